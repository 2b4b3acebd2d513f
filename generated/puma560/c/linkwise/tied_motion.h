/* Motion of joints that ties move: rows, closing, maps and forward dynamics. The same in every package of linkwise.

   The file that includes this one says by AT_POSITION, AT_REST and UNDER_TORQUE what functions are given. */

int API(constraint_rows)(size_t count, AT_REST, const API(constraints) *constraints, const real *held_at, real *violation,
    real *jacobian, real *rate)
{
    NUMBERS(x);
    OFFSETS(o);
    ALIGNED const real rest[N] = {0};
    ALIGNED struct tie_rows t;
    ALIGNED struct standing here, held;
    if (count_rows(constraints) < 0)
        return IS_UNKNOWN;
    for (size_t s = 0; s < count; ++s) {
        const real *const at = q + s * N;
        stand(x, at, &here);
        if (held_at)
            stand(x, held_at + s * N, &held);
        rows_at(constraints, &here, held_at ? &held : &here, o, &t);
        const size_t rows = (size_t)t.rows;
        if (violation)
            copy(rows, t.violation, violation + s * rows);
        if (jacobian)
            copy(rows * N, t.jacobian, jacobian + s * rows * N);
        if (!rate)
            continue;
        set_motion(&here.s.m, qd + s * N, rest);
        rates_at(constraints, &here, o, qd + s * N, &t);
        copy(rows * N, t.rate, rate + s * rows * N);
    }
    return 0;
}

/* Newton's method on the dependent joints, q_d - A_d+ phi, from q to where ties close. */
static int close_ties(struct tied *x, const struct standing *held, real *q)
{
    ALIGNED real step[N], part[ROWS];
    int is_near = 0;
    for (int taken = 0; taken < STEPS; ++taken) {
        real square = 0;
        stand(x->numbers, q, &x->at);
        rows_at(x->c, &x->at, held, x->o, &x->t);
        if (!factor_rows(x, NULL))
            return IS_SINGULAR;
        copy((size_t)x->t.rows, x->t.violation, part);
        follow_one_side(x, part, step);
        for (int i = 0; i < N; ++i)
            square += step[i] * step[i];
        const real size = F(sqrt)(square), shorter = size > LONGEST_STEP ? LONGEST_STEP / size : R(1.0);
        if (is_near || size <= SETTLED) {
            for (int i = 0; i < N; ++i)
                q[i] += step[i];
            return is_open(x) ? IS_UNCLOSED : 0;
        }
        if (!(size > 0))
            return IS_UNCLOSED;
        is_near = size <= NEAR;
        for (int i = 0; i < N; ++i)
            q[i] += step[i] * shorter;
    }
    stand(x->numbers, q, &x->at);
    rows_at(x->c, &x->at, held, x->o, &x->t);
    return !factor_rows(x, NULL) ? IS_SINGULAR : is_open(x) ? IS_UNCLOSED : 0;
}

int API(closed)(size_t count, AT_POSITION, const API(constraints) *constraints, const real *held_at, real *closed)
{
    NUMBERS(numbers);
    OFFSETS(o);
    ALIGNED struct tied x;
    ALIGNED struct standing held;
    x.c = constraints;
    x.o = o;
    x.numbers = numbers;
    if (count_rows(constraints) < 0 || !read_joints(&x))
        return IS_UNKNOWN;
    for (size_t s = 0; s < count; ++s) {
        ALIGNED real at[N];
        copy(N, q + s * N, at);
        if (constraints->contacts)
            stand(numbers, held_at ? held_at + s * N : at, &held);
        const int why = close_ties(&x, &held, at);
        if (why)
            return why;
        copy(N, at, closed + s * N);
    }
    return 0;
}

/* The accelerations -A_d+ dA/dt qd, by the joint whose velocity causes them; `changes` is where they are found. */
static void caused_by_velocities(const struct tied *x, real *changes, real *caused)
{
    for (int r = 0; r < x->t.rows; ++r)
        for (int k = 0; k < N; ++k)
            changes[r * PITCH + k] = x->t.rate[r * N + k] * x->qd[k];
    follow(x, N, changes, caused);
}

int API(following)(size_t count, AT_REST, const API(constraints) *constraints, real *map, real *velocity, real *accelerations)
{
    NUMBERS(numbers);
    OFFSETS(o);
    ALIGNED const real rest[N] = {0};
    ALIGNED struct tied x;
    ALIGNED real changes[ROWS * PITCH], caused[N * PITCH];
    for (size_t s = 0; s < count; ++s) {
        const int why = observe_tied(&x, numbers, o, constraints, q + s * N);
        if (why)
            return why;
        const size_t m = (size_t)x.free;
        for (size_t i = 0; map && i < N; ++i)
            copy(m, x.map + i * PITCH, map + (s * N + i) * m);
        if (!velocity && !accelerations)
            continue;
        move_tied(&x, qd ? qd + s * N : rest, NULL);
        if (velocity)
            copy(N, x.qd, velocity + s * N);
        if (!accelerations)
            continue;
        caused_by_velocities(&x, changes, caused);
        for (size_t i = 0; i < N; ++i)
            copy(N, caused + i * PITCH, accelerations + (s * N + i) * N);
    }
    return 0;
}

/* M, with the armature of joints where what they have of their own counts. */
static void inertia_of(struct tied *x, int own, real *mass)
{
    links_at(x);
    natural_inertia(&x->at.s, mass);
    if (own)
        add_armature(mass);
}

/* G' M G. */
static void reduce_inertia(const struct tied *x, const real *mass, real *small)
{
    const int m = x->free;
    ALIGNED real moved[N * PITCH];
    times_map(x, N, mass, moved);
    for (int a = 0; a < m; ++a)
        for (int b = 0; b < m; ++b) {
            real sum = 0;
            for (int i = 0; i < N; ++i)
                sum += x->map[i * PITCH + a] * moved[i * PITCH + b];
            small[a * m + b] = sum;
        }
}

/* Equations of motion of the independent joints, G' M G ydd = G' (tau - rest), and qdd = G ydd + bias of all joints: what they need
   before torques are known, with G in rows of m; `rest` is M bias + h. */
struct tied_equations {
    real inertia[N * N], rest[N], map[N * N], bias[N];
};

/* These of a motion, with M and h of all joints; with what joints have of their own where it counts. */
static void tied_equations_of(struct tied *x, int own, real *mass, real *force, struct tied_equations *e)
{
    links_at(x);
    equations_of(&x->at.s, x->at.q, x->qd, own, mass, force);
    reduce_inertia(x, mass, e->inertia);
    for (int i = 0; i < N; ++i) {
        e->bias[i] = x->bias[i];
        e->rest[i] = force[i];
        for (int k = 0; k < N; ++k)
            e->rest[i] += mass[i * N + k] * x->bias[k];
        copy((size_t)x->free, x->map + i * PITCH, e->map + i * x->free);
    }
}

/* 0, or why there is no acceleration. */
static int accelerate_independent(int m, const struct tied_equations *e, const real *tau, real *qdd)
{
    ALIGNED real driven[N] = {0};
    for (int i = 0; i < N; ++i)
        for (int a = 0; a < m; ++a)
            driven[a] += e->map[i * m + a] * (tau[i] - e->rest[i]);
    if (solve_positive(m, e->inertia, driven))
        return HAS_NO_INERTIA;
    for (int i = 0; i < N; ++i) {
        qdd[i] = e->bias[i];
        for (int a = 0; a < m; ++a)
            qdd[i] += e->map[i * m + a] * driven[a];
    }
    return 0;
}

/* With them A' lambda = M qdd + h - tau. */
static int accelerate_tied(struct tied *x, const real *tau, int own, real *qdd, real *forces)
{
    struct tied_equations e;
    ALIGNED real mass[N * N], force[N];
    tied_equations_of(x, own, mass, force, &e);
    const int why = accelerate_independent(x->free, &e, tau, qdd);
    if (why)
        return why;
    for (int i = 0; i < N; ++i) {
        force[i] -= tau[i];
        for (int k = 0; k < N; ++k)
            force[i] += mass[i * N + k] * qdd[k];
    }
    bear(x, force, forces);
    return 0;
}

static int tied_dynamics(size_t count, const struct numbers *numbers, const struct offsets *o, const real *q, const real *qd,
    const real *tau, const API(constraints) *constraints, int own, real *qdd, real *forces)
{
    ALIGNED struct tied x;
    ALIGNED real borne[ROWS], moved[N];
    for (size_t s = 0; s < count; ++s) {
        int why = observe_tied(&x, numbers, o, constraints, q + s * N);
        if (why)
            return why;
        move_tied(&x, qd + s * N, NULL);
        why = accelerate_tied(&x, tau + s * N, own, moved, borne);
        if (why)
            return why;
        const size_t rows = (size_t)x.t.rows;
        if (qdd)
            copy(N, moved, qdd + s * N);
        if (forces)
            copy(rows, borne, forces + s * rows);
    }
    return 0;
}

int API(constrained_dynamics)(size_t count, UNDER_TORQUE, const API(constraints) *constraints, real *qdd, real *forces)
{
    NUMBERS(x);
    OFFSETS(o);
    return tied_dynamics(count, x, o, q, qd, tau, constraints, 1, qdd, forces);
}
#ifdef PASSIVE

int API(constrained_dynamics_of_links)(size_t count, UNDER_TORQUE, const API(constraints) *constraints, real *qdd, real *forces)
{
    NUMBERS(x);
    OFFSETS(o);
    return tied_dynamics(count, x, o, q, qd, tau, constraints, 0, qdd, forces);
}
#endif
