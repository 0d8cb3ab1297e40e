#include "vdb/outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/file.h"
#include "core/words.h"
#include "vdb/detail/outline_parse.h"

namespace lamina {
namespace {

double signed_area(const std::vector<Vec2>& x) {
  double twice = 0.0;
  for (std::size_t i = 0, j = x.size() - 1; i < x.size(); j = i++) {
    const Vec2 a = x[j] - x[0], b = x[i] - x[0];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

/// Whether the polygon of a closed curve holds x.
bool holds(const std::vector<Vec2>& polygon, const Vec2& x) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vec2 &a = polygon[i], &b = polygon[j];
    if ((a[1] > x[1]) == (b[1] > x[1])) continue;
    if (x[0] < a[0] + (x[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])) inside = !inside;
  }
  return inside;
}

void drop_repeated(OutlineCurve& curve, double tolerance, OutlineReport& report) {
  std::vector<Vec2> kept;
  std::vector<double> curvature;
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const Vec2& x = curve.points[i];
    if (!kept.empty() && (x - kept.back()).norm() <= tolerance) continue;
    kept.push_back(x);
    if (!curve.curvature.empty()) curvature.push_back(curve.curvature[i]);
  }
  while (curve.closed && kept.size() > 1 && (kept.back() - kept.front()).norm() <= tolerance) kept.pop_back();
  report.duplicates += static_cast<std::int64_t>(curve.points.size() - kept.size());
  curve.points = std::move(kept);
  if (!curvature.empty()) curvature.resize(curve.points.size());
  curve.curvature = std::move(curvature);
}

void check_extent(const OutlineCurve& curve, std::size_t number, double extent, const std::string& name) {
  const std::size_t least = curve.closed ? 3 : 2;
  const auto reject = [&](const char* what) {
    throw Error(ErrorCode::kSurfaceInvalid, fmt::format("{}: curve {} (at ({:g}, {:g})) {}", name, number + 1,
                                                        curve.points[0][0], curve.points[0][1], what));
  };
  if (curve.points.size() < least)
    reject("has too few different points: remove it, or give two for a sheet and three around a body");
  constexpr double kFlat = 1e-12;
  if (curve.closed && std::abs(signed_area(curve.points)) <= kFlat * extent * extent)
    reject("is closed but encloses nothing: for a sheet do not repeat its first point");
}

}  // namespace

bool is_outline_file(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".dat" || extension == ".csv" || extension == ".txt";
}

Outline read_outline(const std::filesystem::path& path) {
  const MappedFile file(path);
  const std::string extension = lower_extension(path);
  if (extension == ".dat") return detail::parse_aerofoil(file.bytes(), path.string());
  if (is_outline_file(path)) return detail::parse_points(file.bytes(), path.string());
  throw Error(
      ErrorCode::kFileUnsupported,
      fmt::format("{}: profiles are read from .dat, .csv and .txt, not '{}'", path.string(), extension));
}

void write_outline(const std::filesystem::path& path, const Outline& outline, const std::string& title) {
  const bool aerofoil = lower_extension(path) == ".dat";
  if (!is_outline_file(path))
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: a profile is written as .dat, .csv or .txt", path.string()));
  std::string text = aerofoil ? title + "\n" : fmt::format("# {}\n", title);
  bool first = true;
  for (const OutlineCurve& curve : outline.curves) {
    if (!first) text += aerofoil ? "999.0 999.0\n" : "\n";
    first = false;
    std::vector<Vec2> points = curve.points;
    if (curve.closed) points.push_back(points.front());
    const std::string_view comma = aerofoil ? " " : ",";
    for (const Vec2& x : points) text += fmt::format("{}{}{}\n", x[0], comma, x[1]);
  }
  OutputFile file(path);
  file.write(text);
  file.commit();
}

OutlineReport clean(Outline& outline, const std::string& name) {
  constexpr double kSamePoint = 1e-12;  // of the extent
  OutlineReport report;
  const double extent = bounds(outline).size().maxCoeff();
  if (!(extent > 0.0))
    throw Error(ErrorCode::kSurfaceEmpty, fmt::format("{}: all points of the profile are one", name));
  for (std::size_t i = 0; i < outline.curves.size(); ++i) {
    OutlineCurve& curve = outline.curves[i];
    report.points_read += static_cast<std::int64_t>(curve.points.size());
    drop_repeated(curve, kSamePoint * extent, report);
    check_extent(curve, i, extent, name);
    ++(curve.closed ? report.closed_curves : report.open_curves);
    report.points += static_cast<std::int64_t>(curve.points.size());
  }
  for (OutlineCurve& curve : outline.curves) {
    if (!curve.closed) continue;
    bool solid = true;  // to its left
    for (const OutlineCurve& other : outline.curves)
      if (&other != &curve && other.closed && holds(other.points, curve.points[0])) solid = !solid;
    if ((signed_area(curve.points) > 0.0) == solid) continue;
    std::reverse(curve.points.begin(), curve.points.end());
    std::reverse(curve.curvature.begin(), curve.curvature.end());
    ++report.turned;
  }
  if (report.duplicates > 0)
    report.warnings.push_back(fmt::format("{}: {} dropped: they lie on the one before", name,
                                          counted(report.duplicates, "repeated point")));
  return report;
}

Box<3> bounds(const Outline& outline) {
  Box<3> box;
  for (const OutlineCurve& curve : outline.curves)
    for (const Vec2& x : curve.points) box.extend({x[0], x[1], 0.0});
  return box;
}

}  // namespace lamina
