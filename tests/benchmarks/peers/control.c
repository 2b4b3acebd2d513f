/* Times control steps of a robot of rigid links without run-time parameters, in double: springs and dampers on all joints
   with their inertia natural, with links scaled, and a frame on springs along and about all axes or as many as there are
   joints. Compiled with -DROBOT=name -DUPPER=NAME and the header by -include. Each figure is the least of many short spells.
   Prints "what nanoseconds" lines. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define JOIN(a, b) a##b
#define GLUE(a, b) JOIN(a, b)
#define CALL(function) GLUE(ROBOT, function)
#define SIZE(what) GLUE(UPPER, what)
enum { N = SIZE(_JOINTS), LINKS = SIZE(_LINKS), STATES = 64, SPELLS = 2000, ROWS = N < 6 ? N : 6 };

static double q[STATES][N], qd[STATES][N], q_d[N], pose_d[STATES][16], tau[N];
static double kept[N * LINKS * N], gain[N * N], rows_gain[ROWS * ROWS];
static const int row[6] = {3, 4, 5, 0, 1, 2};
static const CALL(_impedance) natural = {NULL, NULL, NULL, gain, gain, 0}, scaled = {kept, NULL, kept, gain, gain, 0};
static const CALL(_frame_impedance) frame = {SIZE(_FRAMES) - 1, NULL, ROWS, row, 1, 1, NULL, rows_gain, rows_gain};

static int joints(int s)
{
    return CALL(_partial_impedance)(q[s], qd[s], &natural, q_d, NULL, NULL, NULL, NULL, tau, NULL);
}

static int links(int s)
{
    return CALL(_partial_impedance)(q[s], qd[s], &scaled, q_d, NULL, NULL, NULL, NULL, tau, NULL);
}

static int hand(int s)
{
    return CALL(_frame_partial_impedance)(q[s], qd[s], &natural, q_d, NULL, NULL, &frame, pose_d[s], NULL, NULL, NULL, tau, NULL);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void measure(const char *what, int (*step)(int))
{
    double best = 1e300;
    int refused = 0;
    for (int spell = 0; spell < SPELLS; ++spell) {
        const double start = now();
        for (int s = 0; s < STATES; ++s)
            refused += step(s) != 0;
        const double took = (now() - start) / STATES;
        best = took < best ? took : best;
    }
    if (refused)
        exit(3);
    printf("%s %.5g\n", what, best);
}

int main(void)
{
    for (int s = 0; s < STATES; ++s)
        for (int i = 0; i < N; ++i) {
            double away[N];
            q[s][i] = 0.4 * (i % 3) + 0.3 + 0.3 * rand() / RAND_MAX;
            qd[s][i] = 2.0 * rand() / RAND_MAX - 1.0;
            for (int k = 0; k < N; ++k)
                away[k] = q[s][k] + 0.1;
            CALL(_pose)(frame.frame, away, pose_d[s]);
        }
    for (int i = 0; i < N; ++i)
        gain[i * N + i] = 2.0;
    for (int r = 0; r < ROWS; ++r)
        rows_gain[r * ROWS + r] = 5.0;
    for (int e = 0; e < N * LINKS * N; ++e)
        kept[e] = 0.5 + 0.5 * (e / N % LINKS) / LINKS;
    measure("joints", joints);
    measure("links", links);
    measure("frame", hand);
    return 0;
}
