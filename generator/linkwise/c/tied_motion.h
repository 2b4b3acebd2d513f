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
        if (!factor_rows(x))
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
    return IS_UNCLOSED;
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

/* G' M G, and its diagonal. */
static void reduce_inertia(const struct tied *x, const real *mass, real *small, real *size)
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
    for (int a = 0; a < m; ++a)
        size[a] = small[a * m + a];
}

/* (G' M G) ydd = G' (tau - h - M bias), then A' lambda = M qdd + h - tau; with what joints have of their own where it counts. */
static int accelerate_tied(struct tied *x, const real *tau, int own, real *qdd, real *forces)
{
    const int m = x->free;
    ALIGNED const real rest[N] = {0};
    ALIGNED real mass[N * N], force[N], small[N * N], size[N] = {0}, driven[N];
    inertia_of(x, own, mass);
    answer(&x->at.s, rest, x->qd, 1, force);
    if (own) {
        add_passive(x->at.q, x->qd, rest, force);
        add_friction(x->qd, force);
    }
    clear((size_t)m, driven);
    for (int i = 0; i < N; ++i) {
        real left = force[i] = tau[i] - force[i];
        for (int k = 0; k < N; ++k)
            left -= mass[i * N + k] * x->bias[k];
        for (int a = 0; a < m; ++a)
            driven[a] += x->map[i * PITCH + a] * left;
    }
    reduce_inertia(x, mass, small, size);
    struct pivot weakest = {0, 1};
    if (eliminate(0, m, 1, size, small, driven, &weakest) || vague(&weakest))
        return HAS_NO_INERTIA;
    for (int i = 0; i < N; ++i) {
        qdd[i] = x->bias[i];
        for (int a = 0; a < m; ++a)
            qdd[i] += x->map[i * PITCH + a] * driven[a];
    }
    for (int i = 0; i < N; ++i) {
        force[i] = -force[i];
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
