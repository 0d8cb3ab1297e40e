// What a mesh will be, before it is made: predicted counts by quadrature of the metric's density.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "apps/pipeline/pipeline.h"

namespace lamina {

/// Tetrahedra of a unit mesh per unit of complexity C, the integral of sqrt(det M), where the metric hardly
/// changes over an edge: what the optimizer makes far from all walls (8.0 to 8.4; regular unit tetrahedra,
/// which do not fill space, would be 8.49). Where it changes, a mesh of unit edges is denser: an edge is
/// measured by the metrics of its two ends, and by those a chord of a fan or along a curved wall is longer
/// than by the metric at its middle, by exp(e) on average. Prediction counts exp(3 e) times as many cells,
/// with e measured in each region.
inline constexpr double kCellsPerComplexity = 8.3;
inline constexpr double kCellsPerPoint = 5.8;
/// The same of triangles, of which there are two per point; regular ones would be 2.31.
inline constexpr double kTrianglesPerComplexity = 2.4;

/// Seconds of one core (2 GHz of 2020) and bytes that a cell takes, measured on meshes of 0.2 to 8 million
/// cells.
inline constexpr double kSecondsPerCell = 8e-5;
inline constexpr double kBytesPerCell = 100.0, kBytesAtLeast = 1.4e8;

/// What makes a place costly.
enum class Cause { kFlatWall, kCurvature, kBend, kSharpEdge, kCurvedEdge, kCorner, kOtherWall };
const char* cause_text(Cause cause);

/// A part of the layers and of the body's inside, of an eighth of the body's extent, and what it costs.
struct Spot {
  Vec3 place = Vec3::Zero();  ///< mean place of its cells
  Cause cause = Cause::kFlatWall;
  double cells = 0.0;
};

/// The narrowest place between two walls that face each other.
struct Passage {
  double width = std::numeric_limits<double>::infinity();
  Vec3 place = Vec3::Zero();
};

struct Prediction {
  double complexity = 0.0;
  std::array<double, 4> region_complexity{};  ///< by Region
  double cells = 0.0, points = 0.0;
  std::array<double, 4> region_cells{};  ///< by Region
  std::vector<Spot> spots;               ///< the five most costly ones, most costly first
  Passage gap, thickness;                ///< of the fluid and of the body, as far as samples found them
  std::int64_t evaluations = 0;          ///< of the metric

  [[nodiscard]] double seconds() const { return kSecondsPerCell * cells; }
  [[nodiscard]] double bytes() const { return kBytesAtLeast + kBytesPerCell * cells; }
};

/// Leaves of the quadrature's octree along the body's longest extent: for a count, and to tell costly places.
inline constexpr double kCoarseLeaves = 24.0, kFineLeaves = 40.0;

/// Integrates sqrt(det M) over the domain and measures how much denser a mesh of unit edges is. The same bits
/// for every thread count. Cost: 1e5 to 5e5 evaluations of the metric, two to three times as many with
/// kFineLeaves. Errors:
/// kInterrupted.
Prediction predict(const WallMetric& metric, Progress* progress = nullptr,
                   double leaves_across = kCoarseLeaves);

/// Words on what the body cannot carry: facets that sag more than h_min, voxels many times h_min, gaps and
/// thicknesses narrower than the layers.
std::vector<std::string> limits_of_input(const ResolvedCase& resolved, const Body& body, const Prediction& p);

/// Scales h2 and h1, not h_min, until about c.target_cells cells are predicted; without a target it only
/// predicts. Says what it changed, or why it cannot, in resolved.warnings.
Prediction fit_to_target(ResolvedCase& resolved, const Body& body, Progress* progress);

/// The plan of a case: parameters, table of layers, sizes and predicted counts.
std::string plan_text(const ResolvedCase& resolved, const Prediction& prediction);
std::string plan_json(const ResolvedCase& resolved, const Prediction& prediction);

}  // namespace lamina
