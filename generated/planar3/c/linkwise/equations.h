/* Equations of motion before torques are known: H qdd = tau - rest. The same in every package of linkwise. */
#ifndef LINKWISE_EQUATIONS_H
#define LINKWISE_EQUATIONS_H

#include "passive.h"

/* H = M and rest = C qd + g, with what joints have of their own in both where it counts; of links whose motion is known. */
static inline void equations_of(const struct sample *s, const real *q, const real *qd, int own, real *inertia, real *rest)
{
    ALIGNED const real still[N] = {0};
    natural_inertia(s, inertia);
    answer(s, still, qd, 1, rest);
    if (own) {
        add_armature(inertia);
        add_passive(q, qd, still, rest);
        add_friction(qd, rest);
    }
}

/* x of H x = b, which it overwrites; m of them, and steps as `eliminate` says, joints negative near where H is singular. */
static inline int solve_positive(int m, const real *inertia, real *b)
{
    ALIGNED real size[N] = {0};
    struct pivot weakest = {0, 1};
    for (int a = 0; a < m; ++a)
        size[a] = inertia[a * m + a];
    const int singular = eliminate(0, m, 1, size, inertia, b, &weakest);
    return singular ? singular : -vague(&weakest);
}

/* The accelerations of joints that nothing ties: 0, or as `solve_positive`; where H is singular they are as they were. */
static inline int accelerate(const real *inertia, const real *rest, const real *tau, real *qdd)
{
    ALIGNED real moved[N];
    for (int i = 0; i < N; ++i)
        moved[i] = tau[i] - rest[i];
    const int found = solve_positive(N, inertia, moved);
    if (found <= 0)
        copy(N, moved, qdd);
    return found;
}

#endif
