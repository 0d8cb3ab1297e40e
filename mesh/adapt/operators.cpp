// Every operator follows one pattern: candidates are listed in a fixed order (worst first, ties by index),
// each is turned into a cavity and a point, and the cavity operator decides by one rule: no new cell is worse
// than both the floor and the old worst, volumes stay positive, new lengths stay in a window, and boundary
// vertices stay on their pieces. A cavity whose star fails at one facet takes in the cell behind that facet
// and tries again. One exception: the split of an edge longer than 2 may go down to 0.4 of the floor. Where
// vertices are aligned, a first move onto a level may also raise the energy of the ball.
#include "mesh/adapt/operators.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace lamina::adapt_detail {

template <int D>
void Operators<D>::evaluate(Vertex& p) const {
  p.metric = field_.at(p.x, size_floor_);
  p.density = p.metric.sqrt_det();
}

// Of the pieces of p, which is no corner, across its line where it is on one; of three that meet in a line
// the two that differ most.
template <int D>
typename Operators<D>::Normals Operators<D>::normals_at(const Vertex& p) const {
  Normals found;
  if constexpr (D == 3) {
    if (const int line = p.pieces.line()) {
      const Vec3 along = mesh_.shape->tangent(line, p.x);
      int least = 0;
      along.cwiseAbs().minCoeff(&least);
      found.n[0] = (Vec3::Unit(least) - along[least] * along).normalized();
      found.n[1] = along.cross(found.n[0]);
      found.count = 2;
      return found;
    }
  }
  for (; found.count < std::min(D, p.pieces.size()); ++found.count)
    found.n[found.count] = mesh_.shape->normal(p.pieces[found.count], p.x);
  if (found.count < D || D == 2) return found;
  const auto along = [&](int k, int l) { return std::abs(found.n[k].dot(found.n[l])); };
  found.count = 2;
  if (along(0, 2) < along(0, 1) && along(0, 2) <= along(1, 2))
    found.n[1] = found.n[2];
  else if (along(1, 2) < along(0, 1))
    found.n[0] = found.n[2];
  return found;
}

// The part of v that is tangential to all pieces of p.
template <int D>
Vec<D> Operators<D>::within_pieces(Vec<D> v, const Vertex& p) const {
  constexpr double kParallel = 1e-9;
  std::array<Vec<D>, D> normals;  // orthonormal
  int count = 0;
  const Normals given = normals_at(p);
  for (int k = 0; k < given.count; ++k) {
    Vec<D> n = given.n[k];
    for (int i = 0; i < count; ++i) n -= normals[i].dot(n) * normals[i];
    if (count > 0 && n.norm() <= kParallel) continue;
    if (count > 0) n.normalize();
    normals[count++] = n;
  }
  constexpr int kTwice = 2;  // so that rounding leaves nothing
  for (int repeat = 0; repeat < kTwice; ++repeat)
    for (int i = 0; i < count; ++i) v -= normals[i].dot(v) * normals[i];
  return v;
}

template <int D>
void Operators<D>::slide(Vertex& p, const Vec<D>& step) const {
  p.x += within_pieces(step, p);
  p.x = mesh_.shape->project(p.pieces, p.x);
}

template <int D>
bool Operators<D>::place_on_level(Vertex& p) const {
  const std::optional<Level<D>> level = field_.level(p.x, size_floor_);
  if (!level) return false;
  if (p.pieces.empty()) {
    p.x += level->way;
    p.metric = level->metric;
    p.density = p.metric.sqrt_det();
    p.level = level->number;
    return true;
  }
  if (mesh_.shape->projects(p.pieces)) return false;  // which stays where it is
  const Vec<D> direction = within_pieces(level->normal, p);
  const double along = direction.squaredNorm();
  constexpr double kAlongPlanes = 0.5;  // a level that a plane cuts at a small angle is out of reach
  if (along < kAlongPlanes) return false;
  p.x += level->way.dot(level->normal) / along * direction;
  evaluate(p);
  p.level = level->number;
  return true;
}

// Lists edges changed since the last such sweep with length below `low` or above `high`, each once.
template <int D>
void Operators<D>::collect_edges(double low, double high) {
  // An edge comes once for each of its cells, most of them soon after the first.
  constexpr std::size_t kRemembered = 4096;
  std::vector<std::uint64_t> seen(kRemembered, ~std::uint64_t{0});
  edges_.clear();
  const double low2 = low * low;
  const double high2 = high * high;
  for (Index c = 0; c < static_cast<Index>(mesh_.cells.size()); ++c) {
    if (!mesh_.alive(c)) continue;
    for (const auto& pair : kCellEdges<D>) {
      Index a = mesh_.cells[c].v[pair[0]];
      Index b = mesh_.cells[c].v[pair[1]];
      if (!changed(a) && !changed(b)) continue;
      if (a > b) std::swap(a, b);
      const std::uint64_t key = static_cast<std::uint64_t>(a) << 32U | static_cast<std::uint32_t>(b);
      if (std::exchange(seen[(key * 0x9E3779B97F4A7C15ULL) >> 52U], key) == key) continue;
      const Vec<D> e = mesh_.vertices[b].x - mesh_.vertices[a].x;
      const double la2 = mesh_.vertices[a].metric.map(e).squaredNorm();
      const double lb2 = mesh_.vertices[b].metric.map(e).squaredNorm();
      // The logarithmic mean lies between the two, which settles most edges without a logarithm.
      if (std::min(la2, lb2) >= low2 && std::max(la2, lb2) <= high2) continue;
      const double l = edge_length(std::sqrt(la2), std::sqrt(lb2));
      if (l < low || l > high) edges_.push_back({l, a, b, c});
    }
  }
  std::sort(edges_.begin(), edges_.end(), [](const Edge& s, const Edge& t) {
    return s.a != t.a ? s.a < t.a : s.b != t.b ? s.b < t.b : s.cell < t.cell;
  });
  const auto last = std::unique(edges_.begin(), edges_.end(),
                                [](const Edge& s, const Edge& t) { return s.a == t.a && s.b == t.b; });
  edges_.erase(last, edges_.end());
}

// A cell that holds the edge a-b: `hint` if it still does, else found around a vertex that is not frozen.
template <int D>
Index Operators<D>::find_cell(Index a, Index b, Index hint) {
  if (mesh_.alive(hint) && mesh_.local_index(hint, a) >= 0 && mesh_.local_index(hint, b) >= 0) return hint;
  if (mesh_.vertices[a].cell < 0 || mesh_.vertices[b].cell < 0) return kNone;
  if (mesh_.vertices[a].frozen) std::swap(a, b);
  if (mesh_.vertices[a].frozen) return kNone;
  cavity_.set_ball(a);
  for (const Index c : cavity_.cells())
    if (mesh_.local_index(c, b) >= 0) return c;
  return kNone;
}

// The vertices of the cavity, each once.
template <int D>
void Operators<D>::list_vertices(std::vector<Index>& out) {
  const std::uint32_t seen = ++mesh_.vertex_stamp;
  out.clear();
  for (const Index c : cavity_.cells())
    for (const Index v : mesh_.cells[c].v)
      if (std::exchange(mesh_.vertices[v].mark, seen) != seen) out.push_back(v);
}

template <int D>
bool Operators<D>::propose_enlarging(const Vertex& p, Index id, Index removed, const Rules& rules,
                                     double floor) {
  const double ceiling = energy_of<D>(floor);
  for (int k = 0; k <= rules.enlargements; ++k) {
    if (cavity_.propose(p, id, std::max(ceiling, cavity_.worst_energy()), removed)) return true;
    if (cavity_.blocking_cell() == kNone) return false;
    if (!cavity_.grow(cavity_.blocking_cell(), cavity_.blocking_facet())) return false;
  }
  return false;
}

template <int D>
bool Operators<D>::split(const Edge& e, const Rules& rules) {
  OperatorStats& stats = stats_[kSplit];
  ++stats.tried;
  if (!cavity_.set_shell(e.cell, e.a, e.b)) {
    ++stats.rejected_class;
    return false;
  }
  const Vertex& a = mesh_.vertices[e.a];
  const Vertex& b = mesh_.vertices[e.b];
  const Vec<D> d = b.x - a.x;
  // Halves the metric length when the size varies linearly along the edge.
  const double t = std::clamp(1.0 / (1.0 + std::sqrt(a.metric.length(d) / b.metric.length(d))), 0.25, 0.75);
  Vertex p;
  p.pieces = cavity_.edge_pieces();
  p.x = mesh_.shape->project(p.pieces, a.x + t * d);
  // A far too long edge may pin bad cells that only its split frees, at first at the price of quality and of
  // short edges, which the next sweeps mend.
  constexpr double kFarTooLong = 2.0;
  const bool far_too_long = e.length > kFarTooLong;
  const double shortest = far_too_long ? 0.4 * rules.shortest_new : rules.shortest_new;
  list_vertices(neighbors_);
  // The metrics of the ends tell most of the short edges that would come about, without the price of a new
  // one.
  constexpr double kSurely = 0.8;
  const auto surely_too_short = [&](Index w) {
    const Vec<D> way = mesh_.vertices[w].x - p.x;
    const double here = 0.5 * (a.metric.length(way) + b.metric.length(way));
    return edge_length(here, mesh_.vertices[w].metric.length(way)) < kSurely * shortest;
  };
  if (D == 3 && !rules.align && std::any_of(neighbors_.begin(), neighbors_.end(), surely_too_short)) {
    ++stats.rejected_length;
    return false;
  }
  if (!(rules.align && place_on_level(p))) evaluate(p);
  const auto too_short = [&](Index w) {
    return edge_length<D>(p.x, p.metric, mesh_.vertices[w].x, mesh_.vertices[w].metric) < shortest;
  };
  if (std::any_of(neighbors_.begin(), neighbors_.end(), too_short)) {
    ++stats.rejected_length;
    return false;
  }
  if (!propose_enlarging(p, kNone, kNone, rules, far_too_long ? 0.4 * rules.floor : rules.floor)) {
    ++stats.rejected_quality;
    return false;
  }
  if (std::any_of(cavity_.link().begin(), cavity_.link().end(), too_short)) {
    ++stats.rejected_length;
    return false;
  }
  cavity_.commit(p, kNone);
  ++stats.accepted;
  return true;
}

template <int D>
std::int64_t Operators<D>::split_sweep(const Rules& rules) {
  collect_edges(0.0, rules.long_edge);
  std::sort(edges_.begin(), edges_.end(), [](const Edge& s, const Edge& t) {
    return s.length != t.length ? s.length > t.length : s.a != t.a ? s.a < t.a : s.b < t.b;
  });
  std::int64_t done = 0;
  for (Edge& e : edges_) {
    e.cell = find_cell(e.a, e.b, e.cell);
    if (e.cell != kNone && split(e, rules)) ++done;
  }
  return done;
}

// Whether a may slide along a-b without leaving its pieces: the edge must lie in all of them.
template <int D>
bool Operators<D>::may_collapse(Index a, Index b, Index cell) {
  const Vertex& va = mesh_.vertices[a];
  if (va.frozen) return false;
  if (va.pieces.empty()) return true;
  if (!va.pieces.within(mesh_.vertices[b].pieces)) return false;
  return cavity_.set_shell(cell, a, b) && va.pieces.within(cavity_.edge_pieces());
}

template <int D>
bool Operators<D>::collapse(Index a, Index b, const Rules& rules) {
  OperatorStats& stats = stats_[kCollapse];
  ++stats.tried;
  cavity_.set_ball(a);
  const Vertex p = mesh_.vertices[b];
  // Lengths are cheaper than qualities, and settle most cases.
  const auto too_long = [&](Index w) { return w != a && w != b && mesh_.length(b, w) > rules.longest_new; };
  list_vertices(neighbors_);
  if (std::any_of(neighbors_.begin(), neighbors_.end(), too_long)) {
    ++stats.rejected_length;
    return false;
  }
  if (!propose_enlarging(p, b, a, rules, rules.floor)) {
    ++stats.rejected_quality;
    return false;
  }
  if (std::any_of(cavity_.link().begin(), cavity_.link().end(), too_long)) {
    ++stats.rejected_length;
    return false;
  }
  cavity_.commit(p, b);
  ++stats.accepted;
  return true;
}

template <int D>
std::int64_t Operators<D>::collapse_sweep(const Rules& rules) {
  collect_edges(rules.short_edge, 1e300);
  std::sort(edges_.begin(), edges_.end(), [](const Edge& s, const Edge& t) {
    return s.length != t.length ? s.length < t.length : s.a != t.a ? s.a < t.a : s.b < t.b;
  });
  std::int64_t done = 0;
  for (const Edge& e : edges_) {
    const Index c = find_cell(e.a, e.b, e.cell);
    if (c == kNone) continue;
    if (may_collapse(e.b, e.a, c) && collapse(e.b, e.a, rules)) {
      ++done;
    } else if (may_collapse(e.a, e.b, c) && collapse(e.a, e.b, rules)) {
      ++done;
    }
  }
  return done;
}

template <int D>
void Operators<D>::sweep(Operator what, const Rules& rules) {
  const auto start = std::chrono::steady_clock::now();
  switch (what) {
    case kCollapse:
      collapse_sweep(rules);
      break;
    case kSplit:
      split_sweep(rules);
      break;
    case kSwap:
      swap_sweep(rules);
      break;
    case kSmooth:
      smooth_sweep(rules);
      break;
    case kRepair:
      repair_sweep(rules);
      break;
    case kStretch:
      stretch_sweep(rules);
      break;
    case kOperatorCount:
      break;
  }
  stats_[what].seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template class Operators<2>;
template class Operators<3>;

}  // namespace lamina::adapt_detail
