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

static inline void add_passive(const real *q, const real *qd, const real *qdd, real *torque)
{
    for (int i = 0; i < N; ++i) {
        const struct passive_joint *const own = &passive[i];
        const real sign = (real)((qd[i] > 0) - (qd[i] < 0));
        torque[i] += own->stiffness * q[i] + own->pull + own->damping * qd[i] + own->friction * sign + own->armature * qdd[i];
    }
}
#else
#define add_armature(mass) ((void)(mass))
#define add_passive(q, qd, qdd, torque) ((void)(torque))
#endif

#endif
