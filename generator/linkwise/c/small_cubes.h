/* Results of one sample to their row with its zeros: what stands in place of dense_rows.h under LINKWISE_SMALL. The same in
   every package of linkwise. It needs dense.h for one sample. */

/* Coefficients are theirs times one. */
struct waiting_cubes {
    real ones[N];
};

static inline void begin_cubes(struct waiting_cubes *wait, size_t count, size_t values)
{
    (void)count, (void)values;
    for (int k = 0; k < N; ++k)
        wait->ones[k] = 1;
}

/* c of links, as `place` takes it, into a cube. */
static inline void to_cubes(int first, int last, int half, const real *c, const real *by, size_t samples,
    const struct waiting_cubes *wait, real *cube)
{
    (void)samples, (void)wait;
    for (int i = 0; i < N; ++i)
        clear((size_t)(last - first) * N, cube + (i * LINKS + first) * N);
    place_one(first, last, half, c, by, LINKS, 0, cube + first * N);
}
