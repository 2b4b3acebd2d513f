/* What ties joints: closed loops, frames that the ground holds, and couplings, as rows A qd = 0. The same in every package of
   linkwise.

   The file that includes this one has the robot's own `ties` and `terms` of couplings (tree.h), and NAME.h what a caller adds,
   `contact`. With the axes S = (z, s) of rule.h, m = 1 where a joint moves a frame, and the frames' places x, a pair of
   frames turns and shifts apart, with each coordinate, by
       J = ((m1 - m2) z, (m1 - m2) s + z x X)        X = m1 x1 - m2 x2
   A row is w . J: w is an axis of the world, or one of the first frame, whose rate is omega x w, or u = d / |d|, from the
   second frame to the first. Where a coupling's sum is 0, its row has the slopes of its polynomials. */

enum { MOST_CONTACTS = 8, ROWS = TIED_ROWS + 6 * MOST_CONTACTS };

/* What is held: its two frames, the second one -1 for the ground; where, in the first frame, and its z axis there. */
struct held {
    int kind, first, second;
    real length, point[3], axis[3], arm[3];
};

/* A frame that is held: the frame that carries it, its place, there and in the world, and axes, of which the columns are those of
   what is held. */
typedef struct {
    int carrier;
    vector place, world;
    matrix axes;
} end;

/* Joints at a position. */
struct standing {
    struct sample s;
    ALIGNED real q[N];
};

/* Rows at a position: how far each is from closing, A (rows, N), and how A changes. */
struct tie_rows {
    int rows, first_coupling;
    short owner[ROWS];
    ALIGNED real violation[ROWS], jacobian[ROWS * N], rate[ROWS * N];
};

static inline int rows_of_kind(int kind)
{
    static const int rows[] = {3, 5, 6, 1, 3};
    return rows[kind];
}

/* How many rows there are; -1 where contacts are too many, or one has a kind or a frame that is not there. */
static int count_rows(const API(constraints) *c)
{
    int rows = TIED_ROWS;
    if (c->contacts < 0 || c->contacts > MOST_CONTACTS)
        return -1;
    for (int p = 0; p < c->contacts; ++p) {
        const API(contact) *const contact = &c->contact[p];
        if (contact->kind < 0 || contact->kind > HELD_ROLLING || contact->kind == HELD_DISTANCE || contact->frame < 0
            || contact->frame >= NAMED)
            return -1;
        rows += rows_of_kind(contact->kind);
    }
    return rows;
}

static struct held held_by(const API(constraints) *c, int p)
{
    struct held h = {0, 0, -1, 0, {0, 0, 0}, {0, 0, 1}, {0, 0, 0}};
    if (p < TIES) {
        h.kind = ties[p].kind;
        h.first = ties[p].first;
        h.second = ties[p].second;
        h.length = ties[p].length;
        return h;
    }
    const API(contact) *const contact = &c->contact[p - TIES];
    h.kind = contact->kind;
    h.first = contact->frame;
    copy(3, contact->point, h.point);
    if (h.kind == HELD_HINGE)
        copy(3, contact->axis, h.axis);
    copy(3, contact->arm, h.arm);
    return h;
}

static inline real product(vector a, vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vector component(matrix m, int column)
{
    const vector all[] = {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
    return all[column];
}

/* Axes whose z points along a direction, row by row: x is normal to it and to the axis that it is the least along. */
static void axes_around(const real *direction, real *axes)
{
    const real length = F(sqrt)(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    const real z[3] = {direction[0] / length, direction[1] / length, direction[2] / length};
    int least = 0;
    for (int k = 1; k < 3; ++k)
        if (F(fabs)(z[k]) < F(fabs)(z[least]))
            least = k;
    const vector along_z = {z[0], z[1], z[2]}, unit = {(real)(least == 0), (real)(least == 1), (real)(least == 2)};
    vector x = cross(unit, along_z);
    x = scale(1 / F(sqrt)(product(x, x)), x);
    const vector y = cross(along_z, x);
    const real rows[9] = {x.x, y.x, z[0], x.y, y.y, z[1], x.z, y.z, z[2]};
    copy(9, rows, axes);
}

static inline vector row_times(vector row, const real *m)
{
    const vector product_of = {row.x * m[0] + row.y * m[3] + row.z * m[6], row.x * m[1] + row.y * m[4] + row.z * m[7],
        row.x * m[2] + row.y * m[5] + row.z * m[8]};
    return product_of;
}

static void stand(const struct numbers *x, const real *q, struct standing *at)
{
    ALIGNED const real rest[N] = {0};
    copy(N, q, at->q);
    at->s.x = x;
    moved_one(x, q, rest, rest, NULL, &at->s.m);
}

/* The first frame of what is held, or its second one. */
static end end_of(const struct standing *at, const struct offsets *o, const struct held *h, int second)
{
    const motion *const m = &at->s.m;
    const int frame = second ? h->second : h->first;
    const struct named_frame *const named = &named_frames[frame];
    const matrix turn = m->turn[named->frame];
    end e;
    e.carrier = named->frame;
    e.place = place_of(m, frame, o, second ? NULL : h->point);
    e.world = place_in_world(&at->s, frame, o, second ? NULL : h->point, at->q);
    e.axes.x = row_times(turn.x, named->turn);
    e.axes.y = row_times(turn.y, named->turn);
    e.axes.z = row_times(turn.z, named->turn);
    if (!second && h->second < 0 && h->kind == HELD_HINGE) {
        real axes[9];
        axes_around(h->axis, axes);
        e.axes.x = row_times(e.axes.x, axes);
        e.axes.y = row_times(e.axes.y, axes);
        e.axes.z = row_times(e.axes.z, axes);
    }
    return e;
}

/* 2 sin(t/2) times the axis about which, by t, the first frame is turned from the second one; see tie_arrays.py. */
static vector turned_by(const end *first, const end *second, int every)
{
    const vector z1 = component(first->axes, 2), z2 = component(second->axes, 2);
    vector sine = cross(z2, z1);
    real cosine = product(z2, z1);
    if (every) {
        for (int k = 0; k < 2; ++k) {
            const vector a = component(first->axes, k), b = component(second->axes, k);
            sine = add_cross(sine, b, a);
            cosine += product(b, a);
        }
        sine = scale(R(0.5), sine);
        cosine = R(0.5) * (cosine - 1);
    }
    const real half = R(0.5) * (1 + cosine), least = R(1e-12);
    return scale(1 / F(sqrt)(half > least ? half : least), sine);
}

/* The weights w of the rows of what is held, (turn, shift), by kind; those of a length are found where it is told. */
static int weights_of(const struct held *h, const end *first, vector direction, screw *w)
{
    const vector none = {0, 0, 0}, e[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const vector arm = {h->arm[0], h->arm[1], h->arm[2]};
    int rows = 0;
    if (h->kind == HELD_DISTANCE) {
        w[0].z = none;
        w[0].s = direction;
        return 1;
    }
    for (int k = 0; k < (h->kind == HELD_FRAME ? 3 : h->kind == HELD_HINGE ? 2 : 0); ++k, ++rows) {
        w[rows].z = h->kind == HELD_FRAME ? e[k] : component(first->axes, k);
        w[rows].s = none;
    }
    for (int k = 0; k < 3; ++k, ++rows) {
        w[rows].z = h->kind == HELD_ROLLING ? cross(e[k], arm) : none;
        w[rows].s = e[k];
    }
    return rows;
}

/* A joint's part in the columns of some rows and, where `dw` is given, of their rates: see above. */
static void add_joint(const motion *m, int f, real one, vector x, vector xd, int rows, const screw *w, const screw *dw,
    real *jacobian, real *rate)
{
    const int k = joints[f - 1].coordinate;
    const screw axis = m->axis[f - 1];
    const screw moves = {scale(one, axis.z), add_cross(scale(one, axis.s), axis.z, x)};
    if (!rate) {
        for (int r = 0; r < rows; ++r)
            jacobian[r * N + k] += along(&w[r], &moves);
        return;
    }
    const screw change = m->change[f - 1];
    const screw moved = {scale(one, change.z), add_cross(add_cross(scale(one, change.s), change.z, x), axis.z, xd)};
    for (int r = 0; r < rows; ++r)
        rate[r * N + k] += along(&w[r], &moved) + along(&dw[r], &moves);
}

/* The columns of all joints that move one of two frames, the second one 0 for the ground. */
static void add_joints(const motion *m, const end *first, const end *second, vector xd1, vector xd2, int rows, const screw *w,
    const screw *dw, real *jacobian, real *rate)
{
    char moves_first[FRAMES + 1] = {0}, moves_second[FRAMES + 1] = {0};
    const vector none = {0, 0, 0};
    for (int f = first->carrier; f; f = joints[f - 1].parent)
        moves_first[f] = 1;
    for (int f = second ? second->carrier : 0; f; f = joints[f - 1].parent)
        moves_second[f] = 1;
    for (int f = first->carrier; f; f = joints[f - 1].parent) {
        const int both = moves_second[f];
        const vector x = both ? subtract(first->place, second->place) : first->place, xd = both ? subtract(xd1, xd2) : xd1;
        add_joint(m, f, both ? R(0.0) : R(1.0), x, xd, rows, w, dw, jacobian, rate);
    }
    for (int f = second ? second->carrier : 0; f; f = joints[f - 1].parent)
        if (!moves_first[f])
            add_joint(m, f, -1, subtract(none, second->place), subtract(none, xd2), rows, w, dw, jacobian, rate);
}

static inline vector velocity_at(const motion *m, const end *e)
{
    return add_cross(m->twist[e->carrier].s, m->twist[e->carrier].z, e->place);
}

/* Rows of pair p from row `at` on: phi and A, or, where the motion is that of velocities, how A changes. */
static int pair_rows(const API(constraints) *c, const struct standing *here, const struct standing *held_at,
    const struct offsets *o, int p, int at, int rates, struct tie_rows *t)
{
    const struct held h = held_by(c, p);
    const motion *const m = &here->s.m;
    const vector none = {0, 0, 0};
    const end first = end_of(here, o, &h, 0);
    const end second = h.second < 0 ? end_of(held_at, o, &h, 0) : end_of(here, o, &h, 1);
    const vector shift = subtract(first.world, second.world);
    const real size = F(sqrt)(product(shift, shift)), inverse = size > 0 ? 1 / size : 1;
    const vector u = scale(inverse, shift);
    screw w[6], dw[6];
    const int rows = weights_of(&h, &first, u, w);
    const end *const other = h.second < 0 ? NULL : &second;
    if (!rates) {
        clear((size_t)(rows * N), t->jacobian + at * N);
        add_joints(m, &first, other, none, none, rows, w, NULL, t->jacobian + at * N, NULL);
        const screw apart = {rows > 3 ? turned_by(&first, &second, h.kind == HELD_FRAME) : none, shift};
        for (int r = 0; r < rows; ++r) {
            t->owner[at + r] = (short)p;
            t->violation[at + r] = h.kind == HELD_ROLLING ? R(0.0) : along(&w[r], &apart) - h.length;
        }
        return rows;
    }
    const vector xd1 = velocity_at(m, &first), xd2 = other ? velocity_at(m, &second) : none, slip = subtract(xd1, xd2);
    for (int r = 0; r < rows; ++r) {
        dw[r].z = h.kind == HELD_HINGE ? cross(m->twist[first.carrier].z, w[r].z) : none;
        dw[r].s = h.kind == HELD_DISTANCE ? scale(inverse, subtract(slip, scale(product(u, slip), u))) : none;
    }
    clear((size_t)(rows * N), t->rate + at * N);
    add_joints(m, &first, other, xd1, xd2, rows, w, dw, t->jacobian + at * N, t->rate + at * N);
    return rows;
}

/* Rows of couplings, or how they change. */
static void coupling_rows(const real *q, const real *qd, int at, int rates, struct tie_rows *t)
{
    for (int k = 0; k < COUPLINGS; ++k, ++at) {
        real *const row = (rates ? t->rate : t->jacobian) + at * N;
        clear(N, row);
        if (!rates) {
            t->violation[at] = 0;
            t->owner[at] = (short)(TIES + MOST_CONTACTS + k);
        }
        for (int e = coupling_start[k]; e < coupling_start[k + 1]; ++e) {
            const int i = terms[e].coordinate;
            real value = 0, slope = 0, bend = 0;
            for (int power = terms[e].factors; power-- > 0;) {
                bend = bend * q[i] + 2 * slope;
                slope = slope * q[i] + value;
                value = value * q[i] + factors[terms[e].first + power];
            }
            row[i] += rates ? bend * qd[i] : slope;
            if (!rates)
                t->violation[at] += value;
        }
    }
}

/* phi and A at a position, `held_at` being where contacts took hold. */
static void rows_at(const API(constraints) *c, const struct standing *here, const struct standing *held_at,
    const struct offsets *o, struct tie_rows *t)
{
    int at = 0;
    for (int p = 0; p < TIES + c->contacts; ++p)
        at += pair_rows(c, here, held_at, o, p, at, 0, t);
    t->first_coupling = at;
    coupling_rows(here->q, here->q, at, 0, t);
    t->rows = at + COUPLINGS;
}

/* How A changes, of rows that were found at this position, in a motion of velocities qd. */
static void rates_at(const API(constraints) *c, const struct standing *here, const struct offsets *o, const real *qd,
    struct tie_rows *t)
{
    int at = 0;
    for (int p = 0; p < TIES + c->contacts; ++p)
        at += pair_rows(c, here, here, o, p, at, 1, t);
    coupling_rows(here->q, qd, at, 1, t);
}

/* The velocities and accelerations of frames that stand where they are. */
static void set_motion(motion *m, const real *qd, const real *qdd)
{
    for (int f = 1; f <= FRAMES; ++f) {
        const int up = joints[f - 1].parent, k = joints[f - 1].coordinate;
        const screw axis = m->axis[f - 1], twist = m->twist[up], rate = m->rate[up];
        screw change = {cross(twist.z, axis.z), add_cross(cross(twist.z, axis.s), twist.s, axis.z)};
#ifdef CURVED
        change.z = add(change.z, scale(qd[k], m->bend[f - 1].z));
        change.s = add(change.s, scale(qd[k], m->bend[f - 1].s));
#endif
        m->change[f - 1] = change;
        m->twist[f].z = add(twist.z, scale(qd[k], axis.z));
        m->twist[f].s = add(twist.s, scale(qd[k], axis.s));
        m->rate[f].z = add(rate.z, add(scale(qdd[k], axis.z), scale(qd[k], change.z)));
        m->rate[f].s = add(rate.s, add(scale(qdd[k], axis.s), scale(qd[k], change.s)));
    }
    sum_columns_one(m, NULL);
}
