// Given metrics as the families from coarse to wanted that the optimizer asks for.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "core/analytic_metric.h"
#include "mesh/adapt.h"
#include "mesh/background.h"

namespace lamina {

/// What is done to every size of a metric: multiplied by `scale`, then kept within [h_min, h_max].
struct SizeLimits {
  double scale = 1.0;
  double h_min = 0.0;
  double h_max = std::numeric_limits<double>::infinity();

  [[nodiscard]] double of(double size) const { return std::min(h_max, std::max(h_min, scale * size)); }
  template <int D>
  [[nodiscard]] Vec<D> of(const Vec<D>& sizes) const {
    return (scale * sizes).cwiseMax(h_min).cwiseMin(h_max);
  }
};

/// The same directions, with every size limited.
template <int D>
Metric<D> limited(const Metric<D>& metric, const SizeLimits& limits) {
  const typename Metric<D>::Principal p = metric.principal();
  return Metric<D>::from_frame(p.axes, limits.of<D>(p.sizes));
}

/// True where the metric at a level has another size across it than `layers`, the metric of the layers.
template <int D>
bool of_other_size(const Level<D>& level, const Metric<D>& layers, double size_floor) {
  constexpr double kOtherSizes = 0.6;
  const double thickness = std::max(size_floor, layers.size_along(level.normal));
  const double ratio = level.metric.size_along(level.normal) / thickness;
  return ratio < kOtherSizes || ratio > 1.0 / kOtherSizes;
}

/// A metric stored at the vertices of a mesh. REQUIRES it to outlive this.
template <int D>
class BackgroundFamily : public AdaptMetric<D> {
 public:
  explicit BackgroundFamily(const BackgroundMetric<D>& metric) : metric_(metric) {}
  [[nodiscard]] Metric<D> at(const Vec<D>& x, double size_floor) const override {
    const Metric<D> m = metric_.at(x);
    if (size_floor <= metric_.smallest()) return m;
    return limited<D>(m, {.h_min = size_floor});
  }

 private:
  const BackgroundMetric<D>& metric_;
};

/// A metric given by a formula. REQUIRES it to outlive this.
template <int D>
class AnalyticFamily : public AdaptMetric<D> {
 public:
  explicit AnalyticFamily(const AnalyticMetric<D>& metric, const SizeLimits& limits = {})
      : metric_(metric),
        limits_(limits),
        as_given_(limits.scale == 1.0 && limits.h_min == 0.0 && std::isinf(limits.h_max)) {}
  [[nodiscard]] Metric<D> at(const Vec<D>& x, double size_floor) const override {
    const SizedFrame<D> f = metric_.frame(x);
    return Metric<D>::from_frame(f.axes, limits_.of<D>(f.sizes).cwiseMax(size_floor));
  }
  /// None where limits leave other sizes than those of the layers.
  [[nodiscard]] std::optional<Level<D>> level(const Vec<D>& x, double size_floor) const override {
    std::optional<Level<D>> level = metric_.level(x, size_floor);
    if (!level) return std::nullopt;
    const Vec<D> there = x + level->way;
    level->metric = at(there, size_floor);
    if (as_given_) return level;
    return of_other_size<D>(*level, metric_.at(there), size_floor) ? std::nullopt : level;
  }
  [[nodiscard]] std::optional<double> wall_distance(const Vec<D>& x) const override {
    return metric_.wall_distance(x);
  }

 private:
  const AnalyticMetric<D>& metric_;
  SizeLimits limits_;
  bool as_given_;
};

/// The intersection of several metrics: no size exceeds that of any of them. Levels and the wall are those of
/// the first part that has some.
template <int D>
class IntersectionFamily : public AdaptMetric<D> {
 public:
  using Parts = std::vector<std::unique_ptr<const AdaptMetric<D>>>;
  explicit IntersectionFamily(Parts parts) : parts_(std::move(parts)) {}
  [[nodiscard]] Metric<D> at(const Vec<D>& x, double size_floor) const override {
    Metric<D> m = parts_.front()->at(x, size_floor);
    for (std::size_t i = 1; i < parts_.size(); ++i) m = intersect(m, parts_[i]->at(x, size_floor));
    return m;
  }
  /// None where the other parts ask for other sizes than those of the layers.
  [[nodiscard]] std::optional<Level<D>> level(const Vec<D>& x, double size_floor) const override {
    for (const auto& part : parts_) {
      std::optional<Level<D>> level = part->level(x, size_floor);
      if (!level) continue;
      const Metric<D> own = level->metric;
      level->metric = at(x + level->way, size_floor);
      return of_other_size<D>(*level, own, size_floor) ? std::nullopt : level;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::optional<double> wall_distance(const Vec<D>& x) const override {
    for (const auto& part : parts_)
      if (const auto distance = part->wall_distance(x)) return distance;
    return std::nullopt;
  }

 private:
  Parts parts_;
};

}  // namespace lamina
