// Test meshes: a box of n^D grid cells, each cut into D! simplices along its main diagonal (Kuhn), with its
// boundary facets tagged by box face.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>

#include "mesh/mesh.h"

namespace lamina {

/// A number in [-1, 1) as a function of its arguments.
inline double noise(std::uint64_t a, std::uint64_t b) {
  std::uint64_t h = a * 0x9e3779b97f4a7c15ull + b * 0xbf58476d1ce4e5b9ull + 0x94d049bb133111ebull;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((h ^ (h >> 31)) >> 11) * 0x1p-52 - 1.0;
}

/// Facets that belong to one cell, tagged 1..2D by the face of the box they lie in.
template <int D>
void list_boundary(Mesh<D>& mesh, const Box<D>& box) {
  std::map<std::array<Index, D>, std::pair<int, std::array<Index, D>>> seen;
  for (const auto& cell : mesh.cells) {
    for (const auto& corners : kCellFacets<D>) {
      std::array<Index, D> facet;
      for (int k = 0; k < D; ++k) facet[k] = cell[corners[k]];
      std::array<Index, D> key = facet;
      std::sort(key.begin(), key.end());
      auto& entry = seen[key];
      ++entry.first;
      entry.second = facet;
    }
  }
  for (const auto& [key, entry] : seen) {
    if (entry.first != 1) continue;
    int tag = 0;
    for (int axis = 0; axis < D; ++axis) {
      for (int side = 0; side < 2; ++side) {
        const double face = side == 0 ? box.lo[axis] : box.hi[axis];
        if (std::all_of(key.begin(), key.end(), [&](Index v) { return mesh.points[v][axis] == face; }))
          tag = 1 + 2 * axis + side;
      }
    }
    mesh.facets.push_back(entry.second);
    mesh.facet_tags.push_back(tag);
  }
}

/// n^D grid cells in [0, 1]^D; inner points moved by `shake` times the spacing (up to about 0.15 keeps cells
/// positive).
template <int D>
Mesh<D> lattice(int n, double shake = 0.0) {
  Mesh<D> mesh;
  const int side = n + 1;
  const int count = D == 2 ? side * side : side * side * side;
  for (int i = 0; i < count; ++i) {
    Vec<D> x;
    for (int k = 0, rest = i; k < D; ++k, rest /= side) {
      const int g = rest % side;
      x[k] = static_cast<double>(g) / n;
      if (g > 0 && g < n)
        x[k] += shake / n * noise(static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(k));
    }
    mesh.points.push_back(x);
  }
  for (int i = 0; i < count; ++i) {
    bool inside = true;
    for (int k = 0, rest = i; k < D; ++k, rest /= side) inside = inside && rest % side < n;
    if (!inside) continue;
    std::array<int, D> axes;
    std::iota(axes.begin(), axes.end(), 0);
    do {
      std::array<Index, D + 1> cell;
      cell[0] = i;
      int inversions = 0;
      for (int k = 0; k < D; ++k) {
        const int stride = axes[k] == 0 ? 1 : (axes[k] == 1 ? side : side * side);
        cell[k + 1] = cell[k] + stride;
        for (int j = 0; j < k; ++j) inversions += axes[j] > axes[k];
      }
      if (inversions % 2 == 1) std::swap(cell[D - 1], cell[D]);
      mesh.cells.push_back(cell);
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
  list_boundary(mesh, Box<D>{Vec<D>::Zero(), Vec<D>::Ones()});
  return mesh;
}

}  // namespace lamina
