/* Wanted impedances of joints, free or tied. The same in every package of linkwise.

   Of a wanted motion the robot is away by e = q - q_d and ed = qd - qd_d. With H = M and the joints' armature, M* and B* are
   what is kept of H and of the velocity coefficients C, and what is added; K is the stiffness.

   The file that includes this one has `answer`, `natural_inertia` and `keep` of a SAMPLE. */
#ifndef LINKWISE_WANTED_IMPEDANCE_H
#define LINKWISE_WANTED_IMPEDANCE_H

#include "elimination.h"
#include "passive.h"

/* Nothing but what is natural, and no friction compensated. */
static inline API(impedance) all_natural(void)
{
    API(impedance) wanted;
    wanted.keep_inertia = wanted.inertia = wanted.keep_velocity = wanted.damping = wanted.stiffness = NULL;
    wanted.regular = 0;
#ifdef PASSIVE
    wanted.friction_width = 0;
#endif
    return wanted;
}

/* What is asked of a sample: where to, and how it is away from there. */
struct deviation {
    real place[N], velocity[N], still[N];
    const real *qd_d, *qdd_d;
};

/* NULL stands for zeros. */
static inline void deviate(const real *q, const real *qd, const real *q_d, const real *qd_d, const real *qdd_d,
    struct deviation *from)
{
    clear(N, from->still);
    from->qd_d = qd_d ? qd_d : from->still;
    from->qdd_d = qdd_d ? qdd_d : from->still;
    for (int i = 0; i < N; ++i) {
        from->place[i] = q_d ? q[i] - q_d[i] : q[i];
        from->velocity[i] = qd[i] - from->qd_d[i];
    }
}

/* force += a; force -= a x, of a matrix (n, n). Of both, NULL stands for zeros. */
static inline void join_force(const real *a, real *force)
{
    for (int i = 0; a && i < N; ++i)
        force[i] += a[i];
}

static inline void resist(int n, const real *a, const real *x, real *force)
{
    for (int i = 0; a && i < n; ++i)
        force[i] -= dot(n, a + i * n, x);
}

/* 1 by the largest number of the inverse of a regular a (n, n), each beside its size. */
static inline real left_of_inverse(int n, const real *size, const real *a)
{
    real largest = 0, column[LARGEST * 6];
    for (int first = 0; first < n; first += 6) {
        clear((size_t)n * 6, column);
        for (int k = 0; k < 6 && first + k < n; ++k)
            column[(first + k) * 6 + k] = 1;
        if (eliminate(1, n, 6, size, a, column, NULL))
            return 0;
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < 6 && first + k < n; ++k) {
                const real entry = F(fabs)(column[i * 6 + k]) * F(sqrt)(size[i]) * F(sqrt)(size[first + k]);
                if (entry > largest)
                    largest = entry;
            }
    }
    return 1 / largest;
}

/* Solves wanted x = force for a matrix (n, n). Returns 0, or the row from 1 at which it is not positive, or not regular where
   this is enough: as far as rounding of `natural` (n, n) tells, from which it is made. Otherwise `weakest`, given as {0, 1},
   says how well x is known: a positive matrix is judged by its own diagonal, as M is. */
INLINE int solve(int regular, int n, const real *natural, const real *wanted, real *force, struct pivot *weakest)
{
    real size[LARGEST];
    int symmetric = 1;
    for (int i = 0; i < n; ++i) {
        const real own = natural[i * n + i], asked = wanted[i * n + i], large = F(fabs)(asked);
        if (!regular && !(asked > ROUNDING(n) * own))
            return i + 1;
        size[i] = regular && own > large ? own : large;
        for (int k = 0; k < i; ++k)
            symmetric &= wanted[i * n + k] == wanted[k * n + i];
    }
    if (!regular && !symmetric) {
        real part[LARGEST * LARGEST];
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < n; ++k)
                part[i * n + k] = R(0.5) * (wanted[i * n + k] + wanted[k * n + i]);
        const int fault = eliminate(0, n, 0, size, part, NULL, weakest);
        return fault ? fault : eliminate(0, n, 1, size, wanted, force, NULL);
    }
    const int fault = eliminate(regular, n, 1, size, wanted, force, weakest);
    if (fault || !regular || !(weakest->left < SMALL))
        return fault;
    weakest->left = left_of_inverse(n, size, wanted);
    return weakest->left > ROUNDING(n) ? 0 : weakest->column + 1;
}

/* H, M* and -(B* - C) ed - K e; where c1 is not kept as it is, C is in it too. Without weights kept is M*, from H. */
static inline void wish(const struct sample *s, const API(impedance) * wanted, const struct deviation *from, int inertia,
    real *mass, real *kept, real *force)
{
    clear(N, force);
    if (wanted->keep_inertia || wanted->keep_velocity)
        keep(s, wanted->keep_inertia, wanted->keep_velocity, from->velocity, mass, kept, force);
    resist(N, wanted->damping, from->velocity, force);
    resist(N, wanted->stiffness, from->place, force);
    if (!inertia)
        return;
    if (!wanted->keep_inertia) {
        natural_inertia(s, mass);
        copy((size_t)N * N, mass, kept);
    }
    add_armature(mass);
    add_armature(kept);
    for (int i = 0; wanted->inertia && i < N * N; ++i)
        kept[i] += wanted->inertia[i];
}

#endif
