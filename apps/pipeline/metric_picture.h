// Pictures of a metric before there is a mesh.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "apps/pipeline/case.h"
#include "core/wall_metric.h"

namespace lamina {

enum class MetricColor {
  kSize,   ///< smallest principal size, logarithmic
  kRatio,  ///< largest over smallest principal size, logarithmic
};

struct MetricPictureOptions {
  Plane plane;
  std::array<double, 4> window{};  ///< u0 v0 u1 v1 in the plane, world units, as PictureOptions
  MetricColor color = MetricColor::kSize;
  bool ellipses = true;  ///< directions and ratios in the plane, each drawn to the same length
  int width_px = 1000;   ///< in [200, 8000]; the height follows
};

/// Draws the metric on a plane to .png, .svg or .pdf, atomically: the wall red, the top of the layers blue;
/// the same bytes for the same input. Errors: kFileUnsupported (extension), kParameter (options), kFileWrite.
/// Cost: a metric per pixel.
void draw_metric(const std::filesystem::path& path, const WallMetric& metric,
                 const MetricPictureOptions& options);

}  // namespace lamina
