/* Results that no cache holds go past it: memory is then written without being read first. The same in every package
   of linkwise. It needs rows.h. */
#if defined(__AVX512F__) || defined(__AVX__)
#define PAST_CACHE
#include <immintrin.h>
#endif
#include <string.h>

/* Above this many bytes, results are better not kept in the cache. */
#ifndef LARGE
#define LARGE ((size_t)64 << 20)
#endif

/* `count` values past the cache, if `to` starts on a cache line, as it does wherever that matters, and the processor
   can; otherwise an ordinary copy. */
static void stream(size_t count, const real *from, real *to)
{
#if defined(PAST_CACHE)
    if ((size_t)to % 64 == 0 && count % BLOCK == 0) {
#if defined(__AVX512F__)
        for (size_t at = 0; at < count; at += BLOCK)
            _mm512_stream_si512((__m512i *)(to + at), _mm512_load_si512((const __m512i *)(from + at)));
#else
        for (size_t at = 0; at < count; at += BLOCK / 2)
            _mm256_stream_si256((__m256i *)(to + at), _mm256_load_si256((const __m256i *)(from + at)));
#endif
        return;
    }
#endif
    memcpy(to, from, count * sizeof(real));
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
#if defined(PAST_CACHE)
    _mm_sfence();
#endif
}
