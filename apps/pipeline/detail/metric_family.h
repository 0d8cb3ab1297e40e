// Given metrics as the families from coarse to wanted that the optimizer asks for.
#pragma once

#include <limits>

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

/// A metric given by a formula, and, where there is one, no coarser than `bound`. REQUIRES both to outlive
/// this.
template <int D>
class AnalyticFamily : public AdaptMetric<D> {
 public:
  explicit AnalyticFamily(const AnalyticMetric<D>& metric, const SizeLimits& limits = {},
                          const BackgroundMetric<D>* bound = nullptr)
      : metric_(metric), limits_(limits), bound_(bound) {}
  [[nodiscard]] Metric<D> at(const Vec<D>& x, double size_floor) const override {
    const SizedFrame<D> f = metric_.frame(x);
    const Metric<D> m = Metric<D>::from_frame(f.axes, limits_.of<D>(f.sizes).cwiseMax(size_floor));
    return bound_ == nullptr ? m : intersect(m, BackgroundFamily<D>(*bound_).at(x, size_floor));
  }

 private:
  const AnalyticMetric<D>& metric_;
  SizeLimits limits_;
  const BackgroundMetric<D>* bound_;
};

}  // namespace lamina
