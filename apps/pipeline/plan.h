// What a mesh will be, before it is made: predicted counts by quadrature of the metric's density.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "apps/pipeline/pipeline.h"

namespace lamina {

/// Tetrahedra and vertices of a unit mesh per unit of complexity C, the integral of sqrt(det M).
inline constexpr double kCellsPerComplexity = 11.9;
inline constexpr double kPointsPerComplexity = 2.1;

struct Prediction {
  double complexity = 0.0;
  double cells = 0.0, points = 0.0;
  std::array<double, 4> region_cells{};  ///< by Region
  std::int64_t evaluations = 0;          ///< of the metric
};

/// Integrates sqrt(det M) over the domain. The same bits for every thread count; within some 10 % of the
/// integral. Cost: about 1e5 evaluations of the metric. Errors: kInterrupted.
Prediction predict(const WallMetric& metric, Progress* progress = nullptr);

/// The plan of a case: parameters, table of layers, sizes and predicted counts.
std::string plan_text(const ResolvedCase& resolved, const Prediction& prediction);
std::string plan_json(const ResolvedCase& resolved, const Prediction& prediction);

}  // namespace lamina
