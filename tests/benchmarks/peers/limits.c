/* What the machine can do at most: arithmetic in registers, in the mix of the emitted code, and bytes written to memory.
   FUSED and PRODUCTS say how many of 32 instructions of arithmetic are fused operations, and how many products; the
   others are sums. Arguments: sizes in bytes. Prints "name value" lines: flops and flopsf in GFlop/s, where a fused
   operation counts as two; for each size the GB/s of writing so much past the cache (stream), to memory in use (warm),
   and to memory that the system hands out for it (fresh). */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#if defined(__AVX__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__)
#define BYTES 64
#elif defined(__AVX__)
#define BYTES 32
#else
#define BYTES 16
#endif
typedef double doubles __attribute__((vector_size(BYTES)));
typedef float floats __attribute__((vector_size(BYTES)));
enum { MIX = 32, CHAINS = 12, ROUNDS = 4000 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* 12 chains, which hide each other's latency. Sums come first, so that none follows a product, to fuse with it. */
#define RATE(name, vector, real)                                                               \
    static double name(void)                                                                   \
    {                                                                                          \
        enum { SUMS = MIX - FUSED - PRODUCTS, LANES = sizeof(vector) / sizeof(real) };         \
        vector x[CHAINS] = {0}, a = x[0] + (real)0.999, b = x[0] + (real)0.001;                \
        __asm__ volatile("" : "+x"(a), "+x"(b));                                               \
        double best = 1e9;                                                                     \
        for (int repeat = 0; repeat < 60; ++repeat) {                                          \
            const double start = now();                                                        \
            for (int round = 0; round < ROUNDS; ++round) {                                     \
                _Pragma("GCC unroll 32") for (int i = 0; i < MIX; ++i)                         \
                    _Pragma("GCC unroll 12") for (int c = 0; c < CHAINS; ++c)                  \
                        x[c] = i < SUMS ? x[c] + b : i < SUMS + FUSED ? x[c] * a + b : x[c] * a; \
                for (int c = 0; c < CHAINS; ++c)                                               \
                    __asm__ volatile("" : "+x"(x[c]));                                         \
            }                                                                                  \
            const double took = now() - start;                                                 \
            best = took < best ? took : best;                                                  \
        }                                                                                      \
        return 1e-9 * (MIX + FUSED) * CHAINS * LANES * ROUNDS / best;                          \
    }
RATE(rate, doubles, double)
RATE(ratef, floats, float)

/* Bytes past the cache; where the compiler knows no such store, as memset does it. */
static void stream(char *to, size_t bytes, int value)
{
#if defined(__AVX__)
    const __m256i line = _mm256_set1_epi8((char)value);
    for (size_t at = 0; at + 32 <= bytes; at += 32)
        _mm256_stream_si256((__m256i *)(to + at), line);
    _mm_sfence();
#else
    memset(to, value, bytes);
#endif
}

/* Memory as the system hands it out, on large pages if it has them. */
static char *room(size_t bytes)
{
    char *at = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED)
        exit(1);
#ifdef MADV_HUGEPAGE
    madvise(at, bytes, MADV_HUGEPAGE);
#endif
    return at;
}

static void written(size_t bytes)
{
    const int rounds = (int)(4e6 / (double)bytes) + 1, repeats = bytes < (size_t)1e8 ? 25 : 7;
    char *to = room(bytes);
    double stream_best = 1e9, warm = 1e9, fresh = 1e9;
    memset(to, 1, bytes);
    for (int repeat = 0; repeat < repeats; ++repeat) {
        double start = now();
        for (int round = 0; round < rounds; ++round)
            stream(to, bytes, repeat + round);
        double took = (now() - start) / rounds;
        stream_best = took < stream_best ? took : stream_best;
        start = now();
        for (int round = 0; round < rounds; ++round) {
            memset(to, repeat + round, bytes);
            __asm__ volatile("" : : "r"(to) : "memory");
        }
        took = (now() - start) / rounds;
        warm = took < warm ? took : warm;
        start = now();
        char *other = room(bytes);
        memset(other, 1, bytes);
        __asm__ volatile("" : : "r"(other) : "memory");
        took = now() - start;
        fresh = took < fresh ? took : fresh;
        munmap(other, bytes);
    }
    const double giga = 1e-9 * (double)bytes;
    printf("stream_%zu %.4g\nwarm_%zu %.4g\nfresh_%zu %.4g\n", bytes, giga / stream_best, bytes, giga / warm, bytes,
        giga / fresh);
    munmap(to, bytes);
}

int main(int count, char **sizes)
{
    printf("flops %.4g\nflopsf %.4g\n", rate(), ratef());
    for (int s = 1; s < count; ++s)
        written((size_t)strtod(sizes[s], NULL));
    return 0;
}
