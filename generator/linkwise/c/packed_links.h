/* Links of any energies, and what they answer with to accelerations: sums over the links. The same in every package of
   linkwise. The file that includes this one has `struct sample`, whose c2, c1 and g are packed, and `observe`. */
#include "arrays.h"

#define SAMPLE(s) \
    struct sample s; \
    observe(PASSED_AT_REST, &s)

/* M a + C v, and what potentials ask for where they are to be in it. */
static inline void answer(const struct sample *s, const real *acceleration, const real *velocity, int weighs, real *torque)
{
    const real *c2 = s->c2, *c1 = s->c1, *g = s->g;
    clear(N, torque);
    for (int j = 0; j < LINKS; ++j)
        for (int a = path_start[j]; a < path_start[j + 1]; ++a) {
            const int i = path[a];
            torque[i] += weighs ? *g : 0;
            ++g;
            for (int b = path_start[j]; b < path_start[j + 1]; ++b)
                torque[i] += *c1++ * velocity[path[b]];
            torque[i] += *c2++ * acceleration[i];
            for (int b = a + 1; b < path_start[j + 1]; ++b, ++c2) {
                torque[i] += *c2 * acceleration[path[b]];
                torque[path[b]] += *c2 * acceleration[i];
            }
        }
}

/* Sums of c2, and of w c2 with weights w (N, LINKS, N) unless these are NULL. */
static inline void sum_inertia(const struct sample *s, const real *w, real *mass)
{
    const real *c2 = s->c2;
    clear((size_t)N * N, mass);
    for (int j = 0; j < LINKS; ++j)
        for (int a = path_start[j]; a < path_start[j + 1]; ++a)
            for (int b = a; b < path_start[j + 1]; ++b, ++c2) {
                const int i = path[a], k = path[b];
                mass[i * N + k] += w ? w[(i * LINKS + j) * N + k] * *c2 : *c2;
                if (k != i)
                    mass[k * N + i] += w ? w[(k * LINKS + j) * N + i] * *c2 : *c2;
            }
}

static inline void natural_inertia(const struct sample *s, real *mass)
{
    sum_inertia(s, NULL, mass);
}

/* Weights w (N, LINKS, N) times the links' own, summed over the links, NULL standing for none: w c2 in kept (N, N), beside
   M itself, and w c1 v taken from `torque`. */
static inline void keep(const struct sample *s, const real *inertia, const real *damping, const real *velocity, real *mass,
    real *kept, real *torque)
{
    if (inertia) {
        sum_inertia(s, NULL, mass);
        sum_inertia(s, inertia, kept);
    }
    const real *c1 = s->c1;
    for (int j = 0; damping && j < LINKS; ++j)
        for (int a = path_start[j]; a < path_start[j + 1]; ++a)
            for (int b = path_start[j]; b < path_start[j + 1]; ++b)
                torque[path[a]] -= damping[(path[a] * LINKS + j) * N + path[b]] * *c1++ * velocity[path[b]];
}
