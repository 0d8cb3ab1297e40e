// A metric given at the vertices of a mesh: that of a solution, or of an earlier mesh.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/field.h"
#include "mesh/cell_finder.h"
#include "mesh/mesh.h"

namespace lamina {

/// The point field "metric" of a mesh as metrics; empty when it has none. `name` is used in messages. Errors:
/// kParameter naming the first point whose tensor is not positive definite.
template <int D>
std::optional<std::vector<Metric<D>>> metric_field(const Mesh<D>& mesh, const std::string& name);

/// The metric of the points of a mesh that was read from `path`: its point field "metric", or a .solb or .sol
/// of the same name beside it. Errors: those of read_metric, kFileMissing without a metric, kParameter when
/// the counts differ.
template <int D>
std::vector<Metric<D>> metric_of(const Mesh<D>& mesh, const std::filesystem::path& path);

/// A mesh file and the metric of its points, see metric_of. Errors: those of read_mesh and metric_of,
/// kFileUnsupported without cells or when the mesh is of another dimension.
template <int D>
std::vector<Metric<D>> read_mesh_with_metric(const std::filesystem::path& path, Mesh<D>& mesh);

/// Interpolated within cells as exp of the mean of the logarithms; beyond the mesh, as at its nearest point.
template <int D>
class BackgroundMetric : public MetricField<D> {
 public:
  /// REQUIRES one metric per point, and cells.
  BackgroundMetric(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric)
      : BackgroundMetric(std::make_shared<const CellFinder<D>>(mesh), metric) {}
  /// The same where others look for places in the same mesh.
  BackgroundMetric(std::shared_ptr<const CellFinder<D>> carrier, const std::vector<Metric<D>>& metric);
  /// A mesh file with its metric, see read_mesh_with_metric; bounded by gradate (mesh/gradation.h) where
  /// `gradation` > 1.
  static BackgroundMetric read(const std::filesystem::path& path, double gradation = 0.0);

  [[nodiscard]] Metric<D> at(const Vec<D>& x) const override;
  /// Smallest size in any direction at any vertex.
  [[nodiscard]] double smallest() const { return smallest_; }
  [[nodiscard]] const Box<D>& bounds() const { return carrier_->bounds(); }

 private:
  std::shared_ptr<const CellFinder<D>> carrier_;
  std::vector<Sym<D>> logs_;
  double smallest_ = 0.0;
};

}  // namespace lamina
