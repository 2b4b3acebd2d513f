/* Rows of samples to blocks, and blocks of results to rows. The same in every package of linkwise.

   In rows, the values of a sample lie together; in a block, entry e of its sample b is at e * BLOCK + b. */

/* Rows of `entries` values to a block; the last sample fills it up. */
static void gather(size_t samples, size_t entries, const real *RESTRICT rows, real *RESTRICT block)
{
    for (size_t b = 0; b < BLOCK; ++b) {
        const real *row = rows + (b < samples ? b : samples - 1) * entries;
        for (size_t e = 0; e < entries; ++e)
            block[e * BLOCK + b] = row[e];
    }
}

/* TILE entries of as many samples to rows, in registers where the compiler has vectors: vectors are of a
   size that the processor has. */
#if defined(__AVX512F__) || defined(LINKWISE_FLOAT)
enum { TILE = 8 };
#else
enum { TILE = 4 };
#endif
#if defined(__clang__) || (defined(__GNUC__) && __GNUC__ >= 12)
typedef real tile_row __attribute__((vector_size(TILE * sizeof(real)), aligned(sizeof(real)), may_alias));
#define LOAD(e) *(const tile_row *)(block + e * BLOCK)
#define STORE(e) *(tile_row *)(rows + e * stride)
#if defined(__AVX512F__) || defined(LINKWISE_FLOAT)
/* Three rounds, each of which interleaves vector e with vector e + 4. */
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11)
#define HIGH(a, b) __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15)
#define ROUND(to, a, b, c, d, e, f, g, h) \
    const tile_row to##0 = LOW(a, e), to##1 = HIGH(a, e), to##2 = LOW(b, f), to##3 = HIGH(b, f), \
                   to##4 = LOW(c, g), to##5 = HIGH(c, g), to##6 = LOW(d, h), to##7 = HIGH(d, h)
static inline void tile(const real *RESTRICT block, real *RESTRICT rows, size_t stride)
{
    ROUND(x, LOAD(0), LOAD(1), LOAD(2), LOAD(3), LOAD(4), LOAD(5), LOAD(6), LOAD(7));
    ROUND(y, x0, x1, x2, x3, x4, x5, x6, x7);
    ROUND(z, y0, y1, y2, y3, y4, y5, y6, y7);
    STORE(0) = z0;
    STORE(1) = z1;
    STORE(2) = z2;
    STORE(3) = z3;
    STORE(4) = z4;
    STORE(5) = z5;
    STORE(6) = z6;
    STORE(7) = z7;
}
#undef ROUND
#else
/* Within halves of a vector first, then halves, as AVX does it in one instruction each. */
#define EVEN(a, b) __builtin_shufflevector(a, b, 0, 4, 2, 6)
#define ODD(a, b) __builtin_shufflevector(a, b, 1, 5, 3, 7)
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define HIGH(a, b) __builtin_shufflevector(a, b, 2, 3, 6, 7)
static inline void tile(const real *RESTRICT block, real *RESTRICT rows, size_t stride)
{
    const tile_row x0 = EVEN(LOAD(0), LOAD(1)), x1 = ODD(LOAD(0), LOAD(1));
    const tile_row y0 = EVEN(LOAD(2), LOAD(3)), y1 = ODD(LOAD(2), LOAD(3));
    STORE(0) = LOW(x0, y0);
    STORE(1) = LOW(x1, y1);
    STORE(2) = HIGH(x0, y0);
    STORE(3) = HIGH(x1, y1);
}
#undef EVEN
#undef ODD
#endif
#undef LOW
#undef HIGH
#undef LOAD
#undef STORE
#else
static inline void tile(const real *RESTRICT block, real *RESTRICT rows, size_t stride)
{
    for (size_t b = 0; b < TILE; ++b)
        for (size_t e = 0; e < TILE; ++e)
            rows[b * stride + e] = block[e * BLOCK + b];
}
#endif

/* A block of `entries` values to rows, `stride` apart; the last tile overlaps the one before. */
APART void scatter(size_t samples, size_t entries, size_t stride, const real *RESTRICT block, real *RESTRICT rows)
{
    if (samples == BLOCK && entries >= TILE) {
        for (size_t e = 0; e < entries; e += TILE) {
            const size_t at = e + TILE <= entries ? e : entries - TILE;
            for (size_t b = 0; b < BLOCK; b += TILE)
                tile(block + at * BLOCK + b, rows + b * stride + at, stride);
        }
        return;
    }
    for (size_t b = 0; b < samples; ++b)
        for (size_t e = 0; e < entries; ++e)
            rows[b * stride + e] = block[e * BLOCK + b];
}
