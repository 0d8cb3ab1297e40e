#include "mesh/adapt/fixed_point.h"

#include <algorithm>

#include "core/parallel.h"
#include "mesh/adapt/measure.h"

namespace lamina::adapt_detail {
namespace {

template <int D>
std::int64_t on_levels(const GlobalMesh<D>& mesh) {
  return static_cast<std::int64_t>(mesh.level.size()) -
         std::count(mesh.level.begin(), mesh.level.end(), kNoLevel);
}

}  // namespace

template <int D>
bool is_adapted(const GlobalMesh<D>& mesh) {
  constexpr double kUnitShare = 0.8;
  constexpr double kLongest = 4.0;  // a seed may be unit in its far field, most of it, and miss the body
  return unit_share(mesh) >= kUnitShare && longest_in_metric(mesh) <= kLongest;
}

template <int D>
void find_levels(GlobalMesh<D>& mesh, const AdaptMetric<D>& field) {
  constexpr double kThere = 1e-6;  // of a layer: far above rounding
  for_each_index(
      mesh.x.size(),
      [&](std::size_t v) {
        const auto level = field.level(mesh.x[v], 0.0);
        if (level && level->metric.length(level->way) <= kThere) mesh.level[v] = level->number;
      },
      256);
}

template <int D>
bool is_worthwhile(const AdaptStep& before, const GlobalMesh<D>& old, const AdaptStep& after,
                   const GlobalMesh<D>& mesh, const AdaptOptions& options) {
  constexpr double kGain = 0.005, kFewer = 1e-4, kMoreLevels = 0.01;
  const double more = static_cast<double>(on_levels(mesh) - on_levels(old));
  return after.unit_share > before.unit_share + kGain || after.quality_mean > before.quality_mean + kGain ||
         after.far_share < before.far_share - kFewer ||
         (before.quality_min < options.quality_floor && after.quality_min > 1.1 * before.quality_min) ||
         (options.align == Align::kLayers && more > kMoreLevels * static_cast<double>(mesh.x.size()));
}

template bool is_adapted(const GlobalMesh<2>&);
template bool is_adapted(const GlobalMesh<3>&);
template void find_levels(GlobalMesh<2>&, const AdaptMetric<2>&);
template void find_levels(GlobalMesh<3>&, const AdaptMetric<3>&);
template bool is_worthwhile(const AdaptStep&, const GlobalMesh<2>&, const AdaptStep&, const GlobalMesh<2>&,
                            const AdaptOptions&);
template bool is_worthwhile(const AdaptStep&, const GlobalMesh<3>&, const AdaptStep&, const GlobalMesh<3>&,
                            const AdaptOptions&);

}  // namespace lamina::adapt_detail
