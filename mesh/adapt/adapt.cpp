// The main path of the optimizer. The wanted smallest size is approached by lowering a floor under all sizes,
// so that at every step the mesh is at most a factor of four away from its metric; at each step the mesh is
// cut into pieces along a Hilbert curve and every piece is visited by collapse, split, swap and smoothing
// sweeps. At the end edges out of the unit range are stretched, in a plane cells settle, and the
// surroundings of bad cells are mended.
#include "mesh/adapt.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "core/parallel.h"
#include "mesh/adapt/blocks.h"
#include "mesh/adapt/boundary.h"
#include "mesh/adapt/fixed_point.h"
#include "mesh/adapt/followed_shape.h"
#include "mesh/adapt/measure.h"
#include "mesh/adapt/operators.h"
#include "mesh/adapt/snapshot.h"

namespace lamina {
namespace {

using namespace adapt_detail;  // NOLINT: this file is the face of that namespace

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void add_stats(std::vector<OperatorStats>& total, const std::array<OperatorStats, kOperatorCount>& part) {
  for (int i = 0; i < kOperatorCount; ++i) {
    total[i].tried += part[i].tried;
    total[i].accepted += part[i].accepted;
    total[i].rejected_quality += part[i].rejected_quality;
    total[i].rejected_length += part[i].rejected_length;
    total[i].rejected_class += part[i].rejected_class;
    total[i].seconds += part[i].seconds;
  }
}

// The sweeps of one visit, on the way to the wanted metric and there: what polishing finds among good cells,
// two passes of it gain more than six plain ones. In space a collapse sweep follows split sweeps at once,
// before anything is spent on the shape of points that will go again; a plane keeps more of them, and better
// cells.
template <int D>
inline constexpr std::array kPlain = {kSplit, kCollapse, kSwap, kSmooth};
template <>
inline constexpr std::array kPlain<2> = {kCollapse, kSplit, kSplit, kSplit, kSwap, kSmooth};
template <int D>
inline constexpr std::array kPolish = {kSplit, kSplit,    kCollapse, kSwap, kSmooth, kSplit,
                                       kSwap,  kCollapse, kSmooth,   kSwap, kSmooth, kRepair};
template <>
inline constexpr std::array kPolish<2> = {kCollapse, kSplit,  kSplit, kSwap,   kSmooth, kCollapse,
                                          kSwap,     kSmooth, kSwap,  kSmooth, kRepair};

// Time counts sweeps, and leaves room for as many in every pass.
constexpr std::size_t kMostSweeps = std::max(kPolish<2>.size(), kPolish<3>.size());
constexpr int begin_of(int pass) { return pass * static_cast<int>(kMostSweeps); }

// When everything that sweep k of a pass looks at was last tried. A step begins with all vertices changed,
// so that passes of both kinds do not mix.
int last_tried(std::span<const Operator> sweeps, std::size_t k, int pass) {
  const auto before = sweeps.first(k);
  auto last = std::find(before.rbegin(), before.rend(), sweeps[k]);
  if (last != before.rend()) return begin_of(pass) + static_cast<int>(before.rend() - last) - 1;
  last = std::find(sweeps.rbegin(), sweeps.rend(), sweeps[k]);
  return begin_of(pass - 1) + static_cast<int>(sweeps.rend() - last) - 1;
}

// Around bad cells that an interface kept from being repaired, everything is tried again.
constexpr std::array kMending = {kRepair, kCollapse, kSplit, kSwap, kSmooth, kRepair};

// At the very end, when shapes are settled: what lengths gain here, smoothing would take back.
constexpr std::array kStretching = {kStretch, kStretch, kStretch};

// In a plane shapes follow once more, as far as lengths allow.
constexpr std::array kSettling = {kSmooth, kSwap, kSmooth};

constexpr double kLessSwaps = 0.05;  // where vertices are aligned: right columns have a mean quality of .83

Rules plain_rules(const AdaptOptions& options) {
  Rules rules;
  rules.floor = options.quality_floor;
  rules.align = options.align == Align::kLayers;
  if (rules.align) rules.swap_below -= kLessSwaps;
  return rules;
}

template <int D>
Rules polish_rules(const AdaptOptions& options) {
  Rules rules = plain_rules(options);
  // Where vertices are aligned long edges stay: the diagonals of right columns are sqrt 2 long.
  rules.short_edge = 0.75;
  if (D == 2) {
    rules.swap_below += 0.2;
    if (!rules.align) rules.long_edge = 1.25;
    rules.least_swap = 0.0003;
    rules.least_move = 0.0002;
  } else {
    rules.swap_below += 0.05;
    if (!rules.align) rules.long_edge = 1.38;
  }
  return rules;
}

template <int D>
Rules settling_rules(const AdaptOptions& options) {
  Rules rules = polish_rules<D>(options);
  rules.longest_new = kUnitMax;
  rules.keep_lengths = true;
  rules.metric_step = 0.1;
  return rules;
}

/// One pass over all cells, or over `cells` when there are some.
template <int D>
void run_pass(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, double floor, const AdaptOptions& options,
              int pass, std::span<const Operator> sweeps, const Rules& rules, const std::vector<Index>& cells,
              AdaptSummary& summary) {
  constexpr std::size_t kCellsPerVertex = D == 3 ? 5 : 2;
  const std::size_t cells_per_block = kCellsPerVertex * static_cast<std::size_t>(options.block_vertices);
  const std::size_t blocks = block_count(cells.empty() ? mesh.cells.size() : cells.size(), cells_per_block);
  std::vector<std::array<OperatorStats, kOperatorCount>> stats(blocks);
  const auto visit = [&](LocalMesh<D>& local, std::size_t block) {
    Operators<D> op(local, field, floor);
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
      op.set_time(cells.empty() ? last_tried(sweeps, k, pass) : 0, begin_of(pass) + static_cast<int>(k));
      op.sweep(sweeps[k], rules);
    }
    stats[block] = op.stats();
  };
  block_pass<D>(mesh, pass, begin_of(pass + 1) - 1, cells_per_block, cells, visit);
  for (const auto& s : stats) add_stats(summary.operators, s);
}

/// Passes over the surroundings of bad cells, until there are none or their number stops falling.
template <int D>
void mend(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, const AdaptOptions& options, int pass,
          AdaptSummary& summary) {
  constexpr int kRings = 4;
  constexpr int kMostPasses = 5;
  const double below = Rules().repair_below;
  std::vector<Index> bad = bad_cells(mesh, below);
  for (int i = 0; i < kMostPasses && !bad.empty(); ++i) {
    const std::size_t before = bad.size();
    run_pass<D>(mesh, field, 0.0, options, pass + i, kMending, plain_rules(options),
                cells_around(mesh, std::move(bad), kRings), summary);
    bad = bad_cells(mesh, below);
    if (bad.size() >= before) break;
  }
}

/// Passes over the edges out of the unit range; two, as pieces meet in other places at the second. Where few
/// are left, the rest of the mesh is not cut into pieces.
template <int D>
int stretch(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, const AdaptOptions& options, int pass,
            AdaptSummary& summary) {
  constexpr int kPasses = 2;
  constexpr int kRings = 2;
  std::fill(mesh.changed.begin(), mesh.changed.end(), begin_of(pass));
  for (int i = 0; i < kPasses; ++i) {
    const int since =
        i == 0 ? begin_of(pass) : begin_of(pass + i - 1) + static_cast<int>(kStretching.size()) - 1;
    std::vector<Index> cells = cells_around(mesh, loose_cells(mesh, since), kRings);
    if (cells.empty()) break;
    if (2 * cells.size() > mesh.cells.size()) cells.clear();
    run_pass<D>(mesh, field, 0.0, options, pass + i, kStretching, plain_rules(options), cells, summary);
  }
  return pass + kPasses;
}

/// A pass that gives shapes back what stretching took, and more: the way of each vertex knows how the metric
/// changes along it.
template <int D>
int settle(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, const AdaptOptions& options, int pass,
           AdaptSummary& summary) {
  std::fill(mesh.changed.begin(), mesh.changed.end(), begin_of(pass));
  run_pass<D>(mesh, field, 0.0, options, pass, kSettling, settling_rules<D>(options), {}, summary);
  return pass + 1;
}

// Floors under the sizes, step by step. Each quarters the one before; the last is twice the smallest wanted
// size, so that polishing starts from a mesh of nearly as many cells. Halving gains nothing in quality.
std::vector<double> size_floors(double start, double end) {
  constexpr double kRatio = 4.0;
  std::vector<double> floors = {0.0};
  if (end > 0.0)
    for (double s = 2.0 * end; s < start; s *= kRatio) floors.push_back(s);
  if (start > end) floors.push_back(start);
  std::reverse(floors.begin(), floors.end());
  return floors;
}

template <int D>
AdaptState<D> first_state(const Mesh<D>& mesh, const AdaptMetric<D>& field, const AdaptOptions& options) {
  AdaptState<D> state;
  for (const char* name : {"collapse", "split", "swap", "smooth", "repair", "stretch"}) {
    state.summary.operators.emplace_back();
    state.summary.operators.back().name = name;
  }
  state.mesh = options.follow != nullptr ? recall_mesh(mesh, *options.follow, state.tags)
                                         : import_mesh(mesh, options, state.tags);
  double first = options.start_size;
  if (!(first > 0.0)) {
    evaluate_metric(state.mesh, field, 0.0, 0);
    state.unit_already = is_adapted(state.mesh);
    if (!state.unit_already) first = longest_in_space(state.mesh);
    if (state.unit_already && options.align == Align::kLayers) find_levels(state.mesh, field);
  }
  state.floors = size_floors(first, options.end_size);
  return state;
}

// Tags that follow no surface, as those that a metric gives to cells, leave nothing to move.
template <int D>
void warn_of_rags(const GlobalMesh<D>& mesh, Progress& progress) {
  constexpr std::int64_t kMany = 100;
  std::int64_t between = 0, corners = 0;
  for (const PieceSet pieces : mesh.pieces) {
    bool inner = false;
    for (int k = 0; k < pieces.size(); ++k) inner = inner || mesh.shape->is_inner(pieces[k]);
    between += inner;
    corners += inner && pieces.is_corner<D>();
  }
  if (corners < kMany || 2 * corners < between) return;
  progress.warn(
      fmt::format("{} of the {} points between cells of different tags are corners of ragged borders, "
                  "and stay: tags that are no regions should be dropped (--cell-tags drop)",
                  corners, between));
}

template <int D>
AdaptStep run_step(AdaptState<D>& state, const AdaptMetric<D>& field, const AdaptOptions& options,
                   const Progress* progress) {
  const auto start = std::chrono::steady_clock::now();
  GlobalMesh<D>& mesh = state.mesh;
  const double floor = state.floors[state.next];
  const bool last = state.next + 1 == state.floors.size();
  evaluate_metric(mesh, field, floor, begin_of(state.pass));
  // Polishing looks at what the plain passes left alone.
  if (last) std::fill(mesh.changed.begin(), mesh.changed.end(), begin_of(state.pass));
  const int passes = last ? options.final_passes : options.passes_per_step;
  constexpr double kWorthwhile =
      D == 2 ? 0.001 : 0.005;  // share of the edges that a final pass should make unit
  double gain = 1.0;
  double share = 0.0;
  for (int i = 0; i < passes && gain > kWorthwhile; ++i) {
    if (progress != nullptr) progress->check_cancelled();
    if (!last) {
      run_pass<D>(mesh, field, floor, options, state.pass++, kPlain<D>, plain_rules(options), {},
                  state.summary);
      continue;
    }
    run_pass<D>(mesh, field, floor, options, state.pass++, kPolish<D>, polish_rules<D>(options), {},
                state.summary);
    const double reached = unit_share(mesh);
    gain = reached - std::exchange(share, reached);
  }
  if (last) {
    state.pass = stretch(mesh, field, options, state.pass, state.summary);
    if (D == 2) {
      state.pass = settle(mesh, field, options, state.pass, state.summary);
      state.pass = stretch(mesh, field, options, state.pass, state.summary);
    }
    mend(mesh, field, options, state.pass, state.summary);
  }
  AdaptStep step = measure(mesh);
  step.number = static_cast<std::int64_t>(state.next) + 1;
  step.size_floor = floor;
  step.seconds = seconds_since(start);
  return step;
}

template <int D>
AdaptStep polish_if_worthwhile(AdaptState<D>& state, const AdaptMetric<D>& field, const AdaptOptions& options,
                               const Progress* progress) {
  const GlobalMesh<D> old = state.mesh;
  AdaptStep before = measure(old);
  const AdaptStep after = run_step(state, field, options, progress);
  if (is_worthwhile(before, old, after, state.mesh, options)) return after;
  state.mesh = old;
  before.number = after.number;
  before.seconds = after.seconds;
  return before;
}

}  // namespace

template <int D>
AdaptSummary adapt(Mesh<D>& mesh, const AdaptMetric<D>& field, std::vector<Metric<D>>& metric,
                   const AdaptOptions& options, Progress* progress) {
  const auto start = std::chrono::steady_clock::now();
  AdaptState<D> state =
      options.resume.empty() ? first_state<D>(mesh, field, options) : decode<D>(options.resume, options);
  if (progress != nullptr && options.resume.empty()) warn_of_rags(state.mesh, *progress);
  bool go_on = true;
  while (go_on && state.next < state.floors.size()) {
    const AdaptStep step = state.unit_already ? polish_if_worthwhile(state, field, options, progress)
                                              : run_step(state, field, options, progress);
    state.summary.steps.push_back(step);
    ++state.next;
    if (progress)
      progress->update(static_cast<double>(state.next) / static_cast<double>(state.floors.size()),
                       fmt::format("step {} of {}, {} cells, {:.1f} % unit edges", state.next,
                                   state.floors.size(), step.cells, 100.0 * step.unit_share));
    const auto snapshot = [&] { return encode(state, options); };
    go_on = !options.after_step || options.after_step(step, snapshot);
  }
  AdaptSummary summary = std::move(state.summary);
  summary.stopped_because =
      state.next == state.floors.size()
          ? "all steps done"
          : fmt::format("stopped by the caller after step {} of {}, at a size floor of {:.4g}", state.next,
                        state.floors.size(), state.floors[state.next - 1]);
  export_mesh(state.mesh, state.tags, mesh);
  metric = std::move(state.mesh.metric);
  if (options.keep_shape) summary.shape = remember_shape(state.mesh, state.tags);
  summary.seconds = seconds_since(start);
  return summary;
}

template AdaptSummary adapt(Mesh<2>&, const AdaptMetric<2>&, std::vector<Metric<2>>&, const AdaptOptions&,
                            Progress*);
template AdaptSummary adapt(Mesh<3>&, const AdaptMetric<3>&, std::vector<Metric<3>>&, const AdaptOptions&,
                            Progress*);

}  // namespace lamina
