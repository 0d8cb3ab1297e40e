#include "apps/pipeline/wall_judge.h"

#include <algorithm>
#include <cmath>

#include "core/planar.h"

namespace lamina {

template <int D>
std::vector<Vec<D>> sample_wall(const WallField& wall, int across) {
  constexpr std::size_t kChildren = std::size_t{1} << D;
  const Box<D> bounds = section<D>(wall.bounds());
  double edge = bounds.size().maxCoeff();
  const double wanted = edge / across;
  std::vector<Vec<D>> centers = {bounds.center()};
  while (edge > wanted) {
    edge *= 0.5;
    std::vector<Vec<D>> children(kChildren * centers.size());
    std::vector<std::uint8_t> holds(children.size());
    for_each_index(
        children.size(),
        [&](std::size_t i) {
          children[i] = centers[i / kChildren];
          for (int k = 0; k < D; ++k)
            children[i][k] += (i >> static_cast<unsigned>(k) & 1U) != 0 ? 0.5 * edge : -0.5 * edge;
          holds[i] = std::abs(wall.phi(in_space<D>(children[i]))) <= 0.5 * std::sqrt(D) * edge;
        },
        64);
    centers.clear();
    for (std::size_t i = 0; i < children.size(); ++i)
      if (holds[i] != 0) centers.push_back(children[i]);
  }
  for_each_index(
      centers.size(),
      [&](std::size_t i) { centers[i] = section<D>(wall.at(in_space<D>(centers[i])).closest); }, 64);
  return centers;
}

template <int D>
WallFit judge_wall(const Mesh<D>& mesh, const std::vector<double>& phi, const Body& body,
                   const WallMetric& metric) {
  constexpr int kAcross = D == 2 ? 2048 : 128;
  std::vector<Vec<D>> points = sample_wall<D>(body.level_set, kAcross);
  for (const Vec3& x : body.facet_centers) points.push_back(section<D>(x));
  // WallPoint::N is smoothed over facets and hides creases; the ray of a point close to the wall does not.
  const double close = 1e-3 * metric.layer().h_min;
  const auto probe = [&](const Vec<D>& x) {
    const WallPoint w = body.level_set.at(in_space<D>(x));
    const Vec3 beside = w.closest + close * w.N;
    const Vec3 ray = beside - body.level_set.at(beside).closest;
    const bool smooth = w.feature == WallFeature::kFace && ray.norm() > 0.1 * close;
    return WallProbe<D>{w.phi, section<D>(w.closest), section<D>(Vec3(ray.normalized())),
                        smooth ? std::min(w.edge_distance, w.corner_distance) : 0.0};
  };
  const auto sizes = [&](const Vec<D>& x) { return section<D>(metric.at(in_space<D>(x))); };
  return fit_wall<D>(mesh, phi, points, {probe, sizes});
}

template std::vector<Vec2> sample_wall<2>(const WallField&, int);
template std::vector<Vec3> sample_wall<3>(const WallField&, int);
template WallFit judge_wall(const Mesh<2>&, const std::vector<double>&, const Body&, const WallMetric&);
template WallFit judge_wall(const Mesh<3>&, const std::vector<double>&, const Body&, const WallMetric&);

}  // namespace lamina
