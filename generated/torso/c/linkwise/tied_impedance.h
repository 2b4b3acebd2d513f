/* Partial impedance of joints that ties move, and what is cancelled. The same in every package of linkwise.

   Equations of impedance.h hold along what ties leave free: G' times each of them, for qdd = G ydd + b. From the qdd_0 among
   these whose independent joints have the wanted acceleration,
       qdd = qdd_0 + G (G' M* G)^-1 G' (f + v - B* ed - K e - M* (qdd_0 - qdd_d))
   and driven joints give what it needs (least_torques.h), less what is natural.

   The file that includes this one says by AT_REST and INPUTS what functions are given. */
#include "wanted_impedance.h"

#include "frame_aim.h"

#include "least_torques.h"

/* What a motion needs of the joints. */
struct need {
    struct driven by;
    struct deviation from;
    ALIGNED real mass[N * N], kept[N * N], pull[N], torque[N], qdd[N];
};

/* Joints at a state, and who drives them; 0, or why there is no answer. `turns` says whether it matters how rows change. */
static int ready(struct tied *x, struct need *need, const struct numbers *numbers, const struct offsets *o, const real *q,
    const real *qd, const API(constraints) *constraints, const API(actuators) *actuators, int turns)
{
    const int why = observe_tied(x, numbers, o, constraints, q);
    if (why)
        return why;
    if (turns)
        move_tied(x, qd, NULL);
    else
        follow_velocities(x, qd);
    links_at(x);
    return read_driven(x, actuators, &need->by);
}

/* What joints have of their own in these torques. */
static void add_own(const struct tied *x, const real *qdd, const API(impedance) *wanted, real *torque)
{
    (void)qdd;
    (void)wanted;
    add_passive(x->at.q, x->qd, qdd, torque);
    add_smooth_friction(x->qd, wanted->friction_width, torque);
}

/* The acceleration that is wanted, of what ties allow; 0, or why there is none. */
static int wanted_motion(const struct tied *x, const API(impedance) *wanted, const real *external, const real *task,
    struct need *need, struct pivot *weakest)
{
    const int m = x->free;
    ALIGNED real natural[N] = {0}, small[N * N], own[N * N], driven[N] = {0};
    if (!wanted->keep_velocity)
        answer(&x->at.s, need->from.still, need->from.velocity, 0, natural);
    for (int i = 0; i < N; ++i) {
        need->qdd[i] = x->bias[i];
        for (int a = 0; a < m; ++a)
            need->qdd[i] += x->map[i * PITCH + a] * need->from.qdd_d[x->joint[x->bound + a]];
        need->pull[i] -= natural[i];
    }
    join_force(external, need->pull);
    join_force(task, need->pull);
    for (int i = 0; i < N; ++i)
        natural[i] = need->qdd[i] - need->from.qdd_d[i];
    resist(N, need->kept, natural, need->pull);
    for (int i = 0; i < N; ++i)
        for (int a = 0; a < m; ++a)
            driven[a] += x->map[i * PITCH + a] * need->pull[i];
    reduce_inertia(x, need->kept, small);
    const int changed = wanted->keep_inertia || wanted->inertia;
    if (changed)
        reduce_inertia(x, need->mass, own);
    if (solve(wanted->regular, m, changed ? own : small, small, driven, weakest))
        return IS_NOT_POSITIVE;
    for (int i = 0; i < N; ++i)
        for (int a = 0; a < m; ++a)
            need->qdd[i] += x->map[i * PITCH + a] * driven[a];
    return 0;
}

/* Torques of the driven joints for `need`, the acceleration that follows, and what rows bear, each unless it is NULL. */
static int give_torques(struct tied *x, struct need *need, int said, real *tau, real *qdd, real *forces)
{
    const int m = x->free;
    ALIGNED real force[N] = {0}, torque[N], left[N] = {0}, inertia[N * N], borne[ROWS];
    for (int i = 0; i < N; ++i)
        for (int a = 0; a < m; ++a)
            force[a] += x->map[i * PITCH + a] * need->torque[i];
    if (need->by.rank < m) {
        reduce_inertia(x, need->mass, inertia);
        const int why = leave_undriven(x, &need->by, inertia, force, left);
        if (why)
            return why;
    }
    least_torques(x, &need->by, force, torque);
    for (int i = 0; i < N; ++i) {
        need->qdd[i] += left[i];
        if (!(torque[i] - torque[i] == 0) || (qdd && !(need->qdd[i] - need->qdd[i] == 0)))
            return IS_NOT_FINITE;
    }
    if (forces) {
        for (int i = 0; i < N; ++i) {
            need->torque[i] -= torque[i];
            for (int k = 0; k < N; ++k)
                need->torque[i] += need->mass[i * N + k] * left[k];
        }
        bear(x, need->torque, borne);
        copy((size_t)x->t.rows, borne, forces);
    }
    if (tau)
        copy(N, torque, tau);
    if (qdd)
        copy(N, need->qdd, qdd);
    return said;
}

int API(constrained_partial_impedance)(AT_REST, const API(constraints) *constraints, const API(actuators) *actuators,
    const API(impedance) *wanted, const real *q_d, const real *qd_d, const real *qdd_d, const real *task, const real *external,
    real *tau, real *follows, real *forces)
{
    const API(impedance) natural = all_natural();
    ALIGNED struct tied x;
    ALIGNED struct need need;
    struct pivot weakest = {0, 1};
    NUMBERS(numbers);
    OFFSETS(o);
    if (!wanted)
        wanted = &natural;
    const int solved = wanted->keep_inertia || wanted->inertia || follows || forces;
    int why = ready(&x, &need, numbers, o, q, qd, constraints, actuators, solved);
    if (why)
        return why;
    deviate(q, x.qd, q_d, qd_d, qdd_d, &need.from);
    wish(&x.at.s, wanted, &need.from, solved || need.by.rank < x.free, need.mass, need.kept, need.pull);
    if (!solved) {
        copy(N, need.from.qdd_d, need.qdd);
        answer(&x.at.s, need.from.qdd_d, wanted->keep_velocity ? x.qd : need.from.qd_d, 1, need.torque);
        join_force(need.pull, need.torque);
        join_force(task, need.torque);
    } else {
        why = wanted_motion(&x, wanted, external, task, &need, &weakest);
        if (why)
            return why;
        answer(&x.at.s, need.qdd, x.qd, 1, need.torque);
        for (int i = 0; external && i < N; ++i)
            need.torque[i] -= external[i];
    }
    add_own(&x, need.qdd, wanted, need.torque);
    return give_torques(&x, &need, -vague(&weakest), tau, follows, forces);
}

/* How ties let a frame move, with X by what they leave free, and dG/dt as it takes velocities of all joints. */
static int tied_frame(struct tied *x, const struct need *need, const API(frame_impedance) *wanted, struct frame_motion *frame,
    real *bend, struct pivot *weakest)
{
    const int m = x->free;
    const vector at = place_of(&x->at.s.m, wanted->frame, x->o, wanted->point);
    ALIGNED real every[6 * N], freely[6 * N], small[N * N], moved[N * 6];
    frame_rows(&x->at.s, wanted, at, every, frame);
    for (int r = 0; r < 6; ++r)
        for (int a = 0; a < m; ++a) {
            freely[r * m + a] = 0;
            for (int i = 0; i < N; ++i)
                freely[r * m + a] += every[r * N + i] * x->map[i * PITCH + a];
        }
    reduce_inertia(x, need->mass, small);
    const int fault = show_inertia(m, wanted, at, freely, small, moved, frame->inertia, &weakest[0], &weakest[1]);
    if (fault)
        return fault < 0 ? IS_STUCK : IS_NOT_POSITIVE;
    turn_map(x);
    clear((size_t)(N * N), bend);
    for (int i = 0; i < N; ++i) {
        for (int r = 0; r < 6; ++r) {
            frame->moved[i * 6 + r] = 0;
            for (int a = 0; a < m; ++a)
                frame->moved[i * 6 + r] += x->map[i * PITCH + a] * moved[a * 6 + r];
        }
        for (int a = 0; a < m; ++a)
            bend[i * N + x->joint[x->bound + a]] = x->map_rate[i * PITCH + a];
    }
    return 0;
}

int API(constrained_frame_partial_impedance)(AT_REST, const API(constraints) *constraints, const API(actuators) *actuators,
    const API(impedance) *posture, const real *q_d, const real *qd_d, const real *qdd_d, const API(frame_impedance) *wanted,
    const real *pose_d, const real *velocity_d, const real *acceleration_d, const real *external, real *tau, real *follows,
    real *forces)
{
    const API(impedance) natural = all_natural();
    const struct frame_target target = {wanted, pose_d, velocity_d, acceleration_d};
    ALIGNED struct tied x;
    ALIGNED struct need need;
    ALIGNED struct frame_motion frame;
    ALIGNED real bend[N * N];
    struct pivot weakest[4] = {{0, 1}, {0, 1}, {0, 1}, {0, 1}};
    NUMBERS(numbers);
    OFFSETS(o);
    int why = ready(&x, &need, numbers, o, q, qd, constraints, actuators, 1);
    if (why)
        return why;
    if (need.by.rank < x.free)
        return IS_UNDRIVEN;
    if (!posture)
        posture = &natural;
    deviate(q, x.qd, q_d, qd_d, qdd_d, &need.from);
    wish(&x.at.s, posture, &need.from, 1, need.mass, need.kept, need.pull);
    why = wanted_motion(&x, posture, external, NULL, &need, &weakest[0]);
    if (!why)
        why = tied_frame(&x, &need, wanted, &frame, bend, weakest + 1);
    if (why)
        return why;
    why = aim(&x.at.s, &target, o, q, x.qd, &frame, external, bend, need.mass, need.qdd, &weakest[3]);
    if (why)
        return why == -7 ? IS_HALF_A_TURN : IS_NOT_POSITIVE;
    answer(&x.at.s, need.qdd, x.qd, 1, need.torque);
    for (int i = 0; external && i < N; ++i)
        need.torque[i] -= external[i];
    add_own(&x, need.qdd, posture, need.torque);
    int said = 0;
    for (int k = 0; k < 4 && !said; ++k)
        said = -vague(&weakest[k]);
    return give_torques(&x, &need, said, tau, follows, forces);
}

int API(constrained_cancel)(INPUTS, const API(constraints) *constraints, const API(actuators) *actuators,
    const API(impedance) *wanted, const real *task, real *tau)
{
    const API(impedance) natural = all_natural();
    ALIGNED struct tied x;
    ALIGNED struct need need;
    NUMBERS(numbers);
    OFFSETS(o);
    const int why = ready(&x, &need, numbers, o, q, qd, constraints, actuators, 0);
    if (why)
        return why;
    if (!wanted)
        wanted = &natural;
    const int changed = wanted->keep_inertia || wanted->inertia;
    deviate(q, x.qd, NULL, NULL, NULL, &need.from);
    wish(&x.at.s, wanted, &need.from, changed || need.by.rank < x.free, need.mass, need.kept, need.pull);
    answer(&x.at.s, need.from.still, wanted->keep_velocity ? x.qd : need.from.still, 1, need.torque);
    add_own(&x, need.from.still, wanted, need.torque);
    for (int i = 0; changed && i < N; ++i)
        for (int k = 0; k < N; ++k)
            need.torque[i] += (need.mass[i * N + k] - need.kept[i * N + k]) * qdd[k];
    join_force(need.pull, need.torque);
    join_force(task, need.torque);
    copy(N, qdd, need.qdd);
    return give_torques(&x, &need, 0, tau, NULL, NULL);
}

int API(contacts_keep)(size_t grips, const API(constraints) *constraints, const API(grip) *grip, const real *forces)
{
    if (count_rows(constraints) < 0)
        return -1;
    for (int k = 0; k < (int)grips; ++k) {
        const int p = grip[k].contact;
        if (p < 0 || p >= constraints->contacts)
            return -k - 1;
        const int kind = constraints->contact[p].kind;
        if (kind != HELD_POINT && kind != HELD_ROLLING)
            return -k - 1;
        int at = TIED_ROWS - COUPLINGS;
        for (int e = 0; e < p; ++e)
            at += rows_of_kind(constraints->contact[e].kind);
        const real *const f = forces + at, *const n = grip[k].normal;
        const real square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        const real pushed = (f[0] * n[0] + f[1] * n[1] + f[2] * n[2]) / F(sqrt)(square);
        const real across = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] - pushed * pushed;
        if (!(pushed >= 0 && across <= grip[k].friction * grip[k].friction * pushed * pushed))
            return k + 1;
    }
    return 0;
}
