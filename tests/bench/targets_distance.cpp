// A1 to A4: distances, signs, the grid's values, and queries per second.
#include <fmt/format.h>

#include <cmath>

#include "core/parallel.h"
#include "tests/bench/target_bodies.h"
#include "tests/bench/target_truth.h"
#include "tests/bench/targets.h"
#include "tests/vdb/openvdb_oracle.h"
#include "vdb/detail/facet_wall.h"
#include "vdb/surface_io.h"

namespace lamina::targets {
namespace {

// Of L: distances of voxel centres below this drown in the rounding of their coordinates.
constexpr long double kRounding = 1e-8L;

// Distances do not depend on the grid, so that a coarse one will do.
LevelSet coarse(const Surface& s) {
  LevelSetOptions o;
  o.voxel = s.bounds().size().maxCoeff() / 40.0;
  return LevelSet::from_surface(s, o);
}

struct Named {
  std::string name;
  Surface surface;
};

Surface read_clean(const fs::path& path) {
  std::vector<std::string> ignored;
  return cleaned(read_surface(path, ignored));
}

std::vector<Named> distance_bodies() {
  std::vector<Named> all{{"sphere 20480", icosphere(32)},
                         {"torus 15360", shape("torus", 0.0275)},
                         {"ahmed", shape("ahmed")},
                         {"naca", shape("naca0012")},
                         {"plate 1e-3", box({0, 0, 0}, {1, 0.5, 1e-3})},
                         {"cylinder 2000 slivers", strip_cylinder(1000)},
                         {"lumpy 100820", lumpy(71)}};
  for (const char* name : {"organic/spot.stl", "organic/vase_thinwall.stl"}) {
    const fs::path path = fs::path(LAMINA_DATA) / name;
    if (fs::exists(path))
      all.push_back({name, read_clean(path)});
    else
      Table::skipped("A1", std::string(name) + " is not there");
  }
  return all;
}

}  // namespace

void distance_rows(Table& table) {
  for (const Named& body : distance_bodies()) {
    const BruteDistance brute(body.surface);
    const LevelSet ls = coarse(body.surface);
    const double L = body.surface.bounds().size().maxCoeff();
    WallSampler wall(body.surface, 1);
    Dice dice(2);
    const std::size_t n = table.count(4000, 400);
    double worst = 0.0, worst_near = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const WallSampler::Sample s = wall.next();
      const double side = i % 8 < 4 ? 1.0 : -1.0;
      Vec3 x = s.q + side * 1e-6 * L * s.normal;
      if (i % 4 == 1) x = s.q + side * 1e-3 * L * s.normal;
      if (i % 4 == 2) x = dice.in(body.surface.bounds().padded(0.2 * L));
      if (i % 4 == 3) x = dice.in(body.surface.bounds().padded(10.0 * L));
      const long double truth = brute(x);
      const double off = static_cast<double>(std::abs(std::abs(static_cast<long double>(ls.phi(x))) - truth));
      worst = std::max(worst, off / L);
      if (i % 4 == 0) worst_near = std::max(worst_near, off / static_cast<double>(truth));
    }
    table.at_most("A1", body.name + fmt::format(", {} points: |phi - brute force|", n), worst, 1e-12, " L");
    table.at_most("A1", body.name + ": relative error at phi = 1e-6 L", worst_near, 1e-8, "");
  }
  for (const Named& body : {Named{"sphere 20480", icosphere(32)}, Named{"ahmed", shape("ahmed")},
                            Named{"naca", shape("naca0012")}, Named{"lumpy 100820", lumpy(71)}}) {
    const LevelSet ls = LevelSet::from_surface(body.surface, {});
    const Scratch scratch;
    ls.write(scratch.file("a.vdb"));
    const std::vector<openvdb_oracle::Voxel> voxels =
        openvdb_oracle::active_voxels(scratch.file("a.vdb"), "surface");
    const BruteDistance brute(body.surface);
    const std::size_t step = std::max<std::size_t>(1, voxels.size() / table.count(5000, 500));
    const long double L = body.surface.bounds().size().maxCoeff();
    double worst = 0.0;
    for (std::size_t i = 0; i < voxels.size(); i += step) {
      const long double truth = brute(voxels[i].x);
      const long double off = std::abs(std::abs(static_cast<long double>(voxels[i].value)) - truth);
      worst = std::max(worst, static_cast<double>(off / std::max(truth, kRounding * L)));
    }
    table.at_most("A3", body.name + ": relative error of active voxels in the file", worst, 2e-7, "",
                  fmt::format("polish moved {:.2g} %, by <= {:.2g} voxels",
                              100.0 * static_cast<double>(ls.report().polished_voxels) /
                                  static_cast<double>(ls.report().active_voxels),
                              ls.report().worst_polish_vox));
  }
}

namespace {

struct SignCount {
  std::size_t wrong = 0, all = 0;
  [[nodiscard]] std::string text() const { return fmt::format("{} wrong of {}", wrong, all); }
};

// Half of the points in the box, half within two hundredths of the body's extent of the wall.
SignCount count_signs(const Surface& given, const Surface& truth, std::size_t n) {
  const LevelSet ls = coarse(cleaned(given));
  const RayInside inside(truth);
  WallSampler wall(truth, 4);
  Dice dice(5);
  const Box<3> b = truth.bounds();
  const double L = b.size().maxCoeff();
  SignCount count;
  for (std::size_t i = 0; i < n; ++i) {
    Vec3 x = dice.in(b.padded(0.1 * L));
    if (i % 2 == 1) {
      const WallSampler::Sample s = wall.next();
      x = s.q + L * (i % 4 == 1 ? 0.02 : 1e-5) * dice.uniform(-1.0, 1.0) * s.normal;
    }
    ++count.all;
    count.wrong += (ls.phi(x) < 0.0) != (inside.winding(x) > 0);
  }
  return count;
}

Surface without_cap(Surface s, double diameter) {
  std::erase_if(s.triangles, [&](const auto& t) {
    Vec3 c = Vec3::Zero();
    for (const Index p : t) c += s.points[static_cast<std::size_t>(p)] / 3.0;
    return c[0] > 0.0 && std::hypot(c[1], c[2]) < 0.5 * diameter;
  });
  s.tags.assign(s.triangles.size(), 0);
  return s;
}

Surface half_turned(Surface s) {
  Dice dice(6);
  for (auto& t : s.triangles)
    if (dice.uniform(0.0, 1.0) < 0.5) std::swap(t[1], t[2]);
  return s;
}

}  // namespace

void sign_rows(Table& table) {
  const Surface ball = icosphere(32);
  Surface shifted = ball;
  for (Vec3& p : shifted.points) p += Vec3(0.61, 0.13, 0.07);
  const Surface cavity = joined(ball, turned(scaled(icosphere(20), 0.7)));
  const Surface nested = joined(ball, scaled(icosphere(20), 0.7)), pair = joined(ball, shifted);
  const std::tuple<const char*, Surface, Surface> bodies[] = {
      {"sphere", ball, ball},
      {"torus", shape("torus"), shape("torus")},
      {"ahmed", shape("ahmed"), shape("ahmed")},
      {"naca", shape("naca0012"), shape("naca0012")},
      {"step", shape("step"), shape("step")},
      {"plate of 1e-3 L", box({0, 0, 0}, {1, 0.5, 1e-3}), box({0, 0, 0}, {1, 0.5, 1e-3})},
      {"closed cavity", cavity, cavity},
      {"every facet doubled", joined(ball, ball), ball},
      {"shell inside a shell", nested, nested},
      {"two overlapping spheres", pair, pair},
      {"all facets inverted", turned(ball), ball},
      {"half of the facets flipped", half_turned(ball), ball},
  };
  const std::size_t n = table.count(200000, 10000);
  SignCount sum;
  for (const auto& [name, given, truth] : bodies) {
    const SignCount c = count_signs(given, truth, n);
    sum.wrong += c.wrong;
    sum.all += c.all;
    table.row("A2", fmt::format("sign: {}", name), "0 wrong", c.text(), c.wrong == 0);
  }
  table.row("A2", "sign: all of these", "0 wrong", sum.text(), sum.wrong == 0);
  const SignCount hole = count_signs(without_cap(ball, 0.05), ball, n);
  const double percent = 100.0 * static_cast<double>(hole.wrong) / static_cast<double>(hole.all);
  table.at_most("A2", "sign: sphere with a hole of 5 % of its diameter", percent, 0.05, " %", hole.text());
}

namespace {

// Thousands of calls per CPU second.
template <class Query>
double rate(const std::vector<Vec3>& points, Query&& query) {
  double sum = 0.0;
  const double start = cpu_seconds();
  for (const Vec3& x : points) sum += query(x);
  const double used = cpu_seconds() - start;
  return sum == -1.0 ? 0.0 : 1e-3 * static_cast<double>(points.size()) / std::max(used, 1e-6);
}

void throughput_of(Table& table, const std::string& name, const Surface& s, double least) {
  const LevelSet ls = coarse(s);
  const double L = s.bounds().size().maxCoeff();
  const std::size_t n = table.count(400000, 20000);
  WallSampler wall(s, 7);
  std::vector<Vec3> points(n);
  for (const double height : {1e-5, 1e-3}) {
    for (Vec3& x : points) {
      const WallSampler::Sample at = wall.next();
      x = at.q + height * L * at.normal;
    }
    table.rate("A4", fmt::format("{}: phi at {:g} L from the wall, unsorted", name, height),
               rate(points, [&](const Vec3& x) { return ls.phi(x); }), least);
    std::vector<double> out(n);
    const double start = cpu_seconds();
    ls.sample_phi(points, out);
    table.rate("A4", fmt::format("{}: the same points by sample_phi, which sorts them", name),
               1e-3 * static_cast<double>(n) / std::max(cpu_seconds() - start, 1e-6), least);
  }
  std::vector<Index> all(s.triangles.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Index>(i);
  const detail::TriangleBvh tree(s.points, s.triangles, all);
  points.resize(n / 4);
  Dice dice(8);
  for (const double half_box : {1.0, 5.0, 50.0}) {
    Box<3> box;
    box.lo = Vec3::Constant(-half_box * L);
    box.hi = Vec3::Constant(half_box * L);
    for (Vec3& x : points) x = dice.in(box);
    table.rate("A4", fmt::format("{}: distance within 1 %, half box {:g} L", name, half_box),
               rate(points, [&](const Vec3& x) { return tree.closest(x, INFINITY, 0.01).d2; }), 150.0);
  }
}

}  // namespace

void throughput_rows(Table& table) {
  const ThreadLimit one(1);
  throughput_of(table, "lumpy 100820", lumpy(71), 700.0);
  if (!table.quick()) throughput_of(table, "lumpy 1003520", lumpy(224), 300.0);
  const Surface fan = strip_cylinder(2000);
  const LevelSet ls = coarse(fan);
  std::vector<Vec3> points(table.count(100000, 5000));
  Dice dice(9);
  Box<3> near;
  near.lo = Vec3(-0.01, -0.01, 0.5);
  near.hi = Vec3(0.01, 0.01, 0.51);
  for (Vec3& x : points) x = dice.in(near);
  table.rate("A4", "phi within 0.01 L of the centre of a fan of 2000 slivers",
             rate(points, [&](const Vec3& x) { return ls.phi(x); }), 50.0);
}

}  // namespace lamina::targets
