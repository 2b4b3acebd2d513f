/* What is wanted of a frame, and the accelerations of joints that give it. The same in every package of linkwise.

   With r rows of the frame's Jacobian J, its velocity nu = J qd, and H, C, f as for joints,
       L = (J H^-1 J')^-1      X = H^-1 J'      F = L X' f      mu = L (X' C - dJ/dt) X L
   are the inertia that the frame shows there, the force on it, and what its inertia asks for by the motion: dL/dt - 2 mu is
   skew. Wanted is
       M_e (nud - nud_d) + B_e (nu - nu_d) + E' K_e x = F          M_e = a2 L + m_e        B_e = a1 mu + b_e
   with x = (rotation vector, place) from the target, both in the world's axes, and E, that takes turning velocities to rates
   of the rotation vector. Of all accelerations that give this nud, the torques are those of the closest one, in the sense of
   H, to the joints' own qdd_0 (O. Khatib, A unified approach for motion and force control of robot manipulators, 1987):
       qdd = qdd_0 + X L (nud - dJ/dt qd - J qdd_0)                tau = H qdd + C qd + g + p - f

   Under ties J G stands in the place of J and G' H G in that of H, X is G (G' H G)^-1 G' J', and beside C v stands
   H e, beside dJ/dt v stands J e, where v = G y are velocities and e = dG/dt y. */
#ifndef LINKWISE_FRAME_AIM_H
#define LINKWISE_FRAME_AIM_H

#include "frame_rotation.h"

/* How a frame moves with the joints: J and dJ/dt by the rows that count, X, and L. To six, rows of zeros follow, and in L
   those of the identity: they have no part in anything. */
struct frame_motion {
    real jacobian[6 * N], rate[6 * N], moved[6 * N], inertia[36];
};

/* a x of a matrix (rows, length), and a' y. */
INLINE void times(int rows, int length, const real *a, const real *x, real *product)
{
    for (int r = 0; r < rows; ++r) {
        real sum = 0;
        for (int k = 0; k < length; ++k)
            sum += a[r * length + k] * x[k];
        product[r] = sum;
    }
}

INLINE void transposed_times(int rows, int length, const real *a, const real *y, real *product)
{
    real sum[LARGEST] = {0};
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < length; ++k)
            sum[k] += a[r * length + k] * y[r];
    copy((size_t)length, sum, product);
}

/* All rows of J (6, N), and those that count with dJ/dt. */
static inline void frame_rows(const struct sample *s, const API(frame_impedance) * wanted, vector at, real *every,
    struct frame_motion *out)
{
    const int carrier = named_frames[wanted->frame].frame;
    real rate[6 * N];
    jacobian_rows(&s->m, carrier, at, every);
    rate_rows(&s->m, carrier, at, rate);
    clear(6 * N, out->jacobian);
    clear(6 * N, out->rate);
    for (int r = 0; r < wanted->rows; ++r) {
        copy(N, every + wanted->row[r] * N, out->jacobian + r * N);
        copy(N, rate + wanted->row[r] * N, out->rate + r * N);
    }
}

/* X (n, 6) and L of a frame with rows `every` (6, n), of coordinates of inertia `mass` (n, n). Returns 0, the coordinate at which
   this is not positive, or - the row along which the frame cannot move, both from 1. Whether it moves at all along rows of turns is
   judged by all of them together, and so of places: by how far coordinates would move the frame, were they alone. `joint` and
   `row`, given as {0, 1}, say how well that is known. */
static inline int show_inertia(int n, const API(frame_impedance) * wanted, vector at, const real *every, const real *mass,
    real *moved, real *inertia, struct pivot *joint, struct pivot *row)
{
    real chosen[6 * N] = {0}, mobility[36] = {0}, size[LARGEST], reach[2] = {0, 0};
    const real distance = at.x * at.x + at.y * at.y + at.z * at.z;
    for (int k = 0; k < n; ++k) {
        real turn = 0, move = 0;
        for (int r = 0; r < 3; ++r) {
            turn += every[r * n + k] * every[r * n + k];
            move += every[(3 + r) * n + k] * every[(3 + r) * n + k];
        }
        size[k] = mass[k * n + k];
        reach[0] += turn / size[k];
        reach[1] += (move + turn * distance) / size[k];
    }
    clear(36, inertia);
    for (int r = 0; r < wanted->rows; ++r)
        copy((size_t)n, every + wanted->row[r] * n, chosen + r * n);
    for (int k = 0; k < n; ++k)
        for (int r = 0; r < 6; ++r)
            moved[k * 6 + r] = chosen[r * n + k];
    int fault = eliminate(0, n, 6, size, mass, moved, joint);
    if (fault)
        return fault;
    for (int r = 0; r < 6; ++r) {
        inertia[r * 6 + r] = 1;
        transposed_times(n, 6, moved, chosen + r * n, mobility + r * 6);
        if (r >= wanted->rows)
            mobility[r * 6 + r] = 1;
        size[r] = mobility[r * 6 + r];
        if (r < wanted->rows && !(size[r] > ROUNDING(6) * reach[wanted->row[r] >= 3]))
            return -1 - r;
    }
    fault = eliminate(0, 6, 6, size, mobility, inertia, row);
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k < r; ++k)
            inertia[r * 6 + k] = inertia[k * 6 + r];
    return -fault;
}

/* nud - nud_d, which M_e is to have, from - B_e (nu - nu_d) - E' K_e x + F; returns 0, -7, or - the row, from 1, at which M_e
   is not positive. `weakest`, given as {0, 1}, says how well it is known where M_e is more than a share of L. `bend` (N, N), or NULL for none, takes velocities v to e, of joints of inertia `mass`. */
static inline int frame_acceleration(const struct sample *s, const API(frame_impedance) * wanted, const real *target, vector at,
    const struct frame_motion *frame, const real *velocity, const real *external, const real *bend, const real *mass, real *out,
    struct pivot *weakest)
{
    const int rows = wanted->rows;
    const real still[N] = {0};
    real natural[36], inertia[36], force[6], share[6] = {0};
    clear(6, out);
    resist(rows, wanted->damping, velocity, out);
    if (wanted->stiffness && pull(s, wanted, target, at, out))
        return -7;
    if (wanted->keep_velocity != 0) {
        real moment[6], change[6], joint[N], torque[N];
        times(6, 6, frame->inertia, velocity, moment);
        times(N, 6, frame->moved, moment, joint);
        answer(s, still, joint, 0, torque);
        times(6, N, frame->rate, joint, change);
        if (bend) {
            real turned_by[N];
            times(N, N, bend, joint, turned_by);
            for (int i = 0; i < N; ++i)
                torque[i] += dot(N, mass + i * N, turned_by);
            for (int r = 0; r < rows; ++r)
                change[r] += dot(N, frame->jacobian + r * N, turned_by);
        }
        transposed_times(N, 6, frame->moved, torque, force);
        for (int r = 0; r < 6; ++r)
            share[r] = wanted->keep_velocity * (change[r] - force[r]);
    }
    if (external) {
        transposed_times(N, 6, frame->moved, external, force);
        for (int r = 0; r < 6; ++r)
            share[r] += force[r];
    }
    times(6, 6, frame->inertia, share, force);
    for (int r = 0; r < 6; ++r) {
        out[r] += force[r];
        for (int k = 0; k < 6; ++k)
            natural[r * 6 + k] = r < rows && k < rows ? wanted->keep_inertia * frame->inertia[r * 6 + k] : r == k;
    }
    copy(36, natural, inertia);
    for (int r = 0; wanted->inertia && r < rows; ++r)
        for (int k = 0; k < rows; ++k)
            inertia[r * 6 + k] += wanted->inertia[r * rows + k];
    return -solve(0, 6, natural, inertia, out, wanted->inertia ? weakest : NULL);
}

/* What is asked of a frame. */
struct frame_target {
    const API(frame_impedance) * wanted;
    const real *pose, *velocity, *acceleration;
};

/* Turns the joints' accelerations into the closest ones with which the frame moves as asked; returns what `frame_acceleration` does. */
static inline int aim(const struct sample *s, const struct frame_target *target, const struct offsets *o, const real *q,
    const real *qd, const struct frame_motion *frame, const real *external, const real *bend, const real *mass, real *qdd,
    struct pivot *weakest)
{
    const API(frame_impedance) *const wanted = target->wanted;
    real velocity[6], asked[6], change[6], reached[6], force[N];
    times(6, N, frame->jacobian, qd, velocity);
    for (int r = 0; target->velocity && r < wanted->rows; ++r)
        velocity[r] -= target->velocity[wanted->row[r]];
    const vector there = place_in_world(s, wanted->frame, o, wanted->point, q);
    const int fault = frame_acceleration(s, wanted, target->pose, there, frame, velocity, external, bend, mass, asked, weakest);
    if (fault)
        return fault;
    for (int r = 0; target->acceleration && r < wanted->rows; ++r)
        asked[r] += target->acceleration[wanted->row[r]];
    times(6, N, frame->rate, qd, change);
    times(6, N, frame->jacobian, qdd, reached);
    for (int r = 0; r < 6; ++r)
        asked[r] -= change[r] + reached[r];
    times(6, 6, frame->inertia, asked, change);
    times(N, 6, frame->moved, change, force);
    join_force(force, qdd);
    return 0;
}

#endif
