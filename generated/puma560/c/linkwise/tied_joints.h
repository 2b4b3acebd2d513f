/* Joints that follow others where ties close. The same in every package of linkwise.

   Dependent joints d follow the independent ones y where A qd = 0:
       A_d = Q R    A_d+ = R^-1 Q'    G_d = -A_d+ A_y    lambda = A_d+' tau_d
   by Householder's reflections (G. Golub, C. Van Loan, Matrix Computations, section 5.2). A_d is tall and of full column rank,
   so that redundant rows need no case of their own: lambda is then the solution of the least sum of squares. A coupling's
   row is divided by its largest slope, where that is above 1.

   Matrices of several sides have rows of PITCH numbers, so many that whole vectors of LANES may be taken of each from any side on. */

/* Parts of a column at or below which only rounding is left of it, and of rows that contradict those they follow from. */
#ifdef LINKWISE_FLOAT
#define LOST R(2.422e-5)
#define CONTRADICTS R(1e-3)
#define CLOSABLE R(1e-4)
#define NEAR R(1e-4)
#define SETTLED R(1e-6)
#else
#define LOST R(3.667e-11)
#define CONTRADICTS R(1e-4)
#define CLOSABLE R(1e-6)
#define NEAR R(1e-8)
#define SETTLED R(1e-12)
#endif
#define OPEN R(1e-4)

/* What functions answer with where they have no answer; NAME.h has names for them. */
enum {
    IS_OPEN = 1,
    IS_SINGULAR,
    IS_CONTRADICTED,
    IS_UNCLOSED,
    HAS_NO_INERTIA,
    IS_UNKNOWN,
    IS_LOST,
    IS_NOT_POSITIVE,
    IS_UNDRIVEN,
    IS_NOT_FINITE,
    IS_STUCK,
    IS_HALF_A_TURN
};

enum { PITCH = (N + 2 * LANES - 1) / LANES * LANES, BORNE = (ROWS + LANES - 1) / LANES * LANES };

/* Steps of Newton's method, and the longest one, in rad and m. */
enum { STEPS = 50 };
#define LONGEST_STEP R(0.5)

/* A sample: its frames and links, its rows, and how joints follow: `joint` lists the dependent ones, then the independent ones;
   `factor` has A scaled, its columns in this order, R in place of A_d and Q' A_y in place of A_y; `map` is G, of which `free`
   columns count, and `map_rate` is dG/dt. */
struct tied {
    const API(constraints) *c;
    const struct offsets *o;
    const struct numbers *numbers;
    struct standing at;
    ALIGNED struct tie_rows t;
    int free, bound;
    short joint[N];
    ALIGNED real size[ROWS], factor[ROWS * PITCH], reflector[N * ROWS], twice[N], map[N * PITCH], map_rate[N * PITCH], qd[N], bias[N];
};

/* Which joints follow which; 0 where these are not joints, ascending. */
static int read_joints(struct tied *x)
{
    const API(constraints) *const c = x->c;
    int own = 0;
    x->free = c->freedoms;
    x->bound = N - c->freedoms;
    if (x->free < 0 || x->bound < 0)
        return 0;
    for (int k = 0, other = 0; k < N; ++k) {
        if (own < x->free && c->independent[own] == k)
            x->joint[x->bound + own++] = (short)k;
        else if (other < x->bound)
            x->joint[other++] = (short)k;
        else
            return 0;
    }
    return own == x->free;
}

/* Rows `first` to `rows` of x less v (v . x) twice, for whole vectors of sides. */
static inline void reflect(int first, int rows, int width, const real *v, real twice, real *x)
{
    for (int k = 0; k < width; k += LANES) {
        lanes sum = {0};
        for (int r = first; r < rows; ++r)
            sum += v[r] * LANES_FROM(x + r * PITCH + k);
        sum *= twice;
        for (int r = first; r < rows; ++r)
            LANES_AT(x + r * PITCH + k) -= v[r] * sum;
    }
}

/* The same of a single side, whose numbers stand one behind another. */
static inline void reflect_one_side(int first, int rows, const real *v, real twice, real *x)
{
    real sum = 0;
    for (int r = first; r < rows; ++r)
        sum += v[r] * x[r];
    for (int r = first; r < rows; ++r)
        x[r] -= v[r] * (sum * twice);
}

/* Turns column f of x, from row f on, along its first entry, which is then the answer; `v` and `twice` are the reflector, which
   `reflect` applies to the columns behind it. */
static real turn_column(int f, int rows, real *x, real *v, real *twice)
{
    real square = 0;
    for (int r = f; r < rows; ++r) {
        v[r] = x[r * PITCH + f];
        square += v[r] * v[r];
    }
    const real left = F(sqrt)(square), kept = v[f] > 0 ? -left : left;
    *twice = 1 / (square - v[f] * kept);
    v[f] -= kept;
    return x[f * PITCH + f] = kept;
}

/* A_d = Q R, or 0 where A_d has lost its rank; with weights W of the rows' forces that of W^-1/2 A_d, so that redundant rows
   bear the least sum of weighted squares. */
static int factor_rows(struct tied *x, const real *weight)
{
    const int rows = x->t.rows, d = x->bound;
    for (int r = 0; r < rows; ++r) {
        real most = 0;
        for (int k = 0; r >= x->t.first_coupling && k < N; ++k)
            most = F(fabs)(x->t.jacobian[r * N + k]) > most ? F(fabs)(x->t.jacobian[r * N + k]) : most;
        x->size[r] = (most > 1 ? most : 1) * (weight ? F(sqrt)(weight[r]) : 1);
        const real inverse = 1 / x->size[r];
        for (int k = 0; k < PITCH; ++k)
            x->factor[r * PITCH + k] = k < N ? x->t.jacobian[r * N + x->joint[k]] * inverse : R(0.0);
    }
    if (rows < d)
        return 0;
    for (int f = 0; f < d; ++f) {
        real *const v = x->reflector + f * ROWS, above = 0;
        for (int r = 0; r < f; ++r)
            above += x->factor[r * PITCH + f] * x->factor[r * PITCH + f];
        const real left = turn_column(f, rows, x->factor, v, &x->twice[f]), square = left * left;
        if (!(square > LOST * LOST * (square + above)))
            return 0;
        reflect(f, rows, N - f - 1, v, x->twice[f], x->factor + f + 1);
    }
    return 1;
}

/* R^-1 x, for the first rows of x; each row is subtracted from those above it. */
static void solve_above(const struct tied *x, int width, real *sides)
{
    for (int f = x->bound; f-- > 0;) {
        const real inverse = 1 / x->factor[f * PITCH + f];
        for (int k = 0; k < width; k += LANES) {
            const lanes row = LANES_FROM(sides + f * PITCH + k) * inverse;
            LANES_AT(sides + f * PITCH + k) = row;
            for (int g = 0; g < f; ++g)
                LANES_AT(sides + g * PITCH + k) -= x->factor[g * PITCH + f] * row;
        }
    }
}

/* -A_d+ x on the dependent joints, and nothing on the independent ones, for x (rows, width), which it overwrites. */
static void follow(const struct tied *x, int width, real *sides, real *moved)
{
    for (int r = 0; r < x->t.rows; ++r)
        for (int k = 0; k < width; ++k)
            sides[r * PITCH + k] /= x->size[r];
    for (int f = 0; f < x->bound; ++f)
        reflect(f, x->t.rows, width, x->reflector + f * ROWS, x->twice[f], sides);
    solve_above(x, width, sides);
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < PITCH; ++k)
            moved[x->joint[i] * PITCH + k] = i < x->bound && k < width ? -sides[i * PITCH + k] : R(0.0);
}

/* Of a single side x (rows): Q' x, R^-1 of its first rows, and Q x. */
static void to_factors(const struct tied *x, real *side)
{
    for (int f = 0; f < x->bound; ++f)
        reflect_one_side(f, x->t.rows, x->reflector + f * ROWS, x->twice[f], side);
}

static void from_factors(const struct tied *x, real *side)
{
    for (int f = x->bound; f-- > 0;)
        reflect_one_side(f, x->t.rows, x->reflector + f * ROWS, x->twice[f], side);
}

/* -A_d+ x of a single side on all joints, which it overwrites. */
static void follow_one_side(const struct tied *x, real *side, real *moved)
{
    clear(N, moved);
    for (int r = 0; r < x->t.rows; ++r)
        side[r] /= x->size[r];
    to_factors(x, side);
    for (int f = x->bound; f-- > 0;) {
        side[f] /= x->factor[f * PITCH + f];
        for (int g = 0; g < f; ++g)
            side[g] -= x->factor[g * PITCH + f] * side[f];
        moved[x->joint[f]] = -side[f];
    }
}

/* lambda = A_d+' tau_d of torques on all joints. */
static void bear(const struct tied *x, const real *torque, real *forces)
{
    clear((size_t)x->t.rows, forces);
    for (int f = 0; f < x->bound; ++f) {
        real left = torque[x->joint[f]];
        for (int g = 0; g < f; ++g)
            left -= x->factor[g * PITCH + f] * forces[g];
        forces[f] = left / x->factor[f * PITCH + f];
    }
    from_factors(x, forces);
    for (int r = 0; r < x->t.rows; ++r)
        forces[r] /= x->size[r];
}

/* A_d+ on the dependent joints, rows of BORNE numbers, zeros on the others: row by row, (R^-1 Q')' is Q R^-1'. */
static void find_bearing(const struct tied *x, real *bearing)
{
    ALIGNED real sides[ROWS * PITCH];
    clear((size_t)(N * BORNE), bearing);
    clear((size_t)(x->t.rows * PITCH), sides);
    for (int f = 0; f < x->bound; ++f) {
        sides[f * PITCH + f] = 1;
        for (int k = 0; k <= f; k += LANES) {
            lanes left = LANES_FROM(sides + f * PITCH + k);
            for (int g = 0; g < f; ++g)
                left -= x->factor[g * PITCH + f] * LANES_FROM(sides + g * PITCH + k);
            LANES_AT(sides + f * PITCH + k) = left / x->factor[f * PITCH + f];
        }
    }
    for (int f = x->bound; f-- > 0;)
        reflect(f, x->t.rows, x->bound, x->reflector + f * ROWS, x->twice[f], sides);
    for (int r = 0; r < x->t.rows; ++r)
        for (int f = 0; f < x->bound; ++f)
            bearing[x->joint[f] * BORNE + r] = sides[r * PITCH + f] / x->size[r];
}

/* Square of the length of a row of A_d+, which is that of R^-1. */
static real square_of_row(const struct tied *x, int f)
{
    ALIGNED real row[N];
    real square = 0;
    for (int g = f; g < x->bound; ++g) {
        row[g] = g == f;
        for (int h = f; h < g; ++h)
            row[g] -= row[h] * x->factor[h * PITCH + g];
        row[g] /= x->factor[g * PITCH + g];
        square += row[g] * row[g];
    }
    return square;
}

/* G, from the factors, which are then no more than R. Of joints that ties hold where they are only rounding is left,
   |G_ia| <= 4 N EPSILON |A_d+ row i| |A_y column a|, whose sign would be that of their Coulomb friction: these get zeros. */
static void find_map(struct tied *x)
{
    const int m = x->free, d = x->bound;
    ALIGNED real reach[N] = {0};
    for (int r = 0; r < x->t.rows; ++r)
        for (int a = 0; a < m; ++a)
            reach[a] += x->factor[r * PITCH + d + a] * x->factor[r * PITCH + d + a];
    solve_above(x, m, x->factor + d);
    for (int i = 0; i < N; ++i) {
        real *const row = x->map + x->joint[i] * PITCH;
        for (int a = 0; a < PITCH; ++a)
            row[a] = a >= m ? R(0.0) : i < d ? -x->factor[i * PITCH + d + a] : (real)(i - d == a);
        const real rounding = i < d ? ROUNDING(N) * ROUNDING(N) * square_of_row(x, i) : R(0.0);
        int moves = i >= d;
        for (int a = 0; a < m; ++a)
            moves |= row[a] * row[a] > rounding * reach[a];
        for (int a = 0; a < m && !moves; ++a)
            row[a] = 0;
    }
}

/* Whether redundant rows contradict those they follow from, A G being not 0 beside the largest row of their tie. */
static int is_contradicted(const struct tied *x)
{
    ALIGNED real most[N] = {0};
    if (x->t.rows == x->bound)
        return 0;
    for (int k = 0; k < N; ++k)
        for (int a = 0; a < x->free; ++a)
            most[a] = F(fabs)(x->map[k * PITCH + a]) > most[a] ? F(fabs)(x->map[k * PITCH + a]) : most[a];
    for (int first = 0, last = 0; first < x->t.rows; first = last) {
        real largest = 0;
        for (last = first; last < x->t.rows && x->t.owner[last] == x->t.owner[first]; ++last)
            for (int k = 0; k < N; ++k)
                if (F(fabs)(x->t.jacobian[last * N + k]) / x->size[last] > largest)
                    largest = F(fabs)(x->t.jacobian[last * N + k]) / x->size[last];
        for (int r = first; r < last; ++r)
            for (int a = 0; a < x->free; ++a) {
                real sum = 0;
                for (int k = 0; k < N; ++k)
                    sum += x->t.jacobian[r * N + k] * x->map[k * PITCH + a];
                if (!(F(fabs)(sum) / x->size[r] <= CONTRADICTS * largest * most[a]))
                    return 1;
            }
    }
    return 0;
}

/* Whether rows are open by more than is allowed; without a tolerance also by what joints could close, Q Q' phi. */
static int is_open(const struct tied *x)
{
    const real given = x->c->tolerance, allowed = given > 0 ? given : OPEN;
    ALIGNED real part[ROWS];
    for (int r = 0; r < x->t.rows; ++r) {
        part[r] = x->t.violation[r] / x->size[r];
        if (!(F(fabs)(part[r]) <= allowed))
            return 1;
    }
    if (given > 0)
        return 0;
    if (x->t.rows > x->bound) {
        to_factors(x, part);
        for (int r = x->bound; r < x->t.rows; ++r)
            part[r] = 0;
        from_factors(x, part);
    }
    for (int r = 0; r < x->t.rows; ++r)
        if (!(F(fabs)(part[r]) <= CLOSABLE))
            return 1;
    return 0;
}

/* How joints follow at q, where ties close; 0, or why there is no answer. Links do not move yet. */
static int observe_tied(struct tied *x, const struct numbers *numbers, const struct offsets *o, const API(constraints) *c,
    const real *q)
{
    x->c = c;
    x->o = o;
    x->numbers = numbers;
    if (count_rows(c) < 0 || !read_joints(x))
        return IS_UNKNOWN;
    stand(numbers, q, &x->at);
    rows_at(c, &x->at, &x->at, o, &x->t);
    if (!factor_rows(x, NULL))
        return IS_SINGULAR;
    if (is_open(x))
        return IS_OPEN;
    find_map(x);
    if (is_contradicted(x))
        return IS_CONTRADICTED;
    if (c->weight && x->t.rows > x->bound && !factor_rows(x, c->weight))
        return IS_SINGULAR;
    return 0;
}

/* A matrix (rows, N) times G. */
static void times_map(const struct tied *x, int rows, const real *matrix_of, real *product_of)
{
    for (int r = 0; r < rows; ++r)
        for (int a = 0; a < x->free; a += LANES) {
            lanes sum = {0};
            for (int k = 0; k < N; ++k)
                sum += matrix_of[r * N + k] * LANES_FROM(x->map + k * PITCH + a);
            LANES_AT(product_of + r * PITCH + a) = sum;
        }
}

/* Velocities that follow those of the independent joints. */
static void follow_velocities(struct tied *x, const real *qd)
{
    ALIGNED const real rest[N] = {0};
    for (int i = 0; i < N; ++i) {
        x->qd[i] = 0;
        for (int a = 0; a < x->free; ++a)
            x->qd[i] += x->map[i * PITCH + a] * qd[x->joint[x->bound + a]];
    }
    set_motion(&x->at.s.m, x->qd, rest);
}

/* These, and what they change: dA/dt and the accelerations -A_d+ dA/dt qd; then accelerations that follow, where qdd is given. */
static void move_tied(struct tied *x, const real *qd, const real *qdd)
{
    ALIGNED real side[ROWS], acceleration[N];
    follow_velocities(x, qd);
    rates_at(x->c, &x->at, x->o, x->qd, &x->t);
    for (int r = 0; r < x->t.rows; ++r)
        side[r] = dot(N, x->t.rate + r * N, x->qd);
    follow_one_side(x, side, x->bias);
    if (!qdd)
        return;
    for (int i = 0; i < N; ++i) {
        acceleration[i] = x->bias[i];
        for (int a = 0; a < x->free; ++a)
            acceleration[i] += x->map[i * PITCH + a] * qdd[x->joint[x->bound + a]];
    }
    set_motion(&x->at.s.m, x->qd, acceleration);
}

/* dG/dt, -A_d+ dA/dt G, in a motion. */
static void turn_map(struct tied *x)
{
    ALIGNED real sides[ROWS * PITCH];
    times_map(x, x->t.rows, x->t.rate, sides);
    follow(x, x->free, sides, x->map_rate);
}
