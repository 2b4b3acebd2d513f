/* Induced accelerations of joints that ties move. The same in every package of linkwise.

   Each source x of forces F_x on the joints accelerates them by G (G' M G)^-1 G' F_x and asks ties for lambda_x,
       qdd_x = L F_x        lambda_x = A_d+' (M qdd_x - F_x) = K F_x        L = G (G' M G)^-1 G'
   and the ties' own source, which turn and shift with the motion, by b = -A_d+ dA/dt qd, for b - L M b.

   The file that includes this one says by AT_REST what functions are given. */

/* Sides of a matrix (N, rows of PITCH) times another (N, N), and, as L is symmetric, the other way round. */
static void times_matrix(const real *matrix_of, const real *by, real *product_of)
{
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < N; k += LANES) {
            lanes sum = {0};
            for (int e = 0; e < N; ++e)
                sum += matrix_of[i * N + e] * LANES_FROM(by + e * PITCH + k);
            LANES_AT(product_of + i * PITCH + k) = sum;
        }
}

/* What rows bear of torques (N, rows of PITCH): A_d+' times these, (rows, N). */
static void bear_sides(const struct tied *x, const real *bearing, const real *torque, real *forces)
{
    for (int r = 0; r < x->t.rows; ++r)
        for (int k = 0; k < N; ++k) {
            real sum = 0;
            for (int i = 0; i < N; ++i)
                sum += bearing[i * BORNE + r] * torque[i * PITCH + k];
            forces[r * N + k] = sum;
        }
}

/* L (N, N) of a mass matrix; 0, or why there is none. */
static int find_response(const struct tied *x, const real *mass, real *response)
{
    const int m = x->free;
    ALIGNED real small[N * N], size[N] = {0}, sides[N * 6], inverse[N * N];
    reduce_inertia(x, mass, small);
    for (int a = 0; a < m; ++a)
        size[a] = small[a * m + a];
    for (int first = 0; first < m; first += 6) {
        const int some = m - first < 6 ? m - first : 6;
        struct pivot weakest = {0, 1};
        clear((size_t)(m * some), sides);
        for (int k = 0; k < some; ++k)
            sides[(first + k) * some + k] = 1;
        if (eliminate(0, m, some, size, small, sides, &weakest) || vague(&weakest))
            return HAS_NO_INERTIA;
        for (int a = 0; a < m; ++a)
            copy((size_t)some, sides + a * some, inverse + a * m + first);
    }
    for (int i = 0; i < N; ++i) {
        ALIGNED real part[N];
        for (int a = 0; a < m; ++a) {
            part[a] = 0;
            for (int b = 0; b < m; ++b)
                part[a] += x->map[i * PITCH + b] * inverse[b * m + a];
        }
        for (int k = 0; k < N; ++k) {
            real sum = 0;
            for (int a = 0; a < m; ++a)
                sum += part[a] * x->map[k * PITCH + a];
            response[i * N + k] = sum;
        }
    }
    return 0;
}

/* Where the answers of a sample go. */
struct responses {
    real *velocity, *response, *reactions, *accelerations, *forces;
};

static int respond(struct tied *x, int own, const struct responses *to)
{
    ALIGNED real mass[N * N], sides[N * PITCH], torque[N * PITCH], caused[N * PITCH], changes[ROWS * PITCH], bearing[N * BORNE];
    inertia_of(x, own, mass);
    const int why = find_response(x, mass, to->response);
    if (why)
        return why;
    copy(N, x->qd, to->velocity);
    find_bearing(x, bearing);
    clear((size_t)(N * PITCH), sides);
    for (int i = 0; i < N; ++i)
        copy(N, to->response + i * N, sides + i * PITCH);
    times_matrix(mass, sides, torque);
    for (int i = 0; i < N; ++i)
        torque[i * PITCH + i] -= 1;
    bear_sides(x, bearing, torque, to->reactions);
    caused_by_velocities(x, changes, caused);
    times_matrix(mass, caused, torque);
    times_matrix(to->response, torque, sides);
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < N; ++k) {
            sides[i * PITCH + k] = caused[i * PITCH + k] - sides[i * PITCH + k];
            to->accelerations[i * N + k] = sides[i * PITCH + k];
        }
    times_matrix(mass, sides, torque);
    bear_sides(x, bearing, torque, to->forces);
    return 0;
}

static int tied_responses(size_t count, const struct numbers *numbers, const struct offsets *o, const real *q, const real *qd,
    const API(constraints) *constraints, int own, const struct responses *first)
{
    ALIGNED struct tied x;
    for (size_t s = 0; s < count; ++s) {
        int why = observe_tied(&x, numbers, o, constraints, q + s * N);
        if (why)
            return why;
        move_tied(&x, qd + s * N, NULL);
        const size_t rows = s * (size_t)x.t.rows * N;
        const struct responses to = {first->velocity + s * N, first->response + s * N * N, first->reactions + rows,
            first->accelerations + s * N * N, first->forces + rows};
        why = respond(&x, own, &to);
        if (why)
            return why;
    }
    return 0;
}

int API(constrained_response)(size_t count, AT_REST, const API(constraints) *constraints, real *velocity, real *response,
    real *reactions, real *accelerations, real *forces)
{
    NUMBERS(x);
    OFFSETS(o);
    const struct responses to = {velocity, response, reactions, accelerations, forces};
    return tied_responses(count, x, o, q, qd, constraints, 1, &to);
}
#ifdef PASSIVE

int API(constrained_response_of_links)(size_t count, AT_REST, const API(constraints) *constraints, real *velocity,
    real *response, real *reactions, real *accelerations, real *forces)
{
    NUMBERS(x);
    OFFSETS(o);
    const struct responses to = {velocity, response, reactions, accelerations, forces};
    return tied_responses(count, x, o, q, qd, constraints, 0, &to);
}
#endif
