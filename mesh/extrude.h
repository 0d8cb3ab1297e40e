// A plane mesh as one layer of cells in space, for solvers that know no other.
#pragma once

#include "mesh/mesh.h"

namespace lamina {

/// The triangles as prisms between z = 0 and z = height, each cut into three tetrahedra by the order of its
/// vertices' numbers, so that neighbours match. Point i becomes i below and i + n above. Facets keep their
/// tags on the two triangles that stand on each; bottom and top carry the next two tags, named zmin and zmax
/// where tags have names. Fields are copied: scalars as they are, vectors with z = 0, tensors with the size
/// `height` along z. REQUIRES height > 0.
Mesh<3> extrude(const Mesh<2>& mesh, double height);

}  // namespace lamina
