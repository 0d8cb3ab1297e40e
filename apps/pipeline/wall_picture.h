// Pictures of a wall itself: its level set traced along the lines of sight, coloured by curvature.
#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include "core/field.h"

namespace lamina {

enum class WallColor {
  kPlain,        ///< light grey
  kCurvature,    ///< mean of k1 and k2 times the body's extent: red convex, blue concave
  kReliability,  ///< WallPoint::reliability, red at 0, blue-white at 1
};

struct WallPictureOptions {
  int up = 2;               ///< axis that points up in the picture: 0, 1, 2
  double azimuth = 215.0;   ///< where the eye is: degrees around that axis, for z from +x towards +y
  double elevation = 25.0;  ///< degrees towards that axis, in [-90, 90]
  double zoom = 1.0;        ///< > 1: the middle of the picture, enlarged; in [0.1, 1000]
  Vec3 look_at =
      Vec3::Constant(std::numeric_limits<double>::quiet_NaN());  ///< DEFAULT: the middle of the body
  WallColor color = WallColor::kCurvature;
  int width_px = 1000;  ///< in [200, 8000]; the height follows
  std::string title;    ///< empty: none
};

/// Draws the wall in parallel projection, sharp edges black, to .png, .svg or .pdf, atomically; the same
/// bytes for the same input. Errors: kFileUnsupported (extension), kParameter (options), kFileWrite. Cost:
/// some twenty distances per pixel.
void draw_wall(const std::filesystem::path& path, const WallField& wall, const WallPictureOptions& options);

}  // namespace lamina
