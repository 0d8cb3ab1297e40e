// Sharp edges that turn by less than the feature angle: where two flat faces meet.
//
// A slant of 25 degrees on a flat roof is no coarse picture of a round one. An edge is a crease when the
// facets beside it belong to flat faces, and no edge beyond it, within some facets, turns the wall on in the
// same direction as strips of a faceted fillet or cylinder do.
#pragma once

#include "vdb/detail/topology.h"

namespace lamina::detail {

/// Creases among the smooth edges of `topology` become convex or concave ones.
/// REQUIRES normals, edges and their kinds; vertices need not be classified.
void mark_creases(const Surface& surface, Topology& topology);

}  // namespace lamina::detail
