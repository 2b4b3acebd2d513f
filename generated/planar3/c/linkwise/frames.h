/* Frames that have names: where they are, and how they move with the joints. The same in every package of linkwise.

   They are those of the table `named_frames` (tree.h). The file that includes this one says by AT_POSITION what functions
   are given that take q alone, by AT_REST those that take q and qd, and OFFSETS declares a pointer to where frames stand.
   With the axes S = (z, s) of rule.h, their changes (zd, sd), and the twist (w, v) of what carries the frame, a point of it
   at x moves at
       xd = v + w x x
   and coordinate k moves it by the columns
       J of k:      (z, s + z x x)
       dJ/dt of k:  (zd, sd + zd x x + z x xd) */
#include "one_motion.h"

#include "arrays.h"

#if PART(CONTROL)
/* The frame's matrix is that in its joint's frame, taken to the parent's, and so on to the base. */
void API(pose)(int frame, AT_POSITION, real *pose)
{
    NUMBERS(x);
    OFFSETS(o);
    DISPLACED(1, q);
    const struct named_frame *const named = &named_frames[frame];
    real t[3][4];
    for (int r = 0; r < 3; ++r) {
        copy(3, named->turn + 3 * r, t[r]);
        t[r][3] = o->place[frame][r];
    }
    for (int f = named->frame; f; f = joints[f - 1].parent) {
        const struct placing *const here = &x->placings[f - 1];
        const int turns = joints[f - 1].kind == REVOLUTE;
        const real by = here->ratio * moved[MOVED_BY(f - 1)];
        const real sine = turns ? F(sin)(by) : R(0.0), cosine = turns ? F(cos)(by) : R(1.0);
        t[2][3] += turns ? R(0.0) : by;
        for (int c = 0; c < 4; ++c) {
            const real a = cosine * t[0][c] - sine * t[1][c], b = sine * t[0][c] + cosine * t[1][c], z = t[2][c];
            for (int r = 0; r < 3; ++r)
                t[r][c] = here->turn[3 * r] * a + here->turn[3 * r + 1] * b + here->turn[3 * r + 2] * z;
        }
        for (int r = 0; r < 3; ++r)
            t[r][3] += here->place[r];
    }
    for (int r = 0; r < 3; ++r)
        copy(4, t[r], pose + 4 * r);
    pose[12] = pose[13] = pose[14] = 0;
    pose[15] = 1;
}
#endif

/* The motion of what carries frame f, without accelerations. */
static inline void carriers_moved(const struct numbers *x, int f, const real *q, const real *qd, motion *m)
{
    const real rest[N] = {0};
    char wanted[FRAMES + 1] = {0};
    for (; f; f = joints[f - 1].parent)
        wanted[f] = 1;
    moved_one(x, q, qd, rest, wanted, m);
}

/* Where a point of a named frame is, given in its axes; NULL is its origin. */
static inline vector place_of(const motion *m, int frame, const struct offsets *o, const real *point)
{
    const struct named_frame *const named = &named_frames[frame];
    const real *const turn = named->turn;
    real at[3];
    for (int r = 0; r < 3; ++r) {
        at[r] = o->place[frame][r];
        if (point)
            at[r] += turn[3 * r] * point[0] + turn[3 * r + 1] * point[1] + turn[3 * r + 2] * point[2];
    }
    return add(m->place[named->frame], turned(m->turn[named->frame], at));
}

/* A joint's part in the column of its coordinate. */
static inline void add_column(int k, vector z, vector s, real *rows)
{
    const real column[6] = {z.x, z.y, z.z, s.x, s.y, s.z};
    for (int r = 0; r < 6; ++r)
        rows[r * N + k] += column[r];
}

/* Rows of the Jacobian of a point `at` that frame f carries, and of how it changes. */
static inline void jacobian_rows(const motion *m, int f, vector at, real *rows)
{
    clear(6 * N, rows);
    for (; f; f = joints[f - 1].parent) {
        const screw axis = m->axis[f - 1];
        add_column(joints[f - 1].coordinate, axis.z, add_cross(axis.s, axis.z, at), rows);
    }
}

static inline void rate_rows(const motion *m, int f, vector at, real *rows)
{
    const vector velocity = add_cross(m->twist[f].s, m->twist[f].z, at);
    clear(6 * N, rows);
    for (; f; f = joints[f - 1].parent) {
        const screw axis = m->axis[f - 1], change = m->change[f - 1];
        const vector moved = add_cross(add_cross(change.s, change.z, at), axis.z, velocity);
        add_column(joints[f - 1].coordinate, change.z, moved, rows);
    }
}

#if PART(CONTROL)
void API(jacobian)(int frame, const real *point, AT_POSITION, real *jacobian)
{
    NUMBERS(x);
    OFFSETS(o);
    const real rest[N] = {0};
    const int carrier = named_frames[frame].frame;
    motion m;
    carriers_moved(x, carrier, q, rest, &m);
    jacobian_rows(&m, carrier, place_of(&m, frame, o, point), jacobian);
}

void API(jacobian_rate)(int frame, const real *point, AT_REST, real *rate)
{
    NUMBERS(x);
    OFFSETS(o);
    const int carrier = named_frames[frame].frame;
    motion m;
    carriers_moved(x, carrier, q, qd, &m);
    rate_rows(&m, carrier, place_of(&m, frame, o, point), rate);
}
#endif
