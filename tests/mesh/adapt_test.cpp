// Laws every adapted mesh obeys, in two and three dimensions from one source, on metrics up to an aspect
// ratio of 1e4.
#include "mesh/adapt.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/score.h"
#include "mesh/seed.h"
#include "mesh/validate.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
Box<D> unit_box() {
  return {Vec<D>::Zero(), Vec<D>::Ones()};
}

// Thin layers on both sides of a plane that is not aligned with the axes.
template <int D>
class TiltedPlane : public AdaptMetric<D> {
 public:
  explicit TiltedPlane(double h_min, double h_max = 0.1) : h_min_(h_min), h_max_(h_max) {
    normal_ = Vec<D>::Ones();
    normal_[0] = 0.3;
    normal_.normalize();
  }
  // Layers that grow by 1.2, as long as they are thinner than h_max.
  std::optional<Level<D>> level(const Vec<D>& x, double floor) const override {
    const double s = normal_.dot(x - Vec<D>::Constant(0.5));
    const double k = std::log1p(0.2 * std::abs(s) / h_min_) / std::log(1.2);
    const double number = std::round(k);
    const double spacing = h_min_ * std::pow(1.2, number);
    if (spacing > h_max_ || spacing < floor) return std::nullopt;
    const double goal = std::copysign(h_min_ * (std::pow(1.2, number) - 1.0) / 0.2, s);
    Level<D> found;
    found.number = static_cast<int>(s < 0.0 ? -number : number);
    found.way = (goal - s) * normal_;
    found.normal = normal_;
    found.metric = at(x + found.way, floor);
    return found;
  }
  Metric<D> at(const Vec<D>& x, double floor) const override {
    const double s = normal_.dot(x - Vec<D>::Constant(0.5));
    const double hn = std::max(floor, std::min(h_max_, h_min_ + 0.2 * std::abs(s)));
    const double ht = std::max(floor, h_max_);
    Mat<D> axes;
    axes.row(0) = normal_.transpose();
    if constexpr (D == 2) {
      axes.row(1) = Vec2(-normal_[1], normal_[0]).transpose();
    } else {
      const Vec3 t = normal_.unitOrthogonal();
      axes.row(1) = t.transpose();
      axes.row(2) = normal_.cross(t).transpose();
    }
    Vec<D> h = Vec<D>::Constant(ht);
    h[0] = hn;
    return Metric<D>::from_frame(axes, h);
  }

 private:
  double h_min_, h_max_;
  Vec<D> normal_;
};

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

template <int D>
struct Adapted {
  Mesh<D> mesh;
  std::vector<Metric<D>> metric;
  AdaptSummary summary;
};

template <int D>
Adapted<D> adapt_unit_box(const AdaptMetric<D>& field, AdaptOptions options, double seed_size = 0.2) {
  Adapted<D> a;
  a.mesh = make_seed<D>(unit_box<D>(), seed_size, SeedKind::kLattice);
  a.summary = adapt<D>(a.mesh, field, a.metric, options);
  return a;
}

template <class T>
class Adapt : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(Adapt, Dimensions);

TYPED_TEST(Adapt, ThinLayersAreValidAndUnit) {
  constexpr int D = TypeParam::value;
  for (const double h_min : {1e-2, 1e-3, D == 2 ? 1e-5 : 1e-4}) {
    AdaptOptions options;
    options.end_size = h_min;
    const auto a = adapt_unit_box<D>(TiltedPlane<D>(h_min, 0.2), options);
    const auto v = validate<D>(a.mesh, unit_box<D>());
    EXPECT_TRUE(v.ok()) << h_min << ": " << v.summary();
    const Score s = score<D>(a.mesh, a.metric);
    EXPECT_GE(s.unit_share, 0.95) << h_min;
    EXPECT_GE(s.quality_min, options.quality_floor) << h_min;
    EXPECT_GE(s.quality_mean, 0.8) << h_min;
    EXPECT_EQ(s.points, static_cast<std::int64_t>(a.metric.size()));
  }
}

TYPED_TEST(Adapt, LayersPutVerticesOnLevels) {
  constexpr int D = TypeParam::value;
  const double h_min = 1e-3;
  AdaptOptions options;
  options.end_size = h_min;
  options.align = Align::kLayers;
  const TiltedPlane<D> field(h_min, 0.1);
  const auto a = adapt_unit_box<D>(field, options);
  const auto v = validate<D>(a.mesh, unit_box<D>());
  EXPECT_TRUE(v.ok()) << v.summary();
  const Score s = score<D>(a.mesh, a.metric);
  EXPECT_GE(s.unit_share, 0.93);
  EXPECT_GE(s.quality_min, 0.2);
  EXPECT_GE(s.quality_mean, 0.78);
  std::int64_t in_layers = 0, on_level = 0;
  for (const Vec<D>& x : a.mesh.points) {
    const auto level = field.level(x, 0.0);
    if (!level) continue;
    ++in_layers;
    on_level += level->way.norm() < 0.05 * h_min * std::pow(1.2, std::abs(level->number));
  }
  EXPECT_GT(in_layers, static_cast<std::int64_t>(a.mesh.points.size() / 2));
  EXPECT_GE(on_level, in_layers * 95 / 100);
}

// Pieces of 600 vertices: dozens of them, so that interfaces, joins and threads all matter.
TYPED_TEST(Adapt, SameBitsForEveryThreadCount) {
  constexpr int D = TypeParam::value;
  AdaptOptions options;
  options.end_size = D == 2 ? 1e-3 : 1e-2;
  options.block_vertices = 600;
  options.final_passes = 4;
  options.align = D == 3 ? Align::kLayers : Align::kAnywhere;
  const TiltedPlane<D> field(options.end_size, D == 2 ? 0.01 : 0.08);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return adapt_unit_box<D>(field, options);
  };
  const auto expected = run(1);
  ASSERT_GT(expected.mesh.points.size(), 4U * 600U);
  const auto v = validate<D>(expected.mesh, unit_box<D>());
  EXPECT_TRUE(v.ok()) << v.summary();
  for (const int threads : {2, 3, 8, 1}) {
    const auto got = run(threads);
    ASSERT_EQ(got.mesh.points.size(), expected.mesh.points.size()) << threads;
    EXPECT_EQ(got.mesh.cells, expected.mesh.cells) << threads;
    EXPECT_EQ(std::memcmp(got.mesh.points.data(), expected.mesh.points.data(),
                          sizeof(Vec<D>) * got.mesh.points.size()),
              0)
        << threads;
  }
}

TYPED_TEST(Adapt, CoarsensBackToFewCells) {
  constexpr int D = TypeParam::value;
  Mesh<D> mesh = make_seed<D>(unit_box<D>(), 0.05, SeedKind::kLattice);
  const std::size_t before = mesh.cells.size();
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.start_size = options.end_size = 0.5;
  adapt<D>(mesh, Uniform<D>(0.5), metric, options);
  EXPECT_LT(mesh.cells.size() * 20, before);
  const auto v = validate<D>(mesh, unit_box<D>());
  EXPECT_TRUE(v.ok()) << v.summary();
}

TYPED_TEST(Adapt, BoundaryTagsSurvive) {
  constexpr int D = TypeParam::value;
  AdaptOptions options;
  options.end_size = 0.05;
  const auto a = adapt_unit_box<D>(TiltedPlane<D>(0.05, 0.2), options);
  for (std::size_t f = 0; f < a.mesh.facets.size(); ++f) {
    const int axis = (a.mesh.facet_tags[f] - 1) / 2;
    for (const Index v : a.mesh.facets[f])
      EXPECT_EQ(a.mesh.points[v][axis], a.mesh.facet_tags[f] % 2 == 1 ? 0.0 : 1.0);
  }
}

// One tag all around: the flat pieces are told apart by their planes, and the tag comes back.
TYPED_TEST(Adapt, FindsTheFlatPiecesOfATag) {
  constexpr int D = TypeParam::value;
  for (const bool listed : {true, false}) {
    Mesh<D> mesh = make_seed<D>(unit_box<D>(), 0.5, SeedKind::kLattice);
    for (Index& t : mesh.facet_tags) t = 7;
    mesh.cell_tags.assign(mesh.cells.size(), 3);
    if (!listed) {
      mesh.facets.clear();
      mesh.facet_tags.clear();
    }
    std::vector<Metric<D>> metric;
    AdaptOptions options;
    options.end_size = 0.05;
    adapt<D>(mesh, TiltedPlane<D>(0.05, 0.2), metric, options);
    const auto v = validate<D>(mesh, unit_box<D>());
    EXPECT_TRUE(v.ok()) << v.summary();
    ASSERT_EQ(mesh.facets.size(), static_cast<std::size_t>(v.boundary_facets));
    ASSERT_EQ(mesh.facet_tags.size(), mesh.facets.size());
    EXPECT_EQ(mesh.cell_tags, std::vector<Index>(mesh.cells.size(), 3));
    for (const Index t : mesh.facet_tags) {
      EXPECT_GE(t, listed ? 7 : 1);
      EXPECT_LE(t, listed ? 7 : 2 * D);
    }
  }
}

TYPED_TEST(Adapt, StopsWhenAsked) {
  constexpr int D = TypeParam::value;
  class Stop : public Progress {
   public:
    bool cancelled() const override { return true; }
  };
  Stop stop;
  Mesh<D> mesh = make_seed<D>(unit_box<D>(), 0.5, SeedKind::kLattice);
  std::vector<Metric<D>> metric;
  try {
    adapt<D>(mesh, Uniform<D>(0.1), metric, AdaptOptions{}, &stop);
    FAIL() << "not cancelled";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInterrupted);
  }
}

constexpr std::size_t kSplitStats = 1;  // the place of "split" in AdaptSummary::operators

template <int D>
void expect_same_bits(const Mesh<D>& got, const Mesh<D>& expected) {
  ASSERT_EQ(got.points.size(), expected.points.size());
  EXPECT_EQ(got.cells, expected.cells);
  EXPECT_EQ(got.facets, expected.facets);
  EXPECT_EQ(got.facet_tags, expected.facet_tags);
  EXPECT_EQ(std::memcmp(got.points.data(), expected.points.data(), sizeof(Vec<D>) * got.points.size()), 0);
}

TYPED_TEST(Adapt, EndsWhereTheCallbackSays) {
  constexpr int D = TypeParam::value;
  AdaptOptions options;
  options.end_size = 0.01;
  std::vector<double> floors;
  options.after_step = [&](const AdaptStep& step, Snapshot) {
    floors.push_back(step.size_floor);
    EXPECT_EQ(step.number, static_cast<std::int64_t>(floors.size()));
    return floors.size() < 2;
  };
  const auto a = adapt_unit_box<D>(TiltedPlane<D>(0.01, 0.1), options);
  ASSERT_EQ(floors.size(), 2U);
  EXPECT_LT(floors[1], floors[0]);
  EXPECT_GT(floors[1], 0.0);
  EXPECT_EQ(a.summary.steps.size(), 2U);
  EXPECT_NE(a.summary.stopped_because.find("step 2"), std::string::npos) << a.summary.stopped_because;
  const auto v = validate<D>(a.mesh, unit_box<D>());
  EXPECT_TRUE(v.ok()) << v.summary();
  EXPECT_GE(score<D>(a.mesh, a.metric).unit_share, 0.9);
}

TYPED_TEST(Adapt, ResumesFromEveryStepInTheSameBits) {
  constexpr int D = TypeParam::value;
  for (const Align align : {Align::kAnywhere, Align::kLayers}) {
    AdaptOptions options;
    options.end_size = 0.02;
    options.align = align;
    options.block_vertices = 300;
    const TiltedPlane<D> field(0.02, 0.1);
    std::vector<std::string> snapshots;
    options.after_step = [&](const AdaptStep&, Snapshot snapshot) {
      snapshots.push_back(snapshot());
      return true;
    };
    const auto expected = adapt_unit_box<D>(field, options);
    ASSERT_GE(snapshots.size(), 3U);
    options.after_step = {};
    for (const std::string& snapshot : snapshots) {
      options.resume = snapshot;
      Adapted<D> a;  // the mesh comes from the snapshot
      a.summary = adapt<D>(a.mesh, field, a.metric, options);
      expect_same_bits(a.mesh, expected.mesh);
      ASSERT_EQ(a.summary.steps.size(), expected.summary.steps.size());
      EXPECT_EQ(a.summary.operators[kSplitStats].accepted, expected.summary.operators[kSplitStats].accepted);
    }
  }
}

TYPED_TEST(Adapt, AnAdaptedMeshIsAFixedPoint) {
  constexpr int D = TypeParam::value;
  for (const Align align : {Align::kAnywhere, Align::kLayers}) {
    AdaptOptions options;
    options.end_size = 0.02;
    options.align = align;
    const TiltedPlane<D> field(0.02, 0.1);
    auto a = adapt_unit_box<D>(field, options);
    const Mesh<D> once = a.mesh;
    const AdaptSummary summary = adapt<D>(a.mesh, field, a.metric, options);
    EXPECT_EQ(summary.steps.size(), 1U);
    expect_same_bits(a.mesh, once);
    EXPECT_EQ(a.metric.size(), a.mesh.points.size());
  }
}

// Unit, but not on levels; and unit but for one corner.
TYPED_TEST(Adapt, AUnitMeshIsAdaptedWhereItGains) {
  constexpr int D = TypeParam::value;
  AdaptOptions options;
  options.end_size = 0.02;
  const TiltedPlane<D> field(0.02, 0.1);
  const auto a = adapt_unit_box<D>(field, options);
  options.align = Align::kLayers;
  Mesh<D> mesh = a.mesh;
  std::vector<Metric<D>> metric;
  adapt<D>(mesh, field, metric, options);
  std::int64_t in_layers = 0, on_level = 0;
  for (const Vec<D>& x : mesh.points) {
    const auto level = field.level(x, 0.0);
    if (!level) continue;
    ++in_layers;
    on_level += level->metric.length(level->way) < 0.05;
  }
  EXPECT_GE(on_level, in_layers * 9 / 10);

  class FineCorner : public TiltedPlane<D> {
   public:
    FineCorner() : TiltedPlane<D>(0.02, 0.1) {}
    Metric<D> at(const Vec<D>& x, double floor) const override {
      const Metric<D> m = TiltedPlane<D>::at(x, floor);
      return x.norm() < 0.15 ? m.scaled(0.25) : m;
    }
  };
  options.align = Align::kAnywhere;
  mesh = a.mesh;
  adapt<D>(mesh, FineCorner(), metric, options);
  EXPECT_GT(mesh.points.size(), a.mesh.points.size());
  EXPECT_LT(score<D>(mesh, metric).long_share, 2e-3);
}

TYPED_TEST(Adapt, RefusesForeignSnapshots) {
  constexpr int D = TypeParam::value;
  AdaptOptions options;
  options.end_size = 0.2;
  const Uniform<D> field(0.2);
  std::string snapshot;
  options.after_step = [&](const AdaptStep&, Snapshot take) {
    snapshot = take();
    return true;
  };
  adapt_unit_box<D>(field, options);
  const auto refused = [&](std::string_view bytes, AdaptOptions with) {
    with.after_step = {};
    with.resume = bytes;
    Mesh<D> mesh;
    std::vector<Metric<D>> metric;
    try {
      adapt<D>(mesh, field, metric, with);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kAdapt);
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refused(snapshot, options));
  for (std::size_t n = 1; n < snapshot.size(); n += 1 + snapshot.size() / 50)
    EXPECT_TRUE(refused(std::string_view(snapshot).substr(0, n), options)) << n;
  EXPECT_TRUE(refused(snapshot + "x", options));
  EXPECT_TRUE(refused("not a snapshot, but long enough to be read as the head of one", options));
  AdaptOptions other = options;
  other.quality_floor = 0.2;
  EXPECT_TRUE(refused(snapshot, other));
  Mesh<5 - D> mesh;
  std::vector<Metric<5 - D>> metric;
  AdaptOptions with = options;
  with.after_step = {};
  with.resume = snapshot;
  EXPECT_THROW(adapt<5 - D>(mesh, Uniform<5 - D>(0.2), metric, with), Error);
}

}  // namespace
}  // namespace lamina
