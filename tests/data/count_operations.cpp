/* Counts what a kernel in loops computes for one sample, in numbers that know whether they vary. SOURCE is a robot's file.
   Numbers of the robot do not vary, literals do, for those of the base would otherwise not be counted. */
#include <cstdio>
#include <cmath>
#include <cstddef>
#undef __GNUC__
#define __FAST_MATH__ /* Sines, which are not counted, are then the C library's. */
#define LINKWISE_NUMBERS_H
static long operations;
struct real {
    double value;
    bool varies;
    real() : value(0), varies(true) {}
    real(double x) : value(x), varies(false) {}
    real(double x, bool v) : value(x), varies(v) {}
};
static real result(double x, real a, real b) { operations += a.varies || b.varies; return real(x, a.varies || b.varies); }
static real operator+(real a, real b) { return result(a.value + b.value, a, b); }
static real operator-(real a, real b) { return result(a.value - b.value, a, b); }
static real operator*(real a, real b) { return result(a.value * b.value, a, b); }
static real operator-(real a) { return real(-a.value, a.varies); }
static bool operator>=(real a, real b) { return a.value >= b.value; }
static real &operator+=(real &a, real b) { return a = a + b; }
static real &operator-=(real &a, real b) { return a = a - b; }
static real &operator*=(real &a, real b) { return a = a * b; }
#define R(x) real(x, true)
#define F(function) function##_counted
static real sin_counted(real a) { return real(std::sin(a.value), true); }
static real cos_counted(real a) { return real(std::cos(a.value), true); }
#define BLOCK 8
#define RESTRICT
#define ALIGNED
#define APART static
#define INLINE static inline
#define SINES 1
#define ONE_SAMPLE 2
#define BLOCKS 3
#define POSITION_GRADIENT 4
#define CONTROL 6
#define PART(part) (part <= ONE_SAMPLE)
#define SHARED static
#include SOURCE
int main()
{
    static real q[N], c2[C2], c1[C1], g[G], tau[G];
    /* Tables are made before this is reached, of literals. */
    real *const numbers = reinterpret_cast<real *>(const_cast<struct numbers *>(&own_numbers));
    for (size_t at = 0; at < sizeof own_numbers / sizeof(real); ++at)
        numbers[at].varies = false;
    operations = 0;
    API(decomposition_one)(q, q, q, c2, c1, g, tau);
    std::printf("%ld ", operations);
    operations = 0;
    API(torque_one)(q, q, q, tau);
    std::printf("%ld\n", operations);
}
