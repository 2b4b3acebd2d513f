/* Rows of samples to blocks, and blocks of results to rows. The same in every package of linkwise.

   In rows, the values of a sample lie together; in a block, entry e of its sample b is at e * BLOCK + b. */
#ifndef LINKWISE_ROWS_H
#define LINKWISE_ROWS_H

#ifdef LINKWISE_SMALL
#include "arrays.h"

/* A block of one sample is a row. */
static inline void gather(size_t samples, size_t entries, const real *rows, real *block)
{
    (void)samples;
    copy(entries, rows, block);
}

static inline void scatter(size_t samples, size_t entries, size_t stride, const real *block, real *rows)
{
    (void)samples, (void)stride;
    copy(entries, block, rows);
}
#else

/* Rows of `entries` values to a block; the last sample fills it up. */
static void gather(size_t samples, size_t entries, const real *RESTRICT rows, real *RESTRICT block)
{
    for (size_t b = 0; b < BLOCK; ++b) {
        const real *row = rows + (b < samples ? b : samples - 1) * entries;
        for (size_t e = 0; e < entries; ++e)
            block[e * BLOCK + b] = row[e];
    }
}

/* SIDE entries of as many samples to rows, in registers: vectors that the processor has, as compilers take longer ones
   apart value by value. Each round exchanges corners of all squares of 2, of 4, of 8 values. */
#if (defined(__clang__) || (defined(__GNUC__) && __GNUC__ >= 12)) && defined(__AVX__)
#if defined(LINKWISE_FLOAT) || defined(__AVX512F__)
#define SIDE 8
#define ABOVE_OF_2(a, b) __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14)
#define BELOW_OF_2(a, b) __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15)
#define ABOVE_OF_4(a, b) __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define BELOW_OF_4(a, b) __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#define ABOVE_OF_8(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11)
#define BELOW_OF_8(a, b) __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15)
#else
#define SIDE 4
#define ABOVE_OF_2(a, b) __builtin_shufflevector(a, b, 0, 4, 2, 6)
#define BELOW_OF_2(a, b) __builtin_shufflevector(a, b, 1, 5, 3, 7)
#define ABOVE_OF_4(a, b) __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define BELOW_OF_4(a, b) __builtin_shufflevector(a, b, 2, 3, 6, 7)
#endif
typedef real line __attribute__((vector_size(SIDE * sizeof(real)), aligned(sizeof(real)), may_alias));
#define LOAD(e) const line w##e = *(const line *)(block + e * BLOCK)
#define STORE(e, from) *(line *)(rows + e * stride) = from##e
#define CORNERS(size, to, from, e, f) \
    const line to##e = ABOVE_OF_##size(from##e, from##f), to##f = BELOW_OF_##size(from##e, from##f)
static void tile(const real *RESTRICT block, real *RESTRICT rows, size_t stride)
{
    LOAD(0);
    LOAD(1);
    LOAD(2);
    LOAD(3);
    CORNERS(2, x, w, 0, 1);
    CORNERS(2, x, w, 2, 3);
    CORNERS(4, y, x, 0, 2);
    CORNERS(4, y, x, 1, 3);
#if SIDE == 8
    LOAD(4);
    LOAD(5);
    LOAD(6);
    LOAD(7);
    CORNERS(2, x, w, 4, 5);
    CORNERS(2, x, w, 6, 7);
    CORNERS(4, y, x, 4, 6);
    CORNERS(4, y, x, 5, 7);
    CORNERS(8, z, y, 0, 4);
    CORNERS(8, z, y, 1, 5);
    CORNERS(8, z, y, 2, 6);
    CORNERS(8, z, y, 3, 7);
    STORE(0, z);
    STORE(1, z);
    STORE(2, z);
    STORE(3, z);
    STORE(4, z);
    STORE(5, z);
    STORE(6, z);
    STORE(7, z);
#else
    STORE(0, y);
    STORE(1, y);
    STORE(2, y);
    STORE(3, y);
#endif
}
#undef ABOVE_OF_2
#undef BELOW_OF_2
#undef ABOVE_OF_4
#undef BELOW_OF_4
#undef ABOVE_OF_8
#undef BELOW_OF_8
#undef LOAD
#undef STORE
#undef CORNERS
#else
#define SIDE 8
static void tile(const real *RESTRICT block, real *RESTRICT rows, size_t stride)
{
    for (size_t b = 0; b < SIDE; ++b)
        for (size_t e = 0; e < SIDE; ++e)
            rows[b * stride + e] = block[e * BLOCK + b];
}
#endif

/* A block of `entries` values to rows, `stride` apart; the last tiles overlap those before. */
APART void scatter(size_t samples, size_t entries, size_t stride, const real *RESTRICT block, real *RESTRICT rows)
{
    if (samples == BLOCK && entries >= SIDE) {
        for (size_t e = 0; e < entries; e += SIDE) {
            const size_t at = e + SIDE <= entries ? e : entries - SIDE;
            for (size_t b = 0; b < BLOCK; b += SIDE)
                tile(block + at * BLOCK + b, rows + b * stride + at, stride);
        }
        return;
    }
    for (size_t b = 0; b < samples; ++b)
        for (size_t e = 0; e < entries; ++e)
            rows[b * stride + e] = block[e * BLOCK + b];
}
#endif

#endif
