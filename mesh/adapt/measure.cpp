#include "mesh/adapt/measure.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace lamina::adapt_detail {
namespace {

/// An edge in the metrics of its two ends; its length lies between the two, which settles most questions
/// without a logarithm.
struct EdgeInMetric {
  double a2, b2;  // squared

  [[nodiscard]] double length() const { return edge_length(std::sqrt(a2), std::sqrt(b2)); }
  [[nodiscard]] bool is_within(double low, double high) const {
    if (std::min(a2, b2) >= low * low && std::max(a2, b2) <= high * high) return true;
    if (std::max(a2, b2) < low * low || std::min(a2, b2) > high * high) return false;
    const double l = length();
    return l >= low && l <= high;
  }
  [[nodiscard]] bool is_unit() const { return is_within(kUnitMin, kUnitMax); }
};

template <int D>
EdgeInMetric edge_in_metric(const GlobalMesh<D>& mesh, Index a, Index b) {
  const Vec<D> e = mesh.x[b] - mesh.x[a];
  return {mesh.metric[a].map(e).squaredNorm(), mesh.metric[b].map(e).squaredNorm()};
}

/// The largest value over all edges; `value(a, b, largest)` may return anything below `largest` when it is
/// not above.
template <int D, class Value>
double largest_over_edges(const GlobalMesh<D>& mesh, Value&& value) {
  return reduce(
      mesh.cells.size(), 0.0,
      [&](std::size_t begin, std::size_t end) {
        double largest = 0.0;
        for (std::size_t c = begin; c < end; ++c)
          for (const auto& e : kCellEdges<D>)
            largest = std::max(largest, value(mesh.cells[c][e[0]], mesh.cells[c][e[1]], largest));
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

template <int D, class Predicate>
std::vector<Index> cells_where(const GlobalMesh<D>& mesh, Predicate&& holds) {
  std::vector<std::uint8_t> chosen(mesh.cells.size());
  for_each_index(mesh.cells.size(), [&](std::size_t c) { chosen[c] = holds(c); });
  std::vector<Index> cells;
  for (std::size_t c = 0; c < chosen.size(); ++c)
    if (chosen[c]) cells.push_back(static_cast<Index>(c));
  return cells;
}

template <int D>
double quality_of(double energy) {
  return D == 2 ? 1.0 / energy : 1.0 / cube_root(energy * energy);
}

}  // namespace

template <int D>
void evaluate_metric(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, double floor, int now) {
  mesh.metric.resize(mesh.x.size());
  mesh.changed.resize(mesh.x.size(), now);
  mesh.level.resize(mesh.x.size(), kNoLevel);
  for_each_index(
      mesh.x.size(),
      [&](std::size_t v) {
        const Metric<D> m = field.at(mesh.x[v], floor);
        if (m.tensor() != mesh.metric[v].tensor()) mesh.changed[v] = now;
        mesh.metric[v] = m;
      },
      256);
  mesh.energy.resize(mesh.cells.size());
  for_each_index(mesh.cells.size(), [&](std::size_t c) {
    std::array<const Vec<D>*, D + 1> x;
    int finest = 0;
    for (int i = 0; i <= D; ++i) {
      const auto& v = mesh.cells[c];
      x[i] = &mesh.x[v[i]];
      if (mesh.metric[v[i]].sqrt_det() > mesh.metric[v[finest]].sqrt_det()) finest = i;
    }
    mesh.energy[c] = shape_energy<D>(x, mesh.metric[mesh.cells[c][finest]]);
  });
}

template <int D>
AdaptStep measure(const GlobalMesh<D>& mesh) {
  struct Sums {
    std::int64_t far = 0;
    double quality = 0.0, worst = 1.0;
  };
  const Sums sums = reduce(
      mesh.cells.size(), Sums{},
      [&](std::size_t begin, std::size_t end) {
        Sums s;
        for (std::size_t c = begin; c < end; ++c) {
          const double q = quality_of<D>(mesh.energy[c]);
          s.quality += q;
          s.worst = std::min(s.worst, q);
          for (const auto& e : kCellEdges<D>)
            s.far += !edge_in_metric(mesh, mesh.cells[c][e[0]], mesh.cells[c][e[1]]).is_within(0.5, 2.0);
        }
        return s;
      },
      [](const Sums& a, const Sums& b) {
        return Sums{a.far + b.far, a.quality + b.quality, std::min(a.worst, b.worst)};
      });
  const auto cells = static_cast<double>(mesh.cells.size());
  AdaptStep step;
  step.cells = static_cast<std::int64_t>(mesh.cells.size());
  step.points = static_cast<std::int64_t>(mesh.x.size());
  step.unit_share = unit_share(mesh);
  step.far_share = static_cast<double>(sums.far) / (cells * static_cast<double>(kCellEdges<D>.size()));
  step.quality_min = sums.worst;
  step.quality_mean = sums.quality / cells;
  return step;
}

template <int D>
double unit_share(const GlobalMesh<D>& mesh) {
  const std::int64_t unit = reduce(
      mesh.cells.size(), std::int64_t{0},
      [&](std::size_t begin, std::size_t end) {
        std::int64_t count = 0;
        for (std::size_t c = begin; c < end; ++c)
          for (const auto& e : kCellEdges<D>)
            count += edge_in_metric(mesh, mesh.cells[c][e[0]], mesh.cells[c][e[1]]).is_unit();
        return count;
      },
      [](std::int64_t a, std::int64_t b) { return a + b; });
  return static_cast<double>(unit) / static_cast<double>(mesh.cells.size() * kCellEdges<D>.size());
}

template <int D>
double longest_in_space(const GlobalMesh<D>& mesh) {
  return largest_over_edges(mesh, [&](Index a, Index b, double) { return (mesh.x[b] - mesh.x[a]).norm(); });
}

template <int D>
double longest_in_metric(const GlobalMesh<D>& mesh) {
  return largest_over_edges(mesh, [&](Index a, Index b, double longest) {
    const EdgeInMetric e = edge_in_metric(mesh, a, b);
    return std::max(e.a2, e.b2) <= longest * longest ? 0.0 : e.length();
  });
}

template <int D>
std::vector<Index> bad_cells(const GlobalMesh<D>& mesh, double quality) {
  const double above = energy_of<D>(quality);
  return cells_where(mesh, [&](std::size_t c) { return mesh.energy[c] > above; });
}

template <int D>
std::vector<Index> loose_cells(const GlobalMesh<D>& mesh, int since) {
  return cells_where(mesh, [&](std::size_t c) {
    return std::any_of(kCellEdges<D>.begin(), kCellEdges<D>.end(), [&](const auto& e) {
      const Index a = mesh.cells[c][e[0]];
      const Index b = mesh.cells[c][e[1]];
      return (mesh.changed[a] >= since || mesh.changed[b] >= since) && !edge_in_metric(mesh, a, b).is_unit();
    });
  });
}

template void evaluate_metric(GlobalMesh<2>&, const AdaptMetric<2>&, double, int);
template void evaluate_metric(GlobalMesh<3>&, const AdaptMetric<3>&, double, int);
template AdaptStep measure(const GlobalMesh<2>&);
template AdaptStep measure(const GlobalMesh<3>&);
template double unit_share(const GlobalMesh<2>&);
template double unit_share(const GlobalMesh<3>&);
template double longest_in_space(const GlobalMesh<2>&);
template double longest_in_space(const GlobalMesh<3>&);
template double longest_in_metric(const GlobalMesh<2>&);
template double longest_in_metric(const GlobalMesh<3>&);
template std::vector<Index> bad_cells(const GlobalMesh<2>&, double);
template std::vector<Index> bad_cells(const GlobalMesh<3>&, double);
template std::vector<Index> loose_cells(const GlobalMesh<2>&, int);
template std::vector<Index> loose_cells(const GlobalMesh<3>&, int);

}  // namespace lamina::adapt_detail
