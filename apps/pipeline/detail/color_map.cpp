#include "apps/pipeline/detail/color_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lamina {
namespace {

/// Piecewise linear through equally spaced colours.
template <std::size_t N>
Rgb interpolate(const std::array<Rgb, N>& stops, double t) {
  const double at = (t > 0.0 ? std::min(t, 1.0) : 0.0) * (N - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), N - 2);
  const double rest = at - static_cast<double>(i);
  Rgb c{};
  for (std::size_t k = 0; k < 3; ++k) c[k] = stops[i][k] + rest * (stops[i + 1][k] - stops[i][k]);
  return c;
}

constexpr std::array<Rgb, 5> kQualityStops = {
    {{0.60, 0.00, 0.10}, {0.88, 0.33, 0.19}, {0.99, 0.75, 0.36}, {0.97, 0.94, 0.78}, {0.83, 0.91, 0.97}}};

constexpr std::array<Rgb, 7> kSizeStops = {{{0.36, 0.22, 0.50},
                                            {0.36, 0.40, 0.65},
                                            {0.32, 0.56, 0.68},
                                            {0.33, 0.70, 0.64},
                                            {0.51, 0.82, 0.52},
                                            {0.77, 0.91, 0.43},
                                            {0.99, 0.96, 0.55}}};

constexpr std::array<Rgb, 5> kCurvatureStops = {
    {{0.08, 0.26, 0.60}, {0.42, 0.66, 0.87}, {0.95, 0.95, 0.93}, {0.95, 0.60, 0.42}, {0.66, 0.06, 0.12}}};

constexpr std::array<Rgb, 4> kRegionColors = {
    {{0.80, 0.80, 0.80}, {0.99, 0.83, 0.60}, {0.77, 0.87, 0.95}, {0.98, 0.98, 0.94}}};

}  // namespace

Rgb quality_color(double t) { return interpolate(kQualityStops, t); }

Rgb size_color(double t) { return interpolate(kSizeStops, t); }

Rgb curvature_color(double t) { return interpolate(kCurvatureStops, t); }

Rgb region_color(int region) {
  if (region < 0 || region >= static_cast<int>(kRegionColors.size())) return kPlainColor;
  return kRegionColors[static_cast<std::size_t>(region)];
}

}  // namespace lamina
