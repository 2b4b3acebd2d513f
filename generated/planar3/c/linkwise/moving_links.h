/* Rigid links in motion, and what they answer with to accelerations: sums over the links. The same in every package of
   linkwise.

   C v are velocities v times the c1 of the motion: a link bears f = a' + wd' x c + w' x cd for each unit of its mass and
   N = I wd' - w x E w' (rule.h), where the twist w' is that of v, and the rates a' and wd' are those of its joints' axes,
   which change by the motion. v = qd gives what the velocities ask for. */
#include "elimination.h"
#include "mass.h"

/* A sample: its frames and its links. */
struct sample {
    const struct numbers *x;
    motion m;
    moving_link links[LINKS];
};

/* Where a point of the frame is: the motion has places but for what no joint turns (tree.h), which is added here. */
static inline vector place_in_world(const struct sample *s, int frame, const struct offsets *o, const real *point, const real *q)
{
    vector at = place_of(&s->m, frame, o, point);
    DISPLACED(1, q);
    for (int f = named_frames[frame].frame; f; f = joints[f - 1].parent) {
        const struct joint *const joint = &joints[f - 1];
        if (joint->placed)
            continue;
        at = add(at, turned(s->m.turn[joint->parent], s->x->placings[f - 1].place));
        if (joint->kind == PRISMATIC) {
            const matrix turn = s->m.turn[f];
            const vector z = {turn.x.z, turn.y.z, turn.z.z};
            at = add(at, scale(s->x->placings[f - 1].ratio * moved[MOVED_BY(f - 1)], z));
        }
    }
    return at;
}

static inline void observe(const struct numbers *x, const real *q, const real *qd, struct sample *s)
{
    const real rest[N] = {0};
    s->x = x;
    moved_one(x, q, qd, rest, NULL, &s->m);
    for (int j = 0; j < LINKS; ++j)
        s->links[j] = link_at_one(&s->m, links[j].frame, &x->bodies[j], x->gravity);
}
#define SAMPLE(s) \
    NUMBERS(x_of_##s); \
    struct sample s; \
    observe(x_of_##s, q, qd, &s)

/* M a + C v, and what gravity asks for where it `weighs`. */
static inline void answer(const struct sample *s, const real *acceleration, const real *velocity, int weighs, real *torque)
{
    const motion *const m = &s->m;
    const vector none = m->place[0];
    const screw rest = {none, none};
    screw twist[FRAMES + 1], rate[FRAMES + 1], borne[FRAMES + 1];
    twist[0] = rate[0] = borne[0] = rest;
    if (weighs)
        rate[0].s = s->links[0].weight;
    for (int f = 1; f <= FRAMES; ++f) {
        const int up = joints[f - 1].parent, k = joints[f - 1].coordinate;
        const screw axis = m->axis[f - 1], change = m->change[f - 1];
        twist[f].z = add(twist[up].z, scale(velocity[k], axis.z));
        twist[f].s = add(twist[up].s, scale(velocity[k], axis.s));
        rate[f].z = add(rate[up].z, add(scale(acceleration[k], axis.z), scale(velocity[k], change.z)));
        rate[f].s = add(rate[up].s, add(scale(acceleration[k], axis.s), scale(velocity[k], change.s)));
        borne[f] = rest;
    }
    for (int j = 0; j < LINKS; ++j) {
        const moving_link *const l = &s->links[j];
        const int f = links[j].frame;
        const vector acceleration_of_com = add_cross(add_cross(rate[f].s, rate[f].z, l->com), twist[f].z, l->velocity);
        const vector force = scale(l->mass, acceleration_of_com);
        const vector moment = add_applied(apply(l->inertia, rate[f].z), l->turning, twist[f].z);
        borne[f].z = add_cross(add(borne[f].z, moment), subtract(l->com, m->place[f]), force);
        borne[f].s = add(borne[f].s, force);
    }
    clear(N, torque);
    for (int f = FRAMES; f; --f) {
        const screw axis = own_axis(m, f);
        const int up = joints[f - 1].parent;
        torque[joints[f - 1].coordinate] += along(&axis, &borne[f]);
        borne[up].z = add_cross(add(borne[up].z, borne[f].z), subtract(m->place[f], m->place[up]), borne[f].s);
        borne[up].s = add(borne[up].s, borne[f].s);
    }
}

/* M, of links whose motion is known. */
static inline void natural_inertia(const struct sample *s, real *mass)
{
    composite bodies[FRAMES + 1];
    composites(s->x, &s->m, s->links, bodies);
    masses(&s->m, bodies, mass);
}

/* Weights w (N, LINKS, N) times the links' own, summed over the links, NULL standing for none: w c2 in kept (N, N), beside
   M itself, and w c1 v taken from `torque`. */
static inline void keep(const struct sample *s, const real *inertia, const real *damping, const real *velocity, real *mass,
    real *kept, real *torque)
{
    if (inertia) {
        clear((size_t)N * N, mass);
        clear((size_t)N * N, kept);
    }
    for (int j = 0; j < LINKS; ++j) {
        const short *const joint = path + path_start[j];
        const int length = path_start[j + 1] - path_start[j];
        wrenches w;
        columns_one(&s->m, &s->links[j], columns + path_start[j], length, &w);
        for (int a = 0; a < length; ++a) {
            const screw moves = w.moves[a];
            const size_t i = (size_t)joint[a], row = (i * LINKS + (size_t)j) * N;
            screw felt = {s->m.place[0], s->m.place[0]};
            for (int b = a; inertia && b < length; ++b) {
                const size_t k = (size_t)joint[b];
                const real c2 = along(&moves, &w.c2[b]);
                mass[i * N + k] += c2;
                kept[i * N + k] += inertia[row + k] * c2;
                if (a == b)
                    continue;
                mass[k * N + i] += c2;
                kept[k * N + i] += inertia[(k * LINKS + (size_t)j) * N + i] * c2;
            }
            for (int b = 0; damping && b < length; ++b) {
                const size_t k = (size_t)joint[b];
                const real part = damping[row + k] * velocity[k];
                felt.z = add(felt.z, scale(part, w.c1[b].z));
                felt.s = add(felt.s, scale(part, w.c1[b].s));
            }
            torque[i] -= along(&moves, &felt);
        }
    }
}
