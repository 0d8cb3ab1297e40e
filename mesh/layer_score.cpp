#include "mesh/layer_score.h"

#include <cmath>

#include "core/parallel.h"
#include "mesh/topology/incidence.h"
#include "mesh/topology/sum.h"
#include "mesh/topology/zero_surface.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 1024;
constexpr double kOnLevel = 0.05;  // of a layer

/// A point as its nearest level sees it.
template <int D>
struct Place {
  bool in_layers = false;
  double height = 0.0;  ///< in layers: whole on the levels
  double offset = 0.0;  ///< distance to the level, in layers
  Vec<D> normal = Vec<D>::Zero();
};

template <int D>
std::vector<Place<D>> places_of(const Mesh<D>& mesh, const AdaptMetric<D>& field) {
  std::vector<Place<D>> places(mesh.points.size());
  for_each_index(
      places.size(),
      [&](std::size_t i) {
        const auto level = field.level(mesh.points[i], 0.0);
        if (!level) return;
        const double per_length = level->metric.length(level->normal);
        places[i] = {true, level->number - per_length * level->way.dot(level->normal),
                     per_length * level->way.norm(), level->normal};
      },
      256);
  return places;
}

/// The share of e that is normal to n in the metric of one end.
template <int D>
double tangential(const Vec<D>& e, const Vec<D>& n, const Metric<D>& m) {
  return m.length(e - e.dot(n) * n);
}

// On a curved wall the chord between two vertices of a level leaves the tangent planes of both, so the normal
// part of an edge is the difference of heights, and the tangential part is taken at each end.
template <int D>
bool is_aligned(const Vec<D>& e, const Place<D>& a, const Metric<D>& ma, const Place<D>& b,
                const Metric<D>& mb) {
  constexpr double kTan = 0.17632698070846498;  // of 10 degrees
  const double normal = std::abs(b.height - a.height);
  const double along = edge_length(tangential<D>(e, a.normal, ma), tangential<D>(e, b.normal, mb));
  return normal <= kTan * along || along <= kTan * normal;
}

template <int D>
struct Tally {
  std::int64_t points = 0, on_level = 0, on_wall = 0, edges = 0, aligned = 0;
  CompensatedSum offset, area;
};

template <int D>
Tally<D> join(Tally<D> a, const Tally<D>& b) {
  a.points += b.points;
  a.on_level += b.on_level;
  a.on_wall += b.on_wall;
  a.edges += b.edges;
  a.aligned += b.aligned;
  a.offset.add(b.offset);
  a.area.add(b.area);
  return a;
}

template <int D>
Tally<D> tally_points(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric,
                      const std::vector<Place<D>>& places, const std::vector<double>& phi) {
  const Incidence cells = incidence(mesh.points.size(), mesh.cells);
  const auto chunk = [&](std::size_t begin, std::size_t end) {
    Tally<D> t;
    std::vector<Index> neighbours;
    for (std::size_t v = begin; v < end; ++v) {
      const Place<D>& p = places[v];
      if (!p.in_layers || cells.of(v).empty()) continue;
      ++t.points;
      t.offset.add(p.offset);
      t.on_level += p.offset <= kOnLevel;
      // Level 0 may also be that of a face of the domain.
      t.on_wall += p.offset <= kOnLevel && std::abs(phi[v]) * metric[v].length(p.normal) <= kOnLevel;
      upper_neighbours<D>(mesh, cells, v, neighbours);
      for (const Index w : neighbours) {
        if (!places[w].in_layers) continue;
        ++t.edges;
        t.aligned += is_aligned<D>(mesh.points[w] - mesh.points[v], p, metric[v], places[w], metric[w]);
      }
    }
    return t;
  };
  return reduce(mesh.points.size(), Tally<D>{}, chunk, join<D>, kGrain);
}

/// Area of the mesh's wall in the tangential part of the metric.
template <int D>
Tally<D> measure_wall(const Mesh<D>& mesh, const AdaptMetric<D>& field, const std::vector<double>& phi) {
  const auto chunk = [&](std::size_t begin, std::size_t end) {
    Tally<D> t;
    for (std::size_t c = begin; c < end; ++c) {
      const ZeroPiece<D> piece = zero_piece<D>(mesh, phi, c);
      const Vec<D> area = piece.count > 0 ? piece.area() : Vec<D>(Vec<D>::Zero());
      if (!(area.norm() > 0.0)) continue;
      const Vec<D> center = piece.centroid();
      const auto level = field.level(center, 0.0);
      const Metric<D> m = level ? level->metric : field.at(center, 0.0);
      const Vec<D> normal = level ? level->normal : Vec<D>(area.normalized());
      t.area.add(area.norm() * m.sqrt_det() * m.size_along(normal));
    }
    return t;
  };
  return reduce(mesh.cells.size(), Tally<D>{}, chunk, join<D>, kGrain);
}

double share(std::int64_t part, double whole) {
  return whole > 0.0 ? static_cast<double>(part) / whole : 0.0;
}

}  // namespace

double LayerScore::on_level_share() const { return share(on_level, static_cast<double>(points)); }
double LayerScore::wall_share() const { return share(on_wall, ideal_on_wall); }
double LayerScore::aligned_share() const { return share(aligned, static_cast<double>(edges)); }

template <int D>
std::vector<double> wall_distances(const Mesh<D>& mesh, const AdaptMetric<D>& field) {
  if (mesh.points.empty() || !field.wall_distance(mesh.points.front())) return {};
  std::vector<double> phi(mesh.points.size());
  for_each_index(
      phi.size(), [&](std::size_t i) { phi[i] = *field.wall_distance(mesh.points[i]); }, 256);
  return phi;
}

template <int D>
LayerScore score_layers(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric,
                        const AdaptMetric<D>& field, const std::vector<double>& phi,
                        std::vector<double>* offsets) {
  const std::vector<Place<D>> places = places_of<D>(mesh, field);
  if (offsets != nullptr) {
    offsets->resize(places.size());
    for_each_index(places.size(),
                   [&](std::size_t i) { (*offsets)[i] = places[i].in_layers ? places[i].offset : -1.0; });
  }
  const Tally<D> points = tally_points<D>(mesh, metric, places, phi);
  LayerScore s;
  s.dimension = D;
  if (points.points == 0) return s;
  s.points = points.points;
  s.on_level = points.on_level;
  s.on_wall = points.on_wall;
  s.mean_offset = points.offset.value() / static_cast<double>(points.points);
  s.edges = points.edges;
  s.aligned = points.aligned;
  constexpr double kPointsPerArea = D == 2 ? 1.0 : 1.1547005383792517;
  s.ideal_on_wall = kPointsPerArea * measure_wall<D>(mesh, field, phi).area.value();
  return s;
}

template std::vector<double> wall_distances(const Mesh<2>&, const AdaptMetric<2>&);
template std::vector<double> wall_distances(const Mesh<3>&, const AdaptMetric<3>&);
template LayerScore score_layers(const Mesh<2>&, const std::vector<Metric<2>>&, const AdaptMetric<2>&,
                                 const std::vector<double>&, std::vector<double>*);
template LayerScore score_layers(const Mesh<3>&, const std::vector<Metric<3>>&, const AdaptMetric<3>&,
                                 const std::vector<double>&, std::vector<double>*);

}  // namespace lamina
