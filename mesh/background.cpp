#include "mesh/background.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/gradation.h"
#include "mesh/io.h"
#include "mesh/solution.h"

namespace lamina {

template <int D>
std::optional<std::vector<Metric<D>>> metric_field(const Mesh<D>& mesh, const std::string& name) {
  const MeshField* field = mesh.point_field("metric");
  if (field == nullptr || field->components != kSymSize<D>) return {};
  std::vector<Metric<D>> metric(mesh.points.size());
  for (std::size_t i = 0; i < metric.size(); ++i) {
    Sym<D> tensor;
    std::copy_n(field->values.begin() + static_cast<std::ptrdiff_t>(tensor.size() * i), tensor.size(),
                tensor.begin());
    const auto m = Metric<D>::from_tensor(tensor);
    if (!m)
      throw Error(
          ErrorCode::kParameter,
          fmt::format("{}: field \"metric\": the tensor of point {} is not positive definite", name, i));
    metric[i] = *m;
  }
  return metric;
}

template <int D>
BackgroundMetric<D>::BackgroundMetric(std::shared_ptr<const CellFinder<D>> carrier,
                                      const std::vector<Metric<D>>& metric)
    : carrier_(std::move(carrier)), logs_(metric.size()) {
  for_each_index(logs_.size(), [&](std::size_t i) { logs_[i] = metric[i].log(); });
  smallest_ = std::numeric_limits<double>::infinity();
  for (const Metric<D>& m : metric) smallest_ = std::min(smallest_, m.principal().sizes[0]);
}

template <int D>
Metric<D> BackgroundMetric<D>::at(const Vec<D>& x) const {
  const CellPlace<D> place = carrier_->find(x);
  if (place.cell == kNone) return {};
  Sym<D> mean{};
  for (std::size_t k = 0; k <= D; ++k) {
    const Sym<D>& log = logs_[static_cast<std::size_t>(carrier_->cell(place)[k])];
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += place.weights[k] * log[i];
  }
  return Metric<D>::from_log(mean);
}

template <int D>
std::vector<Metric<D>> metric_of(const Mesh<D>& mesh, const std::filesystem::path& path) {
  std::optional<std::vector<Metric<D>>> metric = metric_field<D>(mesh, path.string());
  if (!metric) {
    const auto solution = find_solution(path);
    if (!solution)
      throw Error(ErrorCode::kFileMissing,
                  fmt::format("{}: no metric: neither a point field \"metric\" nor a .solb or .sol beside it",
                              path.string()));
    metric = read_metric<D>(*solution);
  }
  if (metric->size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{}: {} metrics for {} points", path.string(),
                                                   metric->size(), mesh.points.size()));
  return std::move(*metric);
}

template <int D>
std::vector<Metric<D>> read_mesh_with_metric(const std::filesystem::path& path, Mesh<D>& mesh) {
  AnyMesh any = read_mesh(path);
  auto* found = std::get_if<Mesh<D>>(&any);
  if (found == nullptr)
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: not a mesh in {} dimensions", path.string(), D));
  if (found->cells.empty())
    throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: the mesh has no cells", path.string()));
  std::vector<Metric<D>> metric = metric_of<D>(*found, path);
  mesh = std::move(*found);
  return metric;
}

template <int D>
BackgroundMetric<D> BackgroundMetric<D>::read(const std::filesystem::path& path, double gradation) {
  Mesh<D> mesh;
  std::vector<Metric<D>> metric = read_mesh_with_metric<D>(path, mesh);
  if (gradation > 1.0) gradate<D>(mesh, metric, gradation);
  return {mesh, metric};
}

template std::optional<std::vector<Metric<2>>> metric_field(const Mesh<2>&, const std::string&);
template std::optional<std::vector<Metric<3>>> metric_field(const Mesh<3>&, const std::string&);
template std::vector<Metric<2>> metric_of(const Mesh<2>&, const std::filesystem::path&);
template std::vector<Metric<3>> metric_of(const Mesh<3>&, const std::filesystem::path&);
template std::vector<Metric<2>> read_mesh_with_metric(const std::filesystem::path&, Mesh<2>&);
template std::vector<Metric<3>> read_mesh_with_metric(const std::filesystem::path&, Mesh<3>&);
template class BackgroundMetric<2>;
template class BackgroundMetric<3>;

}  // namespace lamina
