/* Linear equations, by Gaussian elimination. The same in every package of linkwise. */
#ifndef LINKWISE_ELIMINATION_H
#define LINKWISE_ELIMINATION_H

#include <float.h>
#include "arrays.h"

#ifdef LINKWISE_FLOAT
#define EPSILON FLT_EPSILON
#else
#define EPSILON DBL_EPSILON
#endif

/* Rows of the largest matrix, of joints or of a frame; and numbers to which a row is filled up with zeros, so that rows are
   subtracted in whole vectors. */
enum { LARGEST = N > 6 ? N : 6, FILLED = 8 };

/* The row, from c on, whose entry of column c is the largest beside what such entries are about. */
static inline int largest_row(int n, int width, int c, const real *scale, const real *rows)
{
    int row = c;
    for (int r = c + 1; r < n; ++r)
        if (F(fabs)(rows[r * width + c]) * scale[r] > F(fabs)(rows[row * width + c]) * scale[row])
            row = r;
    return row;
}

/* Column of the joint whose pivot is the least beside its inertia, and the part of its inertia that is left when all
   others move freely; where far more than rounding is left, when those before it do. Of a matrix that is not known to be
   positive, what is left is 1 by the largest number of its inverse. */
struct pivot {
    int column;
    real left;
};

/* Beside numbers of the size of 1: a pivot that is rounding, one that may be, and one by which half of the digits are lost. */
#define ROUNDING(n) (4 * (real)(n) * EPSILON)
#define SMALL (1000 * F(sqrt)(EPSILON))
#define HALF F(sqrt)(EPSILON)

/* 0, or the joint, from 1, by which fewer than half of the digits of a solution are known. */
static inline int vague(const struct pivot *weakest)
{
    return weakest->left < HALF ? weakest->column + 1 : 0;
}

/* 1 / (a_cc (a^-1)_cc) of a positive a = L D L', of which rows hold D L' and 1 / D: (a^-1)_cc = y' D^-1 y, L y = e_c. */
static inline real left_when_free(int n, int width, int c, real size, const real *rows)
{
    ALIGNED real y[LARGEST] = {0}, mobility = 0;
    y[c] = 1;
    for (int m = c; m < n; ++m) {
        const real *const row = rows + m * width, moved = y[m] * row[m];
        mobility += moved * y[m];
        for (int k = m + 1; k < n; ++k)
            y[k] -= row[k] * moved;
    }
    return 1 / (size * mobility);
}

/* x of a x = b: a (n, n), b (n, sides), which turns into x, of up to six sides. Where a is `regular` and not known to be
   positive, rows are taken in another order. Entry (i, k) is large or small beside the root of size[i] size[k]. Where a pivot
   or what is left is rounding beside that, or of a positive matrix negative, or not a number, its column is the answer, counted
   from 1, and b is as it was; otherwise the answer is 0. `weakest`, given as {0, 1}, is found, unless it is NULL: x is known to
   a relative error of about EPSILON / left. Of a matrix that is not known to be positive its pivot is all that is looked at. */
/* The rows are ALIGNED as gcc 12 takes them to be, where it vectorizes what is left of a loop. */
INLINE int eliminate(int regular, int n, int sides, const real *size, const real *a, real *b, struct pivot *weakest)
{
    const real least = ROUNDING(n);
    const int width = (n + sides + FILLED - 1) / FILLED * FILLED;
    ALIGNED real rows[LARGEST * (LARGEST + 6 + FILLED)], scale[LARGEST];
    for (int r = 0; r < n; ++r) {
        for (int k = 0; k < n; ++k)
            rows[r * width + k] = a[r * n + k];
        for (int k = 0; k < sides; ++k)
            rows[r * width + n + k] = b[r * sides + k];
        for (int k = n + sides; k < width; ++k)
            rows[r * width + k] = 0;
        scale[r] = regular ? 1 / F(sqrt)(size[r]) : 1;
    }
    for (int c = 0; c < n; ++c) {
        real *const row = rows + c * width;
        real large = row[c];
        if (regular) {
            const int other = largest_row(n, width, c, scale, rows);
            for (int k = 0; k < width; ++k) {
                const real kept = row[k];
                row[k] = rows[other * width + k];
                rows[other * width + k] = kept;
            }
            large = F(fabs)(row[c]) * scale[other] * F(sqrt)(size[c]);
            scale[other] = scale[c];
        }
        if (!(large > least * size[c]))
            return c + 1;
        if (weakest && large < weakest->left * size[c]) {
            weakest->column = c;
            weakest->left = large / size[c];
        }
        const real inverse = 1 / row[c];
        for (int r = c + 1; r < n; ++r) {
            const real factor = rows[r * width + c] * inverse;
            for (int k = 0; k < width; ++k)
                rows[r * width + k] -= factor * row[k];
        }
        row[c] = inverse;
    }
    if (weakest && !regular && weakest->left < SMALL) {
        weakest->left = left_when_free(n, width, weakest->column, size[weakest->column], rows);
        if (!(weakest->left > least))
            return weakest->column + 1;
    }
    for (int c = n; c--;)
        for (int k = 0; k < sides; ++k) {
            const real x = rows[c * width + n + k] * rows[c * width + c];
            b[c * sides + k] = x;
            for (int r = 0; r < c; ++r)
                rows[r * width + n + k] -= rows[r * width + c] * x;
        }
    return 0;
}

#endif
