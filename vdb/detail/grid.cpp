#include "vdb/detail/grid.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Filter.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/error.h"
#include "core/file.h"

namespace lamina::detail {

struct BandGrid::Impl {
  openvdb::FloatGrid::Ptr grid;
};

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

template <class TreeT>
std::vector<typename TreeT::LeafNodeType*> leaves_of(TreeT& tree) {
  std::vector<typename TreeT::LeafNodeType*> leaves;
  leaves.reserve(tree.leafCount());
  tree.getNodes(leaves);
  return leaves;
}

Vec3 world_of(const Lattice& l, const openvdb::Coord& c) {
  return l.A * Vec3(c.x(), c.y(), c.z()) + l.origin;
}

openvdb::math::Transform::Ptr transform_of(const Lattice& l) {
  openvdb::math::Mat4d m(openvdb::math::Mat4d::identity());
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(j, i) = l.A(i, j);  // OpenVDB multiplies row vectors from the left
    m(3, i) = l.origin[i];
  }
  return openvdb::math::Transform::createLinearTransform(m);
}

openvdb::Vec3s to_vdb(const Vec3& v) { return {float(v[0]), float(v[1]), float(v[2])}; }

template <class GridT>
typename GridT::Ptr dress(typename GridT::Ptr grid, const char* name, const Lattice& lattice) {
  grid->setName(name);
  grid->setCreator("Lamina");
  grid->setTransform(transform_of(lattice));
  return grid;
}

}  // namespace

BandGrid::BandGrid() : impl_(std::make_unique<Impl>()) { openvdb::initialize(); }
BandGrid::~BandGrid() = default;
BandGrid::BandGrid(BandGrid&&) noexcept = default;
BandGrid& BandGrid::operator=(BandGrid&&) noexcept = default;

BandGrid BandGrid::from_surface(const Surface& s, double voxel, double half_width_vox, const Vec3& origin) {
  BandGrid out;
  out.unit_ = voxel;
  out.lattice_ = {voxel * Mat3::Identity(), origin};
  std::vector<openvdb::Vec3s> points(s.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = to_vdb((s.points[i] - origin) / voxel);
  std::vector<openvdb::Vec3I> triangles(s.triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      triangles[t][k] = static_cast<openvdb::Index32>(s.triangles[t][static_cast<std::size_t>(k)]);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points, triangles);
  const auto unit = openvdb::math::Transform::createLinearTransform(1.0);
  const float width = static_cast<float>(half_width_vox);
  openvdb::util::NullInterrupter quiet;
  out.impl_->grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      quiet, mesh, *unit, width, width, openvdb::tools::DISABLE_RENORMALIZATION, nullptr);
  out.impl_->grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return out;
}

BandGrid BandGrid::like(const SparseGrid& grid, const Lattice& lattice, double unit, double half_width_vox) {
  BandGrid out;
  out.unit_ = unit;
  out.lattice_ = lattice;
  const float width = static_cast<float>(half_width_vox);
  out.impl_->grid = openvdb::FloatGrid::create(width);
  out.impl_->grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (const Block& b : grid.blocks()) {
    if (std::all_of(b.active.begin(), b.active.end(), [](std::uint64_t w) { return w == 0; })) continue;
    Leaf* leaf = out.impl_->grid->tree().touchLeaf(openvdb::Coord(b.origin[0], b.origin[1], b.origin[2]));
    for (openvdb::Index i = 0; i < 512; ++i) {
      const float v = b.value[i] < 0.0 ? -width : width;
      if (b.is_active(i)) {
        leaf->setValueOn(i, v);
      } else {
        leaf->setValueOff(i, v);
      }
    }
  }
  return out;
}

BandGrid::Polish BandGrid::polish(FunctionRef<double(const Vec3&, double)> exact) {
  const std::vector<Leaf*> leaves = leaves_of(impl_->grid->tree());
  const float width = impl_->grid->background();
  std::vector<Polish> part(leaves.size());
  for_each_index(
      leaves.size(),
      [&](std::size_t i) {
        for (auto it = leaves[i]->beginValueOn(); it; ++it) {
          const double old = std::abs(static_cast<double>(it.getValue()));
          const double bound = old * (1.0 + 1e-4) + kPolishTolerance;
          const double v = exact(world_of(lattice_, it.getCoord()), bound * unit_) / unit_;
          const double off = std::abs(std::abs(v) - old);
          part[i].worst = std::max(part[i].worst, off);
          part[i].changed += off > kPolishTolerance;
          const float f = static_cast<float>(v);
          if (std::abs(f) < width) {
            it.setValue(f);
          } else {
            leaves[i]->setValueOff(it.pos(), f < 0.0F ? -width : width);
          }
        }
      },
      8);
  openvdb::tools::signedFloodFillWithValues(impl_->grid->tree(), width, -width);
  Polish sum;
  for (const Polish& p : part) {
    sum.changed += p.changed;
    sum.worst = std::max(sum.worst, p.worst);
  }
  return sum;
}

BandGrid BandGrid::copy() const {
  BandGrid out;
  out.impl_->grid = impl_->grid->deepCopy();
  out.lattice_ = lattice_;
  out.unit_ = unit_;
  return out;
}

void BandGrid::smooth() {
  openvdb::tools::Filter<openvdb::FloatGrid> filter(*impl_->grid);
  filter.gaussian(1, 1);
}

SparseGrid BandGrid::extract() const {
  const auto leaves = leaves_of(impl_->grid->tree());
  std::vector<Block> blocks(leaves.size());
  for_each_index(
      leaves.size(),
      [&](std::size_t b) {
        const Leaf& leaf = *leaves[b];
        blocks[b].origin = {leaf.origin().x(), leaf.origin().y(), leaf.origin().z()};
        for (openvdb::Index i = 0; i < 512; ++i) {
          blocks[b].value[i] = leaf.getValue(i);
          if (leaf.isValueOn(i)) blocks[b].active[i >> 6] |= std::uint64_t{1} << (i & 63);
        }
      },
      64);
  return {std::move(blocks), impl_->grid->background()};
}

std::int64_t BandGrid::active_voxels() const {
  return static_cast<std::int64_t>(impl_->grid->activeVoxelCount());
}
double BandGrid::bytes() const { return static_cast<double>(impl_->grid->memUsage()); }

namespace {

// openvdb::io::File does not look at its stream after writing: on a full disk it leaves half a file behind as
// if all were well.
class CheckedArchive : public openvdb::io::Archive {
 public:
  [[nodiscard]] openvdb::SharedPtr<openvdb::io::Archive> copy() const override {
    return std::make_shared<CheckedArchive>(*this);
  }
  [[nodiscard]] bool write_file(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids,
                                const openvdb::MetaMap& meta) const {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    Archive::write(out, grids, /*seekable=*/true, meta);
    out.close();
    return out.good();
  }
};

}  // namespace

double stored_scale(double voxel) {
  constexpr double kSmallest = 2e-5;
  double scale = 1.0;
  while (voxel * scale < kSmallest) scale *= 1000.0;
  return scale;
}

void BandGrid::write(const std::filesystem::path& path, FunctionRef<WallPoint(const Vec3&)> at) const {
  using openvdb::Vec3SGrid;
  using openvdb::Vec3STree;
  OutputFile file(path);
  const double scale = stored_scale(unit_);
  const Lattice stored{scale * lattice_.A, scale * lattice_.origin};
  const auto surface = dress<openvdb::FloatGrid>(impl_->grid->deepCopy(), "surface", stored);
  if (scale != 1.0) surface->insertMeta(kScaleMetadata, openvdb::DoubleMetadata(scale));
  const float unit = static_cast<float>(scale * unit_);
  const auto frame_grid = [&](const char* name) {
    const auto tree =
        std::make_shared<Vec3STree>(surface->constTree(), openvdb::Vec3s(0.0F), openvdb::TopologyCopy());
    return dress<Vec3SGrid>(Vec3SGrid::create(tree), name, stored);
  };
  const Vec3SGrid::Ptr frames[3] = {frame_grid("N"), frame_grid("T1"), frame_grid("k")};
  frames[0]->setVectorType(openvdb::VEC_COVARIANT_NORMALIZE);
  frames[1]->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  frames[2]->setVectorType(openvdb::VEC_INVARIANT);
  const auto leaves = leaves_of(surface->tree());
  const auto n = leaves_of(frames[0]->tree()), t = leaves_of(frames[1]->tree()),
             k = leaves_of(frames[2]->tree());
  const double limit = 1e3 / unit_;
  for_each_index(
      leaves.size(),
      [&](std::size_t i) {
        for (openvdb::Index v = 0; v < 512; ++v) leaves[i]->setValueOnly(v, leaves[i]->getValue(v) * unit);
        for (auto it = leaves[i]->cbeginValueOn(); it; ++it) {
          const WallPoint w = at(world_of(lattice_, it.getCoord()));
          n[i]->setValueOnly(it.pos(), to_vdb(w.N));
          t[i]->setValueOnly(it.pos(), to_vdb(w.T1));
          k[i]->setValueOnly(
              it.pos(),
              to_vdb(Vec3(std::clamp(w.k1, -limit, limit), std::clamp(w.k2, -limit, limit), 0.0) / scale));
        }
      },
      8);
  openvdb::tools::changeBackground(surface->tree(), surface->background() * unit);
  openvdb::MetaMap meta;
  meta.insertMeta("creator", openvdb::StringMetadata("Lamina"));
  meta.insertMeta("lamina:k", openvdb::StringMetadata(
                                  "principal curvatures, 1/length, > 0 convex, bounded by 1000 / voxel"));
  try {
    CheckedArchive out;
    out.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    if (!out.write_file(file.temporary_path(), {surface, frames[0], frames[1], frames[2]}, meta))
      throw Error(ErrorCode::kFileWrite,
                  fmt::format("{}: cannot be written: is the disk full?", path.string()));
  } catch (const openvdb::Exception& e) {
    throw Error(ErrorCode::kFileWrite, fmt::format("{}: cannot be written: {}", path.string(), e.what()));
  }
  file.commit();
}

// Leaves hold on the surface about 2 half widths of voxels plus the rest of the blocks they end in: bytes per
// wall voxel measured 70 (half width 3) to 340 (30) on spheres. meshToVolume keeps the polygon index grid at
// the same time, and the stencils a copy in double.
double band_bytes(double area, double voxel, double half_width_vox) {
  return 16.0 * 1.2 * (2.0 * half_width_vox + 14.0) * area / (voxel * voxel);
}

double band_voxel(double area, double bytes, double half_width_vox) {
  return std::sqrt(band_bytes(area, 1.0, half_width_vox) / bytes);
}

}  // namespace lamina::detail
