/* The angles by which a robot's frames turn. The same in every package of linkwise. It goes by the table `joints` of tree.h. */
#ifndef LINKWISE_ANGLES_H
#define LINKWISE_ANGLES_H

/* Those of `width` samples; 0 for a frame that slides. */
static inline void angles(const struct numbers *x, int width, const real *q, real *angle)
{
    for (int f = 0; f < FRAMES; ++f)
        for (int b = 0; b < width; ++b)
            angle[f * width + b]
                = joints[f].kind == REVOLUTE ? x->placings[f].ratio * q[joints[f].coordinate * width + b] : R(0.0);
}

#endif
