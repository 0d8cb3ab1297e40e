#include "vdb/surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "core/error.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

using Triangle = std::array<Index, 3>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Surface make(std::vector<Vec3> points, std::vector<Triangle> triangles) {
  Surface s;
  s.points = std::move(points);
  s.triangles = std::move(triangles);
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"part"};
  return s;
}

/// Axis-aligned box, outward, 12 triangles.
Surface box(const Vec3& lo, const Vec3& hi) {
  std::vector<Vec3> p;
  for (int i = 0; i < 8; ++i)
    p.emplace_back((i & 1) != 0 ? hi[0] : lo[0], (i & 2) != 0 ? hi[1] : lo[1], (i & 4) != 0 ? hi[2] : lo[2]);
  return make(p, {{0, 2, 3},
                  {0, 3, 1},
                  {4, 5, 7},
                  {4, 7, 6},
                  {0, 1, 5},
                  {0, 5, 4},
                  {2, 6, 7},
                  {2, 7, 3},
                  {0, 4, 6},
                  {0, 6, 2},
                  {1, 3, 7},
                  {1, 7, 5}});
}

Surface cube(const Vec3& center, double edge) {
  return box(center - Vec3::Constant(0.5 * edge), center + Vec3::Constant(0.5 * edge));
}

Surface ball(const Vec3& center, double radius, double facet = 0.1) {
  Surface s = make_shape("sphere", {facet, 25.0, false});
  for (Vec3& p : s.points) p = center + 2.0 * radius * p;
  return s;
}

Surface inverted(Surface s) {
  for (Triangle& t : s.triangles) std::swap(t[1], t[2]);
  return s;
}

Surface joined(const std::vector<Surface>& parts) {
  Surface all;
  for (const Surface& s : parts) {
    const auto shift = static_cast<Index>(all.points.size());
    all.points.insert(all.points.end(), s.points.begin(), s.points.end());
    for (const Triangle& t : s.triangles) all.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    all.tags.insert(all.tags.end(), s.triangles.size(), static_cast<Index>(all.tag_names.size()));
    all.tag_names.push_back("part " + std::to_string(all.tag_names.size()));
  }
  return all;
}

/// Every corner a point of its own, as in STL.
Surface soup(const Surface& s) {
  Surface result = make({}, {});
  for (const Triangle& t : s.triangles) {
    const auto first = static_cast<Index>(result.points.size());
    for (const Index v : t) result.points.push_back(s.points[static_cast<std::size_t>(v)]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  result.tags = s.tags;
  result.tag_names = s.tag_names;
  return result;
}

/// True when a warning holds the text.
bool warns(const SurfaceReport& report, const std::string& text) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

TEST(SurfaceBounds, EmptyAndHandValue) {
  EXPECT_TRUE(Surface{}.bounds().empty());
  const Box<3> b = make({{1, 2, 3}, {-1, 5, 0}}, {}).bounds();
  EXPECT_EQ(b.lo, Vec3(-1, 2, 0));
  EXPECT_EQ(b.hi, Vec3(1, 5, 3));
}

TEST(SurfaceClean, CubeByHand) {
  Surface s = soup(cube({0, 0, 0}, 2.0));
  const SurfaceReport r = clean(s, "cube");
  EXPECT_EQ(r.triangles_read, 12);
  EXPECT_EQ(r.triangles, 12);
  EXPECT_EQ(r.points, 8);
  EXPECT_EQ(r.shells, 1);
  EXPECT_EQ(r.flipped, 0);
  EXPECT_TRUE(r.watertight());
  EXPECT_DOUBLE_EQ(r.area, 24.0);
  EXPECT_DOUBLE_EQ(r.volume, 8.0);
  EXPECT_DOUBLE_EQ(r.shortest_edge, 2.0);
  EXPECT_DOUBLE_EQ(r.longest_edge, std::sqrt(8.0));
  EXPECT_EQ(r.facet_sag, 0.0);
  EXPECT_TRUE(r.warnings.empty()) << r.warnings.front();
}

TEST(SurfaceClean, PointsAreNumberedByFirstUseAndMinusZeroIsZero) {
  Surface s = make({{9, 9, 9}, {1, 0, 0}, {0, 1, -0.0}, {-0.0, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 0, 0}},
                   {{1, 2, 3}, {4, 5, 6}});
  const SurfaceReport r = clean(s, "two");
  ASSERT_EQ(s.points.size(), 4u);  // the unused one is gone, the rest is welded
  EXPECT_EQ(s.points[0], Vec3(1, 0, 0));
  EXPECT_EQ(s.points[1], Vec3(0, 1, 0));
  EXPECT_EQ(s.points[2], Vec3(0, 0, 0));
  EXPECT_EQ(s.points[3], Vec3(-1, 0, 0));
  for (const Vec3& p : s.points)
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(p[i] == 0.0 && std::signbit(p[i]));
  EXPECT_EQ(r.open_edges, 4);
}

TEST(SurfaceClean, NeighbouringFloatsAreNotWelded) {
  Surface s = make({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {std::nextafter(1.0, 2.0), 0, 0}, {0, 1, 0}, {1, 1, 0}},
                   {{0, 1, 2}, {3, 5, 4}});
  clean(s, "near");
  EXPECT_EQ(s.points.size(), 5u);
}

TEST(SurfaceClean, OpenEdgesAreCountedMeasuredAndPlaced) {
  Surface s = cube({0, 0, 0}, 1.0);
  s.triangles.resize(10);  // without the side x = 0.5
  s.tags.resize(10);
  const SurfaceReport r = clean(s, "open.stl");
  EXPECT_EQ(r.open_edges, 4);
  EXPECT_EQ(r.volume, 0.0);
  EXPECT_FALSE(r.watertight());
  EXPECT_TRUE(warns(r, "open.stl: not closed: 4 open edges, 4 long in all, one at (0.5, "));
}

TEST(SurfaceClean, NonFiniteTrianglesAreDropped) {
  Surface s = joined({cube({0, 0, 0}, 1.0), make({{kNan, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}),
                      make({{0, 0, 0}, {1, -kInf, 0}, {0, 1, 0}}, {{0, 1, 2}}),
                      make({{0, 0, 0}, {1, 0, 1e101}, {0, 1, 0}}, {{0, 1, 2}})});
  const SurfaceReport r = clean(s, "nan");
  EXPECT_EQ(r.nonfinite, 3);
  EXPECT_EQ(r.triangles, 12);
  EXPECT_EQ(r.points, 8);
  EXPECT_TRUE(r.watertight());
  EXPECT_TRUE(warns(r, "3 triangles dropped: coordinates that are not finite"));
}

TEST(SurfaceClean, NothingLeftIsAnError) {
  Surface s = make({{kNan, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {1, 1, 2}});
  try {
    clean(s, "bad.stl");
    FAIL() << "nothing was thrown";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kSurfaceEmpty);
    EXPECT_NE(std::string(e.what()).find("bad.stl: no usable triangle among 2: 1 with"), std::string::npos);
  }
  Surface none;
  EXPECT_THROW(clean(none, "none"), Error);
}

TEST(SurfaceClean, DegenerateThreshold) {
  // Area / longest edge^2 = h / 2: 1e-12 is the limit.
  for (const auto& [h, kept] : {std::pair{4e-12, true}, std::pair{1e-12, false}}) {
    Surface s =
        make({{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, {{0, 1, 2}, {3, 4, 5}});
    const SurfaceReport r = clean(s, "sliver");
    EXPECT_EQ(r.degenerate, kept ? 0 : 1) << h;
    EXPECT_EQ(r.triangles, kept ? 2 : 1) << h;
    EXPECT_EQ(r.points, kept ? 6 : 3) << "unused points go";
  }
}

TEST(SurfaceClean, DuplicatesKeepOne) {
  Surface s = cube({0, 0, 0}, 1.0);
  s.triangles.insert(s.triangles.end(), {{3, 0, 2}, {2, 0, 3}, {0, 2, 3}});  // all over the first triangle
  s.tags.resize(s.triangles.size());
  const SurfaceReport r = clean(s, "dup");
  EXPECT_EQ(r.duplicate, 3);
  EXPECT_EQ(r.triangles, 12);
  EXPECT_TRUE(r.watertight());
  EXPECT_DOUBLE_EQ(r.volume, 1.0);
}

TEST(SurfaceClean, DoubledSurfacesCollapseToOne) {
  for (const bool turned : {false, true}) {
    Surface s = joined({ball({0, 0, 0}, 1), turned ? inverted(ball({0, 0, 0}, 1)) : ball({0, 0, 0}, 1)});
    const SurfaceReport r = clean(s, "doubled");
    EXPECT_EQ(2 * r.duplicate, r.triangles_read);
    EXPECT_TRUE(r.watertight());
    EXPECT_EQ(r.shells, 1);
    EXPECT_GT(r.volume, 4.0);
  }
}

TEST(SurfaceClean, TwoSidedSheetCollapsesToOneSheet) {
  const Surface sheet = make({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}});
  Surface s = joined({sheet, inverted(sheet)});
  const SurfaceReport r = clean(s, "sheet");
  EXPECT_EQ(r.triangles, 2);
  EXPECT_EQ(r.open_edges, 4);
  EXPECT_TRUE(warns(r, "flat sheet"));
}

TEST(SurfaceClean, WallBetweenTouchingSolidsGoes) {
  // Two boxes over one coincident face, and a third on the other side: two walls of two pairs each.
  Surface s = joined({box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1}), box({-1, 0, 0}, {0, 1, 1})});
  const SurfaceReport r = clean(s, "row");
  EXPECT_EQ(r.duplicate, 8);
  EXPECT_EQ(r.triangles, 28);
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.shells, 1);
  EXPECT_DOUBLE_EQ(r.volume, 3.0);
}

TEST(SurfaceClean, SliverInATJunctionLeavesNoCrack) {
  // The face z = 0 of a tetrahedron cut at the middle m of its edge (1, 2), its neighbour uncut, a sliver
  // between.
  Surface s = make({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.5, 0}},
                   {{0, 2, 4}, {0, 4, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}, {1, 4, 2}});
  const SurfaceReport r = clean(s, "sliver");
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.triangles, 6);
  EXPECT_NEAR(r.volume, 1.0 / 6.0, 1e-15);
  EXPECT_TRUE(warns(r, "1 triangle without area replaced"));
}

TEST(SurfaceClean, StackedSliversLeaveNoCrack) {
  // As above with the edge (1, 2) cut at three points on one side and two slivers deep.
  Surface s =
      make({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.5, 0}, {0.75, 0.25, 0}, {0.25, 0.75, 0}},
           {{0, 2, 6},
            {0, 6, 4},
            {0, 4, 5},
            {0, 5, 1},
            {0, 1, 3},
            {0, 3, 2},
            {1, 2, 3},
            {1, 4, 2},
            {1, 5, 4},
            {4, 6, 2}});
  const SurfaceReport r = clean(s, "slivers");
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.triangles, 10);
  EXPECT_NEAR(r.volume, 1.0 / 6.0, 1e-15);
}

TEST(SurfaceOrient, RandomFlipsAreUndone) {
  const Surface reference = ball({0, 0, 0}, 1.0);
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    Surface s = reference;
    std::int64_t turned = 0;
    for (Triangle& t : s.triangles)
      if (random() % 2 == 0) {
        std::swap(t[1], t[2]);
        ++turned;
      }
    const SurfaceReport r = clean(s, "flipped");
    EXPECT_EQ(r.flipped, turned) << "seed " << seed;
    EXPECT_EQ(r.misoriented_edges, 0);
    EXPECT_GT(r.volume, 0.0);
    EXPECT_TRUE(warns(r, "turned"));
  }
}

/// Volume of `s` after clean().
double cleaned_volume(Surface s) {
  const SurfaceReport r = clean(s, "s");
  EXPECT_EQ(r.misoriented_edges, 0);
  return r.volume;
}

TEST(SurfaceOrient, CavitiesStayAndSolidsTurnOutward) {
  const Surface big = cube({0, 0, 0}, 4.0), hole = cube({0.3, 0.2, 0.1}, 2.0),
                island = cube({0.25, 0.15, 0.1}, 1.0);
  EXPECT_DOUBLE_EQ(cleaned_volume(inverted(big)), 64.0);
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({big, inverted(hole)})), 56.0);
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({inverted(hole), big})), 56.0) << "whatever the order";
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({inverted(big), hole})), 56.0) << "the file inside out";
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({big, hole})), 72.0) << "a solid within a solid is outward";
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({inverted(big), inverted(hole)})), 72.0);
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({big, inverted(hole), island})), 57.0);
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({inverted(island), hole, inverted(big)})), 57.0);
}

TEST(SurfaceOrient, ConcentricAlignedCavity) {
  // Every ray along an axis through a vertex of one meets features of the other.
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({cube({0, 0, 0}, 4.0), inverted(cube({0, 0, 0}, 2.0))})), 56.0);
  EXPECT_NEAR(cleaned_volume(joined({ball({0, 0, 0}, 2), inverted(ball({0, 0, 0}, 1))})),
              7.0 * cleaned_volume(ball({0, 0, 0}, 1)), 1e-9);
}

TEST(SurfaceOrient, InvertedSolidBesideOrAcrossAnotherTurnsOutward) {
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({cube({0, 0, 0}, 2.0), inverted(cube({5, 0, 0}, 1.0))})), 9.0);
  // Its first points are inside, its box is not: an overlap, no cavity.
  EXPECT_DOUBLE_EQ(cleaned_volume(joined({cube({0, 0, 0}, 2.0), inverted(cube({1, 0.1, 0.2}, 1.0))})), 9.0);
  // In the box of the other but outside of it.
  const double torus = cleaned_volume(make_shape("torus", {}));
  EXPECT_NEAR(cleaned_volume(joined({make_shape("torus", {}), inverted(cube({0, 0, 0}, 0.2))})),
              torus + 0.008, 1e-12);
}

TEST(SurfaceOrient, ManyCavities) {
  std::vector<Surface> parts{cube({0, 0, 0}, 10.0)};
  for (int i = 0; i < 27; ++i)
    parts.push_back(inverted(cube({3.0 * (i % 3 - 1), 3.0 * (i / 3 % 3 - 1), 3.0 * (i / 9 - 1)}, 1.0)));
  EXPECT_NEAR(cleaned_volume(joined(parts)), 973.0, 1e-9);
}

TEST(SurfaceOrient, SolidsSharingOneEdgeAreTurnedOneByOne) {
  const Surface a = box({0, 0, 0}, {1, 1, 1}), b = box({1, 1, 0}, {2, 2, 1});
  Surface s = joined({a, inverted(b)});
  const SurfaceReport r = clean(s, "edge");
  EXPECT_EQ(r.nonmanifold_edges, 1);
  EXPECT_EQ(r.open_edges, 0);
  EXPECT_FALSE(r.watertight());
  EXPECT_EQ(r.shells, 1);
  EXPECT_EQ(r.flipped, 12);
  EXPECT_DOUBLE_EQ(r.volume, 2.0);
  EXPECT_TRUE(warns(r, "1 edge with more than two triangles, one at (1, 1, 0.5)"));
}

TEST(SurfaceOrient, OpenShellSeenFromInsideIsTurned) {
  Surface s = inverted(ball({7, 0, 0}, 1.0));
  s.triangles.resize(s.triangles.size() / 2 + 100);
  s.tags.resize(s.triangles.size());
  const SurfaceReport r = clean(s, "bowl");
  EXPECT_GT(r.open_edges, 0);
  EXPECT_EQ(r.flipped, r.triangles);
}

TEST(SurfaceOrient, FlatSheetKeepsTheMajorityOfTheFile) {
  Surface s = make({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {3, 3, 0}},
                   {{0, 3, 1}, {1, 2, 3}, {1, 4, 2}});  // the first against the two others
  const SurfaceReport r = clean(s, "sheet");
  EXPECT_EQ(r.flipped, 1);
  EXPECT_EQ(s.triangles[0], (Triangle{0, 1, 2})) << "points are numbered by first use";
  EXPECT_EQ(s.points[1], Vec3(1, 0, 0));
}

TEST(SurfaceOrient, MoebiusBandIsReported) {
  Surface s = make({}, {});
  constexpr int kN = 30;
  for (int i = 0; i < kN; ++i) {
    const double u = 2.0 * M_PI * i / kN;
    for (const double w : {-0.2, 0.2}) {
      const double r = 1.0 + w * std::cos(0.5 * u);
      s.points.emplace_back(r * std::cos(u), r * std::sin(u), w * std::sin(0.5 * u));
    }
  }
  for (Index i = 0; i < kN; ++i) {
    const bool last = i + 1 == kN;
    const Index a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    s.triangles.insert(s.triangles.end(), {{a, c, b}, {b, c, d}});
  }
  s.tags.assign(s.triangles.size(), 0);
  const SurfaceReport r = clean(s, "band");
  EXPECT_EQ(r.misoriented_edges, 1);
  EXPECT_TRUE(warns(r, "one-sided"));
}

TEST(SurfaceClean, IsIdempotent) {
  Surface s = joined({ball({0, 0, 0}, 2), inverted(ball({0, 0, 0}, 1)), inverted(cube({9, 0, 0}, 1))});
  clean(s, "once");
  Surface again = s;
  const SurfaceReport r = clean(again, "twice");
  EXPECT_EQ(r.flipped + r.degenerate + r.duplicate + r.nonfinite, 0);
  EXPECT_TRUE(again.points == s.points);
  EXPECT_TRUE(again.triangles == s.triangles);
  EXPECT_TRUE(again.tags == s.tags);
}

TEST(SurfaceClean, TagsFollowTheirTriangles) {
  Surface s =
      joined({make({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}}, {{0, 1, 2}}), cube({0, 0, 0}, 1), cube({3, 0, 0}, 1)});
  clean(s, "tags");
  ASSERT_EQ(s.tags.size(), 24u);
  for (std::size_t t = 0; t < 24; ++t) EXPECT_EQ(s.tags[t], t < 12 ? 1 : 2);
  Surface untagged = cube({0, 0, 0}, 1);
  untagged.tags.clear();
  untagged.tag_names.clear();
  clean(untagged, "untagged");
  EXPECT_EQ(untagged.tags.size(), 12u);
  EXPECT_EQ(untagged.tag_names.size(), 1u);
}

/// True when a line of the repairs begins with the text.
bool repaired(const SurfaceReport& report, const std::string& text) {
  return std::any_of(report.repairs.begin(), report.repairs.end(),
                     [&](const std::string& r) { return r.starts_with(text); });
}

TEST(SurfaceReport, TellsEachRepairWithItsCountAndReason) {
  const Surface whole = joined({cube({0, 0, 0}, 2.0), inverted(cube({5, 0, 0}, 2.0)), cube({9, 0, 0}, 2.0)});
  Surface s = soup(whole);
  std::swap(s.triangles[30][1], s.triangles[30][2]);  // one of the third cube
  s.points[0][1] = std::copysign(0.0, -1.0);          // moves one copy of a corner of the first one
  s.points.insert(s.points.end(), {{kNan, 0, 0}, {0, 0, 0}});
  const auto n = static_cast<Index>(s.points.size());
  const Triangle copy = s.triangles[35];
  s.triangles.insert(s.triangles.end(), {{n - 2, 0, 3}, {n - 1, n - 1, 3}, copy});
  s.tags.resize(s.triangles.size());
  const SurfaceReport r = clean(s, "mixed");
  EXPECT_EQ(r.negative_zeros, 1);
  EXPECT_EQ(r.merged, 3 * 36 + 1 - (r.points + 1));  // the one of the triangle without area went later
  EXPECT_EQ(r.flipped, 13);
  EXPECT_EQ(r.shells_turned, 1);
  EXPECT_EQ(r.shells_mixed, 1);
  EXPECT_TRUE(repaired(r, "1 triangle dropped: coordinates that are not finite"));
  EXPECT_TRUE(repaired(r, std::to_string(r.merged) + " points merged"));
  EXPECT_TRUE(repaired(r, "1 coordinate changed from -0.0 to 0.0"));
  EXPECT_TRUE(repaired(r, "1 triangle dropped: without area"));
  EXPECT_TRUE(repaired(r, "1 triangle dropped: duplicate"));
  EXPECT_TRUE(repaired(r,
                       "13 of 36 triangles turned to orient the shells outward: 1 shell whole (inside out in "
                       "the file) and 1 shell in part (1 triangle against the others of the shell)"));
  EXPECT_EQ(r.repairs.size(), 6u);
  for (const char* harmless : {"merged", "-0.0"}) EXPECT_FALSE(warns(r, harmless));
  for (const char* told : {"not finite", "without area", "duplicate", "turned"}) EXPECT_TRUE(warns(r, told));
}

TEST(SurfaceReport, TellsWallsBetweenSolids) {
  Surface s = joined({box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1})});
  const SurfaceReport r = clean(s, "row");
  EXPECT_EQ(r.duplicate, 4);
  EXPECT_TRUE(repaired(r, "2 triangles dropped: duplicate"));
  EXPECT_TRUE(repaired(r, "2 triangles dropped: wall between touching solids"));
}

TEST(SurfaceReport, NothingToRepair) {
  Surface s = cube({0, 0, 0}, 1.0);
  EXPECT_TRUE(clean(s, "cube").repairs.empty());
}

TEST(SurfaceReport, FacetSagByHand) {
  // Two right triangles of altitudes 1 and 0.5 across their common edge, folded by theta about it.
  for (const double degrees : {0.0, 10.0, 39.0, 41.0}) {
    const double theta = degrees * M_PI / 180.0;
    Surface s = make({{0, 0, 0}, {0, 2, 0}, {-1, 0, 0}, {0.5 * std::cos(theta), 0, -0.5 * std::sin(theta)}},
                     {{0, 1, 2}, {1, 0, 3}});
    EXPECT_NEAR(clean(s, "fold").facet_sag, degrees < 40.0 ? 0.5 * theta / 8.0 : 0.0, 1e-12) << degrees;
  }
}

// e theta / 8 is the depth of a strip of a cylinder; of an equilateral facet on a sphere it is 3 / 8 of the
// depth.
TEST(SurfaceReport, FacetSagOfASphere) {
  Surface s = make_shape("sphere", {0.05, 25.0, false});
  const double sag = clean(s, "sphere").facet_sag;
  double depth = 0.0;
  for (const Triangle& t : s.triangles) {
    Vec3 center = Vec3::Zero();
    for (const Index v : t) center += s.points[static_cast<std::size_t>(v)] / 3.0;
    depth = std::max(depth, 0.5 - center.norm());
  }
  EXPECT_GT(sag, 0.3 * depth);
  EXPECT_LT(sag, 0.5 * depth);
}

TEST(SurfaceReport, FacetSagOfACylinderIsItsDepth) {
  Surface s = make_shape("cylinder", {0.04, 25.0, false});
  const SurfaceReport r = clean(s, "cylinder");
  std::int64_t around = 0;
  for (const Vec3& p : s.points) around += p[1] == -0.1 && std::hypot(p[0], p[2]) > 0.2999 ? 1 : 0;
  EXPECT_NEAR(r.facet_sag, 0.3 * (1.0 - std::cos(M_PI / static_cast<double>(around))), 0.02 * r.facet_sag);
}

TEST(SurfaceReport, WarnsOfTheUnit) {
  const auto report = [](double edge, double at) {
    Surface s = cube({at, 0, 0}, edge);
    return clean(s, "cube");
  };
  EXPECT_TRUE(report(1.0, 0).warnings.empty());
  EXPECT_TRUE(report(100.0, 0).warnings.empty());
  EXPECT_TRUE(warns(report(101.0, 0), "looks like millimetres: --unit mm"));
  EXPECT_TRUE(warns(report(1e9, 0), "huge"));
  EXPECT_TRUE(warns(report(1e-9, 0), "tiny"));
  EXPECT_TRUE(warns(report(1.0, 1e7), "from the origin"));
}

TEST(SurfaceReport, ScaleDoesNotChangeTheVerdict) {
  for (const double scale : {1e-30, 1e-9, 1.0, 1e9, 1e30}) {
    Surface s = ball({0, 0, 0}, 1.0);
    for (Vec3& p : s.points) p *= scale;
    const SurfaceReport r = clean(s, "scaled");
    EXPECT_EQ(r.degenerate, 0) << scale;
    EXPECT_TRUE(r.watertight()) << scale;
    EXPECT_GT(r.volume, 0.0) << scale;
  }
}

}  // namespace
}  // namespace lamina
