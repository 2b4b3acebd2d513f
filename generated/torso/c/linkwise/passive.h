/* What joints have of their own, beside the links: springs, damping, friction, armature. The same in every package of
   linkwise. Where there is any of it, the file that includes this one has the table `passive`, and says so by PASSIVE. */
#ifndef LINKWISE_PASSIVE_H
#define LINKWISE_PASSIVE_H

#ifdef PASSIVE
static inline void add_armature(real *mass)
{
    for (int i = 0; i < N; ++i)
        mass[i * N + i] += passive[i].armature;
}

/* All of them but friction. */
static inline void add_passive(const real *q, const real *qd, const real *qdd, real *torque)
{
    for (int i = 0; i < N; ++i) {
        const struct passive_joint *const own = &passive[i];
        torque[i] += own->stiffness * q[i] + own->pull + own->damping * qd[i] + own->armature * qdd[i];
    }
}

/* Coulomb friction, none at rest. */
static inline void add_friction(const real *qd, real *torque)
{
    for (int i = 0; i < N; ++i)
        torque[i] += passive[i].friction * (real)((qd[i] > 0) - (qd[i] < 0));
}

/* What damping and friction of a joint ask for, which is lost. */
static inline real lost_torque(int i, real rate)
{
    return passive[i].damping * rate + passive[i].friction * (real)((rate > 0) - (rate < 0));
}

/* For controllers, which near rest must not jump with the noise of a sensor; none of it without a width. */
static inline void add_smooth_friction(const real *qd, real width, real *torque)
{
    for (int i = 0; width > 0 && i < N; ++i)
        torque[i] += passive[i].friction * F(tanh)(qd[i] / width);
}

#if PART(CONTROL)
void API(passive_torque)(const real *q, const real *qd, const real *qdd, real *torque)
{
    clear(N, torque);
    add_passive(q, qd, qdd, torque);
    add_friction(qd, torque);
}
#endif
#else
#define add_armature(mass) ((void)(mass))
#define add_passive(q, qd, qdd, torque) ((void)(q), (void)(torque))
#define add_friction(qd, torque) ((void)(torque))
#define lost_torque(i, rate) ((void)(i), 0 * (rate))
#define add_smooth_friction(qd, width, torque) ((void)(torque))
#endif

#endif
