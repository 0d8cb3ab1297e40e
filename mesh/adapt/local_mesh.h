// The piece of a mesh that one task adapts: cells with adjacency, vertices with metric and constraints.
//
// Facets that the piece shares with the rest of the mesh are frozen: no operation changes them, which is what
// lets pieces be adapted at the same time. Neighbour codes: >= 0 a cell of the piece, kInterface the rest of
// the mesh, boundary_code(piece) the boundary of the domain. Facets between cells of two regions belong to
// inner pieces, which are kept like those of the boundary of either region.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/metric.h"
#include "mesh/adapt/lines.h"
#include "mesh/adapt/shape.h"
#include "mesh/mesh.h"

namespace lamina::adapt_detail {

inline constexpr Index kInterface = -1;
constexpr Index boundary_code(int piece) { return -1 - piece; }
constexpr bool is_boundary(Index neighbor) { return neighbor < kInterface; }
constexpr int boundary_piece(Index neighbor) { return -1 - neighbor; }

/// Energy of a cell of the given quality, see shape_energy().
template <int D>
double energy_of(double quality) {
  return D == 2 ? 1.0 / quality : 1.0 / (quality * std::sqrt(quality));
}

/// Up to this energy the rounding error of the volume in metric space cannot reach its sign (aspect ratios to
/// 1e9).
inline constexpr double kSignIsSafe = 1e6;

inline constexpr int kNoLevel = std::numeric_limits<int>::min();

template <int D>
struct LocalMesh {
  struct Vertex {
    Vec<D> x;
    Metric<D> metric;
    double density = 0.0;    ///< sqrt(det metric), cached
    PieceSet pieces;         ///< of the boundary that it is kept on
    Index cell = kNone;      ///< one of its cells; < 0: removed
    bool frozen = false;     ///< on an interface
    int level = kNoLevel;    ///< the level it was placed on
    int changed = 0;         ///< time when its cells, position or metric last changed, or it was frozen
    std::uint32_t mark = 0;  ///< scratch of Cavity
  };
  struct Cell {
    std::array<Index, D + 1> v;  ///< v[0] == kNone: removed
    std::array<Index, D + 1> n;  ///< across the facet opposite to v[i]
    double energy = 0.0;         ///< shape_energy() in the largest of its vertices' metrics
    std::uint32_t mark = 0;
    PieceId region = 0;
  };

  std::vector<Vertex> vertices;
  std::vector<Cell> cells;
  /// The inner pieces of the facets of each cell, 0 where there is none; empty: there are none at all.
  std::vector<std::array<PieceId, D + 1>> inner;
  std::vector<Index> free_cells, free_vertices;
  LineTable lines;  ///< empty: there are none at all
  const BoundaryShape<D>* shape = nullptr;
  std::uint32_t stamp = 0;         ///< cells with mark == stamp belong to the current cavity
  std::uint32_t vertex_stamp = 0;  ///< the same for marks of vertices

  int now = 0;  ///< time: number of the sweep, counted through all passes

  [[nodiscard]] bool alive(Index c) const { return cells[c].v[0] != kNone; }

  [[nodiscard]] PieceId inner_piece(Index c, int i) const { return inner.empty() ? 0 : inner[c][i]; }
  /// The piece, outer or inner, of facet i of a cell; 0: none.
  [[nodiscard]] int piece(Index c, int i) const {
    return is_boundary(cells[c].n[i]) ? boundary_piece(cells[c].n[i]) : inner_piece(c, i);
  }

  /// The line that the edge lies on; 0: none.
  [[nodiscard]] PieceId line(Index a, Index b) const {
    if (lines.empty() || !vertices[a].pieces.may_have_line() || !vertices[b].pieces.may_have_line()) return 0;
    return lines.at(a, b);
  }

  [[nodiscard]] double length(Index a, Index b) const {
    return edge_length<D>(vertices[a].x, vertices[a].metric, vertices[b].x, vertices[b].metric);
  }

  using Corners = std::array<const Vertex*, D + 1>;
  [[nodiscard]] Corners corners(const std::array<Index, D + 1>& v) const {
    Corners w;
    for (int i = 0; i <= D; ++i) w[i] = &vertices[v[i]];
    return w;
  }

  /// The metric that decides the shape of a cell: that of the largest determinant, ties: the first.
  [[nodiscard]] static const Metric<D>& cell_metric(const Corners& w) {
    int best = 0;
    for (int i = 1; i <= D; ++i)
      if (w[i]->density > w[best]->density) best = i;
    return w[best]->metric;
  }

  [[nodiscard]] static double energy(const Corners& w) {
    std::array<const Vec<D>*, D + 1> x;
    for (int i = 0; i <= D; ++i) x[i] = &w[i]->x;
    return shape_energy<D>(x, cell_metric(w));
  }

  [[nodiscard]] int local_index(Index c, Index v) const {
    for (int i = 0; i <= D; ++i)
      if (cells[c].v[i] == v) return i;
    return -1;
  }
};

}  // namespace lamina::adapt_detail
