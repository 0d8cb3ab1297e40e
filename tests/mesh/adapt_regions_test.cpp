// Meshes of several regions: slabs and quarters with plane borders, a ball and a cylinder within a box,
// rings. What a cell's tag should be follows from where its centroid lies.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>

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
using Place = std::function<Index(const Vec<D>&)>;

// Fine layers along the plane x = 0.4, which borders of regions cross or follow.
template <int D>
class Layers : public AdaptMetric<D> {
 public:
  explicit Layers(double h, double thin = 1.0) : h_(h), thin_(thin) {}
  Metric<D> at(const Vec<D>& x, double floor) const override {
    Vec<D> h = Vec<D>::Constant(std::max(h_, floor));
    h[0] = std::max(floor, std::min(h_, thin_ * h_ + 0.3 * std::abs(x[0] - 0.4)));
    return Metric<D>::from_frame(Mat<D>::Identity(), h);
  }

 private:
  double h_, thin_;
};

template <int D>
Vec<D> center(const Mesh<D>& mesh, const std::array<Index, D + 1>& cell) {
  Vec<D> sum = Vec<D>::Zero();
  for (const Index v : cell) sum += mesh.points[static_cast<std::size_t>(v)] / (D + 1);
  return sum;
}

template <int D>
void tag_cells(Mesh<D>& mesh, const Place<D>& place) {
  for (const auto& cell : mesh.cells) mesh.cell_tags.push_back(place(center<D>(mesh, cell)));
}

template <int D>
std::map<Index, double> volumes(const Mesh<D>& mesh) {
  std::map<Index, double> sums;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    Mat<D> edges;
    for (int k = 0; k < D; ++k)
      edges.col(k) = mesh.points[mesh.cells[c][k + 1]] - mesh.points[mesh.cells[c][0]];
    sums[mesh.cell_tags[c]] += edges.determinant() / (D == 2 ? 2.0 : 6.0);
  }
  return sums;
}

// Facets between cells of two tags, as the cell of the lower tag sees them.
template <int D>
std::vector<std::array<Index, D>> borders(const Mesh<D>& mesh) {
  std::map<std::array<Index, D>, std::vector<std::pair<Index, std::array<Index, D>>>> seen;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (const auto& corners : kCellFacets<D>) {
      std::array<Index, D> f;
      for (int k = 0; k < D; ++k) f[k] = mesh.cells[c][corners[k]];
      std::array<Index, D> key = f;
      std::sort(key.begin(), key.end());
      seen[key].emplace_back(mesh.cell_tags[c], f);
    }
  }
  std::vector<std::array<Index, D>> out;
  for (auto& [key, sides] : seen) {
    std::sort(sides.begin(), sides.end());
    if (sides.size() == 2 && sides[0].first != sides[1].first) out.push_back(sides[0].second);
  }
  return out;
}

/// visit(x) at points all over the facets.
template <int D, class Visit>
void sample(const Mesh<D>& mesh, const std::vector<std::array<Index, D>>& facets, Visit&& visit) {
  for (const auto& f : facets) sample_facet<D>(mesh, f, visit);
}

// A lattice of [-1, 1]^D whose squares around the axis of the first `round` coordinates become circles (2) or
// whose cubes become balls (3) up to a radius of 1/2; tag 2 within it, 1 outside.
template <int D>
Mesh<D> round_core(int n, int round) {
  Mesh<D> mesh = lattice<D>(n);
  const auto part = [&](Vec<D> x) {
    for (int k = round; k < D; ++k) x[k] = 0.0;
    return x;
  };
  for (Vec<D>& x : mesh.points) x = 2.0 * x - Vec<D>::Ones();
  tag_cells<D>(mesh, [&](const Vec<D>& x) { return part(x).cwiseAbs().maxCoeff() < 0.5 ? 2 : 1; });
  for (Vec<D>& x : mesh.points) {
    const Vec<D> y = part(x);
    const double m = y.cwiseAbs().maxCoeff();
    if (m == 0.0) continue;
    const double square = std::max(0.0, 2.0 * m - 1.0);
    x += (square + (1.0 - square) * m / y.norm() - 1.0) * y;
  }
  return mesh;
}

template <class T>
class AdaptRegions : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(AdaptRegions, Dimensions);

// A wall, a T of three regions, a chequered cross, a block within.
template <int D>
std::vector<Place<D>> plane_places() {
  return {[](const Vec<D>& x) { return x[0] < 0.5 ? 7 : 3; },
          [](const Vec<D>& x) { return x[0] < 0.5   ? 1
                                       : x[1] < 0.5 ? 2
                                                    : 3; },
          [](const Vec<D>& x) { return (x[0] < 0.5) == (x[1] < 0.5) ? 1 : 2; },
          [](const Vec<D>& x) { return (x - Vec<D>::Constant(0.5)).cwiseAbs().maxCoeff() < 0.25 ? 9 : -1; }};
}

TYPED_TEST(AdaptRegions, KeepsPlanesBetweenThemExactly) {
  constexpr int D = TypeParam::value;
  for (const auto& place : plane_places<D>()) {
    for (const double size : {D == 2 ? 0.04 : 0.1, 0.4}) {
      Mesh<D> mesh = lattice<D>(8);
      tag_cells<D>(mesh, place);
      const auto before = volumes<D>(mesh);
      std::vector<Metric<D>> metric;
      AdaptOptions options;
      options.end_size = 0.2 * size;
      adapt<D>(mesh, Layers<D>(size, 0.2), metric, options);
      const Validation v = validate<D>(mesh, Box<D>{Vec<D>::Zero(), Vec<D>::Ones()});
      EXPECT_TRUE(v.ok()) << v.summary();
      ASSERT_EQ(mesh.cell_tags.size(), mesh.cells.size());
      for (std::size_t c = 0; c < mesh.cells.size(); ++c)
        ASSERT_EQ(mesh.cell_tags[c], place(center<D>(mesh, mesh.cells[c])));
      const auto after = volumes<D>(mesh);
      ASSERT_EQ(after.size(), before.size());
      for (const auto& [tag, volume] : before) EXPECT_NEAR(after.at(tag), volume, 1e-13) << tag;
      EXPECT_EQ(mesh.facets.size(), static_cast<std::size_t>(v.boundary_facets));
      const Score s = score<D>(mesh, metric);
      EXPECT_GE(s.quality_min, 0.2);
      EXPECT_GE(s.unit_share, size < 0.4 ? 0.95 : 0.0);
    }
  }
}

TYPED_TEST(AdaptRegions, FollowsCurvedBordersWithinTheTolerance) {
  constexpr int D = TypeParam::value;
  constexpr double kRadius = 0.5;
  const double tolerance = 4e-3;
  for (const int round : D == 2 ? std::vector{2} : std::vector{2, 3}) {
    const Mesh<D> input = round_core<D>(D == 2 ? 32 : 16, round);
    const auto distance = [&](const Vec<D>& x) {
      return round == 2 ? x.template head<2>().norm() - kRadius : x.norm() - kRadius;
    };
    double sagitta = 0.0;
    sample<D>(input, borders<D>(input), [&](const Vec<D>& x) { sagitta = std::max(sagitta, -distance(x)); });
    ASSERT_LT(sagitta, D == 2 ? 0.01 : 0.03);
    for (const double size : {D == 2 ? 0.05 : 0.15, 0.6}) {
      std::vector<Metric<D>> metric;
      const Mesh<D> mesh = followed<D>(input, Layers<D>(size), size, tolerance, metric);
      const auto facets = borders<D>(mesh);
      ASSERT_FALSE(facets.empty());
      sample<D>(mesh, facets, [&](const Vec<D>& x) {
        EXPECT_LE(distance(x), tolerance);
        EXPECT_GE(distance(x), -sagitta - 1.1 * tolerance);
      });
      for (const auto& f : facets)
        for (const Index p : f) {
          EXPECT_LE(distance(mesh.points[p]), 1e-12);
          EXPECT_GE(distance(mesh.points[p]), -sagitta - 1e-12);
        }
      const auto before = volumes<D>(input), after = volumes<D>(mesh);
      const double area = round == 3 ? std::numbers::pi : (D == 2 ? 1.0 : 2.0) * std::numbers::pi;
      ASSERT_EQ(after.size(), 2U);
      EXPECT_NEAR(after.at(2), before.at(2), area * tolerance) << round << " " << size;
      EXPECT_NEAR(after.at(1) + after.at(2), std::pow(2.0, D), 1e-12);
      for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
        const double d = distance(center<D>(mesh, mesh.cells[c]));
        if (std::abs(d) > sagitta + tolerance) {
          ASSERT_EQ(mesh.cell_tags[c], d < 0.0 ? 2 : 1);
        }
      }
      const Score s = score<D>(mesh, metric);
      EXPECT_GE(s.quality_min, size < 0.6 ? 0.2 : AdaptOptions().quality_floor) << round;
      EXPECT_GE(s.unit_share, size < 0.6 ? 0.97 : 0.0) << round;
      if (size == 0.6) {
        EXPECT_LT(facets.size(), borders<D>(input).size()) << round;
      }
    }
  }
}

// Rings of one tag each, cut by a ray: three curved pieces meet along lines, which reach the flat ends.
TYPED_TEST(AdaptRegions, KeepsLinesWhereCurvedBordersMeet) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = lattice<D>(12);
  const Place<D> place = [](const Vec<D>& x) { return x[0] < 0.5 ? 1 : x[1] < 0.5 ? 2 : 3; };
  tag_cells<D>(mesh, place);
  const auto bent = [](double r, double y) { return 0.5 * std::numbers::pi * y + 0.3 * (r - 0.5); };
  for (Vec<D>& x : mesh.points) {
    const double r = 0.5 + 0.5 * x[0], angle = bent(r, x[1]);
    x.template head<2>() = r * Vec2(std::cos(angle), std::sin(angle));
  }
  // One tag of the outer boundary, so that its smooth sides are cut by nothing but the borders.
  for (Index& t : mesh.facet_tags) t = (t + 1) / 2;
  const auto before = volumes<D>(mesh);
  const double whole = validate<D>(mesh).volume;
  const double tolerance = 4e-3, sagitta = 1.0 - std::cos(std::numbers::pi / 48.0);
  std::vector<Metric<D>> metric;
  const double size = D == 2 ? 0.02 : 0.08;
  mesh = followed<D>(std::move(mesh), Layers<D>(size), size, tolerance, metric);
  EXPECT_NEAR(validate<D>(mesh).volume, whole, 4.0 * tolerance);
  const auto after = volumes<D>(mesh);
  ASSERT_EQ(after.size(), 3U);
  for (const auto& [tag, volume] : before) EXPECT_NEAR(after.at(tag), volume, 2.5 * tolerance) << tag;
  sample<D>(mesh, borders<D>(mesh), [&](const Vec<D>& x) {
    const double r = x.template head<2>().norm();
    const double off = std::abs(r - 0.75), aside = r * std::abs(std::atan2(x[1], x[0]) - bent(r, 0.5));
    EXPECT_LE(std::min(off, aside), sagitta + 1.5 * tolerance);
    if (r < 0.75 - sagitta - tolerance) ADD_FAILURE() << "a border in the inner ring at radius " << r;
  });
  const Score s = score<D>(mesh, metric);
  EXPECT_GE(s.quality_min, 0.2);
  EXPECT_GE(s.unit_share, 0.97);
}

TYPED_TEST(AdaptRegions, SameBitsForEveryThreadCountAndAFixedPoint) {
  constexpr int D = TypeParam::value;
  const Mesh<D> input = round_core<D>(D == 2 ? 16 : 8, 2);
  AdaptOptions options;
  options.end_size = D == 2 ? 0.02 : 0.1;
  options.block_vertices = 600;
  options.hausdorff = 0.01;
  const Layers<D> field(options.end_size);
  std::vector<std::string> snapshots;
  const auto run = [&](int threads, const Mesh<D>& from, std::string_view resume) {
    const ThreadLimit limit(threads);
    Mesh<D> mesh = from;
    std::vector<Metric<D>> metric;
    AdaptOptions o = options;
    o.resume = resume;
    if (threads == 1 && resume.empty()) {
      o.after_step = [&](const AdaptStep&, Snapshot snapshot) {
        snapshots.push_back(snapshot());
        return true;
      };
    }
    adapt<D>(mesh, field, metric, o);
    return mesh;
  };
  const auto compare = [&](const Mesh<D>& got, const Mesh<D>& expected) {
    ASSERT_EQ(got.points.size(), expected.points.size());
    EXPECT_EQ(got.cells, expected.cells);
    EXPECT_EQ(got.cell_tags, expected.cell_tags);
    EXPECT_EQ(got.facets, expected.facets);
    EXPECT_EQ(std::memcmp(got.points.data(), expected.points.data(), sizeof(Vec<D>) * got.points.size()), 0);
  };
  const Mesh<D> expected = run(1, input, {});
  ASSERT_GT(expected.points.size(), 2U * 600U);
  ASSERT_FALSE(snapshots.empty());
  compare(run(2, input, snapshots.front()), expected);
  for (const int threads : {2, 3, 8}) compare(run(threads, input, {}), expected);
  options.block_vertices = AdaptOptions{}.block_vertices;
  const Mesh<D> settled = run(2, input, {});
  compare(run(2, settled, {}), settled);
}

// Facets between regions come back with their tags; where cells have one tag, those cut it in two.
TYPED_TEST(AdaptRegions, KeepsTaggedFacetsWithin) {
  constexpr int D = TypeParam::value;
  const Place<D> place = plane_places<D>()[3];
  for (const bool tagged_cells : {true, false}) {
    Mesh<D> mesh = lattice<D>(8);
    tag_cells<D>(mesh, place);
    for (const auto& f : borders<D>(mesh)) {
      mesh.facets.push_back(f);
      mesh.facet_tags.push_back(mesh.points[f[0]][0] == mesh.points[f[D - 1]][0] ? 40 : 41);
    }
    mesh.facet_names = {{40, "sides"}, {41, "rest"}};
    mesh.cell_names = {{9, "core"}};
    if (!tagged_cells) mesh.cell_tags.assign(mesh.cells.size(), 5);
    std::vector<Metric<D>> metric;
    AdaptOptions options;
    options.end_size = 0.1;
    adapt<D>(mesh, Layers<D>(0.1), metric, options);
    const Validation v = validate<D>(mesh);
    EXPECT_TRUE(v.ok()) << v.summary();
    EXPECT_EQ(mesh.facet_names.at(40), "sides");
    EXPECT_EQ(mesh.cell_names.at(9), "core");
    double sides = 0.0, area = 0.0;
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
      if (mesh.facet_tags[f] < 40) continue;
      std::array<Vec<D>, D> x;
      for (int k = 0; k < D; ++k) x[k] = mesh.points[mesh.facets[f][k]];
      for (const Vec<D>& p : x) EXPECT_NEAR((p - Vec<D>::Constant(0.5)).cwiseAbs().maxCoeff(), 0.25, 1e-15);
      double a = (x[1] - x[0]).norm();
      if constexpr (D == 3) a = 0.5 * Vec3(x[1] - x[0]).cross(Vec3(x[2] - x[0])).norm();
      (mesh.facet_tags[f] == 40 ? sides : area) += a;
    }
    EXPECT_NEAR(sides + area, D == 2 ? 2.0 : 1.5, 1e-12);
    if (D == 2) {
      EXPECT_NEAR(sides, 1.0, 1e-12);
    }
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
      ASSERT_EQ(mesh.cell_tags[c], tagged_cells ? place(center<D>(mesh, mesh.cells[c])) : 5);
  }
}

TYPED_TEST(AdaptRegions, RefusesTaggedFacetsThatEndWithin) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = lattice<D>(4);
  tag_cells<D>(mesh, [](const Vec<D>& x) { return x[0] < 0.5 ? 1 : 2; });
  const auto wall = borders<D>(mesh);
  mesh.facets.push_back(wall.front());
  mesh.facet_tags.push_back(8);
  mesh.cell_tags.assign(mesh.cells.size(), 1);
  std::vector<Metric<D>> metric;
  try {
    adapt<D>(mesh, Layers<D>(0.2), metric, AdaptOptions{});
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kAdapt);
    EXPECT_NE(std::string(e.what()).find("(0.5, "), std::string::npos) << e.what();
  }
}

TYPED_TEST(AdaptRegions, DropsTheTagsOfCellsWhenAsked) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = lattice<D>(6);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) mesh.cell_tags.push_back(static_cast<Index>(c % 3));
  Mesh<D> plain = mesh;
  plain.cell_tags.clear();
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.end_size = 0.1;
  options.keep_cell_tags = false;
  adapt<D>(mesh, Layers<D>(0.1), metric, options);
  adapt<D>(plain, Layers<D>(0.1), metric, options);
  EXPECT_TRUE(mesh.cell_tags.empty());
  EXPECT_EQ(mesh.cells, plain.cells);
}

}  // namespace
}  // namespace lamina
