/* Forward dynamics of joints that nothing ties. The same in every package of linkwise.

   The file that includes this one has equations.h and a SAMPLE, and says by UNDER_TORQUE what functions are given. */

/* H qdd + C qd + g + p = tau, with what joints have of their own in H and p; or without it, as M qdd + C qd + g = tau. */
static inline int move_freely(const struct sample *s, const real *q, const real *qd, const real *tau, int own, real *qdd)
{
    ALIGNED real inertia[N * N], rest[N];
    equations_of(s, q, qd, own, inertia, rest);
    return accelerate(inertia, rest, tau, qdd);
}

int API(forward_dynamics)(UNDER_TORQUE, real *qdd)
{
    SAMPLE(s);
    return move_freely(&s, q, qd, tau, 1, qdd);
}
#ifdef PASSIVE

int API(forward_dynamics_of_links)(UNDER_TORQUE, real *qdd)
{
    SAMPLE(s);
    return move_freely(&s, q, qd, tau, 0, qdd);
}
#endif
