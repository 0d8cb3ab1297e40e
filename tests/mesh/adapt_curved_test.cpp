// Boundaries that are not boxes: discs and balls, sectors of rings, many pieces. Distances are measured from
// the circles and spheres that the points of the input lie on, not from its facets.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/adapt.h"
#include "mesh/score.h"
#include "mesh/validate.h"
#include "tests/mesh/followed.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
class Uniform : public AdaptMetric<D> {
 public:
  explicit Uniform(double h) : h_(h) {}
  Metric<D> at(const Vec<D>&, double floor) const override {
    return Metric<D>::isotropic(std::max(h_, floor));
  }

 private:
  double h_;
};

// Shells of a cube become shells of a ball of radius 1; one tag.
template <int D>
Mesh<D> ball(int n) {
  Mesh<D> mesh = lattice<D>(n);
  for (Vec<D>& x : mesh.points) {
    const Vec<D> y = 2.0 * x - Vec<D>::Ones();
    x = y.norm() > 0.0 ? Vec<D>(y * (y.cwiseAbs().maxCoeff() / y.norm())) : y;
  }
  std::fill(mesh.facet_tags.begin(), mesh.facet_tags.end(), 5);
  return mesh;
}

// Radii 1/2 (tag 1) to 1 (tag 2) in the first quadrant; flat sides 3, 4, in 3D 5, 6.
template <int D>
Mesh<D> sector(int n) {
  Mesh<D> mesh = lattice<D>(n);
  for (Vec<D>& x : mesh.points) {
    const double r = 0.5 + 0.5 * x[0], angle = 0.5 * std::numbers::pi * x[1];
    const double c = x[1] == 1.0 ? 0.0 : std::cos(angle), s = x[1] == 0.0 ? 0.0 : std::sin(angle);
    x.template head<2>() = r * Vec2(c, s);
  }
  return mesh;
}

template <int D>
double volume(const Mesh<D>& mesh) {
  return validate<D>(mesh).volume;
}

/// visit(x, tag) at points all over the boundary.
template <int D, class Visit>
void sample_boundary(const Mesh<D>& mesh, Visit&& visit) {
  for (std::size_t f = 0; f < mesh.facets.size(); ++f)
    sample_facet<D>(mesh, mesh.facets[f], [&](const Vec<D>& x) { visit(x, mesh.facet_tags[f]); });
}

template <class T>
class AdaptCurved : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(AdaptCurved, Dimensions);

// Each round coarser than the one before, which would lose a tolerance each.
TYPED_TEST(AdaptCurved, RoundsThatFollowOneInputDoNotAddUpTolerances) {
  constexpr int D = TypeParam::value;
  const Mesh<D> input = ball<D>(D == 2 ? 20 : 8);
  double sagitta = 0.0;
  sample_boundary<D>(input, [&](const Vec<D>& x, Index) { sagitta = std::max(sagitta, 1.0 - x.norm()); });
  constexpr double kTolerance = 1e-2;
  Mesh<D> mesh = input;
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.hausdorff = kTolerance;
  options.keep_shape = true;
  for (const double size : {0.15, 0.3, 0.6}) {
    options.end_size = size;
    options.follow = adapt<D>(mesh, Uniform<D>(size), metric, options).shape;
    ASSERT_NE(options.follow, nullptr);
    EXPECT_TRUE(validate<D>(mesh).ok());
    sample_boundary<D>(mesh, [&](const Vec<D>& x, Index tag) {
      EXPECT_EQ(tag, 5);
      EXPECT_GE(x.norm(), 1.0 - sagitta - kTolerance);
    });
    // Points lie on the input itself.
    for (const auto& f : mesh.facets)
      for (const Index p : f) EXPECT_GE(mesh.points[p].norm(), 1.0 - sagitta - 1e-12);
  }
  mesh = input;
  EXPECT_THROW(adapt<D>(mesh, Uniform<D>(0.3), metric, options), Error);
}

TYPED_TEST(AdaptCurved, StaysOnASphereWithinTheTolerance) {
  constexpr int D = TypeParam::value;
  const Mesh<D> input = ball<D>(D == 2 ? 20 : 8);
  double sagitta = 0.0;
  sample_boundary<D>(input, [&](const Vec<D>& x, Index) { sagitta = std::max(sagitta, 1.0 - x.norm()); });
  for (const double tolerance : {2e-2, 4e-3}) {
    for (const double size : {D == 2 ? 0.03 : 0.12, 0.5}) {
      std::vector<Metric<D>> metric;
      const Mesh<D> mesh = followed<D>(input, Uniform<D>(size), size, tolerance, metric);
      ASSERT_EQ(mesh.facets.size(), static_cast<std::size_t>(validate<D>(mesh).boundary_facets));
      // A closed surface between two concentric spheres is as near to each as they are to each other.
      sample_boundary<D>(mesh, [&](const Vec<D>& x, Index tag) {
        EXPECT_EQ(tag, 5);
        EXPECT_LE(x.norm(), 1.0 + 1e-12);
        EXPECT_GE(x.norm(), 1.0 - sagitta - tolerance);
      });
      for (const auto& f : mesh.facets)
        for (const Index p : f) EXPECT_GE(mesh.points[p].norm(), 1.0 - sagitta - 1e-12);
      const double area = D == 2 ? 2.0 * std::numbers::pi : 4.0 * std::numbers::pi;
      EXPECT_NEAR(volume<D>(mesh), volume<D>(input), area * tolerance);
      const Score s = score<D>(mesh, metric);
      EXPECT_GE(s.quality_min, 0.2) << tolerance << " " << size;
      if (size < 0.5) {
        EXPECT_GE(s.unit_share, 0.98) << tolerance;
      } else {
        EXPECT_LT(2 * mesh.facets.size(), 3 * input.facets.size()) << tolerance;
      }
    }
  }
}

TYPED_TEST(AdaptCurved, KeepsPlanesCornersAndRidgesBesideCurvedPieces) {
  constexpr int D = TypeParam::value;
  const Mesh<D> input = sector<D>(10);
  const double tolerance = 2e-3, sagitta = 1.0 - std::cos(0.025 * std::numbers::pi);
  for (const double size : {0.05, 0.5}) {
    std::vector<Metric<D>> metric;
    const Mesh<D> mesh = followed<D>(input, Uniform<D>(size), size, tolerance, metric);
    sample_boundary<D>(mesh, [&](const Vec<D>& x, Index tag) {
      const double r = x.template head<2>().norm();
      ASSERT_GE(tag, 1);
      ASSERT_LE(tag, 2 * D);
      if (tag <= 2) {
        EXPECT_NEAR(r, 0.5 * tag, sagitta + tolerance);
      } else {
        EXPECT_NEAR(tag <= 4 ? x[4 - tag] : x[D - 1] - (tag - 5), 0.0, 1e-15) << tag;
      }
    });
    // Ridges: the pieces at the flat ends are as large as they were.
    std::array<double, 7> area{}, before{};
    const auto measure = [](const Mesh<D>& m, std::array<double, 7>& sums) {
      for (std::size_t f = 0; f < m.facets.size(); ++f) {
        const Vec<D> e = m.points[m.facets[f][1]] - m.points[m.facets[f][0]];
        double a = e.norm();
        if constexpr (D == 3)
          a = 0.5 * e.cross(Vec3(m.points[m.facets[f][2]] - m.points[m.facets[f][0]])).norm();
        sums[static_cast<std::size_t>(m.facet_tags[f])] += a;
      }
    };
    measure(mesh, area);
    measure(input, before);
    for (std::size_t tag = 3; tag <= 2 * D; ++tag)
      EXPECT_NEAR(area[tag], before[tag], tag <= 4 ? 1e-12 : 3.0 * tolerance) << tag;
    for (const double r : {0.5, 1.0}) {
      for (const Vec2& corner : {Vec2(r, 0.0), Vec2(0.0, r)}) {
        Vec<D> x = Vec<D>::Zero();
        x.template head<2>() = corner;
        EXPECT_NE(std::find(mesh.points.begin(), mesh.points.end(), x), mesh.points.end());
      }
    }
    const Score s = score<D>(mesh, metric);
    EXPECT_GE(s.quality_min, 0.2) << size;
    EXPECT_GE(s.unit_share, size < 0.5 ? 0.98 : 0.0);
  }
}

TYPED_TEST(AdaptCurved, SameBitsForEveryThreadCountAndFromEveryStep) {
  constexpr int D = TypeParam::value;
  const Mesh<D> input = sector<D>(8);
  AdaptOptions options;
  options.end_size = D == 2 ? 0.01 : 0.05;
  options.block_vertices = 600;
  options.final_passes = 3;
  std::vector<std::string> snapshots;
  options.after_step = [&](const AdaptStep&, Snapshot snapshot) {
    snapshots.push_back(snapshot());
    return true;
  };
  const auto run = [&](int threads, std::string_view resume) {
    const ThreadLimit limit(threads);
    Mesh<D> mesh = input;
    std::vector<Metric<D>> metric;
    AdaptOptions o = options;
    o.resume = resume;
    if (threads > 1 || !resume.empty()) o.after_step = {};
    adapt<D>(mesh, Uniform<D>(options.end_size), metric, o);
    return mesh;
  };
  const Mesh<D> expected = run(1, {});
  ASSERT_GT(expected.points.size(), 2U * 600U);
  const auto compare = [&](const Mesh<D>& got) {
    ASSERT_EQ(got.points.size(), expected.points.size());
    EXPECT_EQ(got.cells, expected.cells);
    EXPECT_EQ(got.facet_tags, expected.facet_tags);
    EXPECT_EQ(std::memcmp(got.points.data(), expected.points.data(), sizeof(Vec<D>) * got.points.size()), 0);
  };
  for (const int threads : {2, 8}) compare(run(threads, {}));
  ASSERT_FALSE(snapshots.empty());
  compare(run(1, snapshots.front()));
}

// Each square (in 2D segment) of the boundary of the lattice is a piece of its own.
TYPED_TEST(AdaptCurved, KeepsMorePiecesThanAWordHasBits) {
  constexpr int D = TypeParam::value;
  constexpr int kSide = D == 2 ? 20 : 4;
  Mesh<D> mesh = lattice<D>(kSide);
  const auto place = [&](const Mesh<D>& m, std::size_t f) {
    Vec<D> center = Vec<D>::Zero();
    for (const Index v : m.facets[f]) center += m.points[v] / D;
    return center;
  };
  const auto tag_at = [&](const Vec<D>& x) {
    Index tag = 0;
    for (int k = 0; k < D; ++k)
      tag = tag * (kSide + 2) + (x[k] == 0.0   ? 0
                                 : x[k] == 1.0 ? kSide + 1
                                               : 1 + static_cast<Index>(x[k] * kSide));
    return tag;
  };
  for (std::size_t f = 0; f < mesh.facets.size(); ++f) mesh.facet_tags[f] = 1 + tag_at(place(mesh, f));
  const std::set<Index> before(mesh.facet_tags.begin(), mesh.facet_tags.end());
  ASSERT_GT(before.size(), 64U);
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.end_size = 0.5 / kSide;
  adapt<D>(mesh, Uniform<D>(options.end_size), metric, options);
  const Validation v = validate<D>(mesh, Box<D>{Vec<D>::Zero(), Vec<D>::Ones()});
  EXPECT_TRUE(v.ok()) << v.summary();
  for (std::size_t f = 0; f < mesh.facets.size(); ++f)
    EXPECT_EQ(mesh.facet_tags[f], 1 + tag_at(place(mesh, f)));
  EXPECT_EQ(std::set<Index>(mesh.facet_tags.begin(), mesh.facet_tags.end()), before);
  EXPECT_GE(score<D>(mesh, metric).quality_min, 0.2);
}

// A roof of 15 degrees has points within its planes: it is no curved surface, and its crease stays.
TYPED_TEST(AdaptCurved, KeepsAFlatCreaseBetweenPlanes) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = lattice<D>(8);
  const double slope = std::tan(std::numbers::pi / 12.0);
  const auto roof = [&](const Vec<D>& x) { return 1.0 + slope * std::min(x[0], 1.0 - x[0]); };
  for (Vec<D>& x : mesh.points) x[1] *= roof(x);
  const double before = volume<D>(mesh);
  std::vector<Metric<D>> metric;
  mesh = followed<D>(std::move(mesh), Uniform<D>(0.3), 0.3, 0.1, metric);
  EXPECT_NEAR(volume<D>(mesh), before, 1e-12);
  EXPECT_LT(mesh.points.size(), D == 2 ? 40U : 150U);
  for (std::size_t f = 0; f < mesh.facets.size(); ++f)
    for (const Index p : mesh.facets[f])
      EXPECT_NEAR(mesh.facet_tags[f] == 4 ? mesh.points[p][1] - roof(mesh.points[p]) : 0.0, 0.0, 1e-14);
}

// One smooth piece whose sides come closer than cells are long.
TYPED_TEST(AdaptCurved, ThinBodiesKeepTheirTwoSidesApart) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = ball<D>(D == 2 ? 16 : 8);
  constexpr double kThin = 0.02;
  for (Vec<D>& x : mesh.points) x[D - 1] *= kThin;
  const double before = volume<D>(mesh);
  std::vector<Metric<D>> metric;
  constexpr double kTolerance = 2e-3;
  mesh = followed<D>(std::move(mesh), Uniform<D>(0.2), 0.2, kTolerance, metric);
  const double area = D == 2 ? 4.0 : 2.0 * std::numbers::pi;
  EXPECT_NEAR(volume<D>(mesh), before, area * kTolerance);
}

}  // namespace
}  // namespace lamina
