/* Partial impedance of a frame, which has precedence over that of the joints. The same in every package of linkwise.

   With r rows of the frame's Jacobian J, its velocity nu = J qd, and H, C, f as for joints,
       L = (J H^-1 J')^-1      X = H^-1 J'      F = L X' f      mu = L (X' C - dJ/dt) X L
   are the inertia that the frame shows there, the force on it, and what its inertia asks for by the motion: dL/dt - 2 mu is
   skew. Wanted is
       M_e (nud - nud_d) + B_e (nu - nu_d) + E' K_e x = F          M_e = a2 L + m_e        B_e = a1 mu + b_e
   with x = (rotation vector, place) from the target, both in the world's axes, and E, that takes turning velocities to rates
   of the rotation vector. Of all accelerations that give this nud, the torques are those of the closest one, in the sense of
   H, to the joints' own qdd_0 (O. Khatib, A unified approach for motion and force control of robot manipulators, 1987):
       qdd = qdd_0 + X L (nud - dJ/dt qd - J qdd_0)                tau = H qdd + C qd + g + p - f */
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

/* Returns 0, the joint at which H is not positive, or - the row along which the frame cannot move, both from 1. Whether it
   moves at all along rows of turns is judged by all of them together, and so of places: by how far joints would move the frame,
   were they alone. `joint` and `row`, given as {0, 1}, say how well that is known. */
static inline int frame_moved(const struct sample *s, const API(frame_impedance) * wanted, vector at, const real *mass,
    struct frame_motion *out, struct pivot *joint, struct pivot *row)
{
    real j[6 * N], rate[6 * N], mobility[36] = {0}, size[LARGEST], reach[2] = {0, 0};
    const int carrier = named_frames[wanted->frame].frame;
    const real distance = at.x * at.x + at.y * at.y + at.z * at.z;
    jacobian_rows(&s->m, carrier, at, j);
    rate_rows(&s->m, carrier, at, rate);
    for (int k = 0; k < N; ++k) {
        const real turn = j[k] * j[k] + j[N + k] * j[N + k] + j[2 * N + k] * j[2 * N + k];
        const real move = j[3 * N + k] * j[3 * N + k] + j[4 * N + k] * j[4 * N + k] + j[5 * N + k] * j[5 * N + k];
        size[k] = mass[k * N + k];
        reach[0] += turn / size[k];
        reach[1] += (move + turn * distance) / size[k];
    }
    clear(6 * N, out->jacobian);
    clear(6 * N, out->rate);
    clear(36, out->inertia);
    for (int r = 0; r < wanted->rows; ++r) {
        copy(N, j + wanted->row[r] * N, out->jacobian + r * N);
        copy(N, rate + wanted->row[r] * N, out->rate + r * N);
    }
    for (int k = 0; k < N; ++k)
        for (int r = 0; r < 6; ++r)
            out->moved[k * 6 + r] = out->jacobian[r * N + k];
    int fault = eliminate(0, N, 6, size, mass, out->moved, joint);
    if (fault)
        return fault;
    for (int r = 0; r < 6; ++r) {
        out->inertia[r * 6 + r] = 1;
        transposed_times(N, 6, out->moved, out->jacobian + r * N, mobility + r * 6);
        if (r >= wanted->rows)
            mobility[r * 6 + r] = 1;
        size[r] = mobility[r * 6 + r];
        if (r < wanted->rows && !(size[r] > ROUNDING(6) * reach[wanted->row[r] >= 3]))
            return -1 - r;
    }
    fault = eliminate(0, 6, 6, size, mobility, out->inertia, row);
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k < r; ++k)
            out->inertia[r * 6 + k] = out->inertia[k * 6 + r];
    return -fault;
}

/* nud - nud_d, which M_e is to have, from - B_e (nu - nu_d) - E' K_e x + F; returns 0, -7, or - the row, from 1, at which M_e
   is not positive. `weakest`, given as {0, 1}, says how well it is known where M_e is more than a share of L. */
static inline int frame_acceleration(const struct sample *s, const API(frame_impedance) * wanted, const real *target, vector at,
    const struct frame_motion *frame, const real *velocity, const real *external, real *out, struct pivot *weakest)
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
        transposed_times(N, 6, frame->moved, torque, force);
        times(6, N, frame->rate, joint, change);
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

int API(frame_partial_impedance)(AT_REST, const API(impedance) * posture, const real *q_d, const real *qd_d, const real *qdd_d,
    const API(frame_impedance) * wanted, const real *pose_d, const real *velocity_d, const real *acceleration_d,
    const real *external, real *tau, real *follows)
{
    const API(impedance) natural = all_natural();
    const int rows = wanted->rows;
    struct deviation from;
    struct frame_motion frame;
    struct pivot joint[2] = {{0, 1}, {0, 1}}, row[2] = {{0, 1}, {0, 1}};
    real mass[N * N], kept[N * N], force[N], qdd[N], torque[N], velocity[6], asked[6], change[6], reached[6];
    OFFSETS(o);
    SAMPLE(s);
    if (!posture)
        posture = &natural;
    deviate(q, qd, q_d, qd_d, qdd_d, &from);
    wish(&s, posture, &from, 1, mass, kept, force);
    int fault = wanted_acceleration(&s, posture, &from, mass, kept, external, NULL, force, qdd, &joint[0]);
    if (fault)
        return fault;
    const vector at = place_of(&s.m, wanted->frame, o, wanted->point);
    fault = frame_moved(&s, wanted, at, mass, &frame, &joint[1], &row[0]);
    if (fault)
        return fault;
    times(6, N, frame.jacobian, qd, velocity);
    for (int r = 0; velocity_d && r < rows; ++r)
        velocity[r] -= velocity_d[wanted->row[r]];
    const vector there = place_in_world(&s, wanted->frame, o, wanted->point, q);
    fault = frame_acceleration(&s, wanted, pose_d, there, &frame, velocity, external, asked, &row[1]);
    if (fault)
        return fault;
    for (int r = 0; acceleration_d && r < rows; ++r)
        asked[r] += acceleration_d[wanted->row[r]];
    times(6, N, frame.rate, qd, change);
    times(6, N, frame.jacobian, qdd, reached);
    for (int r = 0; r < 6; ++r)
        asked[r] -= change[r] + reached[r];
    times(6, 6, frame.inertia, asked, change);
    times(N, 6, frame.moved, change, force);
    join_force(force, qdd);
    answer(&s, qdd, qd, 1, torque);
    add_passive(q, qd, qdd, torque);
    add_smooth_friction(qd, posture->friction_width, torque);
    for (int i = 0; external && i < N; ++i)
        torque[i] -= external[i];
    const int moving = vague(&joint[0]) ? vague(&joint[0]) : vague(&joint[1]);
    const int along = vague(&row[0]) ? vague(&row[0]) : vague(&row[1]);
    return command(torque, qdd, moving ? -7 - moving : along ? -7 - N - along : 0, tau, follows);
}
