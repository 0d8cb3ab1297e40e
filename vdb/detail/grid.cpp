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
#include "vdb/detail/size_values.h"

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
    return out.good() && name_by_content(path);
  }

 private:
  // The random identifier in the header becomes one made of the content, so that equal grids give equal
  // files.
  static bool name_by_content(const std::filesystem::path& path) {
    constexpr std::streamoff kBefore = 21;  // magic number, versions, flag of offsets
    constexpr std::size_t kLength = 36;
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(kBefore + std::streamoff{kLength});
    std::uint64_t h[2] = {0xcbf29ce484222325ULL, 0x84222325cbf29ce4ULL};
    std::vector<char> part(std::size_t{1} << 20);
    while (file.read(part.data(), static_cast<std::streamsize>(part.size())) || file.gcount() > 0) {
      for (std::streamsize i = 0; i < file.gcount(); ++i)
        for (std::uint64_t& word : h)
          word = (word ^ static_cast<unsigned char>(part[std::size_t(i)])) * 0x100000001b3ULL;
    }
    file.clear();
    file.seekp(kBefore);
    const std::string id =
        fmt::format("{:08x}-{:04x}-4{:03x}-8{:03x}-{:012x}", h[0] >> 32, h[0] >> 16 & 0xffff, h[0] & 0xfff,
                    h[1] >> 48 & 0xfff, h[1] & 0xffffffffffffULL);
    file.write(id.data(), kLength);
    file.close();
    return file.good();
  }
};

}  // namespace

double stored_scale(double voxel) {
  constexpr double kSmallest = 2e-5;
  double scale = 1.0;
  while (voxel * scale < kSmallest) scale *= 1000.0;
  return scale;
}

namespace {

using openvdb::Vec3SGrid;
using Vec3Leaf = Vec3SGrid::TreeType::LeafNodeType;

// A grid of vectors on the voxels of another.
struct Companion {
  Companion(const openvdb::FloatGrid& like, const Lattice& lattice, const char* name,
            openvdb::VecType vector_type, const char* meaning)
      : grid(dress<Vec3SGrid>(Vec3SGrid::create(std::make_shared<openvdb::Vec3STree>(
                                  like.constTree(), openvdb::Vec3s(0.0F), openvdb::TopologyCopy())),
                              name, lattice)),
        leaves(leaves_of(grid->tree())) {
    grid->setVectorType(vector_type);
    grid->insertMeta("lamina:meaning", openvdb::StringMetadata(meaning));
  }
  Vec3SGrid::Ptr grid;
  std::vector<Vec3Leaf*> leaves;
};

openvdb::FloatGrid::Ptr painted_copy(const SizeGrid& painted, double scale) {
  const SizeValues& v = painted.impl().painted;
  auto grid = openvdb::FloatGrid::create(0.0F);
  const auto stored = [scale](float size) { return static_cast<float>(scale * size); };
  for (const SizeCube& cube : v.cubes) {
    const openvdb::Coord first(cube.origin[0], cube.origin[1], cube.origin[2]);
    if (cube.values < 0) {
      grid->fill(openvdb::CoordBBox::createCube(first, cube.side), stored(cube.least), true);
      continue;
    }
    Leaf* leaf = grid->tree().touchLeaf(first);
    for (openvdb::Index i = 0; i < 512; ++i) {
      const float size = v.values[static_cast<std::size_t>(cube.values) + i];
      if (std::isfinite(size)) leaf->setValueOn(i, stored(size));
    }
  }
  dress<openvdb::FloatGrid>(grid, painted.name().c_str(), {scale * v.lattice.A, scale * v.lattice.origin});
  grid->insertMeta("lamina:meaning", openvdb::StringMetadata("largest element size, a length"));
  if (scale != 1.0) grid->insertMeta(kScaleMetadata, openvdb::DoubleMetadata(scale));
  return grid;
}

// Tensors and sizes are bare numbers to OpenVDB.
constexpr const char* kNotTurned = " Moving or turning the grid does not turn its values.";

}  // namespace

void BandGrid::write(const std::filesystem::path& path, FunctionRef<Sample(const Vec3&, double)> at,
                     bool with_metric, std::span<const SizeGrid> painted) const {
  OutputFile file(path);
  const double scale = stored_scale(unit_);
  const Lattice stored{scale * lattice_.A, scale * lattice_.origin};
  const auto surface = dress<openvdb::FloatGrid>(impl_->grid->deepCopy(), "surface", stored);
  if (scale != 1.0) surface->insertMeta(kScaleMetadata, openvdb::DoubleMetadata(scale));
  std::vector<Companion> beside;
  const auto add = [&](const char* name, openvdb::VecType type, const std::string& meaning) {
    beside.emplace_back(*surface, stored, name, type, meaning.c_str());
  };
  add("N", openvdb::VEC_COVARIANT_NORMALIZE, "unit normal of the closest wall point, into the fluid");
  add("T1", openvdb::VEC_CONTRAVARIANT_RELATIVE, "unit principal direction of k1; T2 = N x T1");
  add("k", openvdb::VEC_INVARIANT,
      "k1, k2, reliability: principal curvatures of the closest wall point, 1/length, > 0 convex, bounded by "
      "1000 / voxel; how far they can be relied on, 0 to 1");
  if (with_metric) {
    add("h", openvdb::VEC_INVARIANT, std::string("element sizes along N, T1 and T2, lengths.") + kNotTurned);
    add("logM_diag", openvdb::VEC_INVARIANT,
        std::string("xx, yy, zz of log(M), M the metric in world axes, 1/length^2.") + kNotTurned);
    add("logM_off", openvdb::VEC_INVARIANT, std::string("xy, xz, yz of log(M).") + kNotTurned);
  }
  const auto leaves = leaves_of(surface->tree());
  const float unit = static_cast<float>(scale * unit_);
  const double limit = 1e3 / unit_, log_scale = 2.0 * std::log(scale);
  for_each_index(
      leaves.size(),
      [&](std::size_t i) {
        for (openvdb::Index v = 0; v < 512; ++v) leaves[i]->setValueOnly(v, leaves[i]->getValue(v) * unit);
        for (auto it = leaves[i]->cbeginValueOn(); it; ++it) {
          const double phi = static_cast<double>(leaves[i]->getValue(it.pos())) / scale;
          const Sample s = at(world_of(lattice_, it.getCoord()), phi);
          const Sym<3>& m = s.log_metric;
          const Vec3 values[6] = {s.wall.N,
                                  s.wall.T1,
                                  {std::clamp(s.wall.k1, -limit, limit) / scale,
                                   std::clamp(s.wall.k2, -limit, limit) / scale, s.wall.reliability},
                                  scale * s.h,
                                  Vec3(m[0], m[2], m[5]) - Vec3::Constant(log_scale),
                                  {m[1], m[3], m[4]}};
          for (std::size_t g = 0; g < beside.size(); ++g)
            beside[g].leaves[i]->setValueOnly(it.pos(), to_vdb(values[g]));
        }
      },
      8);
  openvdb::tools::changeBackground(surface->tree(), surface->background() * unit);
  openvdb::GridCPtrVec grids{surface};
  for (const Companion& c : beside) grids.push_back(c.grid);
  openvdb::MetaMap meta;
  meta.insertMeta("creator", openvdb::StringMetadata("Lamina"));
  try {
    for (const SizeGrid& p : painted) grids.push_back(painted_copy(p, scale));
    CheckedArchive out;
    out.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    if (!out.write_file(file.temporary_path(), grids, meta))
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
