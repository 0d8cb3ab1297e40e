#include "vdb/detail/spline_wall.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "tests/vdb/message_of.h"
#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

// A narrow band of values f(world) on the lattice, and the torus as start surface.
LoadedGrid sample(const std::function<double(const Vec3&)>& f, const Lattice& lattice, double band,
                  const Surface& wall, double value_scale = 1.0) {
  const Mat3 inverse = lattice.A.inverse();
  Box<3> box;
  const Box<3> w = wall.bounds().padded(2.0 * band);
  for (int c = 0; c < 8; ++c)
    box.extend(inverse *
               (Vec3(c & 1 ? w.hi[0] : w.lo[0], c & 2 ? w.hi[1] : w.lo[1], c & 4 ? w.hi[2] : w.lo[2]) -
                lattice.origin));
  std::vector<Block> blocks;
  const auto first = [&](int a) { return static_cast<Index>(std::floor(box.lo[a])) & ~7; };
  for (Index i = first(0); i < box.hi[0]; i += 8)
    for (Index j = first(1); j < box.hi[1]; j += 8)
      for (Index k = first(2); k < box.hi[2]; k += 8) {
        Block b;
        b.origin = {i, j, k};
        bool any = false;
        for (int v = 0; v < 512; ++v) {
          const double value =
              f(lattice.A * Vec3(i + (v >> 6), j + (v >> 3 & 7), k + (v & 7)) + lattice.origin);
          b.value[static_cast<std::size_t>(v)] =
              value_scale * static_cast<float>(std::clamp(value, -band, band));
          if (std::abs(value) < band) {
            b.active[static_cast<std::size_t>(v) >> 6] |= std::uint64_t{1} << (v & 63);
            any = true;
          }
        }
        if (any) blocks.push_back(b);
      }
  LoadedGrid out;
  out.values = SparseGrid(std::move(blocks), value_scale * band);
  out.lattice = lattice;
  out.wall = wall;
  return out;
}

double torus_distance(const Vec3& x) { return std::hypot(std::hypot(x[0], x[1]) - 0.5, x[2]) - 0.15; }

TEST(SparseGrid, SplineReproducesCubics) {
  const auto f = [](const Vec3& x) { return 0.5 + x[0] - 2.0 * x[1] * x[2] + 0.3 * x[0] * x[0] * x[1]; };
  std::vector<Block> blocks;
  for (Index i = -16; i < 16; i += 8)
    for (Index j = -16; j < 16; j += 8)
      for (Index k = -16; k < 16; k += 8) {
        Block b;
        b.origin = {i, j, k};
        b.active.fill(~std::uint64_t{0});
        for (int v = 0; v < 512; ++v)
          b.value[static_cast<std::size_t>(v)] = f(Vec3(i + (v >> 6), j + (v >> 3 & 7), k + (v & 7)));
        blocks.push_back(b);
      }
  SparseGrid grid(blocks, 99.0);
  grid.prefilter(40);
  Dice dice(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3 x = dice.point(Vec3::Constant(-3.0), Vec3::Constant(3.0));
    const SplineSample s = grid.spline(x);
    EXPECT_TRUE(s.active);
    EXPECT_NEAR(s.f, f(x), 1e-3);
    EXPECT_LT((s.g - Vec3(1.0 + 0.6 * x[0] * x[1], -2.0 * x[2] + 0.3 * x[0] * x[0], -2.0 * x[1])).norm(),
              1e-3);
    EXPECT_NEAR(s.H(0, 1), 0.6 * x[0], 2e-3);
    EXPECT_NEAR(s.H(1, 2), -2.0, 2e-3);
    EXPECT_EQ(s.H(1, 2), s.H(2, 1));
  }
  EXPECT_FALSE(grid.spline(Vec3(14.5, 0, 0)).active);  // reaches past the blocks
  EXPECT_EQ(grid.spline(Vec3(1e6, 0, 0)).f, 99.0);
  EXPECT_EQ(grid.spline(Vec3::Constant(std::nan(""))).f, 99.0);
}

TEST(SparseGrid, GradientAndHessianMatchDifferences) {
  std::vector<Block> blocks(1);
  blocks[0].active.fill(~std::uint64_t{0});
  Dice dice(5);
  for (double& v : blocks[0].value) v = dice.uniform(-1.0, 1.0);
  const SparseGrid grid(blocks, 0.0);
  const double h = 1e-5;
  for (int i = 0; i < 50; ++i) {
    const Vec3 x = dice.point(Vec3::Constant(1.1), Vec3::Constant(5.9));
    const SplineSample s = grid.spline(x);
    for (int a = 0; a < 3; ++a) {
      const Vec3 e = h * Vec3::Unit(a);
      EXPECT_NEAR(s.g[a], (grid.spline(x + e).f - grid.spline(x - e).f) / (2 * h), 1e-8);
      EXPECT_LT((s.H.col(a) - (grid.spline(x + e).g - grid.spline(x - e).g) / (2 * h)).norm(), 1e-4);
    }
  }
}

struct Errors {
  double wall = 0.0, normal = 0.0, curvature = 0.0, distance = 0.0;
};

Errors measure(const SplineWall& wall) {
  Errors e;
  Dice dice(7);
  for (int i = 0; i < 400; ++i) {
    const double u = dice.uniform(0, 6.28), v = dice.uniform(0, 6.28), d = dice.uniform(-0.02, 0.3);
    const Vec3 out(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v));
    const Vec3 q = 0.5 * Vec3(std::cos(u), std::sin(u), 0.0) + 0.15 * out;
    const Vec3 x = q + d * out;
    if (std::hypot(x[0], x[1]) < 0.25) continue;  // near the axis the closest point is far from unique
    const WallPoint w = wall.at(x);
    e.wall = std::max(e.wall, std::abs(torus_distance(w.closest)));
    e.distance = std::max(e.distance, std::abs(w.phi - d));
    e.normal = std::max(e.normal, w.N.cross(out).norm());
    const double k2 = std::cos(v) / (0.5 + 0.15 * std::cos(v));
    e.curvature = std::max(e.curvature, 0.15 * std::max(std::abs(w.k1 - 1.0 / 0.15), std::abs(w.k2 - k2)));
  }
  return e;
}

TEST(SplineWall, TorusIsExactToAFractionOfAVoxel) {
  const Surface start = torus(0.5, 0.15, 100, 40);
  Lattice plain;
  plain.A = 0.01 * Mat3::Identity();
  plain.origin = {0.003, -0.001, 0.002};
  const Errors e = measure(SplineWall(sample(torus_distance, plain, 0.06, start)));
  EXPECT_LT(e.wall, 2e-7);
  EXPECT_LT(e.distance, 2e-7);
  EXPECT_LT(e.normal, 1e-4);
  EXPECT_LT(e.curvature, 0.004);
}

TEST(SplineWall, AnyAffineTransformAndAnyUnitOfValues) {
  const Surface start = torus(0.5, 0.15, 100, 40);
  Lattice skew;
  skew.A = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix() *
           Vec3(0.01, 0.008, 0.012).asDiagonal();
  skew.A(0, 1) += 0.002;
  const SplineWall wall(sample(torus_distance, skew, 0.045, start, 37.0));
  const Errors e = measure(wall);
  EXPECT_LT(e.wall, 1e-6);
  EXPECT_LT(e.distance, 1e-6);
  EXPECT_LT(e.normal, 2e-4);
  EXPECT_LT(e.curvature, 0.01);
  EXPECT_NEAR(wall.voxel(), std::cbrt(skew.A.determinant()), 1e-15);
}

TEST(SplineWall, OtherWallsInAGap) {
  const Vec3 left(-0.5, 0.0, 0.0), right(0.45, 0.0, 0.0);
  const auto f = [&](const Vec3& x) { return std::min((x - left).norm() - 0.3, (x - right).norm() - 0.2); };
  Lattice plain;
  plain.A = 0.02 * Mat3::Identity();
  const SplineWall wall(sample(f, plain, 0.08, joined(sphere(0.3, 12, left), sphere(0.2, 8, right))));
  std::array<WallPoint, 4> out;
  const Vec3 x(0.0, 0.05, 0.0);
  const double near = (x - left).norm() - 0.3, far = (x - right).norm() - 0.2;
  const WallPoint w = wall.at(x);
  EXPECT_NEAR(w.phi, near, 1e-5);
  ASSERT_EQ(wall.others(x, w, 0.4, out), 1);
  EXPECT_NEAR(out[0].phi, far, 1e-5);
  EXPECT_NEAR(out[0].k1, 5.0, 0.1);
  EXPECT_EQ(wall.others(x, w, far - 0.01, out), 0);
}

TEST(SplineWall, BlurIsForRoughGridsOnly) {
  Lattice plain;
  plain.A = 0.01 * Mat3::Identity();
  const Surface start = torus(0.5, 0.15, 100, 40);
  EXPECT_EQ(SplineWall(sample(torus_distance, plain, 0.04, start)).blur(), 0.0);
  Dice dice(2);
  const auto rough = [&](const Vec3& x) { return torus_distance(x) + dice.uniform(-3e-4, 3e-4); };
  const SplineWall wall(sample(rough, plain, 0.04, start));
  EXPECT_GT(wall.blur(), 1.0);
  std::vector<double> off;
  for (const Vec3& p : start.points) off.push_back(std::abs(wall.at(p).k1 * 0.15 - 1.0));
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
  EXPECT_LT(off[off.size() / 2], 0.15);  // unblurred: above 1
}

// The torus cut at z = 0.05: circles of radii 0.5 +- sqrt(0.15^2 - 0.05^2).
constexpr double kTube = 0.02;  // 0.15^2 - 0.05^2

TEST(SplineSection, IsTheCurveItselfUnderAnyTransform) {
  const Surface start = torus(0.5, 0.15, 100, 40);
  Lattice skew;
  skew.A = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix() *
           Vec3(0.01, 0.008, 0.012).asDiagonal();
  const SplineWall wall(sample(torus_distance, skew, 0.045, start, 37.0));
  std::vector<std::string> warnings;
  const Outline cut = wall.section(2, 0.05, "f", warnings);
  ASSERT_EQ(cut.curves.size(), 2u);
  EXPECT_TRUE(warnings.empty());
  for (const OutlineCurve& curve : cut.curves) {
    EXPECT_TRUE(curve.closed && curve.smooth && curve.curvature.empty());
    const double radius = 0.5 + std::copysign(std::sqrt(kTube), curve.points[0].norm() - 0.5);
    const std::size_t n = curve.points.size();
    const double step = 2.0 * std::numbers::pi * radius / static_cast<double>(n);
    EXPECT_NEAR(step, 0.5 * wall.voxel(), 0.01 * wall.voxel());
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(curve.points[i].norm(), radius, 1e-6);
      EXPECT_NEAR((curve.points[(i + 1) % n] - curve.points[i]).norm(), step, 0.2 * step);
    }
  }
}

TEST(SplineSection, AxesKeepTheirOrder) {
  const Vec3 center(0.1, 0.2, 0.3);
  const auto f = [&](const Vec3& x) { return (x - center).norm() - 0.2; };
  Lattice plain;
  plain.A = 0.02 * Mat3::Identity();
  const SplineWall wall(sample(f, plain, 0.08, sphere(0.2, 12, center)));
  std::vector<std::string> warnings;
  for (int axis = 0; axis < 3; ++axis) {
    const Outline cut = wall.section(axis, center[axis] + 0.05, "f", warnings);
    ASSERT_EQ(cut.curves.size(), 1u);
    const Vec2 middle(center[axis == 0 ? 1 : 0], center[axis == 2 ? 1 : 2]);
    for (const Vec2& x : cut.curves[0].points) EXPECT_NEAR((x - middle).norm(), std::sqrt(0.0375), 1e-5);
  }
}

TEST(SplineSection, RoughGridsKeepTheirWallAndBlurItsCurvature) {
  Lattice plain;
  plain.A = 0.01 * Mat3::Identity();
  Dice dice(2);
  const auto rough = [&](const Vec3& x) { return torus_distance(x) + dice.uniform(-3e-4, 3e-4); };
  const SplineWall wall(sample(rough, plain, 0.04, torus(0.5, 0.15, 100, 40)));
  std::vector<std::string> warnings;
  for (const OutlineCurve& curve : wall.section(2, 0.05, "f", warnings).curves) {
    const double mean = curve.points[0].norm(), side = mean < 0.5 ? -1.0 : 1.0;
    EXPECT_FALSE(curve.smooth);
    ASSERT_EQ(curve.curvature.size(), curve.points.size());
    std::vector<double> off;
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      EXPECT_NEAR(curve.points[i].norm(), 0.5 + side * std::sqrt(kTube), 1e-3);
      off.push_back(std::abs(side * mean * curve.curvature[i] - 1.0));
    }
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    EXPECT_LT(off[off.size() / 2], 0.3);  // of the points themselves: above 5
  }
}

TEST(SplineSection, RefusesWhatIsNoSection) {
  const auto f = [](const Vec3& x) { return x.norm() - 0.2; };
  Lattice plain;
  plain.A = 0.02 * Mat3::Identity();
  const auto refusal = [](const SplineWall& wall, double offset, ErrorCode code) {
    std::vector<std::string> warnings;
    return message_of(code, [&] { static_cast<void>(wall.section(2, offset, "f", warnings)); });
  };
  const SplineWall whole(sample(f, plain, 0.08, sphere(0.2, 12)));
  EXPECT_NE(refusal(whole, 0.3, ErrorCode::kDomain).find("misses"), std::string::npos);
  EXPECT_NE(refusal(whole, 0.19999, ErrorCode::kDomain).find("grazes"), std::string::npos);
  Surface cap = sphere(0.2, 12);
  std::erase_if(cap.triangles, [&](const auto& t) {
    return std::any_of(t.begin(), t.end(),
                       [&](Index v) { return cap.points[static_cast<std::size_t>(v)][0] < -0.1; });
  });
  cap.tags.resize(cap.triangles.size());
  const SplineWall open(sample(f, plain, 0.08, cap));
  EXPECT_NE(refusal(open, 0.0, ErrorCode::kSurfaceInvalid).find("ends at"), std::string::npos);
}

}  // namespace
}  // namespace lamina::detail
