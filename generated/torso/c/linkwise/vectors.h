/* Vectors, matrices and screws over `number`, for SIZED's number of samples. The same in every package of linkwise. */

#define vector SIZED(vector)
#define matrix SIZED(matrix)
#define screw SIZED(screw)
#define add SIZED(add)
#define subtract SIZED(subtract)
#define scale SIZED(scale)
#define cross SIZED(cross)
#define add_cross SIZED(add_cross)
#define subtract_cross SIZED(subtract_cross)
#define apply SIZED(apply)
#define add_applied SIZED(add_applied)
#define turned SIZED(turned)
#define same SIZED(same)
#define along SIZED(along)

typedef struct {
    number x, y, z;
} vector;

/* Row by row. */
typedef struct {
    vector x, y, z;
} matrix;

/* A motion: angular and linear velocity, say; or a wrench: moment z and force s. */
typedef struct {
    vector z, s;
} screw;

INLINE vector add(vector a, vector b)
{
    const vector sum = {a.x + b.x, a.y + b.y, a.z + b.z};
    return sum;
}

INLINE vector subtract(vector a, vector b)
{
    const vector difference = {a.x - b.x, a.y - b.y, a.z - b.z};
    return difference;
}

INLINE vector scale(number a, vector b)
{
    const vector product = {a * b.x, a * b.y, a * b.z};
    return product;
}

INLINE vector cross(vector a, vector b)
{
    const vector product = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return product;
}

/* a + b x c, and a - b x c: each product is added at once, and fused with the addition where the processor can. */
INLINE vector add_cross(vector a, vector b, vector c)
{
    const vector sum = {a.x + b.y * c.z - b.z * c.y, a.y + b.z * c.x - b.x * c.z, a.z + b.x * c.y - b.y * c.x};
    return sum;
}

INLINE vector subtract_cross(vector a, vector b, vector c)
{
    const vector difference = {a.x - b.y * c.z + b.z * c.y, a.y - b.z * c.x + b.x * c.z, a.z - b.x * c.y + b.y * c.x};
    return difference;
}

INLINE vector apply(matrix m, vector a)
{
    const vector product = {m.x.x * a.x + m.x.y * a.y + m.x.z * a.z, m.y.x * a.x + m.y.y * a.y + m.y.z * a.z,
        m.z.x * a.x + m.z.y * a.y + m.z.z * a.z};
    return product;
}

/* a + m b */
INLINE vector add_applied(vector a, matrix m, vector b)
{
    const vector sum = {a.x + m.x.x * b.x + m.x.y * b.y + m.x.z * b.z, a.y + m.y.x * b.x + m.y.y * b.y + m.y.z * b.z,
        a.z + m.z.x * b.x + m.z.y * b.y + m.z.z * b.z};
    return sum;
}

/* A vector of the robot's, of one frame, in common axes. */
INLINE vector turned(matrix m, const real *a)
{
    const vector product = {m.x.x * a[0] + m.x.y * a[1] + m.x.z * a[2], m.y.x * a[0] + m.y.y * a[1] + m.y.z * a[2],
        m.z.x * a[0] + m.z.y * a[1] + m.z.z * a[2]};
    return product;
}

/* One number in every sample. */
INLINE number same(real a)
{
    const number none = {0};
    return none + a;
}

/* What a wrench does along a motion: z . N + s . f. */
INLINE number along(const screw *a, const screw *f)
{
    return a->z.x * f->z.x + a->z.y * f->z.y + a->z.z * f->z.z + a->s.x * f->s.x + a->s.y * f->s.y + a->s.z * f->s.z;
}
