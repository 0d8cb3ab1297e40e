// Two kinds of wall behind one class: facets (exact distances by a tree over the triangles, the grid for
// curvature and exchange) and spline (the grid is the geometry).
#include "vdb/level_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/hilbert.h"
#include "core/parallel.h"
#include "vdb/detail/facet_wall.h"
#include "vdb/detail/grid.h"
#include "vdb/detail/outline_wall.h"
#include "vdb/detail/spline_wall.h"
#include "vdb/detail/stencil_curvature.h"

namespace lamina {

struct LevelSet::Impl {
  std::unique_ptr<WallField> wall;
  detail::BandGrid grid;  ///< empty for an outline
  double half_width_vox = 0.0;
  LevelSetReport report;
};

namespace {

constexpr double kLargestSide = 1e6;  // voxels; OpenVDB's coordinates are 32 bit

void check_options(const LevelSetOptions& o) {
  const auto check = [](bool good, const char* name, double value, const char* range) {
    if (!good)
      throw Error(ErrorCode::kParameter,
                  fmt::format("level set: {} = {:g} is not in {}", name, value, range));
  };
  check(std::isfinite(o.voxel) && o.voxel >= 0.0, "voxel", o.voxel, "[0, inf)");
  check(o.half_width_vox >= 3.0 && o.half_width_vox <= 100.0, "half_width_vox", o.half_width_vox, "[3, 100]");
  check(o.max_memory > 0.0, "max_memory", o.max_memory, "(0, inf)");
  check(o.feature_angle_degrees > 0.0 && o.feature_angle_degrees <= 180.0, "feature_angle_degrees",
        o.feature_angle_degrees, "(0, 180]");
}

detail::LoadedGrid load_checked(const std::filesystem::path& path, const LevelSetOptions& options,
                                double scale) {
  check_options(options);
  if (!(scale > 0.0) || !std::isfinite(scale))
    throw Error(ErrorCode::kParameter, fmt::format("level set: scale = {:g} is not in (0, inf)", scale));
  return detail::load_grid(path, options, scale);
}

double area_of(const detail::Topology& topology) {
  double area = 0.0;
  for (const double a : topology.areas) area += a;
  return area;
}

// The voxel asked for, or the default, coarsened to the budget, for a wall of some area and longest extent.
double choose_voxel(double area, double longest, const LevelSetOptions& o,
                    std::vector<std::string>& warnings) {
  const double smallest =
      std::max(detail::band_voxel(area, o.max_memory, o.half_width_vox), longest / kLargestSide);
  if (o.voxel > 0.0) {
    if (o.voxel < smallest)
      throw Error(
          ErrorCode::kLevelSetBudget,
          fmt::format(
              "level set: voxel {:g} needs about {:.3g} GB, the budget is {:.3g} GB: the smallest voxel "
              "that fits is {:.4g}",
              o.voxel, 1e-9 * detail::band_bytes(area, o.voxel, o.half_width_vox), 1e-9 * o.max_memory,
              1.001 * smallest));
    return o.voxel;
  }
  const double wanted = longest / kDefaultVoxelsAcross;
  if (wanted >= smallest) return wanted;
  warnings.push_back(
      fmt::format("voxel {:.4g} instead of {:.4g}: the budget of {:.3g} GB allows no finer grid",
                  1.001 * smallest, wanted, 1e-9 * o.max_memory));
  return 1.001 * smallest;
}

constexpr double kSlab = 3.0;  // voxels to either side of z = 0 that the grid of an outline covers

// The grid of an outline, for the part of space next to z = 0.
detail::BandGrid outline_grid(const detail::OutlineWall& wall, double voxel, double half_width_vox) {
  Surface s;
  const double z = (kSlab + 0.5) * voxel;
  for (const std::vector<Vec2>& line : wall.polylines()) {
    const auto first = static_cast<Index>(s.points.size());
    for (const Vec2& x : line)
      for (const double side : {-z, z}) s.points.emplace_back(x[0], x[1], side);
    for (Index i = first; i + 3 < static_cast<Index>(s.points.size()); i += 2) {
      s.triangles.push_back({i, i + 2, i + 3});
      s.triangles.push_back({i, i + 3, i + 1});
    }
  }
  const Vec3 origin = (wall.bounds().center() / voxel).array().round() * voxel;
  detail::BandGrid grid = detail::BandGrid::from_surface(s, voxel, half_width_vox, origin);
  grid.polish([&](const Vec3& x, double) { return wall.phi(x); });
  return grid;
}

// Calls visit(i) for every point, in parallel, along a Hilbert curve.
template <class Visit>
void visit_sorted(std::span<const Vec3> points, Visit&& visit) {
  Box<3> box;
  for (const Vec3& x : points)
    if (x.allFinite()) box.extend(x);
  std::vector<std::uint64_t> keys(points.size());
  for_each_index(keys.size(), [&](std::size_t i) {
    keys[i] = points[i].allFinite() ? hilbert_key<3>(points[i], box) : 0;
  });
  const std::vector<std::int32_t> order = sorted_order(keys);
  for_each_index(
      order.size(), [&](std::size_t i) { visit(static_cast<std::size_t>(order[i])); }, 256);
}

void check_names(const std::filesystem::path& path, std::span<const SizeGrid> painted) {
  std::vector<std::string> taken = {"surface", "N", "T1", "k", "h", "logM_diag", "logM_off"};
  for (const SizeGrid& p : painted) {
    if (std::find(taken.begin(), taken.end(), p.name()) != taken.end())
      throw Error(
          ErrorCode::kLevelSetGrid,
          fmt::format("{}: would hold two grids named '{}': rename the size grid", path.string(), p.name()));
    taken.push_back(p.name());
  }
}

}  // namespace

LevelSet::LevelSet(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LevelSet::LevelSet(LevelSet&&) noexcept = default;
LevelSet& LevelSet::operator=(LevelSet&&) noexcept = default;
LevelSet::~LevelSet() = default;

WallPoint LevelSet::at(const Vec3& x) const { return impl_->wall->at(x); }
WallPoint LevelSet::at_side(const Vec3& x, double sign) const { return impl_->wall->at_side(x, sign); }
double LevelSet::phi(const Vec3& x) const { return impl_->wall->phi(x); }
double LevelSet::distance(const Vec3& x, double eps) const { return impl_->wall->distance(x, eps); }
int LevelSet::others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const {
  return impl_->wall->others(x, nearest, reach, out);
}
int LevelSet::edges_beside(const WallPoint& wall, double reach, std::span<WallEdge> out) const {
  return impl_->wall->edges_beside(wall, reach, out);
}
int LevelSet::bends_beside(const WallPoint& wall, double reach, std::span<WallBend> out) const {
  return impl_->wall->bends_beside(wall, reach, out);
}
std::array<double, 2> LevelSet::graded_curvatures(const WallPoint& wall, double root) const {
  return impl_->wall->graded_curvatures(wall, root);
}
Box<3> LevelSet::bounds() const { return impl_->wall->bounds(); }
const LevelSetReport& LevelSet::report() const { return impl_->report; }

LevelSet LevelSet::from_surface(Surface surface, const LevelSetOptions& options, Progress* progress) {
  check_options(options);
  if (surface.triangles.empty())
    throw Error(ErrorCode::kSurfaceEmpty, "level set: the surface has no triangles");
  auto impl = std::make_unique<Impl>();
  LevelSetReport& report = impl->report;
  auto wall = std::make_unique<detail::FacetWall>(
      std::move(surface), options.feature_angle_degrees * std::numbers::pi / 180.0, options.sheets);
  report.sharp_edges = wall->topology().sharp_edges;
  report.corners = wall->topology().corners;
  report.sign_rule = wall->sign_rule().name();
  report.warnings = wall->sign_rule().warnings();
  const double area = area_of(wall->topology());
  report.voxel = choose_voxel(area, wall->bounds().size().maxCoeff(), options, report.warnings);
  if (progress != nullptr) {
    progress->check_cancelled();
    const double bytes = detail::band_bytes(area, report.voxel, options.half_width_vox);
    progress->update(0.0, fmt::format("voxel {:.3g}, about {:.2g} GB", report.voxel, 1e-9 * bytes));
  }
  const Vec3 origin = (wall->bounds().center() / report.voxel).array().round() * report.voxel;
  impl->grid = detail::BandGrid::from_surface(wall->surface(), report.voxel, options.half_width_vox, origin);
  const detail::BandGrid::Polish polish =
      impl->grid.polish([&](const Vec3& x, double bound) { return wall->phi_within(x, bound); });
  report.polished_voxels = polish.changed;
  report.worst_polish_vox = polish.worst;
  report.active_voxels = impl->grid.active_voxels();
  report.grid_bytes = impl->grid.bytes();
  if (detail::stored_scale(report.voxel) != 1.0)
    report.warnings.push_back(fmt::format(
        "voxels of {:.3g} are too small for OpenVDB: a .vdb is written {:g} times larger, which its "
        "metadata {} says",
        report.voxel, detail::stored_scale(report.voxel), detail::kScaleMetadata));
  if (progress != nullptr) progress->check_cancelled();
  detail::refine_by_stencils(*wall, impl->grid, options.half_width_vox, progress);
  wall->find_falls();
  impl->wall = std::move(wall);
  return LevelSet(std::move(impl));
}

LevelSet LevelSet::from_outline(const Outline& outline, const LevelSetOptions& options,
                                const std::string& name) {
  check_options(options);
  auto impl = std::make_unique<Impl>();
  LevelSetReport& report = impl->report;
  std::vector<detail::Path> paths =
      detail::make_paths(outline, options.feature_angle_degrees * std::numbers::pi / 180.0);
  detail::require_apart(paths, name);
  auto wall = std::make_unique<detail::OutlineWall>(std::move(paths));
  const double longest = wall->bounds().size().maxCoeff();
  const double height = 2.0 * kSlab * (options.voxel > 0.0 ? options.voxel : longest / kDefaultVoxelsAcross);
  report.voxel = choose_voxel(wall->length() * height, longest, options, report.warnings);
  report.sharp_edges = wall->corners();
  report.sign_rule = "pseudonormal";
  impl->half_width_vox = options.half_width_vox;
  impl->wall = std::move(wall);
  return LevelSet(std::move(impl));
}

LevelSet LevelSet::from_vdb(const std::filesystem::path& path, const LevelSetOptions& options, double scale,
                            Progress* progress) {
  auto impl = std::make_unique<Impl>();
  detail::LoadedGrid loaded = load_checked(path, options, scale);
  if (progress != nullptr) progress->check_cancelled();
  const double half_width = loaded.half_width_vox;
  auto wall = std::make_unique<detail::SplineWall>(std::move(loaded));
  impl->grid = detail::BandGrid::like(wall->values(), wall->lattice(), wall->voxel(), half_width);
  LevelSetReport& report = impl->report;
  report.voxel = wall->voxel();
  report.active_voxels = impl->grid.active_voxels();
  report.grid_bytes = impl->grid.bytes();
  report.sign_rule = "grid";
  if (wall->blur() > 0.0)
    report.warnings.push_back(fmt::format(
        "the grid's second derivatives are rough (made from facets, or noisy): normals and curvatures are "
        "taken from values blurred over {:.2g} voxels",
        wall->blur()));
  impl->wall = std::move(wall);
  return LevelSet(std::move(impl));
}

Outline section_of_vdb(const std::filesystem::path& path, const LevelSetOptions& options, double scale,
                       int axis, double offset, std::vector<std::string>& warnings) {
  return detail::SplineWall(load_checked(path, options, scale))
      .section(axis, offset, path.string(), warnings);
}

void LevelSet::sample(std::span<const Vec3> points, std::span<WallPoint> out) const {
  visit_sorted(points, [&](std::size_t i) { out[i] = at(points[i]); });
}

void LevelSet::sample_phi(std::span<const Vec3> points, std::span<double> out) const {
  visit_sorted(points, [&](std::size_t i) { out[i] = phi(points[i]); });
}

void LevelSet::write(const std::filesystem::path& path, const WallMetric* metric,
                     std::span<const SizeGrid> painted) const {
  check_names(path, painted);
  const auto* facets = dynamic_cast<const detail::FacetWall*>(impl_->wall.get());
  // The sign took a winding number where shells cross: it is not asked for again.
  const auto at = [&](const Vec3& x, double phi) -> detail::BandGrid::Sample {
    if (metric == nullptr) return {.wall = facets ? facets->at_known(x, phi) : impl_->wall->at(x)};
    const WallSample s = metric->sample(x);
    const Metric<3>& m = s.metric;
    return {.wall = s.wall,
            .h = {m.size_along(s.wall.N), m.size_along(s.wall.T1), m.size_along(s.wall.T2)},
            .log_metric = m.log()};
  };
  if (facets != nullptr) {
    impl_->grid.write(path, at, metric != nullptr, painted);
    return;
  }
  if (const auto* outline = dynamic_cast<const detail::OutlineWall*>(impl_->wall.get())) {
    outline_grid(*outline, impl_->report.voxel, impl_->half_width_vox)
        .write(path, at, metric != nullptr, painted);
    return;
  }
  // The values read need not be distances: those written are.
  detail::BandGrid grid = impl_->grid.copy();
  grid.polish([&](const Vec3& x, double) { return impl_->wall->phi(x); });
  grid.write(path, at, metric != nullptr, painted);
}

}  // namespace lamina
