/* What joints carry of each link, by cause: its wrenches before an axis projects them. The same in every package of linkwise.

   For each coordinate k of a link's path the link needs the wrenches (N, f) of rule.h, for each unit of qdd_k and of qd_k, and
   one against its weight. There f is that of a unit of mass and N about the centre of mass c; here they are
       f = m f        N = N + (c - p) x f
   about the origin p of the joint that moves the link. About that of a joint before it, at p', it is N + (p - p') x f. */

#include "blocks.h"
#include "stream.h"

enum { WRENCH = 6 };

#include "link_wrenches.h"

/* Results that wait in a block: a whole row where it is short, which may then go past the cache, or as many links as there is
   room for. */
enum {
    ROW = G * WRENCH,
    WEIGHTS = LINKS * WRENCH,
    WHOLE_ROW = BLOCK > 1 && ROW <= 512,
    WAITING_ROOM = WHOLE_ROW ? ROW : WRENCH * LONGEST * (BLOCK > 1 ? 2 : 1)
};

/* Rows, a block at a time; for any qdd, as nothing depends on it. */
static void reactions_of_rows(size_t count, INPUTS, real *acceleration, real *velocity, real *gravity)
{
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED real c2[WAITING_ROOM * BLOCK], c1[WAITING_ROOM * BLOCK], g[WEIGHTS * BLOCK];
    ALIGNED real scratch[WHOLE_ROW ? (ROW > WEIGHTS ? ROW : WEIGHTS) * BLOCK : 1];
    const int large = WHOLE_ROW && past_cache(count, 2 * ROW + WEIGHTS);
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        size_t first = 0, waiting = 0;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        for (int j = 0; j < LINKS; ++j) {
            const size_t at = waiting * BLOCK;
            for (int part = 0; part < BLOCK_PARTS; ++part)
                SIZED(link_wrenches)(x, &m[part], j, c2 + at + part * LANES, c1 + at + part * LANES,
                    g + j * WRENCH * BLOCK + part * LANES);
            waiting += (size_t)((path_start[j + 1] - path_start[j]) * WRENCH);
            if (WHOLE_ROW)
                continue;
            if (j + 1 < LINKS && waiting + (size_t)((path_start[j + 2] - path_start[j + 1]) * WRENCH) <= WAITING_ROOM)
                continue;
            scatter(samples, waiting, ROW, c2, acceleration + s * ROW + first);
            scatter(samples, waiting, ROW, c1, velocity + s * ROW + first);
            first += waiting;
            waiting = 0;
        }
        if (WHOLE_ROW) {
            put_rows(samples, ROW, large, c2, acceleration + s * ROW, scratch);
            put_rows(samples, ROW, large, c1, velocity + s * ROW, scratch);
        }
        put_rows(samples, WEIGHTS, large, g, gravity + s * WEIGHTS, scratch);
    }
    if (large)
        stream_end();
}

#ifndef LINKWISE_SMALL
#include "one_motion.h"

#include "link_wrenches.h"
#endif

void API(reactions)(size_t count, AT_REST, real *acceleration, real *velocity, real *gravity)
{
    if (count != 1) {
        reactions_of_rows(count, PASSED_AT_REST, acceleration, velocity, gravity);
        return;
    }
    NUMBERS(x);
    motion m;
    moved_one(x, q, qd, qd, NULL, &m);
    for (int j = 0; j < LINKS; ++j) {
        const size_t first = (size_t)(path_start[j] * WRENCH);
        link_wrenches_one(x, &m, j, acceleration + first, velocity + first, gravity + (size_t)(j * WRENCH));
    }
}
