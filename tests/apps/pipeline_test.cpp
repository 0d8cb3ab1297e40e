#include "apps/pipeline/pipeline.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/pipeline/plan.h"
#include "core/error.h"
#include "mesh/io.h"
#include "mesh/solution.h"
#include "vdb/shapes.h"
#include "vdb/surface_io.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

/// A sphere of radius 0.5 at the origin, coarse enough for tests.
const Body& sphere() {
  static const Body body = [] {
    ShapeOptions shape;
    shape.facet = 0.1;
    Surface surface = make_shape("sphere", shape);
    SurfaceReport report = clean(surface, "sphere");
    LevelSetOptions options;
    options.voxel = 0.04;
    return Body{.level_set = LevelSet::from_surface(std::move(surface), options), .surface = report};
  }();
  return body;
}

Case sphere_case() {
  Case c;
  c.body = "sphere.stl";
  c.flow.h_min = 0.01;
  return c;
}

std::string resolve_error(const Case& c, ErrorCode code) {
  try {
    static_cast<void>(resolve_case(c, sphere()));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

bool mentions(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines)
    if (line.find(words) != std::string::npos) return true;
  return false;
}

TEST(Resolve, DefaultsAreMultiplesOfTheBody) {
  const ResolvedCase r = resolve_case(sphere_case(), sphere());
  const Box<3> b = sphere().level_set.bounds();
  const double extent = b.size().maxCoeff();
  EXPECT_NEAR(extent, 1.0, 0.02);
  EXPECT_DOUBLE_EQ(r.layer.length, extent);
  EXPECT_DOUBLE_EQ(r.sizes.domain.lo[0], b.lo[0] - 2.0 * extent);
  EXPECT_DOUBLE_EQ(r.sizes.domain.hi[0], b.hi[0] + 4.0 * extent);
  EXPECT_DOUBLE_EQ(r.sizes.domain.lo[1], b.lo[1] - 2.0 * extent);
  EXPECT_DOUBLE_EQ(r.sizes.domain.hi[2], b.hi[2] + 2.0 * extent);
  EXPECT_DOUBLE_EQ(r.sizes.h2, extent / 20.0);
  EXPECT_DOUBLE_EQ(r.sizes.h1, extent / 2.0);
  // delta = .38 L Re^-1/5 = .038 L: a quarter of the extent is the larger margin.
  EXPECT_DOUBLE_EQ(r.sizes.box2.lo[0], b.lo[0] - 0.25 * extent);
}

TEST(Resolve, ResolvingTwiceChangesNothing) {
  const ResolvedCase once = resolve_case(sphere_case(), sphere());
  const ResolvedCase twice = resolve_case(once.c, sphere());
  EXPECT_EQ(case_text(once.c), case_text(twice.c));
  EXPECT_EQ(once.layer.top(), twice.layer.top());
  EXPECT_EQ(once.sizes.box2.lo, twice.sizes.box2.lo);
  // ... nor does the way through a file.
  const ResolvedCase read = resolve_case(parse_case(case_text(once.c), "c.toml"), sphere());
  EXPECT_EQ(case_text(once.c), case_text(read.c));
}

TEST(Resolve, EverythingIsWrittenOut) {
  Case c = sphere_case();
  c.flow.h_min.reset();
  c.flow.velocity = 2.0;
  c.flow.viscosity = 1e-5;
  const ResolvedCase r = resolve_case(c, sphere());
  for (const CaseOption& o : case_options()) {
    if (o.table != "flow" && o.table != "sizes" && o.table != "domain") continue;
    EXPECT_EQ(o.get(r.c).has_value(), o.key != "re" && o.key != "box2_margin" && o.key != "boxes" &&
                                          o.key != "metric" && o.key != "walls" && o.key != "target_cells" &&
                                          o.key != "c" && o.key != "border")
        << o.table << "." << o.key;
  }
  EXPECT_GT(r.c.level_set.voxel, 0.0);
}

TEST(Resolve, TargetCellsScalesTheSizesOnly) {
  Case c = sphere_case();
  c.domain = Box<3>{Vec3::Constant(-1.5), Vec3::Constant(1.5)};
  ResolvedCase plain = resolve_case(c, sphere());
  const double usual = fit_to_target(plain, sphere(), nullptr).cells;
  for (const double factor : {0.5, 3.0}) {
    c.target_cells = factor * usual;
    ResolvedCase r = resolve_case(c, sphere());
    const double h2 = r.sizes.h2;
    EXPECT_NEAR(fit_to_target(r, sphere(), nullptr).cells / *c.target_cells, 1.0, 0.05);
    EXPECT_EQ(factor<1.0, r.sizes.h2> h2);
    EXPECT_EQ(r.layer.h_min, 0.01);
    EXPECT_EQ(r.c.h2, r.sizes.h2);
    EXPECT_TRUE(mentions(r.warnings, "--target-cells"));
    EXPECT_FALSE(r.c.target_cells);
  }
  c.target_cells = 10.0;
  ResolvedCase r = resolve_case(c, sphere());
  fit_to_target(r, sphere(), nullptr);
  EXPECT_TRUE(mentions(r.warnings, "need more than the target"));
}

// What the body cannot carry is told with its numbers.
TEST(Resolve, LimitsOfTheInput) {
  Case c = sphere_case();
  c.flow.h_min = 1e-4;
  const ResolvedCase r = resolve_case(c, sphere());
  Prediction p;
  EXPECT_TRUE(mentions(limits_of_input(r, sphere(), p), "facets sag"));
  EXPECT_FALSE(mentions(limits_of_input(r, sphere(), p), "gap"));
  p.gap = {0.5 * r.layer.top(), Vec3(1, 2, 3)};
  p.thickness = {1e-5, Vec3(4, 5, 6)};
  EXPECT_TRUE(mentions(limits_of_input(r, sphere(), p), "near (1, 2, 3)"));
  EXPECT_TRUE(mentions(limits_of_input(r, sphere(), p), "thick near (4, 5, 6)"));
}

TEST(Resolve, GivenBoxesAreKept) {
  Case c = sphere_case();
  c.domain = Box<3>{Vec3(-3, -2, -1), Vec3(4, 2, 1)};
  c.box2_margin = 0.3;
  const ResolvedCase r = resolve_case(c, sphere());
  EXPECT_EQ(r.sizes.domain.lo, c.domain->lo);
  EXPECT_EQ(r.sizes.domain.hi, c.domain->hi);
  EXPECT_NEAR(r.sizes.box2.hi[0], sphere().level_set.bounds().hi[0] + 0.3, 1e-15);
  // h1 = 10 h2 = .5 is a quarter of the shortest side, 2.
  EXPECT_DOUBLE_EQ(r.sizes.h1, std::min(10.0 * r.sizes.h2, 0.5));
}

TEST(Resolve, Box2IsCutByTheDomain) {
  Case c = sphere_case();
  c.domain = Box<3>{Vec3(-0.6, -0.6, -0.6), Vec3(0.6, 0.6, 0.6)};
  const ResolvedCase r = resolve_case(c, sphere());
  EXPECT_EQ(r.sizes.box2.lo, c.domain->lo);
  c.box2 = Box<3>{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  EXPECT_TRUE(mentions(resolve_case(c, sphere()).warnings, "reaches beyond the domain"));
}

TEST(Resolve, DefaultSizesStayInOrder) {
  Case c = sphere_case();
  c.flow.h_min = 0.08;  // above extent / 20
  c.flow.layers = 1;
  ResolvedCase r = resolve_case(c, sphere());
  EXPECT_LT(r.layer.h_min, r.sizes.h2);
  EXPECT_LE(r.sizes.h2, r.sizes.h1);
  c = sphere_case();
  c.h1 = 0.03;  // below extent / 20
  r = resolve_case(c, sphere());
  EXPECT_EQ(r.sizes.h2, 0.03);
  c = sphere_case();
  c.h2 = 3.0;  // above a quarter of the domain
  EXPECT_EQ(resolve_case(c, sphere()).sizes.h1, 3.0);
}

TEST(Resolve, SizesOutOfOrderAreRefused) {
  Case c = sphere_case();
  c.h2 = 0.01;
  EXPECT_EQ(resolve_error(c, ErrorCode::kParameter),
            "h_min = 0.01 must be below h2 = 0.01: lower --hmin (or --yplus) or raise --h2");
  c.h2 = 0.2;
  c.h1 = 0.1;
  EXPECT_NE(resolve_error(c, ErrorCode::kParameter).find("must not exceed h1"), std::string::npos);
}

TEST(Resolve, BodyAndDomainMustMeet) {
  Case c = sphere_case();
  c.domain = Box<3>{Vec3(2, 2, 2), Vec3(3, 3, 3)};
  EXPECT_NE(resolve_error(c, ErrorCode::kDomain).find("lies outside the domain"), std::string::npos);
  c.domain = Box<3>{Vec3(-0.1, -0.1, -0.1), Vec3(0.1, 0.1, 0.1)};
  EXPECT_NE(resolve_error(c, ErrorCode::kDomain).find("wholly inside the body"), std::string::npos);
  c.domain = Box<3>{Vec3(-2, -2, -2), Vec3(2, 2, 2)};
  c.box2 = Box<3>{Vec3(5, 5, 5), Vec3(6, 6, 6)};
  EXPECT_NE(resolve_error(c, ErrorCode::kDomain).find("--box2"), std::string::npos);
}

TEST(Resolve, BodyThroughAFaceIsAllowedAndSaid) {
  Case c = sphere_case();
  c.domain = Box<3>{Vec3(0, -2, -2), Vec3(2, 2, 2)};
  EXPECT_TRUE(mentions(resolve_case(c, sphere()).warnings, "through the domain's face x-"));
  EXPECT_TRUE(resolve_case(sphere_case(), sphere()).warnings.empty());
}

TEST(Resolve, PictureWindowIsBox2) {
  Case c = sphere_case();
  c.picture = "p.png";
  const ResolvedCase r = resolve_case(c, sphere());
  ASSERT_TRUE(r.c.picture_window.has_value());
  EXPECT_EQ((*r.c.picture_window)[1], r.sizes.box2.lo[2]);
}

/// Records what it is told and can ask to stop in a stage.
class Listener : public Progress {
 public:
  void begin(std::string_view stage) override { stages.emplace_back(stage); }
  void warn(std::string_view message) override { warnings.emplace_back(message); }
  [[nodiscard]] bool cancelled() const override { return !stages.empty() && stages.back() == stop_in; }
  std::vector<std::string> stages, warnings;
  std::string stop_in;
};

class RunTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("lamina_run_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ShapeOptions shape;
    shape.facet = 0.1;
    write_stl(folder_ / "sphere.stl", make_shape("sphere", shape));
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A run of about a thousand cells.
  [[nodiscard]] Case small_case() const {
    Case c;
    c.body = folder_ / "sphere.stl";
    c.domain = Box<3>{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
    c.flow.h_min = 0.1;
    c.flow.layers = 2;
    c.h2 = 0.4;
    c.h1 = 0.8;
    c.level_set.voxel = 0.04;
    return c;
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder_)) out.push_back(entry.path().filename());
    std::sort(out.begin(), out.end());
    return out;
  }
  static std::string bytes(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }

  fs::path folder_;
};

TEST_F(RunTest, WritesEverythingAndReproducesItFromTheResolvedCase) {
  Case c = small_case();
  c.outputs = {folder_ / "out.vtu", folder_ / "out.meshb"};
  c.metric_out = folder_ / "out.solb";
  c.levelset_out = folder_ / "out.vdb";
  c.report = folder_ / "out.json";
  c.picture = folder_ / "out.png";
  const Report report = run_case(c, nullptr);
  EXPECT_EQ(names(), (std::vector<std::string>{"out.case.toml", "out.json", "out.meshb", "out.png",
                                               "out.solb", "out.vdb", "out.vtu", "sphere.stl"}));
  EXPECT_GT(report.cells(), 500);
  EXPECT_EQ(report.score.cells, report.cells());
  EXPECT_TRUE(report.validation.ok());
  EXPECT_GT(report.region_cells[0], 0);
  EXPECT_GT(report.region_cells[1], 0);

  const auto json = nlohmann::json::parse(bytes(folder_ / "out.json"));
  EXPECT_EQ(json["cells"]["total"]["count"], report.cells());
  EXPECT_EQ(json["files"].size(), 7U);

  const auto mesh = std::get<Mesh<3>>(read_mesh(folder_ / "out.vtu"));
  EXPECT_EQ(static_cast<std::int64_t>(mesh.cells.size()), report.cells());
  for (const char* field : {"phi", "N", "hn", "ht1", "ht2", "metric"})
    EXPECT_NE(mesh.point_field(field), nullptr) << field;
  EXPECT_EQ(mesh.cell_tags.size(), mesh.cells.size());
  EXPECT_EQ(read_metric<3>(folder_ / "out.solb").size(), mesh.points.size());

  const std::string first_mesh = bytes(folder_ / "out.meshb"), first_case = bytes(folder_ / "out.case.toml");
  Case again = parse_case(first_case, "out.case.toml");
  again.threads = 2;
  for (const char* name : {"out.meshb", "out.vtu", "out.case.toml"}) fs::remove(folder_ / name);
  const Report second = run_case(again, nullptr);
  EXPECT_EQ(second.mesh_hash, report.mesh_hash);
  EXPECT_EQ(bytes(folder_ / "out.meshb"), first_mesh);
}

TEST_F(RunTest, StagesComeInOrderAndAreMeasured) {
  Listener listener;
  const Report report = run_case(small_case(), &listener);
  EXPECT_EQ(listener.stages,
            (std::vector<std::string>{"level set", "plan", "seed", "adapt", "check", "fields", "write"}));
  ASSERT_EQ(report.stages.size(), 7U);
  for (const StageCost& s : report.stages) EXPECT_GE(s.wall_seconds, 0.0);
}

TEST_F(RunTest, StoppingLeavesNothing) {
  for (const char* stage : {"level set", "adapt", "write"}) {
    Listener listener;
    listener.stop_in = stage;
    Case c = small_case();
    c.outputs = {folder_ / "out.vtu"};
    c.report = folder_ / "out.json";
    try {
      run_case(c, &listener);
      ADD_FAILURE() << "not stopped in " << stage;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInterrupted);
    }
    EXPECT_EQ(names(), std::vector<std::string>{"sphere.stl"}) << stage;
  }
}

TEST_F(RunTest, AMeshThatNobodyCouldHoldIsRefused) {
  Case c = small_case();
  c.h2 = 0.101;
  c.h1 = 0.102;
  c.domain = Box<3>{Vec3(-400, -400, -400), Vec3(400, 400, 400)};
  try {
    run_case(c, nullptr);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kParameter);
    EXPECT_NE(std::string(e.what()).find("cells would be needed"), std::string::npos) << e.what();
  }
}

TEST_F(RunTest, BadOutputsAreRefusedBeforeTheRun) {
  const auto refused = [&](const Case& c, ErrorCode code) {
    Listener listener;
    try {
      run_case(c, &listener);
      ADD_FAILURE() << "accepted";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), code) << e.what();
    }
    EXPECT_TRUE(listener.stages.empty());
    EXPECT_EQ(names(), std::vector<std::string>{"sphere.stl"});
  };
  Case c = small_case();
  c.outputs = {folder_ / "out.xyz"};
  refused(c, ErrorCode::kUsage);
  c.outputs = {folder_ / "none" / "out.vtu"};
  refused(c, ErrorCode::kFileWrite);
  c.outputs = {folder_ / "out.vtu", folder_ / "out.vtu"};
  refused(c, ErrorCode::kUsage);
  c.outputs = {folder_ / "out.vtu"};
  c.report = folder_ / "sphere.stl";
  refused(c, ErrorCode::kUsage);
  c.report.reset();
  c.metric_out = folder_ / "out.txt";
  refused(c, ErrorCode::kUsage);
}

TEST_F(RunTest, BadBodiesAreNamed) {
  const auto code = [&](const fs::path& body) {
    Case c = small_case();
    c.body = body;
    try {
      load_body(c, nullptr);
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(body.string()), std::string::npos) << e.what();
      return e.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(code(folder_ / "none.stl"), ErrorCode::kFileMissing);
  EXPECT_EQ(code(folder_ / "none.vdb"), ErrorCode::kFileMissing);
  EXPECT_EQ(code(folder_), ErrorCode::kFileMissing);
  std::ofstream(folder_ / "text.doc") << "words";
  EXPECT_EQ(code(folder_ / "text.doc"), ErrorCode::kFileUnsupported);
}

TEST_F(RunTest, UnitsScaleTheBody) {
  Case c = small_case();
  c.unit = LengthUnit::kMillimetre;
  c.level_set.voxel = 4e-5;
  const Body body = load_body(c, nullptr);
  EXPECT_NEAR(body.level_set.bounds().size().maxCoeff(), 1e-3, 2e-5);
}

TEST_F(RunTest, TheCaseThatWasReadIsNotOverwritten) {
  std::ofstream(folder_ / "out.case.toml") << "# mine\n";
  Case c = small_case();
  c.source = folder_ / "out.case.toml";
  c.outputs = {folder_ / "out.meshb"};
  const Report report = run_case(c, nullptr);
  EXPECT_EQ(bytes(folder_ / "out.case.toml"), "# mine\n");
  EXPECT_TRUE(mentions(report.warnings, "is left as it is"));
}

}  // namespace
}  // namespace lamina
