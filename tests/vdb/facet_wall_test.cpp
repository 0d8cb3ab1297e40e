#include "vdb/detail/facet_wall.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

constexpr double kPi = std::numbers::pi;
constexpr double kAngle = 40.0 * kPi / 180.0;
constexpr double kInf = std::numeric_limits<double>::infinity();

FacetWall cube() { return {box(Vec3::Zero(), Vec3::Ones()), kAngle}; }

void expect_orthonormal(const WallPoint& w) {
  Mat3 m;
  m << w.N, w.T1, w.T2;
  EXPECT_LT((m.transpose() * m - Mat3::Identity()).norm(), 1e-12);
}

double degrees(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / kPi; }

TEST(FacetWall, CubeFace) {
  const FacetWall wall = cube();
  EXPECT_EQ(wall.topology().sharp_edges, 12);
  EXPECT_EQ(wall.topology().corners, 8);
  const WallPoint w = wall.at({0.3, 0.4, 1.5});
  EXPECT_EQ(w.phi, 0.5);
  EXPECT_LT((w.closest - Vec3(0.3, 0.4, 1.0)).norm(), 1e-15);
  EXPECT_EQ(w.feature, WallFeature::kFace);
  EXPECT_EQ(w.N, Vec3::UnitZ());
  EXPECT_EQ(w.k1, 0.0);
  EXPECT_EQ(w.k2, 0.0);
  EXPECT_NEAR(w.edge_distance, 0.3, 1e-15);
  EXPECT_NEAR(std::abs(w.edge_direction[1]), 1.0, 1e-15);
  EXPECT_NEAR(w.edge_angle, kPi / 2, 1e-15);
  EXPECT_NEAR(w.corner_distance, 0.5, 1e-15);
  expect_orthonormal(w);
  EXPECT_EQ(wall.at({0.3, 0.4, 0.9}).phi, wall.phi({0.3, 0.4, 0.9}));
  EXPECT_NEAR(wall.phi({0.3, 0.4, 0.9}), -0.1, 1e-15);
  EXPECT_EQ(wall.at({0.3, 0.4, 0.9}).N, Vec3::UnitZ());  // into the fluid from inside as well
}

// The face of the cube has edges at 0.2, 0.4, 0.6 and 0.8.
TEST(FacetWall, EdgesBesideAPointOfACubeFace) {
  const FacetWall wall = cube();
  const WallPoint w = wall.at({0.8, 0.6, 1.5});
  EXPECT_NEAR(w.edge_distance, 0.2, 1e-15);
  std::array<WallEdge, 8> edges;
  EXPECT_EQ(wall.edges_beside(w, 0.3, edges), 0);
  ASSERT_EQ(wall.edges_beside(w, 0.9, edges), 3);
  const std::array<double, 3> distances{0.4, 0.6, 0.8};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(edges[i].distance, distances[i], 1e-14);
    EXPECT_NEAR(std::abs(edges[i].direction[i == 2 ? 1 : 0]), 1.0, 1e-14);
    EXPECT_NEAR(edges[i].angle, kPi / 2, 1e-15);
    EXPECT_EQ(edges[i].curvature, 0.0);
  }
  EXPECT_EQ(wall.edges_beside(w, 0.9, std::span(edges).first(2)), 2);  // the nearest
  EXPECT_NEAR(edges[1].distance, 0.6, 1e-14);
}

// On the cap of a cylinder of radius 1 the rim bends ever more around a point that nears the centre, and the
// far side of the rim is a maximum of the distance.
TEST(FacetWall, TheRimOfACapBendsAroundItsCentre) {
  const FacetWall wall(cylinder(1.0, -5.0, 1.0, 720), kAngle);
  for (const double r : {0.9, 0.5, 0.1}) {
    const WallPoint w = wall.at({r, 0.001, 1.1});
    EXPECT_NEAR(w.edge_distance, 1.0 - r, 1e-4);
    EXPECT_NEAR(w.edge_curvature, 1.0 / r, 2e-3 / r / r);
    std::array<WallEdge, 4> edges;  // the chords next to the nearest at most
    for (int i = 0, n = wall.edges_beside(w, 3.0, edges); i < n; ++i)
      EXPECT_NEAR(edges[static_cast<std::size_t>(i)].distance, 1.0 - r, 2e-3) << r;
  }
}

TEST(FacetWall, CubeEdgeAndCornerRays) {
  const FacetWall wall = cube();
  const WallPoint e = wall.at({1.3, 0.4, 1.4});
  EXPECT_EQ(e.feature, WallFeature::kEdge);
  EXPECT_NEAR(e.phi, 0.5, 1e-15);
  EXPECT_LT((e.N - Vec3(0.6, 0, 0.8)).norm(), 1e-14);
  EXPECT_NEAR(std::abs(e.T2[1]), 1.0, 1e-14);
  EXPECT_EQ(e.k1, kInf);
  EXPECT_EQ(e.k2, 0.0);
  EXPECT_EQ(e.edge_distance, 0.0);
  EXPECT_NEAR(e.edge_angle, kPi / 2, 1e-15);
  EXPECT_NEAR(e.corner_distance, 0.4, 1e-15);
  expect_orthonormal(e);
  const WallPoint c = wall.at({1.1, 1.2, 1.2});
  EXPECT_EQ(c.feature, WallFeature::kCorner);
  EXPECT_LT((c.N - Vec3(1, 2, 2) / 3.0).norm(), 1e-14);
  EXPECT_EQ(c.k1, kInf);
  EXPECT_EQ(c.k2, kInf);
  EXPECT_EQ(c.corner_distance, 0.0);
  EXPECT_EQ(c.edge_distance, 0.0);
  EXPECT_TRUE(c.edge_direction.isZero());
  expect_orthonormal(c);
  // On the edge and on the corner themselves: the mean direction.
  EXPECT_LT((wall.at({1.0, 0.4, 1.0}).N - Vec3(1, 0, 1).normalized()).norm(), 1e-14);
  EXPECT_LT((wall.at({1.0, 1.0, 1.0}).N - Vec3(1, 1, 1).normalized()).norm(), 1e-14);
}

TEST(FacetWall, AKnownDistanceChangesNothing) {
  for (const Surface& s : {torus(1.0, 0.3, 30, 12), box(Vec3::Zero(), Vec3::Ones())}) {
    const FacetWall wall(s, kAngle);
    Dice dice(8);
    const Box<3> b = s.bounds().padded(0.5);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x = i % 20 == 0 ? s.points[static_cast<std::size_t>(i) % s.points.size()]
                                 : Vec3(dice.point(b.lo, b.hi));
      const WallPoint asked = wall.at(x);
      const WallPoint known = wall.at_known(x, static_cast<double>(static_cast<float>(asked.phi)));
      EXPECT_EQ(known.phi, asked.phi);
      EXPECT_EQ(known.closest, asked.closest);
      EXPECT_EQ(known.N, asked.N);
      EXPECT_EQ(known.k1, asked.k1);
      EXPECT_EQ(known.edge_distance, asked.edge_distance);
    }
  }
}

TEST(FacetWall, AKnownSideChangesNothing) {
  const FacetWall wall = cube();
  for (const Vec3& x : {Vec3(0.3, 0.4, 1.5), Vec3(0.3, 0.4, 0.9), Vec3(1.3, 0.4, 1.4), Vec3(1.2, 1.3, 1.4)}) {
    const WallPoint w = wall.at(x), known = wall.at_side(x, w.phi < 0.0 ? -1.0 : 1.0);
    EXPECT_EQ(known.phi, w.phi);
    EXPECT_EQ(known.N, w.N);
    EXPECT_EQ(known.T1, w.T1);
    EXPECT_EQ(known.k1, w.k1);
    EXPECT_EQ(known.feature, w.feature);
    EXPECT_EQ(known.edge_distance, w.edge_distance);
  }
}

TEST(FacetWall, FrameIsConstantAlongRays) {
  for (const Surface& s :
       {torus(1.0, 0.3, 30, 12), box(Vec3::Zero(), Vec3::Ones()), cylinder(0.5, 0.0, 1.0, 40)}) {
    const FacetWall wall(s, kAngle);
    Dice dice(4);
    const Box<3> b = s.bounds().padded(0.2);
    int rays = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x = dice.point(b.lo, b.hi);
      const WallPoint far = wall.at(x);
      const Vec3 y = far.closest + 0.1 * (x - far.closest);
      const WallPoint near = wall.at(y);
      if ((near.closest - far.closest).norm() > 1e-9) continue;
      ++rays;
      EXPECT_EQ(near.feature, far.feature);
      EXPECT_LT((near.N - far.N).norm(), 1e-7);
      if (std::isfinite(far.k1)) {
        EXPECT_NEAR(near.k1, far.k1, 1e-7);
      }
    }
    EXPECT_GT(rays, 1500);
  }
}

TEST(FacetWall, NormalIsContinuousOverASmoothWall) {
  const FacetWall wall(torus(1.0, 0.3, 60, 24), kAngle);
  double worst = 0.0;
  Vec3 last = Vec3::Zero();
  for (int i = 0; i <= 20000; ++i) {
    const double u = 0.7 * kPi * i / 20000.0, v = 5.0 * u;
    const Vec3 x((1.0 + 0.33 * std::cos(v)) * std::cos(u), (1.0 + 0.33 * std::cos(v)) * std::sin(u),
                 0.33 * std::sin(v));
    const Vec3 n = wall.at(x).N;
    if (i > 0) worst = std::max(worst, degrees(n, last));
    last = n;
  }
  EXPECT_LT(worst, 0.5);  // the facets' own normals jump by 15 degrees
}

// One face of a rounded cube: a flat square, two fillets of long facets, a ball patch of small ones. All four
// meet in one vertex.
Surface rounded_face(double radius, double core, int cells) {
  std::vector<std::array<double, 2>> line{{0.0, 0.0}};  // core coordinate, tangent
  for (int i = 0; i <= cells; ++i) line.push_back({core, std::tan(0.25 * kPi * i / cells)});
  const int n = static_cast<int>(line.size());
  Surface s;
  for (const auto& [cx, tx] : line)
    for (const auto& [cy, ty] : line)
      s.points.push_back(Vec3(cx, cy, core) + radius * Vec3(tx, ty, 1.0).normalized());
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      const Index a = i * n + j;
      s.triangles.push_back({a, a + n, a + n + 1});
      s.triangles.push_back({a, a + n + 1, a + 1});
    }
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"wall"};
  return s;
}

TEST(FacetWall, FilletsKeepTheirCurvatureWhereTheyMeetAFlatFaceAndABall) {
  const double radius = 0.1, core = 0.4;
  const FacetWall wall(rounded_face(radius, core, 12), kAngle);
  const double turn = 0.01;  // radians; within the first row of facets
  const auto expect = [&](const Vec3& at, double k1, double k2) {
    const WallPoint w = wall.at(at);
    EXPECT_NEAR(w.k1 * radius, k1, 0.01);
    EXPECT_NEAR(w.k2 * radius, k2, 0.01);
  };
  const double c = core + 1.01 * radius * std::sin(turn), z = core + 1.01 * radius * std::cos(turn);
  for (const double along : {0.3, 0.39, 0.399}) {
    expect({along, along, core + 1.01 * radius}, 0.0, 0.0);
    expect({along, c, z}, 1.0, 0.0);
    expect({c, along, z}, 1.0, 0.0);
  }
  expect({c, c, z}, 1.0, 1.0);
}

TEST(FacetWall, SphereAndTorusAgainstFormulas) {
  const auto check = [](const Surface& s, auto&& truth, double normal_bound, double k_bound) {
    const FacetWall wall(s, kAngle);
    Dice dice(9);
    for (int i = 0; i < 3000; ++i) {
      const auto& t = s.triangles[static_cast<std::size_t>(dice.engine() % s.triangles.size())];
      double a = dice.uniform(0, 1), b = dice.uniform(0, 1);
      if (a + b > 1.0) {
        a = 1.0 - a;
        b = 1.0 - b;
      }
      const auto p = [&](std::size_t k) -> const Vec3& { return s.points[static_cast<std::size_t>(t[k])]; };
      const Vec3 q = p(0) + a * (p(1) - p(0)) + b * (p(2) - p(0));
      const WallPoint w = wall.at(q);
      Vec3 N;
      double k1 = 0.0, k2 = 0.0;
      truth(q, N, k1, k2);
      EXPECT_LT(std::abs(w.phi), 1e-15);
      EXPECT_LT(degrees(w.N, N), normal_bound);
      EXPECT_LT(std::max(std::abs(w.k1 - k1), std::abs(w.k2 - k2)), k_bound * std::abs(k1));
      EXPECT_EQ(w.edge_distance, kInf);
      EXPECT_EQ(w.corner_distance, kInf);
    }
  };
  check(
      sphere(0.5, 24),
      [](const Vec3& q, Vec3& N, double& k1, double& k2) {
        N = q.normalized();
        k1 = k2 = 2.0;
      },
      0.2, 0.03);
  check(
      torus(1.0, 0.3, 164, 49),
      [](const Vec3& q, Vec3& N, double& k1, double& k2) {
        const Vec3 c = Vec3(q[0], q[1], 0.0).normalized();
        N = (q - c).normalized();
        k1 = 1.0 / 0.3;
        k2 = N.dot(c) / (1.0 + 0.3 * N.dot(c));
      },
      0.06, 0.006);
}

TEST(FacetWall, CurvatureSignAndDirections) {
  const FacetWall wall(cylinder(0.5, -1.0, 1.0, 100), kAngle);
  const WallPoint w = wall.at({0.7, 0.1, 0.2});
  EXPECT_NEAR(w.k1, 2.0, 0.01);  // convex
  EXPECT_NEAR(w.k2, 0.0, 1e-9);
  EXPECT_NEAR(std::abs(w.T2[2]), 1.0, 1e-9);
  EXPECT_NEAR(w.edge_distance, 0.8, 1e-9);
  const WallPoint cap = wall.at({0.2, 0.1, 1.3});
  EXPECT_EQ(cap.k1, 0.0);
  // The rim is a circle: along it the ray frame bends as the neighbouring walls do.
  const WallPoint side = wall.at({0.7, 0.0, 1.0 + 1e-6}), top = wall.at({0.5 + 1e-6, 0.0, 1.2});
  EXPECT_EQ(side.feature, WallFeature::kEdge);
  EXPECT_NEAR(side.k2, 2.0, 0.02);
  EXPECT_NEAR(top.k2, 0.0, 0.02);
  EXPECT_EQ(wall.topology().corners, 0);
  Surface tube = cylinder(0.5, -1.0, 1.0, 100);
  for (auto& t : tube.triangles) std::swap(t[1], t[2]);
  EXPECT_NEAR(FacetWall(tube, kAngle).at({0.3, 0.1, 0.2}).k1, -2.0, 0.01);
}

TEST(FacetWall, FlatFaceBesideAFilletStaysFlat) {
  // A quarter-round between two long flat faces: the facets of the round are 1/60 as wide as the faces.
  std::vector<Vec2> p{{-1.0, -1.0}, {0.1, -1.0}};
  const int n = 12;
  for (int i = 0; i <= n; ++i)
    p.push_back({std::cos(0.5 * kPi * i / n) * 0.1, std::sin(0.5 * kPi * i / n) * 0.1});
  p.push_back({-1.0, 0.1});
  std::vector<std::array<Index, 3>> fill;
  for (Index i = 1; i + 1 < static_cast<Index>(p.size()); ++i) fill.push_back({0, i, i + 1});
  const FacetWall wall(prism(p, fill, 1.0), kAngle);
  for (const double t : {0.05, 0.3, 0.7}) {
    const WallPoint right = wall.at({0.2, 0.5, -t}), top = wall.at({-t, 0.5, 0.2});
    EXPECT_LT((right.N - Vec3::UnitX()).norm(), 1e-9);
    EXPECT_LT((top.N - Vec3::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(right.k1, 0.0, 1e-9);
    EXPECT_NEAR(top.k1, 0.0, 1e-9);
  }
  for (const double a : {0.1, 0.5, 1.2}) {
    const WallPoint round = wall.at({0.101 * std::cos(a), 0.5, 0.101 * std::sin(a)});
    EXPECT_NEAR(round.k1, 10.0, 0.5);
    EXPECT_LT(degrees(round.N, Vec3(std::cos(a), 0.0, std::sin(a))), 0.5);
  }
}

TEST(FacetWall, ConcaveEdgeIsNoRayFromTheFluid) {
  const FacetWall wall(step(), kAngle);
  const WallPoint on = wall.at({0.0, 0.5, 0.0});  // on the concave edge
  EXPECT_EQ(on.feature, WallFeature::kFace);
  const WallPoint floor = wall.at({0.3, 0.5, 0.1});
  EXPECT_EQ(floor.feature, WallFeature::kFace);
  EXPECT_LT((floor.N - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(floor.edge_distance, 0.3, 1e-12);         // concave edges count too
  const WallPoint inside = wall.at({-0.3, 0.5, -0.4});  // in the body the roles are swapped
  EXPECT_EQ(inside.feature, WallFeature::kEdge);
  EXPECT_LT((inside.N - Vec3(0.6, 0, 0.8)).norm(), 1e-12);
  EXPECT_NEAR(inside.phi, -0.5, 1e-12);
}

TEST(FacetWall, OthersOfAStep) {
  const FacetWall wall(step(), kAngle);
  std::array<WallPoint, 4> out;
  const Vec3 x(0.3, 0.5, 0.2);
  const WallPoint nearest = wall.at(x);
  ASSERT_EQ(wall.others(x, nearest, 1.0, out), 1);
  EXPECT_NEAR(out[0].phi, 0.3, 1e-15);
  EXPECT_LT((out[0].N - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_LT((out[0].closest - Vec3(0, 0.5, 0.2)).norm(), 1e-12);
  EXPECT_EQ(wall.others(x, nearest, 0.29, out), 0);
  EXPECT_EQ(wall.others(x, nearest, 1.0, std::span<WallPoint>()), 0);
  // On the concave edge itself the other wall is at no distance.
  const Vec3 edge(0.0, 0.5, 0.0);
  ASSERT_GE(wall.others(edge, wall.at(edge), 0.1, out), 1);
  EXPECT_EQ(out[0].phi, 0.0);
  EXPECT_LT(std::abs(out[0].N.dot(wall.at(edge).N)), 1e-12);
  // Above the roof there is one wall only, however far one looks: the floor's nearest point is not a minimum.
  const Vec3 roof(-0.5, 0.5, 1.2);
  EXPECT_EQ(wall.others(roof, wall.at(roof), 0.9, out), 0);
}

TEST(FacetWall, OthersInAGapAndABox) {
  const FacetWall gap(joined(box({0, 0, 0}, {4, 4, 1}), box({0, 0, 1.5}, {4, 4, 2.5})), kAngle);
  std::array<WallPoint, 6> out;
  const Vec3 x(2.0, 2.0, 1.2);
  ASSERT_EQ(gap.others(x, gap.at(x), 0.4, out), 1);
  EXPECT_NEAR(out[0].phi, 0.3, 1e-12);
  EXPECT_LT((out[0].N + Vec3::UnitZ()).norm(), 1e-12);
  // The far sides of the plates are not seen from the gap, nor is the other side of the nearest one.
  EXPECT_EQ(gap.others(x, gap.at(x), 1.9, out), 1);
  // Inside a cube: all six faces, nearest first.
  const FacetWall room = cube();
  const Vec3 y(0.4, 0.45, 0.3);
  ASSERT_EQ(room.others(y, room.at(y), 0.75, out), 5);
  EXPECT_TRUE(std::is_sorted(out.begin(), out.begin() + 5, [](const WallPoint& a, const WallPoint& b) {
    return std::abs(a.phi) < std::abs(b.phi);
  }));
  EXPECT_NEAR(out[0].phi, -0.4, 1e-15);
  EXPECT_NEAR(out[4].phi, -0.7, 1e-15);
}

TEST(FacetWall, OthersFindsEveryLocalMinimum) {
  // Against a plain search over all facets, on a scene with smooth, sharp, closed and open parts.
  Surface s = joined(joined(torus(1.0, 0.3, 24, 12), box({-0.2, -0.2, -0.6}, {0.2, 0.2, 0.6})),
                     box({-2, -2, -2}, {2, 2, -0.9}, 32));
  const FacetWall wall(s, kAngle);
  Dice dice(11);
  const double apart = std::cos(kPi / 18);
  int found = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 x = dice.point({-1.6, -1.6, -1.2}, {1.6, 1.6, 0.8});
    const WallPoint nearest = wall.at(x);
    if (nearest.phi <= 0.0) continue;
    const double reach = 0.8;
    std::vector<std::pair<double, Vec3>> minima;  // by descent: a facet no neighbour of which is nearer
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const auto corner = [&](std::size_t f, std::size_t k) -> const Vec3& {
        return s.points[static_cast<std::size_t>(s.triangles[f][k])];
      };
      const TriangleHit h = closest_on_triangle(corner(t, 0), corner(t, 1), corner(t, 2), x);
      if (std::sqrt(h.d2) > reach) continue;
      bool least = true;
      Vec3 side = Vec3::Zero();
      for (std::size_t f = 0; f < s.triangles.size(); ++f) {
        const double touch = closest_on_triangle(corner(f, 0), corner(f, 1), corner(f, 2), h.point).d2;
        if (touch > 1e-24) continue;
        least = least &&
                closest_on_triangle(corner(f, 0), corner(f, 1), corner(f, 2), x).d2 >= h.d2 * (1 - 1e-12);
        side += (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).normalized();
      }
      const bool sheet = wall.sign_rule().two_sided(static_cast<Index>(t));
      if (least && (sheet || side.dot(h.offset) > 0.0)) minima.push_back({h.d2, -h.offset.normalized()});
    }
    std::sort(minima.begin(), minima.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::pair<double, Vec3>> kept{{0.0, (nearest.closest - x).normalized()}};
    for (const auto& m : minima)
      if (std::all_of(kept.begin(), kept.end(),
                      [&](const auto& k) { return m.second.dot(k.second) <= apart; }))
        kept.push_back(m);
    std::array<WallPoint, 12> out;
    const int n = wall.others(x, nearest, reach, out);
    ASSERT_EQ(n + 1, static_cast<int>(kept.size())) << x.transpose();
    for (int k = 0; k < n; ++k)
      EXPECT_NEAR(out[static_cast<std::size_t>(k)].phi,
                  std::sqrt(kept[static_cast<std::size_t>(k) + 1].first), 1e-12);
    found += n;
  }
  EXPECT_GT(found, 200);
}

TEST(FacetWall, NoOtherWallBehindASeam) {
  // A floor of two patches that touch without sharing points: the seam is neither an edge nor another wall.
  Surface s = joined(box({0, 0, -1}, {1, 1, 0}, 32), box({1, 0, -1}, {2, 1, 0}, 32));
  const FacetWall wall(s, kAngle);
  std::array<WallPoint, 4> out;
  for (const double x : {0.4, 0.9, 1.2}) {
    const Vec3 p(x, 0.5, 0.1);
    const WallPoint w = wall.at(p);
    EXPECT_EQ(w.feature, WallFeature::kFace);
    EXPECT_EQ(wall.others(p, w, 1.0, out), 0) << x;
    EXPECT_NEAR(w.edge_distance, std::min({0.5, x, 2.0 - x}), 1e-12);
  }
  EXPECT_EQ(wall.at({1.0, 0.5, 0.1}).feature, WallFeature::kFace);
}

TEST(FacetWall, ConeTipIsACorner) {
  Surface s = cylinder(0.5, 0.0, 1.0, 60);  // top fan raised to a tip
  s.points.back()[2] = 1.5;
  const FacetWall wall(s, kAngle);
  const WallPoint tip = wall.at({0.0, 0.0, 2.0});
  EXPECT_EQ(tip.feature, WallFeature::kCorner);
  EXPECT_EQ(wall.topology().corners, 1);
  EXPECT_NEAR(wall.at({0.25, 0.0, 1.26}).corner_distance, std::sqrt(0.125), 0.02);
}

TEST(FacetWall, NothingIsNanOnHostileSurfaces) {
  Surface s = joined(torus(1.0, 0.3, 12, 6), box(Vec3::Zero(), Vec3::Ones(), 37));
  s.points.push_back(s.points[0] + Vec3(1e-13, 0, 0));
  s.triangles.push_back({0, 1, static_cast<Index>(s.points.size() - 1)});  // a sliver on an edge
  s.triangles.push_back({79, 78, 79});                                     // no area
  s.triangles.push_back({0, 40, 77});                                      // through everything
  finish(s);
  const FacetWall wall(s, kAngle);
  Dice dice(3);
  std::array<WallPoint, 4> out;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = i < 70 ? s.points[static_cast<std::size_t>(i)]
                          : dice.point(Vec3::Constant(-1.5), Vec3::Constant(1.5));
    const WallPoint w = wall.at(x);
    EXPECT_EQ(w.phi, wall.phi(x));
    expect_orthonormal(w);
    EXPECT_FALSE(std::isnan(w.k1) || std::isnan(w.k2));
    EXPECT_GE(std::abs(w.k1), std::abs(w.k2));
    EXPECT_LE(wall.others(x, w, 0.5, out), 4);
  }
}

}  // namespace
}  // namespace lamina::detail
