/* A robot in tables: a tree of joints, and the links that it carries. The same in every package of linkwise.

   Frame 0 is the base, and frame f what joint f moves, counted from 1: its z is the joint's axis. It stands in its
   parent's frame at `place`, turned by `turn`, and then turns about z, or slides along it, by `ratio` times a coordinate, or
   times a curve of it, see curves.h. Several joints may follow one coordinate. So a link's motion has a column for each coordinate of its path: column f - 1
   is joint f, and columns from FRAMES on are sums of two others, for joints of one path that follow the same coordinate.

   The file that includes this one says how many there are: N coordinates, LINKS, FRAMES but for the base, COLUMNS, LONGEST,
   the coordinates of the longest path, and NAMED, the frames that have names. */
#ifndef LINKWISE_TREE_H
#define LINKWISE_TREE_H

enum { REVOLUTE, PRISMATIC };

/* A joint: its parent's frame, its coordinate, counted from 0, its kind, and whether its place matters: what no joint
   before it turns may as well stand at the origin. */
struct joint {
    short parent, coordinate, kind, placed;
};

/* A column that is the sum of another and of a joint's. */
struct sum {
    short column, joint;
};

/* A link: its frame, and where its results begin among those of the robot. */
struct link {
    int frame, c2, c1, g;
};

/* Numbers of a joint; turn is row by row. */
struct placing {
    real turn[9], place[3], ratio;
};

/* Numbers of a link, in its frame: mass, centre of mass, and the inertia about it, as xx, yy, zz, xy, xz, yz. */
struct body {
    real mass, com[3], inertia[6];
};

/* The curve that a joint follows: its pieces among those of all joints. One that follows none has none. */
struct curve {
    short first, pieces;
};

/* Numbers of a robot; gravity in the base's axes. */
struct numbers {
    struct placing placings[FRAMES];
    struct body bodies[LINKS];
    real gravity[3];
};

/* What the joints of a coordinate have of their own: see passive.h. `pull` is what springs give at 0. */
struct passive_joint {
    real stiffness, pull, damping, friction, armature;
};

/* A frame that has a name: the frame in which it stands, and its turn there, row by row. */
struct named_frame {
    short frame;
    real turn[9];
};

/* Where the origins of these frames are there. */
struct offsets {
    real place[NAMED][3];
};

/* What two frames hold of each other, or the ground of a frame: its point, with or without its z axis or all axes, its distance,
   or a point of what rolls: see ties.h. NAME.h has names of those that a caller may ask for. */
enum { HELD_POINT, HELD_HINGE, HELD_FRAME, HELD_DISTANCE, HELD_ROLLING };

/* A tie of the robot's own, by the numbers of its frames among those that have names. */
struct tie {
    short kind, first, second;
    real length;
};

/* A polynomial of a coordinate in a coupling's sum: its coefficients among those of all, from `first` on. */
struct term {
    short coordinate, first, factors;
};

#endif
