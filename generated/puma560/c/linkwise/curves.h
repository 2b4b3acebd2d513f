/* What joints move by, and the angles by which their frames turn. The same in every package of linkwise. It goes by the tables
   of tree.h. */
#ifndef LINKWISE_CURVES_H
#define LINKWISE_CURVES_H

/* CURVED is defined where a joint follows a curve. What joint f, from 0, moves by is then in a table by joints, else it is
   its coordinate. */
#ifdef CURVED
#define MOVED_BY(f) (f)
enum { DERIVATIVES = 4 };

/* A joint's curve at q, and its derivatives, `stride` apart. The polynomial of a piece is in q less its start; it holds up to
   the start of the next one, the first one before its own too. */
static inline void curve_at(int f, real q, int stride, real *moved)
{
    int piece = curves[f].first;
    const int end = piece + curves[f].pieces;
    real d[DERIVATIVES] = {q, R(1.0)};
    if (piece < end) {
        while (piece + 1 < end && q >= curve_starts[piece + 1])
            ++piece;
        const real x = q - curve_starts[piece];
        d[0] = d[1] = 0;
        for (int power = POWERS; power-- > 0;) {
            for (int n = DERIVATIVES; --n > 0;)
                d[n] = d[n] * x + d[n - 1];
            d[0] = d[0] * x + curve_powers[piece][power];
        }
    }
    moved[0] = d[0];
    moved[stride] = d[1];
    moved[2 * stride] = 2 * d[2];
    moved[3 * stride] = 6 * d[3];
}

/* Displacements of all joints of `width` samples, and their derivatives, a table for each. */
static inline void displace(int width, const real *q, real *moved)
{
    for (int f = 0; f < FRAMES; ++f)
        for (int b = 0; b < width; ++b)
            curve_at(f, q[joints[f].coordinate * width + b], FRAMES * width, moved + f * width + b);
}

#define DISPLACED(width, q) \
    ALIGNED real moved[DERIVATIVES * FRAMES * (width)]; \
    displace(width, q, moved)
#else
#define MOVED_BY(f) (joints[f].coordinate)
#define DISPLACED(width, q) const real *const moved = (q)
#endif

/* Angles of `width` samples by what joints moved; 0 for a frame that slides. */
static inline void angles(const struct numbers *x, int width, const real *moved, real *angle)
{
    for (int f = 0; f < FRAMES; ++f)
        for (int b = 0; b < width; ++b)
            angle[f * width + b] = joints[f].kind == REVOLUTE ? x->placings[f].ratio * moved[MOVED_BY(f) * width + b] : R(0.0);
}

#endif
