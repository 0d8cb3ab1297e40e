// Quality of a mesh in a metric: edge lengths, unit share, mean ratio, aspect ratio, complexity, worst cells.
#pragma once

#include <array>
#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina {

struct WorstCell {
  Index cell = kNone;
  double quality = 0.0;
  Vec3 center = Vec3::Zero();  ///< centroid (z = 0 in 2D)
};

struct Score {
  std::int64_t points = 0, cells = 0, edges = 0;  ///< points: those that cells use
  double complexity = 0.0;  ///< sum over cells of volume x mean over vertices of sqrt(det M)
  double unit_share = 0.0;  ///< edges with metric length in [1/sqrt2, sqrt2], as a fraction
  double length_min = 0.0, length_max = 0.0, length_mean = 0.0;
  double short_share = 0.0;  ///< below 1/2
  double long_share = 0.0;   ///< above 2
  double quality_min = 0.0, quality_mean = 0.0;
  double aspect_max = 0.0, aspect_p99 = 0.0;  ///< Euclidean longest edge / shortest height
  /// Counts of edges with metric length in [edges[i], edges[i+1]); the last bin is open.
  static constexpr std::array<double, 15> kLengthBins = {0.0, 0.25, 0.5, 0.6,      kUnitMin, 0.8, 0.9, 1.0,
                                                         1.1, 1.2,  1.3, kUnitMax, 1.6,      2.0, 4.0};
  std::array<std::int64_t, 15> length_histogram{};
  /// Counts of cells with quality in [i/10, (i+1)/10); negative ones in bin 0.
  std::array<std::int64_t, 10> quality_histogram{};
  std::vector<WorstCell> worst;  ///< lowest quality first, at most 20
};

/// Metric lengths use edge_length, quality cell_quality of core/metric.h. REQUIRES metric.size() ==
/// mesh.points.size(). Same bits for every thread count.
template <int D>
Score score(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric);

}  // namespace lamina
