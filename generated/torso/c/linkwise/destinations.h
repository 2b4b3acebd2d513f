/* Where results go that have their zeros, and which torques are asked for. The same in every package of linkwise. */
#ifndef LINKWISE_DESTINATIONS_H
#define LINKWISE_DESTINATIONS_H

/* Values of a square and of a cube: see dense.h. */
enum { SQUARE = N * LINKS, CUBE = SQUARE * N };

/* Where cubes and squares of samples in rows go; whether cubes are coefficients or these times the motion; and whether
   c1 is in them as it is, which sums to tau, or as slopes, d(tau)/d(qd). */
struct dense {
    real *acceleration, *velocity, *gravity;
    int torques, slopes;
};

/* Torques alone: packed, with their zeros, or their sums over the links. */
enum torques { PACKED, DENSE, SUMS };

#endif
