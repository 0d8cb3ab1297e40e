// The integral of sqrt(det M) over the domain of a case, with what it is made of. Part of plan.h.
#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "apps/pipeline/plan.h"

namespace lamina::detail {

constexpr std::size_t kCauses = 7;

/// Complexity of a part of space by cause, and its first moment.
struct Cost {
  std::array<double, kCauses> by_cause{};
  Vec3 moment = Vec3::Zero();

  [[nodiscard]] double sum() const {
    double total = 0.0;
    for (const double c : by_cause) total += c;
    return total;
  }
  void add(const Cost& other) {
    for (std::size_t i = 0; i < kCauses; ++i) by_cause[i] += other.by_cause[i];
    moment += other.moment;
  }
};

using Cell = std::array<int, 3>;

inline void narrow(Passage& a, const Passage& b) {
  if (b.width < a.width) a = b;
}

/// Sums of one leaf or of many. Arrays are by Region.
struct Sums {
  std::array<double, 4> complexity{};
  std::array<double, 4> measured{};    ///< complexity of the points where edges were measured,
  std::array<double, 4> log_length{};  ///< and the sum of its products with the logarithms of their lengths
  std::map<Cell, Cost> costs;
  Passage gap, thickness;
  std::int64_t evaluations = 0;

  /// Mean logarithm of the length that an edge of unit length in the metric at its middle has by the metrics
  /// of its ends, which are what a mesher goes by.
  [[nodiscard]] double excess(std::size_t region) const {
    return measured[region] > 0.0 ? log_length[region] / measured[region] : 0.0;
  }
  void scale(double factor);
  friend Sums operator+(Sums a, const Sums& b);
};

/// `leaves_across`: leaves of the octree along the body's longest extent. The same bits for every thread
/// count. Errors: kInterrupted.
Sums integrate_density(const WallMetric& metric, double leaves_across, const Progress* progress);

}  // namespace lamina::detail
