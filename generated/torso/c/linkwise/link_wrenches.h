/* What a link needs by cause, for SIZED's number of samples, whose entries are W apart. The same in every package of
   linkwise. reactions.h says what is in it, and includes this once for each number of samples. */

/* A wrench, entry by entry, from that of a unit of mass about the centre of mass, which is at `arm` from the joint. */
INLINE void SIZED(put_wrench)(number mass, vector arm, vector moment, vector unit, real *entries)
{
    const vector force = scale(mass, unit), about = add_cross(moment, arm, force);
    PUT(entries + 0 * W, about.x);
    PUT(entries + 1 * W, about.y);
    PUT(entries + 2 * W, about.z);
    PUT(entries + 3 * W, force.x);
    PUT(entries + 4 * W, force.y);
    PUT(entries + 5 * W, force.z);
}

/* Those of link j: of each coordinate of its path, and against its weight. */
static inline void SIZED(link_wrenches)(const struct numbers *x, const motion *m, int j, real *c2, real *c1, real *g)
{
    const int length = path_start[j + 1] - path_start[j];
    const moving_link l = SIZED(link_at)(m, links[j].frame, &x->bodies[j], x->gravity);
    const vector arm = subtract(l.com, m->place[links[j].frame]);
    for (int k = 0; k < length; ++k) {
        const screw axis = m->axis[columns[path_start[j] + k]], change = m->change[columns[path_start[j] + k]];
        vector of_c2, of_c1;
        SIZED(moments)(l.inertia.x, l.turning.x, axis.z, change.z, &of_c2.x, &of_c1.x);
        SIZED(moments)(l.inertia.y, l.turning.y, axis.z, change.z, &of_c2.y, &of_c1.y);
        SIZED(moments)(l.inertia.z, l.turning.z, axis.z, change.z, &of_c2.z, &of_c1.z);
        SIZED(put_wrench)(l.mass, arm, of_c2, SIZED(arm)(&l, &axis), c2 + k * WRENCH * W);
        SIZED(put_wrench)(l.mass, arm, of_c1,
            subtract_cross(subtract_cross(change.s, l.velocity, axis.z), l.com, change.z), c1 + k * WRENCH * W);
    }
    SIZED(put_wrench)(l.mass, arm, m->place[0], l.weight, g);
}
