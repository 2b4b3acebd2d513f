/* Motion over time, by Runge and Kutta's method of order 4 in fixed steps. The same in every package of linkwise.

   The state is (q, v, W): v = qd, and W the work that was done,
       dq/dt = qd    dv/dt = qdd    dW/dt = qd . (tau - damping - friction)
   Of joints that are tied the independent ones are integrated: at each evaluation the others are closed first, by Newton's method
   from where they are, and qd = G yd; likewise after each step. All motions go on together, for the controller is asked for all of
   them at once. The file that includes this one says by AT_REST what functions are given. */

enum { STATE = 2 * N + 1 };

/* A motion: its state, what the evaluations of a step sum to, the last one's slopes, its equations, and the power that is lost. */
struct moving {
    real state[STATE], sum[STATE], slope[STATE], lost;
    struct tied_equations equations;
    struct course course;
};

/* All motions: q, qd and tau as the controller has them. */
struct simulated {
    const API(simulation) *wanted;
    const struct numbers *numbers;
    const struct offsets *o;
    size_t count;
    int own, bound;
    real *q, *qd, *tau;
    struct moving *moving;
};

/* The caller's memory, as NAME.h says how much, holds q, qd, tau and the rest of each motion. */
typedef char scratch_is_as_said[SCRATCH * sizeof(real) == 3 * N * sizeof(real) + sizeof(struct moving) ? 1 : -1];

/* A sample of tied joints, and where contacts took hold, of the motion that is worked on. */
struct held_sample {
    struct tied x;
    struct standing held;
    size_t of;
};

/* Of numbers that are not finite, products with 0 are not numbers. */
static int is_finite(size_t count, const real *a)
{
    real rest = 0;
    for (size_t e = 0; e < count; ++e)
        rest += a[e] * 0;
    return rest > -1;
}

static real lost_power(const struct simulated *all, const real *qd)
{
    real sum = 0;
    if (all->own)
        for (int i = 0; i < N; ++i)
            sum += qd[i] * lost_torque(i, qd[i]);
    return sum;
}

/* Equations of joints that nothing ties. */
static void form_free(const struct simulated *all, const real *q, const real *qd, struct tied_equations *e)
{
    ALIGNED struct sample s;
    observe(all->numbers, q, qd, &s);
    equations_of(&s, q, qd, all->own, e->inertia, e->rest);
}

/* Equations of motion s at q, (s of all), which ties close; velocities there that follow from v. */
static void form_tied(const struct simulated *all, struct tied *x, size_t s, const real *v)
{
    ALIGNED real mass[N * N], force[N], raw[N];
    copy(N, v, raw);
    move_tied(x, raw, NULL);
    tied_equations_of(x, all->own, mass, force, &all->moving[s].equations);
    copy(N, x->qd, all->qd + s * N);
}

static void take_hold(struct held_sample *at, const struct course *c, size_t s)
{
    if (!at->x.c->contacts || at->of == s)
        return;
    stand(at->x.numbers, c->held, &at->held);
    at->of = s;
}

/* Equations where the state has got, or is at the end of a step or at the start. */
enum stage { WITHIN, ENDED, BEGUN };

static int form(const struct simulated *all, struct held_sample *at, size_t s, enum stage stage, const real *state)
{
    struct moving *const m = all->moving + s;
    real *const q = all->q + s * N, *const qd = all->qd + s * N;
    copy(N, state, q);
    copy(N, state + N, qd);
    if (!all->wanted->constraints) {
        form_free(all, q, qd, &m->equations);
    } else {
        int why;
        if (stage == BEGUN) {
            (void)read_joints(&at->x);
            why = begin_course(&at->x, &m->course, q);
        } else {
            take_hold(at, &m->course, s);
            why = stage == ENDED ? settle(&at->x, &m->course, &at->held, q) : place_beside(&at->x, &m->course, &at->held, q);
        }
        if (why)
            return is_finite(STATE, state) ? why : IS_NOT_FINITE;
        form_tied(all, &at->x, s, qd);
    }
    if (stage != WITHIN) {
        copy(N, q, m->state);
        copy(N, qd, m->state + N);
        m->state[2 * N] = state[2 * N];
    }
    m->lost = lost_power(all, qd);
    return 0;
}

/* Torques of all motions where they are; 0, or what the controller answers with, below 0, where no status of ours is. */
static int drive(const struct simulated *all, double time)
{
    const API(simulation) *const wanted = all->wanted;
    if (!wanted->controller)
        return 0;
    const int said = wanted->controller(wanted->context, time, all->count, all->q, all->qd, all->tau);
    return said > 0 ? -said : said;
}

/* The slopes of motion s under its torques. */
static int find_slopes(const struct simulated *all, size_t s)
{
    struct moving *const m = all->moving + s;
    const real *const qd = all->qd + s * N, *const tau = all->tau + s * N;
    real *const qdd = m->slope + N;
    const int why = all->wanted->constraints ? accelerate_independent(N - all->bound, &m->equations, tau, qdd)
                                             : accelerate(m->equations.inertia, m->equations.rest, tau, qdd);
    if (why)
        return is_finite(N, all->q + s * N) && is_finite(N, qd) && is_finite(N, tau) ? HAS_NO_INERTIA : IS_NOT_FINITE;
    copy(N, qd, m->slope);
    m->slope[2 * N] = -m->lost;
    for (int i = 0; i < N; ++i)
        m->slope[2 * N] += qd[i] * tau[i];
    return 0;
}

/* A step of all motions: y + h/6 (k1 + 2 k2 + 2 k3 + k4). */
static int take_step(const struct simulated *all, struct held_sample *at, double begin, double length)
{
    static const real weights[] = {1, 2, 2, 1};
    const double middle = begin + length / 2, last = begin + length, times[] = {begin, middle, middle, last};
    const real h = (real)length, ways[] = {h / 2, h / 2, h, h / 6};
    ALIGNED real state[STATE];
    for (int k = 0; k < 4; ++k) {
        int why = drive(all, times[k]);
        for (size_t s = 0; !why && s < all->count; ++s) {
            struct moving *const m = all->moving + s;
            why = find_slopes(all, s);
            for (int e = 0; e < STATE; ++e) {
                m->sum[e] = (k ? m->sum[e] : R(0.0)) + weights[k] * m->slope[e];
                state[e] = m->state[e] + ways[k] * (k == 3 ? m->sum[e] : m->slope[e]);
            }
            if (!why)
                why = form(all, at, s, k == 3 ? ENDED : WITHIN, state);
        }
        if (why)
            return why;
    }
    return 0;
}

/* From instant to instant, in as many equal steps as make none longer than is wanted. */
static int take_steps(const struct simulated *all, struct held_sample *at, double begin, double until)
{
    const double wanted = all->wanted->step;
    size_t steps = 1;
    if (wanted > 0) {
        const double ratio = (until - begin) / wanted * (1 - 1e-12);
        if (!(ratio < 4e9))
            return IS_UNKNOWN;
        steps = ratio > 1 ? (size_t)ratio : 1;
        steps += (double)steps < ratio;
    }
    const double length = (until - begin) / (double)steps;
    for (size_t k = 0; k < steps; ++k) {
        const int why = take_step(all, at, begin + (double)k * length, length);
        if (why)
            return why;
    }
    return 0;
}

/* Where the results of an instant go. */
struct courses {
    real *positions, *velocities, *torques, *work;
};

/* The motions at an instant, with the torques there; 0, or why there are none. */
static int tell(const struct simulated *all, double time, size_t row, const struct courses *to)
{
    const size_t size = all->count * N, at = row * size;
    if (!is_finite(size, all->q) || !is_finite(size, all->qd))
        return IS_NOT_FINITE;
    const int why = drive(all, time);
    if (why)
        return why;
    if (to->positions)
        copy(size, all->q, to->positions + at);
    if (to->velocities)
        copy(size, all->qd, to->velocities + at);
    if (to->torques)
        copy(size, all->tau, to->torques + at);
    for (size_t s = 0; to->work && s < all->count; ++s)
        to->work[row * all->count + s] = all->moving[s].state[2 * N];
    if (all->wanted->reached)
        *all->wanted->reached = row + 1;
    return 0;
}

/* Whether instants are finite and ascending, and the step is one. */
static int can_be_taken(const API(simulation) *wanted)
{
    const double *const time = wanted->time;
    for (size_t row = 0; row < wanted->instants; ++row)
        if (!(time[row] - time[row] == 0) || (row && !(time[row] > time[row - 1])))
            return 0;
    return wanted->step >= 0 && wanted->step - wanted->step == 0;
}

/* All motions where they begin. */
static int begin_motions(const struct simulated *all, struct held_sample *at, const real *q, const real *qd)
{
    const API(simulation) *const wanted = all->wanted;
    if (wanted->reached)
        *wanted->reached = 0;
    at->of = all->count;
    at->x.c = wanted->constraints;
    at->x.o = all->o;
    at->x.numbers = all->numbers;
    if (!can_be_taken(wanted) || (wanted->constraints && (count_rows(wanted->constraints) < 0 || !read_joints(&at->x))))
        return IS_UNKNOWN;
    for (size_t s = 0; s < all->count; ++s) {
        ALIGNED real state[STATE];
        copy(N, q + s * N, state);
        copy(N, qd + s * N, state + N);
        state[2 * N] = 0;
        const int why = form(all, at, s, BEGUN, state);
        if (why)
            return why;
    }
    clear(all->count * N, all->tau);
    if (wanted->tau)
        copy(all->count * N, wanted->tau, all->tau);
    return 0;
}

int API(simulate)(size_t count, AT_REST, const API(simulation) *wanted, real *scratch, real *positions, real *velocities,
    real *torques, real *work)
{
    NUMBERS(numbers);
    OFFSETS(o);
    struct held_sample at;
    const struct courses to = {positions, velocities, torques, work};
    real *const own_tau = scratch + 2 * count * N;
    struct moving *const moving = (struct moving *)(void *)(own_tau + count * N);
#ifdef PASSIVE
    const int own = !wanted->of_links;
#else
    const int own = 0;
#endif
    const int bound = wanted->constraints ? N - wanted->constraints->freedoms : 0;
    const struct simulated all = {wanted, numbers, o, count, own, bound, scratch, scratch + count * N, own_tau, moving};
    int why = begin_motions(&all, &at, q, qd);
    for (size_t row = 0; !why && row < wanted->instants; ++row) {
        if (row)
            why = take_steps(&all, &at, wanted->time[row - 1], wanted->time[row]);
        if (!why)
            why = tell(&all, wanted->time[row], row, &to);
    }
    return why;
}
