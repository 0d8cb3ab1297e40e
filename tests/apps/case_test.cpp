#include "apps/pipeline/case.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/planar.h"

namespace lamina {
namespace {

/// The message of the Error that `action` throws, which must have the code kUsage.
template <class Action>
std::string usage_error(Action action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUsage) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "more than one line: " << e.what();
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

std::string parse_error(const std::string& text) {
  return usage_error([&] { static_cast<void>(parse_case(text, "c.toml")); });
}

const CaseOption& option(const std::string& key) {
  for (const CaseOption& o : case_options())
    if (o.key == key) return o;
  throw std::runtime_error("no option " + key);
}

GivenOption flag(const std::string& key, OptionValue value) {
  return {&option(key), std::move(value), option(key).name()};
}

/// A case in which every option differs from its default.
Case unusual_case() {
  Case c;
  c.body = "a \"quoted\" \\ name\twith tab.stl";
  c.unit = LengthUnit::kInch;
  c.flow.length = 0.1;
  c.flow.velocity = 1.0 / 3.0;
  c.flow.viscosity = 1.5e-5;
  c.flow.y_plus = 0.7;
  c.flow.growth = 1.15;
  c.flow.regime = Regime::kLaminar;
  c.flow.h_min = 3.1e-5;
  c.flow.delta = 0.012345678901234567;
  c.flow.layers = 27;
  c.h2 = 0.1;
  c.h1 = 0.30000000000000004;
  c.target_cells = 1.5e6;
  c.box2 = Box<3>{Vec3(-1, -2, -3), Vec3(1e-17, 2, 3e20)};
  c.domain = Box<3>{Vec3(-10, -20, -30), Vec3(10, 20, 30)};
  c.box1 = Box<3>{Vec3(-5, -6, -7), Vec3(5, 6, 7)};
  c.polyline = c.spline = true;
  c.slice = Plane{.axis = 2, .offset = 0.1};
  c.extrude = 0.25;
  c.profile = Profile::kContinuous;
  c.corner_elements = 3.5;
  c.edge_growth = 1.3;
  c.gradation = 0.0;
  c.growth_inside = 1.7;
  c.chord = Chord::kWall;
  c.align = Align::kAnywhere;
  c.metric = "solution.meshb";
  c.boxes = {{"wake", {Vec3(1, -0.5, 0), Vec3(2.5, 0.30000000000000004, 1)}, 0.05},
             {"nose", {Vec3(-1, -0.5, 0), Vec3(0.5, 0.5, 1e-17)}, 1e-3}};
  c.walls = {true, false, false, false, true, false};
  c.size_grids = {"density", "paint.vdb:size"};
  c.level_set.voxel = 0.004;
  c.level_set.max_memory = 1e9;
  c.level_set.sheets = true;
  c.level_set.grid = "ls";
  c.level_set.iso = -0.25;
  c.seed = SeedKind::kLattice;
  c.quality_floor = 0.05;
  c.threads = 3;
  c.outputs = {"out.vtu", "dir/out.meshb"};
  c.metric_out = "out.solb";
  c.levelset_out = "out.vdb";
  c.report = "r.json";
  c.picture = "p.svg";
  c.checkpoint = "saved";
  c.picture_plane = {2, -0.125};
  c.picture_window = {-1.0, -0.1, 1.0, 0.1};
  return c;
}

TEST(Case, EveryValueSurvivesWritingAndReading) {
  const Case c = unusual_case();
  const Case back = parse_case(case_text(c), "c.toml");
  for (const CaseOption& o : case_options()) EXPECT_EQ(o.get(c), o.get(back)) << o.table << "." << o.key;
  EXPECT_EQ(case_text(c), case_text(back));
}

TEST(Case, TheUnusualCaseIsUnusualThroughout) {
  // Guards the test above: an option that is left at its default there would not be tested.
  const Case c = unusual_case(), standard;
  for (const CaseOption& o : case_options()) {
    const bool contradicts = o.key == "re" || o.key == "box2_margin" || o.key == "c" || o.key == "border";
    if (contradicts) continue;  // others that are set
    EXPECT_NE(o.get(c), o.get(standard)) << o.table << "." << o.key;
  }
}

TEST(Case, WhatContradictsOthersSurvivesAlone) {
  Case c;
  c.flow.reynolds = 4.25e6;
  c.box2_margin = 0.1;
  const Case back = parse_case(case_text(c), "c.toml");
  EXPECT_EQ(back.flow.reynolds, 4.25e6);
  EXPECT_EQ(*back.box2_margin, 0.1);
  Case shape;
  shape.domain_c = {50.0, 47.1, 96.6};
  EXPECT_EQ(parse_case(case_text(shape), "c.toml").domain_c, shape.domain_c);
  Case curve;
  curve.border = "far field.csv";
  EXPECT_EQ(parse_case(case_text(curve), "c.toml").border, curve.border);
}

TEST(Case, DefaultsSurviveToo) {
  const Case back = parse_case(case_text(Case()), "c.toml");
  EXPECT_EQ(case_text(back), case_text(Case()));
  EXPECT_EQ(back.flow.reynolds, 1e5);
  EXPECT_FALSE(back.h2.has_value());
}

TEST(Case, ExtremeDoublesKeepTheirBits) {
  for (const double x :
       {0.1, 1.0 / 3.0, 5e-324, 1.7976931348623157e308, 1e22, 123456789.0, 9007199254740993.0}) {
    Case c;
    c.h2 = x;
    EXPECT_EQ(*parse_case(case_text(c), "c.toml").h2, x);
  }
}

TEST(Case, EveryOptionIsDescribedOnceAndCompletely) {
  std::vector<std::string> flags, keys;
  for (const CaseOption& o : case_options()) {
    EXPECT_FALSE(o.help.empty()) << o.key;
    EXPECT_TRUE(o.set && o.get) << o.key;
    flags.push_back(o.name());
    keys.push_back(o.table + "." + o.key);
    EXPECT_TRUE(std::any_of(case_tables().begin(), case_tables().end(), [&](const auto& t) {
      return t.first == o.table;
    })) << o.table;
    EXPECT_NE(options_markdown().find("`" + o.table + "." + o.key + "`"), std::string::npos);
  }
  for (auto* list : {&flags, &keys}) {
    std::sort(list->begin(), list->end());
    EXPECT_EQ(std::adjacent_find(list->begin(), list->end()), list->end());
  }
}

TEST(Case, UnknownKeyIsNamedWithLineAndNearestKey) {
  EXPECT_EQ(parse_error("[body]\nfile = \"a.stl\"\n\n[flow]\nhmim = 1e-3\n"),
            "c.toml:5: flow.hmim: unknown key (did you mean hmin?)");
  EXPECT_EQ(parse_error("[flow]\nh2 = 0.1\n"), "c.toml:2: flow.h2: unknown key (it belongs into [sizes])");
}

TEST(Case, KeyInTheWrongTableIsSentToItsOwn) {
  EXPECT_EQ(parse_error("[mesh]\nbox2_margin = 0.1\n"),
            "c.toml:2: mesh.box2_margin: unknown key (it belongs into [sizes])");
  EXPECT_EQ(parse_error("h2 = 0.1\n"), "c.toml:1: unknown key h2 (it belongs into [sizes])");
}

TEST(Case, UnknownTableIsNamed) {
  EXPECT_EQ(parse_error("[flwo]\nre = 1e5\n"), "c.toml:1: unknown table flwo (did you mean flow?)");
  EXPECT_EQ(parse_error("flow = 3\n"), "c.toml:1: flow must be a table: [flow]");
}

TEST(Case, WrongTypesAreNamed) {
  EXPECT_EQ(parse_error("[flow]\nre = \"fast\"\n"), "c.toml:2: flow.re: must be a number, not a text");
  EXPECT_EQ(parse_error("[flow]\nlayers = 12.0\n"),
            "c.toml:2: flow.layers: must be a whole number, not a number with a fraction");
  EXPECT_EQ(parse_error("[body]\nfile = 3\n"), "c.toml:2: body.file: must be a text, not a whole number");
  EXPECT_EQ(parse_error("[sizes]\nbox2 = [1, 2, 3]\n"),
            "c.toml:2: sizes.box2: must be a list of 6 numbers, or 4 in two dimensions");
  EXPECT_EQ(parse_error("[sizes]\nbox2 = 3\n"),
            "c.toml:2: sizes.box2: must be a list of 6 numbers, or 4 in two dimensions");
  EXPECT_EQ(parse_error("[mesh]\nseed = \"tetgem\"\n"),
            "c.toml:2: mesh.seed = tetgem: must be one of tetgen, lattice (did you mean tetgen?)");
  EXPECT_EQ(parse_error("[output]\nfiles = [\"a.vtu\", 3]\n"),
            "c.toml:2: output.files: must be one or more texts, not a whole number");
}

TEST(Case, RangesAreChecked) {
  EXPECT_EQ(parse_error("[flow]\nhmin = -1e-3\n"),
            "c.toml:2: flow.hmin = -0.001 is out of range: must be > 0");
  EXPECT_EQ(parse_error("[sizes]\ngradation = 9\n"),
            "c.toml:2: sizes.gradation = 9 is out of range: must be 0 or in (1, 4]");
  EXPECT_NE(parse_error("[sizes]\ngradation = 1\n").find("0 or in (1, 4]"), std::string::npos);
  EXPECT_EQ(parse_error("[flow]\nhmin = 0\n"), "c.toml:2: flow.hmin = 0 is out of range: must be > 0");
  EXPECT_EQ(parse_error("[flow]\ngrowth = 1\n"),
            "c.toml:2: flow.growth = 1 is out of range: must be in (1, 2]");
  EXPECT_EQ(parse_error("[flow]\nlayers = 0\n"),
            "c.toml:2: flow.layers = 0 is out of range: must be in [1, 200]");
  EXPECT_NE(parse_error("[flow]\nhmin = nan\n").find("out of range"), std::string::npos);
  EXPECT_NE(parse_error("[sizes]\nh2 = inf\n").find("out of range"), std::string::npos);
  EXPECT_NE(parse_error("[domain]\nbox = [0, 0, 0, 1, nan, 1]\n").find("out of range"), std::string::npos);
  EXPECT_EQ(parse_case("[flow]\ngrowth = 2\n", "c").flow.growth, 2.0);
}

TEST(Case, EmptyBoxesAreRefused) {
  EXPECT_EQ(parse_error("[domain]\nbox = [0, 0, 5, 1, 1, 5]\n"),
            "c.toml:2: domain.box is an empty box: 5 must be below 5 (number 3 below number 6)");
}

TEST(Case, BrokenTomlNamesFileAndLine) {
  const std::string message = parse_error("[flow]\nre = 1e5\ngrowth = = 2\n");
  EXPECT_EQ(message.rfind("c.toml:3: not valid TOML", 0), 0U) << message;
  EXPECT_NE(parse_error("[flow]\nre = 1\nre = 2\n").find("not valid TOML"), std::string::npos);
  EXPECT_NE(parse_error("[flow").find("not valid TOML"), std::string::npos);
  EXPECT_NE(parse_error(std::string("\0\x01\xff", 3)).find("not valid TOML"), std::string::npos);
}

TEST(Case, ContradictionsInOneSourceAreRefused) {
  EXPECT_EQ(parse_error("[flow]\nre = 1e5\nvelocity = 3\n"),
            "c.toml:2: flow.re contradicts c.toml:3: flow.velocity: give one of them");
  Case c;
  EXPECT_NE(
      usage_error([&] {
        apply_options(c, {flag("box2_margin", 0.1), flag("box2", std::vector<double>{0, 0, 0, 1, 1, 1})});
      }).find("contradicts"),
      std::string::npos);
}

TEST(Case, FlagsWinOverTheFile) {
  Case c = parse_case("[flow]\nvelocity = 3\nviscosity = 1e-5\nhmin = 1e-3\n[sizes]\nbox2_margin = 0.2\n",
                      "c.toml");
  apply_options(c,
                {flag("re", 2e6), flag("hmin", 5e-4), flag("box2", std::vector<double>{0, 0, 0, 1, 1, 1})});
  EXPECT_EQ(c.flow.reynolds, 2e6);
  EXPECT_FALSE(c.flow.velocity.has_value());
  EXPECT_FALSE(c.flow.viscosity.has_value());
  EXPECT_EQ(*c.flow.h_min, 5e-4);
  EXPECT_FALSE(c.box2_margin.has_value());
  EXPECT_EQ(c.box2->hi, Vec3(1, 1, 1));
}

TEST(Case, WordsOfTheCommandLine) {
  EXPECT_EQ(parse_option(option("hmin"), {"1e-3"}, "--hmin"), OptionValue(1e-3));
  EXPECT_EQ(parse_option(option("layers"), {"12"}, "--layers"), OptionValue(std::int64_t{12}));
  EXPECT_EQ(parse_option(option("box2"), {"-1", "-2", "-3", "+1", "2", "3e0"}, "--box2"),
            OptionValue(std::vector<double>{-1, -2, -3, 1, 2, 3}));
  const auto message = [](const char* key, const std::vector<std::string>& words) {
    return usage_error([&] { static_cast<void>(parse_option(option(key), words, option(key).name())); });
  };
  EXPECT_EQ(message("hmin", {"1mm"}), "--hmin 1mm: must be a number");
  EXPECT_EQ(message("hmin", {""}), "--hmin : must be a number");
  EXPECT_EQ(message("hmin", {"nan"}), "--hmin nan: must be a number");
  EXPECT_EQ(message("hmin", {"1", "2"}), "--hmin 1 2: needs a number, 2 given");
  EXPECT_EQ(message("layers", {"1.5"}), "--layers 1.5: must be a whole number");
  EXPECT_EQ(message("box2", {"1", "2"}), "--box2 1 2: needs 6 numbers, or 4 in two dimensions, 2 given");
}

TEST(Case, MissingFileIsNotAUsageError) {
  try {
    static_cast<void>(read_case("/nonexistent/case.toml"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFileMissing);
  }
}

TEST(Case, Planes) {
  EXPECT_EQ(parse_plane("y=0").axis, 1);
  EXPECT_EQ(parse_plane(" x = -1.5").axis, 0);
  EXPECT_EQ(parse_plane("x=-1.5").offset, -1.5);
  EXPECT_EQ(plane_text({2, 0.1}), "z=0.1");
  for (const char* bad : {"", "y", "y=", "w=0", "y=a", "y=0x", "=0", "y0"})
    EXPECT_NE(usage_error([&] { static_cast<void>(parse_plane(bad)); }).find("for example"),
              std::string::npos)
        << bad;
}

TEST(Case, UnitsAreExactByDefinition) {
  EXPECT_EQ(unit_scale(LengthUnit::kMetre), 1.0);
  EXPECT_EQ(unit_scale(LengthUnit::kMillimetre), 1e-3);
  EXPECT_EQ(unit_scale(LengthUnit::kInch), 0.0254);
  EXPECT_DOUBLE_EQ(unit_scale(LengthUnit::kFoot), 12 * 0.0254);
}

TEST(Text, NearestName) {
  const std::vector<std::string> names = {"hmin", "h1", "h2", "quality_floor"};
  EXPECT_EQ(nearest_name("hmni", names), "hmin");
  EXPECT_EQ(nearest_name("quality-flor", names), "quality_floor");
  EXPECT_EQ(nearest_name("completely", names), "");
  EXPECT_EQ(nearest_name(std::string(1000, 'h'), names), "");
  EXPECT_EQ(nearest_name("", {}), "");
}

TEST(Text, WrapsAtTheWidth) {
  EXPECT_EQ(wrapped("aa bb cc", 5, "# "), "aa bb\n# cc");
  EXPECT_EQ(wrapped("aa bb cc", 5, "", 2), "aa\nbb cc");
  EXPECT_EQ(wrapped("toolongword x", 4, ""), "toolongword\nx");
  EXPECT_EQ(wrapped("", 4, "# "), "");
}

TEST(Text, NumbersAreRead) {
  EXPECT_EQ(parse_number("1e-3"), 1e-3);
  EXPECT_EQ(parse_number("+.5"), 0.5);
  for (const char* bad : {"", "1 ", " 1", "1,5", "nan", "inf", "0x10", "1e999", "-"})
    EXPECT_FALSE(parse_number(bad).has_value()) << bad;
}

TEST(Case, BoxesOfThePlaneHaveFourNumbers) {
  const Case c = parse_case(
      "[domain]\nbox = [0, -1, 3, 1]\n[sizes]\nboxes = [\"wake 1 -1 2 1 0.1\", \"w 0 0 0 1 1 1 0.2\"]\n",
      "c.toml");
  ASSERT_TRUE(c.domain);
  EXPECT_TRUE(is_planar(*c.domain));
  EXPECT_EQ(c.domain->hi.head<2>(), Vec2(3.0, 1.0));
  EXPECT_TRUE(is_planar(c.boxes[0].box));
  EXPECT_FALSE(is_planar(c.boxes[1].box));
  const Case again = parse_case(case_text(c), "again.toml");
  EXPECT_EQ(again.domain->lo, c.domain->lo);
  EXPECT_EQ(again.boxes[0].box.hi, c.boxes[0].box.hi);
  EXPECT_EQ(again.boxes[1].box.hi, c.boxes[1].box.hi);
}

}  // namespace
}  // namespace lamina
