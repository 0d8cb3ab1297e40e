#include "mesh/adapt/cavity.h"

#include <algorithm>

#include "core/predicates.h"

namespace lamina::adapt_detail {
namespace {

template <int D>
std::uint64_t ridge_key(const std::array<Index, D + 1>& v, int skip) {
  if constexpr (D == 2) {
    return static_cast<std::uint64_t>(v[3 - skip]);
  } else {
    Index a = v[skip == 1 ? 2 : 1];
    Index b = v[skip == 3 ? 2 : 3];
    if (a > b) std::swap(a, b);
    return static_cast<std::uint64_t>(a) << 32U | static_cast<std::uint32_t>(b);
  }
}

template <int D>
std::uint64_t facet_ridge_key(const std::array<Index, D>& f, int skip) {
  if constexpr (D == 2) {
    return static_cast<std::uint64_t>(f[1 - skip]);
  } else {
    Index a = f[(skip + 1) % 3];
    Index b = f[(skip + 2) % 3];
    if (a > b) std::swap(a, b);
    return static_cast<std::uint64_t>(a) << 32U | static_cast<std::uint32_t>(b);
  }
}

}  // namespace

template <int D>
void Cavity<D>::begin() {
  ++mesh_.stamp;
  cells_.clear();
  edge_pieces_ = {};
}

template <int D>
void Cavity<D>::add(Index c) {
  mesh_.cells[c].mark = mesh_.stamp;
  cells_.push_back(c);
}

template <int D>
void Cavity<D>::set_ball(Index a) {
  begin();
  add(mesh_.vertices[a].cell);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const auto& cell = mesh_.cells[cells_[k]];
    for (int i = 0; i <= D; ++i) {
      const Index n = cell.n[i];
      if (cell.v[i] != a && n >= 0 && mesh_.cells[n].mark != mesh_.stamp) add(n);
    }
  }
}

template <int D>
bool Cavity<D>::set_shell(Index c, Index a, Index b, double worst) {
  begin();
  add(c);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const auto& cell = mesh_.cells[cells_[k]];
    for (int i = 0; i <= D; ++i) {
      if (cell.v[i] == a || cell.v[i] == b) continue;
      const Index n = cell.n[i];
      if (n == kInterface) return false;
      if (is_boundary(n)) {
        edge_pieces_.add(boundary_piece(n));
      } else if (mesh_.cells[n].mark != mesh_.stamp) {
        if (mesh_.cells[n].energy > worst) return false;
        add(n);
      }
      if (const PieceId piece = mesh_.inner_piece(cells_[k], i)) edge_pieces_.add(piece);
    }
  }
  const PieceId line = mesh_.line(a, b);
  if (line != 0) edge_pieces_.add(line);
  return !mesh_.shape->is_required(line);
}

template <int D>
void Cavity<D>::set_pair(Index c, int i) {
  begin();
  add(c);
  add(mesh_.cells[c].n[i]);
}

template <int D>
bool Cavity<D>::grow(Index c, int i) {
  const Index n = mesh_.cells[c].n[i];
  if (n < 0) return false;
  add(n);
  return true;
}

template <int D>
double Cavity<D>::worst_energy() const {
  double worst = 1.0;
  for (const Index c : cells_) worst = std::max(worst, mesh_.cells[c].energy);
  return worst;
}

template <int D>
double Cavity<D>::excess() const {
  double sum = 0.0;
  for (const Index c : cells_) sum += mesh_.cells[c].energy - 1.0;
  return sum;
}

template <int D>
bool Cavity<D>::add_outer_facet(Index c, int i, const Vertex& p, Index id, double worst) {
  const auto& cell = mesh_.cells[c];
  const Index outside = cell.n[i];
  int back = 0;
  if (outside >= 0) {
    while (mesh_.cells[outside].n[back] != c) ++back;
  }
  const PieceId inner = mesh_.inner_piece(c, i);
  Star star;
  star.v[0] = id;
  bool contains_p = false;
  for (int k = 0; k < D; ++k) {
    star.v[k + 1] = cell.v[kCellFacets<D>[i][k]];
    contains_p = contains_p || star.v[k + 1] == id;
  }
  const bool coplanar = is_boundary(outside) && p.pieces.contains(boundary_piece(outside)) &&
                        lies_beside(p, star, boundary_piece(outside));
  if ((contains_p && id != kNone) || coplanar) {
    Dropped d;
    std::copy(star.v.begin() + 1, star.v.end(), d.v.begin());
    d.outside = outside;
    d.back = back;
    d.contains_p = contains_p && id != kNone;
    d.matched = false;
    d.region = cell.region;
    d.piece = inner;
    dropped_.push_back(d);
    return true;
  }
  typename Local::Corners w;
  w[0] = &p;
  for (int k = 1; k <= D; ++k) w[k] = &mesh_.vertices[star.v[k]];
  star.energy = Local::energy(w);
  bool good = star.energy < worst;
  if (good && star.energy > kSignIsSafe) {
    std::array<Vec<D>, D + 1> x;
    for (int k = 0; k <= D; ++k) x[k] = w[k]->x;
    good = orient<D>(x) > 0.0;
  }
  if (!good) {
    blocking_cell_ = c;
    blocking_facet_ = i;
    return false;
  }
  star.outside = outside;
  star.back = back;
  star.inner.fill(kNone);
  star.region = cell.region;
  star.piece.fill(0);
  star.piece[0] = inner;
  proposed_worst_ = std::max(proposed_worst_, star.energy);
  proposed_excess_ += star.energy - 1.0;
  stars_.push_back(star);
  return true;
}

template <int D>
bool Cavity<D>::add_inner_facet(Index c, int i, const Vertex& p) {
  const PieceId piece = mesh_.inner_piece(c, i);
  if (!p.pieces.contains(piece)) return false;
  InnerFacet f;
  for (int k = 0; k < D; ++k) f.v[k] = mesh_.cells[c].v[kCellFacets<D>[i][k]];
  f.piece = piece;
  inner_.push_back(f);
  return true;
}

template <int D>
bool Cavity<D>::collect(const Vertex& p, Index id, double worst, double excess) {
  stars_.clear();
  dropped_.clear();
  inner_.clear();
  normal_piece_ = 0;
  proposed_worst_ = 1.0;
  proposed_excess_ = 0.0;
  blocking_cell_ = kNone;
  for (const Index c : cells_) {
    for (int i = 0; i <= D; ++i) {
      const Index n = mesh_.cells[c].n[i];
      if (n >= 0 && mesh_.cells[n].mark == mesh_.stamp) {
        if (mesh_.cells[c].region < mesh_.cells[n].region && !add_inner_facet(c, i, p)) {
          blocking_cell_ = kNone;
          return false;
        }
        continue;
      }
      if (!add_outer_facet(c, i, p, id, worst) || proposed_excess_ >= excess) return false;
    }
  }
  return !stars_.empty();
}

template <int D>
bool Cavity<D>::glue_single(const Ridge& ridge, Index id) {
  Star& star = stars_[ridge.star];
  for (Dropped& d : dropped_) {
    for (int k = 0; k < D; ++k) {
      if (d.contains_p ? d.v[k] != id : false) continue;
      if (facet_ridge_key<D>(d.v, k) != ridge.key) continue;
      PieceId piece = 0;
      if (d.region != star.region || inner_at(ridge.key, piece) != 0) return false;
      star.piece[ridge.facet] = d.piece;
      if (d.contains_p) {
        if (d.matched) return false;
        d.matched = true;
        star.outer[ridge.facet] = d.outside;
        star.outer_back[ridge.facet] = d.back;
      } else {
        star.outer[ridge.facet] = d.outside;  // a boundary code: the new facet lies on the same piece
        star.outer_back[ridge.facet] = kNone;
      }
      return true;
    }
  }
  return false;
}

// The number of inner facets that contain the ridge, and the piece of the last.
template <int D>
int Cavity<D>::inner_at(std::uint64_t key, PieceId& piece) const {
  int count = 0;
  for (const InnerFacet& f : inner_) {
    for (int k = 0; k < D; ++k) {
      if (facet_ridge_key<D>(f.v, k) != key) continue;
      piece = f.piece;
      ++count;
    }
  }
  return count;
}

// Two regions meet at the ridge if one facet between regions ends there; where several do, one would lose it.
template <int D>
bool Cavity<D>::glue_pair(const Ridge& a, const Ridge& b) {
  Star &s = stars_[a.star], &t = stars_[b.star];
  if (!inner_.empty()) {
    PieceId piece = 0;
    if (inner_at(a.key, piece) != (s.region == t.region ? 0 : 1)) return false;
    s.piece[a.facet] = t.piece[b.facet] = piece;
  }
  s.inner[a.facet] = b.star;
  t.inner[b.facet] = a.star;
  return true;
}

template <int D>
bool Cavity<D>::glue(Index id) {
  ridges_.clear();
  for (Index s = 0; s < static_cast<Index>(stars_.size()); ++s)
    for (int k = 1; k <= D; ++k) ridges_.push_back({ridge_key<D>(stars_[s].v, k), s, k});
  std::sort(ridges_.begin(), ridges_.end(),
            [](const Ridge& a, const Ridge& b) { return a.key != b.key ? a.key < b.key : a.star < b.star; });
  for (std::size_t r = 0; r < ridges_.size();) {
    std::size_t end = r + 1;
    while (end < ridges_.size() && ridges_[end].key == ridges_[r].key) ++end;
    if (!(end - r == 2   ? glue_pair(ridges_[r], ridges_[r + 1])
          : end - r == 1 ? glue_single(ridges_[r], id)
                         : false))
      return false;
    r = end;
  }
  for (const Dropped& d : dropped_)
    if (d.contains_p && !d.matched && !is_boundary(d.outside)) return false;
  return true;
}

template <int D>
bool Cavity<D>::covers_all_vertices(Index id, Index removed) {
  const std::uint32_t seen = ++mesh_.vertex_stamp;
  link_.clear();
  for (const Star& s : stars_) {
    for (int k = 1; k <= D; ++k) {
      auto& v = mesh_.vertices[s.v[k]];
      if (v.mark == seen) continue;
      v.mark = seen;
      link_.push_back(s.v[k]);
    }
  }
  for (const Index c : cells_)
    for (const Index v : mesh_.cells[c].v)
      if (mesh_.vertices[v].mark != seen && v != id && v != removed) return false;
  return true;
}

// Whether the star has the edge. Valid once link_ is known.
template <int D>
bool Cavity<D>::survives(const LineEdge& edge, Index id) const {
  const auto linked = [&](Index v) { return std::find(link_.begin(), link_.end(), v) != link_.end(); };
  if (edge.a == id) return linked(edge.b);
  if (edge.b == id) return linked(edge.a);
  const auto has = [](const Star& s, Index v) {
    return std::find(s.v.begin() + 1, s.v.end(), v) != s.v.end();
  };
  return std::any_of(stars_.begin(), stars_.end(),
                     [&](const Star& s) { return has(s, edge.a) && has(s, edge.b); });
}

// A new p takes the place of an edge that it lies on; one that is there, that of the edges up to the vertex
// `removed` and beyond.
template <int D>
bool Cavity<D>::lines_survive(const Vertex& p, Index id, Index removed) {
  lost_lines_.clear();
  new_lines_.clear();
  for (const Index c : cells_) {
    for (const auto& e : kCellEdges<D>) {
      const Index a = mesh_.cells[c].v[e[0]], b = mesh_.cells[c].v[e[1]];
      const LineEdge edge{std::min(a, b), std::max(a, b), mesh_.line(a, b)};
      if (edge.line == 0 || survives(edge, id)) continue;
      if (std::find(lost_lines_.begin(), lost_lines_.end(), edge) == lost_lines_.end())
        lost_lines_.push_back(edge);
    }
  }
  if (lost_lines_.empty()) return true;
  const PieceId line = lost_lines_[0].line;
  if (mesh_.shape->is_required(line) || lost_lines_.size() != (id == kNone ? 1 : 2)) return false;
  for (const LineEdge& edge : lost_lines_) {
    if (edge.line != line) return false;
    for (const Index v : {edge.a, edge.b}) {
      if (v == removed || v == id) continue;
      if (id != kNone && edge.a != removed && edge.b != removed) return false;
      new_lines_.push_back(v);
    }
  }
  if (new_lines_.size() != (id == kNone ? 2 : 1) || !p.pieces.may_have_line()) return false;
  return std::all_of(new_lines_.begin(), new_lines_.end(), [&](Index v) {
    return std::find(link_.begin(), link_.end(), v) != link_.end() &&
           (id == kNone || mesh_.line(id, v) == 0) &&
           mesh_.shape->follows_line(line, p.x, mesh_.vertices[v].x);
  });
}

// The edges of lines at p, once it is moved there.
template <int D>
bool Cavity<D>::lines_follow(const Vertex& p, Index id) const {
  if (p.pieces.line() == 0) return true;
  for (const Index c : cells_)
    for (const Index v : mesh_.cells[c].v)
      if (const PieceId line = v == id ? PieceId{0} : mesh_.line(id, v))
        if (!mesh_.shape->follows_line(line, p.x, mesh_.vertices[v].x)) return false;
  return true;
}

// A curved piece may turn back: across a thin part of the domain lies a facet that p sees from its front.
template <int D>
bool Cavity<D>::lies_beside(const Vertex& p, const Star& facet, int piece) {
  if (!mesh_.shape->curved(piece)) return true;
  if (normal_piece_ != piece) {
    normal_piece_ = piece;
    normal_ = mesh_.shape->normal(piece, p.x);
  }
  std::array<Vec<D>, D> x;
  for (int k = 0; k < D; ++k) x[k] = mesh_.vertices[facet.v[k + 1]].x;
  return area_vector<D>(x).dot(normal_) > 0.0;
}

// Inner ones as their lower region sees them.
template <int D>
void Cavity<D>::list_new_facets() {
  boundary_.clear();
  for (const Star& star : stars_) {
    for (int k = 1; k <= D; ++k) {
      const Index beside = star.inner[k];
      const bool outer = beside == kNone && is_boundary(star.outer[k]) && star.outer_back[k] == kNone;
      if (!outer && (beside == kNone || star.region >= stars_[beside].region)) continue;
      BoundaryFacet f;
      for (int i = 0; i < D; ++i) f.v[i] = star.v[kCellFacets<D>[k][i]];
      f.piece = outer ? boundary_piece(star.outer[k]) : star.piece[k];
      boundary_.push_back(f);
    }
  }
}

template <int D>
bool Cavity<D>::follows_shape(const Vertex& p, Index id) {
  if (mesh_.shape->flat() || p.pieces.empty()) return true;
  boundary_.clear();
  for (const Index c : cells_) {
    const auto& cell = mesh_.cells[c];
    for (int i = 0; i <= D; ++i) {
      if (cell.v[i] == id) continue;
      if (!is_boundary(cell.n[i]) && cell.region >= mesh_.cells[cell.n[i]].region) continue;
      BoundaryFacet f;
      for (int k = 0; k < D; ++k) f.v[k] = cell.v[kCellFacets<D>[i][k]];
      f.piece = mesh_.piece(c, i);
      boundary_.push_back(f);
    }
  }
  return lines_follow(p, id) && facets_follow(p, id);
}

// The listed facets with p as vertex `id`, and the edges at p that two pieces share.
template <int D>
bool Cavity<D>::facets_follow(const Vertex& p, Index id) const {
  const BoundaryShape<D>& shape = *mesh_.shape;
  const auto place = [&](Index v) -> const Vec<D>& { return v == id ? p.x : mesh_.vertices[v].x; };
  for (std::size_t f = 0; f < boundary_.size(); ++f) {
    for (std::size_t g = 0; D == 3 && g < f; ++g) {
      if (boundary_[g].piece == boundary_[f].piece) continue;
      for (const Index v : boundary_[f].v)
        if (v != id && std::find(boundary_[g].v.begin(), boundary_[g].v.end(), v) != boundary_[g].v.end() &&
            !shape.follows_ridge(boundary_[f].piece, boundary_[g].piece, p.x, place(v)))
          return false;
    }
    if (!shape.curved(boundary_[f].piece)) continue;
    std::array<Vec<D>, D> x;
    for (int k = 0; k < D; ++k) x[k] = place(boundary_[f].v[k]);
    if (!shape.follows(boundary_[f].piece, x)) return false;
  }
  return true;
}

template <int D>
bool Cavity<D>::propose(const Vertex& p, Index id, double worst, Index removed, double excess) {
  if (!collect(p, id, worst, excess)) return false;
  const bool closed = glue(id) && covers_all_vertices(id, removed) &&
                      (mesh_.lines.empty() || lines_survive(p, id, removed)) &&
                      (mesh_.shape->flat() || (list_new_facets(), facets_follow(p, id)));
  if (!closed) blocking_cell_ = kNone;
  return closed;
}

template <int D>
Index Cavity<D>::commit(const Vertex& p, Index id) {
  for (const Index c : cells_)
    for (const Index v : mesh_.cells[c].v) mesh_.vertices[v].cell = kNone;
  if (id == kNone) {
    if (mesh_.free_vertices.empty()) {
      id = static_cast<Index>(mesh_.vertices.size());
      mesh_.vertices.emplace_back();
    } else {
      id = mesh_.free_vertices.back();
      mesh_.free_vertices.pop_back();
    }
  }
  mesh_.vertices[id] = p;
  if (!mesh_.lines.empty()) {
    for (const LineEdge& edge : lost_lines_) mesh_.lines.erase(edge.a, edge.b);
    for (const Index v : new_lines_) mesh_.lines.set(id, v, lost_lines_[0].line);
  }
  old_vertices_.clear();
  for (const Index c : cells_)
    for (const Index v : mesh_.cells[c].v) old_vertices_.push_back(v);
  // Slots of the cavity are used again, then freed ones, then new ones.
  slots_.resize(stars_.size());
  for (std::size_t s = 0; s < stars_.size(); ++s) {
    if (s < cells_.size()) {
      slots_[s] = cells_[s];
    } else if (!mesh_.free_cells.empty()) {
      slots_[s] = mesh_.free_cells.back();
      mesh_.free_cells.pop_back();
    } else {
      slots_[s] = static_cast<Index>(mesh_.cells.size());
      mesh_.cells.emplace_back();
      if (!mesh_.inner.empty()) mesh_.inner.emplace_back();
    }
  }
  for (std::size_t s = stars_.size(); s < cells_.size(); ++s) {
    mesh_.cells[cells_[s]].v[0] = kNone;
    mesh_.free_cells.push_back(cells_[s]);
  }
  for (std::size_t s = 0; s < stars_.size(); ++s) {
    const Star& star = stars_[s];
    auto& cell = mesh_.cells[slots_[s]];
    cell.v = star.v;
    cell.v[0] = id;
    cell.energy = star.energy;
    cell.mark = 0;
    cell.region = star.region;
    if (!mesh_.inner.empty()) mesh_.inner[slots_[s]] = star.piece;
    cell.n[0] = star.outside;
    if (star.outside >= 0) mesh_.cells[star.outside].n[star.back] = slots_[s];
    for (int k = 1; k <= D; ++k) {
      if (star.inner[k] != kNone) {
        cell.n[k] = slots_[star.inner[k]];
      } else {
        cell.n[k] = star.outer[k];
        if (star.outer[k] >= 0) mesh_.cells[star.outer[k]].n[star.outer_back[k]] = slots_[s];
      }
    }
    for (const Index v : cell.v) {
      mesh_.vertices[v].cell = slots_[s];
      mesh_.vertices[v].changed = mesh_.now;
    }
  }
  for (const Index v : old_vertices_) {
    if (mesh_.vertices[v].cell != kNone) continue;
    mesh_.vertices[v].cell = kNone - 1;  // listed once even though several cells held it
    mesh_.free_vertices.push_back(v);
  }
  return id;
}

template class Cavity<2>;
template class Cavity<3>;

}  // namespace lamina::adapt_detail
