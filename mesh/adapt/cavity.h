// The one operation of the optimizer: a set of cells is replaced by the star of a point.
//
// Split, collapse, swap and point insertion are choices of cavity and point. The star is accepted only when
// it closes: every facet of a new cell is shared with exactly one other new cell, with the mesh around the
// cavity, or lies on the boundary of the domain. Together with positive volumes this makes the new cells fill
// the cavity exactly. Where it has cells of several regions, each region's part of it is such a cavity of its
// own: what p fills stays in its region, and the facets between two regions become the star of p over their
// rim. p must lie on their pieces. Edges of lines in the cavity stay, or are a chain of one line that p
// shortens or cuts in two.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "mesh/adapt/local_mesh.h"

namespace lamina::adapt_detail {

template <int D>
class Cavity {
 public:
  using Local = LocalMesh<D>;
  using Vertex = typename Local::Vertex;

  static constexpr double kUnbounded = std::numeric_limits<double>::infinity();

  explicit Cavity(Local& mesh) : mesh_(mesh) {}

  /// All cells around vertex a. REQUIRES that a is not on an interface.
  void set_ball(Index a);
  /// All cells around the edge a-b of cell c. Returns false when the edge touches an interface or is
  /// required, or a cell other than c has more than that energy.
  bool set_shell(Index c, Index a, Index b, double worst = kUnbounded);
  /// The two cells that share facet i of cell c. REQUIRES a neighbour there.
  void set_pair(Index c, int i);
  /// Adds the cell across facet i of cavity cell c. Returns false when there is none.
  bool grow(Index c, int i);

  [[nodiscard]] const std::vector<Index>& cells() const { return cells_; }
  /// Pieces, outer and inner, that the edge of set_shell() lies on.
  [[nodiscard]] PieceSet edge_pieces() const { return edge_pieces_; }
  [[nodiscard]] double worst_energy() const;
  /// Sum of (energy - 1) over the cells: 0 when all are regular.
  [[nodiscard]] double excess() const;

  /// Proposes the star of `p` (existing vertex `id`, or a new one when id == kNone) in place of the cavity,
  /// after which vertex `removed` (or none) has lost all its cells. Returns false as soon as a cell is not
  /// positive, its energy is not below `worst`, the excess of all is not below `excess`, the star does not
  /// close, or its boundary departs from the shape of the domain; blocking_cell() and blocking_facet() then
  /// tell the outer facet that failed, or kNone.
  bool propose(const Vertex& p, Index id, double worst, Index removed = kNone, double excess = kUnbounded);
  [[nodiscard]] Index blocking_cell() const { return blocking_cell_; }
  [[nodiscard]] int blocking_facet() const { return blocking_facet_; }
  /// Vertices that the star joins to p, each once. Valid after propose() succeeded.
  [[nodiscard]] std::span<const Index> link() const { return link_; }
  [[nodiscard]] double proposed_worst() const { return proposed_worst_; }
  [[nodiscard]] double proposed_excess() const { return proposed_excess_; }

  /// Whether the boundary around vertex `id` follows the shape of the domain once `id` is moved to p; the
  /// cavity is its ball.
  bool follows_shape(const Vertex& p, Index id);

  /// Carries out the last successful proposal; p becomes vertex `id` or a new one. Returns the vertex.
  Index commit(const Vertex& p, Index id);

 private:
  struct Star {                  // a proposed cell: p and an outer facet of the cavity
    std::array<Index, D + 1> v;  // v[0] stands for p
    double energy;
    Index outside;                   // neighbour code across the outer facet
    int back;                        // facet of `outside` that looks at the cavity
    std::array<Index, D + 1> inner;  // across facet i >= 1: star index, or kNone and then ...
    std::array<Index, D + 1> outer;  // ... neighbour code
    std::array<int, D + 1> outer_back;
    PieceId region;
    std::array<PieceId, D + 1> piece;  // inner piece of each facet, 0 where there is none
  };
  struct Dropped {  // an outer facet that contains p, or lies in a boundary plane through p
    std::array<Index, D> v;
    Index outside;
    int back;
    bool contains_p, matched;
    PieceId region, piece;  // of its cell in the cavity; inner piece
  };
  struct InnerFacet {  // between two regions in the cavity
    std::array<Index, D> v;
    PieceId piece;
  };
  struct BoundaryFacet {  // with the vertex that is new there
    std::array<Index, D> v;
    int piece;
  };
  struct Ridge {  // a facet of a star cell that contains p, without p
    std::uint64_t key;
    Index star;
    int facet;
  };

  void begin();
  void add(Index c);
  bool collect(const Vertex& p, Index id, double worst, double excess);
  bool add_outer_facet(Index c, int i, const Vertex& p, Index id, double worst);
  bool glue(Index id);
  bool add_inner_facet(Index c, int i, const Vertex& p);
  bool glue_single(const Ridge& ridge, Index id);
  bool glue_pair(const Ridge& a, const Ridge& b);
  [[nodiscard]] int inner_at(std::uint64_t key, PieceId& piece) const;
  [[nodiscard]] bool lies_beside(const Vertex& p, const Star& facet, int piece);
  void list_new_facets();
  bool facets_follow(const Vertex& p, Index id) const;
  bool covers_all_vertices(Index id, Index removed);
  bool survives(const LineEdge& edge, Index id) const;
  bool lines_survive(const Vertex& p, Index id, Index removed);
  bool lines_follow(const Vertex& p, Index id) const;

  Local& mesh_;
  std::vector<Index> cells_;
  PieceSet edge_pieces_;
  std::vector<Star> stars_;
  std::vector<Dropped> dropped_;
  std::vector<InnerFacet> inner_;
  std::vector<Ridge> ridges_;
  std::vector<Index> link_;
  std::vector<BoundaryFacet> boundary_;  // new or moved facets
  std::vector<LineEdge> lost_lines_;     // edges of lines that a proposal takes out ...
  std::vector<Index> new_lines_;         // ... and what it joins to p instead, along the same line
  int normal_piece_ = 0;                 // the curved piece that normal_ belongs to, at p; 0: none
  Vec<D> normal_ = Vec<D>::Zero();
  double proposed_worst_ = 0.0, proposed_excess_ = 0.0;
  Index blocking_cell_ = kNone;
  int blocking_facet_ = 0;
  std::vector<Index> slots_, old_vertices_;  // scratch of commit()
};

}  // namespace lamina::adapt_detail
