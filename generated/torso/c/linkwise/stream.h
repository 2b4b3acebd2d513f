/* Results that no cache holds go past it: memory is then written without being read first. The same in every package
   of linkwise. It needs rows.h. */
#ifndef LINKWISE_STREAM_H
#define LINKWISE_STREAM_H

#include "arrays.h"

/* Above this many bytes, results are better not kept in the cache: where they are read back at once, writing and reading
   took the same time either way at 20 MB, with a last-level cache of 32 MB. */
#ifndef LARGE
#define LARGE ((size_t)20 << 20)
#endif

/* A vector past the cache, to where such a vector may start, and the end of it. The compilers' own functions do for gcc and
   clang, as reading <immintrin.h> takes them longer than most of what is compiled here. A build may bring its own. */
#if !defined(STREAM) && defined(__GNUC__) && (defined(__AVX__) || defined(__AVX512F__))
#if defined(__AVX512F__)
#define STREAM_BYTES 64
#define STREAM_BUILTIN __builtin_ia32_movntdq512
#else
#define STREAM_BYTES 32
#define STREAM_BUILTIN __builtin_ia32_movntdq256
#endif
#if defined(__clang__)
#define STREAM(to, value) __builtin_nontemporal_store(value, to)
#else
#define STREAM(to, value) STREAM_BUILTIN(to, value)
#endif
#define STREAM_END() __builtin_ia32_sfence()
#endif

/* Whether the results of so many samples, of so many values each, go past the cache. */
static inline int past_cache(size_t samples, size_t values)
{
#if defined(STREAM)
    return samples > LARGE / (values * sizeof(real));
#else
    return (void)samples, (void)values, 0;
#endif
}

/* Whether a cache line starts here. */
static inline int starts_line(const real *at)
{
    return (size_t)at % 64 == 0;
}

#if defined(STREAM)
typedef long long stream_vector __attribute__((vector_size(STREAM_BYTES), may_alias));
typedef long long stream_vector_anywhere __attribute__((vector_size(STREAM_BYTES), aligned(sizeof(real)), may_alias));

/* One cache line past the cache; `to` starts on one. */
static inline void stream_line(const real *from, real *to)
{
    for (size_t v = 0; v < 64 / STREAM_BYTES; ++v)
        STREAM((stream_vector *)to + v, ((const stream_vector_anywhere *)from)[v]);
}
#endif

/* `count` values past the cache where the processor can; lines that hold other values too are written as usual. */
static void stream(size_t count, const real *from, real *to)
{
#if defined(STREAM)
    const size_t before = (64 - (size_t)to % 64) % 64 / sizeof(real), head = before < count ? before : count;
    const size_t end = head + (count - head) / BLOCK * BLOCK;
    copy(head, from, to);
    for (size_t at = head; at < end; at += BLOCK)
        stream_line(from + at, to + at);
    copy(count - end, from + end, to + end);
#else
    copy(count, from, to);
#endif
}

/* A block to consecutive rows; where they are `large` and the block is full, put together in the cache and then written at
   one go. */
static inline void put_rows(size_t samples, size_t entries, int large, const real *block, real *rows, real *scratch)
{
    if (!large || samples != BLOCK) {
        scatter(samples, entries, entries, block, rows);
        return;
    }
    scatter(BLOCK, entries, entries, block, scratch);
    stream(entries * BLOCK, scratch, rows);
}

/* After the last of it: what went past the cache is in memory before anything that is written later, a flag that tells
   another thread of it, say. Stores past the cache are not ordered with others otherwise. */
static inline void stream_end(void)
{
#if defined(STREAM)
    STREAM_END();
#endif
}

#endif
