/* Forward dynamics of joints that nothing ties. The same in every package of linkwise.

   The file that includes this one has `answer` and `natural_inertia` of a SAMPLE, and says by UNDER_TORQUE what functions are
   given. */
#include "elimination.h"
#include "passive.h"

/* H qdd + C qd + g + p = tau, with what joints have of their own in H and p; or without it, as M qdd + C qd + g = tau. */
static inline int accelerate(const struct sample *s, const real *q, const real *qd, const real *tau, int own, real *qdd)
{
    const real rest[N] = {0};
    real mass[N * N], size[N], force[N];
    natural_inertia(s, mass);
    answer(s, rest, qd, 1, force);
    if (own) {
        add_armature(mass);
        add_passive(q, qd, rest, force);
        add_friction(qd, force);
    }
    for (int i = 0; i < N; ++i) {
        size[i] = mass[i * N + i];
        force[i] = tau[i] - force[i];
    }
    struct pivot weakest = {0, 1};
    const int singular = eliminate(0, N, 1, size, mass, force, &weakest);
    if (singular)
        return singular;
    copy(N, force, qdd);
    return -vague(&weakest);
}

int API(forward_dynamics)(UNDER_TORQUE, real *qdd)
{
    SAMPLE(s);
    return accelerate(&s, q, qd, tau, 1, qdd);
}
#ifdef PASSIVE

int API(forward_dynamics_of_links)(UNDER_TORQUE, real *qdd)
{
    SAMPLE(s);
    return accelerate(&s, q, qd, tau, 0, qdd);
}
#endif
