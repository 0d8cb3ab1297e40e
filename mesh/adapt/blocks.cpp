#include "mesh/adapt/blocks.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/hilbert.h"
#include "core/parallel.h"

namespace lamina::adapt_detail {
namespace {

// Open addressing from ids >= 0 to indices.
class IndexMap {
 public:
  explicit IndexMap(std::size_t expected) {
    std::size_t size = 16;
    while (size < 2 * expected) size *= 2;
    slots_.assign(size, {kNone, kNone});
  }
  /// The value of `key`, and whether it is new. Valid until the next call.
  Index& at(Index key, bool& inserted) {
    if (2 * count_ >= slots_.size()) grow();
    Slot& s = slot(key);
    inserted = s.key == kNone;
    if (inserted) {
      s.key = key;
      ++count_;
    }
    return s.value;
  }

 private:
  struct Slot {
    Index key, value;
  };
  Slot& slot(Index key) {
    std::size_t i = (static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15ULL) >> 20U & (slots_.size() - 1);
    while (slots_[i].key != kNone && slots_[i].key != key) i = (i + 1) & (slots_.size() - 1);
    return slots_[i];
  }
  void grow() {
    std::vector<Slot> old(2 * slots_.size(), {kNone, kNone});
    old.swap(slots_);
    for (const Slot& s : old)
      if (s.key != kNone) slot(s.key) = s;
  }

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
};

template <int D>
struct Piece {
  LocalMesh<D> mesh;
  std::vector<Index> global;  // global id of each vertex the piece started with
};

// Facets that wait for their other cell, in a list for each least vertex. Cells follow the curve, and
// vertices are numbered as they come, so lists are short and near each other; a hash table takes three times
// as long.
template <int D>
class OpenFacets {
 public:
  explicit OpenFacets(std::size_t vertices) : first_(vertices, kNone) {}
  /// Takes out and returns the side stored for the facet; stores `side` and returns kNone when there is none.
  Index match(std::array<Index, D> f, Index side) {
    std::sort(f.begin(), f.end());
    Index* link = &first_[f[0]];
    for (; *link != kNone; link = &open_[*link].next) {
      Open& o = open_[*link];
      if (o.middle != f[1] || o.last != f[D - 1]) continue;
      const Index found = o.side, freed = *link;
      *link = o.next;
      o.next = free_;
      free_ = freed;
      return found;
    }
    Index place = free_;
    if (place == kNone) {
      place = static_cast<Index>(open_.size());
      open_.emplace_back();
    } else {
      free_ = open_[place].next;
    }
    open_[place] = {f[1], f[D - 1], side, first_[f[0]]};
    first_[f[0]] = place;
    return kNone;
  }

 private:
  struct Open {
    Index middle, last, side, next;
  };
  std::vector<Index> first_;
  std::vector<Open> open_;
  Index free_ = kNone;
};

template <int D>
void connect(LocalMesh<D>& local, std::vector<std::array<PieceId, D + 1>> pieces) {
  bool any_inner = false;
  OpenFacets<D> open(local.vertices.size());
  for (Index c = 0; c < static_cast<Index>(local.cells.size()); ++c) {
    auto& cell = local.cells[c];
    for (int i = 0; i <= D; ++i) {
      PieceId& piece = pieces[c][i];
      if (piece != 0 && !local.shape->is_inner(piece)) {
        cell.n[i] = boundary_code(std::exchange(piece, PieceId{0}));
        continue;
      }
      any_inner = any_inner || piece != 0;
      std::array<Index, D> f;
      for (int k = 0; k < D; ++k) f[k] = cell.v[kCellFacets<D>[i][k]];
      const Index other = open.match(f, c * (D + 1) + i);
      cell.n[i] = other == kNone ? kInterface : other / (D + 1);
      if (other != kNone) local.cells[other / (D + 1)].n[other % (D + 1)] = c;
    }
  }
  if (any_inner) local.inner = std::move(pieces);
}

// The edges of a cell that lie on lines.
template <int D, class Visit>
void visit_lines(const GlobalMesh<D>& mesh, Index cell, Visit&& visit) {
  const auto& v = mesh.cells[cell];
  for (const auto& e : kCellEdges<D>) {
    if (!mesh.pieces[v[e[0]]].may_have_line() || !mesh.pieces[v[e[1]]].may_have_line()) continue;
    if (const PieceId line = line_of(mesh.kept.lines, v[e[0]], v[e[1]])) visit(e[0], e[1], line);
  }
}

template <int D>
Piece<D> extract(const GlobalMesh<D>& mesh, const Index* cells, std::size_t count) {
  Piece<D> piece;
  LocalMesh<D>& local = piece.mesh;
  local.shape = mesh.shape.get();
  local.cells.resize(count);
  std::vector<std::array<PieceId, D + 1>> pieces(count);
  IndexMap ids(count / (D == 3 ? 4 : 1));
  for (std::size_t k = 0; k < count; ++k) {
    const Index g = cells[k];
    pieces[k] = mesh.facet_pieces[g];
    for (int i = 0; i <= D; ++i) {
      const Index v = mesh.cells[g][i];
      bool inserted = false;
      Index& slot = ids.at(v, inserted);
      if (inserted) {
        slot = static_cast<Index>(piece.global.size());
        piece.global.push_back(v);
        typename LocalMesh<D>::Vertex vertex;
        vertex.x = mesh.x[v];
        vertex.metric = mesh.metric[v];
        vertex.density = vertex.metric.sqrt_det();
        vertex.pieces = mesh.pieces[v];
        vertex.changed = mesh.changed[v];
        vertex.level = mesh.level[v];
        local.vertices.push_back(vertex);
      }
      local.cells[k].v[i] = slot;
      local.vertices[slot].cell = static_cast<Index>(k);
    }
    local.cells[k].energy = mesh.energy[g];
    if (!mesh.regions.empty()) local.cells[k].region = mesh.regions[g];
    if (!mesh.kept.lines.empty())
      visit_lines(mesh, g, [&](int a, int b, PieceId line) {
        local.lines.set(local.cells[k].v[a], local.cells[k].v[b], line);
      });
  }
  connect<D>(local, std::move(pieces));
  for (const auto& cell : local.cells)
    for (int i = 0; i <= D; ++i)
      if (cell.n[i] == kInterface)
        for (int k = 0; k < D; ++k) local.vertices[cell.v[kCellFacets<D>[i][k]]].frozen = true;
  return piece;
}

// What a piece leaves behind: cells with ids < old vertex count (kept) or old count + running number (new).
template <int D>
struct Result {
  std::vector<std::array<Index, D + 1>> cells;
  std::vector<std::array<PieceId, D + 1>> facet_pieces;
  std::vector<PieceId> regions;
  std::vector<double> energy;
  std::vector<LineEdge> lines;
  std::vector<Index> kept;  // vertices that were there before, as the piece numbers them
  std::vector<typename LocalMesh<D>::Vertex> added;
  std::vector<Index> frozen;  // vertices on interfaces, listed by every piece that has them
};

template <int D>
Result<D> write_back(const Piece<D>& piece, GlobalMesh<D>& mesh, std::vector<std::uint8_t>& alive) {
  const LocalMesh<D>& local = piece.mesh;
  const Index old_count = static_cast<Index>(mesh.x.size());
  Result<D> r;
  std::vector<Index> id(local.vertices.size(), kNone);
  for (std::size_t v = 0; v < local.vertices.size(); ++v) {
    const auto& vertex = local.vertices[v];
    const bool known = v < piece.global.size();
    if (vertex.cell < 0) {
      if (known) alive[piece.global[v]] = 0;
      continue;
    }
    if (known) {
      id[v] = piece.global[v];
      r.kept.push_back(id[v]);
      if (vertex.frozen) {
        r.frozen.push_back(id[v]);
        continue;
      }
      mesh.changed[id[v]] = vertex.changed;
      mesh.level[id[v]] = vertex.level;
      mesh.x[id[v]] = vertex.x;
      mesh.metric[id[v]] = vertex.metric;
      mesh.pieces[id[v]] = vertex.pieces;
    } else {
      id[v] = old_count + static_cast<Index>(r.added.size());
      r.added.push_back(vertex);
    }
  }
  const std::size_t count = local.cells.size() - local.free_cells.size();
  r.cells.reserve(count);
  r.facet_pieces.reserve(count);
  if (!mesh.regions.empty()) r.regions.reserve(count);
  r.energy.reserve(count);
  for (Index c = 0; c < static_cast<Index>(local.cells.size()); ++c) {
    if (!local.alive(c)) continue;
    const auto& cell = local.cells[c];
    std::array<Index, D + 1> v;
    std::array<PieceId, D + 1> t;
    for (int i = 0; i <= D; ++i) {
      v[i] = id[cell.v[i]];
      t[i] = static_cast<PieceId>(local.piece(c, i));
    }
    if (!mesh.regions.empty()) r.regions.push_back(cell.region);
    r.cells.push_back(v);
    r.facet_pieces.push_back(t);
    r.energy.push_back(cell.energy);
  }
  r.lines = local.lines.list();
  for (LineEdge& edge : r.lines) edge = {id[edge.a], id[edge.b], edge.line};
  return r;
}

// The cells that no piece holds, as they are. REQUIRES `cells` ascending.
template <int D>
Result<D> others(const GlobalMesh<D>& mesh, const std::vector<Index>& cells) {
  Result<D> r;
  r.kept.resize(mesh.x.size());  // those of the pieces have their numbers by then
  std::iota(r.kept.begin(), r.kept.end(), 0);
  auto skip = cells.begin();
  for (Index c = 0; c < static_cast<Index>(mesh.cells.size()); ++c) {
    if (skip != cells.end() && *skip == c) {
      ++skip;
      continue;
    }
    r.cells.push_back(mesh.cells[c]);
    r.facet_pieces.push_back(mesh.facet_pieces[c]);
    if (!mesh.regions.empty()) r.regions.push_back(mesh.regions[c]);
    r.energy.push_back(mesh.energy[c]);
    if (!mesh.kept.lines.empty())
      visit_lines(mesh, c, [&](int a, int b, PieceId line) {
        r.lines.push_back({mesh.cells[c][a], mesh.cells[c][b], line});
      });
  }
  return r;
}

// Moves the values of the vertices that stay to their new places, and adds those of new ones.
template <int D, class T, class Member>
void renumber_values(std::vector<T>& values, const std::vector<Index>& renumber, Index count,
                     const std::vector<Result<D>>& results, const std::vector<Index>& added_base,
                     Member member) {
  std::vector<T> out(count);
  for_each_index(renumber.size(), [&](std::size_t v) {
    if (renumber[v] != kNone) out[renumber[v]] = values[v];
  });
  for (std::size_t b = 0; b < results.size(); ++b)
    for (std::size_t i = 0; i < results[b].added.size(); ++i)
      out[added_base[b] + static_cast<Index>(i)] = results[b].added[i].*member;
  values.swap(out);
}

// Sizes the vector for new values, and gives its memory back before it takes more.
template <class T>
void start_over(std::vector<T>& values, std::int64_t count) {
  std::vector<T>().swap(values);
  values.resize(static_cast<std::size_t>(count));
}

// The kept parts under the new numbers; new_number(piece, vertex) as a result calls it. An edge on an
// interface comes from every piece around it.
template <int D, class NewNumber>
void join_kept(KeptParts<D>& kept, const std::vector<Result<D>>& results, const std::vector<Index>& renumber,
               NewNumber&& new_number) {
  kept.lines.clear();
  for (std::size_t b = 0; b < results.size(); ++b) {
    for (const LineEdge& edge : results[b].lines) {
      const Index v = new_number(b, edge.a), w = new_number(b, edge.b);
      kept.lines.push_back({std::min(v, w), std::max(v, w), edge.line});
    }
  }
  std::sort(kept.lines.begin(), kept.lines.end(),
            [](const LineEdge& e, const LineEdge& f) { return e.a != f.a ? e.a < f.a : e.b < f.b; });
  kept.lines.erase(std::unique(kept.lines.begin(), kept.lines.end()), kept.lines.end());
  for (Index& v : kept.corners) v = renumber[v];
  for (Index& v : kept.points) v = renumber[v];
  for (auto& facet : kept.facets)
    for (Index& v : facet) v = renumber[v];
}

// Joins the results in piece order. Vertices are numbered as pieces list them, so that those near each other
// in space are near in memory.
template <int D>
void join(GlobalMesh<D>& mesh, std::vector<Result<D>> results, const std::vector<std::uint8_t>& alive,
          int now) {
  using Vertex = typename LocalMesh<D>::Vertex;
  const auto old_count = static_cast<Index>(mesh.x.size());
  // What an interface kept from being tried is tried in the next pass.
  for (const auto& r : results)
    for (const Index v : r.frozen) mesh.changed[v] = now;
  std::vector<Index> renumber(alive.size(), kNone), added_base;
  std::vector<std::int64_t> cell_base;
  Index count = 0;
  for (const auto& r : results) {
    for (const Index v : r.kept)
      if (alive[v] && renumber[v] == kNone) renumber[v] = count++;
    added_base.push_back(count);
    count += static_cast<Index>(r.added.size());
    cell_base.push_back(static_cast<std::int64_t>(r.cells.size()));
  }
  renumber_values<D>(mesh.x, renumber, count, results, added_base, &Vertex::x);
  renumber_values<D>(mesh.metric, renumber, count, results, added_base, &Vertex::metric);
  renumber_values<D>(mesh.pieces, renumber, count, results, added_base, &Vertex::pieces);
  renumber_values<D>(mesh.changed, renumber, count, results, added_base, &Vertex::changed);
  renumber_values<D>(mesh.level, renumber, count, results, added_base, &Vertex::level);
  const auto new_number = [&](std::size_t b, Index v) {
    return v < old_count ? renumber[v] : added_base[b] + (v - old_count);
  };
  join_kept(mesh.kept, results, renumber, new_number);
  const auto cells = exclusive_scan(cell_base);
  start_over(mesh.cells, cells);
  start_over(mesh.facet_pieces, cells);
  const bool regions = !mesh.regions.empty();
  if (regions) start_over(mesh.regions, cells);
  start_over(mesh.energy, cells);
  for_each_index(
      results.size(),
      [&](std::size_t b) {
        const Result<D> r = std::move(results[b]);
        for (std::size_t i = 0; i < r.cells.size(); ++i) {
          auto& cell = mesh.cells[cell_base[b] + static_cast<std::int64_t>(i)];
          for (int k = 0; k <= D; ++k) cell[k] = new_number(b, r.cells[i][k]);
          mesh.facet_pieces[cell_base[b] + static_cast<std::int64_t>(i)] = r.facet_pieces[i];
          mesh.energy[cell_base[b] + static_cast<std::int64_t>(i)] = r.energy[i];
          if (regions) mesh.regions[cell_base[b] + static_cast<std::int64_t>(i)] = r.regions[i];
        }
      },
      1);
}

// The curve of pass k: the bounds enlarged to twice their size and shifted by fractions that never repeat.
template <int D>
Box<D> curve_box(const GlobalMesh<D>& mesh, int pass) {
  constexpr std::array<double, 3> kShift = {0.7548776662466927, 0.5698402909980532, 0.3247179572447460};
  Box<D> box;
  for (int i = 0; i < D; ++i) {
    const double size = mesh.bounds.hi[i] - mesh.bounds.lo[i];
    const double s = kShift[i] * pass;
    box.lo[i] = mesh.bounds.lo[i] - size * (s - std::floor(s));
    box.hi[i] = box.lo[i] + 2.0 * size;
  }
  return box;
}

// The cells, all where none are listed, in the order of their centres along the curve.
template <int D>
std::vector<Index> along_curve(const GlobalMesh<D>& mesh, const Box<D>& box,
                               const std::vector<Index>& cells) {
  const bool all = cells.empty();
  std::vector<std::uint64_t> keys(all ? mesh.cells.size() : cells.size());
  for_each_index(keys.size(), [&](std::size_t k) {
    Vec<D> center = Vec<D>::Zero();
    for (const Index v : mesh.cells[all ? k : cells[k]]) center += mesh.x[v] / (D + 1);
    keys[k] = hilbert_key<D>(center, box);
  });
  std::vector<Index> order = sorted_order(keys);
  if (!all) std::transform(order.begin(), order.end(), order.begin(), [&](Index k) { return cells[k]; });
  return order;
}

}  // namespace

std::size_t block_count(std::size_t cells, std::size_t cells_per_block) {
  return std::max<std::size_t>(1, (cells + cells_per_block / 2) / cells_per_block);
}

template <int D>
void block_pass(GlobalMesh<D>& mesh, int pass, int end_of_pass, std::size_t cells_per_block,
                const std::vector<Index>& cells,
                const std::function<void(LocalMesh<D>&, std::size_t)>& visit) {
  const bool all = cells.empty();
  const std::size_t n = all ? mesh.cells.size() : cells.size();
  const std::size_t blocks = block_count(n, cells_per_block);
  std::vector<std::uint8_t> alive(mesh.x.size(), 1);
  std::vector<Result<D>> results(blocks);
  {
    const std::vector<Index> order = along_curve(mesh, curve_box(mesh, pass), cells);
    for_each_index(
        blocks,
        [&](std::size_t b) {
          const std::size_t begin = n * b / blocks;
          const std::size_t end = n * (b + 1) / blocks;
          Piece<D> piece = extract<D>(mesh, order.data() + begin, end - begin);
          visit(piece.mesh, b);
          // Vertices that are not frozen belong to this piece alone, so their slots are written by no one
          // else.
          results[b] = write_back<D>(piece, mesh, alive);
        },
        1);
  }
  if (!all) results.push_back(others(mesh, cells));
  join<D>(mesh, std::move(results), alive, end_of_pass);
}

template <int D>
std::vector<Index> cells_around(const GlobalMesh<D>& mesh, std::vector<Index> cells, int rings) {
  std::vector<std::uint8_t> near_vertex(mesh.x.size(), 0);
  for (int ring = 0; ring < rings; ++ring) {
    for (const Index c : cells)
      for (const Index v : mesh.cells[c]) near_vertex[v] = 1;
    cells.clear();
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
      if (std::any_of(mesh.cells[c].begin(), mesh.cells[c].end(), [&](Index v) { return near_vertex[v]; }))
        cells.push_back(static_cast<Index>(c));
  }
  return cells;
}

template void block_pass(GlobalMesh<2>&, int, int, std::size_t, const std::vector<Index>&,
                         const std::function<void(LocalMesh<2>&, std::size_t)>&);
template void block_pass(GlobalMesh<3>&, int, int, std::size_t, const std::vector<Index>&,
                         const std::function<void(LocalMesh<3>&, std::size_t)>&);
template std::vector<Index> cells_around(const GlobalMesh<2>&, std::vector<Index>, int);
template std::vector<Index> cells_around(const GlobalMesh<3>&, std::vector<Index>, int);

}  // namespace lamina::adapt_detail
