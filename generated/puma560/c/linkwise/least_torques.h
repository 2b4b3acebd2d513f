/* Torques of the joints that something drives, for what a motion needs of all joints. The same in every package of linkwise.

   With the rows E of G that are driven joints, torques u of these give what is needed, t, if E' u = G' t, up to forces of ties. Where
   many do, the least sum of squares u' W u is taken: with the columns of (W^-1/2 E)' in the order P, by what is left of them,
       (W^-1/2 E)' P = Q (R1 R2)      (R1 R2)' = Q2 R      u = W^-1/2 P Q2 R'^-1 Q' G' t
   The last columns Z of Q are motions in which no driven joint takes part. With the inertia K = G' H G they are left to
   themselves, as all driven joints move as asked, by Gauss's principle (M. Spong, 1994):
       left = -Z (Z' K Z)^-1 Z' G' t      G' t + K left in the place of G' t */

/* Driven joints of a sample: `order` lists them as columns of `factor` (free, rows of PITCH), which has R, and `size` is
   W^-1/2. */
struct driven {
    int rank, count;
    short joint[N], order[N];
    ALIGNED real size[N], factor[N * PITCH], reflector[N * N], twice[N];
};

/* Which joints are driven, and their part in the independent joints' motion; 0, or why there is no answer. */
static int read_driven(const struct tied *x, const API(actuators) *by, struct driven *d)
{
    real most = 0, least_size = 0;
    d->count = by->driven;
    d->rank = x->free - by->undriven;
    if (by->driven < 1 || by->driven > N || by->undriven < 0 || d->rank < 0 || d->rank > by->driven)
        return IS_UNKNOWN;
    clear((size_t)(N * PITCH), d->factor);
    for (int r = 0; r < by->driven; ++r) {
        const int joint = by->joint[r];
        if (joint < 0 || joint >= N || (r && joint <= by->joint[r - 1]))
            return IS_UNKNOWN;
        d->joint[r] = (short)joint;
        d->order[r] = (short)r;
        d->size[r] = by->weight ? 1 / F(sqrt)(by->weight[r]) : R(1.0);
        least_size = r && least_size < d->size[r] ? least_size : d->size[r];
        for (int c = 0; c < x->free; ++c)
            d->factor[c * PITCH + r] = x->map[joint * PITCH + c] * d->size[r];
    }
    for (int i = 0; i < N; ++i)
        for (int c = 0; c < x->free; ++c)
            most = F(fabs)(x->map[i * PITCH + c]) > most ? F(fabs)(x->map[i * PITCH + c]) : most;
    for (int f = 0; f < d->rank; ++f) {
        real largest = -1;
        int best = f;
        for (int r = f; r < d->count; ++r) {
            real square = 0;
            for (int c = f; c < x->free; ++c)
                square += d->factor[c * PITCH + r] * d->factor[c * PITCH + r];
            if (square > largest) {
                largest = square;
                best = r;
            }
        }
        const short first = d->order[f];
        d->order[f] = d->order[best];
        d->order[best] = first;
        for (int c = 0; c < x->free; ++c) {
            const real entry = d->factor[c * PITCH + f];
            d->factor[c * PITCH + f] = d->factor[c * PITCH + best];
            d->factor[c * PITCH + best] = entry;
        }
        const real kept = turn_column(f, x->free, d->factor, d->reflector + f * N, &d->twice[f]);
        if (!(F(fabs)(kept) > HALF * most * least_size))
            return IS_UNDRIVEN;
        reflect(f, x->free, d->count - f - 1, d->reflector + f * N, d->twice[f], d->factor + f + 1);
        for (int c = f + 1; c < x->free; ++c)
            d->factor[c * PITCH + f] = 0;
    }
    for (int r = d->rank; r < d->count; ++r) /* of which nothing is left, if as few motions are driven */
        for (int c = d->rank; c < x->free; ++c)
            if (F(fabs)(d->factor[c * PITCH + r]) > HALF * most * least_size)
                return IS_UNKNOWN;
    return 0;
}

/* The acceleration of all joints that nothing drives, and `force`, G' t, with what it asks for; 0, or why there is no answer. */
static int leave_undriven(const struct tied *x, const struct driven *d, const real *inertia, real *force, real *left)
{
    const int m = x->free, freely = m - d->rank;
    ALIGNED real still[N * N], moved[N], square[N * N], size[N] = {0}, pull[N] = {0}, step[N] = {0};
    for (int k = 0; k < freely; ++k) {
        real *const z = still + k * N;
        clear(N, z);
        z[d->rank + k] = 1;
        for (int f = d->rank; f-- > 0;)
            reflect_one_side(f, m, d->reflector + f * N, d->twice[f], z);
    }
    for (int k = 0; k < freely; ++k) {
        const real *const z = still + k * N;
        for (int a = 0; a < m; ++a) {
            moved[a] = 0;
            for (int b = 0; b < m; ++b)
                moved[a] += inertia[a * m + b] * z[b];
            pull[k] += z[a] * force[a];
        }
        for (int l = 0; l < freely; ++l) {
            square[l * freely + k] = 0;
            for (int a = 0; a < m; ++a)
                square[l * freely + k] += still[l * N + a] * moved[a];
        }
        size[k] = square[k * freely + k];
    }
    struct pivot weakest = {0, 1};
    if (eliminate(0, freely, 1, size, square, pull, &weakest) || vague(&weakest))
        return HAS_NO_INERTIA;
    for (int k = 0; k < freely; ++k)
        for (int a = 0; a < m; ++a)
            step[a] -= still[k * N + a] * pull[k];
    for (int a = 0; a < m; ++a)
        for (int b = 0; b < m; ++b)
            force[a] += inertia[a * m + b] * step[b];
    for (int i = 0; i < N; ++i) {
        left[i] = 0;
        for (int a = 0; a < m; ++a)
            left[i] += x->map[i * PITCH + a] * step[a];
    }
    return 0;
}

/* The least torques u of the driven joints, on all joints, that give `force`, G' t, which is overwritten. */
static void least_torques(const struct tied *x, const struct driven *d, real *force, real *torque)
{
    const int r = d->rank, count = d->count;
    ALIGNED real wide[N * PITCH] = {0}, reflector[N * N], twice[N], some[N] = {0};
    for (int f = 0; f < r; ++f)
        reflect_one_side(f, x->free, d->reflector + f * N, d->twice[f], force);
    for (int k = 0; k < count; ++k)
        for (int f = 0; f < r; ++f)
            wide[k * PITCH + f] = d->factor[f * PITCH + k];
    for (int f = 0; f < r; ++f) {
        turn_column(f, count, wide, reflector + f * N, &twice[f]);
        reflect(f, count, r - f - 1, reflector + f * N, twice[f], wide + f + 1);
    }
    for (int f = 0; f < r; ++f) {
        some[f] = force[f];
        for (int g = 0; g < f; ++g)
            some[f] -= wide[g * PITCH + f] * some[g];
        some[f] /= wide[f * PITCH + f];
    }
    for (int f = r; f-- > 0;)
        reflect_one_side(f, count, reflector + f * N, twice[f], some);
    clear(N, torque);
    for (int k = 0; k < count; ++k)
        torque[d->joint[d->order[k]]] = some[k] * d->size[d->order[k]];
}
