/* Variances of shares, their sums over the links and their products with the motion, where that is uncertain. The same in every
   package of linkwise. It needs regressors.h. Samples are computed in blocks alone. */

#ifndef LINKWISE_SMALL
#include "motion_changes.h"

/* The values of a block. */
static void values_of_block(const struct numbers *x, const real *const *given, const struct shares *here)
{
    ALIGNED motion m[BLOCK_PARTS];
    wrenches w;
    moved_block(x, given[0], given[1], given[2], m);
    for (int j = 0; j < LINKS; ++j) {
        const int length = path_start[j + 1] - path_start[j];
        for (int part = 0; part < BLOCK_PARTS; ++part) {
            const moving_link l = SIZED(link_at)(&m[part], links[j].frame, &x->bodies[j], x->gravity);
            real *c2 = here->c2 + links[j].c2 * BLOCK + part * LANES, *c1 = here->c1 + links[j].c1 * BLOCK + part * LANES;
            SIZED(columns)(&m[part], &l, columns + path_start[j], length, &w);
            for (int i = 0; i < length; ++i) {
                const size_t entry = (size_t)((links[j].g + i) * BLOCK + part * LANES);
                const screw a = w.moves[i];
                PUT(here->g + entry, a.s.x * l.weight.x + a.s.y * l.weight.y + a.s.z * l.weight.z);
                PUT(here->tau + entry, along(&a, &l.wrench));
                for (int k = 0; k < length; ++k, c1 += BLOCK)
                    PUT(c1, along(&a, &w.c1[k]));
                for (int k = i; k < length; ++k, c2 += BLOCK)
                    PUT(c2, along(&a, &w.c2[k]));
            }
        }
    }
}

/* The variance of a product, where its covariance is. */
INLINE void multiply(lanes a, lanes b, lanes va, lanes vb, real *product)
{
    const lanes both = TAKE(product);
    PUT(product, a * a * vb + b * b * va + va * vb + (same(R(2.0)) * a * b + both) * both);
}

/* Products of c2, c1 and tau at these places, of the torque of coordinate i by that of k, from their covariances. */
INLINE void multiply_causes(const real *const *given, const real *variance, int k, int at, const real *c2, const real *c1,
    const real *var_c2, const real *var_c1, real *acceleration, real *velocity)
{
    const int moved = k * BLOCK + at;
    multiply(TAKE(c2), TAKE(given[2] + moved), TAKE(var_c2), TAKE(variance + N * BLOCK + moved), acceleration);
    multiply(TAKE(c1), TAKE(given[1] + moved), TAKE(var_c1), TAKE(variance + moved), velocity);
}

/* All products of link j, whose values are added to the sums over the links. */
static void multiply_link(const real *const *given, const real *variance, int j, const struct varied *to)
{
    const short *const joint = path + path_start[j];
    const int length = path_start[j + 1] - path_start[j];
    for (int i = 0; i < length; ++i)
        for (int at = 0; at < BLOCK; at += LANES) {
            const int row = joint[i] * BLOCK + at, torque = (links[j].g + i) * BLOCK + at;
            increase(to->step.tau + row, TAKE(to->here.tau + torque));
            multiply(TAKE(to->here.tau + torque), TAKE(given[1] + row), TAKE(to->links.tau + torque), TAKE(variance + row),
                to->of_links.power + torque);
            for (int k = 0; k < length; ++k) {
                const int low = i < k ? i : k, high = i < k ? k : i, sum = (joint[i] * N + joint[k]) * BLOCK + at;
                const size_t c2 = (size_t)(links[j].c2 + low * length - low * (low + 1) / 2 + high) * BLOCK + (size_t)at;
                const size_t c1 = (size_t)(links[j].c1 + i * length + k) * BLOCK + (size_t)at;
                increase(to->step.c2 + sum, TAKE(to->here.c2 + c2));
                increase(to->step.c1 + sum, TAKE(to->here.c1 + c1));
                multiply_causes(given, variance, joint[k], at, to->here.c2 + c2, to->here.c1 + c1, to->links.c2 + c2,
                    to->links.c1 + c1, to->of_links.acceleration + c1, to->of_links.velocity + c1);
            }
        }
}

/* All products of a block; `step` holds zeros. */
static void multiply_block(const real *const *given, const real *variance, const struct varied *to)
{
    for (int j = 0; j < LINKS; ++j)
        multiply_link(given, variance, j, to);
    for (int i = 0; i < N; ++i)
        for (int at = 0; at < BLOCK; at += LANES) {
            const int row = i * BLOCK + at;
            PUT(to->of_joints.power + row, TAKE(to->with_motion + N * BLOCK + row));
            multiply(TAKE(to->step.tau + row), TAKE(given[1] + row), TAKE(to->joints.tau + row), TAKE(variance + row),
                to->of_joints.power + row);
            for (int k = 0; k < N; ++k) {
                const int sum = (i * N + k) * BLOCK + at;
                multiply_causes(given, variance, k, at, to->step.c2 + sum, to->step.c1 + sum, to->joints.c2 + sum,
                    to->joints.c1 + sum, to->of_joints.acceleration + sum, to->of_joints.velocity + sum);
            }
        }
}

/* Values of a block in consecutive memory, each of so many entries; returns where they end. */
static inline real *in_room(real *room, size_t c2, size_t c1, size_t g, struct shares *to)
{
    const struct shares there = {room, room + c2 * BLOCK, room + (c2 + c1) * BLOCK, room + (c2 + c1 + g) * BLOCK};
    *to = there;
    return there.tau + g * BLOCK;
}

/* All sums at zero. */
static void begin(real *rest, real *variance, const struct varied *to)
{
    const size_t square = (size_t)N * N;
    clear(4 * (square + N) * BLOCK, rest);
    clear((size_t)2 * N * BLOCK, variance);
    clear((size_t)C2 * BLOCK, to->links.c2);
    clear((size_t)C1 * BLOCK, to->links.c1);
    clear((size_t)G * BLOCK, to->links.g);
    clear((size_t)G * BLOCK, to->links.tau);
    clear((size_t)C1 * BLOCK, to->of_links.acceleration);
    clear((size_t)C1 * BLOCK, to->of_links.velocity);
    clear((size_t)G * BLOCK, to->of_links.power);
    clear(square * BLOCK, to->joints.c2);
    clear(square * BLOCK, to->joints.c1);
    clear((size_t)N * BLOCK, to->joints.g);
    clear((size_t)N * BLOCK, to->joints.tau);
    clear(square * BLOCK, to->of_joints.acceleration);
    clear(square * BLOCK, to->of_joints.velocity);
    clear((size_t)3 * N * BLOCK, to->with_motion);
}

void API(motion_variances_blocks)(size_t blocks, INPUTS, const real *factor, real *c2, real *c1, real *g, real *tau,
    real *acceleration, real *velocity, real *power, real *joint_c2, real *joint_c1, real *joint_g, real *joint_tau,
    real *joint_acceleration, real *joint_velocity, real *joint_power, real *joint_motion, real *room)
{
    if (!blocks)
        return;
    NUMBERS(x);
    const size_t square = (size_t)N * N, row = N, all = C2 + C1 + 2 * G + 4 * (square + row);
    for (size_t s = 0; s < blocks * BLOCK; s += BLOCK) {
        const real *const given[3] = {q + s * N, qd + s * N, qdd + s * N};
        ALIGNED real variance[2 * N * BLOCK];
        const struct shares of_links = {c2 + s * C2, c1 + s * C1, g + s * G, tau + s * G};
        const struct shares of_joints = {joint_c2 + s * square, joint_c1 + s * square, joint_g + s * N, joint_tau + s * N};
        const struct products moved = {acceleration + s * C1, velocity + s * C1, power + s * G};
        const struct products joints_moved = {joint_acceleration + s * square, joint_velocity + s * square, joint_power + s * N};
        struct varied to;
        to.links = of_links;
        to.joints = of_joints;
        to.of_links = moved;
        to.of_joints = joints_moved;
        to.with_motion = joint_motion + s * MOVING;
        real *const rest = in_room(room + s * all, C2, C1, G, &to.here);
        in_room(in_room(rest, square, square, row, &to.step), square, square, row, &to.bend);
        begin(rest, variance, &to);
        values_of_block(x, given, &to.here);
        for (size_t r = 0; r < MOVING; ++r) {
            const real *const by = factor + (s * MOVING + r * BLOCK) * MOVING;
            char moves[N];
            const enum moved most = what_moves(by, moves);
            for (int e = 0; e < 2 * N * BLOCK && most != NOTHING; ++e)
                variance[e] += by[N * BLOCK + e] * by[N * BLOCK + e];
            if (most != NOTHING)
                vary_block(x, given, by, most, moves, &to);
        }
        multiply_block(given, variance, &to);
    }
}
#endif
