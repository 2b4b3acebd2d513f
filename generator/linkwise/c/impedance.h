/* Partial impedance of the joints. The same in every package of linkwise.

   With H = M and the joints' armature, C, gravity g, springs and damping p of the joints, and of their friction what is to be
   compensated, and torques f from outside, the robot moves by
       H qdd + C qd + g + p = tau + f
   Of a wanted motion it is away by e = q - q_d and ed = qd - qd_d. What is wanted there is, v being a task's torques,
       M* (qdd - qdd_d) + B* ed + K e = f + v
   with M* and B* what is kept of the natural ones, and what is added, so that
       qdd = qdd_d + M*^-1 (f + v - B* ed - K e)           tau = H qdd + C qd + g + p - f
   As long as all of M* is natural, f drops out of this and nothing is to be solved, unless qdd is asked for:
       tau = H qdd_d + C qd + g + p + v - B* ed - K e      and with B* = C + b, C qd - B* ed is C qd_d - b ed
   What is not kept at a given qdd is
       tau = (H - M*) qdd + (C - B*) qd + g + p + v

   The file that includes this one has `answer`, `natural_inertia` and `keep` of a SAMPLE. */
#include "wanted_impedance.h"

/* Torques that give these accelerations, to `tau`, and these to `follows`, each unless it is NULL; returns the joint, from 1,
   of which one is not finite, or else `said`. */
static inline int command(const real *torque, const real *qdd, int said, real *tau, real *follows)
{
    for (int i = 0; i < N; ++i)
        if (!(torque[i] - torque[i] == 0) || (follows && !(qdd[i] - qdd[i] == 0)))
            return i + 1;
    if (tau)
        copy(N, torque, tau);
    if (follows)
        copy(N, qdd, follows);
    return said;
}

/* The accelerations that are wanted; `force` is -(B* - C) ed - K e, or -B* ed - K e where c1 has weights. */
static inline int wanted_acceleration(const struct sample *s, const API(impedance) * wanted, const struct deviation *from,
    const real *mass, const real *kept, const real *external, const real *task, const real *force, real *qdd,
    struct pivot *weakest)
{
    real natural[N] = {0};
    if (!wanted->keep_velocity)
        answer(s, from->still, from->velocity, 0, natural);
    for (int i = 0; i < N; ++i)
        qdd[i] = force[i] - natural[i];
    join_force(external, qdd);
    join_force(task, qdd);
    const int fault = solve(wanted->regular, N, mass, kept, qdd, weakest);
    join_force(from->qdd_d, qdd);
    return fault;
}

int API(partial_impedance)(AT_REST, const API(impedance) * wanted, const real *q_d, const real *qd_d, const real *qdd_d,
    const real *task, const real *external, real *tau, real *follows)
{
    const API(impedance) natural = all_natural();
    struct deviation from;
    real mass[N * N], kept[N * N], force[N], qdd[N], torque[N];
    SAMPLE(s);
    if (!wanted)
        wanted = &natural;
    deviate(q, qd, q_d, qd_d, qdd_d, &from);
    const int solved = wanted->keep_inertia || wanted->inertia || follows;
    wish(&s, wanted, &from, solved, mass, kept, force);
    if (!solved) {
        answer(&s, from.qdd_d, wanted->keep_velocity ? qd : from.qd_d, 1, torque);
        add_passive(q, qd, from.qdd_d, torque);
        add_smooth_friction(qd, wanted->friction_width, torque);
        join_force(force, torque);
        join_force(task, torque);
        return command(torque, NULL, 0, tau, NULL);
    }
    struct pivot weakest = {0, 1};
    const int fault = wanted_acceleration(&s, wanted, &from, mass, kept, external, task, force, qdd, &weakest);
    if (fault)
        return fault;
    answer(&s, qdd, qd, 1, torque);
    add_passive(q, qd, qdd, torque);
    add_smooth_friction(qd, wanted->friction_width, torque);
    for (int i = 0; external && i < N; ++i)
        torque[i] -= external[i];
    return command(torque, qdd, -vague(&weakest), tau, follows);
}

int API(cancel)(INPUTS, const API(impedance) * wanted, const real *task, real *tau)
{
    const real still[N] = {0};
    const API(impedance) natural = all_natural();
    struct deviation from;
    real mass[N * N], kept[N * N], force[N], torque[N];
    SAMPLE(s);
    if (!wanted)
        wanted = &natural;
    const int changed = wanted->keep_inertia || wanted->inertia;
    deviate(q, qd, NULL, NULL, NULL, &from);
    wish(&s, wanted, &from, changed, mass, kept, force);
    answer(&s, still, wanted->keep_velocity ? qd : still, 1, torque);
    add_passive(q, qd, still, torque);
    add_smooth_friction(qd, wanted->friction_width, torque);
    for (int i = 0; changed && i < N; ++i)
        for (int k = 0; k < N; ++k)
            force[i] += (mass[i * N + k] - kept[i * N + k]) * qdd[k];
    join_force(force, torque);
    join_force(task, torque);
    return command(torque, NULL, 0, tau, NULL);
}
