/* Number types, compilers and parts: what all files here rely on. The same in every package of linkwise.

   One text of arithmetic serves double and float, one sample and many. It is written with
       real    double or float
       R(x)    the number x in that type                     F(f)   the C library's function f in that type
       W       samples that are computed at a time: 1 or BLOCK
   Beside these, SHARED marks a function that one part calls and another defines.

   In closed forms, vectors have components _x, _y and _z; numbers in names count joints from 1, and 0 is the base:
       sin3, cos3      sine and cosine of joint 3 (3b: of another joint that follows coordinate 3)
       x3, y3, z3      axes of the frame that joint 3 moves; z3 is the joint's own axis
       s3_x, s3_y ...  moment (p - o) x z3 of the axis about the origin o, p a point on it
       zd3, sd3        how z3 and that moment change by the joints before
       w3, wd3         angular velocity and acceleration of what joint 3 carries
       v3, u3          its velocity at the origin o, and that of its frame relative to o
       n3_c2, f3_c2    wrench (moment, force) that accelerating joint 3 asks of the link: c2(i, j, 3) is its part on joint i
       n3_c1, f3_c1    the same for the velocity of joint 3 and c1(i, j, 3)
       ag              gravity
       c2_3_4, c1_3_4  coefficients c2(3, j, 4) and c1(3, j, 4) of this link j, where they are used again
       g_3, tau3_4     gravity's torque at joint 3, and with it what the motions of joints 1 to 4 ask of joint 3
       t1, t2, ...     parts of the above with the other sign, and whatever else is used more than once

   Equal components keep the name of the first joint that has them. Where a joint follows another (mimic), its z is times
   its ratio. Where the head of a link's file says so, lengths are times the square root of the link's mass. */
#ifndef LINKWISE_NUMBERS_H
#define LINKWISE_NUMBERS_H

#include <stddef.h>

#ifdef LINKWISE_FLOAT
typedef float real;
#define R(x) x##f
#define F(function) function##f
#else
typedef double real;
#define R(x) x
#define F(function) function
#endif

/* Samples in a block: one cache line of each quantity. Where stack and code are to be small, as on microcontrollers, a build
   says so by -DLINKWISE_SMALL: samples are then computed one by one. */
#ifdef LINKWISE_SMALL
#define BLOCK 1
#else
#define BLOCK (64 / (int)sizeof(real))
#endif

/* No two arrays that a function is given overlap; C++ has no word of its own for that. */
#if defined(__GNUC__) || defined(_MSC_VER)
#define RESTRICT __restrict
#elif defined(__cplusplus)
#define RESTRICT
#else
#define RESTRICT restrict
#endif

/* Blocks start on a cache line, so that no vector straddles two. What is APART stays a function of its own: one
   over blocks, put into its caller, would lose what RESTRICT says. */
#if defined(__GNUC__) && !defined(LINKWISE_SMALL)
#define ALIGNED __attribute__((aligned(64)))
#define APART __attribute__((noinline)) static
#else
#define ALIGNED
#define APART static
#endif

/* What is INLINE costs no call, not even without optimization: its vectors stay in registers. */
#if defined(__GNUC__) && !defined(LINKWISE_SMALL)
#define INLINE __attribute__((always_inline)) static inline
#else
#define INLINE static inline
#endif

/* Compiled as it stands, a robot's file is whole. A build may also compile it in parts, side by side, and link them:
   -DLINKWISE_PART=SINES, ONE_SAMPLE, BLOCKS, POSITION_GRADIENT, REGRESSORS, CONTROL or CONSTRAINTS, of which the last four
   may be left away. */
#define SINES 1
#define ONE_SAMPLE 2
#define BLOCKS 3
#define POSITION_GRADIENT 4
#define REGRESSORS 5
#define CONTROL 6
#define CONSTRAINTS 7
#if defined(LINKWISE_PART) && defined(LINKWISE_SMALL)
#error "LINKWISE_SMALL is for a robot's file as a whole: leave LINKWISE_PART away"
#endif
#ifndef LINKWISE_PART
#define PART(part) 1
#define SHARED static
#else
#define PART(part) (LINKWISE_PART == part)
#if defined(__GNUC__) && !defined(_WIN32)
#define SHARED __attribute__((visibility("hidden")))
#else
#define SHARED
#endif
#endif

/* Functions of what ties joints take more stack and code than all others: with LINKWISE_SMALL they are there where a build asks
   for them by -DLINKWISE_CONSTRAINTS. */
#if PART(CONSTRAINTS) && (!defined(LINKWISE_SMALL) || defined(LINKWISE_CONSTRAINTS))
#define CONSTRAINED 1
#else
#define CONSTRAINED 0
#endif

#endif
