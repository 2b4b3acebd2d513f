/* Rows of results from the wrenches of rule.h: what each joint bears of them. The same in every package of linkwise.

   Entry e is stored at e * W by PUT. */

/* What a wrench does along two motions, each of its components read once. */
INLINE void SIZED(along_both)(const screw *a, const screw *b, const screw *f, real *first, real *second)
{
    number x = a->z.x * f->z.x, y = b->z.x * f->z.x;
    x += a->z.y * f->z.y;
    y += b->z.y * f->z.y;
    x += a->z.z * f->z.z;
    y += b->z.z * f->z.z;
    x += a->s.x * f->s.x;
    y += b->s.x * f->s.x;
    x += a->s.y * f->s.y;
    y += b->s.y * f->s.y;
    x += a->s.z * f->s.z;
    y += b->s.z * f->s.z;
    PUT(first, x);
    PUT(second, y);
}

/* Rows i and, if there is one, i + 1 of a link's c2 and c1. */
INLINE void SIZED(two_rows)(const wrenches *RESTRICT x, int i, int length, real *RESTRICT c2, real *RESTRICT c1)
{
    const screw a = x->moves[i];
    PUT(c2, along(&a, &x->c2[i]));
    if (i + 1 == length) {
        for (int k = 0; k < length; ++k)
            PUT(c1 + k * W, along(&a, &x->c1[k]));
        return;
    }
    const screw b = x->moves[i + 1];
    real *second2 = c2 + (length - i - 1) * W, *second1 = c1 + length * W;
    for (int k = i + 1; k < length; ++k)
        SIZED(along_both)(&a, &b, &x->c2[k], c2 + (k - i) * W, second2 + (k - i) * W);
    for (int k = 0; k < length; ++k)
        SIZED(along_both)(&a, &b, &x->c1[k], c1 + k * W, second1 + k * W);
}

/* A link's g and tau. */
INLINE void SIZED(torques)(const moving_link *l, const wrenches *x, int length, real *g, real *tau)
{
    for (int i = 0; i < length; ++i) {
        const vector s = x->moves[i].s;
        PUT(g + i * W, s.x * l->weight.x + s.y * l->weight.y + s.z * l->weight.z);
        PUT(tau + i * W, along(&x->moves[i], &l->wrench));
    }
}
