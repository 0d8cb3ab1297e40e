// The whole path: body -> level set -> metric -> seed -> adapted mesh -> files, report and picture.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/pipeline/case.h"
#include "apps/pipeline/report.h"
#include "core/progress.h"
#include "core/wall_metric.h"
#include "vdb/level_set.h"
#include "vdb/size_grid.h"

namespace lamina {

/// The metric of --metric.
struct UserMetric {
  std::shared_ptr<const MetricField<3>> field;
  Box<3> bounds;
  double smallest = 0.0;  ///< size
};

/// A body made ready: level set and what the intake found.
struct Body {
  LevelSet level_set;
  BodyKind kind = BodyKind::kSurface;
  SurfaceReport surface = {};            ///< of a surface
  OutlineReport outline = {};            ///< of a profile
  std::vector<SizeGrid> painted = {};    ///< --size-grid
  std::optional<UserMetric> user = {};   ///< --metric
  std::vector<Vec3> facet_centers = {};  ///< of a surface; of a large one every n-th

  /// A plane body: the mesh is one of triangles, boxes are endless in z.
  [[nodiscard]] bool planar() const { return kind == BodyKind::kProfile; }
};

/// Reads .stl/.obj/.ply/.vdb or a profile, applies the unit, cleans, builds the level set.
Body load_body(const Case& c, Progress* progress);

/// The same for the surface of a closed body, in metres; `name` stands for its file in messages.
Body surface_body(const Case& c, Surface surface, const std::string& name, Progress* progress);

/// Metric of a resolved case. REQUIRES body to outlive it.
WallMetric wall_metric(const Body& body, const ResolvedCase& r);

/// The metric of a wall as the family that the optimizer and the judges of meshes ask for. REQUIRES metric to
/// outlive it.
template <int D>
std::unique_ptr<const AdaptMetric<D>> metric_family(const WallMetric& metric);

/// Fills every default of the case that depends on the body (length, layers, boxes, sizes) and checks it.
ResolvedCase resolve_case(const Case& c, const Body& body);

/// The sizes of a case as the metric takes them. REQUIRES h2, h1 and Box2; the domain
/// is that of the case, empty when it has none.
SizeOptions size_options(const Case& c);

/// Smallest size that the metric of a resolved case has anywhere.
double smallest_size(const ResolvedCase& r, const Body& body);

/// How the optimizer goes about a case.
AdaptOptions adapt_options(const ResolvedCase& r, const Body& body);

/// "120 voxels", or of a profile "64 points of 1 curve".
std::string size_text(const Body& body);

/// Hands on what was said of the body and of the case, which may be null.
void pass_on_warnings(const Body& body, const ResolvedCase* resolved, Progress& progress);

/// Runs a case and writes everything it asks for. Returns the report; report.missed lists properties that
/// were asked for and not reached (exit code 3).
Report run_case(const Case& c, Progress* progress);

}  // namespace lamina
