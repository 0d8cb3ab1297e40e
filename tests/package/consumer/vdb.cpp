// Links Lamina::vdb: the example of vdb/README.md on a sphere, no OpenVDB header in sight.
#include <cmath>
#include <filesystem>

#include "vdb/shapes.h"

// clang-format off
#include "vdb/level_set.h"
#include "vdb/surface_io.h"

// What is known of the wall of body.stl at some points; its level set is written beside it.
std::vector<lamina::WallPoint> look_at_wall(const std::filesystem::path& stl,
                                            const std::vector<lamina::Vec3>& points) {
  std::vector<std::string> warnings;
  lamina::Surface surface = lamina::read_surface(stl, warnings);
  const lamina::SurfaceReport report = lamina::clean(surface, stl.string());  // report.warnings: what was mended
  const auto wall = lamina::LevelSet::from_surface(std::move(surface), {});
  std::vector<lamina::WallPoint> found(points.size());
  wall.sample(points, found);  // phi < 0 inside; N into the fluid; k1, k2 > 0 convex; reliability in [0, 1]
  wall.write(std::filesystem::path(stl).replace_extension(".vdb"));  // grids surface, N, T1, k
  return found;
}
// clang-format on

int main() {
  const std::filesystem::path stl = std::filesystem::temp_directory_path() / "lamina_example.stl";
  const lamina::Surface sphere = lamina::make_shape("sphere", {});
  const lamina::Vec3 center = sphere.bounds().center();
  const double radius = 0.5 * sphere.bounds().size().x();
  lamina::write_stl(stl, sphere);
  const auto found = look_at_wall(stl, {center + lamina::Vec3(0, 0, 2 * radius), center});
  bool good =
      std::abs(found[0].phi - radius) < 0.01 * radius && std::abs(found[1].phi + radius) < 0.01 * radius;
  good = good && found[0].N.z() > 0.999 && std::abs(found[0].k1 * radius - 1.0) < 0.05 &&
         found[0].reliability > 0.9;
  good = good && std::filesystem::remove(std::filesystem::path(stl).replace_extension(".vdb"));
  std::filesystem::remove(stl);
  return good ? 0 : 1;
}
