/* The motion of one sample, for what goes in loops over links and joints. The same in every package of linkwise.

   Wherever it is included, functions and types of SIZED are those of one sample from there on. */
#undef W
#undef number
#undef SIZED
#undef TAKE
#undef PUT
#define W 1
#define number real
#define SIZED(name) name##_one
#define TAKE(at) (*(at))
#define PUT(at, value) (*(at) = (value))

#ifndef LINKWISE_ONE_MOTION_H
#define LINKWISE_ONE_MOTION_H

#include "curves.h"
#include "lanes.h"
#include "vectors.h"

#include "rule.h"

/* The motion of all frames, or of the `wanted` ones. */
static inline void moved_one(const struct numbers *x, const real *q, const real *qd, const real *qdd, const char *wanted,
    motion *m)
{
    real angle[FRAMES], sine[FRAMES], cosine[FRAMES];
    DISPLACED(1, q);
    angles(x, 1, moved, angle);
    API(sines)(FRAMES, angle, sine, cosine);
    base_one(m);
    for (int f = 1; f <= FRAMES; ++f) {
        const int k = joints[f - 1].coordinate;
        if (!wanted || wanted[f])
            frame_one(m, f, &x->placings[f - 1], sine[f - 1], cosine[f - 1], moved + MOVED_BY(f - 1), FRAMES, qd[k],
                qdd[k]);
    }
    sum_columns_one(m, wanted);
}

#endif
