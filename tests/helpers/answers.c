/* Answers of a robot's C, as bytes in a file: for tests that run it elsewhere. They define its HEADER, how to CALL it in
   `real` numbers, and how many of each there are. */
#include HEADER
#include <stdio.h>
#include <stdlib.h>

static void *taken(size_t numbers)
{
    void *memory = calloc(numbers, sizeof(real));
    if (memory == NULL)
        exit(3);
    return memory;
}

static int wrote(FILE *file, const real *numbers, size_t count)
{
    return fwrite(numbers, sizeof(real), count, file) == count;
}

int main(void)
{
    enum { ENTRIES = SAMPLES * JOINTS };
    real *motion = taken(3 * ENTRIES), *q = motion, *qd = q + ENTRIES, *qdd = qd + ENTRIES;
    real *c2 = taken((size_t)SAMPLES * C2), *c1 = taken((size_t)SAMPLES * C1), *g = taken((size_t)SAMPLES * G);
    real *tau = taken((size_t)SAMPLES * G), *torque = taken(ENTRIES);
    real *gradient = taken((size_t)ENTRIES * LINKS * JOINTS), *mass = taken(JOINTS * JOINTS);
    FILE *in = fopen("motion.bin", "rb"), *out = fopen("answer.bin", "wb");
    int whole;

    if (in == NULL || out == NULL || fread(motion, sizeof(real), 3 * ENTRIES, in) != 3 * ENTRIES)
        return 2;
    CALL(decomposition)(SAMPLES, q, qd, qdd, c2, c1, g, tau);
    CALL(inverse_dynamics)(SAMPLES, q, qd, qdd, torque);
    CALL(dense_position_gradient)(SAMPLES, q, qd, qdd, gradient);
    CALL(mass_matrix)(q, mass);
    whole = wrote(out, c2, (size_t)SAMPLES * C2) && wrote(out, c1, (size_t)SAMPLES * C1)
        && wrote(out, g, (size_t)SAMPLES * G) && wrote(out, tau, (size_t)SAMPLES * G) && wrote(out, torque, ENTRIES)
        && wrote(out, gradient, (size_t)ENTRIES * LINKS * JOINTS) && wrote(out, mass, JOINTS * JOINTS);
    fclose(in);
    return fclose(out) || !whole;
}
