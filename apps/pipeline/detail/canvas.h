// A page to draw on: cairo surfaces of .png, .svg and .pdf behind one owner.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/pipeline/detail/color_map.h"
#include "core/file.h"
#include "core/parallel.h"

// As cairo.h declares them; it is included by the sources only.
typedef struct _cairo cairo_t;
typedef struct _cairo_surface cairo_surface_t;

namespace lamina {

inline constexpr Rgb kInkColor = {0.10, 0.11, 0.14}, kWallColor = {0.85, 0.05, 0.08},
                     kTopColor = {0.08, 0.25, 0.80}, kLevelColor = {0.10, 0.55, 0.15},
                     kInnerColor = {0.95, 0.55, 0.05};

/// 0x00RRGGBB.
std::uint32_t pixel_of(const Rgb& c);

class Canvas {
 public:
  /// A white page of so many pixels (points in vector files). The file appears with finish().
  /// Errors: kFileUnsupported, kFileWrite.
  Canvas(const std::filesystem::path& path, int width, int height);

  [[nodiscard]] cairo_t* context() const { return context_.get(); }
  [[nodiscard]] bool is_vector() const { return vector_; }
  void set_color(const Rgb& c, double alpha = 1.0) const;
  /// Draws a line in the colour and width that are set.
  void line(double x0, double y0, double x1, double y1) const;
  /// Writes text with its left end (align 0), middle (0.5) or right end (1) at x and its baseline at y.
  void text(double x, double y, double size, const std::string& s, double align = 0.0) const;
  /// Paints rows of pixels 0x00RRGGBB with their upper left corner at (x, y).
  void image(double x, double y, int width, int height, std::vector<std::uint32_t>& pixels) const;
  /// A framed scale of colours color(0) to color(1), from left to right.
  void color_bar(double x, double y, double width, double height, FunctionRef<Rgb(double)> color) const;
  /// Writes and renames. Errors: kFileWrite.
  void finish();

 private:
  struct Release {
    void operator()(cairo_t* c) const;
    void operator()(cairo_surface_t* s) const;
  };
  std::filesystem::path path_;
  OutputFile out_;
  bool vector_ = false;
  std::unique_ptr<std::string> bytes_;  // filled by the surface, which keeps its address
  std::unique_ptr<cairo_surface_t, Release> surface_;
  std::unique_ptr<cairo_t, Release> context_;
};

}  // namespace lamina
