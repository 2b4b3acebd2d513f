/* Results of blocks to rows with their zeros. The same in every package of linkwise. It needs dense.h and stream.h. */

/* Torques alone: packed, with their zeros, or their sums over the links. */
enum torques { PACKED, DENSE, SUMS };

/* Links whose cubes wait in a block at a time, as many as a usual second-level cache holds beside their rows, and whether
   that is all of them. Of a link by itself only the rows of its path wait, as the others are zero. */
enum {
    MOST = 1024 / (N * N) > 1 ? 1024 / (N * N) : 1,
    WHOLE = MOST >= LINKS,
    AT_ONCE = WHOLE ? LINKS : MOST,
    BY_ITSELF = MOST == 1 && !WHOLE,
    CUBES = BY_ITSELF ? LONGEST * N : AT_ONCE * N * N,
    STREAMED = WHOLE ? CUBE : 1
};

/* Where cubes wait: for their places in rows, and there for their way past the cache. */
struct waiting_cubes {
    ALIGNED real block[CUBES * BLOCK], rows[STREAMED * BLOCK], ones[N * BLOCK];
    int large;
};

/* Zeros stay where no link has values, as long as all links come at once. Coefficients are theirs times one. */
static inline void begin_cubes(struct waiting_cubes *wait, size_t count, size_t bytes)
{
    memset(wait->block, 0, sizeof wait->block);
    for (int e = 0; e < N * BLOCK; ++e)
        wait->ones[e] = 1;
    wait->large = WHOLE && count > LARGE / bytes;
}

/* c of link j, as `place` takes it, into cubes, which are in rows. Returns where the next link's begin. */
static inline const real *to_cubes_by_itself(int j, int half, const real *c, const real *by, size_t samples,
    struct waiting_cubes *wait, real *cubes)
{
    int x = path_start[j];
    const real *waiting = wait->block;
    memset(wait->block, 0, (size_t)(path_start[j + 1] - x) * N * BLOCK * sizeof(real));
    c = place_block(j, j + 1, half, c, by, 1, 1, wait->block);
    for (int i = 0; i < N; ++i) {
        real *const rows = cubes + (size_t)(i * LINKS + j) * N;
        if (x < path_start[j + 1] && path[x] == i) {
            scatter(samples, N, CUBE, waiting, rows);
            waiting += N * BLOCK;
            ++x;
        } else
            for (size_t b = 0; b < samples; ++b)
                memset(rows + b * CUBE, 0, N * sizeof(real));
    }
    return c;
}

/* c of links, as `place` takes it, into cubes, which are in rows. */
static inline void to_cubes(int first, int last, int half, const real *c, const real *by, size_t samples,
    struct waiting_cubes *wait, real *cubes)
{
    if (last - first == LINKS && WHOLE) {
        place_block(first, last, half, c, by, LINKS, 0, wait->block);
        if (wait->large && samples == BLOCK)
            stream_rows(CUBE, wait->block, cubes, wait->rows);
        else
            scatter(samples, CUBE, CUBE, wait->block, cubes);
        return;
    }
    if (BY_ITSELF) {
        for (int j = first; j < last; ++j)
            c = to_cubes_by_itself(j, half, c, by, samples, wait, cubes);
        return;
    }
    for (int j = first; j < last; j += AT_ONCE) {
        const int end = j + AT_ONCE < last ? j + AT_ONCE : last, entries = (end - j) * N;
        memset(wait->block, 0, (size_t)entries * N * BLOCK * sizeof(real));
        c = place_block(j, end, half, c, by, end - j, 0, wait->block);
        for (int i = 0; i < N; ++i)
            scatter(samples, (size_t)entries, CUBE, wait->block + (size_t)i * entries * BLOCK,
                cubes + (size_t)(i * LINKS + j) * N);
    }
}
