/* What shares of a block change by where the motion is off, and their variances by it. The same in every package of linkwise.
   It needs regressors.h.

   Along direction r, q, qd and qdd change by row r of the factor F, and F' F is their covariance. With differences of width
   h, h^2 = 3, a share s has
       var(s) = sum over r of (s_r+ - s_r-)^2 / (4 h^2) + (h^2 - 1) / (4 h^4) (s_r+ + s_r- - 2 s)^2
   (M. Norgaard, N. K. Poulsen, O. Ravn, Automatica 36, 2000), and the product of two
       var(a b) = a^2 var(b) + b^2 var(a) + 2 a b cov(a, b) + var(a) var(b) + cov(a, b)^2
   (L. A. Goodman, J. Am. Stat. Assoc. 55, 1960). */

#define WIDTH R(1.7320508075688772)
#define STEP R(0.2886751345948129)
#define BEND R(0.23570226039551587)

enum { MOVING = 3 * N };

/* What moves along a direction, the later ones with all before: shares that do not hang on it stay as they are. */
enum moved { NOTHING, ACCELERATIONS, VELOCITIES, POSITIONS };

/* Values of a block: of all links, or sums over them, which are (N, N) and (N). */
struct shares {
    real *c2, *c1, *g, *tau;
};

/* Shares times their causes' motion, and torques times the velocities of their joints. */
struct products {
    real *acceleration, *velocity, *power;
};

/* Variances of a block, its values, and what sums over the links change by along a direction, and are bent by; covariances of
   the joints' torques with q, qd and qdd of these joints. */
struct varied {
    struct shares links, joints, here, step, bend;
    struct products of_links, of_joints;
    real *with_motion;
};

INLINE void increase(real *sum, lanes by)
{
    PUT(sum, TAKE(sum) + by);
}

/* Adds to the variance of a value, and to its sum over the links; returns what it changes by. */
INLINE lanes vary(lanes ahead, lanes behind, const real *here, real *variance, real *step_sum, real *bend_sum)
{
    const lanes value = TAKE(here), step = same(STEP) * (ahead - behind);
    const lanes bend = same(BEND) * ((ahead - value) + (behind - value));
    increase(variance, step * step + bend * bend);
    increase(step_sum, step);
    increase(bend_sum, bend);
    return step;
}

/* Whether one of these samples moves; NaN does. */
static inline int any_moves(const real *by)
{
    for (int b = 0; b < BLOCK; ++b)
        if (!(by[b] >= 0 && -by[b] >= 0))
            return 1;
    return 0;
}

/* What moves of each coordinate, and of all of them. */
static inline enum moved what_moves(const real *by, char *moved)
{
    enum moved most = NOTHING;
    for (int k = 0; k < N; ++k) {
        enum moved here = any_moves(by + (2 * N + k) * BLOCK) ? ACCELERATIONS : NOTHING;
        if (any_moves(by + (N + k) * BLOCK))
            here = VELOCITIES;
        if (any_moves(by + k * BLOCK))
            here = POSITIONS;
        moved[k] = (char)here;
        most = here > most ? here : most;
    }
    return most;
}

/* The same of what is linear along the direction. */
INLINE lanes vary_linear(lanes ahead, lanes behind, real *variance, real *step_sum)
{
    const lanes step = same(STEP) * (ahead - behind);
    increase(variance, step * step);
    increase(step_sum, step);
    return step;
}

/* Row i of link j's c1, by the wrenches ahead and behind: linear where positions stay. */
INLINE void vary_c1(const wrenches *ahead, const wrenches *behind, int j, int i, enum moved moved, const char *moves,
    const real *by, int at, const struct varied *to)
{
    const short *const joint = path + path_start[j];
    const int length = path_start[j + 1] - path_start[j];
    const screw a = ahead->moves[i], b = behind->moves[i];
    for (int k = 0; k < length; ++k) {
        const int entry = (links[j].c1 + i * length + k) * BLOCK + at, sum = (joint[i] * N + joint[k]) * BLOCK + at;
        const lanes before = along(&a, &ahead->c1[k]), behind_it = along(&b, &behind->c1[k]);
        const lanes step = moved == POSITIONS ? vary(before, behind_it, to->here.c1 + entry, to->links.c1 + entry,
                                                    to->step.c1 + sum, to->bend.c1 + sum)
                                              : vary_linear(before, behind_it, to->links.c1 + entry, to->step.c1 + sum);
        if (moves[joint[k]] >= VELOCITIES)
            increase(to->of_links.velocity + entry, step * TAKE(by + (N + joint[k]) * BLOCK + at));
    }
}

/* Its row of c2, where positions move. */
INLINE void vary_c2(const wrenches *ahead, const wrenches *behind, int j, int i, const char *moves, const real *by, int at,
    const struct varied *to)
{
    const short *const joint = path + path_start[j];
    const int length = path_start[j + 1] - path_start[j], first = links[j].c2 + i * length - i * (i + 1) / 2;
    const screw a = ahead->moves[i], b = behind->moves[i];
    for (int k = i; k < length; ++k) {
        const int entry = (first + k) * BLOCK + at, sum = (joint[i] * N + joint[k]) * BLOCK + at;
        const lanes step = vary(along(&a, &ahead->c2[k]), along(&b, &behind->c2[k]), to->here.c2 + entry,
            to->links.c2 + entry, to->step.c2 + sum, to->bend.c2 + sum);
        if (moves[joint[k]] != NOTHING)
            increase(to->of_links.acceleration + (links[j].c1 + i * length + k) * BLOCK + at,
                step * TAKE(by + (2 * N + joint[k]) * BLOCK + at));
        if (k > i && moves[joint[i]] != NOTHING)
            increase(to->of_links.acceleration + (links[j].c1 + k * length + i) * BLOCK + at,
                step * TAKE(by + (2 * N + joint[i]) * BLOCK + at));
    }
}

/* All shares of link j along a direction, from the motion ahead and behind. */
static void vary_link(const struct numbers *x, const motion *ahead, const motion *behind, int j, enum moved moved,
    const char *moves, const real *by, const struct varied *to)
{
    const short *const joint = path + path_start[j], *const column = columns + path_start[j];
    const int length = path_start[j + 1] - path_start[j];
    wrenches wa, wb;
    for (int part = 0; part < BLOCK_PARTS; ++part) {
        const int at = part * LANES;
        const moving_link a = SIZED(link_at)(&ahead[part], links[j].frame, &x->bodies[j], x->gravity);
        const moving_link b = SIZED(link_at)(&behind[part], links[j].frame, &x->bodies[j], x->gravity);
        if (moved >= VELOCITIES) {
            SIZED(columns)(&ahead[part], &a, column, length, &wa);
            SIZED(columns)(&behind[part], &b, column, length, &wb);
        }
        for (int i = 0; i < length; ++i) {
            const screw *const axis_a = &ahead[part].axis[column[i]], *const axis_b = &behind[part].axis[column[i]];
            const screw ma = SIZED(moves)(&a, axis_a, SIZED(arm)(&a, axis_a));
            const screw mb = SIZED(moves)(&b, axis_b, SIZED(arm)(&b, axis_b));
            const size_t entry = (size_t)(links[j].g + i) * BLOCK + (size_t)at, sum = (size_t)joint[i] * BLOCK + (size_t)at;
            const lanes step = vary(along(&ma, &a.wrench), along(&mb, &b.wrench), to->here.tau + entry, to->links.tau + entry,
                to->step.tau + sum, to->bend.tau + sum);
            increase(to->of_links.power + entry, step * TAKE(by + (N + joint[i]) * BLOCK + at));
            if (moved == POSITIONS) {
                const lanes ga = ma.s.x * a.weight.x + ma.s.y * a.weight.y + ma.s.z * a.weight.z;
                const lanes gb = mb.s.x * b.weight.x + mb.s.y * b.weight.y + mb.s.z * b.weight.z;
                vary(ga, gb, to->here.g + entry, to->links.g + entry, to->step.g + sum, to->bend.g + sum);
            }
            if (moved == POSITIONS) {
                vary_c1(&wa, &wb, j, i, POSITIONS, moves, by, at, to);
                vary_c2(&wa, &wb, j, i, moves, by, at, to);
            }
            if (moved == VELOCITIES)
                vary_c1(&wa, &wb, j, i, VELOCITIES, moves, by, at, to);
        }
    }
}

/* Adds the variance of a sum over the links, whose changes begin anew; returns what it changes by. */
INLINE lanes vary_sum(real *step_sum, real *bend_sum, real *variance)
{
    const lanes step = TAKE(step_sum), bend = TAKE(bend_sum);
    increase(variance, step * step + bend * bend);
    PUT(step_sum, same(R(0.0)));
    PUT(bend_sum, same(R(0.0)));
    return step;
}

/* All sums over the links along a direction. */
static void vary_sums(enum moved moved, const real *by, const struct varied *to)
{
    for (int i = 0; i < N * BLOCK; i += LANES) {
        const lanes step = vary_sum(to->step.tau + i, to->bend.tau + i, to->joints.tau + i);
        for (int order = 0; order < 3; ++order)
            increase(to->with_motion + order * N * BLOCK + i, step * TAKE(by + order * N * BLOCK + i));
        if (moved == POSITIONS)
            vary_sum(to->step.g + i, to->bend.g + i, to->joints.g + i);
    }
    for (int i = 0; i < N && moved >= VELOCITIES; ++i)
        for (int k = 0; k < N; ++k)
            for (int at = 0; at < BLOCK; at += LANES) {
                const size_t entry = (size_t)(i * N + k) * BLOCK + (size_t)at, mirrored = (size_t)(k * N + i) * BLOCK + (size_t)at;
                const lanes c1 = vary_sum(to->step.c1 + entry, to->bend.c1 + entry, to->joints.c1 + entry);
                increase(to->of_joints.velocity + entry, c1 * TAKE(by + (N + k) * BLOCK + at));
                if (moved < POSITIONS || k < i)
                    continue;
                const lanes c2 = vary_sum(to->step.c2 + entry, to->bend.c2 + entry, to->joints.c2 + entry);
                increase(to->of_joints.acceleration + entry, c2 * TAKE(by + (2 * N + k) * BLOCK + at));
                if (k == i)
                    continue;
                PUT(to->joints.c2 + mirrored, TAKE(to->joints.c2 + entry));
                increase(to->of_joints.acceleration + mirrored, c2 * TAKE(by + (2 * N + i) * BLOCK + at));
            }
}

/* All shares along a direction. */
static void vary_block(const struct numbers *x, const real *const *given, const real *by, enum moved moved, const char *moves,
    const struct varied *to)
{
    ALIGNED motion ahead[BLOCK_PARTS], behind[BLOCK_PARTS];
    ALIGNED real there[3][N * BLOCK], before[3][N * BLOCK];
    for (int order = 0; order < 3; ++order)
        for (int e = 0; e < N * BLOCK; ++e) {
            there[order][e] = given[order][e] + WIDTH * by[order * N * BLOCK + e];
            before[order][e] = given[order][e] - WIDTH * by[order * N * BLOCK + e];
        }
    moved_block(x, there[0], there[1], there[2], ahead);
    moved_block(x, before[0], before[1], before[2], behind);
    for (int j = 0; j < LINKS; ++j) {
        enum moved most = NOTHING;
        for (int i = path_start[j]; i < path_start[j + 1]; ++i)
            most = moves[path[i]] > (char)most ? (enum moved)moves[path[i]] : most;
        if (most != NOTHING)
            vary_link(x, ahead, behind, j, most, moves, by, to);
    }
    vary_sums(moved, by, to);
}
