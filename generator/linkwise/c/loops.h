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
SHARED void API(dense_torque_one)(INPUTS, int summed, real *torque);

/* No link of rigid bodies has h1. */
#if PART(ONE_SAMPLE) || PART(BLOCKS) || PART(POSITION_GRADIENT)
static const char nonquadratic[LINKS] = {0};
#endif

#if PART(ONE_SAMPLE)
#include "one_sample.h"
#endif

#ifdef LINKWISE_SMALL
#include "one_by_one.h"
#include "blocks.h"
#include "small_cubes.h"
#elif PART(BLOCKS) || PART(POSITION_GRADIENT)
#include "blocks.h"

#include "dense.h"
#include "stream.h"
#include "dense_rows.h"
#endif

#if PART(BLOCKS) && !defined(LINKWISE_SMALL)
#include "shares.h"
#include "block_rows.h"
#include "packed_rows.h"

/* How link j moves in a block, what its coordinates ask of it, and its g and tau. */
static void wrenches_of_link(const struct numbers *x, const motion *m, int j, wrenches *w, real *g, real *tau)
{
    const int length = path_start[j + 1] - path_start[j];
    for (int i = 0; i < length; ++i) {
        WRITTEN_SOON(g + i * BLOCK);
        WRITTEN_SOON(tau + i * BLOCK);
    }
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        const moving_link l = link_at_block(&m[part], links[j].frame, &x->bodies[j], x->gravity);
        columns_block(&m[part], &l, columns + path_start[j], length, &w[part]);
        torques_block(&l, &w[part], length, g + part * LANES, tau + part * LANES);
    }
}

/* All results of link j in a block, packed; c2 and c1 past the cache where they are `large`. */
static void results_of_link(const struct numbers *x, const motion *m, int j, int large, real *c2, real *c1, real *g, real *tau)
{
    ALIGNED wrenches w[BLOCK_PARTS];
    const int length = path_start[j + 1] - path_start[j];
    wrenches_of_link(x, m, j, w, g, tau);
    if (large) {
        rows_of(w, 1, length, 1, c2);
        rows_of(w, 0, length, 1, c1);
    } else {
        rows_of(w, 1, length, 0, c2);
        rows_of(w, 0, length, 0, c1);
    }
}

void API(decomposition_blocks)(size_t blocks, INPUTS, real *c2, real *c1, real *g, real *tau)
{
    if (!blocks)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    const int large = past_cache(blocks * BLOCK, C2 + C1 + 2 * G) && may_pass(c2) && may_pass(c1);
    for (size_t s = 0; s < blocks * BLOCK; s += BLOCK) {
        moved_block(x, q + s * N, qd + s * N, qdd + s * N, m);
        for (int j = 0; j < LINKS; ++j) {
            const size_t at_c2 = s * C2 + (size_t)links[j].c2 * BLOCK, at_c1 = s * C1 + (size_t)links[j].c1 * BLOCK;
            const size_t at_g = s * G + (size_t)links[j].g * BLOCK;
            results_of_link(x, m, j, large, c2 + at_c2, c1 + at_c1, g + at_g, tau + at_g);
        }
    }
    if (large)
        stream_end();
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
    ALIGNED wrenches w[BLOCK_PARTS];
    struct waiting all_c2, all_c1, all_g, all_tau;
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        begin_waiting(&all_c2, samples, C2, c2 + s * C2);
        begin_waiting(&all_c1, samples, C1, c1 + s * C1);
        begin_waiting(&all_g, samples, G, g + s * G);
        begin_waiting(&all_tau, samples, G, tau + s * G);
        for (int j = 0; j < LINKS; ++j) {
            const int length = path_start[j + 1] - path_start[j];
            wrenches_of_link(x, m, j, w, room_for(&all_g, length), room_for(&all_tau, length));
            for (int i = 0; i < length; ++i)
                row_of(w, 1, i, length, 0, room_for(&all_c2, length - i));
            for (int i = 0; i < length; ++i)
                row_of(w, 0, i, length, 0, room_for(&all_c1, length));
        }
        leave(&all_c2);
        leave(&all_c1);
        leave(&all_g);
        leave(&all_tau);
    }
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
    struct waiting packed;
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        real *const rows = tau + s * row;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        begin_waiting(&packed, samples, G, rows);
        if (kind != PACKED)
            clear(samples * row, rows);
        for (int j = 0; j < LINKS; ++j) {
            const int length = path_start[j + 1] - path_start[j];
            if (kind == PACKED) {
                torques_of_link(x, m, j, room_for(&packed, length));
                continue;
            }
            torques_of_link(x, m, j, packed.room);
            if (kind == DENSE)
                to_squares_block(j, j + 1, packed.room, samples, rows);
            else
                to_sums_block(j, j + 1, packed.room, samples, rows);
        }
        leave(&packed);
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
        clear(samples * SQUARE, to->gravity + s * SQUARE);
        for (int j = 0; j < LINKS; ++j) {
            results_of_link(x, m, j, 0, c2, c1, g, tau);
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
            SIZED(second_changes)(&m[part], x->gravity, second[part]);
        for (int j = 0; j < LINKS; ++j) {
            const int length = path_start[j + 1] - path_start[j], joints_of_j = frames_of(j, frames, places);
            clear((size_t)length * (size_t)length * BLOCK, block);
            for (int part = 0; part < BLOCK_PARTS; ++part) {
                const moving_link l = SIZED(link_at)(&m[part], links[j].frame, &x->bodies[j], x->gravity);
                SIZED(gradient)(&m[part], second[part], &l, joints_of_j, frames, places, length, block + part * LANES);
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

#if PART(REGRESSORS)
#include "regressors.h"
#include "motion_variances.h"
#ifndef TIED
#include "reactions.h"
#endif
#endif

#if PART(CONTROL) || CONSTRAINED
#include "frames.h"
#include "moving_links.h"
#include "passive.h"
#include "equations.h"
#endif
