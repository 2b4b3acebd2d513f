/* Rows of a link's c2 and c1 in a block of samples. The same in every package of linkwise. It needs blocks.h and stream.h.

   They are most of what a long chain costs: 6 fused operations for each value. So one row is made at a time, or two where
   there are registers for it, coordinate i's motion in registers and the wrenches read from the first-level cache, for as many
   samples as fill the cache line that the value takes: lines are written whole, one after another, be it past the cache or to
   memory that was fetched meanwhile. */

/* Parts of a block that are worked on together: the motion in both takes 12 of 16 registers. */
enum { TOGETHER = BLOCK_PARTS > 1 ? 2 : 1 };

/* Lines from here to what is fetched to be written: more push others out of the first-level cache. */
enum { SOON = 16 };

/* Whether a block's lanes may go past the cache from here on, and on their way. */
static inline int may_pass(const real *at)
{
#if defined(STREAM)
    return (size_t)at % STREAM_BYTES == 0;
#else
    return (void)at, 0;
#endif
}

INLINE void pass(real *at, lanes value)
{
#if defined(STREAM)
    STREAM((stream_vector *)at, (stream_vector)value);
#else
    PUT(at, value);
#endif
}

/* Row i of c2, from itself on, or of c1. */
INLINE void row_of(const wrenches *w, int second, int i, int length, int past, real *to)
{
    for (int part = 0; part < BLOCK_PARTS; part += TOGETHER) {
        const wrenches *a = &w[part], *b = &w[part + TOGETHER - 1];
        const screw *f = second ? a->c2 : a->c1, *g = second ? b->c2 : b->c1;
        const screw moves_a = a->moves[i], moves_b = b->moves[i];
        real *at = to + part * LANES;
        for (int k = second ? i : 0; k < length; ++k) {
            const lanes x = along(&moves_a, &f[k]), y = along(&moves_b, &g[k]);
            if (past) {
                pass(at, x);
                if (TOGETHER == 2)
                    pass(at + LANES, y);
            } else {
                WRITTEN_SOON(at + SOON * BLOCK);
                PUT(at, x);
                if (TOGETHER == 2)
                    PUT(at + LANES, y);
            }
            at += BLOCK;
        }
    }
}

/* Rows i and i + 1, not past the cache, of a block that is one vector: each wrench is read once for both. */
INLINE void two_rows_of(const wrenches *w, int second, int i, int length, real *to)
{
    const screw *f = second ? w->c2 : w->c1;
    const screw moves = w->moves[i], next = w->moves[i + 1];
    real *at = to, *below = to + (second ? length - i : length) * BLOCK;
    if (second) {
        PUT(at, along(&moves, &f[i]));
        at += BLOCK;
    }
    for (int k = second ? i + 1 : 0; k < length; ++k) {
        const screw wrench = f[k];
        WRITTEN_SOON(at + SOON * BLOCK);
        WRITTEN_SOON(below + SOON * BLOCK);
        PUT(at, along(&moves, &wrench));
        PUT(below, along(&next, &wrench));
        at += BLOCK;
        below += BLOCK;
    }
}

/* All rows. */
INLINE void rows_of(const wrenches *w, int second, int length, int past, real *to)
{
    int i = 0;
    for (; BLOCK_PARTS == 1 && !past && i + 1 < length; i += 2) {
        two_rows_of(w, second, i, length, to);
        to += (second ? 2 * (length - i) - 1 : 2 * length) * BLOCK;
    }
    for (; i < length; ++i) {
        row_of(w, second, i, length, past, to);
        to += (second ? length - i : length) * BLOCK;
    }
}
