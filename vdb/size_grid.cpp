// Distances are measured in index space and turned into lengths by the shortest voxel edge: never too long,
// so that bounds are never too large, and exact for cubic voxels.
#include "vdb/size_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vdb/detail/size_values.h"

namespace lamina {
namespace {

using detail::BoxNode;
using detail::BoxRef;
using detail::SizeCube;

// Voxels reach half a step beyond their centres.
struct IndexBox {
  Vec3 lo, hi;
  IndexBox(const Vec3& first, double side)
      : lo(first - Vec3::Constant(0.5)), hi(first + Vec3::Constant(side - 0.5)) {}
  [[nodiscard]] double distance(const Vec3& x) const {
    return (lo - x).cwiseMax(x - hi).cwiseMax(0.0).norm();
  }
};

Vec3 first_voxel(const SizeCube& c) {
  return {double(c.origin[0]), double(c.origin[1]), double(c.origin[2])};
}

std::vector<std::array<float, 2>> least_of_nodes(const detail::BoxTree& tree,
                                                 const std::vector<SizeCube>& cubes) {
  std::vector<std::array<float, 2>> least(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {  // children come after their parent
    for (std::size_t side = 0; side < 2; ++side) {
      const std::int32_t child = tree.nodes[n].child[side];
      float& value = least[n][side];
      if (child >= 0) {
        const std::array<float, 2>& below = least[static_cast<std::size_t>(child)];
        value = std::min(below[0], below[1]);
        continue;
      }
      value = std::numeric_limits<float>::infinity();
      for (int i = detail::leaf_begin(child); i < detail::leaf_begin(child) + detail::leaf_count(child); ++i)
        value = std::min(value, cubes[static_cast<std::size_t>(tree.ids[static_cast<std::size_t>(i)])].least);
    }
  }
  return least;
}

// The least of `best` and of value + rate * distance over the voxels of a cube.
double bound_in_cube(const detail::SizeValues& painted, const SizeCube& cube, const Vec3& x, double rate,
                     double best) {
  const Vec3 first = first_voxel(cube);
  if (cube.values < 0)
    return std::min(best, double(cube.least) + rate * IndexBox(first, cube.side).distance(x));
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3 corner = first + 4.0 * Vec3(octant >> 2, octant >> 1 & 1, octant & 1);
    const double least = cube.octants[static_cast<std::size_t>(octant)];
    if (!(least + rate * IndexBox(corner, 4.0).distance(x) < best)) continue;
    for (int v = 0; v < 64; ++v) {
      const int i = 4 * (octant >> 2) + (v >> 4), j = 4 * (octant >> 1 & 1) + (v >> 2 & 3),
                k = 4 * (octant & 1) + (v & 3);
      const double size =
          painted.values[static_cast<std::size_t>(cube.values) + detail::Block::offset(i, j, k)];
      if (size < best) best = std::min(best, size + rate * IndexBox(first + Vec3(i, j, k), 1.0).distance(x));
    }
  }
  return best;
}

}  // namespace

SizeGrid::Impl::Impl(detail::SizeValues values)
    : painted(std::move(values)), to_index(painted.lattice.A.inverse()) {
  std::vector<BoxRef> refs;
  refs.reserve(painted.cubes.size());
  for (std::size_t i = 0; i < painted.cubes.size(); ++i) {
    const IndexBox box(first_voxel(painted.cubes[i]), painted.cubes[i].side);
    const Vec3 corners[2] = {box.lo, box.hi};
    refs.push_back(BoxRef::around(corners, 2, static_cast<Index>(i)));
  }
  tree = detail::build_box_tree(std::move(refs));
  least = least_of_nodes(tree, painted.cubes);
  shortest = 1.0 / Metric<3>::from_factor(painted.lattice.A).principal().sizes[2];
}

SizeGrid::SizeGrid(std::string name, std::shared_ptr<const Impl> impl)
    : name_(std::move(name)), impl_(std::move(impl)) {}

SizeGrid SizeGrid::read(const std::filesystem::path& path, const std::string& name, double scale) {
  return {name, std::make_shared<const Impl>(detail::load_sizes(path, name, scale))};
}

double SizeGrid::bound(const Vec3& x, double rate, double limit) const {
  const Impl& data = *impl_;
  const Vec3 at = data.to_index * (x - data.painted.lattice.origin);
  const double per_index = rate * data.shortest;
  struct Item {
    double bound;
    std::int32_t node;
  } stack[detail::kTreeStack];
  int depth = 0;
  stack[depth++] = {0.0, data.tree.root};
  double best = limit;
  while (depth > 0) {
    const Item item = stack[--depth];
    if (!(item.bound < best)) continue;
    if (item.node < 0) {
      const int begin = detail::leaf_begin(item.node), count = detail::leaf_count(item.node);
      for (int i = begin; i < begin + count; ++i) {
        const Index cube = data.tree.ids[static_cast<std::size_t>(i)];
        best = bound_in_cube(data.painted, data.painted.cubes[static_cast<std::size_t>(cube)], at, per_index,
                             best);
      }
      continue;
    }
    const BoxNode& node = data.tree.nodes[static_cast<std::size_t>(item.node)];
    double d2[2];
    detail::child_distances(node, at.data(), d2);
    const std::array<float, 2>& least = data.least[static_cast<std::size_t>(item.node)];
    const Item children[2] = {{least[0] + per_index * std::sqrt(d2[0]), node.child[0]},
                              {least[1] + per_index * std::sqrt(d2[1]), node.child[1]}};
    const int near = children[1].bound < children[0].bound ? 1 : 0;
    stack[depth++] = children[1 - near];
    stack[depth++] = children[near];
  }
  return best;
}

std::pair<double, double> SizeGrid::range() const {
  double lo = std::numeric_limits<double>::infinity(), hi = 0.0;
  for (const SizeCube& c : impl_->painted.cubes) {
    lo = std::min(lo, double(c.least));
    if (c.values < 0) hi = std::max(hi, double(c.least));
  }
  for (const float v : impl_->painted.values)
    if (std::isfinite(v)) hi = std::max(hi, double(v));
  return {lo, hi};
}

Box<3> SizeGrid::bounds() const {
  Box<3> box;
  const detail::Lattice& lattice = impl_->painted.lattice;
  const auto add = [&](const IndexBox& b) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 ijk((corner & 4 ? b.hi : b.lo)[0], (corner & 2 ? b.hi : b.lo)[1],
                     (corner & 1 ? b.hi : b.lo)[2]);
      box.extend(lattice.A * ijk + lattice.origin);
    }
  };
  for (const SizeCube& c : impl_->painted.cubes) {
    if (c.values < 0) {
      add(IndexBox(first_voxel(c), c.side));
      continue;
    }
    for (int v = 0; v < 512; ++v)
      if (std::isfinite(impl_->painted.values[static_cast<std::size_t>(c.values + v)]))
        add(IndexBox(first_voxel(c) + Vec3(v >> 6, v >> 3 & 7, v & 7), 1.0));
  }
  return box;
}

}  // namespace lamina
