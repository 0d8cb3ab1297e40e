#include "vdb/level_set.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>

#include "core/parallel.h"
#include "tests/vdb/message_of.h"
#include "tests/vdb/stored_metric.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/surface_io.h"

namespace lamina {
namespace {

using namespace testing_surfaces;
namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::temp_directory_path() / ("lamina_level_set_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  return folder / name;
}

LevelSetOptions coarse() {
  LevelSetOptions o;
  o.voxel = 0.05;
  return o;
}

TEST(LevelSet, ReportOfASphere) {
  const LevelSet ls = LevelSet::from_surface(sphere(0.5, 20), {});
  const LevelSetReport& r = ls.report();
  EXPECT_DOUBLE_EQ(r.voxel, 1.0 / kDefaultVoxelsAcross);
  // 12 voxels across the area of the sphere.
  EXPECT_NEAR(static_cast<double>(r.active_voxels), 12.0 * std::numbers::pi * 200.0 * 200.0, 0.03 * 1.5e6);
  EXPECT_GT(r.grid_bytes, 4.0 * static_cast<double>(r.active_voxels));
  EXPECT_EQ(r.sharp_edges, 0);
  EXPECT_EQ(r.corners, 0);
  EXPECT_EQ(r.sign_rule, "pseudonormal");
  EXPECT_TRUE(r.warnings.empty());
  EXPECT_LT((ls.bounds().size() - Vec3::Ones()).norm(), 1e-12);
  EXPECT_EQ(ls.phi({0.6, 0.01, 0.02}), ls.at({0.6, 0.01, 0.02}).phi);
}

TEST(LevelSet, NoisyTorusIsSmoothedByTheGrid) {
  Surface s = torus(1.0, 0.3, 164, 49);
  Dice dice(3);
  for (Vec3& p : s.points) {  // noise of 2 % of an edge along the normal
    const Vec3 c = Vec3(p[0], p[1], 0.0).normalized();
    double gauss = 0.0;
    for (int i = 0; i < 12; ++i) gauss += dice.uniform(-0.5, 0.5);
    p += 0.02 * 0.04 * gauss * (p - c).normalized();
  }
  const LevelSet ls = LevelSet::from_surface(s, {});
  std::vector<double> off;
  for (std::size_t i = 0; i < s.points.size(); i += 5)
    off.push_back(std::abs(ls.at(s.points[i]).k1 * 0.3 - 1.0));
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 0.04);  // the triangles alone: 0.06
}

TEST(LevelSet, ThreadsDoNotChangeABit) {
  Surface s = joined(torus(1.0, 0.3, 120, 40), box({-0.3, -0.3, -0.5}, {0.3, 1.2, 0.5}, 31));
  Dice noise(8);
  for (Vec3& p : s.points) p += 1e-3 * noise.direction();
  std::vector<double> first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    LevelSetOptions o;
    o.voxel = 0.035;
    const LevelSet ls = LevelSet::from_surface(s, o);
    std::vector<double> all;
    Dice dice(1);
    std::array<WallPoint, 3> out;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x = dice.point(Vec3::Constant(-1.4), Vec3::Constant(1.4));
      const WallPoint w = ls.at(x);
      const int n = ls.others(x, w, 0.3, out);
      all.insert(all.end(), {w.phi, w.N[0], w.N[1], w.T1[2], w.k1, w.k2, w.edge_distance, w.corner_distance,
                             static_cast<double>(n), n > 0 ? out[0].k1 : 0.0});
    }
    if (first.empty()) first = all;
    EXPECT_EQ(std::memcmp(first.data(), all.data(), all.size() * sizeof(double)), 0) << threads;
  }
}

TEST(LevelSet, ScaleDoesNotMatter) {
  // A body of a micrometre and one of a thousand kilometres, far from the origin relative to their size.
  for (const double scale : {1e-6, 1e6}) {
    Surface s = torus(1.0, 0.3, 60, 24);
    for (Vec3& p : s.points) p = scale * (p + Vec3(8.0, 0.0, -4.0));
    const LevelSet ls = LevelSet::from_surface(s, {});
    const WallPoint w = ls.at(scale * Vec3(9.4, 0.0, -4.0));
    EXPECT_NEAR(w.phi / scale, 0.1, 1e-3);
    EXPECT_NEAR(w.k1 * scale * 0.3, 1.0, 0.03);
    EXPECT_GT(ls.report().active_voxels, 100000);
  }
}

TEST(LevelSet, BudgetCoarsensOrRefuses) {
  LevelSetOptions o;
  o.max_memory = 2e7;
  const LevelSet ls = LevelSet::from_surface(sphere(0.5, 10), o);
  EXPECT_GT(ls.report().voxel, 1.0 / kDefaultVoxelsAcross);
  EXPECT_LT(ls.report().grid_bytes, o.max_memory);
  ASSERT_EQ(ls.report().warnings.size(), 1U);
  o.voxel = 1e-4;
  const std::string text =
      message_of(ErrorCode::kLevelSetBudget, [&] { (void)LevelSet::from_surface(sphere(0.5, 10), o); });
  // The remedy it names is right: that voxel is accepted.
  const std::size_t at = text.rfind("fits is ");
  ASSERT_NE(at, std::string::npos) << text;
  o.voxel = std::stod(text.substr(at + 8));
  EXPECT_NO_THROW((void)LevelSet::from_surface(sphere(0.5, 10), o));
}

TEST(LevelSet, BadOptionsAreNamed) {
  const auto with = [](auto&& change) {
    LevelSetOptions o;
    change(o);
    return message_of(ErrorCode::kParameter, [&] { (void)LevelSet::from_surface(sphere(0.5, 4), o); });
  };
  EXPECT_NE(with([](auto& o) { o.voxel = -1.0; }).find("voxel = -1"), std::string::npos);
  EXPECT_NE(with([](auto& o) { o.half_width_vox = 2.0; }).find("half_width_vox"), std::string::npos);
  EXPECT_NE(with([](auto& o) { o.max_memory = 0.0; }).find("max_memory"), std::string::npos);
  EXPECT_NE(with([](auto& o) { o.feature_angle_degrees = 200.0; }).find("feature_angle"), std::string::npos);
  message_of(ErrorCode::kSurfaceEmpty, [] { (void)LevelSet::from_surface({}, {}); });
}

TEST(LevelSet, WriteAndReadBack) {
  const fs::path path = scratch("torus.vdb");
  LevelSetOptions o;
  o.voxel = 0.02;
  const LevelSet ls = LevelSet::from_surface(torus(1.0, 0.3, 200, 60), o);
  ls.write(path);
  const std::vector<VdbGridInfo> info = vdb_info(path);
  ASSERT_EQ(info.size(), 4U);
  for (const VdbGridInfo& g : info) {
    EXPECT_NEAR(g.voxel, 0.02, 1e-15);
    EXPECT_EQ(g.active_voxels, ls.report().active_voxels);
    if (g.name == "surface") {
      EXPECT_EQ(g.grid_class, "level set");
      EXPECT_NEAR(g.background, 0.12, 1e-7);
      EXPECT_GT(g.min, -0.12);
      EXPECT_LT(g.max, 0.12);
      EXPECT_NEAR(g.bounds.hi[0], 1.42, 0.03);
    } else {
      EXPECT_EQ(g.type, "vec3s");
    }
  }
  const LevelSet back = LevelSet::from_vdb(path, {});
  EXPECT_EQ(back.report().warnings.size(), 1U);  // its facets show at this voxel, so curvature is blurred
  Dice dice(2);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = dice.point({-1.6, -1.6, -0.6}, {1.6, 1.6, 0.6});
    const double rho = std::hypot(x[0], x[1]) - 1.0;
    const double truth = std::hypot(rho, x[2]) - 0.3;
    if (truth < -0.2) continue;
    const WallPoint w = back.at(x);
    EXPECT_NEAR(w.phi, truth, 5e-4);
    EXPECT_NEAR(w.k1, 1.0 / 0.3, 0.7);
    EXPECT_EQ(w.phi, back.phi(x));
  }
  // Twice the unit, twice the distance.
  EXPECT_NEAR(LevelSet::from_vdb(path, {}, 2.0).phi({2.8, 0.0, 0.0}), 2.0 * back.phi({1.4, 0.0, 0.0}), 1e-9);
  // Written again from the grid.
  back.write(scratch("again.vdb"));
  EXPECT_NEAR(LevelSet::from_vdb(scratch("again.vdb"), {}).phi({1.4, 0.0, 0.0}), back.phi({1.4, 0.0, 0.0}),
              2e-4);
  fs::remove_all(path.parent_path());
}

// h and the logarithm of the metric, against the metric itself, at aspect ratios of 1e5.
TEST(LevelSet, WritesTheMetric) {
  const fs::path path = scratch("metric.vdb");
  const LevelSet wall = LevelSet::from_surface(box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), coarse());
  const WallMetric metric = thin_metric(wall);
  wall.write(path, &metric);
  const std::vector<StoredMetric> stored = stored_metrics(path);
  ASSERT_EQ(static_cast<std::int64_t>(stored.size()), wall.report().active_voxels);
  double aspect = 0.0;
  for (std::size_t i = 0; i < stored.size(); i += 7) {
    const WallSample truth = metric.sample(stored[i].x);
    const Vec3 along(truth.metric.size_along(truth.wall.N), truth.metric.size_along(truth.wall.T1),
                     truth.metric.size_along(truth.wall.T2));
    EXPECT_LT((stored[i].h.array() / along.array() - 1.0).abs().maxCoeff(), 1e-7);
    EXPECT_LT(size_error(stored[i].metric, truth.metric), 1e-6);
    aspect = std::max(aspect, aspect_ratio(truth.metric));
  }
  EXPECT_GT(aspect, 5e4);
  fs::remove_all(path.parent_path());
}

TEST(LevelSet, SamplesAreThoseOfSinglePoints) {
  const LevelSet wall = LevelSet::from_surface(torus(1.0, 0.3, 60, 20), coarse());
  Dice dice(8);
  std::vector<Vec3> points(20000);
  for (Vec3& x : points) x = dice.point({-2, -2, -1}, {2, 2, 1});
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    std::vector<WallPoint> found(points.size());
    std::vector<double> phi(points.size());
    wall.sample(points, found);
    wall.sample_phi(points, phi);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const WallPoint one = wall.at(points[i]);
      ASSERT_EQ(found[i].phi, one.phi);
      ASSERT_EQ(found[i].closest, one.closest);
      ASSERT_EQ(found[i].T1, one.T1);
      ASSERT_EQ(found[i].k2, one.k2);
      ASSERT_EQ(found[i].reliability, one.reliability);
      ASSERT_EQ(phi[i], one.phi);
    }
  }
  wall.sample({}, {});
  for (const Vec3& x : points) {
    const double exact = std::abs(wall.phi(x)), near = wall.distance(x, 0.01);
    ASSERT_GE(near, exact);
    ASSERT_LE(near, 1.01 * exact);
  }
}

TEST(LevelSet, ReliabilityFallsWhereCurvatureIsPoorlyKnown) {
  const auto of = [](const Surface& s, const Vec3& x) {
    return LevelSet::from_surface(s, coarse()).at(x).reliability;
  };
  EXPECT_GT(of(sphere(0.5, 20), {0.1, 0.2, 0.6}), 0.95);
  const double coarse_sphere = of(sphere(0.5, 2), {0.1, 0.2, 0.6});  // turns by 0.5 per facet
  EXPECT_GT(coarse_sphere, 0.2);
  EXPECT_LT(coarse_sphere, 0.8);
  EXPECT_EQ(of(box({-1, -1, -1}, {1, 1, 1}), {0.1, 0.2, 2.0}), 1.0);
  EXPECT_EQ(of(box({-1, -1, -1}, {1, 1, 1}), {2.0, 2.0, 0.1}), 0.0);  // the ray of an edge
  EXPECT_EQ(of(box({-1, -1, -1}, {1, 1, 1}), {2.0, 2.0, 2.0}), 0.0);  // of a corner
}

TEST(LevelSet, WritesBodiesTooSmallForOpenVdb) {
  const fs::path path = scratch("tiny.vdb"), usual = scratch("usual.vdb");
  LevelSet::from_surface(sphere(0.5, 4), {}).write(usual);
  const LevelSet large = LevelSet::from_vdb(usual, {});
  Surface tiny = sphere(0.5, 4);
  for (Vec3& p : tiny.points) p *= 1e-9;
  const LevelSet ls = LevelSet::from_surface(tiny, {});
  EXPECT_NE(ls.report().warnings.back().find("lamina:scale"), std::string::npos);
  ls.write(path);
  EXPECT_GT(vdb_info(path).front().voxel, 1.4e-5);
  const LevelSet back = LevelSet::from_vdb(path, {});
  for (const double r : {0.3e-9, 0.49e-9, 0.53e-9}) {
    const WallPoint w = back.at({0.0, r, 0.0});
    EXPECT_NEAR(w.phi, ls.phi({0.0, r, 0.0}), 2e-12);
    EXPECT_NEAR(w.k1 * 1e-9, large.at({0.0, 1e9 * r, 0.0}).k1, 1e-3 * std::abs(w.k1 * 1e-9));
  }
  fs::remove_all(path.parent_path());
}

TEST(LevelSet, WriteFailsCleanly) {
  const LevelSet ls = LevelSet::from_surface(sphere(0.5, 4), coarse());
  message_of(ErrorCode::kFileWrite, [&] { ls.write("/nonexistent-folder/x.vdb"); });
}

TEST(LevelSet, BadFiles) {
  message_of(ErrorCode::kFileMissing, [] { (void)LevelSet::from_vdb("/nonexistent.vdb", {}); });
  message_of(ErrorCode::kFileMissing, [] { (void)vdb_info(fs::temp_directory_path()); });
  const fs::path path = scratch("bad.vdb");
  std::ofstream(path) << "this is no grid";
  EXPECT_NE(message_of(ErrorCode::kFileFormat, [&] { (void)LevelSet::from_vdb(path, {}); }).find("truncated"),
            std::string::npos);
  fs::remove_all(path.parent_path());
}

// Every damage gives grids or an error, never a crash: some of these bytes are lengths that OpenVDB trusts.
TEST(LevelSet, DamagedFilesDoNotCrash) {
  const fs::path good = scratch("good.vdb"), bad = scratch("damaged.vdb");
  LevelSetOptions o;
  o.voxel = 0.05;
  LevelSet::from_surface(sphere(0.5, 3), o).write(good);
  std::ifstream in(good, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  ASSERT_GT(bytes.size(), 10000U);
  int refused = 0;
  for (std::size_t i = 0; i < 150; ++i) {
    std::string damaged = bytes;
    const std::size_t at = i < 60 ? 7 * i : (i * 2654435761U) % bytes.size();
    for (std::size_t k = at; k < std::min(at + 4, bytes.size()); ++k)
      damaged[k] = static_cast<char>(~damaged[k]);
    if (i % 10 == 9) damaged.resize(at);
    std::ofstream(bad, std::ios::binary) << damaged;
    try {
      for (const VdbGridInfo& g : vdb_info(bad)) EXPECT_GE(g.active_voxels, 0);
    } catch (const Error& e) {
      ++refused;
      EXPECT_NE(std::string(e.what()).find("damaged.vdb"), std::string::npos);
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(refused, 20);
  fs::remove_all(good.parent_path());
}

class LevelSetData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(LAMINA_DATA))
      GTEST_SKIP() << "NO REAL INPUTS at " << LAMINA_DATA << ": nothing was tested";
  }
  static fs::path file(const std::string& name) { return fs::path(LAMINA_DATA) / name; }
};

TEST_F(LevelSetData, GridsOfOthers) {
  for (const char* name : {"made_sphere_blosc", "made_sphere_half", "made_sphere_uncompressed"}) {
    const LevelSet ls = LevelSet::from_vdb(file("vdb/" + std::string(name) + ".vdb"), {});
    Dice dice(1);
    for (int i = 0; i < 300; ++i) {
      const Vec3 n = dice.direction();
      const WallPoint w = ls.at(0.7 * n);
      EXPECT_NEAR(w.phi, 0.2, 2e-5);
      EXPECT_GT(w.N.dot(n), 0.9999998);
      EXPECT_NEAR(w.k1, 2.0, 0.06);
    }
  }
  LevelSetOptions o;
  o.grid = "second";
  EXPECT_NEAR(LevelSet::from_vdb(file("vdb/made_two_levelsets.vdb"), o).report().voxel, 0.025, 1e-8);
  o.grid = "third";
  EXPECT_NE(message_of(ErrorCode::kLevelSetGrid,
                       [&] { (void)LevelSet::from_vdb(file("vdb/made_two_levelsets.vdb"), o); })
                .find("'second' (float, level set)"),
            std::string::npos);
  o = {};
  o.iso = 0.5;
  EXPECT_NEAR(LevelSet::from_vdb(file("vdb/made_sphere_fog.vdb"), o).phi(Vec3::Zero()), -0.4625, 1e-3);
}

TEST_F(LevelSetData, RefusedWithOneLine) {
  const std::pair<const char*, ErrorCode> cases[] = {
      {"made_sphere_fog", ErrorCode::kLevelSetGrid},     {"made_two_levelsets", ErrorCode::kLevelSetGrid},
      {"made_vec_only", ErrorCode::kLevelSetGrid},       {"arnold_pointgrid", ErrorCode::kLevelSetGrid},
      {"openusd_smoke_empty", ErrorCode::kLevelSetGrid}, {"tinyvdb_sphere-div1", ErrorCode::kLevelSetGrid},
      {"arnold_grids", ErrorCode::kLevelSetGrid},        {"made_truncated", ErrorCode::kFileFormat},
      {"made_bad_magic", ErrorCode::kFileFormat}};
  for (const auto& [name, code] : cases) {
    const fs::path path = file("vdb/" + std::string(name) + ".vdb");
    EXPECT_NE(message_of(code, [&] { (void)LevelSet::from_vdb(path, {}); }).find(path.string()),
              std::string::npos);
  }
}

TEST_F(LevelSetData, EveryRealBody) {
  std::vector<fs::path> files;
  for (const char* folder : {"aero", "organic"})
    for (const auto& entry : fs::directory_iterator(file(folder)))
      if (entry.path().extension() == ".stl") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  EXPECT_GE(files.size(), 10U);
  for (const fs::path& path : files) {
    SCOPED_TRACE(path.filename().string());
    std::vector<std::string> warnings;
    Surface s = read_surface(path, warnings);
    clean(s, path.string());
    LevelSetOptions o;
    o.voxel = s.bounds().size().maxCoeff() / 60.0;
    const LevelSet ls = LevelSet::from_surface(s, o);
    const Box<3> b = ls.bounds();
    Dice dice(6);
    std::array<WallPoint, 4> out;
    for (int i = 0; i < 1500; ++i) {
      const Vec3 x = dice.point(b.padded(0.1 * b.diagonal()).lo, b.padded(0.1 * b.diagonal()).hi);
      const WallPoint w = ls.at(x);
      ASSERT_EQ(w.phi, ls.phi(x));
      ASSERT_NEAR((x - w.closest).norm(), std::abs(w.phi), 1e-12 * b.diagonal());
      Mat3 m;
      m << w.N, w.T1, w.T2;
      ASSERT_LT((m.transpose() * m - Mat3::Identity()).norm(), 1e-9);
      ASSERT_FALSE(std::isnan(w.k1) || std::isnan(w.k2));
      ASSERT_GE(std::abs(w.k1), std::abs(w.k2));
      ASSERT_TRUE(w.feature != WallFeature::kFace || std::isfinite(w.k1));
      const int n = ls.others(x, w, 3.0 * std::abs(w.phi), out);
      for (int k = 0; k < n; ++k)
        ASSERT_GE(std::abs(out[static_cast<std::size_t>(k)].phi), std::abs(w.phi) * (1.0 - 1e-9));
    }
    EXPECT_GT(ls.phi(b.hi + b.size()), 0.0);
  }
}

}  // namespace
}  // namespace lamina
