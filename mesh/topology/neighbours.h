// The edges of a mesh, vertex by vertex.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "mesh/mesh.h"
#include "mesh/topology/incidence.h"

namespace lamina {

/// Vertices joined to each vertex by an edge, ascending.
struct Neighbours {
  std::vector<std::int64_t> first;
  std::vector<Index> items;

  [[nodiscard]] std::span<const Index> of(std::size_t v) const {
    return {items.data() + first[v], static_cast<std::size_t>(first[v + 1] - first[v])};
  }
};

/// REQUIRES valid indices. Same for every thread count.
template <int D>
Neighbours neighbours(const Mesh<D>& mesh) {
  constexpr std::size_t kChunk = 1024;
  const std::size_t n = mesh.points.size();
  const Incidence cells = incidence(n, mesh.cells);
  const auto gather = [&](std::size_t v, std::vector<Index>& out) {
    out.clear();
    for (const Index c : cells.of(v))
      for (const Index w : mesh.cells[c])
        if (static_cast<std::size_t>(w) != v) out.push_back(w);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
  };
  Neighbours result;
  result.first.assign(n + 1, 0);
  for_each_chunk(n, kChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<Index> around;
    for (std::size_t v = begin; v < end; ++v) {
      gather(v, around);
      result.first[v] = static_cast<std::int64_t>(around.size());
    }
  });
  result.items.resize(static_cast<std::size_t>(exclusive_scan(result.first)));
  for_each_chunk(n, kChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<Index> around;
    for (std::size_t v = begin; v < end; ++v) {
      gather(v, around);
      std::copy(around.begin(), around.end(), result.items.begin() + result.first[v]);
    }
  });
  return result;
}

}  // namespace lamina
