// The boundary of a mesh cut into pieces: at changes of the tag and at ridges.
#pragma once

#include <vector>

#include "mesh/adapt/shape.h"

namespace lamina::adapt_detail {

template <int D>
struct BoundaryFacet {
  std::array<Index, D> vertices;  ///< outward
  Index cell = kNone;
  int side = 0;
  Index tag = 0;
  Vec<D> area = Vec<D>::Zero();  ///< normal times a multiple of the area
};

template <int D>
struct Pieces {
  std::vector<Index> tags = {kNone};  ///< of piece 1, 2, ...
  std::vector<PieceId> of_facet;
  std::vector<PieceSet> of_point;
  ShapeData<D> shape;
};

/// Facets of one tag that meet at angles of at most `ridge_angle` (degrees) make a piece; one that lies in a
/// plane is flat, and those of one tag in one plane are one. So are planes at smaller angles, where they are
/// few and each has a point within. `tolerance`: see ShapeData. Errors: kAdapt when there are more than
/// kMostPieces.
template <int D>
Pieces<D> find_pieces(const std::vector<Vec<D>>& points, const std::vector<BoundaryFacet<D>>& facets,
                      double tolerance, double ridge_angle);

}  // namespace lamina::adapt_detail
