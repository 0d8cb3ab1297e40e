// What a run made, took and missed: as JSON for machines and as a short table for people.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/case.h"
#include "apps/pipeline/outcome.h"
#include "mesh/adapt.h"
#include "mesh/layer_score.h"
#include "mesh/score.h"
#include "mesh/validate.h"
#include "mesh/wall_fit.h"

namespace lamina {

/// Version of Lamina, "0.1.0".
std::string version();

/// A requested mesh has at least this share of unit edges; a run below it is reported as missed.
inline constexpr double kWantedUnitShare = 0.80;
/// ... and no cell of lower quality (mean ratio in the metric).
inline constexpr double kWantedQuality = 0.02;
/// ... and where the body is smooth its wall is met to within this share of h_min.
inline constexpr double kWantedWallFit = 0.5;

/// Names of the regions, in the order of Region.
inline constexpr std::array<const char*, 4> kRegionNames = {"inside", "layer", "Box2", "Box1"};

struct Report : RunOutcome {
  std::string version;
  ResolvedCase resolved;
  BodyKind kind = BodyKind::kSurface;
  SurfaceReport surface;  ///< of a surface
  OutlineReport outline;  ///< of a profile
  LevelSetReport level_set;
  std::array<std::int64_t, 4> region_cells{};  ///< cells with their centroid in each Region
  std::int64_t points = 0, facets = 0;
  LayerScore levels;
  WallFit wall;
  double expected_cells = 0.0;  ///< as predicted before the run
  Score score;
  std::vector<Region> worst_regions;  ///< of score.worst, in its order
  Validation validation;
  std::uint64_t mesh_hash = 0;  ///< of points and cells: equal hashes, equal meshes

  [[nodiscard]] std::int64_t cells() const;
  /// The paper's columns: all cells in Box2, those of the layer and of the body included.
  [[nodiscard]] std::int64_t box2_cells() const;
};

/// The lines of Report::missed for a score.
std::vector<std::string> missed_properties(const Score& score);

/// Names and texts of the lines of a table.
std::vector<std::pair<std::string, std::string>> layer_rows(const LayerScore& layers);

/// The lines of Report::missed for a wall with a first layer of h_min.
std::vector<std::string> missed_at_wall(const WallFit& wall, double h_min);
/// The wall's line of a table.
std::string wall_text(const WallFit& wall, double h_min);

/// Everything, indented; numbers in full precision, seconds and bytes, infinite and undefined ones null.
std::string report_json(const Report& report);

/// At most 25 lines: counts per region, edge lengths, quality, time and memory.
std::string report_table(const Report& report);

}  // namespace lamina
