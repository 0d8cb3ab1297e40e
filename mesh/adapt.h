// The anisotropic optimizer: makes a mesh unit in a metric that is evaluated directly at every new or moved
// vertex.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/field.h"
#include "core/level.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "mesh/mesh.h"

namespace lamina {

/// A family of metrics from coarse to wanted: `size_floor` s raises every size below s to s; 0 is the wanted
/// metric.
template <int D>
class AdaptMetric {
 public:
  virtual ~AdaptMetric() = default;
  [[nodiscard]] virtual Metric<D> at(const Vec<D>& x, double size_floor) const = 0;
  /// The level nearest to x, among those that lie at least size_floor apart; none beyond the layers.
  [[nodiscard]] virtual std::optional<Level<D>> level(const Vec<D>& /*x*/, double /*size_floor*/) const {
    return std::nullopt;
  }
  /// Signed distance to the wall that carries the levels; none where the metric has no wall.
  [[nodiscard]] virtual std::optional<double> wall_distance(const Vec<D>& /*x*/) const {
    return std::nullopt;
  }
};

enum class Align {
  kAnywhere,  ///< vertices where cells become most regular in the metric
  kLayers,    ///< vertices on the levels of the metric: semi-structured layers
};

struct AdaptStep;

/// The optimizer after a step, as bytes that AdaptOptions::resume takes. Made when called, during the
/// callback only.
using Snapshot = FunctionRef<std::string()>;
/// Called after every step, on the thread of the caller. Returning false ends the run there, with a valid
/// mesh.
using IterationCallback = std::function<bool(const AdaptStep& step, Snapshot snapshot)>;

/// The boundary that a run followed, and what of it each part of its mesh lies on.
class FollowedShape {
 public:
  FollowedShape() = default;
  FollowedShape(const FollowedShape&) = delete;
  FollowedShape& operator=(const FollowedShape&) = delete;
  virtual ~FollowedShape() = default;
};

inline constexpr double kHausdorffShare = 1e-3;

struct AdaptOptions {
  /// No accepted operation makes a cell worse than min(floor, what was there); the split of an edge longer
  /// than 2 may go down to min(0.4 floor, what was there).
  double quality_floor = 0.1;
  double start_size =
      0.0;                ///< first size floor; 0: the longest edge of the mesh, none when it is unit already
  double end_size = 0.0;  ///< smallest wanted size: the last floor is twice as large; 0: no steps between
  int passes_per_step = 3;  ///< block passes per step of the homotopy
  int final_passes = 8;  ///< at most so many at the wanted metric, dearer ones; fewer where they gain little
  Align align = Align::kAnywhere;
  /// Largest distance between new facets of curved boundaries and the input's; 0: kHausdorffShare of the
  /// diagonal of the mesh.
  double hausdorff = 0.0;
  /// Degrees, in (0, 90]: at larger angles between facets of one tag the boundary has a ridge, in 2D a
  /// corner, which is kept.
  double ridge_angle = 45.0;
  /// Cells of different tags stay apart: the facets between them are a boundary of either region.
  bool keep_cell_tags = true;
  /// AdaptSummary::shape of the run that made `mesh`, which is unchanged since: the input of that run is
  /// followed, with its tags, so that tolerances do not add up. None: `mesh` is.
  std::shared_ptr<const FollowedShape> follow = {};
  bool keep_shape = false;     ///< AdaptSummary::shape is wanted; about 24 bytes a point and 8 a cell
  int block_vertices = 16384;  ///< vertices per block; fixed by the mesh, never by the thread count
  IterationCallback after_step = {};
  /// A snapshot of a run on the same mesh and metric with the same options, by the same build on the same
  /// kind of machine: the run goes on from there and ends in the same bits. Must outlive the run.
  std::string_view resume = {};
};

/// Work of one operator.
struct OperatorStats {
  std::string name;
  std::int64_t tried = 0, accepted = 0;
  std::int64_t rejected_quality = 0, rejected_length = 0, rejected_class = 0;
  double seconds = 0.0;  ///< summed over the threads
};

/// State after one step of the homotopy: a row of the paper's Table 1.
struct AdaptStep {
  std::int64_t number = 0;  ///< 1, 2, ...
  double size_floor = 0.0;
  std::int64_t cells = 0, points = 0;
  double unit_share = 0.0, quality_min = 0.0, quality_mean = 0.0;
  double far_share = 0.0;  ///< edges shorter than 1/2 or longer than 2
  double seconds = 0.0;
};

struct AdaptSummary {
  std::vector<AdaptStep> steps;
  std::vector<OperatorStats> operators;
  double seconds = 0.0;  ///< of this run, not of one that it resumed
  std::string stopped_because;
  std::shared_ptr<const FollowedShape> shape;  ///< where AdaptOptions::keep_shape asks for it
};

/// Adapts `mesh` in place. The boundary of the domain is kept: facets of one tag between ridges are a piece.
/// Flat pieces stay flat, ridges and corners stay. Vertices of curved pieces lie on the input's facets,
/// and new facets within `hausdorff` of them, at points sampled (mesh/README.md). Facets between cells
/// of different tags, and those within the mesh that have tags and cut a part of it off, are kept like
/// boundaries. Listed edges are followed as ridges are, wherever they lie, listed corners stay, and what is
/// required stays as it is. REQUIRES a valid mesh (mesh/validate.h); boundary facets may be missing from the
/// list. Of the input's tags those of facets, edges, cells, corners and required points are kept, with names,
/// fields are not.
/// GUARANTEES (1) every cell positive by an exact predicate; (2) conforming; (3) the same bits for every
/// thread count; (4) `metric` receives the metric of every vertex, at the size floor of the last step, which
/// is the wanted metric unless `after_step` ended the run; (5) a mesh that is unit already and that polishing
/// would hardly improve stays as it is, unless `start_size` is given. Errors: kAdapt (tagged facets within
/// the mesh that cut nothing off, required cells or facets within a region, listed edges that are none of a
/// cell, more than 49151 pieces, 16383 lines or 65534 regions, a snapshot of another run), kInterrupted as
/// soon as `progress` asks for it; the mesh is then what it was.
template <int D>
AdaptSummary adapt(Mesh<D>& mesh, const AdaptMetric<D>& field, std::vector<Metric<D>>& metric,
                   const AdaptOptions& options, Progress* progress = nullptr);

}  // namespace lamina
