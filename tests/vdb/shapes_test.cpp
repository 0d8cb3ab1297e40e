#include "vdb/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "vdb/surface_io.h"

namespace lamina {
namespace {

struct Cleaned {
  Surface surface;
  SurfaceReport report;
};

Cleaned cleaned(const std::string& name, const ShapeOptions& options = {}) {
  Cleaned c{make_shape(name, options), {}};
  c.report = clean(c.surface, name);
  return c;
}

/// V - E + F of a closed surface.
std::int64_t euler(const SurfaceReport& r) { return r.points - r.triangles / 2; }

/// Watertight, outward and free of flaws as built; clean() finds nothing to do.
void expect_sound(const Cleaned& c, std::int64_t shells = 1) {
  EXPECT_TRUE(c.report.watertight());
  EXPECT_EQ(c.report.misoriented_edges, 0);
  EXPECT_EQ(c.report.flipped, 0);
  EXPECT_EQ(c.report.degenerate + c.report.duplicate + c.report.nonfinite, 0);
  EXPECT_EQ(c.report.shells, shells);
  EXPECT_GT(c.report.volume, 0.0);
  EXPECT_EQ(c.surface.tags.size(), c.surface.triangles.size());
}

void expect_box(const Surface& s, const Vec3& lo, const Vec3& hi, double tolerance = 1e-12) {
  EXPECT_LT((s.bounds().lo - lo).cwiseAbs().maxCoeff(), tolerance) << s.bounds().lo.transpose();
  EXPECT_LT((s.bounds().hi - hi).cwiseAbs().maxCoeff(), tolerance) << s.bounds().hi.transpose();
}

/// Volume of the closed Ahmed body. The front loses 2 (W + H) A - 4 B with A, B the integrals of the inset d
/// and of d^2 over the length of the rounding (every section is a rectangle smaller by d all round), the rear
/// a prism.
double ahmed_volume(double slant_degrees) {
  const double r = 0.1, w = 0.389, h = 0.288, a = slant_degrees * M_PI / 180.0;
  const double inset = r * r * (1.0 - M_PI / 4.0), inset2 = r * r * r * (5.0 / 3.0 - M_PI / 2.0);
  return 1.044 * w * h - 2.0 * (w + h) * inset + 4.0 * inset2 -
         0.5 * 0.222 * 0.222 * std::sin(a) * std::cos(a) * w;
}

/// Area of the section of the NACA 0012 with sharp trailing edge: the integral of twice its half thickness.
double naca_area() {
  return 2.0 * 0.594689181 *
         (0.298222773 * 2.0 / 3.0 - 0.127125232 / 2.0 - 0.357907906 / 3.0 + 0.291984971 / 4.0 -
          0.105174606 / 5.0);
}

TEST(Shapes, ListedShapesCanBeMade) {
  const auto list = shape_list();
  EXPECT_EQ(list.size(), 8u);
  for (const auto& [name, text] : list) {
    SCOPED_TRACE(name);
    EXPECT_GT(text.size(), 10u);
    const Cleaned c = cleaned(name);
    expect_sound(c);
    EXPECT_EQ(euler(c.report), name == "torus" ? 0 : 2);
    EXPECT_EQ(c.surface.tag_names, std::vector<std::string>{name});
    EXPECT_LT(c.report.triangles, 100000);
  }
}

TEST(Shapes, BadOptionsAreNamed) {
  const auto message = [](const std::string& name, const ShapeOptions& options) -> std::string {
    try {
      make_shape(name, options);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kParameter);
      return e.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
  };
  EXPECT_NE(message("bunny", {}).find("ahmed, naca0012, sphere"), std::string::npos);
  for (const double facet : {-1.0, 1e-9, 5.0, std::nan("")})
    EXPECT_NE(message("sphere", {facet, 25.0, false}).find("facet"), std::string::npos) << facet;
  for (const double slant : {-1.0, 40.1, std::nan("")})
    EXPECT_NE(message("ahmed", {0.0, slant, false}).find("slant"), std::string::npos) << slant;
}

TEST(Shapes, VolumeConvergesToTheClosedForm) {
  const struct {
    const char* name;
    double volume;
  } cases[] = {{"sphere", M_PI / 6.0},
               {"torus", 2.0 * M_PI * M_PI * 0.35 * 0.15 * 0.15},
               {"cylinder", M_PI * 0.09 * 0.2},
               {"naca0012", 0.2 * naca_area()},
               {"ahmed", ahmed_volume(25.0)}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const Cleaned coarse = cleaned(c.name, {0.04, 25.0, false}), fine = cleaned(c.name, {0.02, 25.0, false});
    expect_sound(coarse);
    expect_sound(fine);
    const double error = std::abs(coarse.report.volume - c.volume),
                 half = std::abs(fine.report.volume - c.volume);
    // Not farther off than a layer as thick as the facets are deep (8 / 3 of the sag, equilateral ones) over
    // the whole surface; second order in the facet.
    EXPECT_LT(error, 8.0 / 3.0 * coarse.report.facet_sag * coarse.report.area);
    EXPECT_LT(half, 8.0 / 3.0 * fine.report.facet_sag * fine.report.area);
    EXPECT_LT(half, 0.35 * error);
  }
}

TEST(Shapes, PlaneShapesAreExact) {
  EXPECT_DOUBLE_EQ(cleaned("cube").report.volume, 0.125);
  EXPECT_NEAR(cleaned("plate").report.volume, 1.0 * 0.2 * 0.01, 1e-15);
  EXPECT_NEAR(cleaned("step").report.volume, 0.2 * (0.5 * 0.2 + 0.5 * 0.1), 1e-15);
  expect_box(cleaned("cube").surface, {-0.25, -0.25, -0.25}, {0.25, 0.25, 0.25});
  expect_box(cleaned("plate").surface, {0, -0.1, -0.005}, {1, 0.1, 0.005});
  expect_box(cleaned("step").surface, {0, -0.1, 0}, {1, 0.1, 0.2});
}

TEST(Shapes, PointsLieOnTheCurvedSurfaces) {
  for (const Vec3& p : make_shape("sphere", {}).points) EXPECT_NEAR(p.norm(), 0.5, 1e-15);
  for (const Vec3& p : make_shape("torus", {}).points)
    EXPECT_NEAR(std::hypot(std::hypot(p[0], p[1]) - 0.35, p[2]), 0.15, 1e-15);
  for (const Vec3& p : make_shape("cylinder", {}).points) {
    const double r = std::hypot(p[0], p[2]);
    EXPECT_TRUE(std::abs(r - 0.3) < 1e-15 || std::abs(std::abs(p[1]) - 0.1) < 1e-15) << p.transpose();
    EXPECT_LE(r, 0.3 + 1e-15);
  }
}

TEST(Shapes, FacetBoundsTheEdgesOfCurvedParts) {
  for (const double facet : {0.15, 0.05, 0.013}) {
    EXPECT_LE(cleaned("sphere", {facet, 25.0, false}).report.longest_edge, facet * (1.0 + 1e-12));
    EXPECT_LE(cleaned("torus", {facet, 25.0, false}).report.longest_edge, facet * (1.0 + 1e-12));
    const Surface s = make_shape("cylinder", {facet, 25.0, false});
    for (const auto& t : s.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& a = s.points[static_cast<std::size_t>(t[k])];
        const Vec3& b = s.points[static_cast<std::size_t>(t[(k + 1) % 3])];
        const bool mantle = std::hypot(a[0], a[2]) > 0.2999999 && std::hypot(b[0], b[2]) > 0.2999999;
        EXPECT_TRUE(!mantle || (b - a).norm() <= facet * (1.0 + 1e-12));
      }
  }
}

TEST(Shapes, NoNeedlesWhereTheyCanBeAvoided) {
  for (const char* name : {"sphere", "torus", "cylinder", "cube", "plate", "step", "ahmed"}) {
    const Surface s = make_shape(name, {});
    double worst = 1.0;
    for (const auto& t : s.triangles) {
      const Vec3& a = s.points[static_cast<std::size_t>(t[0])];
      const Vec3& b = s.points[static_cast<std::size_t>(t[1])];
      const Vec3& c = s.points[static_cast<std::size_t>(t[2])];
      const double longest2 = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
      worst = std::min(worst, (b - a).cross(c - a).norm() / longest2);  // altitude / longest edge
    }
    EXPECT_GT(worst, 0.08) << name;
  }
}

TEST(Shapes, NacaKeepsItsFormulaAndTrailingEdge) {
  const Surface s = make_shape("naca0012", {});
  const auto half = [](double x) {
    return 0.594689181 * (0.298222773 * std::sqrt(x) - 0.127125232 * x - 0.357907906 * x * x +
                          0.291984971 * x * x * x - 0.105174606 * x * x * x * x);
  };
  int trailing = 0;
  for (const Vec3& p : s.points) {
    EXPECT_NEAR(std::abs(p[2]), half(p[0]), 1e-9);
    if (p[0] == 1.0) {
      EXPECT_EQ(p[2], 0.0);
      ++trailing;
    }
  }
  EXPECT_GT(trailing, 2);
  EXPECT_NEAR(s.bounds().hi[2], 0.0594857,
              2e-6);  // 6 % near 30 % chord, scaled with the chord
  expect_box(s, {0, -0.1, -s.bounds().hi[2]}, {1, 0.1, s.bounds().hi[2]});
}

TEST(Shapes, AhmedDimensions) {
  EXPECT_NEAR(ahmed_volume(25.0), 0.110767630, 1e-9);  // the value stated with the reference file
  const Surface s = make_shape("ahmed", {});
  expect_box(s, {0, -0.1945, 0.05}, {1.044, 0.1945, 0.338});
  const double angle = 25.0 * M_PI / 180.0;
  double rear_top = 0.0, front_half = 0.0, roof_end = 0.0;
  for (const Vec3& p : s.points) {
    if (p[0] == 1.044) rear_top = std::max(rear_top, p[2]);
    if (p[0] == 0.0) front_half = std::max(front_half, p[1]);
    if (p[2] > 0.338 - 1e-9) roof_end = std::max(roof_end, p[0]);
  }
  EXPECT_NEAR(rear_top, 0.338 - 0.222 * std::sin(angle), 1e-12);
  EXPECT_NEAR(roof_end, 1.044 - 0.222 * std::cos(angle), 1e-12);
  EXPECT_NEAR(front_half, 0.1945 - 0.1, 1e-12);
}

TEST(Shapes, AhmedSlants) {
  for (const double slant : {0.0, 12.5, 35.0, 40.0}) {
    SCOPED_TRACE(slant);
    const Cleaned c = cleaned("ahmed", {0.0, slant, false});
    expect_sound(c);
    EXPECT_EQ(euler(c.report), 2);
    EXPECT_NEAR(c.report.volume, ahmed_volume(slant), 1e-5);
  }
}

TEST(Shapes, AhmedStilts) {
  const Cleaned c = cleaned("ahmed", {0.0, 25.0, true});
  expect_sound(c, 5);
  EXPECT_EQ(euler(c.report), 10);
  expect_box(c.surface, {0, -0.1945, 0}, {1.044, 0.1945, 0.338});
  EXPECT_EQ(c.surface.tag_names, (std::vector<std::string>{"ahmed", "stilts"}));
  const double stilts = 4.0 * M_PI * 0.015 * 0.015 * 0.06;
  EXPECT_NEAR(c.report.volume, ahmed_volume(25.0) + stilts, 1e-5);
  double top = 0.0;
  for (std::size_t t = 0; t < c.surface.triangles.size(); ++t)
    if (c.surface.tags[t] == 1)
      for (const Index v : c.surface.triangles[t])
        top = std::max(top, c.surface.points[static_cast<std::size_t>(v)][2]);
  EXPECT_NEAR(top, 0.06, 1e-12);
}

/// Largest distance from the points of `a` (some 600 of them) to the triangles of `b`.
double one_sided_distance(const Surface& a, const Surface& b) {
  double worst = 0.0;
  const std::size_t stride = 1 + a.points.size() / 600;
  for (std::size_t i = 0; i < a.points.size(); i += stride) {
    const Vec3& p = a.points[i];
    double best = 1e300;
    for (const auto& t : b.triangles) {
      const Vec3& o = b.points[static_cast<std::size_t>(t[0])];
      const Vec3 u = b.points[static_cast<std::size_t>(t[1])] - o,
                 v = b.points[static_cast<std::size_t>(t[2])] - o;
      const Vec3 n = u.cross(v), w = p - o;
      const double n2 = n.squaredNorm(), s = w.cross(v).dot(n) / n2, r = u.cross(w).dot(n) / n2;
      if (s >= 0.0 && r >= 0.0 && s + r <= 1.0) best = std::min(best, std::abs(w.dot(n)) / std::sqrt(n2));
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& from = b.points[static_cast<std::size_t>(t[k])];
        const Vec3 e = b.points[static_cast<std::size_t>(t[(k + 1) % 3])] - from;
        const double along = std::clamp((p - from).dot(e) / e.squaredNorm(), 0.0, 1.0);
        best = std::min(best, (p - from - along * e).norm());
      }
    }
    worst = std::max(worst, best);
  }
  return worst;
}

TEST(Shapes, MatchTheReferenceFiles) {
  const std::filesystem::path folder = std::filesystem::path(LAMINA_DATA) / "aero";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no reference data at " << folder;
  const struct {
    const char *name, *file;
    ShapeOptions options;
  } cases[] = {{"ahmed", "ref_ahmed25_body.stl", {0.015, 25.0, false}},
               {"ahmed", "ref_ahmed25_stilts_overlapping.stl", {0.015, 25.0, true}},
               {"naca0012", "ref_naca0012_tmr.stl", {0.02, 25.0, false}},
               {"cylinder", "ref_circle_d0p6.stl", {0.015, 25.0, false}}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.file);
    std::vector<std::string> warnings;
    Surface reference = read_surface(folder / c.file, warnings);
    const SurfaceReport expected = clean(reference, c.file);
    const Cleaned ours = cleaned(c.name, c.options);
    EXPECT_EQ(ours.report.shells, expected.shells);
    EXPECT_NEAR(ours.report.volume, expected.volume, 2e-4 * expected.volume);
    // Chords of circles of radius 0.1 and 0.3 cut in some 16 to 256 pieces.
    EXPECT_LT(one_sided_distance(reference, ours.surface), 4e-4);
    EXPECT_LT(one_sided_distance(ours.surface, reference), 4e-4);
  }
}

}  // namespace
}  // namespace lamina
