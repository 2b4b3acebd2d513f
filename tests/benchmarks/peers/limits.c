/* What the machine can do at most: additions and multiplications in registers, and bytes written to memory.
   Prints "name value" lines: flops and flopsf in GFlop/s; write <bytes> in GB/s for each size given. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#if defined(__AVX512F__)
#define BYTES 64
#elif defined(__AVX__)
#define BYTES 32
#else
#define BYTES 16
#endif
typedef double doubles __attribute__((vector_size(BYTES)));
typedef float floats __attribute__((vector_size(BYTES)));

/* 12 chains of x = x * a + b with multiplication and addition apart, as ISO C has them: no fused operation. */
#define RATE(name, vector, real)                                                        \
    static double name(void)                                                            \
    {                                                                                   \
        enum { CHAINS = 12, ROUNDS = 100000, LANES = sizeof(vector) / sizeof(real) };   \
        vector x[CHAINS] = {0}, a = x[0] + (real)0.999, b = x[0] + (real)0.001;         \
        __asm__ volatile("" : "+x"(a), "+x"(b));                                        \
        double best = 1e9;                                                              \
        for (int repeat = 0; repeat < 30; ++repeat) {                                   \
            const double start = now();                                                 \
            for (int round = 0; round < ROUNDS; ++round)                                \
                for (int c = 0; c < CHAINS; ++c)                                        \
                    x[c] = x[c] * a + b;                                                \
            const double took = now() - start;                                          \
            best = took < best ? took : best;                                           \
        }                                                                               \
        for (int c = 0; c < CHAINS; ++c)                                                \
            __asm__ volatile("" : : "x"(x[c]));                                         \
        return 2e-9 * CHAINS * LANES * ROUNDS / best;                                   \
    }
RATE(rate, doubles, double)
RATE(ratef, floats, float)

int main(int count, char **sizes)
{
    printf("flops %.4g\nflopsf %.4g\n", rate(), ratef());
    for (int s = 1; s < count; ++s) {
        const size_t bytes = (size_t)strtod(sizes[s], NULL);
        const int rounds = (int)(4e6 / (double)bytes) + 1;
        char *to = malloc(bytes);
        double best = 1e9;
        if (!to)
            return 1;
        memset(to, 1, bytes);
        for (int repeat = 0; repeat < 15; ++repeat) {
            const double start = now();
            for (int round = 0; round < rounds; ++round) {
                memset(to, repeat + round, bytes);
                __asm__ volatile("" : : "r"(to) : "memory");
            }
            const double took = (now() - start) / rounds;
            best = took < best ? took : best;
        }
        printf("write_%s %.4g\n", sizes[s], 1e-9 * (double)bytes / best);
        free(to);
    }
    return 0;
}
