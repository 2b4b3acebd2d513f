/* Results of blocks to rows with their zeros. The same in every package of linkwise. It needs dense.h and stream.h. */

/* Links whose cubes wait in a block at a time, as many as a usual second-level cache holds beside their rows, and whether
   that is all of them. Of a link by itself only the rows of its path wait, and one of zeros for all others. */
enum {
    MOST = 1024 / (N * N) > 1 ? 1024 / (N * N) : 1,
    WHOLE = MOST >= LINKS,
    AT_ONCE = WHOLE ? LINKS : MOST,
    BY_ITSELF = MOST == 1 && !WHOLE,
    CUBES = BY_ITSELF ? (LONGEST + 1) * N : AT_ONCE * N * N,
    STREAMED = WHOLE ? CUBE : 1
};

/* Where cubes wait: for their places in rows, and there for their way past the cache. */
struct waiting_cubes {
    ALIGNED real block[CUBES * BLOCK], rows[STREAMED * BLOCK], ones[N * BLOCK];
    int large;
};

/* Zeros stay where no link has values, as long as all links come at once. Coefficients are theirs times one. */
static inline void begin_cubes(struct waiting_cubes *wait, size_t count, size_t values)
{
    clear(CUBES * BLOCK, wait->block);
    for (int e = 0; e < N * BLOCK; ++e)
        wait->ones[e] = 1;
    wait->large = WHOLE && past_cache(count, values);
}

/* c of link j, as `place` takes it, into cubes, which are in rows. Returns where the next link's begin. */
static inline const real *to_cubes_by_itself(int j, int half, const real *c, const real *by, size_t samples,
    struct waiting_cubes *wait, real *cubes)
{
    const short *const joint = path + path_start[j];
    const int length = path_start[j + 1] - path_start[j];
    const real *const zeros = wait->block + (size_t)length * N * BLOCK;
    clear((size_t)(length + 1) * N * BLOCK, wait->block);
    c = place_block(j, j + 1, half, c, by, 1, 1, wait->block);
    for (int i = 0, x = 0; i < N; ++i) {
        const int moves = x < length && joint[x] == i;
        scatter(samples, N, CUBE, moves ? wait->block + (size_t)x * N * BLOCK : zeros, cubes + (size_t)(i * LINKS + j) * N);
        x += moves;
    }
    return c;
}

/* c of links, as `place` takes it, into cubes, which are in rows. */
static inline void to_cubes(int first, int last, int half, const real *c, const real *by, size_t samples,
    struct waiting_cubes *wait, real *cubes)
{
    if (last - first == LINKS && WHOLE) {
        place_block(first, last, half, c, by, LINKS, 0, wait->block);
        put_rows(samples, CUBE, wait->large, wait->block, cubes, wait->rows);
        return;
    }
    if (BY_ITSELF) {
        for (int j = first; j < last; ++j)
            c = to_cubes_by_itself(j, half, c, by, samples, wait, cubes);
        return;
    }
    for (int j = first; j < last; j += AT_ONCE) {
        const int end = j + AT_ONCE < last ? j + AT_ONCE : last, entries = (end - j) * N;
        clear((size_t)entries * N * BLOCK, wait->block);
        c = place_block(j, end, half, c, by, end - j, 0, wait->block);
        for (int i = 0; i < N; ++i)
            scatter(samples, (size_t)entries, CUBE, wait->block + (size_t)(i * entries) * BLOCK,
                cubes + (size_t)(i * LINKS + j) * N);
    }
}
