/* Partial impedance of a frame, which has precedence over that of the joints: see frame_aim.h. The same in every package of linkwise. */
#include "impedance.h"

#include "frame_aim.h"

int API(frame_partial_impedance)(AT_REST, const API(impedance) * posture, const real *q_d, const real *qd_d, const real *qdd_d,
    const API(frame_impedance) * wanted, const real *pose_d, const real *velocity_d, const real *acceleration_d,
    const real *external, real *tau, real *follows)
{
    const API(impedance) natural = all_natural();
    const struct frame_target target = {wanted, pose_d, velocity_d, acceleration_d};
    struct deviation from;
    struct frame_motion frame;
    struct pivot joint[2] = {{0, 1}, {0, 1}}, row[2] = {{0, 1}, {0, 1}};
    real mass[N * N], kept[N * N], force[N], qdd[N], torque[N], every[6 * N];
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
    frame_rows(&s, wanted, at, every, &frame);
    fault = show_inertia(N, wanted, at, every, mass, frame.moved, frame.inertia, &joint[1], &row[0]);
    if (fault)
        return fault;
    fault = aim(&s, &target, o, q, qd, &frame, external, NULL, mass, qdd, &row[1]);
    if (fault)
        return fault;
    answer(&s, qdd, qd, 1, torque);
    add_passive(q, qd, qdd, torque);
    add_smooth_friction(qd, posture->friction_width, torque);
    for (int i = 0; external && i < N; ++i)
        torque[i] -= external[i];
    const int moving = vague(&joint[0]) ? vague(&joint[0]) : vague(&joint[1]);
    const int along = vague(&row[0]) ? vague(&row[0]) : vague(&row[1]);
    return command(torque, qdd, moving ? -7 - moving : along ? -7 - N - along : 0, tau, follows);
}
