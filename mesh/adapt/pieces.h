// The boundary of a mesh, and that between its regions, cut into pieces: at changes of the tag and at ridges.
#pragma once

#include <vector>

#include "mesh/adapt/shape.h"

namespace lamina::adapt_detail {

/// Facet of a cell.
struct CellSide {
  Index cell = kNone;
  int side = 0;
};

template <int D>
struct BoundaryFacet {
  std::array<Index, D> vertices;  ///< outward of `at`
  CellSide at;                    ///< of two: the one in the lower region
  CellSide beyond;                ///< of an inner facet
  Index tag = 0;
  std::array<Index, 2> regions = {0, kNone};  ///< of an inner facet: at, beyond
  Vec<D> area = Vec<D>::Zero();               ///< normal times a multiple of the area

  [[nodiscard]] bool is_inner() const { return beyond.cell != kNone; }
};

template <int D>
struct Pieces {
  std::vector<Index> tags = {kNone};  ///< of piece 1, 2, ...
  std::vector<PieceId> of_facet;
  std::vector<PieceSet> of_point;
  ShapeData<D> shape;
};

/// Facets of one tag, of inner ones between the same two regions, that meet at angles of at most
/// `ridge_angle` (degrees) make a piece; one that lies in a plane is flat, and those of one tag in one plane
/// are one, between whatever regions. The outer ones come first. So are planes at smaller angles, where they
/// are few and each has a point within. `tolerance`: see ShapeData. Errors: kAdapt when there are more than
/// kMostPieces.
template <int D>
Pieces<D> find_pieces(const std::vector<Vec<D>>& points, const std::vector<BoundaryFacet<D>>& facets,
                      double tolerance, double ridge_angle);

}  // namespace lamina::adapt_detail
