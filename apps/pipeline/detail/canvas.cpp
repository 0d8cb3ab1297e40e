#include "apps/pipeline/detail/canvas.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/pipeline/picture.h"
#include "core/error.h"

namespace lamina {
namespace {

void check(cairo_status_t status, const std::filesystem::path& path) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error(ErrorCode::kFileWrite, fmt::format("{}: the picture cannot be written: {}", path.string(),
                                                   cairo_status_to_string(status)));
}

cairo_status_t append(void* to, const unsigned char* data, unsigned int size) {
  try {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), size);
  } catch (...) {
    return CAIRO_STATUS_NO_MEMORY;  // no exception may pass through cairo
  }
  return CAIRO_STATUS_SUCCESS;
}

cairo_surface_t* make_surface(const std::string& extension, std::string* to, int width, int height) {
  if (extension == ".svg") return cairo_svg_surface_create_for_stream(append, to, width, height);
  if (extension == ".pdf") {
    cairo_surface_t* surface = cairo_pdf_surface_create_for_stream(append, to, width, height);
    // The time of writing would make every file different.
    cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATE_DATE, "1970-01-01T00:00:00Z");
    return surface;
  }
  return cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
}

/// cairo numbers surfaces and images by a counter of the process: numbers them anew in the order they appear.
std::string renumber(const std::string& svg) {
  std::string result;
  std::map<std::string, std::size_t> numbers;
  for (std::size_t at = 0; at < svg.size();) {
    const std::size_t found =
        std::min(svg.find("\"surface", at), std::min(svg.find("\"image", at), svg.find("\"#image", at)));
    const std::size_t digits =
        found == std::string::npos ? found : svg.find_first_of("0123456789\"", found + 1);
    const std::size_t end =
        digits == std::string::npos ? digits : svg.find_first_not_of("0123456789", digits);
    if (end == std::string::npos) {
      result.append(svg, at);
      break;
    }
    result.append(svg, at, digits - at);
    if (end > digits)
      result +=
          std::to_string(numbers.emplace(svg.substr(digits, end - digits), numbers.size()).first->second);
    at = end;
  }
  return result;
}

}  // namespace

std::uint32_t pixel_of(const Rgb& c) {
  std::uint32_t word = 0;
  for (const double part : c) word = word << 8 | static_cast<std::uint32_t>(std::lround(255.0 * part));
  return word;
}

void check_picture_extension(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension != ".png" && extension != ".svg" && extension != ".pdf")
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: unknown extension \"{}\" of a picture; known are .png, .svg "
                            "and .pdf",
                            path.string(), path.extension().string()));
}

Canvas::Canvas(const std::filesystem::path& path, int width, int height)
    : path_(path),
      out_(path),
      vector_(lower_extension(path) != ".png"),
      bytes_(std::make_unique<std::string>()) {
  check_picture_extension(path);
  surface_.reset(make_surface(lower_extension(path), bytes_.get(), width, height));
  check(cairo_surface_status(surface_.get()), path_);
  context_.reset(cairo_create(surface_.get()));
  set_color({1.0, 1.0, 1.0});
  cairo_paint(context());
  cairo_set_line_join(context(), CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(context(), CAIRO_LINE_CAP_ROUND);
  cairo_select_font_face(context(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
}

void Canvas::Release::operator()(cairo_t* c) const { cairo_destroy(c); }

void Canvas::Release::operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }

void Canvas::set_color(const Rgb& c, double alpha) const {
  cairo_set_source_rgba(context(), c[0], c[1], c[2], alpha);
}

void Canvas::line(double x0, double y0, double x1, double y1) const {
  cairo_move_to(context(), x0, y0);
  cairo_line_to(context(), x1, y1);
  cairo_stroke(context());
}

void Canvas::text(double x, double y, double size, const std::string& s, double align) const {
  cairo_set_font_size(context(), size);
  cairo_text_extents_t extents;
  cairo_text_extents(context(), s.c_str(), &extents);
  cairo_move_to(context(), x - align * extents.x_advance, y);
  cairo_show_text(context(), s.c_str());
}

void Canvas::image(double x, double y, int width, int height, std::vector<std::uint32_t>& pixels) const {
  const std::unique_ptr<cairo_surface_t, Release> picture(cairo_image_surface_create_for_data(
      reinterpret_cast<unsigned char*>(pixels.data()), CAIRO_FORMAT_RGB24, width, height, 4 * width));
  cairo_set_source_surface(context(), picture.get(), x, y);
  cairo_paint(context());
}

void Canvas::color_bar(double x, double y, double width, double height,
                       FunctionRef<Rgb(double)> color) const {
  constexpr int kLevels = 64;
  for (int i = 0; i < kLevels; ++i) {
    cairo_rectangle(context(), x + width * i / kLevels, y, width / kLevels + 0.5, height);
    set_color(color(static_cast<double>(i) / (kLevels - 1)));
    cairo_fill(context());
  }
  set_color(kInkColor);
  cairo_set_line_width(context(), 0.5);
  cairo_rectangle(context(), x, y, width, height);
  cairo_stroke(context());
}

void Canvas::finish() {
  check(cairo_status(context()), path_);
  context_.reset();
  if (vector_) {
    cairo_surface_finish(surface_.get());
  } else {
    check(cairo_surface_write_to_png_stream(surface_.get(), append, bytes_.get()), path_);
  }
  check(cairo_surface_status(surface_.get()), path_);
  surface_.reset();
  out_.write(lower_extension(path_) == ".svg" ? renumber(*bytes_) : *bytes_);
  out_.commit();
}

}  // namespace lamina
