#include "mesh/adapt/shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lamina::adapt_detail {
namespace {

// Of the squared tolerance: between samples the distance may be a little larger.
constexpr double kBetweenSamples = 0.75;

template <int D>
Vec<D> closest_on_segment(const Vec<D>& a, const Vec<D>& b, const Vec<D>& x) {
  const Vec<D> e = b - a;
  const double t = e.dot(x - a) / e.squaredNorm();
  if (!(t > 0.0)) return a;
  if (t >= 1.0) return b;
  return a + t * e;
}

template <int D>
Vec<D> closest_on_facet(const std::array<Vec<D>, D>& f, const Vec<D>& x) {
  if constexpr (D == 2) {
    return closest_on_segment<2>(f[0], f[1], x);
  } else {
    const Vec3 s = f[1] - f[0], t = f[2] - f[0], y = x - f[0];
    const double ss = s.squaredNorm(), st = s.dot(t), tt = t.squaredNorm();
    const double det = ss * tt - st * st;
    const double u = tt * s.dot(y) - st * t.dot(y), v = ss * t.dot(y) - st * s.dot(y);
    if (u >= 0.0 && v >= 0.0 && u + v <= det && det > 0.0) return f[0] + u / det * s + v / det * t;
    Vec3 best = closest_on_segment<3>(f[0], f[1], x);
    for (const auto& [a, b] : {std::pair{1, 2}, std::pair{2, 0}}) {
      const Vec3 other = closest_on_segment<3>(f[a], f[b], x);
      if ((x - other).squaredNorm() < (x - best).squaredNorm()) best = other;
    }
    return best;
  }
}

template <int D>
double longest_side(const std::array<Vec<D>, D>& f) {
  double longest = (f[1] - f[0]).norm();
  for (int k = 2; k < D; ++k) longest = std::max({longest, (f[k] - f[0]).norm(), (f[k] - f[k - 1]).norm()});
  return longest;
}

}  // namespace

template <int D>
BoundaryShape<D>::BoundaryShape(ShapeData<D> data) : data_(std::move(data)) {
  Box<D> bounds;
  for (const Vec<D>& x : data_.points) bounds.extend(x);
  if (!bounds.empty()) origin_ = bounds.center();
  const std::size_t pieces = data_.normals.size();
  const auto boxed = [&](const auto& corners, std::size_t id) {
    std::array<Vec3, 3> at;
    int n = 0;
    for (const Index v : corners) at[static_cast<std::size_t>(n++)] = local(data_.points[v]);
    return detail::BoxRef::around(at.data(), n, static_cast<Index>(id));
  };
  std::vector<std::vector<detail::BoxRef>> refs(pieces);
  edge_.assign(pieces, 0.0);
  for (std::size_t f = 0; f < data_.facets.size(); ++f) {
    const PieceId piece = data_.facet_pieces[f];
    refs[piece].push_back(boxed(data_.facets[f], f));
    edge_[piece] += (data_.points[data_.facets[f][1]] - data_.points[data_.facets[f][0]]).norm();
  }
  for (std::size_t p = 0; p < pieces; ++p) {
    if (!refs[p].empty()) edge_[p] /= static_cast<double>(refs[p].size());
    trees_.push_back(detail::build_box_tree(std::move(refs[p])));
  }
  std::map<Pair, std::vector<detail::BoxRef>> ridges;
  for (std::size_t r = 0; r < data_.ridges.size(); ++r)
    ridges[data_.ridge_pieces[r]].push_back(boxed(data_.ridges[r], r));
  for (auto& [pair, list] : ridges) ridge_trees_[pair] = detail::build_box_tree(std::move(list));
  std::vector<std::vector<detail::BoxRef>> lines;
  for (std::size_t e = 0; e < data_.line_edges.size(); ++e) {
    const auto line = static_cast<std::size_t>(data_.edge_lines[e] - kFirstLine);
    if (lines.size() <= line) lines.resize(line + 1);
    lines[line].push_back(boxed(data_.line_edges[e], e));
  }
  for (auto& list : lines) line_trees_.push_back(detail::build_box_tree(std::move(list)));
}

template <int D>
Vec3 BoundaryShape<D>::local(const Vec<D>& x) const {
  Vec3 out = Vec3::Zero();
  out.template head<D>() = x - origin_;
  return out;
}

template <int D>
template <class Closest>
typename BoundaryShape<D>::Foot BoundaryShape<D>::nearest(const detail::BoxTree& tree, const Vec<D>& x,
                                                          Closest&& closest) const {
  constexpr double kSlack = 1.0 - 1e-12;  // rounding must not hide a facet that is as near
  Foot foot;
  const Vec3 y = local(x);
  double best = foot.d2;
  detail::visit_nearest(tree, y.data(), best, kSlack, [&](int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Index id = tree.ids[static_cast<std::size_t>(i)];
      const Vec<D> point = closest(id);
      const double d2 = (x - point).squaredNorm();
      if (d2 < foot.d2 || (d2 == foot.d2 && id < foot.id)) foot = {d2, point, id};
    }
    best = foot.d2;
  });
  return foot;
}

template <int D>
typename BoundaryShape<D>::Foot BoundaryShape<D>::on_piece(int piece, const Vec<D>& x) const {
  return nearest(trees_[static_cast<std::size_t>(piece)], x, [&](Index f) {
    std::array<Vec<D>, D> corners;
    for (int k = 0; k < D; ++k) corners[k] = data_.points[data_.facets[f][k]];
    return closest_on_facet<D>(corners, x);
  });
}

template <int D>
typename BoundaryShape<D>::Foot BoundaryShape<D>::on_edges(const detail::BoxTree& tree,
                                                           const std::vector<std::array<Index, 2>>& edges,
                                                           const Vec<D>& x) const {
  return nearest(tree, x, [&](Index e) {
    return closest_on_segment<D>(data_.points[edges[e][0]], data_.points[edges[e][1]], x);
  });
}

template <int D>
const detail::BoxTree* BoundaryShape<D>::ridge_between(int piece, int other) const {
  const auto found = ridge_trees_.find(
      {static_cast<PieceId>(std::min(piece, other)), static_cast<PieceId>(std::max(piece, other))});
  return found == ridge_trees_.end() ? nullptr : &found->second;
}

template <int D>
bool BoundaryShape<D>::projects(PieceSet pieces) const {
  if (flat() || pieces.empty() || pieces.is_corner<D>()) return false;
  if (pieces.line() != 0) return true;
  if (pieces.size() == 1) return curved(pieces[0]);
  for (int k = 1; k < pieces.size(); ++k)
    for (int l = 0; l < k; ++l)
      if (ridge_between(pieces[l], pieces[k]) == nullptr) return false;
  return true;
}

template <int D>
Vec<D> BoundaryShape<D>::normal(int piece, const Vec<D>& x) const {
  if (!curved(piece)) return data_.normals[static_cast<std::size_t>(piece)];
  const auto& facet = data_.facets[on_piece(piece, x).id];
  std::array<Vec<D>, D> corners;
  for (int k = 0; k < D; ++k) corners[k] = data_.points[facet[k]];
  return area_vector<D>(corners).normalized();
}

template <int D>
Vec<D> BoundaryShape<D>::tangent(int line, const Vec<D>& x) const {
  const auto& edge =
      data_.line_edges[on_edges(line_trees_[static_cast<std::size_t>(line - kFirstLine)], data_.line_edges, x)
                           .id];
  return (data_.points[edge[1]] - data_.points[edge[0]]).normalized();
}

template <int D>
Vec<D> BoundaryShape<D>::project(PieceSet pieces, const Vec<D>& x) const {
  if (!projects(pieces)) return x;
  if (const int line = pieces.line())
    return on_edges(line_trees_[static_cast<std::size_t>(line - kFirstLine)], data_.line_edges, x).point;
  return (pieces.size() == 1 ? on_piece(pieces[0], x)
                             : on_edges(*ridge_between(pieces[0], pieces[1]), data_.ridges, x))
      .point;
}

// The largest squared distance at points that cut its sides into n; infinite when it exceeds the tolerance or
// the normals differ too much.
template <int D>
double BoundaryShape<D>::departure(int piece, const std::array<Vec<D>, D>& facet, int n) const {
  const Vec<D> normal = area_vector<D>(facet).normalized();
  const double most = kBetweenSamples * data_.tolerance * data_.tolerance;
  double farthest = 0.0;
  const auto accepts = [&](int i, int j) {
    const int rest = n - i - j;
    const Vec<D> x =
        (i * facet[0] + j * facet[1] + (D == 3 ? rest : 0) * facet[D - 1]) / static_cast<double>(n);
    const Foot foot = on_piece(piece, x);
    farthest = std::max(farthest, foot.d2);
    if (foot.d2 > most) return false;
    if (i == 0 || j == 0 || (D == 3 && rest == 0)) return true;
    std::array<Vec<D>, D> corners;
    for (int k = 0; k < D; ++k) corners[k] = data_.points[data_.facets[foot.id][k]];
    return normal.dot(area_vector<D>(corners).normalized()) >= data_.least_cosine;
  };
  for (int i = 0; i < n; ++i)
    for (int j = D == 2 ? n - i : 0; j <= n - i; ++j)
      if (i + j > 0 && j < n && !accepts(i, j)) return std::numeric_limits<double>::infinity();
  return farthest;
}

// Between few samples a kink of the piece may hide, but not one that is three times as far: few do for most
// facets.
template <int D>
bool BoundaryShape<D>::follows(int piece, const std::array<Vec<D>, D>& facet) const {
  constexpr double kFew = 4.0;
  constexpr int kMany = D == 2 ? 16 : 8;
  const double wanted = 2.0 * longest_side<D>(facet) / edge_[static_cast<std::size_t>(piece)];
  const int few = static_cast<int>(std::clamp<double>(std::ceil(wanted), kFew, kMany));
  const double found = departure(piece, facet, few);
  if (9.0 * found <= data_.tolerance * data_.tolerance) return true;
  return std::isfinite(found) && (few == kMany || std::isfinite(departure(piece, facet, kMany)));
}

template <int D>
bool BoundaryShape<D>::follows_edges(const detail::BoxTree& tree,
                                     const std::vector<std::array<Index, 2>>& edges, const Vec<D>& a,
                                     const Vec<D>& b) const {
  constexpr int kSamples = 16;
  const double most = kBetweenSamples * data_.tolerance * data_.tolerance;
  for (int k = 1; k < kSamples; ++k) {
    const Vec<D> x = a + static_cast<double>(k) / kSamples * (b - a);
    if (on_edges(tree, edges, x).d2 > most) return false;
  }
  return true;
}

template <int D>
bool BoundaryShape<D>::follows_ridge(int piece, int other, const Vec<D>& a, const Vec<D>& b) const {
  const detail::BoxTree* ridge = ridge_between(piece, other);
  if (ridge == nullptr) return !curved(piece) && !curved(other);
  return follows_edges(*ridge, data_.ridges, a, b);
}

template <int D>
bool BoundaryShape<D>::follows_line(int line, const Vec<D>& a, const Vec<D>& b) const {
  return follows_edges(line_trees_[static_cast<std::size_t>(line - kFirstLine)], data_.line_edges, a, b);
}

template class BoundaryShape<2>;
template class BoundaryShape<3>;

}  // namespace lamina::adapt_detail
