#include "mesh/box_facets.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "mesh/topology/incidence.h"

namespace lamina {
namespace {

template <int D>
using Facet = std::array<Index, D>;

template <int D>
Facet<D> facet_of(const Mesh<D>& mesh, std::size_t cell, std::size_t side) {
  Facet<D> facet;
  for (std::size_t k = 0; k < D; ++k)
    facet[k] = mesh.cells[cell][static_cast<std::size_t>(kCellFacets<D>[side][k])];
  return facet;
}

/// Marks sides of cells that no other cell has, each at its smallest vertex.
template <int D>
std::vector<std::array<bool, D + 1>> boundary_sides(const Mesh<D>& mesh) {
  std::vector<std::array<bool, D + 1>> alone(mesh.cells.size());
  const Incidence cells = incidence(mesh.points.size(), mesh.cells);
  for_each_index(
      mesh.points.size(),
      [&](std::size_t v) {
        std::vector<std::pair<Facet<D>, std::pair<std::size_t, std::size_t>>> around;
        for (const Index c : cells.of(v)) {
          for (std::size_t side = 0; side <= D; ++side) {
            Facet<D> facet = facet_of<D>(mesh, static_cast<std::size_t>(c), side);
            std::sort(facet.begin(), facet.end());
            if (facet[0] == static_cast<Index>(v))
              around.push_back({facet, {static_cast<std::size_t>(c), side}});
          }
        }
        std::sort(around.begin(), around.end());
        for (std::size_t k = 0; k < around.size(); ++k) {
          const bool shared = (k > 0 && around[k - 1].first == around[k].first) ||
                              (k + 1 < around.size() && around[k + 1].first == around[k].first);
          if (!shared) alone[around[k].second.first][around[k].second.second] = true;
        }
      },
      256);
  return alone;
}

template <int D>
Index tag_of(const Mesh<D>& mesh, const Facet<D>& facet, const Box<D>& box) {
  constexpr double kOnFace = 1e-9;  // of the box: ascii files round
  const double near = kOnFace * box.diagonal();
  for (int axis = 0; axis < D; ++axis) {
    for (int upper = 0; upper < 2; ++upper) {
      const double face = upper == 0 ? box.lo[axis] : box.hi[axis];
      const auto on_face = [&](Index v) {
        return std::abs(mesh.points[static_cast<std::size_t>(v)][axis] - face) <= near;
      };
      if (std::all_of(facet.begin(), facet.end(), on_face)) return 2 * axis + upper + 1;
    }
  }
  return 2 * D + 1;
}

}  // namespace

template <int D>
void list_box_facets(Mesh<D>& mesh) {
  Box<D> box;
  for (const auto& cell : mesh.cells)
    for (const Index v : cell) box.extend(mesh.points[static_cast<std::size_t>(v)]);
  const auto alone = boundary_sides<D>(mesh);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    for (std::size_t side = 0; side <= D; ++side)
      if (alone[c][side]) mesh.facets.push_back(facet_of<D>(mesh, c, side));
  mesh.facet_tags.resize(mesh.facets.size());
  for_each_index(mesh.facets.size(),
                 [&](std::size_t f) { mesh.facet_tags[f] = tag_of<D>(mesh, mesh.facets[f], box); });
  for (const Index tag : mesh.facet_tags)
    mesh.facet_names.try_emplace(
        tag, tag <= 2 * D ? kBoxFaceNames[static_cast<std::size_t>(tag - 1)] : "boundary");
}

template <int D>
std::int64_t list_missing_facets(Mesh<D>& mesh) {
  std::vector<Facet<D>> listed = mesh.facets;
  for (Facet<D>& facet : listed) std::sort(facet.begin(), facet.end());
  std::sort(listed.begin(), listed.end());
  const auto before = static_cast<std::int64_t>(mesh.facets.size());
  const auto alone = boundary_sides<D>(mesh);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (std::size_t side = 0; side <= D; ++side) {
      if (!alone[c][side]) continue;
      Facet<D> key = facet_of<D>(mesh, c, side);
      std::sort(key.begin(), key.end());
      if (!std::binary_search(listed.begin(), listed.end(), key))
        mesh.facets.push_back(facet_of<D>(mesh, c, side));
    }
  }
  if (!mesh.facet_tags.empty()) mesh.facet_tags.resize(mesh.facets.size(), 0);
  return static_cast<std::int64_t>(mesh.facets.size()) - before;
}

template void list_box_facets(Mesh<2>&);
template void list_box_facets(Mesh<3>&);
template std::int64_t list_missing_facets(Mesh<2>&);
template std::int64_t list_missing_facets(Mesh<3>&);

}  // namespace lamina
