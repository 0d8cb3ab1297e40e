// Coarse seed meshes of a box-shaped domain.
#pragma once

#include "mesh/mesh.h"

namespace lamina {

enum class SeedKind { kTetgen, kLattice };

/// True when Lamina was built with TetGen (LAMINA_TETGEN).
bool have_tetgen();

/// Tetrahedra (triangles for D = 2) that fill `box` exactly, of edge length about `size` but at least one and
/// at most `max_cells_per_axis` cells along each axis. Facets carry tags 1..2D: x-, x+, y-, y+ (, z-, z+),
/// named xmin, xmax, ymin, ymax (, zmin, zmax).
/// kTetgen is 3D only. Errors: kSeed (TetGen missing from this build or failing), kDomain (empty box).
template <int D>
Mesh<D> make_seed(const Box<D>& box, double size, SeedKind kind, int max_cells_per_axis = 200);

}  // namespace lamina
