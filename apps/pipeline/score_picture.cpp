#include "apps/pipeline/score_picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/pipeline/detail/canvas.h"
#include "core/metric.h"

namespace lamina {
namespace {

constexpr int kWidth = 1100, kHeight = 480;
constexpr double kTop = 70.0, kBottom = 60.0, kPanel = 460.0;
constexpr double kShortest = 0.15, kLongest = 6.0;  // of the axis; bins beyond are cut there
constexpr std::array<Rgb, 2> kColors = {{{0.25, 0.45, 0.80}, {0.85, 0.35, 0.05}}};

/// A share of edges or cells between two places of the axis.
struct Bar {
  double from, to, share;
};

/// One diagram: places 0 to 1 of its axis, and densities up to `most`.
struct Panel {
  double left;
  double most = 0.0;
  [[nodiscard]] double x(double place) const { return left + place * kPanel; }
  [[nodiscard]] double y(double density) const {
    return kHeight - kBottom - density / most * (kHeight - kTop - kBottom);
  }
};

double place_of_length(double length) {
  const double clipped = std::clamp(length, kShortest, kLongest);
  return std::log(clipped / kShortest) / std::log(kLongest / kShortest);
}

template <std::size_t N>
double share(const std::array<std::int64_t, N>& counts, std::size_t i) {
  std::int64_t all = 0;
  for (const std::int64_t n : counts) all += n;
  return all == 0 ? 0.0 : static_cast<double>(counts[i]) / static_cast<double>(all);
}

std::vector<Bar> length_bars(const Score& s) {
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < Score::kLengthBins.size(); ++i) {
    const double to = i + 1 < Score::kLengthBins.size() ? Score::kLengthBins[i + 1] : kLongest;
    bars.push_back(
        {place_of_length(Score::kLengthBins[i]), place_of_length(to), share(s.length_histogram, i)});
  }
  return bars;
}

std::vector<Bar> quality_bars(const Score& s) {
  std::vector<Bar> bars;
  const double width = 1.0 / static_cast<double>(s.quality_histogram.size());
  for (std::size_t i = 0; i < s.quality_histogram.size(); ++i)
    bars.push_back(
        {width * static_cast<double>(i), width * static_cast<double>(i + 1), share(s.quality_histogram, i)});
  return bars;
}

/// The first mesh filled, the second as a line over it.
void draw_bars(const Canvas& canvas, const Panel& panel, const std::vector<Bar>& bars, std::size_t mesh) {
  cairo_t* c = canvas.context();
  cairo_move_to(c, panel.x(0.0), panel.y(0.0));
  for (const Bar& b : bars) {
    const double y = panel.y(b.share / (b.to - b.from));
    cairo_line_to(c, panel.x(b.from), y);
    cairo_line_to(c, panel.x(b.to), y);
  }
  cairo_line_to(c, panel.x(1.0), panel.y(0.0));
  canvas.set_color(kColors[mesh], mesh == 0 ? 0.55 : 1.0);
  cairo_set_line_width(c, 2.2);
  if (mesh == 0)
    cairo_fill(c);
  else
    cairo_stroke(c);
}

void draw_axis(const Canvas& canvas, const Panel& panel, const std::string& title) {
  canvas.set_color(kInkColor);
  cairo_set_line_width(canvas.context(), 1.0);
  canvas.line(panel.x(0.0), panel.y(0.0), panel.x(1.0), panel.y(0.0));
  canvas.text(panel.x(0.5), kHeight - 14.0, 15.0, title, 0.5);
}

void draw_tick(const Canvas& canvas, const Panel& panel, double place, const std::string& label) {
  canvas.set_color(kInkColor);
  canvas.line(panel.x(place), panel.y(0.0), panel.x(place), panel.y(0.0) + 5.0);
  canvas.text(panel.x(place), panel.y(0.0) + 21.0, 13.0, label, 0.5);
}

void draw_panel(const Canvas& canvas, Panel panel, const std::vector<std::vector<Bar>>& sets) {
  for (std::size_t mesh = 0; mesh < sets.size(); ++mesh)
    if (!sets[mesh].empty()) draw_bars(canvas, panel, sets[mesh], mesh);
}

double highest(const std::vector<std::vector<Bar>>& sets) {
  double most = 1e-300;
  for (const auto& bars : sets)
    for (const Bar& b : bars) most = std::max(most, b.share / (b.to - b.from));
  return 1.05 * most;
}

void draw_lengths(const Canvas& canvas, const std::vector<ScoredMesh>& meshes) {
  std::vector<std::vector<Bar>> sets;
  for (const ScoredMesh& m : meshes) sets.push_back(m.has_metric ? length_bars(m.score) : std::vector<Bar>{});
  const Panel panel{60.0, highest(sets)};
  canvas.set_color(kInkColor, 0.07);
  const double from = panel.x(place_of_length(kUnitMin)), to = panel.x(place_of_length(kUnitMax));
  cairo_rectangle(canvas.context(), from, kTop, to - from, kHeight - kTop - kBottom);
  cairo_fill(canvas.context());
  draw_panel(canvas, panel, sets);
  const std::array<std::pair<double, const char*>, 7> ticks = {{{0.25, "1/4"},
                                                                {0.5, "1/2"},
                                                                {kUnitMin, "1/√2"},
                                                                {1.0, "1"},
                                                                {kUnitMax, "√2"},
                                                                {2.0, "2"},
                                                                {4.0, "4"}}};
  for (const auto& [length, label] : ticks) draw_tick(canvas, panel, place_of_length(length), label);
  draw_axis(canvas, panel, "length of edges in the metric");
}

void draw_qualities(const Canvas& canvas, const std::vector<ScoredMesh>& meshes) {
  std::vector<std::vector<Bar>> sets;
  for (const ScoredMesh& m : meshes) sets.push_back(quality_bars(m.score));
  const Panel panel{kWidth - 40.0 - kPanel, highest(sets)};
  draw_panel(canvas, panel, sets);
  for (int i = 0; i <= 5; ++i) draw_tick(canvas, panel, 0.2 * i, fmt::format("{:g}", 0.2 * i));
  draw_axis(canvas, panel, "quality of cells, mean ratio");
}

std::string legend(const ScoredMesh& m) {
  std::string text = fmt::format("{}: {} cells, quality from {:.3g}, mean {:.3f}", m.name, m.score.cells,
                                 m.score.quality_min, m.score.quality_mean);
  if (m.has_metric) text += fmt::format(", {:.2f} % unit edges", 100.0 * m.score.unit_share);
  return text;
}

}  // namespace

void draw_scores(const std::filesystem::path& path, const std::vector<ScoredMesh>& meshes) {
  Canvas canvas(path, kWidth, kHeight);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const double y = 24.0 + 22.0 * static_cast<double>(i);
    canvas.set_color(kColors[i], i == 0 ? 0.55 : 1.0);
    cairo_rectangle(canvas.context(), 60.0, y - 11.0, 18.0, 12.0);
    cairo_fill(canvas.context());
    canvas.set_color(kInkColor);
    canvas.text(86.0, y, 14.0, legend(meshes[i]));
  }
  draw_lengths(canvas, meshes);
  draw_qualities(canvas, meshes);
  canvas.finish();
}

}  // namespace lamina
