/* Times CasADi's generated function on one sample after another. Prints "best nanoseconds". */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#ifndef casadi_real
#define casadi_real double
#endif
int decomposition(const casadi_real **in, casadi_real **out, long long *integers, casadi_real *work, int memory);
int decomposition_work(long long *in, long long *out, long long *integers, long long *work);

enum { SAMPLES = 128, REPEATS = 500 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

int main(int count, char **arguments)
{
    const size_t n = strtoul(arguments[count > 1], NULL, 10), entries = strtoul(arguments[2], NULL, 10);
    long long arguments_room, results_room, integers, work;
    decomposition_work(&arguments_room, &results_room, &integers, &work);
    double *motion = malloc(3 * n * SAMPLES * sizeof(double)), *to = malloc(entries * SAMPLES * sizeof(double));
    double *scratch = malloc(((size_t)work + 1) * sizeof(double)), best = 1e300;
    long long *whole = malloc(((size_t)integers + 1) * sizeof(long long));
    const double **in = malloc((size_t)arguments_room * sizeof(double *));
    double **out = malloc((size_t)results_room * sizeof(double *));
    for (size_t e = 0; e < 3 * n * SAMPLES; ++e)
        motion[e] = 3.0 * ((double)rand() / RAND_MAX - 0.5);
    for (int repeat = 0; repeat < REPEATS; ++repeat) {
        const double start = now();
        for (size_t s = 0; s < SAMPLES; ++s) {
            for (size_t a = 0; a < 3; ++a)
                in[a] = motion + (3 * s + a) * n;
            out[0] = to + s * entries;
            decomposition(in, out, whole, scratch, 0);
        }
        const double took = (now() - start) / SAMPLES;
        best = took < best ? took : best;
    }
    printf("best %.5g\n", best);
    return 0;
}
