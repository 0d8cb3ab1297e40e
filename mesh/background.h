// A metric given at the vertices of a mesh: that of a solution, or of an earlier mesh.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/box_tree.h"
#include "core/field.h"
#include "mesh/mesh.h"

namespace lamina {

/// The point field "metric" of a mesh as metrics; empty when it has none. `name` is used in messages. Errors:
/// kParameter naming the first point whose tensor is not positive definite.
template <int D>
std::optional<std::vector<Metric<D>>> metric_field(const Mesh<D>& mesh, const std::string& name);

/// A mesh file and the metric of its points: a point field "metric" (.vtu), or a .sol or .solb of the same
/// name beside it. Errors: those of read_mesh and read_metric, kFileMissing without a metric,
/// kFileUnsupported without cells or when the mesh is of another dimension, kParameter when the counts
/// differ.
template <int D>
std::vector<Metric<D>> read_mesh_with_metric(const std::filesystem::path& path, Mesh<D>& mesh);

/// Interpolated within cells as exp of the mean of the logarithms; beyond the mesh, as at its nearest point.
template <int D>
class BackgroundMetric : public MetricField<D> {
 public:
  /// REQUIRES one metric per point, and cells. Facets, tags and fields of the mesh are not kept.
  BackgroundMetric(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric);
  /// A mesh file with its metric, see read_mesh_with_metric; bounded by gradate (mesh/gradation.h) where
  /// `gradation` > 1.
  static BackgroundMetric read(const std::filesystem::path& path, double gradation = 0.0);

  [[nodiscard]] Metric<D> at(const Vec<D>& x) const override;
  /// Smallest size in any direction at any vertex.
  [[nodiscard]] double smallest() const { return smallest_; }
  [[nodiscard]] Box<D> bounds() const { return bounds_; }

 private:
  struct Place {
    Index cell = kNone;
    std::array<double, D + 1> weights{};  ///< of the cell's vertices
  };
  [[nodiscard]] Place find(const Vec<D>& x) const;

  std::vector<Vec<D>> points_;
  std::vector<std::array<Index, D + 1>> cells_;
  std::vector<Sym<D>> logs_;
  Vec3 origin_ = Vec3::Zero();  ///< the tree's coordinates are relative to this
  detail::BoxTree tree_;
  Box<D> bounds_;
  double smallest_ = 0.0;
};

}  // namespace lamina
