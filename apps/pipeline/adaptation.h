// Any mesh made unit in a given metric: mesh and metric from files or from a formula -> adapted mesh, metric
// and report.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/case.h"
#include "apps/pipeline/outcome.h"
#include "core/progress.h"
#include "mesh/adapt.h"
#include "mesh/carry.h"
#include "mesh/layer_score.h"
#include "mesh/score.h"
#include "mesh/validate.h"

namespace lamina {

/// The metric in which linear interpolation of a point field has the least error in L^p, see mesh/hessian.h.
struct LpHessian {
  std::string field;  ///< see scalar_field in apps/pipeline/detail/wanted_metric.h
  double p = 2.0;     ///< at least 1
};

struct Adaptation {
  /// The mesh to adapt. Empty: the start of the analytic metric's benchmark, a lattice in its own box.
  std::filesystem::path mesh;
  std::string analytic;  ///< NAME[:key=value,...], see core/analytic_metric.h
  /// Instead of `analytic`: tensors of the mesh's points (.sol, .solb), or another mesh with its metric, see
  /// BackgroundMetric::read. When both are empty, and `lp_hessians` too: the metric that belongs to `mesh`.
  std::filesystem::path metric;
  std::vector<LpHessian> lp_hessians;  ///< each of the wanted complexity before they are intersected
  std::vector<std::filesystem::path> intersect;  ///< more metrics, given as `metric` is
  /// A wall whose layers bound all of that: a point field of signed distances, or a body as `lamina mesh` has
  /// them. Alone: its metric only. Sizes beyond the layers grow by `wall`'s gradation, without h1 and h2 up
  /// to `h_max`.
  std::string level_set;
  Case wall;  ///< options of that wall; its h_min is by default `h_min`, its domain the bounds of `mesh`
  std::vector<std::filesystem::path> outputs;
  std::optional<std::filesystem::path> metric_out, report;
  double h_min = 0.0;       ///< smallest size, world units; 0: no bound
  double h_max = 0.0;       ///< largest size; 0: no bound
  double complexity = 0.0;  ///< wanted integral of sqrt(det M), by one factor on all sizes; 0: as given
  /// Bound on the growth of sizes per unit of metric length, see mesh/gradation.h; 0: none.
  double gradation = 0.0;
  double quality_floor = AdaptOptions{}.quality_floor;
  double hausdorff = 0.0;  ///< as AdaptOptions::hausdorff
  double ridge_angle = AdaptOptions{}.ridge_angle;
  bool keep_cell_tags = true;      ///< as AdaptOptions::keep_cell_tags
  bool keep_edges = true;          ///< listed edges, corners and required parts
  Align align = Align::kAnywhere;  ///< kLayers: for metrics with layers only
  int threads = 0;                 ///< 0: all
};

/// A point field of the input on the new mesh.
struct CarriedField {
  std::string name;
  int components = 1;
  FieldRange before, after;
};

struct AdaptationReport : RunOutcome {
  Adaptation adaptation;
  int dimension = 3;
  std::int64_t points_before = 0, cells_before = 0;
  std::int64_t points = 0, cells = 0, facets = 0;
  double scale = 1.0;                       ///< factor on all sizes that --complexity asked for
  std::optional<BoundaryLayer> wall_layer;  ///< of level_set
  std::vector<CarriedField> fields;
  Score score;
  std::optional<LayerScore> layers;  ///< of a metric with layers
  Validation validation;
  std::uint64_t mesh_hash = 0;
};

/// Reads, adapts, judges and writes; point fields of the mesh are carried along, see mesh/carry.h. Inverted
/// cells are turned and unused points dropped, with a warning. report.missed lists properties that were not
/// reached (exit code 3). Errors: kUsage, kParameter, those of reading and writing files, kAdapt and
/// kMeshInvalid when the mesh cannot be adapted, kInterrupted.
AdaptationReport run_adaptation(const Adaptation& a, Progress* progress);

std::string adaptation_json(const AdaptationReport& report);
/// A short table for people.
std::string adaptation_table(const AdaptationReport& report);

}  // namespace lamina
