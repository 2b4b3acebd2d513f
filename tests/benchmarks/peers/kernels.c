/* Times two packages of one robot, a kernel in LOOPS and a STRAIGHT one, in turns; the least of many spells of each.
   Arguments: joints, and the values of c2, c1 and g. Prints the ratio of times for blocks of 256 samples and for one. */
#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define JOIN(a, b) a##b
#define GLUE(a, b) JOIN(a, b)
typedef void function(size_t, const double *, const double *, const double *, double *, double *, double *, double *);
function GLUE(LOOPS, _decomposition), GLUE(LOOPS, _decomposition_blocks), GLUE(STRAIGHT, _decomposition),
    GLUE(STRAIGHT, _decomposition_blocks);
enum { SAMPLES = 256, BLOCK = 8 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double *room(size_t values)
{
    const size_t bytes = (values * sizeof(double) + 63) / 64 * 64;
    double *at = aligned_alloc(64, bytes);
    if (!at)
        exit(2);
    memset(at, 0, bytes);
    return at;
}

int main(int count, char **arguments)
{
    function *const called[2][2] = {{GLUE(LOOPS, _decomposition_blocks), GLUE(STRAIGHT, _decomposition_blocks)},
        {GLUE(LOOPS, _decomposition), GLUE(STRAIGHT, _decomposition)}};
    double *in[3], *out[4];
    size_t sizes[4], values = 0;
    if (count != 5)
        return 2;
    for (int a = 0; a < 4; ++a)
        sizes[a] = strtoul(arguments[a + 1], NULL, 10);
    for (int k = 0; k < 3; ++k) {
        in[k] = room(SAMPLES * sizes[0]);
        for (size_t e = 0; e < SAMPLES * sizes[0]; ++e)
            in[k][e] = 2.0 * sin(k + 1.0 + 7.1 * (double)e);
    }
    for (int k = 0; k < 4; ++k) {
        const size_t size = sizes[k < 3 ? k + 1 : 3];
        out[k] = room(SAMPLES * size);
        values += size;
    }
    for (int one = 0; one < 2; ++one) {
        double best[2] = {1e300, 1e300};
        const long rounds = 1 + (long)(3e6 / ((double)values * (one ? 2.0 : SAMPLES)));
        for (int repeat = 0; repeat < 100; ++repeat)
            for (int kernel = 0; kernel < 2; ++kernel) {
                const double start = now();
                for (long round = 0; round < rounds; ++round)
                    called[one][kernel](one ? 1 : SAMPLES / BLOCK, in[0], in[1], in[2], out[0], out[1], out[2], out[3]);
                const double took = now() - start;
                best[kernel] = took < best[kernel] ? took : best[kernel];
            }
        printf("%.2f ", best[0] / best[1]);
    }
    printf("\n");
    return 0;
}
