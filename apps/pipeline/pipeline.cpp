// The main job as a list of steps. Every stage is measured and can be cancelled; outputs are written under
// temporary names and get their own when all of them are complete, so a run that fails or is stopped leaves
// nothing behind.
#include "apps/pipeline/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "apps/pipeline/checkpoint.h"
#include "apps/pipeline/detail/adapted.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/picture.h"
#include "apps/pipeline/plan.h"
#include "apps/pipeline/wall_judge.h"
#include "core/error.h"
#include "core/file.h"
#include "core/memory.h"
#include "core/parallel.h"
#include "core/planar.h"
#include "core/words.h"
#include "mesh/background.h"
#include "mesh/extrude.h"
#include "mesh/io.h"
#include "mesh/solution.h"
#include "vdb/surface_io.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

/// The wall's metric as the family that the optimizer asks for.
template <int D>
class Homotopy : public AdaptMetric<D> {
 public:
  explicit Homotopy(const WallMetric& metric) : metric_(metric) {}
  [[nodiscard]] Metric<D> at(const Vec<D>& x, double size_floor) const override {
    return section<D>(metric_.at_coarsened(in_space<D>(x), std::max(size_floor, 0.0)));
  }
  [[nodiscard]] std::optional<Level<D>> level(const Vec<D>& x, double size_floor) const override {
    const auto level = metric_.level(in_space<D>(x), size_floor);
    return level ? std::optional(section<D>(*level)) : std::nullopt;
  }
  [[nodiscard]] std::optional<double> wall_distance(const Vec<D>& x) const override {
    return metric_.wall().phi(in_space<D>(x));
  }

 private:
  const WallMetric& metric_;
};

/// A metric of the plane in space; along z its largest size.
class InSpace : public MetricField<3> {
 public:
  explicit InSpace(BackgroundMetric<2> metric) : metric_(std::move(metric)) {}
  [[nodiscard]] Metric<3> at(const Vec3& x) const override {
    const Metric<2> m = metric_.at(section<2>(x));
    Mat3 factor = Mat3::Zero();
    factor.topLeftCorner<2, 2>() = m.factor();
    factor(2, 2) = 1.0 / m.principal().sizes[1];
    return Metric<3>::from_factor(factor);
  }

 private:
  BackgroundMetric<2> metric_;
};

fs::path resolved_case_path(const Case& c) {
  fs::path path = c.outputs.front();
  return path.replace_extension(".case.toml");
}

/// Checks names and places of all outputs before the work starts.
void expect_outputs(const Case& c, OutputSet& outputs) {
  const auto expect = [&](const fs::path& path) { outputs.expect(path, c.body); };
  for (const fs::path& path : c.outputs) outputs.expect_mesh(path, c.body);
  if (c.metric_out) {
    require_extension(*c.metric_out, "a metric", {".sol", ".solb"});
    expect(*c.metric_out);
  }
  if (c.levelset_out) {
    require_extension(*c.levelset_out, "a level set", {".vdb"});
    expect(*c.levelset_out);
  }
  if (c.report) expect(*c.report);
  if (c.picture) {
    require_extension(*c.picture, "a picture", {".png", ".svg", ".pdf"});
    expect(*c.picture);
  }
}

/// The resolved case has a name of its own choosing, which must not take the place of the file it was read
/// from.
bool expect_resolved_case(const Case& c, OutputSet& outputs, StageRecorder& stages) {
  if (c.outputs.empty()) return false;
  const fs::path path = resolved_case_path(c);
  std::error_code ec;
  if (!c.source.empty() && fs::equivalent(c.source, path, ec)) {
    stages.warn(fmt::format("{} is the case that was read: it is left as it is", path.string()));
    return false;
  }
  outputs.expect(path, c.body);
  return true;
}

void write_resolved_case(Case c, OutputSet& outputs) {
  c.checkpoint.reset();  // whoever runs it again starts anew
  outputs.write_text(resolved_case_path(c), case_text(c));
}

template <int D>
void add_point_fields(Mesh<D>& mesh, const WallMetric& metric, const std::vector<Metric<D>>& vertex_metric,
                      std::vector<double> wall_distances, std::vector<double> level_offsets) {
  const std::size_t n = mesh.points.size();
  const auto field = [&](const char* name, int components) {
    return MeshField{name, components, std::vector<double>(n * static_cast<std::size_t>(components))};
  };
  MeshField normal = field("N", D), hn = field("hn", 1), ht1 = field("ht1", 1), ht2 = field("ht2", 1);
  for_each_index(
      n,
      [&](std::size_t i) {
        const Vec3 x = in_space<D>(mesh.points[i]);
        const WallPoint wall = metric.wall().at(x);
        const WallSizes s = metric.sizes_at(x, wall);
        for (int k = 0; k < D; ++k) normal.values[D * i + static_cast<std::size_t>(k)] = wall.N[k];
        hn.values[i] = s.hn;
        ht1.values[i] = s.ht1;
        ht2.values[i] = s.ht2;
      },
      256);
  mesh.point_fields = {
      {"phi", 1, std::move(wall_distances)}, std::move(normal), std::move(hn), std::move(ht1)};
  if (D == 3) mesh.point_fields.push_back(std::move(ht2));
  mesh.point_fields.push_back(tensor_field<D>(vertex_metric));
  mesh.point_fields.push_back({"level_offset", 1, std::move(level_offsets)});
}

template <int D>
void add_cell_fields(Mesh<D>& mesh, const WallMetric& metric, const std::vector<Metric<D>>& vertex_metric,
                     const std::vector<double>& wall_distances) {
  mesh.cell_tags.resize(mesh.cells.size());
  for_each_index(
      mesh.cells.size(),
      [&](std::size_t i) {
        Vec<D> center = Vec<D>::Zero();
        for (const Index v : mesh.cells[i]) center += mesh.points[static_cast<std::size_t>(v)] / (D + 1);
        const Vec3 x = in_space<D>(center);
        // The wall distance of a vertex is off by no more than its own distance, which often decides.
        for (const Index v : mesh.cells[i]) {
          const double phi = wall_distances[static_cast<std::size_t>(v)];
          const double off = (mesh.points[static_cast<std::size_t>(v)] - center).norm();
          const Region region = metric.region(x, phi - off);
          if (region != metric.region(x, phi + off)) continue;
          mesh.cell_tags[i] = static_cast<Index>(region);
          return;
        }
        mesh.cell_tags[i] = static_cast<Index>(metric.region(x, metric.wall().phi(x)));
      },
      256);
  mesh.cell_fields = {quality_field<D>(mesh, vertex_metric)};
}

/// What the parts of the run have to say, beyond what the steps themselves put into the report.
void finish_report(Report& report, const Body& body, const OutputSet& outputs, const StageRecorder& stages) {
  report.version = version();
  report.kind = body.kind;
  report.surface = body.surface;
  report.outline = body.outline;
  report.level_set = body.level_set.report();
  report.stages = stages.costs();
  report.threads = report.resolved.c.threads > 0 ? report.resolved.c.threads : hardware_threads();
  report.warnings = stages.warnings();
  report.missed = missed_properties(report.score);
  for (std::string& line : missed_at_wall(report.wall, report.resolved.layer.h_min))
    report.missed.push_back(std::move(line));
  report.files = outputs.targets();
}

/// What the mesh itself tells.
template <int D>
void report_mesh(Report& report, const Mesh<D>& mesh) {
  report.points = static_cast<std::int64_t>(mesh.points.size());
  report.facets = static_cast<std::int64_t>(mesh.facets.size());
  for (const Index tag : mesh.cell_tags) ++report.region_cells[static_cast<std::size_t>(tag)];
  for (const WorstCell& w : report.score.worst)
    report.worst_regions.push_back(static_cast<Region>(mesh.cell_tags[static_cast<std::size_t>(w.cell)]));
  report.mesh_hash = mesh_hash(mesh);
}

/// Errors: kParameter when no mesh could hold so many cells.
void check_count(double cells) {
  constexpr double kMost = std::numeric_limits<Index>::max();
  if (!(cells < kMost))
    throw Error(
        ErrorCode::kParameter,
        fmt::format("about {:.2g} cells would be needed, and a mesh holds at most {:.2g}: raise --hmin, "
                    "--h2 or --h1, or make the domain smaller",
                    cells, kMost));
}

/// What the run goes on from, or nothing. A fresh run gets its folder ready.
std::string open_checkpoints(const Case& c) {
  if (!c.checkpoint) return {};
  if (c.resume) return read_last_checkpoint(*c.checkpoint, case_fingerprint(c));
  begin_checkpoints(*c.checkpoint, c);
  return {};
}

IterationCallback checkpoint_writer(const Case& c) {
  if (!c.checkpoint) return {};
  return [folder = *c.checkpoint, fingerprint = case_fingerprint(c)](const AdaptStep& step, Snapshot state) {
    write_checkpoint(folder, step.number, fingerprint, state());
    return true;
  };
}

template <int D>
void write_picture(const fs::path& path, const Mesh<D>& mesh, const ResolvedCase& r) {
  PictureOptions options;
  options.plane = r.c.picture_plane;
  options.window = r.c.picture_window;
  set_levels(options, r.layer, r.sizes.mirrored_layers);
  draw_slice(path, mesh, options);
}

template <int D>
struct Result {
  const Mesh<D>& mesh;
  const std::vector<Metric<D>>& vertex_metric;
  const WallMetric& metric;
  const Body& body;
  const ResolvedCase& resolved;
};

/// Writes everything but the report, which tells how long this took.
template <int D>
void write_outputs(const Result<D>& made, OutputSet& outputs, StageRecorder& stages) {
  const Case& c = made.resolved.c;
  MeshWriteOptions options;
  options.height = c.extrude;
  for (const fs::path& path : c.outputs) {
    if constexpr (D == 2) {
      if (c.extrude && !mesh_format(path)->prisms)
        write_mesh(outputs.files(), path, extrude(made.mesh, *c.extrude));
      else
        write_mesh(outputs.files(), path, made.mesh, options);
    } else {
      write_mesh(outputs.files(), path, made.mesh, options);
    }
    stages.check_cancelled();
  }
  if (c.metric_out)
    outputs.write(*c.metric_out, [&](const fs::path& p) { write_metric<D>(p, made.vertex_metric); });
  if (c.levelset_out)
    outputs.write(*c.levelset_out,
                  [&](const fs::path& p) { made.body.level_set.write(p, &made.metric, made.body.painted); });
  if (c.picture)
    outputs.write(*c.picture, [&](const fs::path& p) { write_picture(p, made.mesh, made.resolved); });
  stages.check_cancelled();
}

/// Options of one kind of body given with the other are refused: ignoring them would hide a mistake.
void check_kind(const Case& c, BodyKind kind) {
  const auto refuse = [&](bool given, const char* option, const char* why) {
    if (given) throw Error(ErrorCode::kUsage, fmt::format("{}: {} {}", c.body.string(), option, why));
  };
  const LevelSetOptions& o = c.level_set;
  if (kind == BodyKind::kProfile)
    refuse(c.slice.has_value(), "--slice", "is for bodies in space: this is a profile");
  if (kind != BodyKind::kProfile && !c.slice) {
    refuse(c.polyline, "--polyline", "is for profiles: this is a body in space");
    refuse(c.spline, "--spline", "is for profiles: this is a body in space");
  }
  refuse(c.polyline && c.spline, "--polyline", "contradicts --spline: give one of them");
  if (kind == BodyKind::kProfile)
    refuse(o.sheets, "--sheet", "is for surfaces: an open curve of a profile is a sheet");
  if (kind == BodyKind::kVdb) {
    refuse(o.voxel > 0.0, "--voxel", "is for surfaces: a .vdb body keeps its own voxels");
    refuse(o.sheets, "--sheet", "is for surfaces: a level set has no open shells");
  } else {
    refuse(!o.grid.empty(), "--grid", "is for .vdb bodies: a surface has no grids");
    refuse(o.iso.has_value(), "--iso", "is for .vdb bodies: a surface is its own wall");
  }
}

std::vector<Vec3> facet_centers(const Surface& surface) {
  constexpr std::size_t kMost = 200000;
  const std::size_t step = 1 + surface.triangles.size() / kMost;
  std::vector<Vec3> centers;
  for (std::size_t i = 0; i < surface.triangles.size(); i += step) {
    Vec3 sum = Vec3::Zero();
    for (const Index v : surface.triangles[i]) sum += surface.points[static_cast<std::size_t>(v)];
    centers.push_back(sum / 3.0);
  }
  return centers;
}

Body profile_body(const Case& c, Outline outline) {
  if (c.polyline || c.spline)
    for (OutlineCurve& curve : outline.curves) curve.smooth = c.spline;
  OutlineReport report = clean(outline, c.body.string());
  return {.level_set = LevelSet::from_outline(outline, c.level_set, c.body.string()),
          .kind = BodyKind::kProfile,
          .outline = std::move(report)};
}

Body load_surface(const Case& c, double scale, Progress* progress) {
  if (!is_surface_file(c.body))
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: not a body; bodies are .stl, .obj, .ply and .vdb files, profiles .dat, .csv "
                            "and .txt",
                            c.body.string()));
  std::vector<std::string> warnings;
  Surface surface = read_surface(c.body, warnings);
  if (scale != 1.0)
    for (Vec3& x : surface.points) x *= scale;
  Body body = surface_body(c, std::move(surface), c.body.string(), progress);
  body.surface.warnings.insert(body.surface.warnings.begin(), warnings.begin(), warnings.end());
  return body;
}

Body load_profile(const Case& c, double scale) {
  Outline outline = read_outline(c.body);
  for (OutlineCurve& curve : outline.curves)
    for (Vec2& x : curve.points) x *= scale;
  return profile_body(c, std::move(outline));
}

Body load_vdb(const Case& c, double scale, Progress* progress) {
  if (!c.slice)
    return {.level_set = LevelSet::from_vdb(c.body, c.level_set, scale, progress), .kind = BodyKind::kVdb};
  std::vector<std::string> warnings;
  Body body =
      profile_body(c, section_of_vdb(c.body, c.level_set, scale, c.slice->axis, c.slice->offset, warnings));
  body.outline.warnings.insert(body.outline.warnings.begin(), warnings.begin(), warnings.end());
  return body;
}

BodyKind kind_of(const fs::path& path) {
  if (is_outline_file(path)) return BodyKind::kProfile;
  return lower_extension(path) == ".vdb" ? BodyKind::kVdb : BodyKind::kSurface;
}

template <int D>
UserMetric load_metric(const Case& c) {
  BackgroundMetric<D> metric = BackgroundMetric<D>::read(*c.metric, c.gradation);
  const Box<D> b = metric.bounds();
  const double smallest = metric.smallest();
  if constexpr (D == 2) {
    return {std::make_shared<InSpace>(std::move(metric)), endless(b.lo, b.hi), smallest};
  } else {
    return {std::make_shared<BackgroundMetric<3>>(std::move(metric)), b, smallest};
  }
}

// "NAME" is a grid of the body's own file, "FILE.vdb:NAME" one of another.
SizeGrid load_painted(const Case& c, const std::string& which, double scale) {
  constexpr std::string_view kSeparator = ".vdb:";
  const std::size_t at = which.rfind(kSeparator);
  if (at != std::string::npos)
    return SizeGrid::read(which.substr(0, at + kSeparator.size() - 1), which.substr(at + kSeparator.size()),
                          scale);
  if (lower_extension(c.body) != ".vdb")
    throw Error(ErrorCode::kUsage,
                fmt::format("--size-grid {}: {} holds no grids: name the file too, as FILE.vdb:{}", which,
                            c.body.string(), which));
  return SizeGrid::read(c.body, which, scale);
}

}  // namespace

Body load_body(const Case& c, Progress* progress) {
  if (c.body.empty())
    throw Error(ErrorCode::kUsage, "no body is given: name a .stl, .obj, .ply or .vdb file");
  const double scale = unit_scale(c.unit);
  const BodyKind kind = kind_of(c.body);
  { const MappedFile exists(c.body); }  // a missing file or a folder is the better message
  check_kind(c, kind);
  std::vector<SizeGrid> painted;
  for (const std::string& which : c.size_grids) painted.push_back(load_painted(c, which, scale));
  std::optional<UserMetric> user;
  const bool planar = kind == BodyKind::kProfile || c.slice.has_value();
  if (c.metric) user = planar ? load_metric<2>(c) : load_metric<3>(c);
  Body body = kind == BodyKind::kProfile ? load_profile(c, scale)
              : kind == BodyKind::kVdb   ? load_vdb(c, scale, progress)
                                         : load_surface(c, scale, progress);
  body.painted = std::move(painted);
  body.user = std::move(user);
  return body;
}

Body surface_body(const Case& c, Surface surface, const std::string& name, Progress* progress) {
  SurfaceReport report = clean(surface, name);
  if (c.slice) {
    Body body = profile_body(c, slice(surface, c.slice->axis, c.slice->offset, name));
    body.surface = std::move(report);
    return body;
  }
  std::vector<Vec3> centers = facet_centers(surface);
  return {.level_set = LevelSet::from_surface(std::move(surface), c.level_set, progress),
          .kind = BodyKind::kSurface,
          .surface = std::move(report),
          .facet_centers = std::move(centers)};
}

WallMetric wall_metric(const Body& body, const ResolvedCase& r) {
  std::vector<const SizeField*> painted;
  for (const SizeGrid& p : body.painted) painted.push_back(&p);
  return {body.level_set, r.layer, r.sizes, std::move(painted), body.user ? body.user->field.get() : nullptr};
}

double smallest_size(const ResolvedCase& r, const Body& body) {
  double least = r.layer.h_min;
  for (const SizeGrid& p : body.painted) least = std::min(least, p.range().first);
  for (const SizedBox& b : r.sizes.boxes) least = std::min(least, b.size);
  if (body.user) least = std::min(least, body.user->smallest);
  return least;
}

AdaptOptions adapt_options(const ResolvedCase& r, const Body& body) {
  AdaptOptions options;
  options.quality_floor = r.c.quality_floor;
  options.align = r.c.align;
  options.start_size = 2.0 * r.sizes.h1;  // given: a seed may be unit and yet know nothing of a small body
  options.end_size = smallest_size(r, body);
  return options;
}

std::string size_text(const Body& body) {
  if (body.kind != BodyKind::kProfile) return fmt::format("{} voxels", body.level_set.report().active_voxels);
  const OutlineReport& o = body.outline;
  return fmt::format("{} of {}", counted(o.points, "point"),
                     counted(o.closed_curves + o.open_curves, "curve"));
}

template <int D>
std::unique_ptr<const AdaptMetric<D>> metric_family(const WallMetric& metric) {
  return std::make_unique<Homotopy<D>>(metric);
}
template std::unique_ptr<const AdaptMetric<2>> metric_family(const WallMetric&);
template std::unique_ptr<const AdaptMetric<3>> metric_family(const WallMetric&);

void pass_on_warnings(const Body& body, const ResolvedCase* resolved, Progress& progress) {
  static const std::vector<std::string> none;
  for (const auto* list : {&body.surface.warnings, &body.outline.warnings, &body.level_set.report().warnings,
                           resolved != nullptr ? &resolved->warnings : &none})
    for (const std::string& w : *list) progress.warn(w);
}

namespace {

struct Run {
  const Body& body;
  const WallMetric& metric;
  const std::string& snapshot;  // to go on from
  const IterationCallback& after_step;
  OutputSet& outputs;
  StageRecorder& stages;
  Report& report;
};

/// Everything from the seed to the files.
template <int D>
void make_mesh(const Run& run) {
  const ResolvedCase& r = run.report.resolved;
  StageRecorder& stages = run.stages;
  Report& report = run.report;
  const Box<D> domain = section<D>(r.sizes.domain);

  stages.stage("seed");
  Mesh<D> mesh;
  if constexpr (D == 2)
    mesh = r.border ? make_seed(*r.border) : make_seed<D>(domain, r.sizes.h1, r.c.seed);
  else
    mesh = make_seed<D>(domain, r.sizes.h1, r.c.seed);
  stages.done(fmt::format("{} cells", mesh.cells.size()));

  stages.stage("adapt");
  std::vector<Metric<D>> vertex_metric;
  AdaptOptions options = adapt_options(r, run.body);
  options.resume = run.snapshot;
  options.after_step = run.after_step;
  report.adapt = adapt<D>(mesh, Homotopy<D>(run.metric), vertex_metric, options, &stages);
  release_freed_memory();
  stages.done(fmt::format("{} cells, {} points", mesh.cells.size(), mesh.points.size()));

  stages.stage("check");
  report.validation = require_valid<D>(mesh, r.border ? std::nullopt : std::optional(domain));
  report.score = score<D>(mesh, vertex_metric);
  stages.done(fmt::format("valid, {:.1f} % unit edges, worst quality {:.3g}", 100.0 * report.score.unit_share,
                          report.score.quality_min));

  stages.stage("fields");
  const Homotopy<D> wanted(run.metric);
  std::vector<double> phi = wall_distances<D>(mesh, wanted), offsets;
  report.wall = judge_wall<D>(mesh, phi, run.body, run.metric);
  report.levels = score_layers<D>(mesh, vertex_metric, wanted, phi, &offsets);
  add_cell_fields<D>(mesh, run.metric, vertex_metric, phi);
  add_point_fields<D>(mesh, run.metric, vertex_metric, std::move(phi), std::move(offsets));
  stages.done(
      fmt::format("{} point and {} cell fields", mesh.point_fields.size(), mesh.cell_fields.size() + 1));

  stages.stage("write");
  write_outputs<D>({mesh, vertex_metric, run.metric, run.body, r}, run.outputs, stages);
  report_mesh<D>(report, mesh);
}

}  // namespace

Report run_case(const Case& c, Progress* progress) {
  const ThreadLimit limit(c.threads);
  StageRecorder stages(progress);
  OutputSet outputs;
  expect_outputs(c, outputs);
  const bool with_case = expect_resolved_case(c, outputs, stages);
  const std::string snapshot = open_checkpoints(c);

  stages.stage("level set");
  const Body body = load_body(c, &stages);
  Report report;
  report.resolved = resolve_case(c, body);
  const ResolvedCase& r = report.resolved;
  stages.done(fmt::format("{}, {} layers from h_min {:.3g} to {:.3g}", size_text(body), r.layer.layers,
                          r.layer.h_min, r.layer.top()));

  stages.stage("plan");
  report.expected_cells = fit_to_target(report.resolved, body, &stages).cells;
  check_count(report.expected_cells);
  const WallMetric metric = wall_metric(body, r);
  pass_on_warnings(body, &r, stages);
  stages.done(fmt::format("about {:.2g} cells", report.expected_cells));

  const IterationCallback after_step = checkpoint_writer(c);
  const Run run{body, metric, snapshot, after_step, outputs, stages, report};
  if (body.planar()) {
    make_mesh<2>(run);
  } else {
    make_mesh<3>(run);
  }
  if (with_case) write_resolved_case(r.c, outputs);
  stages.done(fmt::format("{} files", outputs.targets().size()));

  finish_report(report, body, outputs, stages);
  if (c.report) outputs.write_text(*c.report, report_json(report));
  stages.check_cancelled();
  outputs.commit();
  return report;
}

}  // namespace lamina
