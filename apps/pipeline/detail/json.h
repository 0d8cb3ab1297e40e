// Values of the pipeline as JSON. Private to apps: keeps nlohmann's headers out of the public ones.
#pragma once

#include <nlohmann/json.hpp>

#include "apps/pipeline/case.h"
#include "apps/pipeline/outcome.h"
#include "mesh/layer_score.h"
#include "mesh/score.h"
#include "mesh/validate.h"
#include "mesh/wall_fit.h"
#include "vdb/inspect.h"
#include "vdb/outline.h"
#include "vdb/surface.h"

namespace lamina {

using Json = nlohmann::ordered_json;

Json to_json(const Vec3& x);
/// [x0, y0, z0, x1, y1, z1], of a box of the plane [x0, y0, x1, y1].
Json to_json(const Box<3>& box);
Json to_json(const Score& score);
Json to_json(const LayerScore& score);
Json to_json(const WallFit& wall);
Json to_json(const Validation& validation);
Json to_json(const SurfaceReport& surface);
Json to_json(const OutlineReport& outline);
Json to_json(const SurfaceInspection& inspection);
Json to_json(const LevelSetReport& level_set);
Json to_json(const BoundaryLayer& layer);
/// Tables and keys as in the case file.
Json to_json(const Case& c);
/// Cells of Score::worst, in its order.
Json worst_cells_json(const Score& score);

/// Adds the keys that every run's report ends with.
void append_outcome(Json& json, const RunOutcome& outcome);

/// Indented text that survives names which are not UTF-8.
std::string json_text(const Json& json);

}  // namespace lamina
