/* Zeros, copies and sums of products. Of the first two the C library's memset and memcpy, which not every microcontroller brings, are not called by name;
   compilers may. The same in every package of linkwise. */
#ifndef LINKWISE_ARRAYS_H
#define LINKWISE_ARRAYS_H

static inline void clear(size_t count, real *to)
{
    for (size_t e = 0; e < count; ++e)
        to[e] = 0;
}

/* The two do not overlap. */
static inline void copy(size_t count, const real *RESTRICT from, real *RESTRICT to)
{
    for (size_t e = 0; e < count; ++e)
        to[e] = from[e];
}

/* a . b: four sums side by side wait less for each other. */
static inline real dot(int count, const real *a, const real *b)
{
    real part[4] = {0, 0, 0, 0};
    int e = 0;
    for (; e + 4 <= count; e += 4)
        for (int k = 0; k < 4; ++k)
            part[k] += a[e + k] * b[e + k];
    for (; e < count; ++e)
        part[0] += a[e] * b[e];
    return (part[0] + part[1]) + (part[2] + part[3]);
}

#endif
