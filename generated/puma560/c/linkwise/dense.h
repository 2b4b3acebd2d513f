/* Results to their places among zeros. The same in every package of linkwise.

   A cube is a row (N, LINKS, N) of c(i, j, k), a square a row (N, LINKS) of g(i, j) or tau(i, j). Link j has values for
   the joints on its path alone, path[path_start[j]] to path[path_start[j + 1] - 1]. The file that includes this one has
   these tables, and nonquadratic[j], whether link j has h1. It says by W and SIZED, as for closed forms, of how many samples
   functions are, and includes this once for each. Values come packed, as links store them: entry e of sample b is at
   e * W + b, in cubes too. Of links, `first` is the first, and the one before `last` the last. */
#ifndef LINKWISE_DENSE_H
#define LINKWISE_DENSE_H

#include "arrays.h"
#include "destinations.h"
#endif

/* Links into a cube that `sharing` links have in common, the first one's entries at its start: each times `by` of joint k. c has all
   (i, k), or `half` of them, i <= k, where (k, i) is the same. The cube has rows for every i, or, of a link by itself,
   for those on its `path_only`. Returns where the next link's begin. */
APART const real *SIZED(place)(int first, int last, int half, const real *RESTRICT c, const real *RESTRICT by, int sharing,
    int path_only, real *RESTRICT cube)
{
    const size_t step = (size_t)sharing * N;
    for (int j = first; j < last; ++j) {
        const short *const joint = path + path_start[j];
        const int length = path_start[j + 1] - path_start[j];
        real *const mine = cube + (size_t)(j - first) * N * W;
        for (int x = 0; x < length; ++x) {
            const int i = joint[x], row = path_only ? x : i;
            for (int y = half ? x : 0; y < length; ++y, c += W) {
                const int k = joint[y], mirror = path_only ? y : k;
                real *const to = mine + ((size_t)row * step + (size_t)k) * W;
                for (int b = 0; b < W; ++b)
                    to[b] = c[b] * by[k * W + b];
                if (half) {
                    real *const mirrored = mine + ((size_t)mirror * step + (size_t)i) * W;
                    for (int b = 0; b < W; ++b)
                        mirrored[b] = c[b] * by[i * W + b];
                }
            }
        }
    }
    return c;
}

/* From c1 of links to its slopes, 2 c1 - h1. */
static inline void SIZED(to_slopes)(int first, int last, real *RESTRICT c1, const real *RESTRICT h1)
{
    for (int j = first; j < last; ++j) {
        const int length = path_start[j + 1] - path_start[j];
        for (int e = 0; e < length * length; ++e, c1 += W)
            for (int b = 0; b < W; ++b)
                c1[b] *= R(2.0);
        if (!nonquadratic[j])
            continue;
        c1 -= length * length * W;
        for (int e = 0; e < length * length; ++e, c1 += W, h1 += W)
            for (int b = 0; b < W; ++b)
                c1[b] -= h1[b];
    }
}

/* Links into squares, which are in rows and have their zeros. */
static inline void SIZED(to_squares)(int first, int last, const real *g, size_t samples, real *squares)
{
    for (int j = first; j < last; ++j)
        for (int x = path_start[j]; x < path_start[j + 1]; ++x, g += W)
            for (size_t b = 0; b < samples; ++b)
                squares[b * SQUARE + (size_t)(path[x] * LINKS + j)] = g[b];
}

/* Torques of links, added to the sums of each joint, which are in rows. */
static inline void SIZED(to_sums)(int first, int last, const real *tau, size_t samples, real *rows)
{
    for (int j = first; j < last; ++j)
        for (int x = path_start[j]; x < path_start[j + 1]; ++x, tau += W) {
            const size_t i = (size_t)path[x];
            for (size_t b = 0; b < samples; ++b)
                rows[b * N + i] += tau[b];
        }
}
