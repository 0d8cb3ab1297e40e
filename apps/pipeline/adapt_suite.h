// The benchmark of the optimizer: analytic metrics with what the mesh and the time must reach.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/case.h"
#include "core/progress.h"
#include "mesh/layer_score.h"

namespace lamina {

/// A body of make_shape() under Lamina's own wall metric.
struct SuiteBody {
  std::string shape;
  Case settings;
};

struct SuiteCase {
  /// The analytic metric, see core/analytic_metric.h, or a name of its own for a body; "/layers" behind it:
  /// aligned.
  std::string name;
  /// Targets: at least this share of unit edges, worst and mean quality, in at most these user seconds of
  /// adapt() on one thread, of a body from its surface on.
  double unit_share = 0.0, quality_min = 0.0, quality_mean = 0.0, seconds = 0.0;
  std::string start;   ///< file of the start mesh in a folder of data
  bool large = false;  ///< takes minutes
  std::optional<SuiteBody> body = std::nullopt;

  [[nodiscard]] std::string metric() const { return name.substr(0, name.find('/')); }
  [[nodiscard]] bool aligned() const { return name.find('/') != std::string::npos; }
};

/// Targets of aligned cases: at most this mean offset, in layers; at least these shares of the ideal number
/// of points on the wall and of the aligned edges that right columns have.
inline constexpr double kWantedOffset = 0.05, kWantedOnWall = 0.80, kWantedAligned = 0.75;

const std::vector<SuiteCase>& adapt_suite();

struct SuiteRow {
  SuiteCase wanted;
  std::int64_t start_cells = 0, cells = 0, points = 0;
  double unit_share = 0.0, quality_min = 0.0, quality_mean = 0.0;
  std::optional<LayerScore> layers;  ///< of an aligned case
  double user_seconds = 0.0, wall_seconds = 0.0, peak_bytes = 0.0;
  int threads = 1;

  /// Names of the properties that miss their targets; seconds count on one thread only.
  [[nodiscard]] std::vector<std::string> missed() const;
};

/// Cases by name; all that are not large when `name` is empty and `large` is not set. Errors: kUsage listing
/// the names when it is unknown.
std::vector<SuiteCase> select_cases(const std::string& name, bool large);

/// Adapts one case from the mesh named by its `start` in `data`, or, when `data` is empty, from a lattice
/// like it. Errors: those of reading a mesh, kMeshInvalid.
SuiteRow run_suite_case(const SuiteCase& c, const std::filesystem::path& data, int threads,
                        Progress* progress);

/// Lines of a table; a target stands beside each number, and a mark where it is missed.
std::string suite_header();
std::string suite_line(const SuiteRow& row);
std::string suite_json(const std::vector<SuiteRow>& rows);

}  // namespace lamina
