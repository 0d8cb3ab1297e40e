// How closely the wall that a mesh resolves, the zero surface of the signed distance interpolated linearly
// over its cells, follows the exact wall, and whether cells are small enough there.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/metric.h"
#include "core/parallel.h"
#include "mesh/mesh.h"

namespace lamina {

/// The exact wall seen from a point.
template <int D>
struct WallProbe {
  double phi = 0.0;                                                ///< signed distance
  Vec<D> closest = Vec<D>::Zero();                                 ///< point of the wall
  Vec<D> normal = Vec<D>::Zero();                                  ///< of the wall there
  double edge_distance = std::numeric_limits<double>::infinity();  ///< from it to the nearest sharp edge
};

/// Thread safe.
template <int D>
struct ExactWall {
  FunctionRef<WallProbe<D>(const Vec<D>&)> probe;
  FunctionRef<Metric<D>(const Vec<D>&)> metric;
};

struct WallFit {
  /// A distance and where it is. On smooth parts: what WallProbe::edge_distance tells of is farther than the
  /// cell is long.
  struct Worst {
    double distance = 0.0;
    Vec3 at = Vec3::Zero();  ///< z = 0 in 2D
  };
  /// From the mesh's wall to the exact one: where edges cross it, and at the centroids of its pieces.
  Worst to_wall;
  /// From points of the exact wall to the mesh's: the interpolated distance there.
  Worst to_mesh;
  Worst anywhere;  ///< the larger of both with no regard to edges
  static constexpr double kKink = 0.25;
  std::int64_t mesh_points = 0, wall_points = 0;  ///< compared, on smooth parts
  std::int64_t outside = 0;                       ///< points of the wall in no cell: beyond the domain

  struct Straddler {
    Index cell = kNone;
    double length = 0.0;  ///< longest edge in the metric of the wall there
    Vec3 at = Vec3::Zero();
  };
  /// Cells that the wall runs through with an edge longer than kTooLong in the metric of the wall there.
  /// Where sizes double from element to element an edge of a good mesh may have 6 in the finest of its
  /// metrics; a cell that missed a part of the wall has the ratio of its sizes.
  std::int64_t straddling = 0;
  std::vector<Straddler> worst;  ///< longest first, at most 20
  static constexpr double kTooLong = 8.0;
};

/// `phi` holds the signed distances of the mesh's points; `wall_points` are points of the exact wall, every
/// part of which should have some. REQUIRES phi.size() == mesh.points.size(). Same bits for every thread
/// count.
template <int D>
WallFit fit_wall(const Mesh<D>& mesh, const std::vector<double>& phi, const std::vector<Vec<D>>& wall_points,
                 const ExactWall<D>& wall);

}  // namespace lamina
