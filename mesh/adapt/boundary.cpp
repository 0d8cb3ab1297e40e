// Facets of one cell are the outer boundary, those of cells in two regions the inner one.
#include "mesh/adapt/boundary.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/words.h"
#include "mesh/adapt/pieces.h"
#include "mesh/topology/incidence.h"

namespace lamina::adapt_detail {
namespace {

// Before pieces are known.
constexpr PieceId kSomeOuter = 1, kSomeInner = 2;
constexpr std::size_t kMostRegions = std::numeric_limits<PieceId>::max();

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

template <int D>
struct Found {
  Facet<D> key;  ///< sorted
  CellSide at;

  bool operator<(const Found& o) const {
    return std::tie(key, at.cell, at.side) < std::tie(o.key, o.at.cell, o.at.side);
  }
};

/// Calls visit(begin, end) with the sides of each facet whose smallest vertex is v.
template <int D, class Visit>
void visit_facets(const GlobalMesh<D>& global, const Incidence& cells, std::size_t v, Visit&& visit) {
  std::vector<Found<D>> around;
  for (const Index c : cells.of(v)) {
    for (int i = 0; i <= D; ++i) {
      const Facet<D> f = sorted<D>(facet_of<D>(global.cells[c], i));
      if (f[0] == static_cast<Index>(v)) around.push_back({f, {c, i}});
    }
  }
  std::sort(around.begin(), around.end());
  for (std::size_t begin = 0, end = 0; begin < around.size(); begin = end) {
    while (end < around.size() && around[end].key == around[begin].key) ++end;
    visit(around.data() + begin, around.data() + end);
  }
}

template <int D>
PieceId region_of(const GlobalMesh<D>& global, Index cell) {
  return global.regions.empty() ? PieceId{0} : global.regions[cell];
}

/// Marks facets of exactly one cell, and those of cells in two regions, in global.facet_pieces.
template <int D>
void mark_boundaries(GlobalMesh<D>& global, const Incidence& cells) {
  global.facet_pieces.assign(global.cells.size(), {});
  for_each_index(
      global.x.size(),
      [&](std::size_t v) {
        visit_facets(global, cells, v, [&](const Found<D>* begin, const Found<D>* end) {
          const bool outer = end - begin == 1;
          if (!outer && region_of(global, begin->at.cell) == region_of(global, end[-1].at.cell)) return;
          for (const Found<D>* f = begin; f != end; ++f)
            global.facet_pieces[f->at.cell][f->at.side] = outer ? kSomeOuter : kSomeInner;
        });
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
  /// `otherwise` where the input says nothing.
  [[nodiscard]] Index of(const Facet<D>& facet, Index otherwise) const {
    const Facet<D> key = sorted<D>(facet);
    const auto at = std::lower_bound(list_.begin(), list_.end(), std::pair<Facet<D>, Index>(key, kLowest));
    return at != list_.end() && at->first == key ? at->second : otherwise;
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
std::string at_center(const GlobalMesh<D>& global, const Facet<D>& facet) {
  Vec<D> x = Vec<D>::Zero();
  for (const Index v : facet) x += global.x[v] / D;
  return fmt::format("({:.6g})", fmt::join(x.data(), x.data() + D, ", "));
}

/// The cells of each tag are a region.
template <int D>
void number_regions(const std::vector<Index>& cell_tags, GlobalMesh<D>& global, BoundaryTags& tags) {
  tags.cell_tags = cell_tags;
  std::sort(tags.cell_tags.begin(), tags.cell_tags.end());
  tags.cell_tags.erase(std::unique(tags.cell_tags.begin(), tags.cell_tags.end()), tags.cell_tags.end());
  if (tags.cell_tags.size() < 2) return;
  if (tags.cell_tags.size() > kMostRegions)
    throw Error(ErrorCode::kAdapt,
                fmt::format("the cells have {} different tags: no more than {} can be kept apart",
                            tags.cell_tags.size(), kMostRegions));
  global.regions.resize(global.cells.size());
  for_each_index(global.cells.size(), [&](std::size_t c) {
    const auto at = std::lower_bound(tags.cell_tags.begin(), tags.cell_tags.end(), cell_tags[c]);
    global.regions[c] = static_cast<PieceId>(at - tags.cell_tags.begin());
  });
}

/// The parts of regions that the tagged facets within cut them into become regions of their own. Errors:
/// kAdapt when such a facet has one of them on both sides.
template <int D>
void cut_regions(const ListedTags<D>& listed, const Incidence& cells, GlobalMesh<D>& global,
                 BoundaryTags& tags) {
  std::vector<Index> part(global.cells.size());
  std::iota(part.begin(), part.end(), 0);
  const auto root = [&](Index c) {
    while (part[c] != c) c = part[c] = part[part[c]];
    return c;
  };
  const auto for_each_inside = [&](bool tagged, auto&& visit) {
    for (std::size_t v = 0; v < global.x.size(); ++v) {
      visit_facets(global, cells, v, [&](const Found<D>* begin, const Found<D>* end) {
        if (end - begin == 2 && (listed.of(begin->key, 0) != 0) == tagged)
          visit(begin->key, begin[0].at.cell, begin[1].at.cell);
      });
    }
  };
  for_each_inside(false, [&](const Facet<D>&, Index a, Index b) {
    if (region_of(global, a) != region_of(global, b)) return;
    a = root(a);
    b = root(b);
    part[std::max(a, b)] = std::min(a, b);
  });
  std::int64_t loose = 0;
  std::string first;
  for_each_inside(true, [&](const Facet<D>& f, Index a, Index b) {
    if (root(a) == root(b) && loose++ == 0) first = at_center<D>(global, f);
  });
  if (loose > 0)
    throw Error(
        ErrorCode::kAdapt,
        fmt::format("{} inside a region of the mesh without cutting it in two, the first at {}: only "
                    "facets on the boundary of the mesh, between cell tags, or all around a part of it "
                    "can be kept",
                    counted(loose, "tagged facet lies", "tagged facets lie"), first));
  std::vector<std::pair<PieceId, Index>> roots;
  for (Index c = 0; c < static_cast<Index>(part.size()); ++c)
    if (root(c) == c) roots.emplace_back(region_of(global, c), c);
  std::sort(roots.begin(), roots.end());
  if (roots.size() > kMostRegions)
    throw Error(ErrorCode::kAdapt,
                fmt::format("tagged facets cut the mesh into {} parts: no more than {} can be kept apart",
                            roots.size(), kMostRegions));
  std::vector<Index> cell_tags;
  std::vector<PieceId> regions(part.size());
  for (const auto& [region, c] : roots) {
    regions[c] = static_cast<PieceId>(cell_tags.size());
    cell_tags.push_back(tags.cell_tags.empty() ? 0 : tags.cell_tags[region]);
  }
  for (Index c = 0; c < static_cast<Index>(part.size()); ++c) regions[c] = regions[root(c)];
  global.regions = std::move(regions);
  if (!tags.cell_tags.empty()) tags.cell_tags = std::move(cell_tags);
}

template <int D>
BoundaryFacet<D> boundary_facet(const GlobalMesh<D>& global, CellSide at) {
  BoundaryFacet<D> facet;
  facet.vertices = facet_of<D>(global.cells[at.cell], at.side);
  facet.at = at;
  std::array<Vec<D>, D> x;
  for (int k = 0; k < D; ++k) x[k] = global.x[facet.vertices[k]];
  facet.area = area_vector<D>(x);
  return facet;
}

/// The outer ones, in the order of their cells, then the inner ones.
template <int D>
std::vector<BoundaryFacet<D>> boundary_facets(const GlobalMesh<D>& global, const ListedTags<D>& listed) {
  std::vector<BoundaryFacet<D>> out;
  std::vector<Found<D>> inner;
  for (std::size_t c = 0; c < global.cells.size(); ++c) {
    for (int i = 0; i <= D; ++i) {
      if (global.facet_pieces[c][i] == 0) continue;
      const CellSide at{static_cast<Index>(c), i};
      if (global.facet_pieces[c][i] == kSomeInner) {
        inner.push_back({sorted<D>(facet_of<D>(global.cells[c], i)), at});
        continue;
      }
      out.push_back(boundary_facet<D>(global, at));
      out.back().tag = listed.of(out.back().vertices, 0);
    }
  }
  std::sort(inner.begin(), inner.end());
  for (std::size_t k = 0; k < inner.size(); k += 2) {
    CellSide at = inner[k].at, beyond = inner[k + 1].at;
    if (global.regions[at.cell] > global.regions[beyond.cell]) std::swap(at, beyond);
    out.push_back(boundary_facet<D>(global, at));
    out.back().beyond = beyond;
    out.back().regions = {global.regions[at.cell], global.regions[beyond.cell]};
    out.back().tag = listed.of(inner[k].key, kUnlisted);
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
  GlobalMesh<D> global;
  global.x = mesh.points;
  global.cells = mesh.cells;
  for (const Vec<D>& x : global.x) global.bounds.extend(x);
  number_regions(mesh.cell_tags, global, tags);
  if (!options.keep_cell_tags && !global.regions.empty()) {
    global.regions.clear();
    tags.cell_tags.clear();
  }
  const Incidence cells = incidence(global.x.size(), global.cells);
  mark_boundaries(global, cells);
  const ListedTags<D> listed(mesh);
  std::vector<BoundaryFacet<D>> facets = boundary_facets(global, listed);
  const auto kept = static_cast<std::size_t>(std::count_if(
      facets.begin(), facets.end(), [](const auto& f) { return f.tag != 0 && f.tag != kUnlisted; }));
  if (kept < listed.tagged()) {
    cut_regions(listed, cells, global, tags);
    mark_boundaries(global, cells);
    facets = boundary_facets(global, listed);
  }
  const double tolerance =
      options.hausdorff > 0.0 ? options.hausdorff : kHausdorffShare * global.bounds.diagonal();
  Pieces<D> pieces = find_pieces<D>(global.x, facets, tolerance, options.ridge_angle);
  for (std::size_t f = 0; f < facets.size(); ++f)
    for (const CellSide& side : {facets[f].at, facets[f].beyond})
      if (side.cell != kNone) global.facet_pieces[side.cell][side.side] = pieces.of_facet[f];
  if (lists_kept_parts(mesh)) {
    FoundLines<D> found = find_lines<D>(mesh, facets, pieces, cells, options.ridge_angle);
    global.kept = std::move(found.kept);
    tags.lines = std::move(found.kinds);
    const auto tags_of = [&](const std::vector<Index>& points) {
      std::vector<Index> list;
      for (const Index v : points) list.push_back(mesh.point_tags.empty() ? 0 : mesh.point_tags[v]);
      return list;
    };
    tags.corner_tags = tags_of(global.kept.corners);
    tags.required_point_tags = tags_of(global.kept.points);
  }
  global.pieces = std::move(pieces.of_point);
  tags.of_piece = std::move(pieces.tags);
  global.shape = std::make_shared<const BoundaryShape<D>>(std::move(pieces.shape));
  return global;
}

namespace {

/// Edges of lines, corners and required parts.
template <int D>
void export_kept(const KeptParts<D>& kept, const BoundaryTags& tags, Mesh<D>& mesh) {
  for (const LineEdge& edge : kept.lines) {
    const LineKind kind = tags.lines[edge.line - kFirstLine];
    if ((kind.flags & LineKind::kListed) == 0) continue;
    const auto number = static_cast<Index>(mesh.edges.size());
    mesh.edges.push_back({edge.a, edge.b});
    mesh.edge_tags.push_back(kind.tag);
    if ((kind.flags & LineKind::kSharp) != 0) mesh.ridges.push_back(number);
    if ((kind.flags & LineKind::kRequired) != 0) mesh.required.edges.push_back(number);
  }
  const auto none = [](Index tag) { return tag == 0; };
  if (std::all_of(mesh.edge_tags.begin(), mesh.edge_tags.end(), none)) mesh.edge_tags.clear();
  mesh.corners = kept.corners;
  mesh.required.points = kept.points;
  const auto tag_points = [&](const std::vector<Index>& points, const std::vector<Index>& point_tags) {
    if (std::all_of(point_tags.begin(), point_tags.end(), none)) return;
    mesh.point_tags.resize(mesh.points.size());
    for (std::size_t i = 0; i < points.size(); ++i) mesh.point_tags[points[i]] = point_tags[i];
  };
  tag_points(kept.corners, tags.corner_tags);
  tag_points(kept.points, tags.required_point_tags);
  std::sort(mesh.corners.begin(), mesh.corners.end());
  std::sort(mesh.required.points.begin(), mesh.required.points.end());
  std::vector<Facet<D>> wanted;
  for (const Facet<D>& f : kept.facets) wanted.push_back(sorted<D>(f));
  std::sort(wanted.begin(), wanted.end());
  for (std::size_t f = 0; f < mesh.facets.size() && !wanted.empty(); ++f)
    if (std::binary_search(wanted.begin(), wanted.end(), sorted<D>(mesh.facets[f])))
      mesh.required.facets.push_back(static_cast<Index>(f));
}

}  // namespace

template <int D>
void export_mesh(const GlobalMesh<D>& global, const BoundaryTags& tags, Mesh<D>& mesh) {
  Mesh<D> adapted;
  adapted.cell_names = std::move(mesh.cell_names);
  if (tags.tagged) adapted.facet_names = std::move(mesh.facet_names);
  adapted.edge_names = std::move(mesh.edge_names);
  adapted.point_names = std::move(mesh.point_names);
  mesh = std::move(adapted);
  mesh.points = global.x;
  mesh.cells = global.cells;
  if (!tags.cell_tags.empty()) {
    mesh.cell_tags.resize(mesh.cells.size());
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
      mesh.cell_tags[c] = tags.cell_tags[region_of(global, static_cast<Index>(c))];
  }
  const auto list = [&](const CellSide& at) {
    const PieceId piece = global.facet_pieces[at.cell][at.side];
    mesh.facets.push_back(facet_of<D>(global.cells[at.cell], at.side));
    if (tags.tagged)
      mesh.facet_tags.push_back(tags.of_piece[piece]);
    else if (!tags.listed)
      mesh.facet_tags.push_back(piece);
  };
  std::vector<Found<D>> inner;
  for (std::size_t c = 0; c < global.cells.size(); ++c) {
    for (int i = 0; i <= D; ++i) {
      const PieceId piece = global.facet_pieces[c][i];
      const CellSide at{static_cast<Index>(c), i};
      if (piece == 0 || tags.of_piece[piece] == kUnlisted) continue;
      if (global.shape->is_inner(piece))
        inner.push_back({sorted<D>(facet_of<D>(global.cells[c], i)), at});
      else
        list(at);
    }
  }
  std::sort(inner.begin(), inner.end());
  for (std::size_t k = 0; k < inner.size(); k += 2) {
    const CellSide &a = inner[k].at, &b = inner[k + 1].at;
    list(global.regions[a.cell] < global.regions[b.cell] ? a : b);
  }
  export_kept(global.kept, tags, mesh);
}

template GlobalMesh<2> import_mesh(const Mesh<2>&, const AdaptOptions&, BoundaryTags&);
template GlobalMesh<3> import_mesh(const Mesh<3>&, const AdaptOptions&, BoundaryTags&);
template void export_mesh(const GlobalMesh<2>&, const BoundaryTags&, Mesh<2>&);
template void export_mesh(const GlobalMesh<3>&, const BoundaryTags&, Mesh<3>&);

}  // namespace lamina::adapt_detail
