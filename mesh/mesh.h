// A simplicial mesh as it is exchanged: triangles in the plane (D = 2) or tetrahedra (D = 3), its boundary
// facets, tags and named fields. The optimizer works on a structure of its own (mesh/adapt) and converts at
// its ends.
#pragma once

#include <array>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/types.h"

namespace lamina {

/// Named values on points or cells, `components` doubles each (1 scalar, D vector, kSymSize<D> symmetric
/// tensor in the order of Sym<D>).
struct MeshField {
  std::string name;
  int components = 1;
  std::vector<double> values;
};

/// Names of tags, as solvers want them.
using TagNames = std::map<Index, std::string>;

/// Parts that the optimizer must leave as they are: their numbers, ascending.
struct RequiredParts {
  std::vector<Index> points, edges, facets, cells;

  [[nodiscard]] bool empty() const {
    return points.empty() && edges.empty() && facets.empty() && cells.empty();
  }
  bool operator==(const RequiredParts&) const = default;
};

template <int D>
struct Mesh {
  std::vector<Vec<D>> points;
  std::vector<std::array<Index, D + 1>> cells;  ///< positive: right-handed (0, 1, 2, 3)
  std::vector<Index> cell_tags;                 ///< one per cell, or empty
  std::vector<std::array<Index, D>> facets;  ///< boundary (and tagged interior) facets; normal points outward
  std::vector<Index> facet_tags;             ///< one per facet, or empty
  std::vector<Index> point_tags;             ///< one per point, or empty
  TagNames cell_names, facet_names;          ///< of tags that have one (materials, walls)
  /// Lines that are kept, in 3D: edges of cells, each once. In 2D there are none, facets are the edges.
  std::vector<std::array<Index, 2>> edges;
  std::vector<Index> edge_tags;      ///< one per edge, or empty
  std::vector<Index> ridges;         ///< the edges that are sharp, ascending
  std::vector<Index> corners;        ///< points that are kept, ascending
  TagNames edge_names, point_names;  ///< of tags that have one
  RequiredParts required;
  std::vector<MeshField> point_fields, cell_fields;

  [[nodiscard]] const MeshField* point_field(const std::string& name) const {
    for (const MeshField& f : point_fields)
      if (f.name == name) return &f;
    return nullptr;
  }
};

using AnyMesh = std::variant<Mesh<2>, Mesh<3>>;

/// Facet i of a positive cell is opposite to vertex i and listed so that its normal points out of the cell.
template <int D>
inline constexpr std::array<std::array<int, D>, D + 1> kCellFacets = [] {
  if constexpr (D == 2) {
    return std::array<std::array<int, 2>, 3>{{{1, 2}, {2, 0}, {0, 1}}};
  } else {
    return std::array<std::array<int, 3>, 4>{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  }
}();

/// Vertex pairs of the edges of a cell.
template <int D>
inline constexpr std::array<std::array<int, 2>, D*(D + 1) / 2> kCellEdges = [] {
  if constexpr (D == 2) {
    return std::array<std::array<int, 2>, 3>{{{0, 1}, {0, 2}, {1, 2}}};
  } else {
    return std::array<std::array<int, 2>, 6>{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
  }
}();

}  // namespace lamina
