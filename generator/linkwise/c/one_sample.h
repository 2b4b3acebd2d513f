/* The functions of one sample, for a kernel in loops. The same in every package of linkwise. */
#include "one_motion.h"

#include "shares.h"

#include "dense.h"

/* What link j answers with. */
static inline void link_one(const struct numbers *x, int j, const motion *m, real *c2, real *c1, real *g, real *tau)
{
    const int length = path_start[j + 1] - path_start[j];
    const moving_link l = link_at_one(m, links[j].frame, &x->bodies[j], x->gravity);
    wrenches w;
    columns_one(m, &l, columns + path_start[j], length, &w);
    torques_one(&l, &w, length, g, tau);
    for (int i = 0; i < length; i += 2) {
        two_rows_one(&w, i, length, c2, c1);
        c2 += 2 * (length - i) - 1;
        c1 += 2 * length;
    }
}

/* Link j alone: of the others it takes only the joints that move it. */
static inline void alone(int j, INPUTS, real *c2, real *c1, real *g, real *tau)
{
    NUMBERS(x);
    motion m;
    char wanted[FRAMES + 1] = {0};
    for (int f = links[j].frame; f; f = joints[f - 1].parent)
        wanted[f] = 1;
    moved_one(x, q, qd, qdd, wanted, &m);
    link_one(x, j, &m, c2, c1, g, tau);
}

SHARED void API(decomposition_one)(INPUTS, real *c2, real *c1, real *g, real *tau)
{
    NUMBERS(x);
    motion m;
    moved_one(x, q, qd, qdd, NULL, &m);
    for (int j = 0; j < LINKS; ++j)
        link_one(x, j, &m, c2 + links[j].c2, c1 + links[j].c1, g + links[j].g, tau + links[j].g);
}

SHARED void API(torque_one)(INPUTS, real *tau)
{
    NUMBERS(x);
    motion m;
    moved_one(x, q, qd, qdd, NULL, &m);
    for (int j = 0; j < LINKS; ++j) {
        const moving_link l = link_at_one(&m, links[j].frame, &x->bodies[j], x->gravity);
        for (int e = path_start[j]; e < path_start[j + 1]; ++e) {
            const screw *axis = &m.axis[columns[e]], moves = moves_one(&l, axis, arm_one(&l, axis));
            *tau++ = along(&moves, &l.wrench);
        }
    }
}

SHARED void API(dense_one)(INPUTS, const struct dense *to)
{
    NUMBERS(x);
    motion m;
    real c2[LONGEST * (LONGEST + 1) / 2], c1[LONGEST * LONGEST], g[LONGEST], tau[LONGEST], ones[N];
    moved_one(x, q, qd, qdd, NULL, &m);
    for (int k = 0; k < N; ++k)
        ones[k] = 1;
    clear(CUBE, to->acceleration);
    clear(CUBE, to->velocity);
    clear(SQUARE, to->gravity);
    for (int j = 0; j < LINKS; ++j) {
        const size_t at = (size_t)j * N;
        link_one(x, j, &m, c2, c1, g, tau);
        if (to->slopes)
            to_slopes_one(j, j + 1, c1, NULL);
        place_one(j, j + 1, 1, c2, to->torques ? qdd : ones, LINKS, 0, to->acceleration + at);
        place_one(j, j + 1, 0, c1, to->torques ? qd : ones, LINKS, 0, to->velocity + at);
        to_squares_one(j, j + 1, g, 1, to->gravity);
    }
}

#undef W
#undef number
#undef SIZED
#undef TAKE
#undef PUT
