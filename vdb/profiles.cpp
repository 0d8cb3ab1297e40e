#include "vdb/profiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace lamina {
namespace {

/// Number of steps of at most `spacing` along `length`.
int steps(double length, double spacing, int standard) {
  constexpr double kMost = 1e6;
  if (spacing == 0.0) return standard;
  return static_cast<int>(std::clamp(std::ceil(length / spacing), 8.0, kMost));
}

/// The paper's plate, from x = 0.5 to 4.5 in the middle of its channel [Billon2016, section 5.1.1].
Outline plate() { return {{{.points = {{0.5, 1.375}, {4.5, 1.375}}, .closed = false, .smooth = false}}}; }

/// The paper's circle of radius 0.3, here around (2, 1.375).
Outline circle(double spacing) {
  constexpr double kRadius = 0.3;
  const int n = steps(2.0 * std::numbers::pi * kRadius, spacing, 96);
  OutlineCurve curve{.points = {}, .closed = true, .smooth = true};
  for (int i = 0; i < n; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / n;
    curve.points.emplace_back(2.0 + kRadius * std::cos(angle), 1.375 + kRadius * std::sin(angle));
  }
  return {{curve}};
}

/// The paper's square of side 0.6, here around (2, 1.375).
Outline square() {
  return {{{.points = {{1.7, 1.075}, {2.3, 1.075}, {2.3, 1.675}, {1.7, 1.675}}, .closed = true}}};
}

/// An aerofoil of NACA's four digits: camber, its place and the thickness, all of the chord.
struct FourDigits {
  double camber, place, thickness;
};

/// From the trailing edge over the upper side and back along the lower one, on a chord from (0, 0) to (1, 0),
/// with the coefficient -0.1036 that closes the trailing edge; points by the cosine of equal angles.
std::vector<Vec2> four_digits(const FourDigits& f, int n) {
  const auto side = [&](double x, double sign) -> Vec2 {
    const double t =
        5.0 * f.thickness * (0.2969 * std::sqrt(x) - x * (0.126 + x * (0.3516 - x * (0.2843 - 0.1036 * x))));
    if (f.camber == 0.0) return {x, sign * t};
    const double p = f.place, front = x < p ? p : 1.0 - p;
    const double scale = f.camber / (front * front);
    const double y = scale * (x < p ? 2.0 * p * x - x * x : 1.0 - 2.0 * p + 2.0 * p * x - x * x);
    const double angle = std::atan(2.0 * scale * (p - x));
    return {x - sign * t * std::sin(angle), y + sign * t * std::cos(angle)};
  };
  const auto at = [n](int i) { return i == n ? 1.0 : 0.5 * (1.0 - std::cos(std::numbers::pi * i / n)); };
  std::vector<Vec2> points{{1.0, 0.0}};
  for (int i = n - 1; i > 0; --i) points.push_back(side(at(i), 1.0));
  for (int i = 0; i < n; ++i) points.push_back(side(at(i), -1.0));
  return points;
}

/// Turned by `degrees` around its leading edge, stretched to `chord`, and moved.
OutlineCurve element(const FourDigits& f, int n, double chord, double degrees, const Vec2& leading_edge) {
  const Eigen::Rotation2Dd turn(degrees * std::numbers::pi / 180.0);
  OutlineCurve curve{.points = four_digits(f, n), .closed = true, .smooth = true};
  for (Vec2& x : curve.points) x = leading_edge + chord * (turn * x);
  return curve;
}

/// The symmetric aerofoil of the paper [Billon2016, section 5.2], chord 1.
Outline naca0012(double spacing) {
  return {{element({0.0, 0.5, 0.12}, steps(0.5 * std::numbers::pi, spacing, 100), 1.0, 0.0, {0.0, 0.0})}};
}

/// A wing with slat and flap out, three aerofoils with gaps of about two per cent of the chord. Ours: no
/// published geometry.
Outline highlift(double spacing) {
  const int n = steps(0.5 * std::numbers::pi, spacing, 80);
  return {{element({0.04, 0.4, 0.12}, n, 0.18, 25.0, {-0.158, -0.018}),
           element({0.02, 0.4, 0.14}, n, 1.0, 0.0, {0.0, 0.0}),
           element({0.02, 0.4, 0.12}, n, 0.32, -30.0, {0.985, -0.04})}};
}

}  // namespace

std::vector<std::pair<std::string, std::string>> profile_list() {
  return {{"plate", "sheet of length 4 m, from (0.5, 1.375)"},
          {"circle", "radius 0.3 m around (2, 1.375)"},
          {"square", "0.6 x 0.6 m around (2, 1.375)"},
          {"naca0012", "aerofoil of chord 1 m with a sharp trailing edge"},
          {"highlift", "wing of chord 1 m with slat and flap, three aerofoils"}};
}

Outline make_profile(const std::string& name, double spacing) {
  if (!(spacing >= 0.0) || !std::isfinite(spacing))
    throw Error(ErrorCode::kParameter, fmt::format("spacing of a profile = {:g} must be > 0", spacing));
  if (name == "plate") return plate();
  if (name == "circle") return circle(spacing);
  if (name == "square") return square();
  if (name == "naca0012") return naca0012(spacing);
  if (name == "highlift") return highlift(spacing);
  std::string names;
  for (const auto& [known, help] : profile_list()) names += (names.empty() ? "" : ", ") + known;
  throw Error(ErrorCode::kParameter, fmt::format("unknown profile {}; known are {}", name, names));
}

}  // namespace lamina
