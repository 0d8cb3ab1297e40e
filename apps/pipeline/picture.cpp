// Polygons are clipped to the window in double precision first (cairo's coordinates are 24.8 fixed point, so
// a zoom far into a coarse mesh would overflow), then painted in four layers: fills, outlines, contours,
// legend.
//
// Fills are sampled without antialiasing on an image of twice the size: with antialiasing, thousands of cells
// thinner than a pixel would each let some background through and whiten dense layers. Vector files get that
// image when there are many cells, else polygons. Outlines get thinner and fainter as the cell gets thinner,
// and are left out below a fifth of a pixel.
#include "apps/pipeline/picture.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "apps/pipeline/detail/canvas.h"
#include "apps/pipeline/detail/color_map.h"
#include "core/error.h"
#include "mesh/slice.h"

namespace lamina {
namespace {

constexpr int kShades = 64;          // shades of a colour scale
constexpr int kRegionCount = 4;      // colours of regions
constexpr int kInk = 12;             // shades of outlines
constexpr double kClipMargin = 8.0;  // pixels around the window that are drawn and cut off
constexpr double kThinnest = 0.2;    // pixels; thinner cells have no outline
constexpr double kFullInk = 6.0;     // pixels; thicker cells have a full one
constexpr std::size_t kVectorFills = 20000;

/// A value for each cell and how it becomes a colour.
struct Coloring {
  PictureColor mode = PictureColor::kPlain;
  std::vector<double> values;  ///< per cell; sizes as logarithms
  double low = 0.0, high = 1.0;
  std::vector<std::string> regions;  ///< what the values 0, 1, ... of kRegion stand for

  [[nodiscard]] int level(Index cell) const {
    if (mode == PictureColor::kPlain) return 0;
    const double v = values[static_cast<std::size_t>(cell)];
    if (mode == PictureColor::kRegion) return static_cast<int>(std::clamp(v, 0.0, kShades - 1.0));
    const double t = high > low ? (v - low) / (high - low) : 0.5;
    if (mode == PictureColor::kLevels)  // 0 is that of cells without a level
      return v < 0.0 ? 0 : 1 + static_cast<int>(std::clamp(t, 0.0, 1.0) * (kShades - 2) + 0.5);
    return static_cast<int>(std::clamp(t, 0.0, 1.0) * (kShades - 1) + 0.5);
  }
  [[nodiscard]] Rgb color(int level) const {
    const double t = static_cast<double>(level) / (kShades - 1);
    switch (mode) {
      case PictureColor::kQuality:
        return quality_color(t);
      case PictureColor::kRegion:
        return region_color(level % kRegionCount);
      case PictureColor::kLevels:
        return level == 0 ? kPlainColor : quality_color(1.0 - t);
      case PictureColor::kSize:
        return size_color(t);
      default:
        return kPlainColor;
    }
  }
};

/// Meshes with the fields of `lamina mesh` have its regions, all others tags with or without a name.
template <int D>
void color_regions(const Mesh<D>& mesh, Coloring& c) {
  if (mesh.point_field("hn") != nullptr) {
    c.regions = {"inside", "layer", "Box2", "Box1"};
    c.values.assign(mesh.cell_tags.begin(), mesh.cell_tags.end());
    return;
  }
  std::vector<Index> tags = mesh.cell_tags;
  std::sort(tags.begin(), tags.end());
  tags.erase(std::unique(tags.begin(), tags.end()), tags.end());
  for (const Index tag : mesh.cell_tags)
    c.values.push_back(static_cast<double>(std::lower_bound(tags.begin(), tags.end(), tag) - tags.begin()));
  for (const Index tag : tags) {
    const auto name = mesh.cell_names.find(tag);
    c.regions.push_back(name == mesh.cell_names.end() ? fmt::format("tag {}", tag) : name->second);
  }
}

template <int D>
Coloring make_coloring(const Mesh<D>& mesh, PictureColor mode) {
  Coloring c;
  const std::size_t n = mesh.cells.size();
  if (mode == PictureColor::kRegion && mesh.cell_tags.size() == n) {
    color_regions(mesh, c);
  } else if (mode == PictureColor::kQuality) {
    for (const MeshField& f : mesh.cell_fields)
      if (f.name == "quality" && f.components == 1 && f.values.size() == n) c.values = f.values;
  } else if (mode == PictureColor::kLevels) {
    const MeshField* offset = mesh.point_field("level_offset");
    if (offset == nullptr || offset->components != 1 || offset->values.size() != mesh.points.size()) return c;
    c.high = 0.5;
    c.values.assign(n, -1.0);
    for (std::size_t i = 0; i < n; ++i)
      for (const Index v : mesh.cells[i])
        c.values[i] = std::max(c.values[i], offset->values[static_cast<std::size_t>(v)]);
  } else if (mode == PictureColor::kSize) {
    const MeshField* hn = mesh.point_field("hn");
    if (hn == nullptr || hn->components != 1 || hn->values.size() != mesh.points.size()) return c;
    c.values.assign(n, 0.0);
    for (std::size_t i = 0; i < n; ++i)
      for (const Index v : mesh.cells[i])
        c.values[i] += std::log(std::max(hn->values[static_cast<std::size_t>(v)], 1e-300)) / (D + 1);
  }
  if (c.values.size() == n && n > 0) c.mode = mode;
  return c;
}

struct Window {
  Vec2 lo, hi;
  [[nodiscard]] Vec2 size() const { return hi - lo; }
};

/// Where the window lies on the page. y grows downward.
struct Layout {
  Window window;
  double unit = 1.0;   ///< size of letters and lines: 1 at a width of 1400
  double scale = 1.0;  ///< pixels per world unit
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;  ///< of the drawing
  int page_width = 0, page_height = 0;

  [[nodiscard]] Vec2 to_page(const Vec2& p) const {
    return {left + (p[0] - window.lo[0]) * scale, top + (window.hi[1] - p[1]) * scale};
  }
};

Layout make_layout(const Window& window, const PictureOptions& o) {
  constexpr double kTallest = 1.6, kFlattest = 0.05;
  Layout l;
  l.window = window;
  l.unit = std::max(0.5, o.width_px / 1400.0);
  const double margin = 12.0 * l.unit;
  const double room = o.width_px - 2.0 * margin;
  l.width = room;
  l.scale = room / window.size()[0];
  l.height = l.scale * window.size()[1];
  if (l.height > kTallest * room) {
    l.height = kTallest * room;
    l.scale = l.height / window.size()[1];
    l.width = l.scale * window.size()[0];
  }
  l.left = margin + 0.5 * (room - l.width);
  l.top = margin + (o.title.empty() ? 0.0 : 34.0 * l.unit);
  l.page_width = o.width_px;
  l.page_height = static_cast<int>(std::ceil(l.top + std::max(l.height, kFlattest * room) + 62.0 * l.unit));
  return l;
}

/// A polygon in page coordinates with phi at its corners.
struct Piece {
  std::vector<Vec2> corners;
  std::vector<double> phi;
  int level = 0;
  double thickness = 0.0;  ///< pixels: twice the area over the longest edge
};

/// Cuts away what lies beyond `limit` along an axis; side +1 keeps smaller coordinates, -1 larger ones.
void clip(Piece& piece, int axis, double limit, double side) {
  Piece kept;
  const std::size_t n = piece.corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = (i + 1) % n;
    const Vec2 &p = piece.corners[i], &q = piece.corners[j];
    const double a = side * (limit - p[axis]), b = side * (limit - q[axis]);
    if (a >= 0.0) {
      kept.corners.push_back(p);
      if (!piece.phi.empty()) kept.phi.push_back(piece.phi[i]);
    }
    if ((a >= 0.0) == (b >= 0.0)) continue;
    const double t = a / (a - b);
    kept.corners.push_back(p + t * (q - p));
    if (!piece.phi.empty()) kept.phi.push_back(piece.phi[i] + t * (piece.phi[j] - piece.phi[i]));
  }
  piece.corners.swap(kept.corners);
  piece.phi.swap(kept.phi);
}

double thickness_of(const std::vector<Vec2>& x) {
  double area2 = 0.0, longest = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec2 &p = x[i], &q = x[(i + 1) % x.size()];
    area2 += (p[0] - x[0][0]) * (q[1] - x[0][1]) - (q[0] - x[0][0]) * (p[1] - x[0][1]);
    longest = std::max(longest, (q - p).norm());
  }
  return longest > 0.0 ? std::abs(area2) / longest : 0.0;
}

/// Polygons that reach into the window.
std::vector<const SlicePolygon*> visible(const std::vector<SlicePolygon>& polygons, const Window& w) {
  std::vector<const SlicePolygon*> seen;
  for (const SlicePolygon& p : polygons) {
    Vec2 lo = p.corners[0], hi = p.corners[0];
    for (const Vec2& c : p.corners) {
      lo = lo.cwiseMin(c);
      hi = hi.cwiseMax(c);
    }
    if ((lo.array() <= w.hi.array()).all() && (hi.array() >= w.lo.array()).all()) seen.push_back(&p);
  }
  return seen;
}

std::vector<Piece> make_pieces(const std::vector<const SlicePolygon*>& polygons, const Layout& l,
                               const Coloring& coloring) {
  std::vector<Piece> pieces;
  pieces.reserve(polygons.size());
  for (const SlicePolygon* p : polygons) {
    Piece piece;
    for (const Vec2& c : p->corners) piece.corners.push_back(l.to_page(c));
    piece.phi = p->phi;
    piece.level = coloring.level(p->cell);
    piece.thickness = thickness_of(piece.corners);
    clip(piece, 0, l.left - kClipMargin, -1.0);
    clip(piece, 0, l.left + l.width + kClipMargin, 1.0);
    clip(piece, 1, l.top - kClipMargin, -1.0);
    clip(piece, 1, l.top + l.height + kClipMargin, 1.0);
    if (piece.corners.size() > 2) pieces.push_back(std::move(piece));
  }
  return pieces;
}

void add_path(cairo_t* to, const Piece& piece) {
  cairo_move_to(to, piece.corners[0][0], piece.corners[0][1]);
  for (std::size_t i = 1; i < piece.corners.size(); ++i)
    cairo_line_to(to, piece.corners[i][0], piece.corners[i][1]);
  cairo_close_path(to);
}

/// Fills all pieces level by level; `hairline` > 0 also strokes them, which closes the seams between them.
void fill_pieces(cairo_t* to, const std::vector<Piece>& pieces, const Coloring& coloring, double hairline) {
  std::array<std::vector<const Piece*>, kShades> by_level;
  for (const Piece& p : pieces) by_level[static_cast<std::size_t>(p.level)].push_back(&p);
  for (int level = 0; level < kShades; ++level) {
    const auto& group = by_level[static_cast<std::size_t>(level)];
    if (group.empty()) continue;
    const Rgb c = coloring.color(level);
    cairo_set_source_rgb(to, c[0], c[1], c[2]);
    for (const Piece* p : group) add_path(to, *p);
    if (hairline > 0.0) {
      cairo_set_line_width(to, hairline);
      cairo_stroke_preserve(to);
    }
    cairo_fill(to);
  }
}

void paint_fills(const Canvas& canvas, const Layout& l, const std::vector<Piece>& pieces,
                 const Coloring& coloring) {
  constexpr double kSamples = 2.0;
  if (canvas.is_vector() && pieces.size() <= kVectorFills) {
    fill_pieces(canvas.context(), pieces, coloring, 0.5);
    return;
  }
  cairo_surface_t* image =
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(l.width * kSamples)) + 1,
                                 static_cast<int>(std::ceil(l.height * kSamples)) + 1);
  cairo_t* to = cairo_create(image);
  cairo_set_source_rgb(to, 1.0, 1.0, 1.0);
  cairo_paint(to);
  cairo_scale(to, kSamples, kSamples);
  cairo_translate(to, -l.left, -l.top);
  cairo_set_antialias(to, CAIRO_ANTIALIAS_NONE);
  fill_pieces(to, pieces, coloring, 0.0);
  cairo_destroy(to);
  cairo_save(canvas.context());
  cairo_translate(canvas.context(), l.left, l.top);
  cairo_scale(canvas.context(), 1.0 / kSamples, 1.0 / kSamples);
  cairo_set_source_surface(canvas.context(), image, 0.0, 0.0);
  cairo_paint(canvas.context());
  cairo_restore(canvas.context());
  cairo_surface_destroy(image);
}

void paint_outlines(const Canvas& canvas, const Layout& l, const std::vector<Piece>& pieces) {
  cairo_set_line_join(canvas.context(),
                      CAIRO_LINE_JOIN_BEVEL);  // round ones cost most of the time and do not show
  std::array<std::vector<const Piece*>, kInk + 1> by_ink;
  for (const Piece& p : pieces) {
    if (p.thickness < kThinnest) continue;
    const double ink = std::min(1.0, p.thickness / (kFullInk * l.unit));
    by_ink[static_cast<std::size_t>(std::ceil(ink * kInk))].push_back(&p);
  }
  for (int ink = 1; ink <= kInk; ++ink) {
    const auto& group = by_ink[static_cast<std::size_t>(ink)];
    if (group.empty()) continue;
    const double share = static_cast<double>(ink) / kInk;
    canvas.set_color(kInkColor, 0.70 * share);
    cairo_set_line_width(canvas.context(), l.unit * (0.25 + 0.55 * share));
    for (const Piece* p : group) add_path(canvas.context(), *p);
    cairo_stroke(canvas.context());
  }
  cairo_set_line_join(canvas.context(), CAIRO_LINE_JOIN_ROUND);
}

/// Draws the line phi = value: phi is linear on a piece, so its outline is crossed twice or not at all.
void paint_contour(const Canvas& canvas, const std::vector<Piece>& pieces, double value, const Rgb& color,
                   double line_width) {
  for (const Piece& p : pieces) {
    Vec2 ends[2];
    int found = 0;
    const std::size_t n = p.phi.size();
    for (std::size_t i = 0; i < n && found < 2; ++i) {
      const std::size_t j = (i + 1) % n;
      const double a = p.phi[i] - value, b = p.phi[j] - value;
      if ((a >= 0.0) != (b >= 0.0))
        ends[found++] = p.corners[i] + a / (a - b) * (p.corners[j] - p.corners[i]);
    }
    if (found < 2 || ends[0] == ends[1]) continue;
    cairo_move_to(canvas.context(), ends[0][0], ends[0][1]);
    cairo_line_to(canvas.context(), ends[1][0], ends[1][1]);
  }
  canvas.set_color({1.0, 1.0, 1.0}, 0.6);  // a rim that parts the line from dark cells
  cairo_set_line_width(canvas.context(), 1.8 * line_width);
  cairo_stroke_preserve(canvas.context());
  canvas.set_color(color);
  cairo_set_line_width(canvas.context(), line_width);
  cairo_stroke(canvas.context());
}

/// Levels that lie far enough from the one below to be told apart.
void paint_levels(const Canvas& canvas, const Layout& l, const std::vector<Piece>& pieces,
                  const PictureOptions& o) {
  constexpr double kClosest = 4.0;  // pixels
  const double closest = kClosest * l.unit / l.scale;
  double last = 0.0;
  for (const double level : o.levels) {
    if (level - last >= closest) paint_contour(canvas, pieces, level, kLevelColor, 0.8 * l.unit);
    last = level;
  }
  if (-o.inner >= closest) paint_contour(canvas, pieces, o.inner, kInnerColor, 1.2 * l.unit);
}

/// 1, 2 or 5 times a power of ten, at most x.
double round_length(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x)));
  for (const double digit : {5.0, 2.0, 1.0})
    if (digit * power <= x) return digit * power;
  return power;
}

void paint_scale_bar(const Canvas& canvas, const Layout& l, double y) {
  const double length = round_length(0.2 * l.width / l.scale);
  const double x = 12.0 * l.unit, end = x + length * l.scale, tick = 5.0 * l.unit;
  canvas.set_color(kInkColor);
  cairo_set_line_width(canvas.context(), 1.5 * l.unit);
  for (const auto& [x0, y0, x1, y1] :
       {std::array<double, 4>{x, y, end, y}, {x, y - tick, x, y + tick}, {end, y - tick, end, y + tick}}) {
    cairo_move_to(canvas.context(), x0, y0);
    cairo_line_to(canvas.context(), x1, y1);
  }
  cairo_stroke(canvas.context());
  canvas.text(0.5 * (x + end), y + 20.0 * l.unit, 14.0 * l.unit, fmt::format("{:g}", length), 0.5);
}

void paint_swatch(const Canvas& canvas, double x, double y, double width, double height, const Rgb& c) {
  cairo_rectangle(canvas.context(), x, y, width, height);
  canvas.set_color(c);
  cairo_fill_preserve(canvas.context());
  canvas.set_color(kInkColor);
  cairo_set_line_width(canvas.context(), 0.5);
  cairo_stroke(canvas.context());
}

/// The colour scale with its ends, right-aligned.
void paint_color_bar(const Canvas& canvas, const Layout& l, const Coloring& c, double y, double lowest,
                     double highest) {
  const double u = l.unit, width = 260.0 * u, x = l.page_width - 12.0 * u - width, height = 12.0 * u;
  canvas.color_bar(x, y - height, width, height,
                   [&](double t) { return c.color(static_cast<int>(t * (kShades - 1) + 0.5)); });
  const bool size = c.mode == PictureColor::kSize;
  const auto shown = [size](double v) { return fmt::format("{:.3g}", size ? std::exp(v) : v); };
  canvas.text(x, y + 18.0 * u, 14.0 * u, shown(c.low));
  canvas.text(x + width, y + 18.0 * u, 14.0 * u, shown(c.high), 1.0);
  const std::string name = size ? std::string("normal size, log scale")
                           : c.mode == PictureColor::kLevels
                               ? std::string("farthest vertex from its level, in layers")
                               : fmt::format("quality {} .. {}", shown(lowest), shown(highest));
  canvas.text(x - 12.0 * u, y, 14.0 * u, name, 1.0);
}

/// As many as have a colour of their own.
void paint_regions(const Canvas& canvas, const Layout& l, const std::vector<std::string>& names, double y) {
  const double u = l.unit;
  const int count = std::min(kRegionCount, static_cast<int>(names.size()));
  double x = l.page_width - 12.0 * u - count * 90.0 * u;
  for (int i = 0; i < count; ++i, x += 90.0 * u) {
    paint_swatch(canvas, x, y - 12.0 * u, 22.0 * u, 14.0 * u, region_color(i));
    canvas.text(x + 28.0 * u, y, 14.0 * u, names[static_cast<std::size_t>(i)]);
  }
}

void paint_legend(const Canvas& canvas, const Layout& l, const Coloring& c, const std::string& label,
                  double lowest, double highest) {
  const double y = l.page_height - 34.0 * l.unit;
  paint_scale_bar(canvas, l, y);
  canvas.text(12.0 * l.unit + 0.25 * l.page_width, y + 5.0 * l.unit, 14.0 * l.unit, label);
  if (c.mode == PictureColor::kRegion) {
    paint_regions(canvas, l, c.regions, y + 5.0 * l.unit);
  } else if (c.mode != PictureColor::kPlain) {
    paint_color_bar(canvas, l, c, y, lowest, highest);
  }
}

Window window_of(const std::vector<SlicePolygon>& polygons, const PictureOptions& o) {
  if (o.window) {
    const auto& [u0, v0, u1, v1] = *o.window;
    if (!(u0 < u1 && v0 < v1) || !std::isfinite(u1 - u0) || !std::isfinite(v1 - v0))
      throw Error(ErrorCode::kParameter,
                  fmt::format("the picture window {} {} {} {} is empty; give u0 v0 u1 v1 with u0 < "
                              "u1 and v0 < v1",
                              u0, v0, u1, v1));
    return {{u0, v0}, {u1, v1}};
  }
  Window w{Vec2::Constant(std::numeric_limits<double>::infinity()),
           Vec2::Constant(-std::numeric_limits<double>::infinity())};
  for (const SlicePolygon& p : polygons) {
    for (const Vec2& c : p.corners) {
      w.lo = w.lo.cwiseMin(c);
      w.hi = w.hi.cwiseMax(c);
    }
  }
  if (!(w.size().array() > 0.0).all() || !w.size().allFinite())
    throw Error(ErrorCode::kParameter, "the part of the mesh in the picture has no extent");
  return w;
}

/// The picture of some polygons of a mesh.
void draw(const std::filesystem::path& path, const std::vector<SlicePolygon>& polygons, Coloring coloring,
          const std::string& label, const PictureOptions& o) {
  const Window window = window_of(polygons, o);
  const auto seen = visible(polygons, window);
  if (seen.empty())
    throw Error(ErrorCode::kParameter, fmt::format("no cell lies in the picture window {} {} {} {}",
                                                   window.lo[0], window.lo[1], window.hi[0], window.hi[1]));
  double lowest = 0.0, highest = 0.0;
  if (coloring.mode != PictureColor::kPlain) {
    const auto value = [&](const SlicePolygon* p) {
      return coloring.values[static_cast<std::size_t>(p->cell)];
    };
    const auto [low, high] =
        std::minmax_element(seen.begin(), seen.end(), [&](auto* a, auto* b) { return value(a) < value(b); });
    lowest = value(*low);
    highest = value(*high);
    if (coloring.mode == PictureColor::kSize) {
      coloring.low = lowest;
      coloring.high = highest;
    }
  }
  const Layout l = make_layout(window, o);
  const std::vector<Piece> pieces = make_pieces(seen, l, coloring);
  Canvas canvas(path, l.page_width, l.page_height);
  cairo_save(canvas.context());
  cairo_rectangle(canvas.context(), l.left, l.top, l.width, l.height);
  cairo_clip(canvas.context());
  paint_fills(canvas, l, pieces, coloring);
  paint_outlines(canvas, l, pieces);
  paint_levels(canvas, l, pieces, o);
  if (o.layer_top > 0.0) paint_contour(canvas, pieces, o.layer_top, kTopColor, 1.5 * l.unit);
  paint_contour(canvas, pieces, 0.0, kWallColor, 2.0 * l.unit);
  cairo_restore(canvas.context());
  canvas.set_color(kInkColor);
  cairo_set_line_width(canvas.context(), l.unit);
  cairo_rectangle(canvas.context(), l.left, l.top, l.width, l.height);
  cairo_stroke(canvas.context());
  if (!o.title.empty()) canvas.text(l.left, l.top - 14.0 * l.unit, 20.0 * l.unit, o.title);
  paint_legend(canvas, l, coloring, label, lowest, highest);
  canvas.finish();
}

void check_options(const std::filesystem::path& path, const PictureOptions& o) {
  check_picture_extension(path);
  if (o.width_px < 200 || o.width_px > 8000)
    throw Error(ErrorCode::kParameter,
                fmt::format("a picture width of {} pixels; it must lie in 200..8000", o.width_px));
}

template <int D>
const std::vector<double>& phi_of(const Mesh<D>& mesh) {
  static const std::vector<double> none;
  const MeshField* phi = mesh.point_field("phi");
  return phi != nullptr && phi->components == 1 && phi->values.size() == mesh.points.size() ? phi->values
                                                                                            : none;
}

}  // namespace

void set_levels(PictureOptions& options, const BoundaryLayer& layer, int mirrored_layers) {
  options.layer_top = layer.top();
  options.levels.clear();
  for (int k = 1; k < layer.layers; ++k) options.levels.push_back(layer.level(k));
  options.inner = -layer.level(mirrored_layers);
}

void draw_slice(const std::filesystem::path& path, const Mesh<3>& mesh, const PictureOptions& options) {
  check_options(path, options);
  const auto [axis, offset] = options.plane;
  const std::vector<SlicePolygon> polygons = slice(mesh, axis, offset, phi_of(mesh));
  const std::string plane = fmt::format("{} = {:g}", "xyz"[axis], offset);
  if (polygons.empty())
    throw Error(ErrorCode::kParameter, fmt::format("the plane {} of the picture cuts no cell", plane));
  draw(path, polygons, make_coloring(mesh, options.color), plane, options);
}

void draw_slice(const std::filesystem::path& path, const Mesh<2>& mesh, const PictureOptions& options) {
  check_options(path, options);
  const std::vector<double>& phi = phi_of(mesh);
  std::vector<SlicePolygon> polygons(mesh.cells.size());
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    polygons[i].cell = static_cast<Index>(i);
    for (const Index v : mesh.cells[i]) {
      polygons[i].corners.push_back(mesh.points[static_cast<std::size_t>(v)]);
      if (!phi.empty()) polygons[i].phi.push_back(phi[static_cast<std::size_t>(v)]);
    }
  }
  if (polygons.empty()) throw Error(ErrorCode::kParameter, "a mesh without cells has no picture");
  draw(path, polygons, make_coloring(mesh, options.color), "", options);
}

}  // namespace lamina
