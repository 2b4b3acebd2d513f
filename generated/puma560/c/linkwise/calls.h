/* Functions that are the same for every kernel. The same in every package of linkwise.

   The file that includes it has torque_rows, dense_rows and gradient_rows, which compute rows of results by its kernel. It
   says by INPUTS what functions are given, by PASSED how that is handed on, and by AT_REST and PASSED_AT_REST the same of
   those that take no qdd. */
#include "arrays.h"
#include "destinations.h"

#if PART(ONE_SAMPLE)
SHARED void API(dense_torque_one)(INPUTS, int summed, real *torque)
{
    real tau[G];
    API(torque_one)(PASSED, tau);
    clear(summed ? (size_t)N : (size_t)SQUARE, torque);
    if (summed)
        to_sums_one(0, LINKS, tau, 1, torque);
    else
        to_squares_one(0, LINKS, tau, 1, torque);
}
#endif

#if PART(BLOCKS)
void API(torque)(size_t count, INPUTS, real *tau)
{
    if (count == 1)
        API(torque_one)(PASSED, tau);
    else
        torque_rows(count, PASSED, PACKED, tau);
}

void API(partial_torque)(size_t count, INPUTS, real *torque)
{
    if (count == 1)
        API(dense_torque_one)(PASSED, 0, torque);
    else
        torque_rows(count, PASSED, DENSE, torque);
}

void API(inverse_dynamics)(size_t count, INPUTS, real *torque)
{
    if (count == 1)
        API(dense_torque_one)(PASSED, 1, torque);
    else
        torque_rows(count, PASSED, SUMS, torque);
}

void API(coefficients)(size_t count, AT_REST, real *acceleration, real *velocity, real *gravity)
{
    const struct dense to = {acceleration, velocity, gravity, 0, 0};
    dense_rows(count, PASSED_AT_REST, &to); /* any qdd: coefficients don't depend on it */
}

void API(propagation)(size_t count, INPUTS, real *acceleration, real *velocity, real *gravity)
{
    const struct dense to = {acceleration, velocity, gravity, 1, 0};
    dense_rows(count, PASSED, &to);
}

void API(gradient_propagation)(size_t count, INPUTS, real *acceleration, real *velocity, real *gravity)
{
    const struct dense to = {acceleration, velocity, gravity, 1, 1};
    dense_rows(count, PASSED, &to);
}
#endif

#if PART(POSITION_GRADIENT)
void API(position_gradient)(size_t count, INPUTS, real *c0)
{
    gradient_rows(count, PASSED, 0, c0);
}

void API(dense_position_gradient)(size_t count, INPUTS, real *gradient)
{
    gradient_rows(count, PASSED, 1, gradient);
}
#endif
