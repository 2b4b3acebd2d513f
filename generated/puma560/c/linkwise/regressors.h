/* Regressors: what the torques multiply the links' inertial parameters by. The same in every package of linkwise.

   What link j carries is pi_j = (m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz), I about the origin of its frame
   and in its axes; tau(i, j) = Y(i, j) . pi_j, and so c2(i, j, k), c1(i, j, k) and g(i, j), with a row Y of 10 each. In
   these axes, and about this origin, coordinate i turns the link by z and moves the origin by s; the link turns at w. With
   y = z x w and ad the cross product of the last two,
       Y = [s . a,  a x z + s x ad + (s x b) x w,  z ad' + y b' (products summed) - 1/2 (y . b) (moments)]
   for
       tau:      a the origin's acceleration less gravity    ad = wd         b = w
       c2 of k:  a = s of k                                  ad = z of k     b = 0
       c1 of k:  a = how s of k changes                      ad = zd of k    b = z of k
       g:        a = minus gravity                           ad = 0          b = 0 */

#include "blocks.h"

enum { INERTIAL = 10 };

/* A link in its own axes: w and wd, its origin's velocity and acceleration, the latter less gravity, and minus gravity; of
   each coordinate (z, s) and their change. */
typedef struct {
    vector w, wd, velocity, acceleration, weight;
    screw axis[LONGEST], change[LONGEST];
} carried;

/* What a row is made of beside its own coordinate: a, ad and b. */
typedef struct {
    vector a, ad, b;
} cause;

/* A vector in a frame's axes. */
INLINE vector in_axes(matrix turn, vector a)
{
    const vector own = {turn.x.x * a.x + turn.y.x * a.y + turn.z.x * a.z, turn.x.y * a.x + turn.y.y * a.y + turn.z.y * a.z,
        turn.x.z * a.x + turn.y.z * a.y + turn.z.z * a.z};
    return own;
}

/* A motion in frame f's axes and about its origin. */
INLINE screw in_frame(const motion *m, int f, screw a)
{
    const screw own = {in_axes(m->turn[f], a.z), in_axes(m->turn[f], add_cross(a.s, a.z, m->place[f]))};
    return own;
}

/* Link j. */
static inline void carry(const struct numbers *x, const motion *m, int j, carried *l)
{
    const int f = links[j].frame, length = path_start[j + 1] - path_start[j];
    const vector g = {same(x->gravity[0]), same(x->gravity[1]), same(x->gravity[2])};
    const screw twist = in_frame(m, f, m->twist[f]), rate = in_frame(m, f, m->rate[f]);
    l->w = twist.z;
    l->wd = rate.z;
    l->velocity = twist.s;
    l->weight = in_axes(m->turn[f], subtract(m->place[0], g));
    l->acceleration = add(add_cross(rate.s, twist.z, twist.s), l->weight);
    for (int k = 0; k < length; ++k) {
        const int column = columns[path_start[j] + k];
        l->axis[k] = in_frame(m, f, m->axis[column]);
        l->change[k] = in_frame(m, f, m->change[column]);
        l->change[k].s = add_cross(l->change[k].s, l->axis[k].z, l->velocity);
    }
}

/* The row of a coordinate of a link. */
INLINE void row_of_cause(const carried *l, int i, cause of, real *y10)
{
    const vector z = l->axis[i].z, s = l->axis[i].s, ad = of.ad, b = of.b, y = cross(z, l->w);
    const vector h = add_cross(add_cross(cross(of.a, z), s, ad), cross(s, b), l->w);
    const lanes half = same(R(0.5)) * (y.x * b.x + y.y * b.y + y.z * b.z);
    PUT(y10 + 0 * W, s.x * of.a.x + s.y * of.a.y + s.z * of.a.z);
    PUT(y10 + 1 * W, h.x);
    PUT(y10 + 2 * W, h.y);
    PUT(y10 + 3 * W, h.z);
    PUT(y10 + 4 * W, z.x * ad.x + y.x * b.x - half);
    PUT(y10 + 5 * W, z.x * ad.y + z.y * ad.x + y.x * b.y + y.y * b.x);
    PUT(y10 + 6 * W, z.y * ad.y + y.y * b.y - half);
    PUT(y10 + 7 * W, z.x * ad.z + z.z * ad.x + y.x * b.z + y.z * b.x);
    PUT(y10 + 8 * W, z.y * ad.z + z.z * ad.y + y.y * b.z + y.z * b.y);
    PUT(y10 + 9 * W, z.z * ad.z + y.z * b.z - half);
}

/* The rows of a coordinate in a block: of tau, g, or c2 or c1 of coordinate k. */
enum rows { OF_TAU, OF_G, OF_C2, OF_C1 };

static void rows_of_block(const motion *m, const carried *l, enum rows kind, int i, int k, real *y10)
{
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        const carried *c = &l[part];
        const vector none = m[part].place[0];
        const cause tau = {c->acceleration, c->wd, c->w}, g = {c->weight, none, none};
        const cause c2 = {c->axis[k].s, c->axis[k].z, none}, c1 = {c->change[k].s, c->change[k].z, c->axis[k].z};
        row_of_cause(c, i, kind == OF_TAU ? tau : kind == OF_G ? g : kind == OF_C2 ? c2 : c1, y10 + part * LANES);
    }
}

void API(regressor)(size_t count, INPUTS, real *regressor)
{
    if (!count)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED carried l[BLOCK_PARTS];
    ALIGNED real y10[INERTIAL * BLOCK];
    const size_t all = (size_t)N * LINKS * INERTIAL;
    clear(count * all, regressor);
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        for (int j = 0; j < LINKS; ++j) {
            const short *const joint = path + path_start[j];
            const int length = path_start[j + 1] - path_start[j];
            for (int part = 0; part < BLOCK_PARTS; ++part)
                carry(x, &m[part], j, &l[part]);
            for (int i = 0; i < length; ++i) {
                rows_of_block(m, l, OF_TAU, i, 0, y10);
                scatter(samples, INERTIAL, all, y10, regressor + s * all + (size_t)(joint[i] * LINKS + j) * INERTIAL);
            }
        }
    }
}

/* c2 and c1 of link j, and its g, to their places from these rows on. */
static void coefficients_of_link(const motion *m, const carried *l, int j, size_t samples, real *acceleration, real *velocity,
    real *gravity)
{
    ALIGNED real y10[INERTIAL * BLOCK];
    const short *const joint = path + path_start[j];
    const int length = path_start[j + 1] - path_start[j];
    const size_t squares = (size_t)N * LINKS * INERTIAL, cubes = squares * N;
    for (int i = 0; i < length; ++i) {
        const size_t square = (size_t)(joint[i] * LINKS + j);
        rows_of_block(m, l, OF_G, i, 0, y10);
        scatter(samples, INERTIAL, squares, y10, gravity + square * INERTIAL);
        for (int k = 0; k < length; ++k) {
            const size_t other = (size_t)joint[k], cube = (square * N + other) * INERTIAL;
            rows_of_block(m, l, OF_C1, i, k, y10);
            scatter(samples, INERTIAL, cubes, y10, velocity + cube);
            rows_of_block(m, l, OF_C2, i, k, y10);
            scatter(samples, INERTIAL, cubes, y10, acceleration + cube);
        }
    }
}

void API(coefficient_regressors)(size_t count, AT_REST, real *acceleration, real *velocity, real *gravity)
{
    if (!count)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED carried l[BLOCK_PARTS];
    const size_t squares = (size_t)N * LINKS * INERTIAL, cubes = squares * N;
    clear(count * cubes, acceleration);
    clear(count * cubes, velocity);
    clear(count * squares, gravity);
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        rows_moved(x, samples, q + s * N, qd + s * N, qd + s * N, m); /* any qdd: they don't depend on it */
        for (int j = 0; j < LINKS; ++j) {
            for (int part = 0; part < BLOCK_PARTS; ++part)
                carry(x, &m[part], j, &l[part]);
            coefficients_of_link(m, l, j, samples, acceleration + s * cubes, velocity + s * cubes, gravity + s * squares);
        }
    }
}

/* The squares of F' Y of a row Y in a block, summed: its variance where F F' is the covariance of what the link carries. */
static void variance_of_row(const real *factor, const real *y10, real *variance)
{
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        lanes y[INERTIAL], sum = same(0);
        for (int a = 0; a < INERTIAL; ++a)
            y[a] = TAKE(y10 + a * W + part * LANES);
        for (int r = 0; r < INERTIAL; ++r) {
            lanes along_r = same(0);
            for (int a = 0; a < INERTIAL; ++a)
                along_r += same(factor[a * INERTIAL + r]) * y[a];
            sum += along_r * along_r;
        }
        PUT(variance + part * LANES, sum);
    }
}

void API(share_variances)(size_t count, INPUTS, const real *factor, real *c2, real *c1, real *g, real *tau)
{
    if (!count)
        return;
    NUMBERS(x);
    ALIGNED motion m[BLOCK_PARTS];
    ALIGNED carried l[BLOCK_PARTS];
    ALIGNED real y10[INERTIAL * BLOCK], variance[BLOCK];
    size_t pairs = 0;
    for (int j = 0; j < LINKS; ++j)
        pairs += (size_t)((path_start[j + 1] - path_start[j]) * (path_start[j + 1] - path_start[j]));
    const size_t entries = (size_t)path_start[LINKS], halves = (pairs + entries) / 2;
    for (size_t s = 0; s < count; s += BLOCK) {
        const size_t samples = count - s < BLOCK ? count - s : BLOCK;
        size_t pair = s * pairs, half = s * halves, entry = s * entries;
        rows_moved(x, samples, q + s * N, qd + s * N, qdd + s * N, m);
        for (int j = 0; j < LINKS; ++j) {
            const real *const own = factor + j * INERTIAL * INERTIAL;
            const int length = path_start[j + 1] - path_start[j];
            for (int part = 0; part < BLOCK_PARTS; ++part)
                carry(x, &m[part], j, &l[part]);
            for (int i = 0; i < length; ++i, ++entry) {
                rows_of_block(m, l, OF_G, i, 0, y10);
                variance_of_row(own, y10, variance);
                scatter(samples, 1, entries, variance, g + entry);
                rows_of_block(m, l, OF_TAU, i, 0, y10);
                variance_of_row(own, y10, variance);
                scatter(samples, 1, entries, variance, tau + entry);
                for (int k = 0; k < length; ++k, ++pair) {
                    rows_of_block(m, l, OF_C1, i, k, y10);
                    variance_of_row(own, y10, variance);
                    scatter(samples, 1, pairs, variance, c1 + pair);
                }
                for (int k = i; k < length; ++k, ++half) {
                    rows_of_block(m, l, OF_C2, i, k, y10);
                    variance_of_row(own, y10, variance);
                    scatter(samples, 1, halves, variance, c2 + half);
                }
            }
        }
    }
}
