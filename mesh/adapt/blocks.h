// Cuts the mesh into pieces along a Hilbert curve, adapts them at the same time, and joins them again.
//
// The number of pieces follows from the mesh alone, each is adapted by serial code, and ids are given in
// piece order, so the result does not depend on the number of threads. The curve is shifted from pass to
// pass, so that what was frozen between two pieces lies inside one in the next pass.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "mesh/adapt.h"
#include "mesh/adapt/local_mesh.h"

namespace lamina::adapt_detail {

/// The mesh between passes.
template <int D>
struct GlobalMesh {
  std::vector<Vec<D>> x;
  std::vector<Metric<D>> metric;
  std::vector<PieceSet> pieces;  ///< as LocalMesh::Vertex::pieces
  std::vector<int> level;        ///< as LocalMesh::Vertex::level
  std::vector<int> changed;      ///< as LocalMesh::Vertex::changed
  std::vector<std::array<Index, D + 1>> cells;
  std::vector<std::array<PieceId, D + 1>> facet_pieces;  ///< outer and inner; 0: none
  std::vector<PieceId> regions;                          ///< of the cells; empty: there is one
  std::vector<double> energy;  ///< as LocalMesh::Cell::energy; up to date from evaluate_metric() on
  KeptParts<D> kept;
  std::shared_ptr<const BoundaryShape<D>> shape;
  Box<D> bounds;
};

/// Number of pieces that many cells are cut into.
std::size_t block_count(std::size_t cells, std::size_t cells_per_block);

/// One pass: visit(piece) is called once for every piece, on any thread. `cells`, ascending, are the ones to
/// be cut into pieces; none: all of them. What interfaces kept from being tried counts as changed at time
/// `end_of_pass`.
template <int D>
void block_pass(GlobalMesh<D>& mesh, int pass, int end_of_pass, std::size_t cells_per_block,
                const std::vector<Index>& cells,
                const std::function<void(LocalMesh<D>&, std::size_t block)>& visit);

/// The given cells and all that lie within that many rings around them, ascending.
template <int D>
std::vector<Index> cells_around(const GlobalMesh<D>& mesh, std::vector<Index> cells, int rings);

}  // namespace lamina::adapt_detail
