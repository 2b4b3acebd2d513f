/* Times the C of a robot of rigid links without run-time parameters: nanoseconds a sample of the full decomposition, in rows
   and in blocks, and of the reactions, in rows.
   Compiled with -DROBOT=name -DUPPER=NAME -DREAL=double -DSUFFIX= (or float, f) and the header by -include.
   Each figure is the least of many short spells, so that other work on the machine falls between them.
   Arguments: seconds for a figure, then batch sizes. Prints "call layout batch threads nanoseconds" lines. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#define JOIN3(a, b, c) a##b##c
#define GLUE(a, b, c) JOIN3(a, b, c)
#define CALL(function) GLUE(ROBOT, function, SUFFIX)
#define SIZE(what) GLUE(UPPER, what, )
enum { N = SIZE(_JOINTS), LINKS = SIZE(_LINKS), C2 = SIZE(_C2), C1 = SIZE(_C1), G = SIZE(_G) };
enum kind { ROWS, BLOCKS, REACTIONS, KINDS };
enum { W = GLUE(UPPER, _BLOCK, WIDTH), THREADS = 2 };
typedef REAL real;

struct work {
    enum kind kind;
    size_t count;
    long rounds, repeats;
    double start, end;
    real *q, *qd, *qdd, *c2, *c1, *g, *tau;
    pthread_barrier_t *gate;
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* Memory on large pages where the system has them, as NumPy asks for it. */
static real *room(size_t values)
{
    const size_t page = (size_t)1 << 21, bytes = (values * sizeof(real) + page) / page * page;
    real *at = aligned_alloc(page, bytes);
    if (!at)
        exit(2);
#ifdef MADV_HUGEPAGE
    madvise(at, bytes, MADV_HUGEPAGE);
#endif
    memset(at, 0, bytes);
    return at;
}

static void call(const struct work *w)
{
    if (w->kind == REACTIONS)
        CALL(_reactions)(w->count, w->q, w->qd, w->c2, w->c1, w->g);
    else if (w->kind == BLOCKS)
        CALL(_decomposition_blocks)(w->count / W, w->q, w->qd, w->qdd, w->c2, w->c1, w->g, w->tau);
    else
        CALL(_decomposition)(w->count, w->q, w->qd, w->qdd, w->c2, w->c1, w->g, w->tau);
}

static void *loop(void *data)
{
    struct work *w = data;
    for (long repeat = 0; repeat < w->repeats; ++repeat) {
        pthread_barrier_wait(w->gate);
        w->start = now();
        for (long round = 0; round < w->rounds; ++round)
            call(w);
        w->end = now();
        pthread_barrier_wait(w->gate);
    }
    return NULL;
}

/* Best time of one call on all samples, each thread on its own part. */
static double best(struct work whole, int threads)
{
    struct work part[THREADS];
    pthread_t id[THREADS];
    pthread_barrier_t gate;
    double least = 1e300;
    pthread_barrier_init(&gate, NULL, (unsigned)threads + 1);
    for (int t = 0; t < threads; ++t) {
        const size_t share = whole.count / (size_t)threads, from = share * (size_t)t;
        struct work *w = &part[t];
        *w = whole;
        w->count = share;
        w->gate = &gate;
        w->q += from * N, w->qd += from * N, w->qdd += from * N;
        const int reacts = w->kind == REACTIONS;
        w->c2 += from * (reacts ? 6 * G : C2), w->c1 += from * (reacts ? 6 * G : C1);
        w->g += from * (reacts ? 6 * LINKS : G), w->tau += from * G;
        pthread_create(&id[t], NULL, loop, w);
    }
    for (long repeat = 0; repeat < whole.repeats; ++repeat) {
        pthread_barrier_wait(&gate);
        pthread_barrier_wait(&gate);
        double start = part[0].start, end = part[0].end;
        for (int t = 1; t < threads; ++t) {
            start = part[t].start < start ? part[t].start : start;
            end = part[t].end > end ? part[t].end : end;
        }
        const double took = (end - start) / (double)whole.rounds;
        least = took < least ? took : least;
    }
    for (int t = 0; t < threads; ++t)
        pthread_join(id[t], NULL);
    pthread_barrier_destroy(&gate);
    return least;
}

int main(int count, char **arguments)
{
    const double budget = 1e9 * strtod(arguments[1], NULL), spell = 4e5;
    size_t largest = 1;
    for (int a = 2; a < count; ++a) {
        const size_t batch = strtoul(arguments[a], NULL, 10);
        largest = batch > largest ? batch : largest;
    }
    struct work w = {.q = room(largest * N), .qd = room(largest * N), .qdd = room(largest * N)};
    w.c2 = room(largest * (C2 > 6 * G ? C2 : 6 * G)), w.c1 = room(largest * (C1 > 6 * G ? C1 : 6 * G));
    w.g = room(largest * (G > 6 * LINKS ? G : 6 * LINKS)), w.tau = room(largest * G);
    unsigned state = 1;
    for (size_t e = 0; e < largest * N; ++e) {
        state = state * 1664525u + 1013904223u;
        w.q[e] = (real)(6.0 * (state / 4294967296.0 - 0.5));
        w.qd[e] = (real)(3.0 * ((state ^ 0x9e3779b9u) / 4294967296.0 - 0.5));
        w.qdd[e] = (real)(3.0 * ((state ^ 0x85ebca6bu) / 4294967296.0 - 0.5));
    }
    for (int a = 2; a < count; ++a)
        for (int kind = 0; kind < KINDS; ++kind)
            for (int threads = 1; threads <= THREADS; ++threads) {
                w.kind = (enum kind)kind;
                w.count = strtoul(arguments[a], NULL, 10);
                if (w.count < (size_t)threads * (kind == BLOCKS ? W : 1))
                    continue;
                call(&w);
                const double start = now();
                call(&w);
                const double took = now() - start;
                w.rounds = (long)(spell / took) + 1;
                w.repeats = (long)(budget / ((double)w.rounds * took)) + 15;
                printf("%s %s %zu %d %.5g\n", kind == REACTIONS ? "reactions" : "packed",
                    kind == BLOCKS ? "blocks" : "rows", w.count, threads, best(w, threads) / (double)w.count);
            }
    return 0;
}
