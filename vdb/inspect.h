// What a cleaned surface holds in store for boundary layers: where it crosses itself, its sharp features, and
// how small a first layer its facets carry.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vdb/level_set.h"
#include "vdb/surface.h"

namespace lamina {

struct InspectOptions {
  double feature_angle_degrees = LevelSetOptions{}.feature_angle_degrees;  ///< in (0, 180)
  std::optional<double> h_min = std::nullopt;  ///< height of the first layer, world units, > 0
};

struct SurfaceInspection {
  /// Pairs of facets with more in common than touch: a stretch of line inside one of them, or an area. Shared
  /// corners and edges are touch, as are edges along each other; a facet folded onto its neighbour is not.
  std::int64_t crossing_pairs = 0;
  bool crossings_complete = true;          ///< false: the search was ended early, there are at least so many
  std::optional<Vec3> first_crossing;      ///< a point of the first pair, world units
  std::int64_t sharp_edges = 0;            ///< convex ones, exterior dihedral above the feature angle; rims
  std::int64_t corners = 0;                ///< where sharp edges meet or turn, and tips
  double smallest_h_min = 0.0;             ///< of the first layers that the facets carry: the facet sag
  std::optional<double> sag_per_h_min;     ///< facet sag / h_min, when that was given; carried up to 1
  std::string crossings_words, sag_words;  ///< what it means, and the remedy
};

/// Inspects a surface that clean() has returned, with its report. Errors: kParameter for an option out of its
/// range. Cost: 2 CPU seconds for a million facets of a clean body; ends also where everything crosses, see
/// `crossings_complete`. GUARANTEES the same answer for every thread count.
SurfaceInspection inspect(const Surface& surface, const SurfaceReport& report,
                          const InspectOptions& options = {});

}  // namespace lamina
