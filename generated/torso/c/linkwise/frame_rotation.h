/* Where a frame is beside its target, and what its springs ask for. The same in every package of linkwise.

   The rotation vector v of R R_d' = exp [v] and the place make x; with E = 1 - [v] / 2 + c [v]^2, c = (1 - v/2 cot v/2) / v^2,
   E w is the rate of v under an angular velocity w, so that E' K x is what a spring of energy x' K x / 2 asks for. */
#include "wanted_impedance.h"

/* The turn R R_d' that leads from a target to a frame, as a quaternion (w, x, y, z) with w >= 0: the largest of the four is
   found first (S. Shepperd, J. Guidance and Control 1(3), 1978). */
static inline void turn_from(const struct sample *s, int frame, const real *target, real *quaternion)
{
    const struct named_frame *const named = &named_frames[frame];
    real own[3][3], t[3][3];
    for (int c = 0; c < 3; ++c) {
        const real column[3] = {named->turn[c], named->turn[3 + c], named->turn[6 + c]};
        const vector axis = turned(s->m.turn[named->frame], column);
        own[0][c] = axis.x;
        own[1][c] = axis.y;
        own[2][c] = axis.z;
    }
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            t[r][c] = own[r][0] * target[4 * c] + own[r][1] * target[4 * c + 1] + own[r][2] * target[4 * c + 2];
    const real trace = t[0][0] + t[1][1] + t[2][2];
    int large = 0;
    for (int r = 0; r < 3; ++r)
        if (t[r][r] > (large ? t[large - 1][large - 1] : trace))
            large = r + 1;
    if (!large) {
        const real four = 2 * F(sqrt)(1 + trace);
        quaternion[0] = four / 4;
        for (int r = 0; r < 3; ++r)
            quaternion[1 + r] = (t[(r + 2) % 3][(r + 1) % 3] - t[(r + 1) % 3][(r + 2) % 3]) / four;
    } else {
        const int a = large - 1, b = (a + 1) % 3, c = (a + 2) % 3;
        const real four = 2 * F(sqrt)(1 + t[a][a] - t[b][b] - t[c][c]);
        quaternion[0] = (t[c][b] - t[b][c]) / four;
        quaternion[1 + a] = four / 4;
        quaternion[1 + b] = (t[a][b] + t[b][a]) / four;
        quaternion[1 + c] = (t[a][c] + t[c][a]) / four;
    }
    const real sign = quaternion[0] < 0 ? R(-1.0) : R(1.0);
    for (int r = 0; r < 4; ++r)
        quaternion[r] *= sign;
}

/* The rotation vector of a turn, and E of turns, 1 - [v] / 2 + c [v]^2, row by row. Returns whether it is half a turn, to
   1e-6 rad: the opposite vector would do as well. */
static inline int rotation_of(const real *quaternion, real *v, real *e)
{
    const real w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
    const real sine = F(sqrt)(x * x + y * y + z * z), half = F(atan2)(sine, w);
    const int small = sine < R(1e-4);
    const real c = small ? R(1.0) / 12 : (1 - half * w / sine) / (4 * half * half);
    for (int r = 0; r < 3; ++r)
        v[r] = quaternion[1 + r] * (small ? 2 : 2 * half / sine);
    const real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k < 3; ++k)
            e[3 * r + k] = c * v[r] * v[k] + (r == k ? 1 - c * square : 0);
    for (int r = 0; r < 3; ++r) {
        const int next = (r + 1) % 3, last = (r + 2) % 3;
        e[3 * next + last] += v[r] / 2;
        e[3 * last + next] -= v[r] / 2;
    }
    return w < R(5e-7);
}

/* Whether the first three columns of a pose turn, to 1e-4: they may be rounded, but neither stretch nor mirror. */
static inline int turns_only(const real *pose)
{
    for (int r = 0; r < 3; ++r)
        for (int k = r; k < 3; ++k) {
            const real *const a = pose + 4 * r, *const b = pose + 4 * k;
            if (!(F(fabs)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - (r == k)) <= R(1e-4)))
                return 0;
        }
    const vector x = {pose[0], pose[1], pose[2]}, y = {pose[4], pose[5], pose[6]}, z = cross(x, y);
    return z.x * pose[8] + z.y * pose[9] + z.z * pose[10] > 0;
}

/* -E' K_e x, by the chosen rows, added to `force`; returns -7 at half a turn from a target, and for one that is none. */
static inline int pull(const struct sample *s, const API(frame_impedance) * wanted, const real *target, vector at, real *force)
{
    const real place[3] = {at.x, at.y, at.z};
    real x[6], e[9], chosen[6], pulled[6] = {0}, quaternion[4];
    int turns = 0;
    turn_from(s, wanted->frame, target, quaternion);
    const int opposite = rotation_of(quaternion, x, e);
    for (int r = 0; r < 3; ++r) {
        x[3 + r] = place[r] - target[4 * r + 3];
        for (int c = 0; wanted->point && c < 3; ++c)
            x[3 + r] -= target[4 * r + c] * wanted->point[c];
    }
    for (int r = 0; r < wanted->rows; ++r) {
        turns = turns || wanted->row[r] < 3;
        chosen[r] = x[wanted->row[r]];
    }
    if (turns && (opposite || !turns_only(target)))
        return -7;
    resist(wanted->rows, wanted->stiffness, chosen, pulled);
    for (int r = 0; r < wanted->rows; ++r)
        for (int k = 0; k < wanted->rows; ++k) {
            const int row = wanted->row[r], other = wanted->row[k];
            force[r] += row < 3 && other < 3 ? e[3 * other + row] * pulled[k] : r == k ? pulled[k] : 0;
        }
    return 0;
}
