// What the two kinds of seed share.
#pragma once

#include "mesh/seed.h"

namespace lamina {

/// TetGen's mesh of the box; throws kSeed when it is not part of this build.
Mesh<3> make_tetgen_seed(const Box<3>& box, double size, int max_cells_per_axis);

}  // namespace lamina
