// The metric that an adaptation asks for, put together from a formula, files and Hessians.
#pragma once

#include <memory>
#include <vector>

#include "apps/pipeline/adaptation.h"
#include "apps/pipeline/detail/metric_family.h"
#include "core/progress.h"

namespace lamina {

/// A mesh as it was read, that metrics and fields are interpolated on.
template <int D>
struct Carrier {
  explicit Carrier(Mesh<D> m) : mesh(std::move(m)), places(std::make_shared<const CellFinder<D>>(mesh)) {}
  Mesh<D> mesh;
  std::shared_ptr<const CellFinder<D>> places;
};

/// The values of a scalar point field. `spec` names it, as "NAME:K" its K-th component (from 1), or is a .sol
/// or .solb of the mesh's points that holds one scalar. `option` and `mesh_name` are used in messages.
/// Errors: kUsage listing the fields, those of reading files.
template <int D>
std::vector<double> scalar_field(const Mesh<D>& mesh, const std::string& spec, const char* option,
                                 const std::string& mesh_name);

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
  [[nodiscard]] bool complexity_is_estimate() const { return stored_.size() != 1 || formula_ != nullptr; }
  /// Multiplies all sizes by `factor`, within the limits.
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
  std::vector<Stored> stored_;
  std::vector<std::unique_ptr<const BackgroundMetric<D>>> backgrounds_;  ///< of stored_
  std::unique_ptr<const BackgroundMetric<D>> bound_;
  SizeLimits limits_;
};

}  // namespace lamina
