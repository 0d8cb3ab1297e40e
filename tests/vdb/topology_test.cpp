#include "vdb/detail/topology.h"

#include <gtest/gtest.h>

#include "tests/vdb/test_surfaces.h"
#include "vdb/detail/curvature.h"
#include "vdb/detail/surface_topology.h"
#include "vdb/shapes.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

constexpr double kPi = std::numbers::pi;
constexpr double kAngle = 40.0 * kPi / 180.0;

int count_kind(const Topology& t, EdgeKind kind) {
  int n = 0;
  for (const Edge& e : t.edges) n += e.kind == kind;
  return n;
}

TEST(Topology, Cube) {
  const Topology t = make_topology(box(Vec3::Zero(), Vec3::Ones()), kAngle);
  EXPECT_EQ(t.edges.size(), 18U);
  EXPECT_EQ(count_kind(t, EdgeKind::kConvex), 12);
  EXPECT_EQ(count_kind(t, EdgeKind::kSmooth), 6);
  EXPECT_EQ(t.shells, 1);
  EXPECT_EQ(t.corners, 8);
  for (const Edge& e : t.edges) EXPECT_NEAR(e.angle, e.kind == EdgeKind::kConvex ? kPi / 2 : 0.0, 1e-15);
  for (std::size_t f = 0; f < 12; ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge& e = t.edges[static_cast<std::size_t>(t.facet_edges[f][k])];
      EXPECT_TRUE(e.regular);
      EXPECT_EQ(e.count, 2);
    }
}

TEST(Topology, StepHasOneConcaveEdge) {
  const Topology t = make_topology(step(), kAngle);
  EXPECT_EQ(count_kind(t, EdgeKind::kConcave), 1);
  EXPECT_EQ(t.sharp_edges, 17);
  // The ends of the concave edge join two convex ones that turn: corners for the fluid outside the ends.
  EXPECT_EQ(t.corners, 12);
}

TEST(Topology, FeatureAngleIsTheLimit) {
  const Surface s = cylinder(1.0, 0.0, 1.0, 8);  // strips meet at 45 degrees
  EXPECT_EQ(make_topology(s, 46.0 * kPi / 180.0).sharp_edges, 16);
  EXPECT_EQ(make_topology(s, 44.0 * kPi / 180.0).sharp_edges, 24);
}

TEST(Topology, RimsShellsAndFins) {
  const Topology open = make_topology(box(Vec3::Zero(), Vec3::Ones(), 31), kAngle);
  int rims = 0;
  for (const Edge& e : open.edges) {
    if (e.count != 1) continue;
    ++rims;
    EXPECT_EQ(e.angle, kPi);
    EXPECT_EQ(e.kind, EdgeKind::kConvex);
  }
  EXPECT_EQ(rims, 4);
  EXPECT_EQ(make_topology(joined(box(Vec3::Zero(), Vec3::Ones()), sphere(1.0, 3)), kAngle).shells, 2);
  Surface fin;  // three half planes on the z axis, 90, 90 and 180 degrees apart
  fin.points = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0.5}, {0, 1, 0.5}, {-1, 0, 0.5}};
  fin.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const Topology t = make_topology(fin, kAngle);
  EXPECT_EQ(t.shells, 3);
  EXPECT_EQ(t.edges[0].count, 3);
  EXPECT_NEAR(t.edges[0].angle, 0.0, 1e-12);  // no gap beyond a half turn: not convex
  EXPECT_EQ(t.edges[0].kind, EdgeKind::kConcave);
}

TEST(Topology, UnweldedSeamsAreNoEdges) {
  // A cube whose top is cut in two strips that share no points, one of them also cut along its length (a T
  // junction).
  Surface top;
  top.points = {{0, 0, 1}, {0.5, 0, 1}, {0.5, 1, 1}, {0, 1, 1},    {0.5, 0, 1},
                {1, 0, 1}, {1, 1, 1},   {0.5, 1, 1}, {0.5, 0.4, 1}};
  top.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 8}, {5, 6, 8}, {6, 7, 8}};
  finish(top);
  const Surface s = joined(box(Vec3::Zero(), Vec3::Ones(), 31), top);
  const Topology t = make_topology(s, kAngle);
  int seams = 0;
  for (const Edge& e : t.edges) {
    if (e.partner == kNone) continue;
    ++seams;
    const bool middle = std::abs(s.points[static_cast<std::size_t>(e.a)][0] - 0.5) < 1e-9 &&
                        std::abs(s.points[static_cast<std::size_t>(e.b)][0] - 0.5) < 1e-9;
    EXPECT_EQ(e.kind, middle ? EdgeKind::kSmooth : EdgeKind::kConvex);
    EXPECT_NEAR(e.angle, middle ? 0.0 : kPi / 2, 1e-12);
  }
  EXPECT_EQ(seams, 3 + 10);
}

TEST(Topology, CreaseIsProlongedWhereItSoftens) {
  // A roof whose ridge opens from 60 to 30 degrees of bend along x.
  Surface s;
  const double bend[] = {60.0, 60.0, 45.0, 35.0, 35.0, 30.0, 30.0};
  for (int i = 0; i < 7; ++i) {
    const double drop = std::tan(0.5 * bend[i] * kPi / 180.0);
    s.points.emplace_back(i, 0.0, 0.0);
    s.points.emplace_back(i, -1.0, -drop);
    s.points.emplace_back(i, 1.0, -drop);
  }
  for (Index i = 0; i < 6; ++i) {
    const Index a = 3 * i;
    s.triangles.push_back({a, a + 1, a + 4});
    s.triangles.push_back({a, a + 4, a + 3});
    s.triangles.push_back({a, a + 3, a + 5});
    s.triangles.push_back({a, a + 5, a + 2});
  }
  finish(s);
  int ridge = 0;
  for (const Edge& e : make_topology(s, kAngle).edges)
    ridge += e.kind == EdgeKind::kConvex && e.count == 2 && e.a % 3 == 0 && e.b % 3 == 0;
  EXPECT_EQ(ridge, 6);
}

/// Coordinates as an STL file holds them.
Surface in_single_precision(Surface s) {
  for (Vec3& p : s.points) p = p.cast<float>().cast<double>();
  return s;
}

/// Sharp edges of an Ahmed body, of `facet`, along the line where the roof meets the slant, and how many of
/// its edges lie there.
std::array<int, 2> slant_edges(double slant_degrees, double facet) {
  ShapeOptions options;
  options.slant_degrees = slant_degrees;
  options.facet = facet;
  const Surface s = in_single_precision(make_shape("ahmed", options));
  const double x = 1.044 - 0.222 * std::cos(slant_degrees * kPi / 180.0), z = 0.338;
  const auto there = [&](Index v) {
    const Vec3& p = s.points[static_cast<std::size_t>(v)];
    return std::hypot(p[0] - x, p[2] - z) < 1e-6;
  };
  std::array<int, 2> count{};
  for (const Edge& e : make_topology(s, kAngle).edges) {
    if (!there(e.a) || !there(e.b)) continue;
    ++count[1];
    count[0] += e.kind == EdgeKind::kConvex;
  }
  return count;
}

TEST(Topology, AMildCreaseBetweenFlatFacesIsSharp) {
  for (const double slant : {8.0, 12.5, 25.0, 35.0})
    for (const double facet : {0.01, 0.05}) {
      const auto [sharp, all] = slant_edges(slant, facet);
      EXPECT_EQ(sharp, all) << slant << " " << facet;
      EXPECT_GT(all, 8);
    }
  EXPECT_EQ(slant_edges(3.0, 0.01)[0], 0);
}

/// Every facet cut into four, corners where they are.
Surface refined(const Surface& s) {
  Surface out;
  for (const auto& t : s.triangles) {
    std::array<Vec3, 3> p, m;
    for (std::size_t k = 0; k < 3; ++k) p[k] = s.points[static_cast<std::size_t>(t[k])];
    for (std::size_t k = 0; k < 3; ++k) m[k] = 0.5 * (p[k] + p[(k + 1) % 3]);
    const std::array<std::array<Vec3, 3>, 4> parts{
        {{p[0], m[0], m[2]}, {m[0], p[1], m[1]}, {m[2], m[1], p[2]}, {m[0], m[1], m[2]}}};
    for (const auto& part : parts) {
      const auto at = static_cast<Index>(out.points.size());
      out.points.insert(out.points.end(), part.begin(), part.end());
      out.triangles.push_back({at, at + 1, at + 2});
    }
  }
  finish(out);
  weld(out);
  return out;
}

TEST(Topology, FacetsOfRoundWallsMakeNoCreases) {
  for (const int n : {10, 12, 17, 30, 60}) {
    const Surface s = cylinder(1.0, 0.0, 1.0, n);
    EXPECT_EQ(make_topology(s, kAngle).sharp_edges, 2 * n) << n;
    EXPECT_EQ(make_topology(refined(s), kAngle).sharp_edges, 4 * n) << n;
  }
  for (const int n : {3, 4, 7, 20}) EXPECT_EQ(make_topology(sphere(1.0, n), kAngle).sharp_edges, 0) << n;
  for (const int n : {16, 24, 40})
    EXPECT_EQ(make_topology(torus(1.0, 0.3, 2 * n, n), kAngle).sharp_edges, 0) << n;
}

// A box with a fillet of few strips in the place of one edge.
TEST(Topology, FilletsOfFewStripsMakeNoCreases) {
  for (const int strips : {3, 4, 5}) {
    std::vector<Vec2> p{{1.0, 0.0}};
    for (int i = 0; i <= strips; ++i) {
      const double a = 0.5 * kPi * i / strips;
      p.emplace_back(0.7 + 0.3 * std::cos(a), 0.7 + 0.3 * std::sin(a));
    }
    p.emplace_back(0.0, 1.0);
    p.emplace_back(0.0, 0.0);
    std::vector<std::array<Index, 3>> fill;
    for (Index i = 1; i + 2 < static_cast<Index>(p.size()); ++i)
      fill.push_back({static_cast<Index>(p.size()) - 1, i - 1, i});
    const auto n = static_cast<Index>(p.size());
    fill.push_back({n - 1, n - 3, n - 2});
    // The outline and the three edges along y that turn by 90 degrees.
    EXPECT_EQ(make_topology(prism(p, fill, 1.0), kAngle).sharp_edges, 2 * n + 3) << strips;
  }
}

// A ramp down on a floor: one convex crease, one concave.
TEST(Topology, CreasesMayBeConcave) {
  const std::vector<Vec2> p{{-1.0, -1.0}, {2.0, -1.0}, {2.0, 0.0}, {1.0, 0.0}, {0.0, 0.3}, {-1.0, 0.3}};
  const Topology t = make_topology(prism(p, {{0, 1, 3}, {1, 2, 3}, {0, 3, 4}, {0, 4, 5}}, 1.0), kAngle);
  EXPECT_EQ(count_kind(t, EdgeKind::kConcave), 1);
  EXPECT_EQ(t.sharp_edges, 12 + 4 + 1);
}

TEST(Curvature, PrincipalFrame) {
  const Vec3 n = Vec3(1, 2, -2) / 3.0, u = n.unitOrthogonal(), v = n.cross(u);
  for (const auto& [a, b] :
       {std::pair{3.0, 1.0}, {-3.0, 1.0}, {3.0, -1.0}, {2.0, 2.0}, {0.0, 0.0}, {-1.0, -4.0}}) {
    const Frame f = principal_frame(n, to_sym<3>(Mat3(a * u * u.transpose() + b * v * v.transpose())));
    EXPECT_NEAR(std::abs(f.k1), std::max(std::abs(a), std::abs(b)), 1e-14);
    EXPECT_NEAR(f.k1 + f.k2, a + b, 1e-14);
    EXPECT_GE(std::abs(f.k1), std::abs(f.k2));
    EXPECT_NEAR(f.T1.cross(f.T2).dot(f.N), 1.0, 1e-14);
    const Mat3 again = f.k1 * f.T1 * f.T1.transpose() + f.k2 * f.T2 * f.T2.transpose();
    EXPECT_LT((again - a * u * u.transpose() - b * v * v.transpose()).norm(), 1e-13);
  }
  Sym<3> bad{};
  bad[2] = std::nan("");
  EXPECT_EQ(principal_frame(n, bad).k1, 0.0);
}

TEST(Curvature, GroupsAreSplitAtSharpEdges) {
  const Surface s = box(Vec3::Zero(), Vec3::Ones());
  const Curvature c = estimate_curvature(s, make_topology(s, kAngle));
  EXPECT_EQ(c.groups.size(), 24U);  // three per corner
  for (const VertexShape& v : c.shapes) EXPECT_NEAR(v.normal.cwiseAbs().maxCoeff(), 1.0, 1e-15);
}

TEST(Curvature, HugeFanIsLinear) {
  const Surface s = cylinder(1.0, 0.0, 1e-3, 100000);  // 100000 facets share a vertex
  const Curvature c = estimate_curvature(s, make_topology(s, kAngle));
  EXPECT_EQ(c.groups.size(), 4U * 100000U + 2U);
}

}  // namespace
}  // namespace lamina::detail
