/* The mass matrix. The same in every package of linkwise.

   The matrix is that of composite bodies (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.2). What joint f
   carries is one body, with mass m, first moment h and inertia I about the place of frame f, in the base's axes. Moved by
   the joint, (z, 0) for a turn and (0, s) for a slide, it has the momentum
       f = m s + z x h            n = I z + h x s
   about that place, and n + d x f about that of a joint before it, from which d leads here. What the momentum does along
   the axes of joint f and of those before it are the entries of the matrix.

   The file that includes this one says by AT_POSITION what functions are given that take q alone. */
#include "one_motion.h"

#include "arrays.h"

/* m, h and I. */
typedef struct {
    real mass;
    vector first;
    matrix inertia;
} composite;

/* A row of I + (2 h . d + m d . d) 1 - (h d' + d h') - m d d', a body's inertia about a place from which d leads to its own:
   rows of I and of the second summand, and what of h and d is in this row. */
static inline vector inertia_from(vector row, vector second, real h_row, real d_row, const composite *b, vector d)
{
    return subtract(add(row, second), add(scale(h_row + b->mass * d_row, d), scale(d_row, b->first)));
}

/* A body that is part of another, from whose place d leads to its own. */
static inline void join(const composite *b, vector d, composite *whole)
{
    const vector h = b->first;
    const real second = 2 * (h.x * d.x + h.y * d.y + h.z * d.z) + b->mass * (d.x * d.x + d.y * d.y + d.z * d.z);
    const vector x = {second, 0, 0}, y = {0, second, 0}, z = {0, 0, second};
    whole->mass += b->mass;
    whole->first = add(whole->first, add(h, scale(b->mass, d)));
    whole->inertia.x = add(whole->inertia.x, inertia_from(b->inertia.x, x, h.x, d.x, b, d));
    whole->inertia.y = add(whole->inertia.y, inertia_from(b->inertia.y, y, h.y, d.y, b, d));
    whole->inertia.z = add(whole->inertia.z, inertia_from(b->inertia.z, z, h.z, d.z, b, d));
}

/* What each joint carries, by its frame; inertias are those of `moving` links, or found from the turns where it is NULL. */
static inline void composites(const struct numbers *x, const motion *m, const moving_link *moving, composite *bodies)
{
    const vector none = m->place[0];
    const composite nothing = {0, none, {none, none, none}};
    for (int f = 0; f <= FRAMES; ++f)
        bodies[f] = nothing;
    for (int j = 0; j < LINKS; ++j) {
        const int f = links[j].frame;
        const struct body *const b = &x->bodies[j];
        const matrix turn = m->turn[f];
        composite link = {b->mass, none, {none, none, none}};
        if (moving) {
            link.inertia = moving[j].inertia;
        } else {
            link.inertia.x = inertia_row_one(turn, turn.x, b->inertia);
            link.inertia.y = inertia_row_one(turn, turn.y, b->inertia);
            link.inertia.z = inertia_row_one(turn, turn.z, b->inertia);
        }
        join(&link, turned(turn, b->com), &bodies[f]);
    }
    for (int f = FRAMES; f > 0; --f) {
        const int up = joints[f - 1].parent;
        if (up)
            join(&bodies[f], subtract(m->place[f], m->place[up]), &bodies[up]);
    }
}

/* A joint's axis about its own place. */
static inline screw own_axis(const motion *m, int f)
{
    const screw axis = {m->axis[f - 1].z, joints[f - 1].kind == PRISMATIC ? m->axis[f - 1].s : m->place[0]};
    return axis;
}

/* M; joints that follow one coordinate add up. */
static inline void masses(const motion *m, const composite *bodies, real *mass)
{
    clear((size_t)N * N, mass);
    for (int f = 1; f <= FRAMES; ++f) {
        const screw axis = own_axis(m, f);
        const composite *const b = &bodies[f];
        const int k = joints[f - 1].coordinate;
        screw momentum = {add_cross(apply(b->inertia, axis.z), b->first, axis.s),
            add_cross(scale(b->mass, axis.s), axis.z, b->first)};
        for (int at = f; at;) {
            const screw other = own_axis(m, at);
            const int i = joints[at - 1].coordinate, up = joints[at - 1].parent;
            const real entry = along(&other, &momentum);
            mass[i * N + k] += entry;
            if (at != f)
                mass[k * N + i] += entry;
            if (up)
                momentum.z = add_cross(momentum.z, subtract(m->place[at], m->place[up]), momentum.s);
            at = up;
        }
    }
}

#if PART(CONTROL)
void API(mass_matrix)(AT_POSITION, real *mass)
{
    NUMBERS(x);
    const real rest[N] = {0};
    motion m;
    composite bodies[FRAMES + 1];
    moved_one(x, q, rest, rest, NULL, &m);
    composites(x, &m, NULL, bodies);
    masses(&m, bodies, mass);
}
#endif
