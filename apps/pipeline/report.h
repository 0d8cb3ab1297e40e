// What a run made, took and missed: as JSON for machines and as a short table for people.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/pipeline/case.h"
#include "apps/pipeline/outcome.h"
#include "mesh/adapt.h"
#include "mesh/score.h"
#include "mesh/validate.h"

namespace lamina {

/// Version of Lamina, "0.1.0".
std::string version();

/// A requested mesh has at least this share of unit edges; a run below it is reported as missed.
inline constexpr double kWantedUnitShare = 0.80;
/// ... and no cell of lower quality (mean ratio in the metric).
inline constexpr double kWantedQuality = 0.02;

/// Names of the regions, in the order of Region.
inline constexpr std::array<const char*, 4> kRegionNames = {"inside", "layer", "Box2", "Box1"};

/// Where the points of the layers lie.
struct LevelFit {
  std::int64_t points = 0;    ///< from the wall to the top of the layers
  std::int64_t on_level = 0;  ///< within 5 % of a layer's thickness of a level
  std::int64_t on_wall = 0;   ///< of those, on the wall
  double mean_offset = 0.0;   ///< distance to the nearest level, in layers; 1/4 at random
};

struct Report : RunOutcome {
  std::string version;
  ResolvedCase resolved;
  BodyKind kind = BodyKind::kSurface;
  SurfaceReport surface;  ///< of a surface
  OutlineReport outline;  ///< of a profile
  LevelSetReport level_set;
  std::array<std::int64_t, 4> region_cells{};  ///< cells with their centroid in each Region
  std::int64_t points = 0, facets = 0;
  LevelFit levels;
  double expected_cells = 0.0;  ///< as predicted before the run
  Score score;
  std::vector<Region> worst_regions;  ///< of score.worst, in its order
  Validation validation;
  std::uint64_t mesh_hash = 0;  ///< of points and cells: equal hashes, equal meshes

  [[nodiscard]] std::int64_t cells() const;
  /// The paper's columns: all cells in Box2, those of the layer and of the body included.
  [[nodiscard]] std::int64_t box2_cells() const;
};

/// From the signed distances of all points.
LevelFit fit_levels(const BoundaryLayer& layer, const std::vector<double>& phi);

/// The lines of Report::missed for a score.
std::vector<std::string> missed_properties(const Score& score);

/// Everything, indented; numbers in full precision, seconds and bytes, infinite and undefined ones null.
std::string report_json(const Report& report);

/// At most 25 lines: counts per region, edge lengths, quality, time and memory.
std::string report_table(const Report& report);

}  // namespace lamina
