// Facets of one cell are the boundary.
#include "mesh/adapt/boundary.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/words.h"
#include "mesh/adapt/pieces.h"
#include "mesh/topology/incidence.h"

namespace lamina::adapt_detail {
namespace {

constexpr PieceId kSomeBoundary = 1;  // before pieces are known

template <int D>
using Facet = std::array<Index, D>;

template <int D>
Facet<D> facet_of(const std::array<Index, D + 1>& cell, int i) {
  Facet<D> f;
  for (int k = 0; k < D; ++k) f[k] = cell[kCellFacets<D>[i][k]];
  return f;
}

template <int D>
Facet<D> sorted(Facet<D> f) {
  std::sort(f.begin(), f.end());
  return f;
}

/// Marks facets of exactly one cell in global.facet_pieces. Each facet is judged at its smallest vertex.
template <int D>
void mark_boundary(GlobalMesh<D>& global) {
  global.facet_pieces.assign(global.cells.size(), {});
  const Incidence cells = incidence(global.x.size(), global.cells);
  for_each_index(
      global.x.size(),
      [&](std::size_t v) {
        std::vector<std::pair<Facet<D>, std::pair<Index, int>>> around;
        for (const Index c : cells.of(v)) {
          for (int i = 0; i <= D; ++i) {
            const Facet<D> f = sorted<D>(facet_of<D>(global.cells[c], i));
            if (f[0] == static_cast<Index>(v)) around.push_back({f, {c, i}});
          }
        }
        std::sort(around.begin(), around.end());
        for (std::size_t k = 0; k < around.size(); ++k) {
          const bool alone = (k == 0 || around[k - 1].first != around[k].first) &&
                             (k + 1 == around.size() || around[k + 1].first != around[k].first);
          if (alone) global.facet_pieces[around[k].second.first][around[k].second.second] = kSomeBoundary;
        }
      },
      256);
}

/// The tags that the input lists for facets, in the order of their sorted vertices.
template <int D>
class ListedTags {
 public:
  explicit ListedTags(const Mesh<D>& mesh) {
    list_.reserve(mesh.facets.size());
    for (std::size_t f = 0; f < mesh.facets.size(); ++f)
      list_.push_back({sorted<D>(mesh.facets[f]), mesh.facet_tags.empty() ? 0 : mesh.facet_tags[f]});
    std::sort(list_.begin(), list_.end());
  }
  /// 0 where the input says nothing.
  [[nodiscard]] Index of(const Facet<D>& facet) const {
    const Facet<D> key = sorted<D>(facet);
    const auto at = std::lower_bound(list_.begin(), list_.end(), std::pair<Facet<D>, Index>(key, kLowest));
    return at != list_.end() && at->first == key ? at->second : 0;
  }
  [[nodiscard]] std::size_t tagged() const {
    return static_cast<std::size_t>(
        std::count_if(list_.begin(), list_.end(), [](const auto& entry) { return entry.second != 0; }));
  }

 private:
  static constexpr Index kLowest = std::numeric_limits<Index>::min();
  std::vector<std::pair<Facet<D>, Index>> list_;
};

template <int D>
std::vector<BoundaryFacet<D>> boundary_facets(const GlobalMesh<D>& global, const ListedTags<D>& listed) {
  std::vector<BoundaryFacet<D>> out;
  for (std::size_t c = 0; c < global.cells.size(); ++c) {
    for (int i = 0; i <= D; ++i) {
      if (global.facet_pieces[c][i] == 0) continue;
      const Facet<D> f = facet_of<D>(global.cells[c], i);
      std::array<Vec<D>, D> x;
      for (int k = 0; k < D; ++k) x[k] = global.x[f[k]];
      out.push_back({f, static_cast<Index>(c), i, listed.of(f), area_vector<D>(x)});
    }
  }
  return out;
}

}  // namespace

template <int D>
GlobalMesh<D> import_mesh(const Mesh<D>& mesh, const AdaptOptions& options, BoundaryTags& tags) {
  if (mesh.cells.empty()) throw Error(ErrorCode::kAdapt, "the mesh has no cells");
  tags = {};
  tags.listed = !mesh.facets.empty();
  tags.tagged = !mesh.facet_tags.empty();
  if (!mesh.cell_tags.empty() && std::adjacent_find(mesh.cell_tags.begin(), mesh.cell_tags.end(),
                                                    std::not_equal_to<>()) == mesh.cell_tags.end())
    tags.cell_tags = {mesh.cell_tags.front()};
  GlobalMesh<D> global;
  global.x = mesh.points;
  global.cells = mesh.cells;
  for (const Vec<D>& x : global.x) global.bounds.extend(x);
  mark_boundary(global);
  const ListedTags<D> listed(mesh);
  const std::vector<BoundaryFacet<D>> facets = boundary_facets(global, listed);
  const auto on_boundary = static_cast<std::size_t>(
      std::count_if(facets.begin(), facets.end(), [](const auto& f) { return f.tag != 0; }));
  if (on_boundary < listed.tagged())
    throw Error(ErrorCode::kAdapt, counted(static_cast<std::int64_t>(listed.tagged() - on_boundary),
                                           "tagged facet lies", "tagged facets lie") +
                                       " inside the mesh: interfaces within a mesh cannot be adapted");
  const double tolerance =
      options.hausdorff > 0.0 ? options.hausdorff : kHausdorffShare * global.bounds.diagonal();
  Pieces<D> pieces = find_pieces<D>(global.x, facets, tolerance, options.ridge_angle);
  for (std::size_t f = 0; f < facets.size(); ++f)
    global.facet_pieces[facets[f].cell][facets[f].side] = pieces.of_facet[f];
  global.pieces = std::move(pieces.of_point);
  tags.of_piece = std::move(pieces.tags);
  global.shape = std::make_shared<const BoundaryShape<D>>(std::move(pieces.shape));
  return global;
}

template <int D>
void export_mesh(const GlobalMesh<D>& global, const BoundaryTags& tags, Mesh<D>& mesh) {
  Mesh<D> adapted;
  adapted.cell_names = std::move(mesh.cell_names);
  if (tags.tagged) adapted.facet_names = std::move(mesh.facet_names);
  mesh = std::move(adapted);
  mesh.points = global.x;
  mesh.cells = global.cells;
  if (!tags.cell_tags.empty()) mesh.cell_tags.assign(mesh.cells.size(), tags.cell_tags.front());
  for (std::size_t c = 0; c < global.cells.size(); ++c) {
    for (int i = 0; i <= D; ++i) {
      const PieceId piece = global.facet_pieces[c][i];
      if (piece == 0) continue;
      mesh.facets.push_back(facet_of<D>(global.cells[c], i));
      if (tags.tagged)
        mesh.facet_tags.push_back(tags.of_piece[piece]);
      else if (!tags.listed)
        mesh.facet_tags.push_back(piece);
    }
  }
}

template GlobalMesh<2> import_mesh(const Mesh<2>&, const AdaptOptions&, BoundaryTags&);
template GlobalMesh<3> import_mesh(const Mesh<3>&, const AdaptOptions&, BoundaryTags&);
template void export_mesh(const GlobalMesh<2>&, const BoundaryTags&, Mesh<2>&);
template void export_mesh(const GlobalMesh<3>&, const BoundaryTags&, Mesh<3>&);

}  // namespace lamina::adapt_detail
