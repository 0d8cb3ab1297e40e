// D1: level sets of others. D2: level sets written for others. E1, E2: intake of triangles.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/bench/target_bodies.h"
#include "tests/bench/targets.h"
#include "tests/vdb/openvdb_oracle.h"
#include "tests/vdb/stored_metric.h"
#include "vdb/detail/facet_wall.h"
#include "vdb/detail/grid.h"
#include "vdb/detail/intersections.h"
#include "vdb/detail/surface_topology.h"
#include "vdb/surface_io.h"

namespace lamina::targets {
namespace {

using openvdb_oracle::Transform;

double degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

// The torus of make_shape as others would write it, read back.
void read_rows(Table& table, const std::string& name, const Transform& transform, double band,
               double zero_set) {
  const Scratch scratch;
  Box<3> box;
  box.lo = Vec3(-0.62, -0.62, -0.27);
  box.hi = -box.lo;
  openvdb_oracle::write_level_set(scratch.file("torus.vdb"), transform, box, band, torus_distance);
  const LevelSet ls = LevelSet::from_vdb(scratch.file("torus.vdb"), {});
  std::vector<double> off, normal, curvature;
  Dice dice(21);
  for (std::size_t i = 0; i < table.count(40000, 4000); ++i) {
    const double u = dice.uniform(0.0, 2.0 * std::numbers::pi), v = dice.uniform(0.0, 2.0 * std::numbers::pi);
    const double r = kMinor + dice.uniform(-0.02, 0.02), rho = kMajor + r * std::cos(v);
    const WallPoint w = ls.at({rho * std::cos(u), rho * std::sin(u), r * std::sin(v)});
    const Truth truth = torus_truth(w.closest);
    off.push_back(std::abs(torus_distance(w.closest)));
    normal.push_back(degrees_between(w.N, truth.N));
    const auto [low, high] = std::minmax(w.k1, w.k2);
    const auto [true_low, true_high] = std::minmax(truth.k1, truth.k2);
    curvature.push_back(100.0 * kMinor * std::max(std::abs(low - true_low), std::abs(high - true_high)));
  }
  const std::string remark = ls.report().warnings.empty() ? "" : "blurred";
  table.at_most("D1", name + ": zero set, max", quantile(off, 1.0), zero_set, " m", remark);
  table.at_most("D1", name + ": normal, p99", quantile(normal, 0.99), 0.005, " deg", remark);
  table.at_most("D1", name + ": curvature times r, p99", quantile(curvature, 0.99), 0.2, " %", remark);
}

void write_rows(Table& table, const std::string& name, const Surface& s) {
  const Scratch scratch;
  const LevelSet ls = LevelSet::from_surface(s, {});
  ls.write(scratch.file("a.vdb"));
  const std::string found = openvdb_oracle::check_level_set(scratch.file("a.vdb"), "surface", 8);
  table.row("D2", name + ": OpenVDB's checkLevelSet, tests 1 to 8", "passes",
            found.empty() ? "passes" : found.substr(0, found.find('\n')), found.empty());
}

// What is in memory, times the voxel, must be what OpenVDB reads from the file, bit by bit.
void bits_row(Table& table) {
  const Scratch scratch;
  const Surface s = shape("torus");
  const detail::FacetWall wall(s, 0.7);
  const double voxel = 0.01;
  detail::BandGrid grid = detail::BandGrid::from_surface(s, voxel, 6.0, Vec3::Zero());
  grid.polish([&](const Vec3& x, double bound) { return wall.phi_within(x, bound); });
  grid.write(scratch.file("a.vdb"),
             [&](const Vec3& x, double) { return detail::BandGrid::Sample{.wall = wall.at(x)}; }, false, {});
  std::map<std::array<int, 3>, float> memory;
  const detail::SparseGrid values = grid.extract();
  for (const detail::Block& b : values.blocks())
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
          const std::size_t at = detail::Block::offset(i, j, k);
          if (b.is_active(at))
            memory[{b.origin[0] + i, b.origin[1] + j, b.origin[2] + k}] =
                static_cast<float>(b.value[at]) * static_cast<float>(voxel);
        }
  const auto file = openvdb_oracle::active_voxels(scratch.file("a.vdb"), "surface");
  std::size_t differ =
      file.size() > memory.size() ? file.size() - memory.size() : memory.size() - file.size();
  for (const openvdb_oracle::Voxel& v : file) {
    const auto found = memory.find(v.ijk);
    differ += found == memory.end() ||
              std::bit_cast<std::uint32_t>(found->second) != std::bit_cast<std::uint32_t>(v.value);
  }
  table.row("D2", "torus written and read by OpenVDB, bits of active voxels", "all equal",
            fmt::format("{} of {} differ", differ, file.size()), differ == 0);
}

// The metric in double precision against the one read back: its principal sizes.
void log_metric_row(Table& table) {
  const Scratch scratch;
  LevelSetOptions options;
  options.voxel = 0.02;
  const LevelSet wall = LevelSet::from_surface(shape("cube"), options);
  const WallMetric metric = thin_metric(wall);
  wall.write(scratch.file("a.vdb"), &metric);
  double worst = 0.0, aspect = 0.0;
  for (const StoredMetric& stored : stored_metrics(scratch.file("a.vdb"))) {
    const Metric<3> truth = metric.at(stored.x);
    worst = std::max(worst, size_error(stored.metric, truth));
    aspect = std::max(aspect, aspect_ratio(truth));
  }
  table.at_most("D2",
                fmt::format("log M written and read, relative error of sizes, ratios to {:.1e}", aspect),
                worst, 1e-6, "");
}

}  // namespace

void grid_rows(Table& table) {
  const Mat3 turn =
      (Eigen::AngleAxisd(0.4, Vec3::UnitZ()) * Eigen::AngleAxisd(0.7, Vec3::UnitX())).toRotationMatrix();
  const double dx = 0.01;
  read_rows(table, "torus, dx 0.01, band 4", {dx * Mat3::Identity(), Vec3::Zero()}, 4.0 * dx, 2e-7);
  read_rows(table, "torus, dx 0.01, band 6", {dx * Mat3::Identity(), Vec3::Zero()}, 6.0 * dx, 2e-7);
  read_rows(table, "torus, dx 0.01, rotated, band 6", {dx * turn, Vec3(0.003, 0.001, 0.007)}, 6.0 * dx, 1e-5);
  read_rows(table, "torus, dx 0.008 x 0.01 x 0.012",
            {Mat3(Vec3(0.008, 0.01, 0.012).asDiagonal()), Vec3::Zero()}, 0.06, 1e-5);
  write_rows(table, "torus", shape("torus"));
  write_rows(table, "ahmed", shape("ahmed"));
  write_rows(table, "naca", shape("naca0012"));
  bits_row(table);
  log_metric_row(table);
}

namespace {

std::string binary_stl(const Surface& s, const std::string& header) {
  const Scratch scratch;
  write_stl(scratch.file("a.stl"), s);
  std::ifstream in(scratch.file("a.stl"), std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  bytes.replace(0, 80, header + std::string(80 - header.size(), '\0'));
  return bytes;
}

std::string ascii_stl(const Surface& s, const std::string& end, std::size_t solids) {
  std::string text;
  const std::size_t part = (s.triangles.size() + solids - 1) / solids;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    if (t % part == 0) text += (t > 0 ? "endsolid part" + end : "") + "solid part" + end;
    text += "facet normal 0 0 0" + end + "outer loop" + end;
    for (const Index i : s.triangles[t]) {
      const Vec3& p = s.points[static_cast<std::size_t>(i)];
      text += fmt::format("vertex {} {} {}", p[0], p[1], p[2]) + end;
    }
    text += "endloop" + end + "endfacet" + end;
  }
  return text + "endsolid part" + end;
}

std::string upper(std::string s) {
  for (char& c : s) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return s;
}

// The malformed files of the study: a surface, or one line.
void malformed_rows(Table& table) {
  const Surface s = icosphere(5);
  const std::string binary = binary_stl(s, "made by hand"), solid = binary_stl(s, "solid made by hand");
  std::string count = binary, nan = binary, number = ascii_stl(s, "\n", 1);
  count.replace(80, 4, "\xff\xff\xff\xff");
  nan.replace(84 + 50 * 7 + 12, 4, std::string("\0\0\xc0\x7f", 4));
  number.replace(number.find("vertex") + 7, 3, "0.x");
  const std::pair<const char*, std::string> files[] = {
      {"binary, header 'solid'", solid},
      {"binary, cut short", binary.substr(0, binary.size() - 1010)},
      {"binary, header 'solid', cut short", solid.substr(0, solid.size() - 1010)},
      {"binary, trailing bytes", binary + "and more"},
      {"binary, count 0xffffffff", count},
      {"binary, one NaN", nan},
      {"ascii, a bad number", number},
      {"ascii, CRLF", ascii_stl(s, "\r\n", 1)},
      {"ascii, upper case", upper(ascii_stl(s, "\n", 1))},
      {"ascii, three solids", ascii_stl(s, "\n", 3)}};
  const Scratch scratch;
  for (const auto& [name, bytes] : files) {
    std::ofstream(scratch.file("a.stl"), std::ios::binary) << bytes;
    std::string measured;
    bool met = true;
    try {
      std::vector<std::string> warnings;
      Surface read = read_surface(scratch.file("a.stl"), warnings);
      const std::size_t told = warnings.size() + clean(read, "a.stl").warnings.size();
      measured =
          fmt::format("{} of {} triangles, {} warnings", read.triangles.size(), s.triangles.size(), told);
      met = !read.triangles.empty();
    } catch (const Error& e) {
      measured = "an error";
      met = std::string(e.what()).find('\n') == std::string::npos;
    }
    table.row("E1", name, "surface or one line", measured, met);
  }
}

}  // namespace

void reader_rows(Table& table) {
  const ThreadLimit one(1);
  const Scratch scratch;
  const int n = table.quick() ? 71 : 224;
  const Surface made = icosphere(n);
  write_stl(scratch.file("a.stl"), made);
  const double million = 1e6 / static_cast<double>(made.triangles.size());
  std::vector<std::string> warnings;
  const double start = cpu_seconds();
  Surface s = read_surface(scratch.file("a.stl"), warnings);
  detail::weld(s);
  const double read = (cpu_seconds() - start) * million;
  table.row("E1", fmt::format("binary STL of {} facets, read and welded", made.triangles.size()),
            "<= 0.5 s / 1e6", fmt::format("{:.3g} s / 1e6, {} points", read, s.points.size()), read <= 0.5,
            Kind::kTime);
  const double again = cpu_seconds();
  clean(s, "a.stl");
  table.row("E1", "the rest of clean()", "-",
            fmt::format("{:.3g} s / 1e6", (cpu_seconds() - again) * million), true, Kind::kNote);
  const double search = cpu_seconds();
  const std::int64_t crossings = detail::find_intersections(s).pairs;
  const double searched = (cpu_seconds() - search) * million;
  table.row("E2", "search for crossing facets", "<= 2 s / 1e6",
            fmt::format("{:.3g} s / 1e6, {} found", searched, crossings), searched <= 2.0, Kind::kTime);
  malformed_rows(table);
}

}  // namespace lamina::targets
