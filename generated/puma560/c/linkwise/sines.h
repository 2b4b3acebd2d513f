/* Sines and cosines of many angles. The same in every package of linkwise.

   Both of an angle come from one reduction, in a loop that compilers turn into vectors: with n the whole number next to
   2 angle / pi,

       angle = n pi / 2 + r + rest,   |r| <= pi / 4,   rest what r lost by rounding
       sin(r + rest) = r + (r^3 S(r^2) + rest)          cos(r + rest) = 1 - r^2 / 2 + (r^4 C(r^2) - r rest)

   and n says which of the two is which, and their signs. S and C are the polynomials of least relative error, 2^-57 in double
   and 2^-28 in float. pi / 2 is QUARTER + QUARTER_REST, and n QUARTER is exact for |n| <= 2^TURNS. Results are off by less than
   1 unit in their last place, or than 2^-67, in float 2^-29, where they are almost zero and angles are not. The C library's
   functions are called where an angle is beyond that, infinite or NaN, and where the compiler reorders sums, keeps more digits
   than it should or makes small code. */
#include <float.h>
#include <math.h>

SHARED void API(sines)(size_t count, const real *angle, real *sine, real *cosine);

#if PART(SINES)
#if !defined(__FAST_MATH__) && !defined(LINKWISE_SMALL) && FLT_EVAL_METHOD % 16 == 0
#ifdef LINKWISE_FLOAT
typedef unsigned word;
enum { MANTISSA = 23, TURNS = 9 };
#define QUARTER R(1.5706787109375)
#define QUARTER_REST R(0.00011761585739661923)
#define SINE_BY(z) (R(-0.16666654591348035) + z * (R(0.008332159585993534) - z * R(0.0001951512041449221)))
#define COSINE_BY(z) (R(0.04166664565091659) - z * (R(0.0013887314659562764) - z * R(2.4432971145367546e-05)))
#else
typedef unsigned long long word;
enum { MANTISSA = 52, TURNS = 19 };
#define QUARTER R(1.5707963267341256)
#define QUARTER_REST R(6.077100506506192e-11)
#define SINE_BY(z) \
    (R(-0.1666666666666663) + z * (R(0.00833333333332209) + z * (R(-0.00019841269829566093) \
    + z * (R(2.7557313612961395e-06) + z * (R(-2.5050746400887792e-08) + z * R(1.5896148847647893e-10))))))
#define COSINE_BY(z) \
    (R(0.041666666666666664) - z * (R(0.001388888888888658) - z * (R(2.480158729806052e-05) \
    - z * (R(2.7557317024629567e-07) - z * (R(2.0876108568537454e-09) - z * R(1.1380551352543826e-11))))))
#endif

INLINE word bits_of(real x)
{
    const union {
        real number;
        word bits;
    } same = {x};
    return same.bits;
}

/* Returns whether no angle was beyond what this is for. */
static int near_sines(size_t count, const real *RESTRICT angle, real *RESTRICT sine, real *RESTRICT cosine)
{
    /* Numbers of this size have 1 for their last bit: adding rounds to whole numbers, and the bits count them. */
    const real middle = R(1.5) * (real)((word)1 << MANTISSA);
    word every = 0;
    for (size_t e = 0; e < count; ++e) {
        const real shifted = angle[e] * R(0.6366197723675814) + middle, turns = shifted - middle;
        const word n = bits_of(shifted) - bits_of(middle);
        const real first = angle[e] - turns * QUARTER, r = first - turns * QUARTER_REST;
        const real rest = first - r - turns * QUARTER_REST, z = r * r, half = R(0.5) * z, upper = R(1.0) - half;
        const real s = r + (r * z * SINE_BY(z) + rest), c = upper + (R(1.0) - upper - half + (z * z * COSINE_BY(z) - r * rest));
        const real a = n & 1 ? c : s, b = n & 1 ? s : c;
        sine[e] = n & 2 ? -a : a;
        cosine[e] = (n + 1) & 2 ? -b : b;
        every |= n + ((word)1 << TURNS);
    }
    return !(every >> (TURNS + 1));
}
#undef QUARTER
#undef QUARTER_REST
#undef SINE_BY
#undef COSINE_BY
#else
static int near_sines(size_t count, const real *angle, real *sine, real *cosine)
{
    return (void)angle, (void)sine, (void)cosine, !count;
}
#endif

SHARED void API(sines)(size_t count, const real *RESTRICT angle, real *RESTRICT sine, real *RESTRICT cosine)
{
    if (near_sines(count, angle, sine, cosine))
        return;
    for (size_t e = 0; e < count; ++e)
        sine[e] = F(sin)(angle[e]);
    for (size_t e = 0; e < count; ++e)
        cosine[e] = F(cos)(angle[e]);
}
#endif
