/* The rigid-link rule in loops. The same in every package of linkwise.

   The file that includes it has the robot's tables `joints` and `sums` (tree.h) and says what SIZED makes of a name and what a `number` is:
   that of one sample, or the lanes of several.

   All vectors are in the base's axes. Joint k's axis is S = (z, s): z its direction times its ratio, s = p x z with its
   place p; a slide has z = 0 and its direction for s. Where the twist (w, v) is that of what carries the joint, S changes by
       zd = w x z                    sd = w x s + v x z
   Coordinate k turns a link by z_k and moves its centre of mass c by s_k - c x z_k, its partial velocity, which changes by
   sd_k - cd x z_k - c x zd_k. With inertia I about c and E = tr(I) / 2 - I, the link needs the wrenches (N, f), f for each
   unit of its mass m,
       c2 of k:  N = I z             f = s - c x z
       c1 of k:  N = I zd - w x E z  f = sd - cd x z - c x zd
       tau:      N = I wd - w x E w  f = cdd - gravity
       g:        N = 0               f = -gravity
   and joint i bears z_i . N + m (s_i - c x z_i) . f of each. The term with E is that by which c1 is 1/2 d(tau)/d(qd)
   (S. Echeandia, P. Wensing, J. Comput. Nonlinear Dynam. 16(9), 2021).

   Errors of tau are rounding of its wrench. What velocities add to that, a centripetal force say, may be large and do
   nothing along any axis: where the joints move fast and hardly accelerate, few digits of tau are left. */

#define motion SIZED(motion)
#define moving_link SIZED(moving_link)
#define wrenches SIZED(wrenches)

/* Frames, 0 being the base: axes, place, twist (w, v) and its rate (wd, vd), v at the base's origin. Columns: S and its
   change. Where joints follow curves, how S changes by its own coordinate, and what this adds to S's second change. */
typedef struct {
    matrix turn[FRAMES + 1];
    vector place[FRAMES + 1];
    screw twist[FRAMES + 1], rate[FRAMES + 1];
    screw axis[COLUMNS], change[COLUMNS];
#ifdef CURVED
    screw bend[FRAMES], second[FRAMES];
#endif
} motion;

/* A link: c, cd, m, I, the matrix of z to -w x E z, and its wrenches for tau and g, of which the latter is a force. */
typedef struct {
    vector com, velocity;
    number mass;
    matrix inertia, turning;
    screw wrench;
    vector weight;
} moving_link;

/* For each coordinate of a link's path: how the link moves, with its mass, and the wrenches that it needs for c2 and c1. */
typedef struct {
    screw moves[LONGEST], c2[LONGEST], c1[LONGEST];
} wrenches;

static inline void SIZED(base)(motion *m)
{
    const number zero = same(R(0.0)), one = same(R(1.0));
    const vector none = {zero, zero, zero};
    const matrix identity = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
    const screw rest = {none, none};
    m->turn[0] = identity;
    m->place[0] = none;
    m->twist[0] = m->rate[0] = rest;
}

/* A row of a frame's axes from that of its parent's. */
INLINE vector SIZED(axes)(vector row, const real *t, number sine, number cosine)
{
    const number x = row.x * t[0] + row.y * t[3] + row.z * t[6], y = row.x * t[1] + row.y * t[4] + row.z * t[7];
    const vector axes = {cosine * x + sine * y, cosine * y - sine * x, row.x * t[2] + row.y * t[5] + row.z * t[8]};
    return axes;
}

/* Frame f, its joint turned by an angle with this sine and cosine, or moved by ratio * by; derivatives of `by` are `stride`
   behind each other. */
static inline void SIZED(frame)(motion *m, int f, const struct placing *here, number sine, number cosine, const real *by,
    int stride, number qd, number qdd)
{
    const struct joint *joint = &joints[f - 1];
    const matrix above = m->turn[joint->parent];
    const screw twist = m->twist[joint->parent], rate = m->rate[joint->parent];
    const vector none = m->place[0];
    const matrix turn = {SIZED(axes)(above.x, here->turn, sine, cosine),
        SIZED(axes)(above.y, here->turn, sine, cosine), SIZED(axes)(above.z, here->turn, sine, cosine)};
    const vector z = {turn.x.z, turn.y.z, turn.z.z}, direction = scale(same(here->ratio), z);
    vector place = joint->placed ? add(m->place[joint->parent], turned(above, here->place)) : none;
    screw axis = {direction, cross(place, direction)}, change;
    if (joint->kind == PRISMATIC) {
        axis.z = none;
        axis.s = direction;
        if (joint->placed)
            place = add(place, scale(TAKE(by), direction));
    }
#ifdef CURVED
    const number slope = TAKE(by + stride), bent = TAKE(by + 2 * stride), own = TAKE(by + 3 * stride) * qd * qd + bent * qdd;
    const screw straight = axis, bend = {scale(bent, straight.z), scale(bent, straight.s)};
    axis.z = scale(slope, straight.z);
    axis.s = scale(slope, straight.s);
#else
    (void)stride;
#endif
    change.z = cross(twist.z, axis.z);
    change.s = add_cross(cross(twist.z, axis.s), twist.s, axis.z);
#ifdef CURVED
    m->bend[f - 1] = bend;
    m->second[f - 1].z = add(scale(qd, cross(twist.z, bend.z)), scale(own, straight.z));
    m->second[f - 1].s = add(scale(qd, add_cross(cross(twist.z, bend.s), twist.s, bend.z)), scale(own, straight.s));
    change.z = add(change.z, scale(qd, bend.z));
    change.s = add(change.s, scale(qd, bend.s));
#endif
    m->turn[f] = turn;
    m->place[f] = place;
    m->axis[f - 1] = axis;
    m->change[f - 1] = change;
    m->twist[f].z = add(twist.z, scale(qd, axis.z));
    m->twist[f].s = add(twist.s, scale(qd, axis.s));
    m->rate[f].z = add(rate.z, add(scale(qdd, axis.z), scale(qd, change.z)));
    m->rate[f].s = add(rate.s, add(scale(qdd, axis.s), scale(qd, change.s)));
}

/* Columns of joints that follow one coordinate together, for all or the `wanted` frames. */
static inline void SIZED(sum_columns)(motion *m, const char *wanted)
{
    for (int column = FRAMES; column < COLUMNS; ++column) {
        const int a = sums[column - FRAMES].column, b = sums[column - FRAMES].joint;
        if (wanted && !wanted[b + 1])
            continue;
        m->axis[column].z = add(m->axis[a].z, m->axis[b].z);
        m->axis[column].s = add(m->axis[a].s, m->axis[b].s);
        m->change[column].z = add(m->change[a].z, m->change[b].z);
        m->change[column].s = add(m->change[a].s, m->change[b].s);
    }
}

/* A row of the inertia in the base's axes: of R J R', with J = xx, yy, zz, xy, xz, yz. */
INLINE vector SIZED(inertia_row)(matrix turn, vector row, const real *j)
{
    const vector half = {row.x * j[0] + row.y * j[3] + row.z * j[4], row.x * j[3] + row.y * j[1] + row.z * j[5],
        row.x * j[4] + row.y * j[5] + row.z * j[2]};
    return apply(turn, half);
}

/* The link of this body, at frame f. */
INLINE moving_link SIZED(link_at)(const motion *m, int f, const struct body *body, const real *gravity)
{
    const matrix turn = m->turn[f];
    const screw twist = m->twist[f], rate = m->rate[f];
    const real *j = body->inertia;
    const vector g = {same(gravity[0]), same(gravity[1]), same(gravity[2])};
    moving_link l;
    l.mass = same(body->mass);
    l.com = add(m->place[f], turned(turn, body->com));
    l.velocity = add_cross(twist.s, twist.z, l.com);
    const vector acceleration = add_cross(add_cross(rate.s, rate.z, l.com), twist.z, l.velocity);
    const matrix inertia = {SIZED(inertia_row)(turn, turn.x, j), SIZED(inertia_row)(turn, turn.y, j),
        SIZED(inertia_row)(turn, turn.z, j)};
    l.inertia = inertia;
    /* -w x E = w x I - tr(I) / 2 w x, and column c of w x I is w x I_c. */
    const vector x = cross(twist.z, inertia.x), y = cross(twist.z, inertia.y), z = cross(twist.z, inertia.z);
    const vector w = scale(same(R(0.5) * (j[0] + j[1] + j[2])), twist.z);
    const matrix turning = {{x.x, y.x + w.z, z.x - w.y}, {x.y - w.z, y.y, z.y + w.x}, {x.z + w.y, y.z - w.x, z.z}};
    l.turning = turning;
    l.wrench.z = add_applied(apply(inertia, rate.z), turning, twist.z);
    l.wrench.s = subtract(acceleration, g);
    l.weight = subtract(m->place[0], g);
    return l;
}

/* How a link's centre of mass moves with a joint: s - c x z. */
INLINE vector SIZED(arm)(const moving_link *l, const screw *axis)
{
    return subtract_cross(axis->s, l->com, axis->z);
}

/* What a wrench is put together with: z and, as forces are for each unit of mass, m times the `arm`. */
INLINE screw SIZED(moves)(const moving_link *l, const screw *axis, vector arm)
{
    const screw moves = {axis->z, scale(l->mass, arm)};
    return moves;
}

/* A row of I z and one of I zd - w x E z, each entry of the matrices read once. */
INLINE void SIZED(moments)(vector inertia, vector turning, vector z, vector zd, number *c2, number *c1)
{
    number n = inertia.x * z.x, nd = inertia.x * zd.x;
    n += inertia.y * z.y;
    nd += inertia.y * zd.y;
    n += inertia.z * z.z;
    nd += inertia.z * zd.z;
    nd += turning.x * z.x;
    nd += turning.y * z.y;
    nd += turning.z * z.z;
    *c2 = n;
    *c1 = nd;
}

/* The wrenches of each coordinate of a link's path. */
static inline void SIZED(columns)(const motion *m, const moving_link *l, const short *column, int length, wrenches *out)
{
    for (int k = 0; k < length; ++k) {
        const screw axis = m->axis[column[k]], change = m->change[column[k]];
        const vector arm = SIZED(arm)(l, &axis);
        out->moves[k] = SIZED(moves)(l, &axis, arm);
        SIZED(moments)(l->inertia.x, l->turning.x, axis.z, change.z, &out->c2[k].z.x, &out->c1[k].z.x);
        SIZED(moments)(l->inertia.y, l->turning.y, axis.z, change.z, &out->c2[k].z.y, &out->c1[k].z.y);
        SIZED(moments)(l->inertia.z, l->turning.z, axis.z, change.z, &out->c2[k].z.z, &out->c1[k].z.z);
        out->c2[k].s = arm;
        out->c1[k].s = subtract_cross(subtract_cross(change.s, l->velocity, axis.z), l->com, change.z);
    }
}
