/* Functions of joints that loops, couplings and contacts tie. The same in every package of linkwise.

   The file that includes this one has what frames.h, moving_links.h, passive.h and equations.h are made of. */
#include "ties.h"

#include "tied_joints.h"

#include "tied_shares.h"

#include "tied_motion.h"

#include "tied_response.h"

#include "tied_impedance.h"

#include "tied_course.h"

#include "simulation.h"
