// Facets are joined where they meet smoothly, at `joints`: the points between two segments, the edges between
// triangles. In a plane go the largest facets first: these tell it best, and whether a small or thin facet
// lies in it is decided by the distance of its vertices, which does not suffer from its own badly known
// normal.
#include "mesh/adapt/pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace lamina::adapt_detail {
namespace {

constexpr double kFlat = 1e-9;          // of the diagonal: far above rounding, far below any element
constexpr std::size_t kFewPlanes = 31;  // more planes at small angles than that are a curved surface

template <int D>
struct Plane {
  Index tag;
  bool inner;
  Vec<D> normal, point;
};

template <int D>
struct Joint {
  std::array<Index, D - 1> points;  // ascending
  std::size_t facet;
};

struct Ridge {
  Index point, other;
  PieceSet between;  // two or three
};

template <int D>
class Finder {
 public:
  Finder(const std::vector<Vec<D>>& points, const std::vector<BoundaryFacet<D>>& facets, double ridge_angle)
      : points_(points), facets_(facets), least_(std::cos(ridge_angle * std::numbers::pi / 180.0)) {
    Box<D> bounds;
    for (const Vec<D>& x : points) bounds.extend(x);
    diagonal_ = bounds.diagonal();
    center_ = bounds.center();
    flat_ = kFlat * diagonal_;
  }

  Pieces<D> find(double tolerance, double ridge_angle) {
    list_joints();
    join_facets();
    const std::vector<std::size_t> planar = planar_facets();
    pieces_.of_facet.assign(facets_.size(), 0);
    for (const bool inner : {false, true}) {
      if (inner) pieces_.shape.first_inner = static_cast<PieceId>(pieces_.tags.size());
      number_planes(planar, inner);
      number_patches(inner);
    }
    pieces_.of_point.resize(points_.size());
    for (std::size_t f = 0; f < facets_.size(); ++f)
      for (const Index v : facets_[f].vertices) pieces_.of_point[v].add(pieces_.of_facet[f]);
    fix_corners();
    keep_shape();
    constexpr double kMargin = 15.0, kSteepest = 85.0;
    pieces_.shape.tolerance = tolerance;
    pieces_.shape.least_cosine =
        std::cos(std::min(kSteepest, ridge_angle + kMargin) * std::numbers::pi / 180.0);
    return std::move(pieces_);
  }

 private:
  void list_joints() {
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      for (int out = 0; out < D; ++out) {
        Joint<D> joint;
        joint.facet = f;
        for (int k = 1; k < D; ++k) joint.points[k - 1] = facets_[f].vertices[(out + k) % D];
        std::sort(joint.points.begin(), joint.points.end());
        joints_.push_back(joint);
      }
    }
    std::sort(joints_.begin(), joints_.end(), [](const Joint<D>& a, const Joint<D>& b) {
      return a.points != b.points ? a.points < b.points : a.facet < b.facet;
    });
  }

  /// Calls with the facets that meet at each joint.
  template <class Visit>
  void for_each_joint(Visit&& visit) const {
    for (std::size_t begin = 0; begin < joints_.size();) {
      std::size_t end = begin;
      while (end < joints_.size() && joints_[end].points == joints_[begin].points) ++end;
      visit(joints_.data() + begin, joints_.data() + end);
      begin = end;
    }
  }

  [[nodiscard]] bool turns_little(std::size_t f, std::size_t g) const {
    const Vec<D>&a = facets_[f].area, &b = facets_[g].area;
    return a.dot(b) >= least_ * a.norm() * b.norm();
  }

  [[nodiscard]] bool smooth(const Joint<D>* begin, const Joint<D>* end) const {
    if (end - begin != 2) return false;
    const BoundaryFacet<D>&f = facets_[begin[0].facet], &g = facets_[begin[1].facet];
    return f.tag == g.tag && f.regions == g.regions && turns_little(begin[0].facet, begin[1].facet);
  }

  // The inner facets at a joint follow the outer ones, as they do in the list.
  [[nodiscard]] const Joint<D>* first_inner(const Joint<D>* begin, const Joint<D>* end) const {
    return std::find_if(begin, end, [&](const Joint<D>& j) { return facets_[j.facet].is_inner(); });
  }

  std::size_t root(std::size_t f) {
    while (patch_[f] != f) f = patch_[f] = patch_[patch_[f]];
    return f;
  }

  // patch_: the first facet of the smooth patch that a facet belongs to.
  void join_facets() {
    patch_.resize(facets_.size());
    std::iota(patch_.begin(), patch_.end(), std::size_t{0});
    const auto join = [&](const Joint<D>* begin, const Joint<D>* end) {
      if (!smooth(begin, end)) return;
      const std::size_t a = root(begin[0].facet), b = root(begin[1].facet);
      patch_[std::max(a, b)] = std::min(a, b);
    };
    for_each_joint([&](const Joint<D>* begin, const Joint<D>* end) {
      const Joint<D>* inner = first_inner(begin, end);
      join(begin, inner);
      join(inner, end);
    });
    for (std::size_t f = 0; f < patch_.size(); ++f) patch_[f] = root(f);
  }

  [[nodiscard]] bool lies_in(const BoundaryFacet<D>& f, const Plane<D>& plane) const {
    if (f.tag != plane.tag || f.is_inner() != plane.inner) return false;
    if (!plane.inner && plane.normal.dot(f.area) < 0.0) return false;
    return std::all_of(f.vertices.begin(), f.vertices.end(), [&](Index v) {
      return std::abs(plane.normal.dot(points_[v] - plane.point)) <= flat_;
    });
  }

  // The planes of some facets and the one that each lies in; at most `most`, false when there are more.
  bool find_planes(std::vector<std::size_t> order, std::size_t most, std::vector<Plane<D>>& planes,
                   std::vector<std::pair<std::size_t, std::size_t>>& plane_of) const {
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return facets_[a].area.squaredNorm() > facets_[b].area.squaredNorm();
    });
    std::multimap<double, std::size_t> by_key;
    for (const std::size_t i : order) {
      const double key = plane_key(facets_[i]), slack = key_slack(facets_[i]);
      std::size_t found = planes.size();
      const auto search = [&](double at) {
        const auto end = by_key.upper_bound(at + slack);
        for (auto p = by_key.lower_bound(at - slack); p != end; ++p)
          if (p->second < found && lies_in(facets_[i], planes[p->second])) found = p->second;
      };
      search(key);
      if (facets_[i].is_inner()) search(-key);
      plane_of.emplace_back(i, found);
      if (found != planes.size()) continue;
      if (planes.size() == most) return false;
      by_key.emplace(key, planes.size());
      planes.push_back({facets_[i].tag, facets_[i].is_inner(), facets_[i].area.normalized(),
                        points_[facets_[i].vertices[0]]});
    }
    return true;
  }

  // A number that facets of one plane nearly share: normal and distance, seen from one direction. The other
  // side's is its negative.
  [[nodiscard]] double plane_key(const BoundaryFacet<D>& f) const {
    constexpr std::array<double, 3> kDirection = {0.7548776662466927, 0.5698402909980532, 0.3247179572447460};
    const Vec<D> n = f.area.normalized();
    return n.dot(Eigen::Map<const Vec<D>>(kDirection.data())) +
           n.dot(points_[f.vertices[0]] - center_) / diagonal_;
  }

  // Between the keys of a facet and of a plane that it lies in: as far as its vertices may be off the plane,
  // the facet may be tilted, the more the thinner it is.
  [[nodiscard]] double key_slack(const BoundaryFacet<D>& f) const {
    double longest = 0.0;
    for (int k = 0; k < D; ++k)
      longest = std::max(longest, (points_[f.vertices[(k + 1) % D]] - points_[f.vertices[k]]).norm());
    const double height = D == 2 ? longest : f.area.norm() / longest;
    return 4.0 * kFlat + 12.0 * flat_ / height;
  }

  // Whether each plane has a point all around which is that plane: no strip of a curved surface has.
  [[nodiscard]] bool has_inner_points(const std::vector<std::pair<std::size_t, std::size_t>>& plane_of,
                                      std::size_t planes) {
    constexpr std::size_t kNowhere = ~std::size_t{0}, kSeveral = kNowhere - 1;
    plane_at_.resize(points_.size(), kNowhere);
    for (const auto& [f, plane] : plane_of)
      for (const Index v : facets_[f].vertices)
        plane_at_[v] = plane_at_[v] == kNowhere || plane_at_[v] == plane ? plane : kSeveral;
    std::vector<char> has(planes, 0);
    for (const auto& [f, plane] : plane_of)
      for (const Index v : facets_[f].vertices)
        if (plane_at_[v] == plane) has[plane] = static_cast<char>(on_border_[v] == 0 || has[plane] != 0);
    for (const auto& [f, plane] : plane_of)
      for (const Index v : facets_[f].vertices) plane_at_[v] = kNowhere;
    return std::find(has.begin(), has.end(), 0) == has.end();
  }

  // Facets of patches that are planes, one or few.
  std::vector<std::size_t> planar_facets() {
    on_border_.assign(points_.size(), 0);
    for_each_joint([&](const Joint<D>* begin, const Joint<D>* end) {
      if (!smooth(begin, end))
        for (const Index v : begin->points) on_border_[v] = 1;
    });
    std::vector<std::size_t> order(facets_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return patch_[a] < patch_[b]; });
    std::vector<std::size_t> planar;
    for (auto begin = order.begin(); begin != order.end();) {
      const auto end =
          std::find_if(begin, order.end(), [&](std::size_t f) { return patch_[f] != patch_[*begin]; });
      std::vector<Plane<D>> planes;
      std::vector<std::pair<std::size_t, std::size_t>> plane_of;
      if (find_planes({begin, end}, kFewPlanes, planes, plane_of) &&
          (planes.size() == 1 || has_inner_points(plane_of, planes.size())))
        planar.insert(planar.end(), begin, end);
      begin = end;
    }
    std::sort(planar.begin(), planar.end());
    return planar;
  }

  PieceId add_piece(Index tag, const Vec<D>& normal) {
    if (pieces_.tags.size() > kMostPieces)
      throw Error(
          ErrorCode::kAdapt,
          fmt::format("the boundary, with that between cell tags, has more than {} pieces between its "
                      "ridges: its mesh is too coarse to tell them, or --ridge-angle too small, or "
                      "the cell tags are no regions to keep (--cell-tags drop)",
                      kMostPieces));
    pieces_.tags.push_back(tag);
    pieces_.shape.normals.push_back(normal);
    return static_cast<PieceId>(pieces_.tags.size() - 1);
  }

  // In the order of their tags, those of one tag in that of their largest facets.
  void number_planes(std::vector<std::size_t> planar, bool inner) {
    std::erase_if(planar, [&](std::size_t f) { return facets_[f].is_inner() != inner; });
    std::vector<Plane<D>> planes;
    std::vector<std::pair<std::size_t, std::size_t>> plane_of;
    find_planes(std::move(planar), facets_.size(), planes, plane_of);
    std::vector<std::size_t> by_tag(planes.size());
    std::iota(by_tag.begin(), by_tag.end(), std::size_t{0});
    std::stable_sort(by_tag.begin(), by_tag.end(),
                     [&](std::size_t a, std::size_t b) { return planes[a].tag < planes[b].tag; });
    std::vector<PieceId> number(planes.size());
    for (const std::size_t p : by_tag) number[p] = add_piece(planes[p].tag, planes[p].normal);
    for (const auto& [f, plane] : plane_of) pieces_.of_facet[f] = number[plane];
  }

  // Those that are curved, in the order of their tags, those of one tag in that of their first facets.
  void number_patches(bool inner) {
    const auto waits = [&](std::size_t f) {
      return pieces_.of_facet[f] == 0 && facets_[f].is_inner() == inner;
    };
    std::vector<std::pair<Index, std::size_t>> curved;
    for (std::size_t f = 0; f < facets_.size(); ++f)
      if (waits(f) && patch_[f] == f) curved.emplace_back(facets_[f].tag, f);
    std::sort(curved.begin(), curved.end());
    for (const auto& [tag, first] : curved) pieces_.of_facet[first] = add_piece(tag, Vec<D>::Zero());
    for (std::size_t f = 0; f < facets_.size(); ++f)
      if (waits(f)) pieces_.of_facet[f] = pieces_.of_facet[patch_[f]];
  }

  [[nodiscard]] bool curved(int piece) const {
    return pieces_.shape.normals[static_cast<std::size_t>(piece)].isZero(0.0);
  }

  // The pieces at a joint where two or three smooth ones end or meet; none elsewhere.
  [[nodiscard]] PieceSet meeting_at(const Joint<D>* begin, const Joint<D>* end) const {
    const auto outer = first_inner(begin, end) - begin;
    if (outer != 0 && outer != 2) return {};
    PieceSet pieces;
    for (const Joint<D>* j = begin; j != end; ++j) {
      const PieceId piece = pieces_.of_facet[j->facet];
      for (const Joint<D>* k = begin; k != j; ++k)
        if (pieces_.of_facet[k->facet] == piece && curved(piece) && !turns_little(j->facet, k->facet))
          return {};
      pieces.add(piece);
    }
    return pieces.size() == 2 || pieces.size() == 3 ? pieces : PieceSet();
  }

  // Points where borders of pieces meet, and all along a ridge within one piece.
  void fix_corners() {
    for_each_joint([&](const Joint<D>* begin, const Joint<D>* end) {
      if (pieces_.of_facet[begin->facet] == pieces_.of_facet[end[-1].facet] && smooth(begin, end)) return;
      if constexpr (D == 3) {
        const PieceSet between = meeting_at(begin, end);
        if (!between.empty()) {
          ridges_.push_back({begin->points[0], begin->points[1], between});
          ridges_.push_back({begin->points[1], begin->points[0], between});
          return;
        }
      }
      for (const Index v : begin->points) fix(v);
    });
    if constexpr (D == 3) fix_ends_of_ridges();
  }

  // Points where ridges end, meet or turn sharply, and where pieces meet in nothing but the point.
  void fix_ends_of_ridges() {
    std::vector<char> on_ridge(points_.size(), 0);
    for (const Ridge& r : ridges_) on_ridge[r.point] = 1;
    for (std::size_t v = 0; v < points_.size(); ++v)
      if (on_ridge[v] == 0 && pieces_.of_point[v].size() > 1) fix(static_cast<Index>(v));
    std::sort(ridges_.begin(), ridges_.end(), [](const Ridge& e, const Ridge& f) {
      return e.point != f.point ? e.point < f.point : e.other < f.other;
    });
    for (std::size_t begin = 0; begin < ridges_.size();) {
      std::size_t end = begin;
      while (end < ridges_.size() && ridges_[end].point == ridges_[begin].point) ++end;
      const Ridge &e = ridges_[begin], &f = ridges_[end - 1];
      const Vec<D> before = points_[e.point] - points_[e.other], after = points_[f.other] - points_[e.point];
      if (end - begin != 2 || e.between != f.between || pieces_.of_point[e.point] != e.between ||
          before.dot(after) < least_ * before.norm() * after.norm())
        fix(e.point);
      begin = end;
    }
  }

  void fix(Index v) {
    if (!pieces_.of_point[v].template is_corner<D>()) pieces_.of_point[v].fix();
  }

  // Whether the ridge is the line that two planes have in common.
  [[nodiscard]] bool told_by_planes(int p, int q) const {
    constexpr double kParallel = 1.0 - 1e-6;
    const auto& normals = pieces_.shape.normals;
    const Vec<D>&a = normals[static_cast<std::size_t>(p)], &b = normals[static_cast<std::size_t>(q)];
    return !curved(p) && !curved(q) && std::abs(a.dot(b)) < kParallel;
  }

  // The curved pieces and the ridges that planes do not tell, with the points they need.
  void keep_shape() {
    ShapeData<D>& shape = pieces_.shape;
    std::vector<Index> number(points_.size(), kNone);
    const auto keep = [&](Index& v) {
      if (number[v] == kNone) {
        number[v] = static_cast<Index>(shape.points.size());
        shape.points.push_back(points_[v]);
      }
      v = number[v];
    };
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      if (!curved(pieces_.of_facet[f])) continue;
      shape.facets.push_back(facets_[f].vertices);
      shape.facet_pieces.push_back(pieces_.of_facet[f]);
      for (Index& v : shape.facets.back()) keep(v);
    }
    for (const Ridge& r : ridges_) {
      if (r.point > r.other) continue;
      for (int k = 1; k < r.between.size(); ++k) {
        for (int l = 0; l < k; ++l) {
          if (told_by_planes(r.between[l], r.between[k])) continue;
          shape.ridges.push_back({r.point, r.other});
          shape.ridge_pieces.push_back(
              {static_cast<PieceId>(r.between[l]), static_cast<PieceId>(r.between[k])});
          for (Index& v : shape.ridges.back()) keep(v);
        }
      }
    }
  }

  const std::vector<Vec<D>>& points_;
  const std::vector<BoundaryFacet<D>>& facets_;
  double least_, flat_ = 0.0, diagonal_ = 0.0;
  Vec<D> center_ = Vec<D>::Zero();
  std::vector<Joint<D>> joints_;
  std::vector<std::size_t> patch_, plane_at_;
  std::vector<Ridge> ridges_;    // each from either end
  std::vector<char> on_border_;  // of a patch
  Pieces<D> pieces_;
};

}  // namespace

template <int D>
Pieces<D> find_pieces(const std::vector<Vec<D>>& points, const std::vector<BoundaryFacet<D>>& facets,
                      double tolerance, double ridge_angle) {
  return Finder<D>(points, facets, ridge_angle).find(tolerance, ridge_angle);
}

template Pieces<2> find_pieces(const std::vector<Vec<2>>&, const std::vector<BoundaryFacet<2>>&, double,
                               double);
template Pieces<3> find_pieces(const std::vector<Vec<3>>&, const std::vector<BoundaryFacet<3>>&, double,
                               double);

}  // namespace lamina::adapt_detail
