/* Closed places along a motion, and the independent joints that change on its way, as tied_motion.py has them. The same in every
   package of linkwise.

   Where independent joints come to tell little of the others, as at a crank's dead point, a motion goes on with others, which
   pivoting finds: the motion itself does not depend on the choice. */

/* Parts of what was left of columns of A_d where joints were chosen: where less is left they tell nothing, and where others are
   looked for; and a way of dependent joints, in rad and m, that is far from where they follow in a straight line. */
#define DEAD R(1e-3)
#define WEAK R(0.5)
#define FAR R(0.1)

/* A motion's own: which joints are dependent, then which are independent, what was left where they were chosen, and where contacts
   took hold; then, where the last step ended, q, G by the numbers of the joints that were independent there, the reflectors of A_d = Q R, and Q' A (d, N). */
struct course {
    real joint[N], left, weak, held[N], q[N], map[N * N], reflector[N * ROWS], twice[N], rows[N * N];
};

static void take_joints(const struct course *c, struct tied *x)
{
    for (int i = 0; i < N; ++i)
        x->joint[i] = (short)c->joint[i];
}

static void keep_joints(const struct tied *x, real left, struct course *c)
{
    for (int i = 0; i < N; ++i)
        c->joint[i] = (real)x->joint[i];
    c->left = left;
    c->weak = WEAK;
}

/* The least part of a column of R that is left normal to those before it. */
static real least_left(const struct tied *x)
{
    real least = 1;
    for (int f = 0; f < x->bound; ++f) {
        real square = 0;
        for (int r = 0; r <= f; ++r)
            square += x->factor[r * PITCH + f] * x->factor[r * PITCH + f];
        const real part = square > 0 ? F(fabs)(x->factor[f * PITCH + f]) / F(sqrt)(square) : R(0.0);
        least = part < least ? part : least;
    }
    return least;
}

/* A, with rows divided by their sizes; rows of PITCH. */
static void scaled_rows(const struct tied *x, real *rows)
{
    for (int r = 0; r < x->t.rows; ++r)
        for (int k = 0; k < PITCH; ++k)
            rows[r * PITCH + k] = k < N ? x->t.jacobian[r * N + k] / x->size[r] : R(0.0);
}

/* The column, of those that are not taken, of which the most is left. */
static int largest_column(const real *rows, int count, const char *taken)
{
    int column = -1;
    real most = -1;
    for (int k = 0; k < N; ++k) {
        real square = 0;
        for (int r = 0; r < count; ++r)
            square += rows[r * PITCH + k] * rows[r * PITCH + k];
        if (!taken[k] && (column < 0 || square > most)) {
            column = k;
            most = square;
        }
    }
    return column;
}

/* Dependent joints by pivoting in A, whose sizes are known; A = Q R for these, and the least part that is left. */
static real choose_joints(struct tied *x)
{
    ALIGNED real rows[ROWS * PITCH], axis[ROWS];
    char taken[N] = {0};
    scaled_rows(x, rows);
    for (int f = 0; f < x->bound; ++f) {
        const int pivot = largest_column(rows, x->t.rows, taken);
        real square = 0;
        for (int r = 0; r < x->t.rows; ++r)
            square += rows[r * PITCH + pivot] * rows[r * PITCH + pivot];
        taken[pivot] = 1;
        const real inverse = 1 / F(sqrt)(square);
        for (int r = 0; r < x->t.rows; ++r)
            axis[r] = rows[r * PITCH + pivot] * inverse;
        for (int twice = 0; twice < 2; ++twice) /* once more for what rounding leaves */
            reflect(0, x->t.rows, N, axis, 1, rows);
    }
    for (int k = 0, f = 0, own = x->bound; k < N; ++k)
        x->joint[taken[k] ? f++ : own++] = (short)k;
    return factor_rows(x, NULL) ? least_left(x) : R(0.0);
}

/* The same at a position. */
static real choose_joints_at(struct tied *x, const real *q)
{
    stand(x->numbers, q, &x->at);
    rows_at(x->c, &x->at, &x->at, x->o, &x->t);
    factor_rows(x, NULL);
    return choose_joints(x);
}

/* Closes ties from q by the joints of x, and finds how others follow there; 0, or why not. */
static int follow_from(struct tied *x, const struct standing *held, real *q)
{
    const int why = close_ties(x, held, q);
    if (why)
        return why;
    copy(N, q, x->at.q);
    find_map(x);
    return is_contradicted(x) ? IS_CONTRADICTED : 0;
}

/* q near to where dependent joints follow from the last step in a straight line. */
static void lead(const struct tied *x, const struct course *c, real *q)
{
    ALIGNED real led[N];
    int is_far = 0;
    for (int p = 0; p < x->c->contacts; ++p)
        if (x->c->contact[p].kind == HELD_ROLLING)
            return;
    for (int i = 0; i < N; ++i) {
        led[i] = c->q[i];
        for (int k = 0; k < N; ++k)
            led[i] += c->map[i * N + k] * (q[k] - c->q[k]);
        is_far |= F(fabs)(q[i] - led[i]) > FAR;
    }
    if (is_far)
        copy(N, led, q);
}

/* Closes ties beside q, by other independent joints where those of the course tell nothing; 0, or IS_LOST. */
static int place_beside(struct tied *x, struct course *c, const struct standing *held, real *q)
{
    ALIGNED real near[N];
    lead(x, c, q);
    copy(N, q, near);
    take_joints(c, x);
    if (!follow_from(x, held, q) && least_left(x) >= DEAD * c->left)
        return 0;
    const real left = choose_joints_at(x, c->q);
    copy(N, near, q);
    if (follow_from(x, held, q))
        return IS_LOST;
    keep_joints(x, left, c);
    return least_left(x) >= DEAD * left ? 0 : IS_LOST;
}

/* Whether the determinant of a matrix, which it overwrites, is below zero. */
static int is_negative(int d, real *a)
{
    int negative = 0;
    for (int c = 0; c < d; ++c) {
        int row = c;
        for (int r = c + 1; r < d; ++r)
            if (F(fabs)(a[r * d + c]) > F(fabs)(a[row * d + c]))
                row = r;
        const real pivot = a[row * d + c];
        if (!(F(fabs)(pivot) > 0))
            return 0;
        negative ^= (pivot < 0) ^ (row != c);
        for (int k = c; k < d; ++k) {
            const real kept = a[c * d + k];
            a[c * d + k] = a[row * d + k];
            a[row * d + k] = kept;
        }
        for (int r = c + 1; r < d; ++r)
            for (int k = d; k-- > c;) /* column c last, which all others need */
                a[r * d + k] -= a[r * d + c] / pivot * a[c * d + k];
    }
    return negative;
}

/* Whether det (Q' A) (Q' A_now)' is below zero, Q' A being that of the last step: then A has lost rank on the way. */
static int has_turned(const struct tied *x, const struct course *c)
{
    const int d = x->bound;
    ALIGNED real now[ROWS * PITCH], minors[N * N];
    scaled_rows(x, now);
    for (int f = 0; f < d; ++f)
        reflect(f, x->t.rows, N, c->reflector + f * ROWS, c->twice[f], now);
    for (int f = 0; f < d; ++f)
        for (int g = 0; g < d; ++g) {
            minors[f * d + g] = 0;
            for (int k = 0; k < N; ++k)
                minors[f * d + g] += c->rows[f * N + k] * now[g * PITCH + k];
        }
    return is_negative(d, minors);
}

/* The end of a step is where the next one begins. */
static void remember(const struct tied *x, const real *q, struct course *c)
{
    ALIGNED real now[ROWS * PITCH];
    const size_t d = (size_t)x->bound;
    copy(N, q, c->q);
    copy(d * ROWS, x->reflector, c->reflector);
    copy(d, x->twice, c->twice);
    scaled_rows(x, now);
    for (int f = 0; f < x->bound; ++f)
        reflect(f, x->t.rows, N, x->reflector + f * ROWS, x->twice[f], now);
    for (size_t f = 0; f < d; ++f)
        copy(N, now + f * PITCH, c->rows + f * N);
    clear((size_t)(N * N), c->map);
    for (int i = 0; i < N; ++i)
        for (int a = 0; a < x->free; ++a)
            c->map[i * N + x->joint[x->bound + a]] = x->map[i * PITCH + a];
}

/* Other independent joints at a closed place, where those of the course tell less than `weak`; the place is then that of these. */
static void choose_in_time(struct tied *x, struct course *c, const struct standing *held, real *q)
{
    ALIGNED real other[N];
    const real part = least_left(x) / c->left;
    if (!(part < c->weak))
        return;
    copy(N, q, other);
    const real left = choose_joints(x);
    if (!follow_from(x, held, other)) {
        keep_joints(x, left, c);
        copy(N, other, q);
        return;
    }
    c->weak = part / 2;
    take_joints(c, x);
    (void)follow_from(x, held, q);
}

/* Closes ties at the end of a step. Within a step other joints would cost its order, for its stages are less exact than its end. */
static int settle(struct tied *x, struct course *c, const struct standing *held, real *q)
{
    if (place_beside(x, c, held, q) || has_turned(x, c))
        return IS_LOST;
    choose_in_time(x, c, held, q);
    remember(x, q, c);
    return 0;
}

/* Closes ties at the start, where contacts take hold too; 0, or why not. */
static int begin_course(struct tied *x, struct course *c, real *q)
{
    ALIGNED struct standing held;
    ALIGNED real start[N];
    copy(N, q, start);
    stand(x->numbers, start, &held);
    const int why = follow_from(x, &held, q);
    if (why) {
        (void)choose_joints_at(x, start);
        copy(N, start, q);
        if (follow_from(x, &held, q))
            return why;
    }
    keep_joints(x, least_left(x), c);
    copy(N, q, c->held);
    remember(x, q, c);
    return 0;
}
