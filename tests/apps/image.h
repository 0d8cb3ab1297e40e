#pragma once

#include <cairo/cairo.h>  // found without the include path that the library keeps to itself

#include <array>
#include <filesystem>
#include <memory>

namespace lamina {

/// Pixels of a .png.
class Image {
 public:
  explicit Image(const std::filesystem::path& path)
      : surface_(cairo_image_surface_create_from_png(path.c_str()), cairo_surface_destroy) {}
  [[nodiscard]] int width() const { return cairo_image_surface_get_width(surface_.get()); }
  [[nodiscard]] int height() const { return cairo_image_surface_get_height(surface_.get()); }
  [[nodiscard]] std::array<int, 3> at(int x, int y) const {
    const unsigned char* p = cairo_image_surface_get_data(surface_.get()) +
                             static_cast<std::ptrdiff_t>(y) * cairo_image_surface_get_stride(surface_.get()) +
                             4 * x;
    return {p[2], p[1], p[0]};
  }
  /// Pixels for which `wanted` holds.
  template <class Wanted>
  [[nodiscard]] int count(Wanted&& wanted) const {
    int n = 0;
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) n += wanted(at(x, y));
    return n;
  }

 private:
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
};

}  // namespace lamina
