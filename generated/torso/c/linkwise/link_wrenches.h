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
    wrenches w;
    SIZED(columns)(m, &l, columns + path_start[j], length, &w);
    for (int k = 0; k < length; ++k) {
        SIZED(put_wrench)(l.mass, arm, w.c2[k].z, w.c2[k].s, c2 + k * WRENCH * W);
        SIZED(put_wrench)(l.mass, arm, w.c1[k].z, w.c1[k].s, c1 + k * WRENCH * W);
    }
    SIZED(put_wrench)(l.mass, arm, m->place[0], l.weight, g);
}
