/* A control loop of 1 kHz, from the C that linkwise emits and nothing else. In the repository's folder:

       cc -std=c99 -O2 -ftree-vectorize -ffp-contract=fast -march=native -I generated/puma560/c \
           docs/control_loop.c generated/puma560/c/puma560.c -lm -o control_loop
       ./control_loop              the loop, and how long a million steps take
       ./control_loop --sealed     the same steps where Linux ends a program at its first system call

   Each joint is held by a spring and a damper that the controller makes, as stiff as gives it 10 rad/s by itself. Besides,
   of the inertia of links 4 to 6 only half is felt: a partial impedance. Gravity is borne, and joint 1 is pushed for a
   second. */
#define _GNU_SOURCE
#include "puma560.h"

#include <linux/seccomp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { N = PUMA560_JOINTS, LINKS = PUMA560_LINKS, STEPS = 1000000 };
static const double PERIOD = 1e-3, PUSH = 10.0; /* s, N m */

/* A robot, and what is wanted of it: arrays that the impedance points to. */
static double q[N], qd[N], q_d[N], tau[N], push[N];
static double kept[N][LINKS][N], stiffness[N][N], damping[N][N];
static const puma560_impedance wanted = {&kept[0][0][0], NULL, &kept[0][0][0], &damping[0][0], &stiffness[0][0], 0};

static void start(void)
{
    double mass[N][N];
    for (int i = 0; i < N; ++i)
        q[i] = q_d[i] = 0.2 * i - 0.3, qd[i] = 0.0;
    puma560_mass_matrix(q, &mass[0][0]);
    for (int i = 0; i < N; ++i) {
        stiffness[i][i] = 100.0 * mass[i][i];
        damping[i][i] = 20.0 * mass[i][i];
        for (int j = 0; j < LINKS; ++j)
            for (int k = 0; k < N; ++k)
                kept[i][j][k] = j < 3 ? 1.0 : 0.5;
    }
}

/* What the controller does in a period: torques from what is measured. */
static int control(void)
{
    return puma560_partial_impedance(q, qd, &wanted, q_d, NULL, NULL, NULL, push, tau, NULL);
}

/* What the robot does meanwhile: it is simulated here, by a step of Euler's. */
static int move(void)
{
    double load[N], qdd[N];
    for (int i = 0; i < N; ++i)
        load[i] = tau[i] + push[i];
    if (puma560_forward_dynamics(q, qd, load, qdd))
        return 1;
    for (int i = 0; i < N; ++i) {
        qd[i] += PERIOD * qdd[i];
        q[i] += PERIOD * qd[i];
    }
    return 0;
}

/* Some seconds; `said` prints four lines for each. Returns 0 if no step was refused. */
static int loop(int steps, int said)
{
    for (int step = 0; step < steps; ++step) {
        push[0] = step % 4000 >= 1000 && step % 4000 < 2000 ? PUSH : 0.0;
        const int refused = control();
        if (said && step % 250 == 0)
            printf("%6.2f s %9.1f N m %12.4f rad %14.2f N m %10.2f N m\n", step * PERIOD, push[0], q[0] - q_d[0], tau[0],
                tau[1]);
        if (refused || move())
            return 1;
    }
    return 0;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void report(const char *what, float *took)
{
    qsort(took, STEPS, sizeof took[0], ascending);
    printf("%s: a control step takes %.2f us, 999 of 1000 at most %.2f us, the worst of %d %.1f us\n", what,
        (double)took[STEPS / 2], (double)took[STEPS / 1000 * 999], STEPS, (double)took[STEPS - 1]);
}

/* A million steps, the controller's share of each on the clock: once as they come, then each at its best of several times,
   so that what else the machine does falls out. */
static int measure(void)
{
    static float took[STEPS], least[STEPS];
    for (int time = 0; time < 4; ++time) {
        start();
        for (int step = 0; step < STEPS; ++step) {
            const double from = now();
            const int refused = control();
            took[step] = (float)(now() - from);
            if (refused || (step % 100 == 0 && move()))
                return 1;
            least[step] = time == 0 || took[step] < least[step] ? took[step] : least[step];
        }
        if (time == 0)
            report("as they come", took);
    }
    report("undisturbed", least);
    return 0;
}

int main(int count, char **given)
{
    start();
    if (count < 2) {
        printf("%8s %13s %16s %18s %14s\n", "time", "push 1", "away 1", "torque 1", "torque 2");
        if (loop(4000, 1))
            return 1;
        printf("%g N m against %.1f N m/rad: %.4f rad\n", PUSH, stiffness[0][0], PUSH / stiffness[0][0]);
        return measure();
    }
    if (strcmp(given[1], "--sealed") || loop(1, 0) || prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT))
        return 2;
    static const char done[] = "a million steps, and no system call\n";
    const int fault = loop(STEPS, 0) || write(STDOUT_FILENO, done, sizeof done - 1) < 0;
    return (int)syscall(SYS_exit, fault);
}
