/* Results that no cache holds go past it: memory is then written without being read first. The same in every package
   of linkwise. It needs rows.h. */
#if defined(__AVX__) || defined(__AVX512F__)
#include <immintrin.h>
#endif
#include <string.h>

/* Above this many bytes, results are better not kept in the cache. */
#ifndef LARGE
#define LARGE ((size_t)64 << 20)
#endif

/* One cache line past the cache; `to` starts on one. */
#if defined(__AVX512F__)
#define STREAMS 1
static inline void stream_line(const void *from, void *to)
{
    _mm512_stream_si512((__m512i *)to, _mm512_loadu_si512(from));
}
#elif defined(__AVX__)
#define STREAMS 1
static inline void stream_line(const void *from, void *to)
{
    _mm256_stream_si256((__m256i *)to, _mm256_loadu_si256((const __m256i *)from));
    _mm256_stream_si256((__m256i *)to + 1, _mm256_loadu_si256((const __m256i *)from + 1));
}
#endif

/* `count` values past the cache where the processor can; lines that hold other values too are written as usual. */
static void stream(size_t count, const real *from, real *to)
{
#if defined(STREAMS)
    const size_t before = (64 - (size_t)to % 64) % 64 / sizeof(real), head = before < count ? before : count;
    const size_t end = head + (count - head) / BLOCK * BLOCK;
    memcpy(to, from, head * sizeof(real));
    for (size_t at = head; at < end; at += BLOCK)
        stream_line(from + at, to + at);
    memcpy(to + end, from + end, (count - end) * sizeof(real));
#else
    memcpy(to, from, count * sizeof(real));
#endif
}

/* A whole block to consecutive rows, put together in the cache and then written at one go. */
static inline void stream_rows(size_t entries, const real *block, real *rows, real *scratch)
{
    scatter(BLOCK, entries, entries, block, scratch);
    stream(entries * BLOCK, scratch, rows);
}

/* After the last of it: what went past the cache is in memory before anything that is written later, a flag that tells
   another thread of it, say. Stores past the cache are not ordered with others otherwise. */
static inline void stream_end(void)
{
#if defined(STREAMS)
    _mm_sfence();
#endif
}
