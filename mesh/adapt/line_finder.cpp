#include "mesh/adapt/line_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/words.h"

namespace lamina::adapt_detail {
namespace {

constexpr const char* kRemedy = "; --edges drop forgets listed edges, corners and required parts";

template <int D>
class LineFinder {
 public:
  LineFinder(const Mesh<D>& mesh, const std::vector<BoundaryFacet<D>>& facets, Pieces<D>& pieces,
             const Incidence& cells, double ridge_angle)
      : mesh_(mesh),
        facets_(facets),
        pieces_(pieces),
        cells_(cells),
        least_(std::cos(ridge_angle * std::numbers::pi / 180.0)) {}

  FoundLines<D> find() {
    if (!mesh_.required.cells.empty())
      throw Error(
          ErrorCode::kAdapt,
          fmt::format("{}: cells that may not change cannot be kept{}",
                      counted(static_cast<std::int64_t>(mesh_.required.cells.size()), "required cell"),
                      kRemedy));
    list_edges();
    list_required_facets();
    find_pieces_of_edges();
    fix_points();
    number_lines();
    keep_shape();
    return std::move(found_);
  }

 private:
  struct Edge {
    Index a, b;  // ascending
    LineKind kind;
    PieceSet pieces;  // of the boundary
  };

  [[nodiscard]] std::string place(Index v) const {
    const Vec<D>& x = mesh_.points[static_cast<std::size_t>(v)];
    return fmt::format("({:.6g})", fmt::join(x.data(), x.data() + D, ", "));
  }

  [[nodiscard]] bool is_edge(Index a, Index b) const {
    const auto around = cells_.of(static_cast<std::size_t>(a));
    return a != b && std::any_of(around.begin(), around.end(), [&](Index c) {
             const auto& cell = mesh_.cells[static_cast<std::size_t>(c)];
             return std::find(cell.begin(), cell.end(), b) != cell.end();
           });
  }

  static bool before(const Edge& e, const Edge& f) { return e.a != f.a ? e.a < f.a : e.b < f.b; }
  [[nodiscard]] std::size_t position(Index a, Index b) const {
    const Edge key{std::min(a, b), std::max(a, b), {}, {}};
    const auto at = std::lower_bound(edges_.begin(), edges_.end(), key, before);
    const bool there = at != edges_.end() && at->a == key.a && at->b == key.b;
    return there ? static_cast<std::size_t>(at - edges_.begin()) : edges_.size();
  }

  void list_edges() {
    for (std::size_t e = 0; e < mesh_.edges.size(); ++e) {
      const auto [a, b] = mesh_.edges[e];
      if (!is_edge(a, b))
        throw Error(ErrorCode::kAdapt,
                    fmt::format("the listed edge {} (counted from 0) at {} is not one of a cell{}", e,
                                place(a), kRemedy));
      edges_.push_back({std::min(a, b),
                        std::max(a, b),
                        {mesh_.edge_tags.empty() ? 0 : mesh_.edge_tags[e], LineKind::kListed},
                        {}});
    }
    for (const Index e : mesh_.ridges) edges_[static_cast<std::size_t>(e)].kind.flags |= LineKind::kSharp;
    for (const Index e : mesh_.required.edges)
      edges_[static_cast<std::size_t>(e)].kind.flags |= LineKind::kRequired;
    std::sort(edges_.begin(), edges_.end(), before);
    const auto twice = std::adjacent_find(edges_.begin(), edges_.end(),
                                          [](const Edge& e, const Edge& f) { return !before(e, f); });
    if (twice != edges_.end())
      throw Error(ErrorCode::kAdapt, fmt::format("the edge between {} and {} is listed twice{}",
                                                 place(twice->a), place(twice->b), kRemedy));
  }

  void list_required_facets() {
    if (mesh_.required.facets.empty()) return;
    const auto sorted = [](std::array<Index, D> f) {
      std::sort(f.begin(), f.end());
      return f;
    };
    std::vector<std::array<Index, D>> on_boundary;
    for (const auto& f : facets_) on_boundary.push_back(sorted(f.vertices));
    std::sort(on_boundary.begin(), on_boundary.end());
    std::vector<Edge> more;
    for (const Index f : mesh_.required.facets) {
      const std::array<Index, D> facet = sorted(mesh_.facets[static_cast<std::size_t>(f)]);
      if (!std::binary_search(on_boundary.begin(), on_boundary.end(), facet))
        throw Error(
            ErrorCode::kAdapt,
            fmt::format("the required facet at {} lies within a region: only those of boundaries can be "
                        "kept{}",
                        place(facet[0]), kRemedy));
      found_.kept.facets.push_back(facet);
      for (int k = 1; k < D; ++k)
        for (int l = 0; l < k; ++l) more.push_back({facet[l], facet[k], {0, LineKind::kRequired}, {}});
    }
    std::sort(more.begin(), more.end(), before);
    for (const Edge& edge : more) {
      const std::size_t at = position(edge.a, edge.b);
      if (at < edges_.size()) edges_[at].kind.flags |= LineKind::kRequired;
    }
    std::erase_if(more, [&](const Edge& edge) { return position(edge.a, edge.b) < edges_.size(); });
    more.erase(
        std::unique(more.begin(), more.end(), [](const Edge& e, const Edge& f) { return !before(e, f); }),
        more.end());
    edges_.insert(edges_.end(), more.begin(), more.end());
    std::sort(edges_.begin(), edges_.end(), before);
  }

  void find_pieces_of_edges() {
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      const auto& v = facets_[f].vertices;
      for (int k = 1; k < D; ++k) {
        for (int l = 0; l < k; ++l) {
          const std::size_t at = position(v[k], v[l]);
          if (at < edges_.size()) edges_[at].pieces.add(pieces_.of_facet[f]);
        }
      }
    }
  }

  void fix(Index v) { pieces_.of_point[static_cast<std::size_t>(v)].fix(); }

  void fix_points() {
    found_.kept.corners = mesh_.corners;
    found_.kept.points = mesh_.required.points;
    for (const Index v : mesh_.corners) fix(v);
    for (const Index v : mesh_.required.points) fix(v);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      ends_.emplace_back(edges_[e].a, e);
      ends_.emplace_back(edges_[e].b, e);
    }
    std::sort(ends_.begin(), ends_.end());
    for_each_point([&](Index v, const Edge* e, const Edge* f) {
      if (f == nullptr || !goes_on(v, *e, *f)) fix(v);
    });
  }

  /// visit(point, edge, edge): at points with two edges; with one and nullptr elsewhere.
  template <class Visit>
  void for_each_point(Visit&& visit) {
    for (std::size_t begin = 0, end = 0; begin < ends_.size(); begin = end) {
      while (end < ends_.size() && ends_[end].first == ends_[begin].first) ++end;
      Edge* second = end - begin == 2 ? &edges_[ends_[begin + 1].second] : nullptr;
      visit(ends_[begin].first, &edges_[ends_[begin].second], second);
    }
  }

  [[nodiscard]] bool goes_on(Index v, const Edge& e, const Edge& f) const {
    if (!(e.kind == f.kind) || (e.kind.flags & LineKind::kRequired) != 0) return false;
    const PieceSet& here = pieces_.of_point[static_cast<std::size_t>(v)];
    if (!(e.pieces == f.pieces) || !(e.pieces == here)) return false;
    const auto point = [&](Index w) { return mesh_.points[static_cast<std::size_t>(w)]; };
    const Vec<D> before_v = point(v) - point(e.a == v ? e.b : e.a),
                 after = point(f.a == v ? f.b : f.a) - point(v);
    return before_v.dot(after) >= least_ * before_v.norm() * after.norm();
  }

  /// Chains get numbers in the order of their first edges, then the required edges of each kind.
  void number_lines() {
    std::vector<std::size_t> first(edges_.size());
    std::iota(first.begin(), first.end(), std::size_t{0});
    const auto root = [&](std::size_t e) {
      while (first[e] != e) e = first[e] = first[first[e]];
      return e;
    };
    for_each_point([&](Index v, const Edge* e, const Edge* f) {
      if (f == nullptr || pieces_.of_point[static_cast<std::size_t>(v)].template is_corner<D>()) return;
      const std::size_t s = root(static_cast<std::size_t>(e - edges_.data())),
                        t = root(static_cast<std::size_t>(f - edges_.data()));
      first[std::max(s, t)] = std::min(s, t);
    });
    std::vector<std::size_t> line(edges_.size());
    for (const bool required : {false, true}) {
      if (required)
        pieces_.shape.first_required =
            static_cast<PieceId>(std::min<std::size_t>(kFirstLine + found_.kinds.size(), kLastLine + 1));
      const std::size_t before_these = found_.kinds.size();
      for (std::size_t e = 0; e < edges_.size(); ++e) {
        const LineKind& kind = edges_[e].kind;
        if (((kind.flags & LineKind::kRequired) != 0) != required) continue;
        if (!required && root(e) != e) {
          line[e] = line[root(e)];
          continue;
        }
        const auto begin = found_.kinds.begin() + static_cast<std::ptrdiff_t>(before_these);
        const auto known = required ? std::find(begin, found_.kinds.end(), kind) : found_.kinds.end();
        line[e] = static_cast<std::size_t>(known - found_.kinds.begin());
        if (known == found_.kinds.end()) found_.kinds.push_back(kind);
      }
    }
    constexpr std::size_t kMost = kLastLine - kFirstLine + 1;
    if (found_.kinds.size() > kMost)
      throw Error(ErrorCode::kAdapt,
                  fmt::format("the listed edges are {} lines between corners: no more than {} can "
                              "be kept apart{}",
                              found_.kinds.size(), kMost, kRemedy));
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const auto number = static_cast<PieceId>(kFirstLine + line[e]);
      found_.kept.lines.push_back({edges_[e].a, edges_[e].b, number});
      // A full set is that of a corner, which need not tell its lines.
      for (const Index v : {edges_[e].a, edges_[e].b})
        if (PieceSet& set = pieces_.of_point[static_cast<std::size_t>(v)]; set.size() < 4) set.add(number);
    }
  }

  void keep_shape() {
    ShapeData<D>& shape = pieces_.shape;
    std::unordered_map<Index, Index> number;
    const auto kept = [&](Index v) {
      const auto [at, added] = number.emplace(v, static_cast<Index>(shape.points.size()));
      if (added) shape.points.push_back(mesh_.points[static_cast<std::size_t>(v)]);
      return at->second;
    };
    for (const LineEdge& edge : found_.kept.lines) {
      if (edge.line >= shape.first_required) continue;
      const Index a = kept(edge.a), b = kept(edge.b);
      shape.line_edges.push_back({a, b});
      shape.edge_lines.push_back(edge.line);
    }
  }

  const Mesh<D>& mesh_;
  const std::vector<BoundaryFacet<D>>& facets_;
  Pieces<D>& pieces_;
  const Incidence& cells_;
  double least_;
  std::vector<Edge> edges_;                          // sorted
  std::vector<std::pair<Index, std::size_t>> ends_;  // of edges, sorted by points
  FoundLines<D> found_;
};

}  // namespace

template <int D>
FoundLines<D> find_lines(const Mesh<D>& mesh, const std::vector<BoundaryFacet<D>>& facets, Pieces<D>& pieces,
                         const Incidence& cells, double ridge_angle) {
  return LineFinder<D>(mesh, facets, pieces, cells, ridge_angle).find();
}

template FoundLines<2> find_lines(const Mesh<2>&, const std::vector<BoundaryFacet<2>>&, Pieces<2>&,
                                  const Incidence&, double);
template FoundLines<3> find_lines(const Mesh<3>&, const std::vector<BoundaryFacet<3>>&, Pieces<3>&,
                                  const Incidence&, double);

}  // namespace lamina::adapt_detail
