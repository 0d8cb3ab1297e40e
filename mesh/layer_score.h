// How closely a mesh follows the layers of its metric: vertices on their levels, right columns, and a wall
// that carries as many vertices as its tangential sizes ask for.
//
// Thicknesses are those of the metric: the size along the normal, on the level, is one layer.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/adapt.h"

namespace lamina {

struct LayerScore {
  int dimension = 3;
  std::int64_t points = 0;    ///< with a level of the metric nearby
  std::int64_t on_level = 0;  ///< of those, within 5 % of a layer of it
  std::int64_t on_wall = 0;   ///< of those, on the wall
  double mean_offset = 0.0;   ///< mean distance of `points` to their levels, in layers; 1/4 at random
  /// Vertices of a regular mesh of the wall that is unit in its tangential sizes: the metric area of the
  /// mesh's wall times 2/sqrt(3), in 2D the metric length.
  double ideal_on_wall = 0.0;
  std::int64_t edges = 0;    ///< between `points`
  std::int64_t aligned = 0;  ///< of those, within 10 degrees of the normal or the tangent plane in the metric

  [[nodiscard]] double on_level_share() const;
  [[nodiscard]] double wall_share() const;  ///< on_wall / ideal_on_wall; 0 where there is no wall
  [[nodiscard]] double aligned_share() const;
  /// aligned_share() relative to right columns on regular triangles, cut into cells: their edges are 3 within
  /// a level, 1 along the normal and 3 diagonals a vertex, in 2D 1, 1 and 1.
  [[nodiscard]] double aligned_of_ideal() const {
    return aligned_share() / (dimension == 3 ? 4.0 / 7.0 : 2.0 / 3.0);
  }
};

/// Signed distances of all points to the wall of `field`; empty when it has none.
template <int D>
std::vector<double> wall_distances(const Mesh<D>& mesh, const AdaptMetric<D>& field);

/// `phi` holds the wall distances; `offsets`, when given, receives the distance of each point to its level,
/// in layers, -1 where there is none. REQUIRES metric and phi of as many entries as there are points. Same
/// bits for every thread count. Cost: one level for each point and each cell that the wall cuts.
template <int D>
LayerScore score_layers(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric,
                        const AdaptMetric<D>& field, const std::vector<double>& phi,
                        std::vector<double>* offsets = nullptr);

}  // namespace lamina
