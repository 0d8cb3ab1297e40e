#include "tests/vdb/openvdb_oracle.h"

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Diagnostics.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>
#include <stdexcept>

namespace lamina::openvdb_oracle {
namespace {

template <class GridT>
typename GridT::Ptr read(const std::filesystem::path& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<GridT>(file.readGrid(name));
  if (!grid) throw std::runtime_error(path.string() + ": " + name + " is of another type");
  return grid;
}

openvdb::math::Transform::Ptr to_vdb(const Transform& transform) {
  openvdb::math::Mat4d m(openvdb::math::Mat4d::identity());
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(j, i) = transform.A(i, j);
    m(3, i) = transform.origin[i];
  }
  return openvdb::math::Transform::createLinearTransform(m);
}

Vec3 to_vec(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

void write_level_set(const std::filesystem::path& path, const Transform& transform, const Box<3>& bounds,
                     double half_width, const std::function<double(const Vec3&)>& phi) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(static_cast<float>(half_width));
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(to_vdb(transform));
  const Mat3 to_index = transform.A.inverse();
  Box<3> box;
  for (int c = 0; c < 8; ++c)
    box.extend(to_index * (Vec3(c & 1 ? bounds.hi[0] : bounds.lo[0], c & 2 ? bounds.hi[1] : bounds.lo[1],
                                c & 4 ? bounds.hi[2] : bounds.lo[2]) -
                           transform.origin));
  const auto low = [&](int i) { return static_cast<int>(std::floor(box.lo[i])); };
  const auto high = [&](int i) { return static_cast<int>(std::ceil(box.hi[i])); };
  auto accessor = grid->getAccessor();
  for (int i = low(0); i <= high(0); ++i)
    for (int j = low(1); j <= high(1); ++j)
      for (int k = low(2); k <= high(2); ++k) {
        const double v = phi(transform.A * Vec3(i, j, k) + transform.origin);
        if (std::abs(v) < half_width) accessor.setValue({i, j, k}, static_cast<float>(v));
      }
  openvdb::tools::signedFloodFill(grid->tree());
  openvdb::io::File(path.string()).write({grid});
}

void write_painted(const std::filesystem::path& path, const std::string& name, const Transform& transform,
                   const std::vector<Painted>& boxes) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(0.0F);
  grid->setName(name);
  grid->setTransform(to_vdb(transform));
  for (const Painted& b : boxes)
    grid->sparseFill({{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}}, static_cast<float>(b.value));
  openvdb::io::File(path.string()).write({grid});
}

std::vector<Voxel> active_voxels(const std::filesystem::path& path, const std::string& name) {
  const auto grid = read<openvdb::FloatGrid>(path, name);
  std::vector<Voxel> out;
  out.reserve(grid->activeVoxelCount());
  for (auto it = grid->cbeginValueOn(); it; ++it) {
    const openvdb::Coord c = it.getCoord();
    out.push_back({{c.x(), c.y(), c.z()}, to_vec(grid->indexToWorld(c)), it.getValue()});
  }
  return out;
}

std::vector<Vec3> active_vectors(const std::filesystem::path& path, const std::string& name) {
  const auto grid = read<openvdb::Vec3SGrid>(path, name);
  std::vector<Vec3> out;
  out.reserve(grid->activeVoxelCount());
  for (auto it = grid->cbeginValueOn(); it; ++it) out.push_back(to_vec(openvdb::Vec3d(it.getValue())));
  return out;
}

std::string check_level_set(const std::filesystem::path& path, const std::string& name, int tests) {
  return openvdb::tools::checkLevelSet(*read<openvdb::FloatGrid>(path, name),
                                       static_cast<std::size_t>(tests));
}

}  // namespace lamina::openvdb_oracle
