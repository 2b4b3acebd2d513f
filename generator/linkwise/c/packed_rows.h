/* Packed results of blocks to rows of samples. The same in every package of linkwise. It needs rows.h. */

/* Consecutive results that wait in the first-level cache for their places in rows: those of a link's row at least. */
enum { ROOM = LONGEST > 96 ? LONGEST : 96 };

/* Values of one kind in a block, on their way to rows that are `every` values apart: how many of each sample wait. */
struct waiting {
    real *to;
    size_t every, samples;
    int count;
    ALIGNED real room[ROOM * BLOCK];
};

static void begin_waiting(struct waiting *w, size_t samples, size_t every, real *to)
{
    w->to = to;
    w->every = every;
    w->samples = samples;
    w->count = 0;
}

/* What waits leaves. */
static void leave(struct waiting *w)
{
    scatter(w->samples, (size_t)w->count, w->every, w->room, w->to);
    w->to += w->count;
    w->count = 0;
}

/* Where the next `count` values may be put. */
static real *room_for(struct waiting *w, int count)
{
    if (w->count + count > ROOM)
        leave(w);
    w->count += count;
    return w->room + (w->count - count) * BLOCK;
}
