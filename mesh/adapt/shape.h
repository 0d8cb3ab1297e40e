// The boundary of the mesh and of its regions as it was given: planes, and the facets of curved pieces with
// the ridges between them, which new and moved vertices are put on.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "core/box_tree.h"
#include "core/types.h"
#include "mesh/adapt/piece_set.h"

namespace lamina::adapt_detail {

/// Normal of a facet times a multiple of its area.
template <int D>
Vec<D> area_vector(const std::array<Vec<D>, D>& f) {
  if constexpr (D == 2)
    return Vec2(f[1][1] - f[0][1], f[0][0] - f[1][0]);
  else
    return Vec3(f[1] - f[0]).cross(Vec3(f[2] - f[0]));
}

template <int D>
struct ShapeData {
  std::vector<Vec<D>> normals = {Vec<D>::Zero()};  ///< unit, outward, of flat piece p; zero: p is curved
  PieceId first_inner = 0xffff;                    ///< pieces from here on lie between two regions
  std::vector<Vec<D>> points;
  std::vector<std::array<Index, D>> facets;  ///< of curved pieces, outward
  std::vector<PieceId> facet_pieces;
  /// In 3D: edges between two pieces, unless they are planes that meet at an angle; of three one for each
  /// pair.
  std::vector<std::array<Index, 2>> ridges;
  std::vector<std::array<PieceId, 2>> ridge_pieces;  ///< ascending
  std::vector<std::array<Index, 2>> line_edges;      ///< of the lines before first_required
  std::vector<PieceId> edge_lines;
  PieceId first_required = 0xffff;  ///< edges of the lines from here on never change
  double tolerance = 0.0;           ///< distance that a facet may keep from its piece
  double least_cosine = 0.0;        ///< between normals of a facet and of its piece beside it
};

/// All queries give the same bits for the same data; of equally near facets the one listed first counts.
template <int D>
class BoundaryShape {
 public:
  explicit BoundaryShape(ShapeData<D> data);
  [[nodiscard]] const ShapeData<D>& data() const { return data_; }

  /// Whether normals tell all pieces and ridges.
  [[nodiscard]] bool flat() const { return data_.points.empty(); }
  /// Whether the piece lies between two regions.
  [[nodiscard]] bool is_inner(int piece) const {
    return piece >= data_.first_inner && piece < static_cast<int>(data_.normals.size());
  }
  [[nodiscard]] bool curved(int piece) const { return !trees_[static_cast<std::size_t>(piece)].empty(); }
  [[nodiscard]] bool is_required(PieceId line) const { return line >= data_.first_required; }
  /// Unit direction of a line, at its point nearest to x.
  [[nodiscard]] Vec<D> tangent(int line, const Vec<D>& x) const;
  /// Whether project() may move a point.
  [[nodiscard]] bool projects(PieceSet pieces) const;
  /// Unit outward normal of the piece, of a curved one at its point nearest to x.
  [[nodiscard]] Vec<D> normal(int piece, const Vec<D>& x) const;
  /// The nearest point of the line, else of the piece, or of the ridge between two or three; x where normals
  /// tell these.
  /// Corners give x.
  [[nodiscard]] Vec<D> project(PieceSet pieces, const Vec<D>& x) const;
  /// Whether a facet, outward, may stand for a part of that curved piece.
  [[nodiscard]] bool follows(int piece, const std::array<Vec<D>, D>& facet) const;
  /// Whether an edge may stand for a part of the ridge between two pieces.
  [[nodiscard]] bool follows_ridge(int piece, int other, const Vec<D>& a, const Vec<D>& b) const;
  /// Whether an edge may stand for a part of the line.
  [[nodiscard]] bool follows_line(int line, const Vec<D>& a, const Vec<D>& b) const;

 private:
  struct Foot {
    double d2 = std::numeric_limits<double>::infinity();
    Vec<D> point;
    Index id = kNone;
  };
  using Pair = std::array<PieceId, 2>;

  [[nodiscard]] Vec3 local(const Vec<D>& x) const;
  template <class Closest>
  [[nodiscard]] Foot nearest(const detail::BoxTree& tree, const Vec<D>& x, Closest&& closest) const;
  [[nodiscard]] Foot on_piece(int piece, const Vec<D>& x) const;
  [[nodiscard]] Foot on_edges(const detail::BoxTree& tree, const std::vector<std::array<Index, 2>>& edges,
                              const Vec<D>& x) const;
  [[nodiscard]] bool follows_edges(const detail::BoxTree& tree,
                                   const std::vector<std::array<Index, 2>>& edges, const Vec<D>& a,
                                   const Vec<D>& b) const;
  [[nodiscard]] double departure(int piece, const std::array<Vec<D>, D>& facet, int n) const;
  [[nodiscard]] const detail::BoxTree* ridge_between(int piece, int other) const;

  ShapeData<D> data_;
  Vec<D> origin_ = Vec<D>::Zero();      ///< boxes are in single precision, around it
  std::vector<detail::BoxTree> trees_;  ///< of the facets of each curved piece
  std::vector<double> edge_;            ///< mean edge of each curved piece
  std::map<Pair, detail::BoxTree> ridge_trees_;
  std::vector<detail::BoxTree> line_trees_;  ///< of line kFirstLine, ...
};

}  // namespace lamina::adapt_detail
