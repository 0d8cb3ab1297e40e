// Every operator follows one pattern: candidates are listed in a fixed order (worst first, ties by index),
// each is turned into a cavity and a point, and the cavity operator decides by one rule: the new worst
// quality must exceed min(floor, old worst), volumes stay positive, new lengths stay in a window, and
// boundary vertices stay on their planes. A cavity whose star fails at one facet takes in the cell behind
// that facet and tries again. One exception: the split of an edge longer than 2 may go down to 0.4 of the
// floor.
#include "mesh/adapt/operators.h"

#include <algorithm>
#include <cmath>

namespace lamina::adapt_detail {
namespace {

// q^-power, bounded where q is next to nothing.
double badness(double q, int power) {
  const double inverse = 1.0 / std::max(q, 0.01);
  double result = 1.0;
  for (int i = 0; i < power; ++i) result *= inverse;
  return result;
}

}  // namespace

template <int D>
typename Operators<D>::Vertex Operators<D>::make_vertex(const Vec<D>& x, TagSet tags) const {
  Vertex p;
  p.x = x;
  p.metric = field_.at(x, size_floor_);
  p.density = p.metric.sqrt_det();
  p.tags = tags;
  return p;
}

// Lists active edges with length below `low` or above `high`, each once.
template <int D>
void Operators<D>::collect_edges(double low, double high) {
  edges_.clear();
  const double low2 = low * low;
  const double high2 = high * high;
  for (Index c = 0; c < static_cast<Index>(mesh_.cells.size()); ++c) {
    if (!mesh_.alive(c)) continue;
    for (const auto& pair : kCellEdges<D>) {
      Index a = mesh_.cells[c].v[pair[0]];
      Index b = mesh_.cells[c].v[pair[1]];
      if (!mesh_.active(a) && !mesh_.active(b)) continue;
      if (a > b) std::swap(a, b);
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
                                     double relax) {
  for (int k = 0; k <= rules.enlargements; ++k) {
    const double floor = std::min(relax * rules.floor, cavity_.worst_quality());
    if (cavity_.propose(p, id, floor, removed)) return true;
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
  const Vertex p = make_vertex(a.x + t * d, cavity_.edge_tags());
  // A far too long edge may pin bad cells that only its split frees, at first at the price of quality and of
  // short edges, which the next sweeps mend.
  constexpr double kFarTooLong = 2.0;
  const bool far_too_long = e.length > kFarTooLong;
  const double shortest = far_too_long ? 0.4 * rules.shortest_new : rules.shortest_new;
  const auto too_short = [&](Index w) {
    return edge_length<D>(p.x, p.metric, mesh_.vertices[w].x, mesh_.vertices[w].metric) < shortest;
  };
  list_vertices(neighbors_);
  if (std::any_of(neighbors_.begin(), neighbors_.end(), too_short)) {
    ++stats.rejected_length;
    return false;
  }
  if (!propose_enlarging(p, kNone, kNone, rules, far_too_long ? 0.4 : 1.0)) {
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

// Whether a may slide along a-b without leaving its planes: the edge must lie in all of them.
template <int D>
bool Operators<D>::may_collapse(Index a, Index b, Index cell) {
  const Vertex& va = mesh_.vertices[a];
  if (va.frozen) return false;
  if (va.tags == 0) return true;
  if ((va.tags & ~mesh_.vertices[b].tags) != 0) return false;
  return cavity_.set_shell(cell, a, b) && (va.tags & ~cavity_.edge_tags()) == 0;
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
  if (!propose_enlarging(p, b, a, rules, 1.0)) {
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

// Vertices whose star differs from what is there and from each other's. For a shell: its ring; a ring of
// three closes to one triangle whichever vertex is taken. For a pair of cells: one of the two apexes.
template <int D>
void Operators<D>::list_apexes(const std::array<Index, D + 1>& v, int move, std::vector<Index>& apexes) {
  apexes.clear();
  constexpr int kEdges = static_cast<int>(kCellEdges<D>.size());
  if (move >= kEdges) {
    apexes.push_back(v[move - kEdges]);
    return;
  }
  const Index a = v[kCellEdges<D>[move][0]];
  const Index b = v[kCellEdges<D>[move][1]];
  list_vertices(apexes);
  std::erase_if(apexes, [&](Index w) { return w == a || w == b; });
  const bool closed = cavity_.edge_tags() == 0;
  if (closed && (D == 2 || apexes.size() == 3)) apexes.resize(1);
}

// Tries every shell and facet pair of a bad cell, starred from each possible apex; the best proposal is
// carried out.
template <int D>
bool Operators<D>::swap_around(Index c, const Rules& rules) {
  OperatorStats& stats = stats_[kSwap];
  const auto cell = mesh_.cells[c];
  double best = 0.0;
  int best_move = -1;
  Index best_vertex = kNone;
  constexpr int kEdges = static_cast<int>(kCellEdges<D>.size());
  const auto set = [&](int move) {
    if (move < kEdges)
      return cavity_.set_shell(c, cell.v[kCellEdges<D>[move][0]], cell.v[kCellEdges<D>[move][1]]);
    if (cell.n[move - kEdges] < 0) return false;
    cavity_.set_pair(c, move - kEdges);
    return true;
  };
  std::vector<Index> candidates;
  for (int move = 0; move < (D == 3 ? kEdges + D + 1 : kEdges); ++move) {
    if (!set(move)) continue;
    // Worst cells come first, so a shell whose worst cell is another one has been tried already.
    const double old = cavity_.worst_quality();
    if (old < cell.quality) continue;
    list_apexes(cell.v, move, candidates);
    for (const Index v : candidates) {
      ++stats.tried;
      const double least = std::max(old * 1.02, best);
      if (!cavity_.propose(mesh_.vertices[v], v, least)) continue;
      double longest = 0.0;
      for (const Index w : cavity_.link())
        if (w != v) longest = std::max(longest, mesh_.length(v, w));
      if (longest > rules.longest_new) continue;
      best = cavity_.proposed_worst();
      best_move = move;
      best_vertex = v;
    }
  }
  if (best_move < 0) return false;
  set(best_move);
  const Vertex p = mesh_.vertices[best_vertex];
  cavity_.propose(p, best_vertex, 0.0);
  cavity_.commit(p, best_vertex);
  ++stats.accepted;
  return true;
}

// Active cells below a quality, worst first.
template <int D>
std::vector<std::pair<double, Index>> Operators<D>::bad_cells(double below) const {
  std::vector<std::pair<double, Index>> bad;
  for (Index c = 0; c < static_cast<Index>(mesh_.cells.size()); ++c) {
    const auto& cell = mesh_.cells[c];
    if (!mesh_.alive(c) || cell.quality >= below) continue;
    if (std::any_of(cell.v.begin(), cell.v.end(), [&](Index v) { return mesh_.active(v); }))
      bad.emplace_back(cell.quality, c);
  }
  std::sort(bad.begin(), bad.end());
  return bad;
}

template <int D>
std::int64_t Operators<D>::swap_sweep(const Rules& rules) {
  std::int64_t done = 0;
  for (const auto& [quality, c] : bad_cells(rules.swap_below))
    if (mesh_.alive(c) && mesh_.cells[c].quality == quality && swap_around(c, rules)) ++done;
  return done;
}

// Mean of the apexes that would make each cell of the ball regular, in the metric of a, weighted by 1 /
// quality.
template <int D>
Vec<D> Operators<D>::ideal_step(Index a, int power) const {
  const Vertex& va = mesh_.vertices[a];
  const double height = D == 3 ? std::sqrt(2.0 / 3.0) : std::sqrt(0.75);
  Vec<D> sum = Vec<D>::Zero();
  double weights = 0.0;
  for (const Index c : cavity_.cells()) {
    const auto& cell = mesh_.cells[c];
    const int i = mesh_.local_index(c, a);
    std::array<Vec<D>, D> y;
    Vec<D> center = Vec<D>::Zero();
    for (int k = 0; k < D; ++k) {
      y[k] = va.metric.map(mesh_.vertices[cell.v[kCellFacets<D>[i][k]]].x - va.x);
      center += y[k] / D;
    }
    Vec<D> normal;  // out of the cell
    if constexpr (D == 2) {
      normal = Vec2(y[1][1] - y[0][1], y[0][0] - y[1][0]);
    } else {
      normal = (y[1] - y[0]).cross(y[2] - y[0]);
    }
    const double norm = normal.norm();
    if (norm == 0.0) continue;
    const double w = badness(cell.quality, power);
    sum += w * (center - normal * (height / norm));
    weights += w;
  }
  if (weights == 0.0) return sum;
  return va.metric.factor().template triangularView<Eigen::Upper>().solve(Vec<D>(sum / weights));
}

// Fills qualities_ with those of the cells of the ball of a once a is replaced by p; false as soon as one is
// not above the floor or the badness sums up to the limit.
template <int D>
bool Operators<D>::improves_ball(Index a, const Vertex& p, double floor, double limit, int power) {
  qualities_.clear();
  double sum = 0.0;
  for (const Index c : cavity_.cells()) {
    std::array<const Vertex*, D + 1> w;
    for (int i = 0; i <= D; ++i) {
      const Index v = mesh_.cells[c].v[i];
      w[i] = v == a ? &p : &mesh_.vertices[v];
    }
    const double q = mesh_.quality(w);
    sum += badness(q, 2 * power);
    if (!(q > floor) || sum >= limit) return false;
    qualities_.push_back(q);
  }
  return true;
}

template <int D>
bool Operators<D>::smooth(Index a, const Rules& rules, int power) {
  OperatorStats& stats = stats_[kSmooth];
  ++stats.tried;
  cavity_.set_ball(a);
  Vec<D> step = ideal_step(a, power);
  const TagSet tags = mesh_.vertices[a].tags;
  // Twice, so that the step is orthogonal to all planes even where two of them are not orthogonal.
  for (int repeat = 0; repeat < 2; ++repeat)
    for (int t = 1; t < 32; ++t)
      if (tags & tag_bit(t)) step -= mesh_.normals[t].dot(step) * mesh_.normals[t];
  if (mesh_.vertices[a].metric.length(step) < 1e-3) return false;
  double worst = 1.0;
  double sum = 0.0;
  for (const Index c : cavity_.cells()) {
    const double q = mesh_.cells[c].quality;
    worst = std::min(worst, q);
    sum += badness(q, 2 * power);
  }
  const double floor = std::max(std::min(rules.floor, worst), kSignIsSafe);
  constexpr int kBackoffs = 3;
  constexpr double kWorthwhile = 0.995;  // smaller gains would keep the whole mesh moving for ever
  double fraction = 1.0;
  for (int k = 0; k < kBackoffs; ++k, fraction *= 0.5) {
    // The metric of the old place tells most failures, without the price of a new one.
    Vertex p = mesh_.vertices[a];
    p.x += fraction * step;
    if (!improves_ball(a, p, floor, kWorthwhile * sum, power)) continue;
    p = make_vertex(p.x, tags);
    p.cell = mesh_.vertices[a].cell;
    if (!improves_ball(a, p, floor, kWorthwhile * sum, power)) continue;
    mesh_.vertices[a] = p;
    for (std::size_t i = 0; i < qualities_.size(); ++i) {
      auto& cell = mesh_.cells[cavity_.cells()[i]];
      cell.quality = qualities_[i];
      for (const Index v : cell.v) mesh_.vertices[v].changed = mesh_.pass;
    }
    ++stats.accepted;
    return true;
  }
  ++stats.rejected_quality;
  return false;
}

template <int D>
std::int64_t Operators<D>::smooth_sweep(const Rules& rules) {
  std::int64_t done = 0;
  for (Index a = 0; a < static_cast<Index>(mesh_.vertices.size()); ++a) {
    const Vertex& v = mesh_.vertices[a];
    if (v.cell >= 0 && !v.frozen && mesh_.active(a) && smooth(a, rules, 1)) ++done;
  }
  return done;
}

template <int D>
bool Operators<D>::repair(Index c, const Rules& rules) {
  OperatorStats& stats = stats_[kRepair];
  ++stats.tried;
  if (swap_around(c, rules)) return true;
  const auto cell = mesh_.cells[c];
  constexpr int kSharp = 4;
  for (const Index a : cell.v)
    if (!mesh_.vertices[a].frozen && smooth(a, rules, kSharp) && mesh_.cells[c].quality > cell.quality)
      return true;
  Rules strict = rules;
  strict.floor = 1.0;        // min(floor, old worst) is then the old worst: every repair must lift it
  strict.longest_new = 2.5;  // around a bad cell edges are too long already
  for (const auto& e : kCellEdges<D>) {
    for (const auto& [a, b] : {std::pair{cell.v[e[0]], cell.v[e[1]]}, std::pair{cell.v[e[1]], cell.v[e[0]]}})
      if (may_collapse(a, b, c) && collapse(a, b, strict)) return true;
  }
  strict.shortest_new = 0.4;
  for (const auto& e : kCellEdges<D>)
    if (split({0.0, cell.v[e[0]], cell.v[e[1]], c}, strict)) return true;
  return false;
}

template <int D>
std::int64_t Operators<D>::repair_sweep(const Rules& rules, double below) {
  std::int64_t done = 0;
  for (const auto& [quality, c] : bad_cells(below))
    if (mesh_.alive(c) && mesh_.cells[c].quality == quality && repair(c, rules)) ++done;
  stats_[kRepair].accepted += done;
  return done;
}

template class Operators<2>;
template class Operators<3>;

}  // namespace lamina::adapt_detail
