// Reading grids of others. Everything OpenVDB throws is turned into one line that names the file and the
// remedy. What it does not throw - OpenVDB 10 trusts the lengths in a damaged file and may write past its
// buffers - is met by a first reading in a process of its own.
#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <new>

#include "core/error.h"
#include "vdb/detail/grid.h"
#include "vdb/detail/size_values.h"

namespace lamina {
namespace {

using openvdb::GridBase;

std::string class_name(const GridBase& g) { return GridBase::gridClassToString(g.getGridClass()); }

struct NamedGrid {
  std::string name;
  GridBase::Ptr grid;
};

std::vector<NamedGrid> read_grids(const std::filesystem::path& path) {
  std::vector<NamedGrid> out;
  openvdb::io::File file(path.string());
  file.open(false);  // no delayed loading: it keeps the file mapped and is slower to read
  for (auto it = file.beginName(); it != file.endName(); ++it)
    out.push_back({it.gridName(), file.readGrid(it.gridName())});
  return out;
}

constexpr int kTooLarge = 3;  // exit code of the child

// Virtual memory of this process, bytes.
double virtual_bytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0;
  statm >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

template <class Resource>
void limit(Resource what, double most) {
  const rlimit value{static_cast<rlim_t>(most), static_cast<rlim_t>(most)};
  setrlimit(what, &value);
}

[[noreturn]] void read_and_exit(const std::filesystem::path& path, double file_bytes) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU}) std::signal(signal, SIG_DFL);
  // Far more than any sound file takes: grids of one value compress a thousandfold.
  limit(RLIMIT_CORE, 0.0);
  limit(RLIMIT_CPU, 10.0 + 1e-6 * file_bytes);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory takes terabytes of addresses
  limit(RLIMIT_AS, virtual_bytes() + 1e9 + 1e3 * file_bytes);
#endif
  if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(0);
  try {
    read_grids(path);
  } catch (const std::bad_alloc&) {
    _exit(kTooLarge);
  } catch (...) {  // NOLINT: the parent reads again and tells what was thrown
  }
  _exit(0);
}

// A damaged file ends the child, not the program.
void try_in_child(const std::filesystem::path& path) {
  const double file_bytes = static_cast<double>(std::filesystem::file_size(path));
  const pid_t child = fork();
  if (child < 0) return;  // no process to spare: read at the caller's risk
  if (child == 0) read_and_exit(path, file_bytes);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return;
  const bool too_large = WIFEXITED(status) && WEXITSTATUS(status) == kTooLarge;
  if (WIFSIGNALED(status) || too_large)
    throw Error(ErrorCode::kFileFormat,
                fmt::format("{}: damaged: {}: write or copy it again", path.string(),
                            too_large ? "its content claims more memory than such a file can hold"
                                      : "OpenVDB does not survive reading it"));
}

std::vector<NamedGrid> read_all(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  if (!fs::exists(path)) throw Error(ErrorCode::kFileMissing, path.string() + ": no such file");
  if (!fs::is_regular_file(path))
    throw Error(ErrorCode::kFileMissing, path.string() + ": not a regular file");
  openvdb::initialize();
  try_in_child(path);
  std::vector<NamedGrid> out;
  try {
    out = read_grids(path);
  } catch (const std::exception& e) {
    throw Error(ErrorCode::kFileFormat,
                fmt::format("{}: not readable as OpenVDB ({}): is it truncated or another format?",
                            path.string(), e.what()));
  }
  return out;
}

std::string list_grids(const std::vector<NamedGrid>& grids) {
  std::string out;
  for (const NamedGrid& g : grids)
    out += fmt::format("{}'{}' ({}, {})", out.empty() ? "" : ", ", g.name, g.grid->valueType(),
                       class_name(*g.grid));
  return out.empty() ? "none" : out;
}

// By its name, or by the name with a number that tells grids of one name apart ("density[1]").
const NamedGrid* named(const std::vector<NamedGrid>& grids, const std::string& name) {
  for (const NamedGrid& g : grids)
    if (g.name == name || g.grid->getName() == name) return &g;
  return nullptr;
}

const NamedGrid& choose(const std::vector<NamedGrid>& grids, const std::filesystem::path& path,
                        const LevelSetOptions& options) {
  const auto only = [&](auto&& wanted) -> const NamedGrid* {
    const auto count = std::count_if(grids.begin(), grids.end(), wanted);
    return count == 1 ? &*std::find_if(grids.begin(), grids.end(), wanted) : nullptr;
  };
  const NamedGrid* found = nullptr;
  if (!options.grid.empty()) {
    found = named(grids, options.grid);
  } else if (options.iso) {
    found = only([](const NamedGrid& g) { return g.grid->getGridClass() == openvdb::GRID_FOG_VOLUME; });
    if (found == nullptr) found = named(grids, "density");
    if (found == nullptr && grids.size() == 1) found = grids.data();
  } else {
    found = only([](const NamedGrid& g) { return g.grid->getGridClass() == openvdb::GRID_LEVEL_SET; });
    if (found == nullptr) found = named(grids, "surface");
    if (found == nullptr && grids.size() == 1) found = grids.data();
  }
  if (found != nullptr) return *found;
  throw Error(ErrorCode::kLevelSetGrid,
              fmt::format("{}: {}; it holds {}: name one with --grid", path.string(),
                          options.grid.empty() ? "no single level set to take"
                                               : "no grid named '" + options.grid + "'",
                          list_grids(grids)));
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& name, const std::string& why) {
  throw Error(ErrorCode::kLevelSetGrid, fmt::format("{}: grid '{}' {}", path.string(), name, why));
}

detail::Lattice lattice_of(const openvdb::math::Transform& t, double scale) {
  const auto at = [&](double i, double j, double k) {
    const openvdb::Vec3d w = t.indexToWorld(openvdb::Vec3d(i, j, k));
    return Vec3(w[0], w[1], w[2]);
  };
  detail::Lattice l;
  const Vec3 o = at(0, 0, 0);
  l.A.col(0) = scale * (at(1, 0, 0) - o);
  l.A.col(1) = scale * (at(0, 1, 0) - o);
  l.A.col(2) = scale * (at(0, 0, 1) - o);
  l.origin = scale * o;
  return l;
}

// Values become sign * value + shift, < 0 inside. Neighbours of leaves that are tiles become blocks of one
// value, so that the spline knows the side they are on.
template <class GridT>
detail::SparseGrid extract(const GridT& grid, double sign, double shift) {
  using Leaf = typename GridT::TreeType::LeafNodeType;
  std::vector<const Leaf*> leaves;
  grid.tree().getNodes(leaves);
  std::vector<detail::Block> blocks(leaves.size());
  std::vector<openvdb::Coord> beside;
  const auto accessor = grid.getConstAccessor();
  for (std::size_t b = 0; b < leaves.size(); ++b) {
    const openvdb::Coord o = leaves[b]->origin();
    blocks[b].origin = {o.x(), o.y(), o.z()};
    for (openvdb::Index i = 0; i < 512; ++i) {
      blocks[b].value[i] = sign * static_cast<double>(leaves[b]->getValue(i)) + shift;
      if (leaves[b]->isValueOn(i)) blocks[b].active[i >> 6] |= std::uint64_t{1} << (i & 63);
    }
    for (int n = 0; n < 27; ++n) {
      const openvdb::Coord c = o.offsetBy(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1));
      if (accessor.probeConstLeaf(c) == nullptr) beside.push_back(c);
    }
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  for (const openvdb::Coord& c : beside) {
    detail::Block block;
    block.origin = {c.x(), c.y(), c.z()};
    block.value.fill(sign * static_cast<double>(accessor.getValue(c)) + shift);
    blocks.push_back(block);
  }
  return {std::move(blocks), sign * static_cast<double>(grid.background()) + shift};
}

template <class GridT>
Surface iso_surface(const GridT& grid, double iso, const detail::Lattice& lattice) {
  typename GridT::ConstPtr shared =
      grid.copyReplacingTransform(openvdb::math::Transform::createLinearTransform(1.0));
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*shared, points, triangles, quads, iso, 0.0, true);
  Surface s;
  for (const openvdb::Vec3s& p : points)
    s.points.push_back(lattice.A * Vec3(p[0], p[1], p[2]) + lattice.origin);
  const auto add = [&](openvdb::Index32 i, openvdb::Index32 j, openvdb::Index32 k) {
    const Vec3 &a = s.points[i], &b = s.points[j], &c = s.points[k];
    if ((b - a).cross(c - a).isZero(0.0)) return;
    s.triangles.push_back({static_cast<Index>(i), static_cast<Index>(j), static_cast<Index>(k)});
  };
  for (const openvdb::Vec3I& t : triangles) add(t[0], t[1], t[2]);
  for (const openvdb::Vec4I& q : quads) {
    add(q[0], q[1], q[2]);
    add(q[0], q[2], q[3]);
  }
  double volume = 0.0;
  const Vec3 center = s.bounds().center();
  for (const auto& t : s.triangles) {
    Vec3 p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = s.points[static_cast<std::size_t>(t[k])] - center;
    volume += p[0].dot(p[1].cross(p[2]));
  }
  if (volume < 0.0)
    for (auto& t : s.triangles) std::swap(t[1], t[2]);
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"wall"};
  return s;
}

template <class GridT>
std::pair<double, double> value_range(const GridT& grid) {
  double lo = std::numeric_limits<double>::infinity(), hi = -lo;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const double v = static_cast<double>(*it);
    if (!std::isfinite(v)) return {v, v};
    lo = std::min(lo, v);
    hi = std::max(hi, v);
  }
  return {lo, hi};
}

struct Source {
  const std::filesystem::path& path;
  const std::string& name;
  const LevelSetOptions& options;
};

// The sign and shift that make the values negative inside.
template <class GridT>
std::pair<double, double> orientation(const GridT& grid, const Source& from) {
  const auto [lo, hi] = value_range(grid);
  if (!std::isfinite(lo)) refuse(from.path, from.name, "holds values that are not finite");
  if (lo == hi)
    refuse(from.path, from.name, fmt::format("holds nothing but the value {:g}: there is no wall", lo));
  const bool level_set = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  if (from.options.iso && !level_set) {
    const double iso = *from.options.iso;
    if (!(iso > std::min(lo, double(grid.background())) && iso < hi))
      refuse(from.path, from.name,
             fmt::format("has values in [{:g}, {:g}]: iso value {:g} is outside", lo, hi, iso));
    return {-1.0, iso};
  }
  if (!level_set && (grid.getGridClass() == openvdb::GRID_FOG_VOLUME || !(lo < 0.0)))
    refuse(from.path, from.name,
           fmt::format(
               "is no level set (class {}, values in [{:g}, {:g}]): give the value of its wall with --iso",
               class_name(grid), lo, hi));
  const double iso = from.options.iso.value_or(0.0);
  if (!(lo < iso))
    refuse(from.path, from.name,
           fmt::format("has no value below {:g} (least {:g}): an unsigned distance has no inside, a signed "
                       "one is needed",
                       iso, lo));
  if (!(hi > iso))
    refuse(from.path, from.name, fmt::format("has no value above {:g}: there is no wall", iso));
  return {1.0, -iso};
}

template <class GridT>
detail::LoadedGrid convert(const GridT& grid, const Source& from, double scale) {
  const auto [sign, shift] = orientation(grid, from);
  const double bytes = 30.0 * static_cast<double>(grid.activeVoxelCount());
  if (bytes > from.options.max_memory)
    throw Error(
        ErrorCode::kLevelSetBudget,
        fmt::format(
            "{}: grid '{}' needs about {:.3g} GB, the budget is {:.3g} GB: raise it or resample the grid",
            from.path.string(), from.name, 1e-9 * bytes, 1e-9 * from.options.max_memory));
  detail::LoadedGrid out;
  out.lattice = lattice_of(grid.transform(), scale);
  if (!(std::abs(out.lattice.A.determinant()) > 0.0))
    refuse(from.path, from.name, "has a singular transform");
  typename GridT::Ptr full;
  const GridT* values = &grid;
  if (grid.tree().activeTileCount() > 0) {
    full = grid.deepCopy();
    full->tree().voxelizeActiveTiles();
    values = full.get();
  }
  out.values = extract(*values, sign, shift);
  out.wall = iso_surface(*values, -shift * sign, out.lattice);
  if (out.wall.triangles.empty())
    refuse(from.path, from.name, "has no wall: its values never change sign between voxels");
  const double voxel = std::cbrt(std::abs(out.lattice.A.determinant())) / scale;
  out.half_width_vox = std::clamp(std::round(std::abs(double(grid.background())) / voxel), 3.0, 10.0);
  return out;
}

// World units per stored unit of length, see kScaleMetadata.
double stored_unit(const NamedGrid& g, const std::filesystem::path& path, double scale) {
  const auto stored = g.grid->getMetadata<openvdb::DoubleMetadata>(detail::kScaleMetadata);
  if (!stored) return scale;
  if (!(stored->value() >= 1.0))
    refuse(path, g.name,
           fmt::format("has {} = {:g}: it must be at least 1", detail::kScaleMetadata, stored->value()));
  return scale / stored->value();
}

void require_linear(const NamedGrid& g, const std::filesystem::path& path) {
  if (!g.grid->transform().isLinear())
    refuse(path, g.name, "has a frustum transform: resample it to straight voxels");
}

double valid_size(double value, const openvdb::Coord& c, const openvdb::GridBase& grid,
                  const std::filesystem::path& path, const std::string& name) {
  if (value > 0.0 && value < std::numeric_limits<float>::max()) return value;
  const openvdb::Vec3d w = grid.indexToWorld(c);
  refuse(
      path, name,
      fmt::format("holds {:g} at ({:g}, {:g}, {:g}): a size is a length above 0; deactivate the voxels that "
                  "ask for none",
                  value, w[0], w[1], w[2]));
}

template <class GridT>
detail::SizeValues read_sizes(const GridT& grid, const std::filesystem::path& path, const std::string& name,
                              double scale) {
  detail::SizeValues out;
  out.lattice = lattice_of(grid.transform(), scale);
  if (!(std::abs(out.lattice.A.determinant()) > 0.0)) refuse(path, name, "has a singular transform");
  const auto size = [&](double value, const openvdb::Coord& c) {
    return static_cast<float>(scale * valid_size(value, c, grid, path, name));
  };
  for (auto it = grid.tree().cbeginValueOn(); it; ++it) {
    if (!it.isTileValue()) continue;
    const openvdb::CoordBBox box = it.getBoundingBox();
    const openvdb::Coord& o = box.min();
    out.cubes.push_back({.origin = {o.x(), o.y(), o.z()},
                         .side = box.dim().x(),
                         .least = size(static_cast<double>(it.getValue()), o)});
  }
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    if (leaf->isEmpty()) continue;
    const openvdb::Coord& o = leaf->origin();
    detail::SizeCube cube{.origin = {o.x(), o.y(), o.z()},
                          .values = static_cast<std::int64_t>(out.values.size()),
                          .least = std::numeric_limits<float>::infinity()};
    cube.octants.fill(cube.least);
    out.values.resize(out.values.size() + 512, cube.least);
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      const float value = size(static_cast<double>(it.getValue()), it.getCoord());
      const openvdb::Index i = it.pos();
      out.values[static_cast<std::size_t>(cube.values) + i] = value;
      float& octant = cube.octants[(i >> 8 & 1) << 2 | (i >> 5 & 1) << 1 | (i >> 2 & 1)];
      octant = std::min(octant, value);
      cube.least = std::min(cube.least, value);
    }
    out.cubes.push_back(cube);
  }
  return out;
}

template <class GridT>
void add_range(const GridBase& grid, VdbGridInfo& info) {
  const GridT& g = static_cast<const GridT&>(grid);
  std::tie(info.min, info.max) = value_range(g);
  info.background = static_cast<double>(g.background());
}

}  // namespace

detail::LoadedGrid detail::load_grid(const std::filesystem::path& path, const LevelSetOptions& options,
                                     double scale) {
  const std::vector<NamedGrid> grids = read_all(path);
  if (!grids.empty() && std::all_of(grids.begin(), grids.end(),
                                    [](const NamedGrid& g) { return g.grid->activeVoxelCount() == 0; }))
    throw Error(ErrorCode::kLevelSetGrid, fmt::format("{}: every grid is empty, without an active voxel: {}",
                                                      path.string(), list_grids(grids)));
  const NamedGrid& chosen = choose(grids, path, options);
  const Source from{path, chosen.name, options};
  const GridBase& grid = *chosen.grid;
  const bool is_float = grid.isType<openvdb::FloatGrid>(), is_double = grid.isType<openvdb::DoubleGrid>();
  if (!is_float && !is_double)
    refuse(path, chosen.name,
           fmt::format("holds {} values: a level set of float or double is needed (the file holds {})",
                       grid.valueType(), list_grids(grids)));
  require_linear(chosen, path);
  if (grid.activeVoxelCount() == 0) refuse(path, chosen.name, "is empty: it has no active voxels");
  scale = stored_unit(chosen, path, scale);
  if (is_float) return convert(static_cast<const openvdb::FloatGrid&>(grid), from, scale);
  return convert(static_cast<const openvdb::DoubleGrid&>(grid), from, scale);
}

detail::SizeValues detail::load_sizes(const std::filesystem::path& path, const std::string& name,
                                      double scale) {
  const std::vector<NamedGrid> grids = read_all(path);
  const NamedGrid* found = named(grids, name);
  if (found == nullptr)
    throw Error(ErrorCode::kLevelSetGrid, fmt::format("{}: no size grid named '{}'; it holds {}",
                                                      path.string(), name, list_grids(grids)));
  const GridBase& grid = *found->grid;
  require_linear(*found, path);
  if (grid.activeVoxelCount() == 0) refuse(path, found->name, "is empty: no voxel of it is painted");
  scale = stored_unit(*found, path, scale);
  if (grid.isType<openvdb::FloatGrid>())
    return read_sizes(static_cast<const openvdb::FloatGrid&>(grid), path, found->name, scale);
  if (grid.isType<openvdb::DoubleGrid>())
    return read_sizes(static_cast<const openvdb::DoubleGrid&>(grid), path, found->name, scale);
  refuse(path, found->name, fmt::format("holds {} values: sizes are float or double", grid.valueType()));
}

std::vector<VdbGridInfo> vdb_info(const std::filesystem::path& path) {
  std::vector<VdbGridInfo> out;
  for (const NamedGrid& g : read_all(path)) {
    VdbGridInfo info;
    info.name = g.name;
    info.type = g.grid->valueType();
    info.grid_class = class_name(*g.grid);
    info.transform = g.grid->transform().mapType();
    info.voxel = g.grid->voxelSize()[0];
    info.active_voxels = static_cast<std::int64_t>(g.grid->activeVoxelCount());
    if (g.grid->isType<openvdb::FloatGrid>() && info.active_voxels > 0)
      add_range<openvdb::FloatGrid>(*g.grid, info);
    else if (g.grid->isType<openvdb::DoubleGrid>() && info.active_voxels > 0)
      add_range<openvdb::DoubleGrid>(*g.grid, info);
    const openvdb::CoordBBox box = g.grid->evalActiveVoxelBoundingBox();
    if (info.active_voxels > 0) {
      for (int c = 0; c < 8; ++c) {
        const openvdb::Vec3d w = g.grid->indexToWorld(openvdb::Vec3d(c & 1 ? box.max().x() : box.min().x(),
                                                                     c & 2 ? box.max().y() : box.min().y(),
                                                                     c & 4 ? box.max().z() : box.min().z()));
        info.bounds.extend({w[0], w[1], w[2]});
      }
    }
    out.push_back(std::move(info));
  }
  return out;
}

}  // namespace lamina
