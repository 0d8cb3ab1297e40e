#include "apps/pipeline/metric_picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/pipeline/detail/canvas.h"
#include "apps/pipeline/picture.h"
#include "core/error.h"
#include "core/parallel.h"

namespace lamina {
namespace {

constexpr int kEllipsesAcross = 36;
constexpr double kEllipseLength = 0.42;  // half of the long axis, of the distance between ellipses

struct Field {
  int width = 0, height = 0;
  std::vector<double> phi, value;  // per pixel; value as logarithm
};

struct View {
  MetricPictureOptions options;
  int u = 0, v = 1, width = 0, height = 0;
  double pixel = 1.0;  // world units

  [[nodiscard]] Vec3 at(double column, double row) const {
    Vec3 x;
    x[options.plane.axis] = options.plane.offset;
    x[u] = options.window[0] + column * pixel;
    x[v] = options.window[3] - row * pixel;
    return x;
  }
};

View make_view(const MetricPictureOptions& o) {
  View view;
  view.options = o;
  view.u = o.plane.axis == 0 ? 1 : 0;
  view.v = o.plane.axis == 2 ? 1 : 2;
  view.width = o.width_px;
  view.pixel = (o.window[2] - o.window[0]) / o.width_px;
  view.height = std::clamp(static_cast<int>(std::ceil((o.window[3] - o.window[1]) / view.pixel)),
                           o.width_px / 20, 2 * o.width_px);
  return view;
}

double value_of(const Metric<3>& m, MetricColor color) {
  const Vec3 sizes = m.principal().sizes;
  return std::log(color == MetricColor::kSize ? sizes[0] : sizes[2] / sizes[0]);
}

Field evaluate(const View& view, const WallMetric& metric) {
  Field f{view.width, view.height, {}, {}};
  const std::size_t n = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  f.phi.resize(n);
  f.value.resize(n);
  for_each_index(
      n,
      [&](std::size_t i) {
        const std::size_t w = static_cast<std::size_t>(view.width);
        const WallSample s =
            metric.sample(view.at(static_cast<double>(i % w) + 0.5, static_cast<double>(i / w) + 0.5));
        f.phi[i] = s.wall.phi;
        f.value[i] = value_of(s.metric, view.options.color);
      },
      512);
  return f;
}

Rgb color_of(MetricColor color, double t) {
  return color == MetricColor::kSize ? size_color(t) : quality_color(1.0 - t);
}

// Does the level cross between this pixel and the one to its right or below it?
bool on_level(const Field& f, int column, int row, double level) {
  const auto below = [&](int c, int r) {
    return f.phi[static_cast<std::size_t>(r) * static_cast<std::size_t>(f.width) +
                 static_cast<std::size_t>(c)] < level;
  };
  const bool here = below(column, row);
  return (column + 1 < f.width && below(column + 1, row) != here) ||
         (row + 1 < f.height && below(column, row + 1) != here);
}

std::vector<std::uint32_t> paint(const Field& f, MetricColor color, double low, double high, double top) {
  std::vector<std::uint32_t> pixels(f.value.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const int column = static_cast<int>(i) % f.width, row = static_cast<int>(i) / f.width;
    Rgb c = color_of(color, high > low ? (f.value[i] - low) / (high - low) : 0.5);
    if (on_level(f, column, row, top)) c = kTopColor;
    if (on_level(f, column, row, 0.0)) c = kWallColor;
    pixels[i] = pixel_of(c);
  }
  return pixels;
}

// The section of the metric's unit ball with the plane: half axes as columns, the long one first.
Mat<2> section(const Metric<3>& m, int u, int v) {
  const Mat3 U = m.factor();
  Eigen::Matrix<double, 3, 2> B;
  B << U.col(u), U.col(v);
  const auto principal = Metric<2>::from_tensor(to_sym<2>(B.transpose() * B));
  Mat<2> axes = Mat<2>::Identity();
  if (!principal) return axes;
  const auto p = principal->principal();
  axes.col(0) = p.sizes[1] * p.axes.row(1).transpose();
  axes.col(1) = p.sizes[0] * p.axes.row(0).transpose();
  return axes;
}

void draw_ellipses(const Canvas& canvas, const View& view, const WallMetric& metric, double unit) {
  const double step = static_cast<double>(view.width) / kEllipsesAcross;
  canvas.set_color(kInkColor, 0.8);
  cairo_set_line_width(canvas.context(), 0.8 * unit);
  for (double y = 0.5 * step; y < view.height; y += step) {
    for (double x = 0.5 * step; x < view.width; x += step) {
      const Mat<2> axes = section(metric.at(view.at(x, y)), view.u, view.v);
      const Mat<2> drawn = kEllipseLength * step / axes.col(0).norm() * axes;
      constexpr int kCorners = 32;
      for (int i = 0; i < kCorners; ++i) {
        const double a = 2.0 * std::numbers::pi * i / kCorners;
        const Vec2 p = drawn * Vec2(std::cos(a), std::sin(a));
        cairo_line_to(canvas.context(), x + p[0], y - p[1]);
      }
      cairo_close_path(canvas.context());
      cairo_stroke(canvas.context());
    }
  }
}

void check_options(const std::filesystem::path& path, const MetricPictureOptions& o) {
  check_picture_extension(path);
  const auto& [u0, v0, u1, v1] = o.window;
  if (!(u0 < u1 && v0 < v1) || !std::isfinite(u1 - u0) || !std::isfinite(v1 - v0))
    throw Error(
        ErrorCode::kParameter,
        fmt::format("the picture window {} {} {} {} is empty; give u0 v0 u1 v1 with u0 < u1 and v0 < v1", u0,
                    v0, u1, v1));
  if (o.width_px < 200 || o.width_px > 8000)
    throw Error(ErrorCode::kParameter,
                fmt::format("a picture width of {} pixels; it must lie in 200..8000", o.width_px));
}

}  // namespace

void draw_metric(const std::filesystem::path& path, const WallMetric& metric,
                 const MetricPictureOptions& options) {
  check_options(path, options);
  const View view = make_view(options);
  const Field field = evaluate(view, metric);
  const auto [low, high] = std::minmax_element(field.value.begin(), field.value.end());
  const double u = std::max(0.5, view.width / 1000.0), bar = 260.0 * u;
  Canvas canvas(path, view.width, view.height + static_cast<int>(48.0 * u));
  std::vector<std::uint32_t> pixels = paint(field, options.color, *low, *high, metric.layer().top());
  canvas.image(0.0, 0.0, view.width, view.height, pixels);
  if (options.ellipses) draw_ellipses(canvas, view, metric, u);
  const double x = view.width - bar - 12.0 * u, y = view.height + 8.0 * u;
  canvas.color_bar(x, y, bar, 12.0 * u, [&](double t) { return color_of(options.color, t); });
  canvas.text(x - 12.0 * u, y + 12.0 * u, 14.0 * u,
              options.color == MetricColor::kSize ? "smallest size, log scale"
                                                  : "largest over smallest size, log scale",
              1.0);
  canvas.text(x, y + 29.0 * u, 13.0 * u, fmt::format("{:.3g}", std::exp(*low)));
  canvas.text(x + bar, y + 29.0 * u, 13.0 * u, fmt::format("{:.3g}", std::exp(*high)), 1.0);
  canvas.text(12.0 * u, y + 12.0 * u, 14.0 * u,
              fmt::format("{} = {:g}, {:.3g} wide", "xyz"[options.plane.axis], options.plane.offset,
                          options.window[2] - options.window[0]));
  canvas.finish();
}

}  // namespace lamina
