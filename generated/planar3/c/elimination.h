/* Linear equations, by Gaussian elimination. The same in every package of linkwise. */
#ifndef LINKWISE_ELIMINATION_H
#define LINKWISE_ELIMINATION_H

#include <float.h>
#include <string.h>

/* Rows of the largest matrix: of joints, or of a frame. */
enum { LARGEST = N > 6 ? N : 6 };

/* What a matrix is known to be: symmetric and positive, of which the upper half is read; positive; or regular, which takes
   rows in another order. */
enum known { SYMMETRIC, POSITIVE, REGULAR };

static inline void swap_numbers(int count, real *a, real *b)
{
    for (int k = 0; k < count; ++k) {
        const real kept = a[k];
        a[k] = b[k];
        b[k] = kept;
    }
}

/* Of the rows from c on, the one whose entry of column c is the largest. */
static inline int largest_row(int n, int c, const real *scale, const real *a)
{
    int row = c;
    for (int r = c + 1; r < n; ++r)
        if (F(fabs)(a[r * n + c]) * scale[r] > F(fabs)(a[row * n + c]) * scale[row])
            row = r;
    return row;
}

/* x of a x = b: a (n, n), b (n, columns), which turns into x; a is written over. Entry (i, k) is large or small beside the
   root of size[i] size[k]. Where a pivot is rounding beside that, or of a positive matrix negative, or not a number, its
   column is the answer, counted from 1, and otherwise 0. */
INLINE int eliminate(enum known known, int n, int columns, const real *size, real *a, real *b)
{
    real scale[LARGEST];
    for (int i = 0; known == REGULAR && i < n; ++i)
        scale[i] = 1 / F(sqrt)(size[i]);
    const real least = 4 * n * (sizeof(real) == sizeof(float) ? (real)FLT_EPSILON : (real)DBL_EPSILON);
    for (int c = 0; c < n; ++c) {
        real *const row = a + c * n, *const right = b + c * columns;
        real large = row[c];
        if (known == REGULAR) {
            const int other = largest_row(n, c, scale, a);
            swap_numbers(n, row, a + other * n);
            swap_numbers(columns, right, b + other * columns);
            swap_numbers(1, scale + c, scale + other);
            large = F(fabs)(row[c]) * scale[c] * F(sqrt)(size[c]);
        }
        if (!(large > least * size[c]))
            return c + 1;
        const real inverse = 1 / row[c];
        for (int r = c + 1; r < n; ++r) {
            const real factor = (known == SYMMETRIC ? row[r] : a[r * n + c]) * inverse;
            for (int k = known == SYMMETRIC ? r : c + 1; k < n; ++k)
                a[r * n + k] -= factor * row[k];
            for (int k = 0; k < columns; ++k)
                b[r * columns + k] -= factor * right[k];
        }
        row[c] = inverse;
    }
    for (int i = n; i--;) {
        real *const right = b + i * columns;
        for (int c = i + 1; c < n; ++c)
            for (int k = 0; k < columns; ++k)
                right[k] -= a[i * n + c] * b[c * columns + k];
        for (int k = 0; k < columns; ++k)
            right[k] *= a[i * n + i];
    }
    return 0;
}

#endif
