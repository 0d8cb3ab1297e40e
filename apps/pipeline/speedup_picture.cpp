#include "apps/pipeline/speedup_picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "apps/pipeline/detail/canvas.h"

namespace lamina {
namespace {

constexpr int kWidth = 900, kHeight = 640;
constexpr double kLeft = 70.0, kRight = 210.0, kTop = 40.0, kBottom = 60.0;

/// Threads and speed-ups, both from 0 to `most`, on the page.
struct Axes {
  double most;
  [[nodiscard]] double x(double threads) const { return kLeft + threads / most * (kWidth - kLeft - kRight); }
  [[nodiscard]] double y(double value) const {
    return kHeight - kBottom - value / most * (kHeight - kTop - kBottom);
  }
};

void draw_axes(const Canvas& canvas, const Axes& a, int threads) {
  const int step = std::max(1, threads / 8);
  for (int i = 0; i <= threads; i += step) {
    canvas.set_color(kInkColor, i == 0 ? 1.0 : 0.15);
    cairo_set_line_width(canvas.context(), 1.0);
    canvas.line(a.x(i), a.y(0), a.x(i), a.y(a.most));
    canvas.line(a.x(0), a.y(i), a.x(a.most), a.y(i));
    canvas.set_color(kInkColor);
    canvas.text(a.x(i), a.y(0) + 22.0, 14.0, fmt::format("{}", i), 0.5);
    canvas.text(a.x(0) - 10.0, a.y(i) + 5.0, 14.0, fmt::format("{}", i), 1.0);
  }
  canvas.text(0.5 * (a.x(0) + a.x(a.most)), a.y(0) + 46.0, 15.0, "threads", 0.5);
  canvas.text(a.x(0) - 50.0, a.y(a.most) - 16.0, 15.0, "speed-up");
  const std::array<double, 2> dashes = {6.0, 5.0};
  cairo_set_dash(canvas.context(), dashes.data(), 2, 0.0);
  canvas.set_color(kInkColor, 0.6);
  canvas.line(a.x(0), a.y(0), a.x(a.most), a.y(a.most));
  cairo_set_dash(canvas.context(), nullptr, 0, 0.0);
}

}  // namespace

void draw_speedups(const std::filesystem::path& path, const std::vector<Speedup>& lines) {
  constexpr std::array<Rgb, 6> kColors = {{{0.10, 0.11, 0.14},
                                           {0.85, 0.05, 0.08},
                                           {0.08, 0.25, 0.80},
                                           {0.10, 0.55, 0.20},
                                           {0.80, 0.50, 0.05},
                                           {0.50, 0.15, 0.60}}};
  Canvas canvas(path, kWidth, kHeight);
  const int threads = lines.empty() ? 1 : static_cast<int>(lines.front().values.size());
  double most = threads;
  for (const Speedup& l : lines)
    for (const double v : l.values) most = std::max(most, v);
  const Axes axes{1.05 * most};
  draw_axes(canvas, axes, threads);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    canvas.set_color(kColors[i % kColors.size()]);
    cairo_set_line_width(canvas.context(), i == 0 ? 3.0 : 1.6);
    for (std::size_t k = 0; k < lines[i].values.size(); ++k) {
      const double x = axes.x(static_cast<double>(k + 1)), y = axes.y(lines[i].values[k]);
      if (k > 0) canvas.line(axes.x(static_cast<double>(k)), axes.y(lines[i].values[k - 1]), x, y);
      cairo_arc(canvas.context(), x, y, 4.0, 0.0, 6.2832);
      cairo_fill(canvas.context());
    }
    canvas.text(
        kWidth - kRight + 16.0, kTop + 24.0 * static_cast<double>(i + 1), 15.0,
        fmt::format("{} ({:.2f})", lines[i].name, lines[i].values.empty() ? 1.0 : lines[i].values.back()));
  }
  canvas.finish();
}

}  // namespace lamina
