/* Zeros and copies: the C library's memset and memcpy, which not every microcontroller brings, are not called by name;
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

#endif
