// Split, collapse, swap and smoothing on one piece of the mesh, each a sweep in a fixed order.
#pragma once

#include <vector>

#include "mesh/adapt.h"
#include "mesh/adapt/cavity.h"

namespace lamina::adapt_detail {

enum Operator : int { kCollapse, kSplit, kSwap, kSmooth, kRepair, kStretch, kOperatorCount };

/// Limits of one visit of a piece.
struct Rules {
  double floor = 0.1;            ///< absolute quality floor
  double short_edge = kUnitMin;  ///< edges below are collapsed
  double long_edge = kUnitMax;   ///< edges above are split
  double shortest_new = 0.5;     ///< no split makes an edge shorter than this
  double longest_new = 1.6;      ///< no collapse or swap makes an edge longer than this
  double swap_below = 0.75;      ///< cells below this quality are candidates of swaps
  double least_swap = 0.003;     ///< share of its energies that a swap takes off; less would go on for ever
  double least_move = 0.0003;    ///< the same of a move
  double relaxation = 1.3;       ///< of the Newton step of a vertex
  double metric_step = 0.0;      ///< metric length over which steps see the metric change; 0: it is held
  bool keep_lengths = false;     ///< no move takes lengths around its vertex further out of the unit range
  double repair_below = 0.45;    ///< and below this one of repairs
  bool align = false;            ///< place vertices on the levels of the metric
  double aligned_floor = 0.2;    ///< moves onto a level keep to this floor where `floor` is lower
  int enlargements = 6;          ///< cells a cavity may take in before a move is given up
};

template <int D>
class Operators {
 public:
  using Local = LocalMesh<D>;
  using Vertex = typename Local::Vertex;

  Operators(Local& mesh, const AdaptMetric<D>& field, double size_floor)
      : mesh_(mesh), cavity_(mesh), field_(field), size_floor_(size_floor) {}

  /// What stood unchanged since time `since` has been tried by the coming sweep already; what it changes is
  /// marked with time `now`.
  void set_time(int since, int now) {
    since_ = since;
    mesh_.now = now;
  }

  /// Runs the sweep of one operator and measures its time.
  void sweep(Operator what, const Rules& rules);
  [[nodiscard]] const std::array<OperatorStats, kOperatorCount>& stats() const { return stats_; }

 private:
  std::int64_t collapse_sweep(const Rules& rules);
  std::int64_t split_sweep(const Rules& rules);
  std::int64_t swap_sweep(const Rules& rules);
  std::int64_t smooth_sweep(const Rules& rules);
  /// Worst cells first: whatever single operation lifts the worst quality of its cavity, lengths permitting.
  std::int64_t repair_sweep(const Rules& rules);

  /// Edges out of the unit range: an end is moved along them.
  void stretch_sweep(const Rules& rules);

  struct Edge {
    double length;
    Index a, b, cell;
  };

  struct SwapFacet {  // an outer facet of the cavity of a swap
    std::array<Index, D> v;
    std::array<const Vertex*, D> corners;
    const Vertex* finest = nullptr;  // of the corners; none: corners are not looked up
    int piece;                       // of the boundary; 0: it lies within
    // In the metric of the finest corner: the normal, the sum of the sides from corner 0, and the squares of
    // the sides.
    bool measured = false;
    Vec<D> inward, sum;
    double squares;
  };

  struct NewtonStep {
    Vec<D> step = Vec<D>::Zero();     // in space
    double energy = 0.0, gain = 0.0;  // sum over the ball before the step, and what the step should take off
  };

  [[nodiscard]] bool changed(Index v) const { return mesh_.vertices[v].changed >= since_; }
  void evaluate(Vertex& p) const;
  struct Normals {
    std::array<Vec<D>, D> n;
    int count = 0;
  };
  [[nodiscard]] Normals normals_at(const Vertex& p) const;
  [[nodiscard]] Vec<D> within_pieces(Vec<D> v, const Vertex& p) const;
  /// Moves p by the part of the step that keeps it on its pieces.
  void slide(Vertex& p, const Vec<D>& step) const;
  /// Moves p to the nearest level of the metric, within its pieces, and evaluates it there; false when there
  /// is none in reach.
  bool place_on_level(Vertex& p) const;
  void collect_edges(double low, double high);
  [[nodiscard]] std::vector<std::pair<double, Index>> bad_cells(double below) const;
  [[nodiscard]] Index find_cell(Index a, Index b, Index hint);
  bool propose_enlarging(const Vertex& p, Index id, Index removed, const Rules& rules, double floor);
  bool split(const Edge& e, const Rules& rules);
  bool collapse(Index a, Index b, const Rules& rules);
  bool may_collapse(Index a, Index b, Index cell);
  bool swap_around(Index c, const Rules& rules);
  void list_vertices(std::vector<Index>& out);
  void list_facets(const std::array<Index, D + 1>& v, int move);
  double star_energy(const Vertex& p, SwapFacet& f);
  bool may_star(Index v, double worst, double limit);
  void list_apexes(const std::array<Index, D + 1>& v, int move, std::vector<Index>& apexes);
  bool repair(Index c, const Rules& rules);
  /// Lowers the sum of energy^power over the cells around a; high powers look at the worst cell alone.
  bool smooth(Index a, const Rules& rules, int power);
  /// Brings a to its level, at the price of energy but not of the floor, or along it to where the energy
  /// falls. Returns whether a is bound to a level, moved or not.
  bool align(Index a, const Rules& rules, const NewtonStep& newton);
  bool stretch(Index a, Index other, double wanted, const Rules& rules);
  [[nodiscard]] double length_excess(Index a, const Vertex& p) const;
  bool keeps_lengths(Index a, const Vertex& p, const Rules& rules);
  void move(Index a, const Vertex& p);
  NewtonStep newton_step(Index a, int power, double metric_step) const;
  void add_turning(Index a, int power, double step, const Mat<D>& to_space, Vec<D>& gradient) const;
  bool improves_ball(Index a, const Vertex& p, double worst, double limit, int power);

  Local& mesh_;
  Cavity<D> cavity_;
  const AdaptMetric<D>& field_;
  double size_floor_;
  int since_ = 0;
  std::vector<Edge> edges_;
  std::vector<Index> neighbors_;
  std::vector<double> energies_;
  std::vector<SwapFacet> facets_;
  std::size_t facet_count_ = 0;
  std::array<OperatorStats, kOperatorCount> stats_;
};

}  // namespace lamina::adapt_detail
