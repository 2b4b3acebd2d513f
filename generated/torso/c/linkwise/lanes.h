/* Numbers of several samples at a time, in vectors as wide as the processor's registers where the compiler has such
   types. The same in every package of linkwise.

   A block is worked on LANES samples at a time, each `lanes` of numbers; LANES_AT(at) are those in an array, which may
   start anywhere. */
#ifndef LINKWISE_LANES_H
#define LINKWISE_LANES_H

#if defined(__GNUC__) && !defined(LINKWISE_SMALL)
#if defined(__AVX512F__)
#define LANES (64 / (int)sizeof(real))
#elif defined(__AVX__)
#define LANES (32 / (int)sizeof(real))
#else
#define LANES (16 / (int)sizeof(real))
#endif
typedef real lanes __attribute__((vector_size(LANES * sizeof(real))));
typedef real lanes_anywhere __attribute__((vector_size(LANES * sizeof(real)), aligned(sizeof(real)), may_alias));
#else
#define LANES 1
typedef real lanes, lanes_anywhere;
#endif

#define LANES_AT(at) (*(lanes_anywhere *)(at))
#define LANES_FROM(at) (*(const lanes_anywhere *)(at))

/* Memory that is about to be written may be fetched meanwhile; it need not be there. */
#if defined(__GNUC__)
#define WRITTEN_SOON(at) __builtin_prefetch(at, 1)
#else
#define WRITTEN_SOON(at) ((void)(at))
#endif

#endif
