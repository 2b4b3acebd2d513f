/* Rows of samples one after another, by the functions of one sample: what stands in place of blocks where a build asks for
   little stack and code by LINKWISE_SMALL. The same in every package of linkwise.

   The file that includes it says by PASSED_ROW what those functions are given of row s, by RESULTS what a decomposition
   writes, and by RESULTS_ROW what of it is row s. */
#include "destinations.h"

void API(decomposition)(size_t count, INPUTS, RESULTS)
{
    for (size_t s = 0; s < count; ++s)
        API(decomposition_one)(PASSED_ROW, RESULTS_ROW);
}

static void torque_rows(size_t count, INPUTS, enum torques kind, real *tau)
{
    const size_t rows_of[] = {G, SQUARE, N}, row = rows_of[kind];
    for (size_t s = 0; s < count; ++s)
        if (kind == PACKED)
            API(torque_one)(PASSED_ROW, tau + s * row);
        else
            API(dense_torque_one)(PASSED_ROW, kind == SUMS, tau + s * row);
}

static void dense_rows(size_t count, INPUTS, const struct dense *to)
{
    for (size_t s = 0; s < count; ++s) {
        struct dense here = *to;
        here.acceleration += s * CUBE;
        here.velocity += s * CUBE;
        here.gravity += s * SQUARE;
        API(dense_one)(PASSED_ROW, &here);
    }
}
