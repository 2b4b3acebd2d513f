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
        for (int k = 0; k < n; ++k)
            force[i] -= a[i * n + k] * x[k];
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
