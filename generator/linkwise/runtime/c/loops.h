/* The functions of a robot whose kernel is in loops. The same in every package of linkwise.

   The file that includes it has the robot's tables: `joints`, `sums` and `links` (see tree.h); `path` and `columns`, which
   from path_start[j] to path_start[j + 1] - 1 have the coordinates that move link j and their columns. It says by INPUTS
   what every function is given, by PASSED how that is handed on, and NUMBERS declares a pointer to the robot's numbers. */

#include "lanes.h"

SHARED void API(decomposition_one)(INPUTS, real *c2, real *c1, real *g, real *tau);
SHARED void API(torque_one)(INPUTS, real *tau);

/* Where results with their zeros go: see dense.h. */
struct dense;
SHARED void API(dense_one)(INPUTS, const struct dense *to);
SHARED void API(dense_torque_one)(INPUTS, int sums, real *torque);

/* No link of rigid bodies has h1. */
#if PART(ONE_SAMPLE) || PART(BLOCKS) || PART(POSITION_GRADIENT)
static const char linear[LINKS] = {0};
#endif

#if PART(ONE_SAMPLE) || PART(BLOCKS) || PART(POSITION_GRADIENT)
/* The angles by which frames turn, of `width` samples; 0 for one that slides. */
static inline void angles(const struct numbers *x, int width, const real *q, real *angle)
{
    for (int f = 0; f < FRAMES; ++f)
        for (int b = 0; b < width; ++b)
            angle[f * width + b]
                = joints[f].kind == REVOLUTE ? x->placings[f].ratio * q[joints[f].coordinate * width + b] : R(0.0);
}
#endif

#if PART(ONE_SAMPLE)
#include "one_sample.h"
#endif

#if PART(BLOCKS) || PART(POSITION_GRADIENT)
#include "rows.h"

#include "blocks.h"
#include "dense.h"
#include "stream.h"
#include "dense_rows.h"
#endif

#if PART(BLOCKS)
#include "shares.h"

/* Consecutive results that wait in the cache. */
enum { ROOM = 4 * LONGEST > 384 ? 4 * LONGEST : 384 };

/* Where the results of a block go: straight to their places; or, where they wait, to rows of `samples` samples, or past
   the cache. c2, c1 and g say which entries of the robot's wait first, the others how many do. */
struct results {
    real *c2_to, *c1_to, *g_to, *tau_to;
    int waits;
    size_t samples;
    int c2, c1, g, c2_count, c1_count, g_count;
    ALIGNED real c2_room[ROOM * BLOCK];
    ALIGNED real c1_room[ROOM * BLOCK];
    ALIGNED real g_room[ROOM * BLOCK];
    ALIGNED real tau_room[ROOM * BLOCK];
};

static void leave(const struct results *r, int count, int every, int first, const real *room, real *to)
{
    if (r->samples)
        scatter(r->samples, (size_t)count, (size_t)every, room, to + first);
    else
        stream((size_t)count * BLOCK, room, to + (size_t)first * BLOCK);
}

/* What waits leaves; nothing does afterwards. */
static void leave_rows(struct results *r)
{
    leave(r, r->c2_count, C2, r->c2, r->c2_room, r->c2_to);
    leave(r, r->c1_count, C1, r->c1, r->c1_room, r->c1_to);
    r->c2 += r->c2_count;
    r->c1 += r->c1_count;
    r->c2_count = r->c1_count = 0;
}

static void leave_torques(struct results *r)
{
    if (r->g_to)
        leave(r, r->g_count, G, r->g, r->g_room, r->g_to);
    leave(r, r->g_count, G, r->g, r->tau_room, r->tau_to);
    r->g += r->g_count;
    r->g_count = 0;
}

/* A block's results of all links. */
static void results_of_block(const struct numbers *x, const motion *m, struct results *r)
{
    ALIGNED wrenches w[BLOCK_PARTS];
    for (int j = 0; j < LINKS; ++j) {
        const struct link *link = &links[j];
        const int length = path_start[j + 1] - path_start[j];
        if (r->g_count + length > ROOM)
            leave_torques(r);
        real *g = r->waits ? r->g_room + r->g_count * BLOCK : r->g_to + (size_t)link->g * BLOCK;
        real *tau = r->waits ? r->tau_room + r->g_count * BLOCK : r->tau_to + (size_t)link->g * BLOCK;
        for (int part = 0; part < BLOCK_PARTS; ++part) {
            const moving_link l = link_at_block(&m[part], link->frame, &x->bodies[j], x->gravity);
            columns_block(&m[part], &l, columns + path_start[j], length, &w[part]);
            torques_block(&l, &w[part], length, g + part * LANES, tau + part * LANES);
        }
        r->g_count += r->waits ? length : 0;
        real *c2 = r->c2_to + (size_t)link->c2 * BLOCK, *c1 = r->c1_to + (size_t)link->c1 * BLOCK;
        for (int i = 0; i < length; i += 2) {
            const int rows = length - i > 1 ? 2 : 1, c2_count = rows * (length - i) - (rows - 1);
            if (r->waits) {
                if (r->c2_count + c2_count > ROOM || r->c1_count + rows * length > ROOM)
                    leave_rows(r);
                c2 = r->c2_room + r->c2_count * BLOCK;
                c1 = r->c1_room + r->c1_count * BLOCK;
                r->c2_count += c2_count;
                r->c1_count += rows * length;
            }
            two_rows_block(&w[0], i, length, 1, c2, c1);
            for (int part = 1; part < BLOCK_PARTS; ++part)
                two_rows_block(&w[part], i, length, 0, c2 + part * LANES, c1 + part * LANES);
            c2 += c2_count * BLOCK;
            c1 += rows * length * BLOCK;
        }
    }
    if (r->waits) {
        leave_rows(r);
        leave_torques(r);
    }
}

/* Results from the robot's first entries on. */
static void begin(struct results *r, int waits, size_t samples, real *c2, real *c1, real *g, real *tau)
{
    r->c2_to = c2;
    r->c1_to = c1;
    r->g_to = g;
    r->tau_to = tau;
    r->waits = waits;
    r->samples = samples;
    r->c2 = r->c1 = r->g = r->c2_count = r->c1_count = r->g_count = 0;
}

void API(decomposition)(size_t count, INPUTS, real *c2, real *c1, real *g, real *tau)
{
    if (count == 1) {
        API(decomposition_one)(PASSED, c2, c1, g, tau);
        return;
    }
    if (!count)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    struct results r;
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        begin(&r, 1, samples, c2 + s * C2, c1 + s * C1, g + s * G, tau + s * G);
        results_of_block(x, m, &r);
    }
}

void API(decomposition_blocks)(size_t blocks, INPUTS, real *c2, real *c1, real *g, real *tau)
{
    if (!blocks)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    struct results r;
    const int large = blocks * BLOCK > LARGE / ((C2 + C1 + 2 * G) * sizeof(real));
    for (size_t s = 0; s < blocks * BLOCK; s += BLOCK) {
        moved_block(x, q + s * N, qd + s * N, qdd + s * N, m);
        begin(&r, large, 0, c2 + s * C2, c1 + s * C1, g + s * G, tau + s * G);
        results_of_block(x, m, &r);
    }
    if (large)
        stream_end();
}

/* tau of link j in a block. */
static void torques_of_link(const struct numbers *x, const motion *m, int j, real *tau)
{
    const int length = path_start[j + 1] - path_start[j];
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        const moving_link l = link_at_block(&m[part], links[j].frame, &x->bodies[j], x->gravity);
        for (int i = 0; i < length; ++i) {
            const screw *axis = &m[part].axis[columns[path_start[j] + i]];
            const screw moves = moves_block(&l, axis, arm_block(&l, axis));
            PUT(tau + i * BLOCK + part * LANES, along(&moves, &l.wrench));
        }
    }
}

/* Torques alone. */
static void torque_rows(size_t count, INPUTS, enum torques kind, real *tau)
{
    if (!count)
        return;
    const size_t rows_of[] = {G, SQUARE, N}, row = rows_of[kind];
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    struct results r;
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        real *const rows = tau + s * row;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        begin(&r, 1, samples, NULL, NULL, NULL, rows);
        if (kind != PACKED)
            memset(rows, 0, samples * row * sizeof(real));
        for (int j = 0; j < LINKS; ++j) {
            const int length = path_start[j + 1] - path_start[j];
            if (r.g_count + length > ROOM)
                leave_torques(&r);
            torques_of_link(x, m, j, r.tau_room + r.g_count * BLOCK);
            if (kind == PACKED)
                r.g_count += length;
            else if (kind == DENSE)
                to_squares_block(j, j + 1, r.tau_room, samples, rows);
            else
                to_sums_block(j, j + 1, r.tau_room, samples, rows);
        }
        leave_torques(&r);
    }
}

/* All results of link j in a block, packed. */
static void results_of_link(const struct numbers *x, const motion *m, int j, real *c2, real *c1, real *g, real *tau)
{
    const int length = path_start[j + 1] - path_start[j];
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        wrenches w;
        const moving_link l = link_at_block(&m[part], links[j].frame, &x->bodies[j], x->gravity);
        real *second = c2 + part * LANES, *first = c1 + part * LANES;
        columns_block(&m[part], &l, columns + path_start[j], length, &w);
        torques_block(&l, &w, length, g + part * LANES, tau + part * LANES);
        for (int i = 0; i < length; i += 2) {
            two_rows_block(&w, i, length, 0, second, first);
            second += (2 * (length - i) - 1) * BLOCK;
            first += 2 * length * BLOCK;
        }
    }
}

static void dense_rows(size_t count, INPUTS, const struct dense *to)
{
    if (count == 1) {
        API(dense_one)(PASSED, to);
        return;
    }
    if (!count)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED real c2[LONGEST * (LONGEST + 1) / 2 * BLOCK], c1[LONGEST * LONGEST * BLOCK];
    ALIGNED real g[LONGEST * BLOCK], tau[LONGEST * BLOCK], velocity[N * BLOCK], acceleration[N * BLOCK];
    struct waiting_cubes wait;
    begin_cubes(&wait, 0, 1);
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        gather(samples, N, qd + s * N, velocity);
        gather(samples, N, qdd + s * N, acceleration);
        memset(to->gravity + s * SQUARE, 0, samples * SQUARE * sizeof(real));
        for (int j = 0; j < LINKS; ++j) {
            results_of_link(x, m, j, c2, c1, g, tau);
            if (to->slopes)
                to_slopes_block(j, j + 1, c1, NULL);
            to_cubes(j, j + 1, 1, c2, to->torques ? acceleration : wait.ones, samples, &wait,
                to->acceleration + s * CUBE);
            to_cubes(j, j + 1, 0, c1, to->torques ? velocity : wait.ones, samples, &wait, to->velocity + s * CUBE);
            to_squares_block(j, j + 1, g, samples, to->gravity + s * SQUARE);
        }
    }
}

#endif

#if PART(POSITION_GRADIENT)
#include "gradient.h"

/* The frames that move link j, from the base on, and which coordinate of its path each follows. */
static int frames_of(int j, short *frames, short *places)
{
    int count = 0, at;
    for (int f = links[j].frame; f; f = joints[f - 1].parent)
        ++count;
    at = count;
    for (int f = links[j].frame; f; f = joints[f - 1].parent) {
        const short *place = path + path_start[j];
        while (*place != joints[f - 1].coordinate)
            ++place;
        frames[--at] = (short)f;
        places[at] = (short)(place - path - path_start[j]);
    }
    return count;
}

/* Packed, or with its zeros. */
static void gradient_rows(size_t count, INPUTS, int dense, real *c0)
{
    if (!count)
        return;
    const size_t row = dense ? (size_t)CUBE : (size_t)C1;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED screw second[BLOCK_PARTS][FRAMES + 1];
    ALIGNED real block[LONGEST * LONGEST * BLOCK];
    short frames[FRAMES], places[FRAMES];
    struct waiting_cubes wait;
    begin_cubes(&wait, 0, 1);
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        for (int part = 0; part < BLOCK_PARTS; ++part)
            second_changes_block(&m[part], x->gravity, second[part]);
        for (int j = 0; j < LINKS; ++j) {
            const int length = path_start[j + 1] - path_start[j], joints_of_j = frames_of(j, frames, places);
            memset(block, 0, (size_t)length * (size_t)length * BLOCK * sizeof(real));
            for (int part = 0; part < BLOCK_PARTS; ++part) {
                const moving_link l = link_at_block(&m[part], links[j].frame, &x->bodies[j], x->gravity);
                gradient_block(&m[part], second[part], &l, joints_of_j, frames, places, length, block + part * LANES);
            }
            if (dense)
                to_cubes(j, j + 1, 0, block, wait.ones, samples, &wait, c0 + s * row);
            else
                scatter(samples, (size_t)(length * length), C1, block, c0 + s * row + links[j].c1);
        }
    }
}
#endif

#include "calls.h"
