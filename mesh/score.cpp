// Cells are scored one by one; edges at their smaller vertex, whose cells give all its neighbours, so that no
// table of edges is needed. Sums run in fixed chunks.
#include "mesh/score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "core/predicates.h"
#include "mesh/topology/incidence.h"
#include "mesh/topology/sum.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr std::size_t kWorst = 20;

template <int D>
using Corners = std::array<Vec<D>, D + 1>;

template <int D>
Corners<D> corners_of(const Mesh<D>& mesh, std::size_t cell) {
  Corners<D> x;
  for (int k = 0; k <= D; ++k) x[k] = mesh.points[mesh.cells[cell][k]];
  return x;
}

/// Longest edge over shortest height, Euclidean.
template <int D>
double aspect_ratio(const Corners<D>& x, double determinant) {
  double longest2 = 0.0;
  for (const auto& [a, b] : kCellEdges<D>) longest2 = std::max(longest2, (x[b] - x[a]).squaredNorm());
  const double longest = std::sqrt(longest2);
  double largest_facet = longest;  // in 2D; in 3D twice the area of the largest face
  if constexpr (D == 3) {
    largest_facet = 0.0;
    for (const auto& f : kCellFacets<3>)
      largest_facet = std::max(largest_facet, (x[f[1]] - x[f[0]]).cross(x[f[2]] - x[f[0]]).norm());
  }
  const double height = std::abs(determinant) / largest_facet;
  return height > 0.0 ? longest / height : std::numeric_limits<double>::infinity();
}

bool worse(const WorstCell& a, const WorstCell& b) {
  return a.quality != b.quality ? a.quality < b.quality : a.cell < b.cell;
}

/// Results over some cells.
struct CellTally {
  CompensatedSum complexity, quality;
  double aspect_max = 0.0;
  std::array<std::int64_t, 10> histogram{};
  std::vector<WorstCell> worst;
  double bar = std::numeric_limits<double>::infinity();  ///< only cells below it can be among the worst

  template <int D>
  void add_worst(Index cell, double q, const Corners<D>& x) {
    WorstCell w{cell, q, Vec3::Zero()};
    for (const Vec<D>& p : x) w.center.template head<D>() += p / (D + 1);
    worst.push_back(w);
    if (worst.size() < 4 * kWorst) return;
    keep_worst();
    bar = worst.back().quality;
  }
  void keep_worst() {
    const std::size_t kept = std::min(kWorst, worst.size());
    std::partial_sort(worst.begin(), worst.begin() + static_cast<std::ptrdiff_t>(kept), worst.end(), worse);
    worst.resize(kept);
  }
};

CellTally join(CellTally a, const CellTally& b) {
  a.complexity.add(b.complexity);
  a.quality.add(b.quality);
  a.aspect_max = std::max(a.aspect_max, b.aspect_max);
  for (std::size_t i = 0; i < a.histogram.size(); ++i) a.histogram[i] += b.histogram[i];
  a.worst.insert(a.worst.end(), b.worst.begin(), b.worst.end());
  a.keep_worst();
  return a;
}

template <int D>
CellTally score_cells(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric,
                      std::vector<double>& aspect) {
  constexpr double kParallelepiped = D == 2 ? 2.0 : 6.0;  // the determinant over the volume of the simplex
  const auto chunk = [&](std::size_t begin, std::size_t end) {
    CellTally tally;
    for (std::size_t i = begin; i < end; ++i) {
      const Corners<D> x = corners_of(mesh, i);
      std::array<const Metric<D>*, D + 1> m;
      double density = 0.0;
      for (int k = 0; k <= D; ++k) {
        m[k] = &metric[mesh.cells[i][k]];
        density += m[k]->sqrt_det();
      }
      const double determinant = orient<D>(x);
      double quality = cell_quality<D>(x, m);
      if (!(quality > -1e300)) quality = -1e300;  // NaN: as bad as can be
      tally.complexity.add(std::abs(determinant) / kParallelepiped * (density / (D + 1)));
      tally.quality.add(quality);
      tally.histogram[static_cast<std::size_t>(std::clamp(std::floor(quality * 10.0), 0.0, 9.0))] += 1;
      aspect[i] = aspect_ratio<D>(x, determinant);
      tally.aspect_max = std::max(tally.aspect_max, aspect[i]);
      if (quality < tally.bar) tally.add_worst<D>(static_cast<Index>(i), quality, x);
    }
    tally.keep_worst();
    return tally;
  };
  return reduce(mesh.cells.size(), CellTally{}, chunk, join, kGrain);
}

/// Results over some edges.
struct EdgeTally {
  std::int64_t edges = 0, points = 0, unit = 0, small = 0, large = 0;
  double min = std::numeric_limits<double>::infinity(), max = 0.0;
  CompensatedSum sum;
  std::array<std::int64_t, Score::kLengthBins.size()> histogram{};

  void add(double length) {
    ++edges;
    unit += length >= kUnitMin && length <= kUnitMax;
    small += length < 0.5;
    large += length > 2.0;
    min = std::min(min, length);
    max = std::max(max, length);
    sum.add(length);
    const auto bin = std::upper_bound(Score::kLengthBins.begin() + 1, Score::kLengthBins.end(), length);
    ++histogram[static_cast<std::size_t>(bin - Score::kLengthBins.begin()) - 1];
  }
};

EdgeTally join_edges(EdgeTally a, const EdgeTally& b) {
  a.edges += b.edges;
  a.points += b.points;
  a.unit += b.unit;
  a.small += b.small;
  a.large += b.large;
  a.min = std::min(a.min, b.min);
  a.max = std::max(a.max, b.max);
  a.sum.add(b.sum);
  for (std::size_t i = 0; i < a.histogram.size(); ++i) a.histogram[i] += b.histogram[i];
  return a;
}

template <int D>
EdgeTally score_edges(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric) {
  const Incidence cells = incidence(mesh.points.size(), mesh.cells);
  const auto chunk = [&](std::size_t begin, std::size_t end) {
    EdgeTally tally;
    std::vector<Index> neighbours;
    for (std::size_t v = begin; v < end; ++v) {
      upper_neighbours<D>(mesh, cells, v, neighbours);
      for (const Index w : neighbours)
        tally.add(edge_length<D>(mesh.points[v], metric[v], mesh.points[w], metric[w]));
      tally.points += !cells.of(v).empty();
    }
    return tally;
  };
  return reduce(mesh.points.size(), EdgeTally{}, chunk, join_edges, kGrain);
}

/// Percentile with linear interpolation between order statistics. Reorders the values.
double percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0.0;
  const double rank = fraction * static_cast<double>(values.size() - 1);
  const auto low = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), low, values.end());
  const double rest = rank - std::floor(rank);
  if (rest == 0.0 || low + 1 == values.end()) return *low;
  return *low + rest * (*std::min_element(low + 1, values.end()) - *low);
}

}  // namespace

template <int D>
Score score(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric) {
  if (metric.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, "a mesh of " + std::to_string(mesh.points.size()) +
                                           " points is scored in " + std::to_string(metric.size()) +
                                           " metrics; one for each point is needed");
  Score s;
  std::vector<double> aspect(mesh.cells.size());
  const CellTally cells = score_cells(mesh, metric, aspect);
  const EdgeTally edges = score_edges(mesh, metric);
  s.cells = static_cast<std::int64_t>(mesh.cells.size());
  s.points = edges.points;
  s.edges = edges.edges;
  s.complexity = cells.complexity.value();
  s.aspect_max = cells.aspect_max;
  s.aspect_p99 = percentile(aspect, 0.99);
  s.quality_histogram = cells.histogram;
  s.worst = cells.worst;
  s.length_histogram = edges.histogram;
  if (s.cells == 0) return s;
  const auto edge_count = static_cast<double>(edges.edges);
  s.quality_min = cells.worst.front().quality;
  s.quality_mean = cells.quality.value() / static_cast<double>(s.cells);
  s.length_min = edges.min;
  s.length_max = edges.max;
  s.length_mean = edges.sum.value() / edge_count;
  s.unit_share = static_cast<double>(edges.unit) / edge_count;
  s.short_share = static_cast<double>(edges.small) / edge_count;
  s.long_share = static_cast<double>(edges.large) / edge_count;
  return s;
}

template Score score<2>(const Mesh<2>&, const std::vector<Metric<2>>&);
template Score score<3>(const Mesh<3>&, const std::vector<Metric<3>>&);

}  // namespace lamina
