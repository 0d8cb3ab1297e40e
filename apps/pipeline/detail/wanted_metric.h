// The metric that an adaptation asks for, put together from a formula, files, Hessians and a wall.
#pragma once

#include <memory>
#include <vector>

#include "apps/pipeline/adaptation.h"
#include "apps/pipeline/detail/adapt_wall.h"
#include "apps/pipeline/detail/carrier.h"
#include "apps/pipeline/detail/metric_family.h"
#include "core/progress.h"

namespace lamina {

/// Each metric is interpolated on the mesh it was given on, or evaluated where it is a formula, and the
/// intersection is taken where a vertex goes: no mesh is bound to the resolution of another.
template <int D>
class WantedMetric {
 public:
  /// `input` is the mesh as read, with its fields; null where nothing is given on it, see needs_input.
  /// `domain` is the mesh that complexities are estimated on. Scales sizes where a complexity is asked for.
  /// REQUIRES `a` to outlive this. Errors: kUsage, kParameter, those of reading files.
  WantedMetric(const Adaptation& a, std::shared_ptr<const Carrier<D>> input, const Mesh<D>& domain,
               Progress& progress);

  [[nodiscard]] static bool needs_input(const Adaptation& a);

  /// REQUIRES this to outlive it, unchanged.
  [[nodiscard]] std::unique_ptr<const AdaptMetric<D>> family() const;
  [[nodiscard]] double smallest() const;
  [[nodiscard]] double scale() const { return limits_.scale; }
  [[nodiscard]] bool has_formula() const { return formula_ != nullptr; }
  /// The complexity was estimated without a mesh that resolves the metric.
  [[nodiscard]] bool complexity_is_estimate() const { return stored_.size() != 1 || formula_ || wall_; }
  /// The layers along the wall; null where there is none.
  [[nodiscard]] const AdaptWall<D>* wall() const { return wall_.get(); }
  /// Multiplies all sizes but those of the wall by `factor`, within the limits.
  void rescale(double factor);
  /// The formula, and not what bounds it, at points.
  [[nodiscard]] std::vector<Metric<D>> formula_at(const std::vector<Vec<D>>& points) const;
  /// From now on no coarser than `metric` at the points of `mesh`.
  void bound_by(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric);

 private:
  struct Stored {
    std::shared_ptr<const Carrier<D>> carrier;
    std::vector<Metric<D>> given, limited;  ///< of its points
  };
  void add_file(const std::filesystem::path& file);
  void add_on_input(std::vector<Metric<D>> metric);
  void add_hessians(Progress& progress);
  void apply(Progress* progress);
  void fit_complexity(const Mesh<D>& domain, Progress& progress);
  [[nodiscard]] double complexity_on(const Mesh<D>& domain) const;

  const Adaptation& a_;
  std::shared_ptr<const Carrier<D>> input_;
  std::unique_ptr<const AnalyticMetric<D>> formula_;
  std::unique_ptr<const AdaptWall<D>> wall_;
  std::vector<Stored> stored_;
  std::vector<std::unique_ptr<const BackgroundMetric<D>>> backgrounds_;  ///< of stored_
  std::unique_ptr<const BackgroundMetric<D>> bound_;
  SizeLimits limits_;
};

}  // namespace lamina
