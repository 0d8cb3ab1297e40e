// Split, collapse, swap and smoothing on one piece of the mesh, each a sweep in a fixed order.
#pragma once

#include <vector>

#include "mesh/adapt.h"
#include "mesh/adapt/cavity.h"

namespace lamina::adapt_detail {

enum Operator : int { kCollapse, kSplit, kSwap, kSmooth, kRepair, kOperatorCount };

/// Limits of one visit of a piece.
struct Rules {
  double floor = 0.1;          ///< absolute quality floor
  double short_edge = 0.7071;  ///< edges below are collapsed
  double long_edge = 1.4142;   ///< edges above are split
  double shortest_new = 0.5;   ///< no split makes an edge shorter than this
  double longest_new = 1.6;    ///< no collapse or swap makes an edge longer than this
  double swap_below = 0.6;     ///< cells below this quality are candidates of swaps
  int enlargements = 6;        ///< cells a cavity may take in before a move is given up
};

template <int D>
class Operators {
 public:
  using Local = LocalMesh<D>;
  using Vertex = typename Local::Vertex;

  Operators(Local& mesh, const AdaptMetric<D>& field, double size_floor)
      : mesh_(mesh), cavity_(mesh), field_(field), size_floor_(size_floor) {}

  /// Each returns the number of accepted operations.
  std::int64_t collapse_sweep(const Rules& rules);
  std::int64_t split_sweep(const Rules& rules);
  std::int64_t swap_sweep(const Rules& rules);
  std::int64_t smooth_sweep(const Rules& rules);
  /// Worst cells first: whatever single operation lifts the worst quality of its cavity, lengths permitting.
  std::int64_t repair_sweep(const Rules& rules, double below);

  [[nodiscard]] const std::array<OperatorStats, kOperatorCount>& stats() const { return stats_; }

 private:
  struct Edge {
    double length;
    Index a, b, cell;
  };

  Vertex make_vertex(const Vec<D>& x, TagSet tags) const;
  void collect_edges(double low, double high);
  [[nodiscard]] std::vector<std::pair<double, Index>> bad_cells(double below) const;
  [[nodiscard]] Index find_cell(Index a, Index b, Index hint);
  bool propose_enlarging(const Vertex& p, Index id, Index removed, const Rules& rules, double relax);
  bool split(const Edge& e, const Rules& rules);
  bool collapse(Index a, Index b, const Rules& rules);
  bool may_collapse(Index a, Index b, Index cell);
  bool swap_around(Index c, const Rules& rules);
  void list_vertices(std::vector<Index>& out);
  void list_apexes(const std::array<Index, D + 1>& v, int move, std::vector<Index>& apexes);
  bool repair(Index c, const Rules& rules);
  /// `power` p weighs a cell of quality q by q^-p in the step and q^-2p in the sum that must fall.
  bool smooth(Index a, const Rules& rules, int power);
  Vec<D> ideal_step(Index a, int power) const;
  bool improves_ball(Index a, const Vertex& p, double floor, double limit, int power);

  Local& mesh_;
  Cavity<D> cavity_;
  const AdaptMetric<D>& field_;
  double size_floor_;
  std::vector<Edge> edges_;
  std::vector<Index> neighbors_;
  std::vector<double> qualities_;
  std::array<OperatorStats, kOperatorCount> stats_;
};

}  // namespace lamina::adapt_detail
