// Smoothed normals and curvature tensors at the corners of facets, and their evaluation anywhere on the wall.
//
// A vertex holds one normal per smooth group of facets around it (groups are separated by sharp edges) and
// one or more shape tensors: one for each connected set of broad facets, one for the others. Broad are the
// facets of a flat face and those many times wider than their neighbour across a bent edge: a flat face that
// ends in a finely meshed fillet, a fillet that ends in a ball patch. A flat face keeps its own normal, which
// is that of the fillet there as well, and its own (zero) curvature, instead of smearing the fillet's over
// its whole width.
#pragma once

#include <array>
#include <vector>

#include "vdb/detail/topology.h"

namespace lamina::detail {

/// Normal and shape tensor (the derivative of the normal: convex > 0) at a vertex.
struct VertexShape {
  Vec3 normal = Vec3::UnitZ();
  Sym<3> shape{};  ///< xx, xy, yy, xz, yz, zz; normal is in its kernel
  double reliability = 1.0;
};

/// A smooth group of corners at a vertex.
struct CornerGroup {
  Index vertex = kNone;
  Index shape = kNone;       ///< of the facets that are not broad; those of the sets of broad ones follow it
  int parts = 1;             ///< 1 + number of sets of broad facets
  double facet_width = 0.0;  ///< mean width of the facets across the curvature; 0 where all is flat
};

struct Curvature {
  std::vector<CornerGroup> groups;
  std::vector<VertexShape> shapes;
  std::vector<std::array<Index, 3>> corner_shapes;  ///< per facet corner: index into shapes
};

/// The tensor of [Rusinkiewicz2004] with the vertex normals of [Max1999].
Curvature estimate_curvature(const Surface& surface, const Topology& topology);

/// Normal and principal curvatures with directions.
struct Frame {
  Vec3 N, T1, T2;
  double k1 = 0.0, k2 = 0.0;  ///< |k1| >= |k2|
  double reliability = 1.0;
};

/// Frame at barycentric coordinates of a facet. Never NaN; `fallback` is the facet's normal.
Frame interpolate_frame(const Curvature& curvature, Index facet, const std::array<double, 3>& bary,
                        const Vec3& fallback);

/// WallPoint::reliability of a curvature whose normal turns by `turn` radians per facet or voxel and which
/// differs by the relative `scatter` from place to place.
double reliability(double turn, double scatter);

/// Principal frame of a symmetric tensor restricted to the plane of the unit vector n.
Frame principal_frame(const Vec3& n, const Sym<3>& shape);

}  // namespace lamina::detail
