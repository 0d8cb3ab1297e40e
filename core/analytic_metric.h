// Metrics given by formulas on a box of their own: the benchmarks that meshes of different programs are
// judged by. Those of [Ibanez2017] are cube-linear, polar-1 and polar-2; tilted-plane, sphere and cube are
// walls in the unit cube; the names that end in -bl carry the layers of [Billon2016] with sizes that make
// every layer [s_{k-1}, s_k] exactly one unit thick: h(d) = kappa h_min + ln(alpha) d, kappa = ln(alpha) /
// (alpha - 1).
//
// A metric is named NAME[:key=value,...], e.g. "tilted-plane:hmin=1e-5,ht=0.1". Distances to walls are
// positive outside.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/field.h"
#include "core/level.h"

namespace lamina {

/// A number that a named metric takes.
struct AnalyticKey {
  std::string name;
  double value = 0.0;  ///< DEFAULT; NaN: derived from the others
  double low = 0.0;    ///< values are > low
};

struct AnalyticName {
  std::string name;
  int dimension = 3;  ///< 0: any
  std::string help;   ///< a few words
  std::vector<AnalyticKey> keys;
};

/// All that are known.
const std::vector<AnalyticName>& analytic_names();

/// One line each: name, keys with their defaults, and what it is.
std::string analytic_list();

/// 2 or 3, or 0 for a metric of both. Errors: kUsage listing the names when it is unknown.
int analytic_dimension(std::string_view spec);

/// Orthonormal directions (rows of `axes`) and the size along each.
template <int D>
struct SizedFrame {
  Mat<D> axes;
  Vec<D> sizes;
};

template <int D>
class AnalyticMetric : public MetricField<D> {
 public:
  [[nodiscard]] virtual SizedFrame<D> frame(const Vec<D>& x) const = 0;
  [[nodiscard]] Metric<D> at(const Vec<D>& x) const override {
    const SizedFrame<D> f = frame(x);
    return Metric<D>::from_frame(f.axes, f.sizes);
  }
  /// The layer surface nearest to x, as AdaptMetric::level but without its metric; none where there are no
  /// layers.
  [[nodiscard]] virtual std::optional<Level<D>> level(const Vec<D>& /*x*/, double /*size_floor*/) const {
    return std::nullopt;
  }
  /// Signed distance to the wall that carries the layers; none where there are no layers.
  [[nodiscard]] virtual std::optional<double> wall_distance(const Vec<D>& /*x*/) const {
    return std::nullopt;
  }
  /// Smallest size in any direction at any point.
  [[nodiscard]] virtual double smallest() const = 0;
  /// The box that the benchmark is defined on.
  [[nodiscard]] virtual Box<D> domain() const = 0;
  /// Edge length of the lattice (mesh/seed.h) in `domain` that the benchmark starts from.
  [[nodiscard]] virtual double start_size() const = 0;
};

/// The metric of a name. Errors: kUsage when the name is unknown, of another dimension, or a key is unknown,
/// given twice, malformed or out of range; the message lists what is known.
template <int D>
std::unique_ptr<const AnalyticMetric<D>> make_analytic_metric(std::string_view spec);

}  // namespace lamina
