#include "mesh/background.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/gradation.h"
#include "mesh/io.h"

namespace lamina {
namespace {

template <int D>
Vec3 in_space(const Vec<D>& x) {
  Vec3 out = Vec3::Zero();
  out.template head<D>() = x;
  return out;
}

/// Closest point of the simplex with the corners in `used` to x, as weights of the corners. Where the closest
/// point of their affine hull is outside, it is on a side that lacks one of the corners with a negative
/// weight.
template <int D>
double closest_weights(const std::array<Vec<D>, D + 1>& corners, const std::vector<int>& used,
                       const Vec<D>& x, std::array<double, D + 1>& weights) {
  const int n = static_cast<int>(used.size()) - 1;
  const auto corner = [&](int k) -> const Vec<D>& {
    return corners[static_cast<std::size_t>(used[static_cast<std::size_t>(k)])];
  };
  using Edges = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, D>;
  Edges edges(D, n);
  for (int k = 0; k < n; ++k) edges.col(k) = corner(k + 1) - corner(0);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, D, 1> b(n);
  if (n > 0) b = edges.colPivHouseholderQr().solve(x - corner(0));
  weights.fill(0.0);
  const auto weight = [&](int k) -> double& {
    return weights[static_cast<std::size_t>(used[static_cast<std::size_t>(k)])];
  };
  weight(0) = 1.0;
  Vec<D> foot = corner(0);
  for (int k = 0; k < n; ++k) {
    weight(k + 1) = b[k];
    weight(0) -= b[k];
    foot += b[k] * edges.col(k);
  }
  if (std::all_of(weights.begin(), weights.end(), [](double w) { return w >= 0.0; }))
    return (x - foot).squaredNorm();
  const std::array<double, D + 1> hull = weights;
  double best = std::numeric_limits<double>::infinity();
  for (const int out : used) {
    if (hull[static_cast<std::size_t>(out)] >= 0.0) continue;
    std::vector<int> side;
    for (const int k : used)
      if (k != out) side.push_back(k);
    std::array<double, D + 1> there;
    const double d2 = closest_weights<D>(corners, side, x, there);
    if (!(d2 < best)) continue;
    best = d2;
    weights = there;
  }
  return best;
}

}  // namespace

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
BackgroundMetric<D>::BackgroundMetric(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric)
    : points_(mesh.points), cells_(mesh.cells), logs_(metric.size()) {
  for (const Vec<D>& x : points_) bounds_.extend(x);
  origin_ = in_space<D>(bounds_.center());
  for_each_index(logs_.size(), [&](std::size_t i) { logs_[i] = metric[i].log(); });
  smallest_ = std::numeric_limits<double>::infinity();
  for (const Metric<D>& m : metric) smallest_ = std::min(smallest_, m.principal().sizes[0]);
  std::vector<detail::BoxRef> refs(cells_.size());
  for_each_index(refs.size(), [&](std::size_t c) {
    std::array<Vec3, D + 1> corners;
    for (std::size_t k = 0; k <= D; ++k)
      corners[k] = in_space<D>(points_[static_cast<std::size_t>(cells_[c][k])]) - origin_;
    refs[c] = detail::BoxRef::around(corners.data(), D + 1, static_cast<Index>(c));
  });
  tree_ = detail::build_box_tree(std::move(refs));
}

template <int D>
typename BackgroundMetric<D>::Place BackgroundMetric<D>::find(const Vec<D>& x) const {
  const Vec3 local = in_space<D>(x) - origin_;
  std::vector<int> all(D + 1);
  std::iota(all.begin(), all.end(), 0);
  double best = std::numeric_limits<double>::infinity();
  Place place;
  detail::visit_nearest(tree_, local.data(), best, 1.0, [&](int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Index id = tree_.ids[static_cast<std::size_t>(i)];
      std::array<Vec<D>, D + 1> corners;
      for (std::size_t k = 0; k <= D; ++k)
        corners[k] = points_[static_cast<std::size_t>(cells_[static_cast<std::size_t>(id)][k])];
      std::array<double, D + 1> weights;
      const double d2 = closest_weights<D>(corners, all, x, weights);
      if (!(d2 < best)) continue;
      best = d2;
      place = {id, weights};
    }
  });
  return place;
}

template <int D>
Metric<D> BackgroundMetric<D>::at(const Vec<D>& x) const {
  const Place place = find(x);
  if (place.cell == kNone) return {};
  Sym<D> mean{};
  for (std::size_t k = 0; k <= D; ++k) {
    const Sym<D>& log = logs_[static_cast<std::size_t>(cells_[static_cast<std::size_t>(place.cell)][k])];
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += place.weights[k] * log[i];
  }
  return Metric<D>::from_log(mean);
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
  std::optional<std::vector<Metric<D>>> metric = metric_field<D>(*found, path.string());
  for (const char* extension : {".solb", ".sol"}) {
    std::filesystem::path beside = path;
    if (!metric && std::filesystem::exists(beside.replace_extension(extension)))
      metric = read_metric<D>(beside);
  }
  if (!metric)
    throw Error(ErrorCode::kFileMissing,
                fmt::format("{}: no metric: neither a point field \"metric\" nor a .solb or .sol beside it",
                            path.string()));
  if (metric->size() != found->points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{}: {} metrics for {} points", path.string(),
                                                   metric->size(), found->points.size()));
  mesh = std::move(*found);
  return std::move(*metric);
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
template std::vector<Metric<2>> read_mesh_with_metric(const std::filesystem::path&, Mesh<2>&);
template std::vector<Metric<3>> read_mesh_with_metric(const std::filesystem::path&, Mesh<3>&);
template class BackgroundMetric<2>;
template class BackgroundMetric<3>;

}  // namespace lamina
