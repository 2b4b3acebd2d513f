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

/* How the chosen rows of a frame move with the joints: J and dJ/dt, row by row, X with zeros for the rest of six, and L. */
struct frame_motion {
    real jacobian[6 * N], rate[6 * N], moved[6 * N], inertia[36];
};

/* a x of a matrix (rows, columns); X y, and X' f. */
static inline void times(int rows, int columns, const real *a, const real *x, real *product)
{
    for (int r = 0; r < rows; ++r) {
        real sum = 0;
        for (int k = 0; k < columns; ++k)
            sum += a[r * columns + k] * x[k];
        product[r] = sum;
    }
}

static inline void to_joints(int rows, const real *moved, const real *y, real *product)
{
    for (int i = 0; i < N; ++i) {
        real sum = 0;
        for (int r = 0; r < rows; ++r)
            sum += moved[i * 6 + r] * y[r];
        product[i] = sum;
    }
}

static inline void from_joints(const real *moved, const real *f, real *product)
{
    real sum[6] = {0};
    for (int i = 0; i < N; ++i)
        for (int r = 0; r < 6; ++r)
            sum[r] += moved[i * 6 + r] * f[i];
    memcpy(product, sum, sizeof sum);
}

/* Returns 0, the joint at which H is not positive, or - the row along which the frame cannot move, both from 1. Rows of turns
   are judged together, and so are those of places: by how far joints would move the frame, were they alone. H is written
   over. */
static inline int frame_moved(const struct sample *s, const API(frame_impedance) * wanted, vector at, real *mass,
    struct frame_motion *out)
{
    const int rows = wanted->rows;
    real j[6 * N], rate[6 * N], mobility[36], size[LARGEST], reach[2] = {0, 0};
    const int carrier = named_frames[wanted->frame].frame;
    jacobian_rows(&s->m, carrier, at, j);
    rate_rows(&s->m, carrier, at, rate);
    for (int k = 0; k < N; ++k) {
        const real turn = j[k] * j[k] + j[N + k] * j[N + k] + j[2 * N + k] * j[2 * N + k];
        const real length = at.x * at.x + at.y * at.y + at.z * at.z;
        reach[0] += turn / mass[k * N + k];
        for (int r = 3; r < 6; ++r)
            reach[1] += j[r * N + k] * j[r * N + k] / mass[k * N + k];
        reach[1] += turn * length / mass[k * N + k];
        size[k] = mass[k * N + k];
    }
    memset(out->moved, 0, sizeof out->moved);
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < N; ++k) {
            out->jacobian[r * N + k] = out->moved[k * 6 + r] = j[wanted->row[r] * N + k];
            out->rate[r * N + k] = rate[wanted->row[r] * N + k];
        }
    const int fault = eliminate(SYMMETRIC, N, 6, size, mass, out->moved);
    if (fault)
        return fault;
    for (int r = 0; r < rows; ++r) {
        real row[6];
        from_joints(out->moved, out->jacobian + r * N, row);
        for (int k = 0; k < rows; ++k) {
            mobility[r * rows + k] = row[k];
            out->inertia[r * rows + k] = r == k;
        }
    }
    for (int r = 0; r < rows; ++r) {
        const real own = mobility[r * rows + r], all = reach[wanted->row[r] >= 3];
        size[r] = own > all ? own : all;
    }
    return -eliminate(SYMMETRIC, rows, rows, size, mobility, out->inertia);
}

/* nud - nud_d, which M_e is to have, from - B_e (nu - nu_d) - E' K_e x + F; returns 0, -7, or - the row, from 1, at which M_e
   is not positive. */
static inline int frame_acceleration(const struct sample *s, const API(frame_impedance) * wanted, const real *target, vector at,
    const struct frame_motion *frame, const real *velocity, const real *external, real *out)
{
    const int rows = wanted->rows;
    const real still[N] = {0};
    real inertia[36], moment[6], share[6], joint[N], torque[N], part[6];
    memset(out, 0, (size_t)rows * sizeof(real));
    resist(rows, wanted->damping, velocity, out);
    if (wanted->stiffness) {
        const int fault = pull(s, wanted, target, at, out);
        if (fault)
            return fault;
    }
    times(rows, rows, frame->inertia, velocity, moment);
    to_joints(rows, frame->moved, moment, joint);
    answer(s, still, joint, 0, torque);
    from_joints(frame->moved, torque, share);
    times(rows, N, frame->rate, joint, part);
    for (int r = 0; r < rows; ++r)
        share[r] = -wanted->keep_velocity * (share[r] - part[r]);
    if (external) {
        from_joints(frame->moved, external, part);
        for (int r = 0; r < rows; ++r)
            share[r] += part[r];
    }
    times(rows, rows, frame->inertia, share, part);
    for (int r = 0; r < rows; ++r)
        out[r] += part[r];
    for (int e = 0; e < rows * rows; ++e)
        inertia[e] = wanted->keep_inertia * frame->inertia[e] + (wanted->inertia ? wanted->inertia[e] : 0);
    return -solve(0, rows, frame->inertia, inertia, out);
}

int API(frame_partial_impedance)(AT_REST, const API(impedance) * posture, const real *q_d, const real *qd_d, const real *qdd_d,
    const API(frame_impedance) * wanted, const real *pose_d, const real *velocity_d, const real *acceleration_d,
    const real *external, real *tau)
{
    const API(impedance) natural = {NULL, NULL, NULL, NULL, NULL, 0};
    const int rows = wanted->rows;
    struct deviation from;
    struct frame_motion frame;
    real mass[N * N], kept[N * N], force[N], qdd[N], torque[N], velocity[6], wish_of_frame[6], part[6];
    OFFSETS(o);
    SAMPLE(s);
    if (!posture)
        posture = &natural;
    deviate(q, qd, q_d, qd_d, qdd_d, &from);
    wish(&s, posture, &from, 1, mass, kept, force);
    int fault = wanted_acceleration(&s, posture, &from, mass, kept, external, NULL, force, qdd);
    if (fault)
        return fault;
    const vector at = place_of(&s.m, wanted->frame, o, wanted->point);
    fault = frame_moved(&s, wanted, at, mass, &frame);
    if (fault)
        return fault;
    times(rows, N, frame.jacobian, qd, velocity);
    for (int r = 0; velocity_d && r < rows; ++r)
        velocity[r] -= velocity_d[wanted->row[r]];
    const vector there = place_in_world(&s, wanted->frame, o, wanted->point, q);
    fault = frame_acceleration(&s, wanted, pose_d, there, &frame, velocity, external, wish_of_frame);
    if (fault)
        return fault;
    times(rows, N, frame.rate, qd, part);
    for (int r = 0; r < rows; ++r)
        wish_of_frame[r] += (acceleration_d ? acceleration_d[wanted->row[r]] : 0) - part[r];
    times(rows, N, frame.jacobian, qdd, part);
    for (int r = 0; r < rows; ++r)
        wish_of_frame[r] -= part[r];
    times(rows, rows, frame.inertia, wish_of_frame, part);
    to_joints(rows, frame.moved, part, force);
    join_force(force, qdd);
    answer(&s, qdd, qd, 1, torque);
    add_passive(q, qd, qdd, torque);
    for (int i = 0; external && i < N; ++i)
        torque[i] -= external[i];
    return command(torque, tau);
}
