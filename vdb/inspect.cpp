// The sag of facets is judged by what first layers do there: they keep their height above the facets, so
// where facets miss the round wall by more than that height, the mesh resolves the facets' edges as kinks
// that the wall does not have. The sag goes with the square of the edge length.
#include "vdb/inspect.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/intersections.h"
#include "vdb/detail/topology.h"

namespace lamina {
namespace {

void check(const InspectOptions& o) {
  if (!(o.feature_angle_degrees > 0.0 && o.feature_angle_degrees < 180.0))
    throw Error(ErrorCode::kParameter, fmt::format("inspect: feature_angle_degrees = {:g} is not in (0, 180)",
                                                   o.feature_angle_degrees));
  if (o.h_min && !(*o.h_min > 0.0 && std::isfinite(*o.h_min)))
    throw Error(ErrorCode::kParameter, fmt::format("inspect: h_min = {:g} is not in (0, inf)", *o.h_min));
}

std::string words_on_crossings(const SurfaceInspection& i) {
  const char* ended = "the search was ended early, for too many facets lie close together";
  if (i.crossing_pairs == 0 && !i.crossings_complete) return fmt::format("none found, but {}", ended);
  if (i.crossing_pairs == 0) return "no facet crosses or overlaps another";
  const Vec3& x = *i.first_crossing;
  std::string words = fmt::format(
      "{}{} or overlap each other, the first at ({:.6g}, {:.6g}, {:.6g}); where shells overlap their union "
      "is "
      "meshed",
      i.crossings_complete ? "" : "at least ",
      counted(i.crossing_pairs, "pair of facets that cross", "pairs of facets that cross"), x[0], x[1], x[2]);
  return i.crossings_complete ? words : words + "; " + ended;
}

std::string words_on_sag(double sag, const InspectOptions& options) {
  if (sag == 0.0) return "no smooth edge bends: the facets carry first layers of any height";
  const std::string miss = fmt::format("facets miss a round wall by up to {:.3g}", sag);
  if (!options.h_min) return fmt::format("{}: they carry first layers of h_min >= {:.3g}", miss, sag);
  const double ratio = sag / *options.h_min;
  if (ratio <= 1.0)
    return fmt::format("{}, {:.3g} of the first layer: they carry h_min = {:g}", miss, ratio, *options.h_min);
  return fmt::format(
      "{}, {:.4g} times the first layer of {:g}: layers will follow the facets, with kinks at their edges, "
      "and not the round wall; triangulate finer (edges shorter by {:.2g}) or take h_min >= {:.3g}",
      miss, ratio, *options.h_min, std::sqrt(ratio), sag);
}

}  // namespace

SurfaceInspection inspect(const Surface& surface, const SurfaceReport& report,
                          const InspectOptions& options) {
  check(options);
  SurfaceInspection out;
  const detail::Intersections crossings = detail::find_intersections(surface);
  out.crossing_pairs = crossings.pairs;
  out.crossings_complete = crossings.complete;
  if (crossings.pairs > 0) out.first_crossing = crossings.place;
  out.crossings_words = words_on_crossings(out);
  const detail::Topology topology =
      detail::make_topology(surface, options.feature_angle_degrees * std::numbers::pi / 180.0);
  out.sharp_edges = topology.sharp_edges;
  out.corners = topology.corners;
  out.smallest_h_min = report.facet_sag;
  if (options.h_min) out.sag_per_h_min = report.facet_sag / *options.h_min;
  out.sag_words = words_on_sag(report.facet_sag, options);
  return out;
}

}  // namespace lamina
