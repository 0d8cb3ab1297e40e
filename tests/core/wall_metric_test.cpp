// The wall is a plane, a sphere, a wedge or a concave corner given by closed forms, so that every expected
// size is too.
#include "core/wall_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace lamina {
namespace {

// Body z < 0, filling the lower half of a large box.
class Plane : public WallField {
 public:
  WallPoint at(const Vec3& x) const override {
    WallPoint w;
    w.phi = x[2];
    w.closest = Vec3(x[0], x[1], 0.0);
    return w;
  }
  double phi(const Vec3& x) const override { return x[2]; }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  Box<3> bounds() const override { return {Vec3(-1, -1, -1), Vec3(1, 1, 0)}; }
};

class Sphere : public WallField {
 public:
  explicit Sphere(double r) : r_(r) {}
  WallPoint at(const Vec3& x) const override {
    WallPoint w;
    w.phi = x.norm() - r_;
    w.N = x.normalized();
    w.closest = r_ * w.N;
    w.T1 = w.N.unitOrthogonal();
    w.T2 = w.N.cross(w.T1);
    w.k1 = w.k2 = 1.0 / r_;
    return w;
  }
  double phi(const Vec3& x) const override { return x.norm() - r_; }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  Box<3> bounds() const override { return {Vec3::Constant(-r_), Vec3::Constant(r_)}; }

 private:
  double r_;
};

// Fluid x > 0 and z > 0 between the walls x = 0 and z = 0.
class ConcaveCorner : public WallField {
 public:
  WallPoint at(const Vec3& x) const override { return wall(x, x[0] < x[2] ? 0 : 2); }
  double phi(const Vec3& x) const override { return std::min(x[0], x[2]); }
  int others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const override {
    const int other = nearest.N[0] == 1.0 ? 2 : 0;
    if (x[other] > reach) return 0;
    out[0] = wall(x, other);
    return 1;
  }
  Box<3> bounds() const override { return {Vec3(-1, -1, -1), Vec3(1, 1, 1)}; }

 private:
  static WallPoint wall(const Vec3& x, int axis) {
    WallPoint w;
    w.phi = x[axis];
    w.closest = x;
    w.closest[axis] = 0.0;
    w.N = Vec3::Unit(axis);
    w.T1 = Vec3::Unit(2 - axis);
    w.T2 = Vec3::UnitY();
    return w;
  }
};

BoundaryLayer layer(double h_min = 1e-3, int layers = 10) {
  Flow flow;
  flow.h_min = h_min;
  flow.layers = layers;
  return resolve(flow, 1.0);
}

SizeOptions sizes() {
  SizeOptions s;
  s.h2 = 0.1;
  s.h1 = 0.5;
  s.domain = {Vec3::Constant(-4), Vec3::Constant(4)};
  s.box2 = {Vec3::Constant(-1.5), Vec3::Constant(1.5)};
  return s;
}

TEST(WallMetric, LayersOverAPlane) {
  const Plane wall;
  const WallMetric m(wall, layer(), sizes());
  double level = 0.0;
  for (int k = 1; k <= 10; ++k) {
    const double h = 1e-3 * std::pow(1.2, k - 1);
    for (const double t : {0.02, 0.5, 0.98}) {
      const WallSample s = m.sample(Vec3(0.1, 0.2, level + t * h));
      EXPECT_NEAR(s.hn / h, 1.0, 1e-12) << k;
      EXPECT_EQ(s.ht1, 0.1);
      EXPECT_EQ(s.region, Region::kLayer);
      EXPECT_NEAR(s.metric.size_along(Vec3::UnitZ()) / h, 1.0, 1e-12);
      EXPECT_NEAR(s.metric.size_along(Vec3(1, 1, 0).normalized()), 0.1, 1e-12);
    }
    level += h;
    EXPECT_NEAR(m.normal_size(Vec3(0, 0, level), level) / h, k < 10 ? std::sqrt(1.2) : 1.0, 1e-12)
        << "on a level the geometric mean of both layers";
  }
}

TEST(WallMetric, MirroredLayersInsideThenGrowth) {
  const Plane wall;
  const WallMetric m(wall, layer(), sizes());
  EXPECT_NEAR(m.normal_size(Vec3::Zero(), -0.5e-3), 1e-3, 1e-15);
  EXPECT_NEAR(m.normal_size(Vec3::Zero(), -3.5e-3), 1.44e-3, 1e-15);
  const double depth = 0.02;
  EXPECT_NEAR(m.normal_size(Vec3::Zero(), -depth), 1.44e-3 + std::log(2.0) * (depth - 3.64e-3), 1e-12);
  EXPECT_EQ(m.normal_size(Vec3::Zero(), -0.9), 0.1);
}

TEST(WallMetric, LinearToBox2GeometricToBox1) {
  const Plane wall;
  SizeOptions s = sizes();
  s.gradation = 0.0;
  const WallMetric m(wall, layer(), s);
  const double top = layer().top();
  const double start = layer().top_size();
  const Vec3 x(0, 0, 0.75);
  const double u = (0.75 - top) / (0.75 - top + 0.75);
  EXPECT_NEAR(m.normal_size(x, 0.75), start + (0.1 - start) * u, 1e-14);
  EXPECT_NEAR(m.normal_size(Vec3(0, 0, 1.5), 1.5), 0.1, 1e-14);
  // Half way from Box2 (1.5) to the domain (4).
  EXPECT_NEAR(m.normal_size(Vec3(0, 0, 2.75), 2.75), 0.1 * std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(m.normal_size(Vec3(0, 0, 4), 4.0), 0.5, 1e-14);
  const WallSample far = m.sample(Vec3(0, 0, 2.75));
  EXPECT_EQ(far.region, Region::kBox1);
  EXPECT_NEAR(far.metric.size_along(Vec3::UnitX()), 0.1 * std::sqrt(5.0), 1e-12);
}

TEST(WallMetric, GradationBoundsTheWayOut) {
  const Plane wall;
  SizeOptions s = sizes();
  s.box2 = {Vec3(-1.5, -1.5, -1.5), Vec3(1.5, 1.5, 0.05)};
  s.domain.hi[2] = 0.06;
  const WallMetric m(wall, layer(), s);
  const double rate = std::log(1.5);
  double before = m.normal_size(Vec3(0, 0, layer().top()), layer().top());
  for (double z = layer().top() + 1e-4; z < 0.06; z += 1e-4) {
    const double h = m.normal_size(Vec3(0, 0, z), z);
    EXPECT_LE(h - before, rate * 1e-4 * (1 + 1e-9)) << z;
    before = h;
  }
}

TEST(WallMetric, TangentialSizeOnASphere) {
  const Sphere wall(0.3);
  const WallMetric m(wall, layer(), sizes());
  const double d = 0.5e-3;
  const WallSample s = m.sample(Vec3(0.3 + d, 0, 0));
  EXPECT_NEAR(s.ht1, std::sqrt(2 * (0.3 + d) * 1e-3 + 1e-6), 1e-12);
  EXPECT_NEAR(s.metric.size_along(Vec3::UnitY()), s.ht1, 1e-12);
  EXPECT_NEAR(s.metric.size_along(Vec3::UnitX()), 1e-3, 1e-15);
}

// The stray of a chord goes from the whole normal size at the wall to .65 of it at the first level.
TEST(WallMetric, ChordsInsideASphereStrayByLessThanTheNormalSize) {
  const Sphere wall(0.3);
  const WallMetric m(wall, layer(), sizes());
  const auto chord = [](double stray) { return std::sqrt(2 * 0.3 * stray + stray * stray); };
  const auto size = [&](double depth) { return m.sample(Vec3(0.3 - depth, 0, 0)).ht1; };
  EXPECT_NEAR(size(0.0), chord(1e-3), 1e-12);
  EXPECT_NEAR(size(0.5e-3), chord(0.825e-3), 1e-12);
  EXPECT_NEAR(size(1.5e-3), chord(0.78e-3), 1e-12);
  EXPECT_NEAR(size(3e-3), chord(0.936e-3), 1e-12);
}

TEST(WallMetric, ConcaveCornerObeysBothWallsAndIsContinuous) {
  const ConcaveCorner wall;
  const WallMetric m(wall, layer(), sizes());
  const auto near_x = m.at(Vec3(0.01 - 1e-9, 0, 0.01));
  const auto near_z = m.at(Vec3(0.01 + 1e-9, 0, 0.01));
  for (const Vec3& d : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)})
    EXPECT_NEAR(near_x.size_along(d) / near_z.size_along(d), 1.0, 1e-6);
  const auto close = m.at(Vec3(0.5e-3, 0, 0.02));
  EXPECT_NEAR(close.size_along(Vec3::UnitX()), 1e-3, 1e-12);
  // The further wall's normal size grows by the larger of the layers' growth and edge_growth.
  EXPECT_NEAR(close.size_along(Vec3::UnitZ()), 1e-3 + std::log(2.0) * (0.02 - 0.5e-3), 1e-12);
  SizeOptions slow = sizes();
  slow.edge_growth = 1.1;
  EXPECT_NEAR(WallMetric(wall, layer(), slow).at(Vec3(0.5e-3, 0, 0.02)).size_along(Vec3::UnitZ()),
              m.normal_size(Vec3(0, 0, 0.02), 0.02), 1e-12);
  EXPECT_NEAR(close.size_along(Vec3::UnitY()), 0.1, 1e-12);
}

// Near a sharp edge sizes across it start at the fan and grow by edge_growth per element; along the edge
// nothing changes.
TEST(WallMetric, SizesAcrossASharpEdgeAreGraded) {
  class Edge : public Plane {
   public:
    WallPoint at(const Vec3& x) const override {
      WallPoint w = Plane::at(x);
      w.edge_distance = std::abs(x[0]);
      w.edge_direction = Vec3::UnitY();
      w.edge_angle = 0.5 * std::numbers::pi;
      return w;
    }
  };
  const Edge wall;
  SizeOptions options = sizes();
  options.edge_growth = 1.5;
  const WallMetric m(wall, layer(), options);
  for (const double t : {0.0, 0.01, 0.1, 0.2}) {
    const auto s = m.at(Vec3(t, 0, 0.5e-3));
    EXPECT_NEAR(s.size_along(Vec3::UnitX()), 1e-3 + std::log(1.5) * t, 1e-9) << t;
    EXPECT_NEAR(s.size_along(Vec3::UnitY()), 0.1, 1e-9);
    EXPECT_NEAR(s.size_along(Vec3::UnitZ()), 1e-3, 1e-12);
  }
  EXPECT_NEAR(m.at(Vec3(0.8, 0, 0.5e-3)).size_along(Vec3::UnitX()), 0.1, 1e-9);
}

// A painted size bounds every direction, spreads by the gradation, and leaves smaller sizes alone.
TEST(WallMetric, PaintedSizesAreUpperBounds) {
  class HalfSpace : public SizeField {  // 0.02 where x > 0.5
   public:
    double bound(const Vec3& x, double rate, double limit) const override {
      return std::min(limit, 0.02 + rate * std::max(0.0, 0.5 - x[0]));
    }
  };
  const Plane wall;
  const HalfSpace painted;
  const WallMetric plain(wall, layer(), sizes()), m(wall, layer(), sizes(), {&painted});
  const auto near = m.at(Vec3(0.6, 0, 0.5e-3));
  EXPECT_NEAR(near.size_along(Vec3::UnitX()), 0.02, 1e-12);
  EXPECT_NEAR(near.size_along(Vec3::UnitY()), 0.02, 1e-12);
  EXPECT_NEAR(near.size_along(Vec3::UnitZ()), 1e-3, 1e-12);
  const auto beside = m.at(Vec3(0.4, 0, 0.5e-3));
  EXPECT_NEAR(beside.size_along(Vec3::UnitX()), 0.02 + 0.1 * std::log(1.5), 1e-12);
  for (const double z : {0.2, 0.5}) {
    const Vec3 high(0.6, 0, z);
    EXPECT_NEAR(m.sample(high).hn, std::min(0.02, plain.sample(high).hn), 1e-12);
  }
  const Vec3 far(-0.9, 0, 0.5e-3);
  EXPECT_EQ(m.at(far).tensor(), plain.at(far).tensor());
  SizeOptions off = sizes();
  off.gradation = 0.0;  // not beyond the painted voxels
  const Vec3 outside(0.49, 0, 0.5e-3);
  EXPECT_EQ(WallMetric(wall, layer(), off, {&painted}).at(outside).tensor(),
            WallMetric(wall, layer(), off).at(outside).tensor());
}

TEST(WallMetric, BoxesBoundTheSizeAndSpread) {
  const Plane wall;
  SizeOptions s = sizes();
  s.boxes = {{"wake", {Vec3(0.5, -1, 0), Vec3(0.9, 1, 1)}, 0.02}};
  const WallMetric m(wall, layer(), s);
  EXPECT_NEAR(m.at(Vec3(0.6, 0, 0.5)).size_along(Vec3::UnitY()), 0.02, 1e-12);
  EXPECT_NEAR(m.at(Vec3(0.4, 0, 0.5e-3)).size_along(Vec3::UnitX()), 0.02 + 0.1 * std::log(1.5), 1e-12);
  EXPECT_NEAR(m.at(Vec3(0.6, 0, 0.5e-3)).size_along(Vec3::UnitZ()), 1e-3, 1e-15);
  s.boxes[0].size = 0.0;
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
  s.boxes[0] = {"flat", {Vec3(0.5, -1, 0), Vec3(0.5, 1, 1)}, 0.02};
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
}

// The chord of a sphere is measured by the local size or by h_min [eq. 29].
TEST(WallMetric, ChordOfTheWall) {
  const Sphere wall(0.3);
  SizeOptions s = sizes();
  s.chord = Chord::kWall;
  const WallMetric m(wall, layer(), s);
  const double d = 4.0e-3;
  EXPECT_NEAR(m.sample(Vec3(0.3 + d, 0, 0)).ht1, std::sqrt(2 * (0.3 + d) * 1e-3 + 1e-6), 1e-12);
}

// A face of the domain is a wall: layers over it as over the body, both obeyed where they meet, none of its
// layers deep inside the body.
TEST(WallMetric, FacesOfTheDomainCarryLayers) {
  const Sphere wall(0.3);
  SizeOptions s = sizes();
  s.domain = {Vec3(-2, -2, -0.35), Vec3(2, 2, 2)};
  s.box2 = {Vec3(-0.8, -0.8, -0.35), Vec3(0.8, 0.8, 0.8)};
  s.walls[4] = true;  // z-
  const WallMetric m(wall, layer(), s);
  for (const double x : {0.7, 1.5}) {  // within Box2 and outside
    const auto ground = m.at(Vec3(x, 0, -0.35 + 0.5e-3));
    EXPECT_NEAR(ground.size_along(Vec3::UnitZ()), 1e-3, 1e-12) << x;
    EXPECT_GE(ground.size_along(Vec3::UnitX()), 0.1 - 1e-12) << x;
  }
  const double height = layer().level(2) + 1e-5;  // in the third layer
  EXPECT_NEAR(m.at(Vec3(0.7, 0, -0.35 + height)).size_along(Vec3::UnitZ()), 1e-3 * 1.2 * 1.2, 1e-9);
  const auto gap = m.at(Vec3(0, 0, -0.325));  // the middle of the gap of 0.05
  EXPECT_LE(gap.size_along(Vec3::UnitZ()), 0.05 / 4);
  for (const double z : {-0.325 - 1e-7, -0.325 + 1e-7})  // from one wall to the other
    EXPECT_NEAR(m.at(Vec3(0.1, 0, z)).size_along(Vec3(0.6, 0, 0.8)) /
                    m.at(Vec3(0.1, 0, -0.325)).size_along(Vec3(0.6, 0, 0.8)),
                1.0, 1e-3);
  const WallMetric plain(wall, layer(), [&] {
    SizeOptions o = s;
    o.walls.fill(false);
    return o;
  }());
  EXPECT_EQ(m.at(Vec3(0, 0, 0.1)).tensor(), plain.at(Vec3(0, 0, 0.1)).tensor());
  EXPECT_NEAR(m.at(Vec3(0, 0, 0.3005)).size_along(Vec3::UnitZ()), 1e-3, 1e-12);
}

// Beside a bend the wall's sizes start at those of the bend and grow with the distance from it.
TEST(WallMetric, SizesGrowAwayFromABend) {
  class Bent : public Plane {
   public:
    WallPoint at(const Vec3& x) const override {
      WallPoint w = Plane::at(x);
      w.bend_distance = std::abs(x[0]);
      w.bend_direction = Vec3::UnitX();
      w.bend_k1 = 10.0;
      return w;
    }
  };
  const Bent wall;
  const WallMetric m(wall, layer(), sizes());
  const double chord = std::sqrt(2 * 1e-3 * (0.1 + 0.5e-3) + 1e-6);
  for (const double x : {0.0, 0.01, 0.05}) {
    const auto s = m.at(Vec3(x, 0, 0.5e-3));
    EXPECT_NEAR(s.size_along(Vec3::UnitX()), chord + std::log(2.0) * x, 1e-9) << x;
    EXPECT_NEAR(s.size_along(Vec3::UnitY()), 0.1, 1e-9);
    EXPECT_NEAR(s.size_along(Vec3::UnitZ()), 1e-3, 1e-12);
  }
  EXPECT_NEAR(m.at(Vec3(0.5, 0, 0.5e-3)).size_along(Vec3::UnitX()), 0.1, 1e-9);
}

TEST(WallMetric, CoarsenedRaisesOnlySmallSizes) {
  const Plane wall;
  const WallMetric m(wall, layer(), sizes());
  const auto c = m.at_coarsened(Vec3(0, 0, 0.5e-3), 0.02);
  EXPECT_NEAR(c.size_along(Vec3::UnitZ()), 0.02, 1e-15);
  EXPECT_NEAR(c.size_along(Vec3::UnitX()), 0.1, 1e-15);
}

// s_k = h_min (g^k - 1) / (g - 1): 1e-3, 2.2e-3, 3.64e-3 for g = 1.2.
TEST(WallMetric, NearestLevelOfALayer) {
  const Plane plane;
  const WallMetric m(plane, layer(), sizes());
  const auto expect = [&](double z, double floor, int number, double level) {
    const auto found = m.level(Vec3(0.1, 0.2, z), floor);
    ASSERT_TRUE(found) << z;
    EXPECT_EQ(found->number, number) << z;
    EXPECT_NEAR(found->way[2], level - z, 1e-15);
    EXPECT_EQ(found->way.head<2>().norm(), 0.0);
    EXPECT_EQ(found->normal, Vec3(0, 0, 1));
    EXPECT_EQ(found->metric.tensor(), m.at_coarsened(Vec3(0.1, 0.2, level), floor).tensor()) << z;
  };
  expect(0.0, 0.0, 0, 0.0);
  expect(4e-4, 0.0, 0, 0.0);
  expect(6e-4, 0.0, 1, 1e-3);
  expect(2.9e-3, 0.0, 2, 2.2e-3);
  expect(3.0e-3, 0.0, 3, 3.64e-3);
  expect(-6e-4, 0.0, -1, -1e-3);
  // With sizes of 0.02 the layers are not resolved: the wall alone is.
  expect(6e-4, 0.02, 0, 0.0);
  EXPECT_FALSE(m.level(Vec3(0, 0, 0.013), 0.02));
  EXPECT_FALSE(m.level(Vec3(0, 0, 0.09), 0.0));   // above the layers
  EXPECT_FALSE(m.level(Vec3(0, 0, -0.02), 0.0));  // below the mirrored ones
}

// From level to level an edge has length 1, although sizes are constant in each layer.
TEST(WallMetric, EdgesBetweenLevelsAreUnit) {
  const Plane plane;
  const BoundaryLayer b = layer();
  const WallMetric m(plane, b, sizes());
  for (int k = 1; k + 1 < b.layers; ++k) {
    const Vec3 p(0, 0, b.level(k)), q(0, 0, b.level(k + 1));
    EXPECT_NEAR(edge_length<3>(p, m.at(p), q, m.at(q)), 1.0, 2e-3) << k;
  }
}

TEST(WallMetric, LevelsGiveWayToOtherSizes) {
  const Plane plane;
  SizeOptions o = sizes();
  o.boxes.push_back({"fine", {Vec3(-1, -1, -1), Vec3(1, 1, 1)}, 5e-4});
  EXPECT_FALSE(WallMetric(plane, layer(), o).level(Vec3(0, 0, 3e-3), 0.0));
}

TEST(WallMetric, RefusesContradictions) {
  const Plane wall;
  SizeOptions s = sizes();
  s.h2 = 1e-4;
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
  s = sizes();
  s.h1 = 0.05;
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
  s = sizes();
  s.domain = {Vec3::Constant(5), Vec3::Constant(6)};
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
  s = sizes();
  s.gradation = 0.5;
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
  s = sizes();
  s.edge_growth = 1.0;
  EXPECT_THROW(WallMetric(wall, layer(), s), Error);
}

}  // namespace
}  // namespace lamina
