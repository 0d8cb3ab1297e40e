// The polygons in which an axis-aligned plane cuts a tetrahedral mesh, with values carried along.
#pragma once

#include <vector>

#include "mesh/mesh.h"

namespace lamina {

/// One cut cell as a polygon in plane coordinates (the two axes other than `axis`, in cyclic order
/// x->y->z->x; so for y = const the horizontal axis is x and the vertical one z by choice of the drawing).
struct SlicePolygon {
  Index cell = kNone;
  std::vector<Vec2> corners;  ///< counter-clockwise or clockwise, 3 or 4 corners
  std::vector<double> phi;    ///< the interpolated scalar at each corner (empty when none was given)
};

/// Plane coordinates: axis 0 -> (y, z), axis 1 -> (x, z), axis 2 -> (x, y).
/// `scalar`: one value per point or empty. Cells that only touch the plane are left out. Deterministic order
/// (by cell).
std::vector<SlicePolygon> slice(const Mesh<3>& mesh, int axis, double offset,
                                const std::vector<double>& scalar);

}  // namespace lamina
