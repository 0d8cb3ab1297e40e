// The piece of a mesh that one task adapts: cells with adjacency, vertices with metric and constraints.
//
// Facets that the piece shares with the rest of the mesh are frozen: no operation changes them, which is what
// lets pieces be adapted at the same time. Neighbour codes: >= 0 a cell of the piece, kInterface the rest of
// the mesh, boundary_code(tag) the boundary of the domain.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina::adapt_detail {

inline constexpr Index kInterface = -1;
constexpr Index boundary_code(int tag) { return -1 - tag; }  ///< tag in 1..31
constexpr bool is_boundary(Index neighbor) { return neighbor < kInterface; }
constexpr int boundary_tag(Index neighbor) { return -1 - neighbor; }

/// Above this quality the rounding error of the volume in metric space cannot reach its sign (aspect ratios
/// to 1e9).
inline constexpr double kSignIsSafe = 1e-4;

/// Set of boundary tags a vertex, edge or facet lies on, as bits.
using TagSet = std::uint32_t;
constexpr TagSet tag_bit(int tag) { return TagSet{1} << tag; }

template <int D>
struct LocalMesh {
  struct Vertex {
    Vec<D> x;
    Metric<D> metric;
    double density = 0.0;  ///< sqrt(det metric), cached
    TagSet tags = 0;
    Index cell = kNone;      ///< one of its cells; < 0: removed
    bool frozen = false;     ///< on an interface
    int changed = 0;         ///< last pass in which its cells, position or metric changed, or it was frozen
    std::uint32_t mark = 0;  ///< scratch of Cavity
  };
  struct Cell {
    std::array<Index, D + 1> v;  ///< v[0] == kNone: removed
    std::array<Index, D + 1> n;  ///< across the facet opposite to v[i]
    double quality = 0.0;
    std::uint32_t mark = 0;
  };

  std::vector<Vertex> vertices;
  std::vector<Cell> cells;
  std::vector<Index> free_cells, free_vertices;
  std::array<Vec<D>, 32> normals;  ///< unit normal of the plane of each boundary tag
  std::uint32_t stamp = 0;         ///< cells with mark == stamp belong to the current cavity
  std::uint32_t vertex_stamp = 0;  ///< the same for marks of vertices

  int pass = 0;  ///< number of the current pass

  /// What was tried in the last pass and is unchanged since would fail again.
  [[nodiscard]] bool active(Index v) const { return vertices[v].changed >= pass - 1; }

  [[nodiscard]] bool alive(Index c) const { return cells[c].v[0] != kNone; }

  [[nodiscard]] double length(Index a, Index b) const {
    return edge_length<D>(vertices[a].x, vertices[a].metric, vertices[b].x, vertices[b].metric);
  }

  /// Quality of the cell with these vertices, with the first one replaced by p when p is not null.
  [[nodiscard]] double quality(const std::array<Index, D + 1>& v, const Vertex* p = nullptr) const {
    std::array<const Vertex*, D + 1> w;
    for (int i = 0; i <= D; ++i) w[i] = &vertices[v[i]];
    if (p) w[0] = p;
    return quality(w);
  }

  [[nodiscard]] double quality(const std::array<const Vertex*, D + 1>& w) const {
    int best = 0;
    for (int i = 1; i <= D; ++i)
      if (w[i]->density > w[best]->density) best = i;
    std::array<const Vec<D>*, D + 1> x;
    for (int i = 0; i <= D; ++i) x[i] = &w[i]->x;
    return mean_ratio<D>(x, w[best]->metric);
  }

  [[nodiscard]] int local_index(Index c, Index v) const {
    for (int i = 0; i <= D; ++i)
      if (cells[c].v[i] == v) return i;
    return -1;
  }
};

}  // namespace lamina::adapt_detail
