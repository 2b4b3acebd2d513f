/* The position gradient of the rigid-link rule. The same in every package of linkwise.

   With the twist V of what carries joint k, its rate A less gravity, the change Sd = V x S, and the wrench F of tau,
       c0(i, j, k) = S_i . (I Sdd + 2 B Sd)                     for i behind k
                   = S_i . (I Sdd + 2 B Sd + S x* F)            for k itself and i before it
       Sdd = A x S + V x Sd        S x* F = (z x N + s x f, z x f)
   Where joints follow curves, Sdd has more, and for a joint itself there is what F does along the change of S by its own
   coordinate. */

/* Sdd of every joint, by its frame. */
static inline void SIZED(second_changes)(const motion *m, const real *gravity, screw *second)
{
    const vector g = {same(gravity[0]), same(gravity[1]), same(gravity[2])};
    for (int f = 1; f <= FRAMES; ++f) {
        const int up = joints[f - 1].parent;
        const screw twist = m->twist[up], rate = m->rate[up], axis = m->axis[f - 1], change = m->change[f - 1];
        const vector s = add_cross(cross(rate.z, axis.s), subtract(rate.s, g), axis.z);
        second[f].z = add_cross(cross(rate.z, axis.z), twist.z, change.z);
        second[f].s = add_cross(add_cross(s, twist.z, change.s), twist.s, change.z);
#ifdef CURVED
        second[f].z = add(second[f].z, m->second[f - 1].z);
        second[f].s = add(second[f].s, m->second[f - 1].s);
#endif
    }
}

/* c0 of a link, to which each pair of joints on its path adds: `frames` from the base on, each of which follows the
   coordinate at `places` of the path. */
static inline void SIZED(gradient)(const motion *m, const screw *second, const moving_link *l, int count, const short *frames,
    const short *places, int length, real *c0)
{
    const vector force = l->wrench.s;
    for (int b = 0; b < count; ++b) {
        const int f = frames[b];
        const screw axis = m->axis[f - 1], change = m->change[f - 1], sdd = second[f];
        const screw moves = SIZED(moves)(l, &axis, SIZED(arm)(l, &axis));
        const vector twice = scale(same(R(2.0)), change.z);
        const vector slips = subtract_cross(subtract_cross(sdd.s, l->com, sdd.z), l->velocity, twice);
        const screw behind = {add_applied(apply(l->inertia, sdd.z), l->turning, twice), slips};
        const screw before = {add_cross(add_cross(behind.z, axis.z, l->wrench.z), moves.s, force),
            add_cross(behind.s, axis.z, force)};
        for (int a = 0; a < count; ++a) {
            const screw *other = &m->axis[frames[a] - 1], of = SIZED(moves)(l, other, SIZED(arm)(l, other));
            real *entry = c0 + (places[a] * length + places[b]) * W;
            PUT(entry, TAKE(entry) + along(&of, a <= b ? &before : &behind));
        }
#ifdef CURVED
        const screw own = SIZED(moves)(l, &m->bend[f - 1], SIZED(arm)(l, &m->bend[f - 1]));
        real *entry = c0 + (places[b] * length + places[b]) * W;
        PUT(entry, TAKE(entry) + along(&own, &l->wrench));
#endif
    }
}
