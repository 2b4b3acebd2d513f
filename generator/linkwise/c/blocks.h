/* Blocks of samples for what goes in loops over links and joints, and their motion. The same in every package of linkwise. */
#ifndef LINKWISE_BLOCKS_H
#define LINKWISE_BLOCKS_H

#include "curves.h"
#include "lanes.h"
#include "rows.h"

#ifdef LINKWISE_SMALL
#include "one_motion.h"

enum { BLOCK_PARTS = 1 };

/* A row is a block, and its motion that of one sample. */
static inline void rows_moved(const struct numbers *x, size_t samples, const real *q, const real *qd, const real *qdd,
    motion *m)
{
    (void)samples;
    moved_one(x, q, qd, qdd, NULL, m);
}
#else

#define W BLOCK
#define number lanes
#define SIZED(name) name##_block
#define TAKE(at) LANES_FROM(at)
#define PUT(at, value) (LANES_AT(at) = (value))
#include "vectors.h"

#include "rule.h"

/* A block is worked on in so many parts, each of LANES samples. */
enum { BLOCK_PARTS = BLOCK / LANES };

/* The motion of a block, of W samples, part by part. */
static inline void moved_block(const struct numbers *x, const real *q, const real *qd, const real *qdd, motion *m)
{
    ALIGNED real angle[FRAMES * BLOCK], sine[FRAMES * BLOCK], cosine[FRAMES * BLOCK];
    DISPLACED(BLOCK, q);
    angles(x, BLOCK, moved, angle);
    API(sines)(FRAMES * BLOCK, angle, sine, cosine);
    for (int part = 0; part < BLOCK_PARTS; ++part)
        base_block(&m[part]);
    for (int f = 1; f <= FRAMES; ++f)
        for (int part = 0; part < BLOCK_PARTS; ++part) {
            const int turn = (f - 1) * BLOCK + part * LANES, k = joints[f - 1].coordinate * BLOCK + part * LANES;
            frame_block(&m[part], f, &x->placings[f - 1], TAKE(sine + turn), TAKE(cosine + turn),
                moved + MOVED_BY(f - 1) * BLOCK + part * LANES, FRAMES * BLOCK, TAKE(qd + k), TAKE(qdd + k));
        }
    for (int part = 0; part < BLOCK_PARTS; ++part)
        sum_columns_block(&m[part], NULL);
}

/* Up to BLOCK rows to a block, and its motion. */
static inline void rows_moved(const struct numbers *x, size_t samples, const real *q, const real *qd, const real *qdd,
    motion *m)
{
    ALIGNED real block[3][N * BLOCK];
    gather(samples, N, q, block[0]);
    gather(samples, N, qd, block[1]);
    gather(samples, N, qdd, block[2]);
    moved_block(x, block[0], block[1], block[2], m);
}
#endif

#endif
