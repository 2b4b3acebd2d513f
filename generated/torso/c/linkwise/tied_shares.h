/* Shares and forces of joints that ties move. The same in every package of linkwise.

   With the wrenches of rule.h, c2 and c1 of joint i through link j by coordinate k are moves_i . c2_k and moves_i . c1_k. So those
   of the independent joints,
       c2^ = G' c2 G        c1^ = G' (c2 dG/dt + c1 G)        g^ = G' g
   are the same products of wrenches that G has summed up first, and what ties bear is the same again with A_d+ in place of
   the G on the left.

   The file that includes this one says by AT_REST and INPUTS what functions are given. */

/* Sums over a path of wrenches, each times its joint's row of a matrix: six rows of `width` numbers, `sides` apart as the rows are. */
static inline void project(const screw *wrench, const short *at, int length, const real *rows, int sides, int width, int more,
    real *to)
{
    for (int k = 0; k < width; k += LANES) {
        lanes a = {0}, b = {0}, c = {0}, d = {0}, e = {0}, f = {0};
        for (int i = 0; i < length; ++i) {
            const lanes by = LANES_FROM(rows + at[i] * sides + k);
            a += wrench[i].z.x * by;
            b += wrench[i].z.y * by;
            c += wrench[i].z.z * by;
            d += wrench[i].s.x * by;
            e += wrench[i].s.y * by;
            f += wrench[i].s.z * by;
        }
        lanes total[6] = {a, b, c, d, e, f};
        for (int r = 0; r < 6; ++r) {
            if (more)
                total[r] += LANES_FROM(to + r * sides + k);
            LANES_AT(to + r * sides + k) = total[r];
        }
    }
}

/* Numbers of a vector, as many as are wanted. */
static inline void put_some(lanes from, int wanted, real *to)
{
    ALIGNED real kept[LANES];
    if (wanted >= LANES) {
        LANES_AT(to) = from;
        return;
    }
    LANES_AT(kept) = from;
    for (int k = 0; k < wanted; ++k)
        to[k] = kept[k];
}

/* What wrenches do along motions, rows of `width`: to each of `loaded` rows, `step` apart. */
static inline void place_products(int loaded, const real *moves, int sides, int width, const real *wrench, size_t step, real *to)
{
    for (int a = 0; a < loaded; ++a, to += step)
        for (int k = 0; k < width; k += LANES) {
            lanes sum = moves[a] * LANES_FROM(wrench + k);
            for (int r = 1; r < 6; ++r)
                sum += moves[r * sides + a] * LANES_FROM(wrench + r * PITCH + k);
            put_some(sum, width - k, to + k);
        }
}

/* The same of the force of a weight alone. */
static inline void place_weights(int loaded, const real *moves, int sides, vector weight, real *to)
{
    for (int a = 0; a < loaded; ++a, to += LINKS)
        *to = moves[3 * sides + a] * weight.x + moves[4 * sides + a] * weight.y + moves[5 * sides + a] * weight.z;
}

/* Where the shares of a sample go, and the forces that ties bear; either may be NULL. */
struct tied_results {
    real *acceleration, *velocity, *gravity, *force_acceleration, *force_velocity, *force_gravity;
};

/* The shares of link j; the motions of the independent joints are 1 where coefficients are asked for. */
static void tied_link(const struct tied *x, int j, const real *bearing, const real *yd, const real *ydd,
    const struct tied_results *to)
{
    const int m = x->free, rows = x->t.rows, first = path_start[j], length = path_start[j + 1] - first;
    const moving_link *const l = &x->at.s.links[j];
    ALIGNED real moves[6 * PITCH], borne[6 * BORNE], c2[6 * PITCH], c1[6 * PITCH];
    wrenches w;
    columns_one(&x->at.s.m, l, columns + first, length, &w);
    project(w.c2, path + first, length, x->map, PITCH, m, 0, c2);
    project(w.c2, path + first, length, x->map_rate, PITCH, m, 0, c1);
    project(w.c1, path + first, length, x->map, PITCH, m, 1, c1);
    for (int r = 0; yd && r < 6; ++r)
        for (int b = 0; b < m; ++b) {
            c2[r * PITCH + b] *= ydd[b];
            c1[r * PITCH + b] *= yd[b];
        }
    const size_t at = (size_t)j * (size_t)m, step = (size_t)LINKS * (size_t)m;
    if (to->acceleration) {
        project(w.moves, path + first, length, x->map, PITCH, m, 0, moves);
        place_products(m, moves, PITCH, m, c2, step, to->acceleration + at);
        place_products(m, moves, PITCH, m, c1, step, to->velocity + at);
        place_weights(m, moves, PITCH, l->weight, to->gravity + j);
    }
    if (!bearing)
        return;
    project(w.moves, path + first, length, bearing, BORNE, rows, 0, borne);
    place_products(rows, borne, BORNE, m, c2, step, to->force_acceleration + at);
    place_products(rows, borne, BORNE, m, c1, step, to->force_velocity + at);
    place_weights(rows, borne, BORNE, l->weight, to->force_gravity + j);
}

static void links_at(struct tied *x)
{
    for (int j = 0; j < LINKS; ++j)
        x->at.s.links[j] = link_at_one(&x->at.s.m, links[j].frame, &x->numbers->bodies[j], x->numbers->gravity);
}

/* Shares of a sample, which moves already. */
static void tied_links(struct tied *x, const real *qd, const real *qdd, const struct tied_results *to)
{
    ALIGNED real bearing[N * BORNE], yd[N], ydd[N];
    for (int a = 0; qdd && a < x->free; ++a) {
        yd[a] = qd[x->joint[x->bound + a]];
        ydd[a] = qdd[x->joint[x->bound + a]];
    }
    links_at(x);
    if (to->force_acceleration)
        find_bearing(x, bearing);
    for (int j = 0; j < LINKS; ++j)
        tied_link(x, j, to->force_acceleration ? bearing : NULL, qdd ? yd : NULL, ydd, to);
}

/* Results of sample s. */
static struct tied_results results_at(const struct tied_results *first, size_t s, size_t m, size_t rows)
{
    struct tied_results to = *first;
    if (to.acceleration) {
        to.acceleration += s * m * LINKS * m;
        to.velocity += s * m * LINKS * m;
        to.gravity += s * m * LINKS;
    }
    if (to.force_acceleration) {
        to.force_acceleration += s * rows * LINKS * m;
        to.force_velocity += s * rows * LINKS * m;
        to.force_gravity += s * rows * LINKS;
    }
    return to;
}

static int tied_shares(size_t count, const struct numbers *numbers, const struct offsets *offsets, const real *q, const real *qd,
    const real *qdd, const API(constraints) *c, const struct tied_results *first)
{
    ALIGNED struct tied x;
    const int shares = !first->acceleration + !first->velocity + !first->gravity;
    const int forces = !first->force_acceleration + !first->force_velocity + !first->force_gravity;
    if (shares % 3 || forces % 3)
        return IS_UNKNOWN;
    for (size_t s = 0; s < count; ++s) {
        const int why = observe_tied(&x, numbers, offsets, c, q + s * N);
        if (why)
            return why;
        const struct tied_results to = results_at(first, s, (size_t)x.free, (size_t)x.t.rows);
        move_tied(&x, qd + s * N, NULL);
        turn_map(&x);
        tied_links(&x, qd + s * N, qdd ? qdd + s * N : NULL, &to);
    }
    return 0;
}

int API(constrained_coefficients)(size_t count, AT_REST, const API(constraints) *constraints, real *acceleration,
    real *velocity, real *gravity, real *force_acceleration, real *force_velocity, real *force_gravity)
{
    NUMBERS(x);
    OFFSETS(o);
    const struct tied_results to = {acceleration, velocity, gravity, force_acceleration, force_velocity, force_gravity};
    return tied_shares(count, x, o, q, qd, NULL, constraints, &to);
}

int API(constrained_propagation)(size_t count, INPUTS, const API(constraints) *constraints, real *acceleration, real *velocity,
    real *gravity, real *force_acceleration, real *force_velocity, real *force_gravity)
{
    NUMBERS(x);
    OFFSETS(o);
    const struct tied_results to = {acceleration, velocity, gravity, force_acceleration, force_velocity, force_gravity};
    return tied_shares(count, x, o, q, qd, qdd, constraints, &to);
}

/* What link j asks of joints, summed with a matrix's rows of these joints: `width` numbers, LINKS apart. */
static void place_torques(const struct tied *x, int j, const real *rows, int sides, int width, real *to)
{
    const moving_link *const l = &x->at.s.links[j];
    ALIGNED real torque[LONGEST], kept[LANES];
    for (int e = path_start[j]; e < path_start[j + 1]; ++e) {
        const screw *const axis = &x->at.s.m.axis[columns[e]], moves = moves_one(l, axis, arm_one(l, axis));
        torque[e - path_start[j]] = along(&moves, &l->wrench);
    }
    for (int a = 0; a < width; a += LANES) {
        lanes sum = {0};
        for (int e = path_start[j]; e < path_start[j + 1]; ++e)
            sum += torque[e - path_start[j]] * LANES_FROM(rows + path[e] * sides + a);
        LANES_AT(kept) = sum;
        for (int k = 0; k < LANES && a + k < width; ++k)
            to[(a + k) * LINKS] = kept[k];
    }
}

int API(constrained_torque)(size_t count, INPUTS, const API(constraints) *constraints, real *torque, real *forces)
{
    NUMBERS(numbers);
    OFFSETS(o);
    ALIGNED struct tied x;
    ALIGNED real bearing[N * BORNE];
    for (size_t s = 0; s < count; ++s) {
        const int why = observe_tied(&x, numbers, o, constraints, q + s * N);
        if (why)
            return why;
        move_tied(&x, qd + s * N, qdd + s * N);
        links_at(&x);
        if (forces)
            find_bearing(&x, bearing);
        for (int j = 0; j < LINKS; ++j) {
            if (torque)
                place_torques(&x, j, x.map, PITCH, x.free, torque + s * (size_t)x.free * LINKS + j);
            if (forces)
                place_torques(&x, j, bearing, BORNE, x.t.rows, forces + s * (size_t)x.t.rows * LINKS + j);
        }
    }
    return 0;
}
