// The walls of a plane flow: closed curves around bodies and open ones, which are sheets of no thickness.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"
#include "vdb/surface.h"

namespace lamina {

struct OutlineCurve {
  std::vector<Vec2> points;  ///< in order; of a closed curve the first one is not repeated
  bool closed = true;
  bool smooth = false;  ///< a cubic spline through the points, with corners where it turns sharply
  /// Of the wall that chords stand for, at each point; > 0 where the solid is convex. Empty: from the points.
  std::vector<double> curvature = {};
};

struct Outline {
  std::vector<OutlineCurve> curves;
};

/// What was found in an outline, and what clean() did to it.
struct OutlineReport {
  std::int64_t points_read = 0, points = 0;  ///< before and after cleaning
  std::int64_t closed_curves = 0, open_curves = 0;
  std::int64_t duplicates = 0;        ///< points dropped because they lie on the one before
  std::int64_t turned = 0;            ///< curves whose direction was reversed
  std::vector<std::string> warnings;  ///< one line each
};

/// True when the extension (any case) is .dat, .csv or .txt.
bool is_outline_file(const std::filesystem::path& path);

/// Reads aerofoils (.dat: Selig's order, Lednicer's, several elements parted by 999 999) and lists of points
/// (.csv, .txt: x and y a line, curves parted by blank lines; a curve is closed when its last point is its
/// first). Aerofoils are smooth, lists are not. An aerofoil whose ends differ gets a blunt trailing edge.
/// Errors: kFileMissing, kFileUnreadable, kFileUnsupported (extension), kFileFormat naming line, value and
/// remedy, kSurfaceEmpty without points.
Outline read_outline(const std::filesystem::path& path);

/// Writes curves as read_outline reads them from a .csv or .txt, or one closed smooth curve as an aerofoil in
/// Selig's order (.dat); atomically, doubles to the bit. Errors: kFileWrite, kFileUnsupported.
void write_outline(const std::filesystem::path& path, const Outline& outline, const std::string& title);

/// Drops repeated points and turns curves so that solid lies to their left: a curve within another one is a
/// hole, one within that solid again. Errors: kSurfaceEmpty (no extent), kSurfaceInvalid for a closed curve
/// of no area. `name` is used in messages only. Crossing curves are found by LevelSet::from_outline.
OutlineReport clean(Outline& outline, const std::string& name);

/// The section of a cleaned surface by the plane where coordinate `axis` is `offset`, as chords; its
/// coordinates are the other two in the order x, y, z. What only touches the plane from below is left out.
/// `name` is used in messages. Errors: kDomain when the plane misses the surface, kSurfaceInvalid where more
/// than two facets meet in an edge that it cuts.
Outline slice(const Surface& surface, int axis, double offset, const std::string& name);

/// Of all points; z is 0.
Box<3> bounds(const Outline& outline);

}  // namespace lamina
