#include "apps/pipeline/wall_picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "apps/pipeline/detail/canvas.h"
#include "apps/pipeline/picture.h"
#include "core/error.h"
#include "core/parallel.h"

namespace lamina {
namespace {

constexpr int kSamples = 2;                // rays per pixel, along each side
constexpr double kMargin = 1.04;           // of the body's outline
constexpr double kCoarse = 0.25;           // relative error of the distances that move the rays
constexpr double kHit = 0.25;              // pixels from the wall that count as on it
constexpr int kMostSteps = 1000;           // grazing rays of a rough wall
constexpr double kEdgeWidth = 0.75;        // pixels
constexpr double kMostCurvature = 1000.0;  // times extent; the scale ends there
constexpr Rgb kBackground = {1.0, 1.0, 1.0};

struct View {
  Vec3 right, up, towards;  // orthonormal; `towards` points to the eye
  Vec3 center;
  double pixel = 1.0;   // world units
  double radius = 1.0;  // of a sphere around the body
  double extent = 1.0;  // of the body
  int width = 0, height = 0;
};

Rgb mix(const Rgb& a, const Rgb& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

View make_view(const Box<3>& body, const WallPictureOptions& o) {
  const double az = o.azimuth * std::numbers::pi / 180.0, el = o.elevation * std::numbers::pi / 180.0;
  View v;
  const Vec3 a = Vec3::Unit((o.up + 1) % 3), b = Vec3::Unit((o.up + 2) % 3), up = Vec3::Unit(o.up);
  v.towards = std::cos(el) * (std::cos(az) * a + std::sin(az) * b) + std::sin(el) * up;
  v.right = std::cos(az) * b - std::sin(az) * a;
  v.up = v.towards.cross(v.right);
  v.center = o.look_at.allFinite() ? o.look_at : body.center();
  v.extent = body.size().maxCoeff();
  v.radius = 0.51 * body.diagonal() + (v.center - body.center()).norm();
  const Vec3 half = 0.5 * kMargin * body.size();
  const double across = half.dot(v.right.cwiseAbs()), high = half.dot(v.up.cwiseAbs());
  v.width = o.width_px;
  v.pixel = 2.0 * across / o.zoom / o.width_px;
  v.height =
      std::clamp(static_cast<int>(std::ceil(2.0 * high / o.zoom / v.pixel)), o.width_px / 8, 2 * o.width_px);
  return v;
}

// Where the ray from the eye through (x, y), in pixels from the middle, first meets the wall.
bool trace(const WallField& wall, const View& v, double x, double y, Vec3& hit) {
  const Vec3 start = v.center + v.pixel * (x * v.right + y * v.up) + v.radius * v.towards;
  double t = 0.0;
  for (int step = 0; step < kMostSteps && t < 2.0 * v.radius; ++step) {
    hit = start - t * v.towards;
    const double d = wall.distance(hit, kCoarse) / (1.0 + kCoarse);
    if (d < kHit * v.pixel) return true;
    t += d;
  }
  return false;
}

// 0.5 where flat; by the logarithm of the magnitude, so that a fillet and a roof both show.
double curvature_level(double k, double extent) {
  const double scaled = std::asinh(k * extent) / std::asinh(kMostCurvature);
  return 0.5 + 0.5 * std::clamp(scaled, -1.0, 1.0);
}

Rgb color_of(const WallPoint& w, const View& v, WallColor color) {
  if (w.edge_distance < kEdgeWidth * v.pixel || w.corner_distance < kEdgeWidth * v.pixel) return kInkColor;
  Rgb base = kPlainColor;
  if (color == WallColor::kCurvature) base = curvature_color(curvature_level(0.5 * (w.k1 + w.k2), v.extent));
  if (color == WallColor::kReliability) base = quality_color(w.reliability);
  const Vec3 light = (v.towards + 0.4 * v.up - 0.3 * v.right).normalized();
  const double facing = w.N.dot(v.towards) < 0.0 ? -1.0 : 1.0;  // a sheet has two sides
  return mix({0.0, 0.0, 0.0}, base, 0.45 + 0.55 * std::max(0.0, facing * w.N.dot(light)));
}

Rgb pixel_color(const WallField& wall, const View& v, int column, int row, WallColor color) {
  Rgb sum{};
  for (int s = 0; s < kSamples * kSamples; ++s) {
    const double x = column + (s % kSamples + 0.5) / kSamples - 0.5 * v.width;
    const double y = 0.5 * v.height - row - (static_cast<double>(s / kSamples) + 0.5) / kSamples;
    Vec3 hit;
    const Rgb c = trace(wall, v, x, y, hit) ? color_of(wall.at(hit), v, color) : kBackground;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += c[k] / (kSamples * kSamples);
  }
  return sum;
}

std::vector<std::uint32_t> render(const WallField& wall, const View& v, WallColor color) {
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(v.width) * static_cast<std::size_t>(v.height));
  for_each_index(
      pixels.size(),
      [&](std::size_t i) {
        const int column = static_cast<int>(i % static_cast<std::size_t>(v.width)),
                  row = static_cast<int>(i / static_cast<std::size_t>(v.width));
        pixels[i] = pixel_of(pixel_color(wall, v, column, row, color));
      },
      512);
  return pixels;
}

void paint_scale(const Canvas& canvas, const View& v, WallColor color, double y, double u) {
  const double width = 260.0 * u, height = 12.0 * u, x = v.width - width - 12.0 * u;
  canvas.color_bar(x, y, width, height, [&](double t) {
    return color == WallColor::kCurvature ? curvature_color(t) : quality_color(t);
  });
  if (color == WallColor::kReliability) {
    canvas.text(x - 12.0 * u, y + height, 14.0 * u, "reliability of the curvature", 1.0);
    for (const double t : {0.0, 0.5, 1.0})
      canvas.text(x + width * t, y + 2.4 * height, 13.0 * u, fmt::format("{:g}", t), t);
    return;
  }
  canvas.text(x - 12.0 * u, y + height, 14.0 * u, "mean curvature x extent", 1.0);
  for (const double k : {-1000.0, -30.0, 0.0, 30.0, 1000.0}) {
    const double t = curvature_level(k, 1.0);
    canvas.text(x + width * t, y + 2.4 * height, 13.0 * u, fmt::format("{:g}", k), t);
  }
}

void check_options(const std::filesystem::path& path, const WallPictureOptions& o) {
  check_picture_extension(path);
  const auto require = [](bool good, const char* name, double value, const char* range) {
    if (!good)
      throw Error(ErrorCode::kParameter,
                  fmt::format("picture of a wall: {} = {:g} must lie in {}", name, value, range));
  };
  require(o.up >= 0 && o.up <= 2, "up", o.up, "0, 1, 2");
  require(std::isfinite(o.azimuth), "azimuth", o.azimuth, "(-inf, inf) degrees");
  require(o.elevation >= -90.0 && o.elevation <= 90.0, "elevation", o.elevation, "[-90, 90] degrees");
  require(o.zoom >= 0.1 && o.zoom <= 1000.0, "zoom", o.zoom, "[0.1, 1000]");
  require(o.width_px >= 200 && o.width_px <= 8000, "width", o.width_px, "[200, 8000] pixels");
}

}  // namespace

void draw_wall(const std::filesystem::path& path, const WallField& wall, const WallPictureOptions& options) {
  check_options(path, options);
  const View v = make_view(wall.bounds(), options);
  const double u = v.width / 1000.0;
  const int top = options.title.empty() ? 0 : static_cast<int>(40.0 * u);
  const int bottom = static_cast<int>(48.0 * u);
  std::vector<std::uint32_t> pixels = render(wall, v, options.color);
  Canvas canvas(path, v.width, top + v.height + bottom);
  canvas.image(0.0, top, v.width, v.height, pixels);
  canvas.set_color(kInkColor);
  if (!options.title.empty()) canvas.text(12.0 * u, 26.0 * u, 20.0 * u, options.title);
  if (options.color != WallColor::kPlain) paint_scale(canvas, v, options.color, top + v.height + 8.0 * u, u);
  canvas.finish();
}

}  // namespace lamina
