// Which simplices touch a vertex: one counting sort, 4 bytes an entry, from which edges and facets are found
// vertex by vertex without a table of all of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "mesh/mesh.h"

namespace lamina {

struct Incidence {
  std::vector<std::int64_t> first;  ///< of vertex v in `items`; one more entry than there are vertices
  std::vector<Index> items;         ///< ascending for each vertex

  [[nodiscard]] std::span<const Index> of(std::size_t v) const {
    return {items.data() + first[v], static_cast<std::size_t>(first[v + 1] - first[v])};
  }
};

/// Vertices to simplices. Simplices for which skip(i) holds are left out; REQUIRES the indices of the others
/// in [0, vertices). Serial, time and memory linear.
template <std::size_t N, class Skip>
Incidence incidence(std::size_t vertices, const std::vector<std::array<Index, N>>& simplices, Skip&& skip) {
  Incidence result;
  result.first.assign(vertices + 1, 0);
  for (std::size_t i = 0; i < simplices.size(); ++i)
    if (!skip(i))
      for (const Index v : simplices[i]) ++result.first[v];
  result.items.resize(static_cast<std::size_t>(exclusive_scan(result.first)));
  for (std::size_t i = 0; i < simplices.size(); ++i)
    if (!skip(i))
      for (const Index v : simplices[i]) result.items[result.first[v]++] = static_cast<Index>(i);
  // Each start has moved on to the next one's.
  for (std::size_t v = vertices; v > 0; --v) result.first[v] = result.first[v - 1];
  result.first[0] = 0;
  return result;
}

template <std::size_t N>
Incidence incidence(std::size_t vertices, const std::vector<std::array<Index, N>>& simplices) {
  return incidence(vertices, simplices, [](std::size_t) { return false; });
}

/// The vertices above v that share a cell with it, ascending: every edge comes once, at its lower vertex.
/// `cells` is the incidence of the mesh's cells.
template <int D>
void upper_neighbours(const Mesh<D>& mesh, const Incidence& cells, std::size_t v, std::vector<Index>& out) {
  out.clear();
  for (const Index c : cells.of(v))
    for (const Index w : mesh.cells[c])
      if (static_cast<std::size_t>(w) > v) out.push_back(w);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
}

}  // namespace lamina
