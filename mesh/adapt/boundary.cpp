// Facets of one cell are the boundary. They are grouped into flat pieces, the largest facets first: these
// tell their plane best, and whether a small or thin facet lies in it is decided by the distance of its
// vertices, which does not suffer from its own badly known normal.
#include "mesh/adapt/boundary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/words.h"
#include "mesh/topology/incidence.h"

namespace lamina::adapt_detail {
namespace {

constexpr std::uint8_t kSomeBoundary = 1;  // before pieces are known

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

/// Marks facets of exactly one cell in global.facet_tags. Each facet is judged at its smallest vertex.
template <int D>
void mark_boundary(GlobalMesh<D>& global) {
  global.facet_tags.assign(global.cells.size(), {});
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
          if (alone) global.facet_tags[around[k].second.first][around[k].second.second] = kSomeBoundary;
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
struct BoundaryFacet {
  Facet<D> vertices;
  Index cell = kNone;
  int side = 0;
  Index tag = 0;
  Vec<D> area = Vec<D>::Zero();  ///< normal times a multiple of the area
};

template <int D>
std::vector<BoundaryFacet<D>> boundary_facets(const GlobalMesh<D>& global, const ListedTags<D>& listed) {
  std::vector<BoundaryFacet<D>> out;
  for (std::size_t c = 0; c < global.cells.size(); ++c) {
    for (int i = 0; i <= D; ++i) {
      if (global.facet_tags[c][i] == 0) continue;
      const Facet<D> f = facet_of<D>(global.cells[c], i);
      const Vec<D> e = global.x[f[1]] - global.x[f[0]];
      Vec<D> area;
      if constexpr (D == 2)
        area = Vec2(e[1], -e[0]);
      else
        area = e.cross(Vec3(global.x[f[2]] - global.x[f[0]]));
      out.push_back({f, static_cast<Index>(c), i, listed.of(f), area});
    }
  }
  return out;
}

template <int D>
struct Plane {
  Index tag;
  Vec<D> normal, point;
};

template <int D>
bool lies_in(const BoundaryFacet<D>& f, const Plane<D>& plane, const GlobalMesh<D>& global,
             double tolerance) {
  if (f.tag != plane.tag || plane.normal.dot(f.area) < 0.0) return false;
  return std::all_of(f.vertices.begin(), f.vertices.end(), [&](Index v) {
    return std::abs(plane.normal.dot(global.x[v] - plane.point)) <= tolerance;
  });
}

/// Numbers the flat pieces and gives their numbers to facets and vertices.
template <int D>
void find_pieces(GlobalMesh<D>& global, const std::vector<BoundaryFacet<D>>& facets, BoundaryTags& tags) {
  constexpr std::size_t kMostPieces = 31;
  constexpr double kFlat = 1e-9;  // of the diagonal: far above rounding, far below any element
  std::vector<std::size_t> order(facets.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return facets[a].area.squaredNorm() > facets[b].area.squaredNorm();
  });
  const double tolerance = kFlat * global.bounds.diagonal();
  std::vector<Plane<D>> planes;
  std::vector<std::size_t> plane_of(facets.size());
  for (const std::size_t i : order) {
    const BoundaryFacet<D>& f = facets[i];
    const auto found = std::find_if(planes.begin(), planes.end(),
                                    [&](const Plane<D>& p) { return lies_in(f, p, global, tolerance); });
    plane_of[i] = static_cast<std::size_t>(found - planes.begin());
    if (found != planes.end()) continue;
    if (planes.size() == kMostPieces)
      throw Error(
          ErrorCode::kAdapt,
          fmt::format("the boundary has more than {} flat pieces: curved boundaries cannot be adapted",
                      kMostPieces));
    planes.push_back({f.tag, f.area.normalized(), global.x[f.vertices[0]]});
  }
  // Pieces in the order of their tags, those of one tag in that of their largest facets.
  std::vector<std::size_t> by_tag(planes.size()), number(planes.size());
  std::iota(by_tag.begin(), by_tag.end(), std::size_t{0});
  std::stable_sort(by_tag.begin(), by_tag.end(),
                   [&](std::size_t a, std::size_t b) { return planes[a].tag < planes[b].tag; });
  global.normals.fill(Vec<D>::Zero());
  for (const std::size_t p : by_tag) {
    number[p] = tags.of_piece.size();
    global.normals[number[p]] = planes[p].normal;
    tags.of_piece.push_back(planes[p].tag);
  }
  for (std::size_t i = 0; i < facets.size(); ++i) {
    const std::size_t piece = number[plane_of[i]];
    global.facet_tags[facets[i].cell][facets[i].side] = static_cast<std::uint8_t>(piece);
    for (const Index v : facets[i].vertices) global.tags[v] |= tag_bit(static_cast<int>(piece));
  }
}

}  // namespace

template <int D>
GlobalMesh<D> import_mesh(const Mesh<D>& mesh, BoundaryTags& tags) {
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
  global.tags.assign(mesh.points.size(), 0);
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
  find_pieces(global, facets, tags);
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
      const std::uint8_t piece = global.facet_tags[c][i];
      if (piece == 0) continue;
      mesh.facets.push_back(facet_of<D>(global.cells[c], i));
      if (tags.tagged)
        mesh.facet_tags.push_back(tags.of_piece[piece]);
      else if (!tags.listed)
        mesh.facet_tags.push_back(piece);
    }
  }
}

template GlobalMesh<2> import_mesh(const Mesh<2>&, BoundaryTags&);
template GlobalMesh<3> import_mesh(const Mesh<3>&, BoundaryTags&);
template void export_mesh(const GlobalMesh<2>&, const BoundaryTags&, Mesh<2>&);
template void export_mesh(const GlobalMesh<3>&, const BoundaryTags&, Mesh<3>&);

}  // namespace lamina::adapt_detail
