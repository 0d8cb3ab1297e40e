// Links Lamina::vdb: the level set of a sphere, no OpenVDB header in sight.
#include <cmath>

#include "vdb/level_set.h"
#include "vdb/shapes.h"

int main() {
  lamina::LevelSetOptions options;
  lamina::Surface sphere = lamina::make_shape("sphere", {});
  const lamina::Box<3> box = sphere.bounds();
  options.voxel = 0.1 * box.size().maxCoeff();
  const auto level_set = lamina::LevelSet::from_surface(std::move(sphere), options);
  const double radius = 0.5 * box.size().x();
  return std::abs(level_set.phi(box.center()) + radius) < 0.1 * radius ? 0 : 1;
}
