// Boundary facets of meshes that name none or not all, as `lamina mesh` leaves them out of a .vtu.
#pragma once

#include <cstdint>

#include "mesh/mesh.h"

namespace lamina {

/// Names of the faces of a box, in the order of the tags 1, 2, ... that their facets get.
inline constexpr std::array<const char*, 6> kBoxFaceNames = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

/// Lists the facets of one cell, outward, in the order of cells. Those in a face of the mesh's bounding box
/// get its tag, x-, x+, y-, y+ (, z-, z+) from 1 on, all others the next one; tags that occur are named, the
/// last one "boundary". REQUIRES valid indices, positive cells for the orientation, and no facets. GUARANTEES
/// the same for every thread count.
template <int D>
void list_box_facets(Mesh<D>& mesh);

/// Appends those facets of one cell that the list lacks, outward, in the order of cells, with tag 0. Returns
/// their number. REQUIRES valid indices, positive cells for the orientation.
template <int D>
std::int64_t list_missing_facets(Mesh<D>& mesh);

}  // namespace lamina
