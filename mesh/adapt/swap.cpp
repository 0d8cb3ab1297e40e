// Swaps and the repair of the worst cells.
//
// A swap lowers the excess of its cavity, the sum of (shape energy - 1), the same sum that smoothing lowers:
// with one objective the two never undo each other. Accepting by the worst cell alone stalls earlier (mean
// quality lower by .005 on a tilted plane).
#include <algorithm>

#include "mesh/adapt/operators.h"

namespace lamina::adapt_detail {

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
  const bool closed = cavity_.edge_pieces().empty();
  if (closed && (D == 2 || apexes.size() == 3)) apexes.resize(1);
  // Opposite apexes of a ring of four give the same cells; the first two are of one cell, so neighbours.
  if (closed && apexes.size() == 4) apexes.resize(2);
}

// The outer facets of the cavity that an apex of the move can see.
template <int D>
void Operators<D>::list_facets(const std::array<Index, D + 1>& v, int move) {
  constexpr int kEdges = static_cast<int>(kCellEdges<D>.size());
  facet_count_ = 0;
  const auto list = [&](const typename Local::Cell& cell, int i) {
    if (facet_count_ == facets_.size()) facets_.emplace_back();
    SwapFacet& f = facets_[facet_count_++];
    for (int k = 0; k < D; ++k) f.v[k] = cell.v[kCellFacets<D>[i][k]];
    f.piece = is_boundary(cell.n[i]) ? boundary_piece(cell.n[i]) : 0;
    f.finest = nullptr;
  };
  if (move >= kEdges) {  // facets of the first cell contain the apex
    const auto& cell = mesh_.cells[cavity_.cells()[1]];
    for (int i = 0; i <= D; ++i)
      if (cell.n[i] != cavity_.cells()[0]) list(cell, i);
    return;
  }
  const Index a = v[kCellEdges<D>[move][0]];
  const Index b = v[kCellEdges<D>[move][1]];
  for (const Index c : cavity_.cells()) {
    const auto& cell = mesh_.cells[c];
    for (int i = 0; i <= D; ++i)
      if (cell.v[i] == a || cell.v[i] == b || is_boundary(cell.n[i])) list(cell, i);
  }
}

// Energy of the simplex of p and the facet. What does not depend on p is kept for the next apex.
template <int D>
double Operators<D>::star_energy(const Vertex& p, SwapFacet& f) {
  if (f.finest == nullptr) {
    for (int k = 0; k < D; ++k) {
      f.corners[k] = &mesh_.vertices[f.v[k]];
      if (k == 0 || f.corners[k]->density > f.finest->density) f.finest = f.corners[k];
    }
    f.measured = false;
  }
  if (D == 2 || p.density >= f.finest->density) {
    typename Local::Corners w;
    w[0] = &p;
    for (int k = 0; k < D; ++k) w[k + 1] = f.corners[k];
    return Local::energy(w);
  }
  const Metric<D>& m = f.finest->metric;
  if constexpr (D == 3) {
    if (!f.measured) {
      f.measured = true;
      const Vec<D> s = m.map(f.corners[1]->x - f.corners[0]->x);
      const Vec<D> t = m.map(f.corners[2]->x - f.corners[0]->x);
      f.inward = t.cross(s);
      f.sum = s + t;
      f.squares = 3.0 * (s.squaredNorm() + t.squaredNorm()) - 2.0 * s.dot(t);
    }
  }
  const Vec<D> y = m.map(p.x - f.corners[0]->x);
  const double squares = f.squares + 3.0 * y.squaredNorm() - 2.0 * y.dot(f.sum);
  return shape_energy<D>(SimplexMeasure{squares, f.inward.dot(y)});
}

// Whether all cells that vertex v would make with the outer facets are below `worst` and their excess is
// below the limit; most apexes fail at the first or second cell.
template <int D>
bool Operators<D>::may_star(Index v, double worst, double limit) {
  const Vertex& p = mesh_.vertices[v];
  double excess = 0.0;
  for (std::size_t k = 0; k < facet_count_; ++k) {
    SwapFacet& f = facets_[k];
    if ((f.piece != 0 && p.pieces.contains(f.piece)) || std::find(f.v.begin(), f.v.end(), v) != f.v.end())
      continue;
    const double energy = star_energy(p, f);
    excess += energy - 1.0;
    if (!(energy < worst) || excess >= limit) return false;
  }
  return true;
}

// Tries every shell and facet pair of a bad cell, starred from each possible apex; the best proposal is
// carried out.
template <int D>
bool Operators<D>::swap_around(Index c, const Rules& rules) {
  OperatorStats& stats = stats_[kSwap];
  const auto cell = mesh_.cells[c];
  const double ceiling = energy_of<D>(rules.floor);
  double best_gain = 0.0;
  int best_move = -1;
  Index best_vertex = kNone;
  constexpr int kEdges = static_cast<int>(kCellEdges<D>.size());
  // Worst cells come first, so a shell whose worst cell is another one has been tried already.
  const auto set = [&](int move) {
    if (move < kEdges)
      return cavity_.set_shell(c, cell.v[kCellEdges<D>[move][0]], cell.v[kCellEdges<D>[move][1]],
                               cell.energy);
    const Index n = cell.n[move - kEdges];
    if (n < 0 || mesh_.cells[n].energy > cell.energy) return false;
    cavity_.set_pair(c, move - kEdges);
    return true;
  };
  for (int move = 0; move < (D == 3 ? kEdges + D + 1 : kEdges); ++move) {
    if (!set(move)) continue;
    const double worst = std::max(ceiling, cell.energy);
    const double excess = cavity_.excess();
    const double least_gain = rules.least_swap * (excess + static_cast<double>(cavity_.cells().size()));
    list_apexes(cell.v, move, neighbors_);
    list_facets(cell.v, move);
    for (const Index v : neighbors_) {
      ++stats.tried;
      const double limit = excess - std::max(least_gain, best_gain);
      if (!may_star(v, worst, limit)) continue;
      if (!cavity_.propose(mesh_.vertices[v], v, worst, kNone, limit)) continue;
      double longest = 0.0;
      for (const Index w : cavity_.link())
        if (w != v) longest = std::max(longest, mesh_.length(v, w));
      if (longest > rules.longest_new) continue;
      best_gain = excess - cavity_.proposed_excess();
      best_move = move;
      best_vertex = v;
    }
  }
  if (best_move < 0) return false;
  set(best_move);
  const Vertex p = mesh_.vertices[best_vertex];
  cavity_.propose(p, best_vertex, Cavity<D>::kUnbounded);
  cavity_.commit(p, best_vertex);
  ++stats.accepted;
  return true;
}

// Cells below a quality that changed since the last such sweep, worst first.
template <int D>
std::vector<std::pair<double, Index>> Operators<D>::bad_cells(double below) const {
  std::vector<std::pair<double, Index>> bad;
  const double above = energy_of<D>(below);
  for (Index c = 0; c < static_cast<Index>(mesh_.cells.size()); ++c) {
    const auto& cell = mesh_.cells[c];
    if (!mesh_.alive(c) || cell.energy <= above) continue;
    if (std::any_of(cell.v.begin(), cell.v.end(), [&](Index v) { return changed(v); }))
      bad.emplace_back(-cell.energy, c);
  }
  std::sort(bad.begin(), bad.end());
  return bad;
}

template <int D>
std::int64_t Operators<D>::swap_sweep(const Rules& rules) {
  std::int64_t done = 0;
  for (const auto& [minus_energy, c] : bad_cells(rules.swap_below))
    if (mesh_.alive(c) && mesh_.cells[c].energy == -minus_energy && swap_around(c, rules)) ++done;
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
    if (!mesh_.vertices[a].frozen && smooth(a, rules, kSharp) && mesh_.cells[c].energy < cell.energy)
      return true;
  Rules strict = rules;
  strict.floor = 1.0;        // no new cell may then be as bad as the old worst
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
std::int64_t Operators<D>::repair_sweep(const Rules& rules) {
  std::int64_t done = 0;
  for (const auto& [minus_energy, c] : bad_cells(rules.repair_below))
    if (mesh_.alive(c) && mesh_.cells[c].energy == -minus_energy && repair(c, rules)) ++done;
  stats_[kRepair].accepted += done;
  return done;
}

template class Operators<2>;
template class Operators<3>;

}  // namespace lamina::adapt_detail
