/* Sines and cosines of many angles. The same in every package of linkwise.

   With gcc and glibc, as C, these loops call the vector functions of the library libmvec, which -lm brings along.
   glibc declares them under -ffast-math only, hence the options, which hold for this file alone, and hence <math.h>
   here: nothing may include it before. Other compilers and C++ take one angle after another. */
#if defined(__GNUC__) && !defined(__clang__) && !defined(__cplusplus) && defined(__gnu_linux__) && !defined(LINKWISE_SMALL)
#define VECTOR_SINES
#pragma GCC push_options
#pragma GCC optimize("O3,fast-math")
#endif

#include <math.h>

SHARED void API(sines)(size_t count, const real *angle, real *sine, real *cosine);

#if PART(SINES)
SHARED void API(sines)(size_t count, const real *RESTRICT angle, real *RESTRICT sine, real *RESTRICT cosine)
{
    for (size_t e = 0; e < count; ++e)
        sine[e] = F(sin)(angle[e]);
    for (size_t e = 0; e < count; ++e)
        cosine[e] = F(cos)(angle[e]);
}
#endif

#ifdef VECTOR_SINES
#pragma GCC pop_options
#endif
