#include "apps/pipeline/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace lamina {
namespace {

Report example() {
  Report r;
  r.version = "1.2.3";
  r.resolved.layer.h_min = 1e-3;
  r.resolved.layer.layers = 10;
  r.resolved.c.body = "body.stl";
  r.resolved.sizes.domain = {Vec3(0, 0, 0), Vec3(1, 2, 3)};
  r.resolved.sizes.box2 = {Vec3(0, 0, 0), Vec3(1, 1, 1)};
  r.region_cells = {10, 40, 30, 20};
  r.points = 25;
  r.score.cells = 100;
  r.score.unit_share = 0.9;
  r.score.quality_min = 0.1;
  r.score.length_histogram[3] = 7;
  r.score.quality_histogram[9] = 100;
  r.score.worst = {{5, 0.1, Vec3(1, 2, 3)}};
  r.worst_regions = {Region::kLayer};
  r.adapt.steps = {{.size_floor = 0.5, .cells = 12}, {.size_floor = 0.0, .cells = 100}};
  r.adapt.operators = {{.name = "split", .tried = 9, .accepted = 4}};
  r.stages = {{"seed", 1.5, 2.5, 100.0}, {"adapt", 2.0, 3.0, 300.0}};
  r.threads = 2;
  r.mesh_hash = 0xabcdefull;
  r.warnings = {"mind the gap"};
  r.files = {"out.vtu"};
  return r;
}

nlohmann::json parsed(const Report& r) { return nlohmann::json::parse(report_json(r)); }

TEST(Report, CountsFollowThePapersColumns) {
  const Report r = example();
  EXPECT_EQ(r.cells(), 100);
  EXPECT_EQ(r.box2_cells(), 80);
  const auto json = parsed(r);
  EXPECT_EQ(json["cells"]["total"]["count"], 100);
  EXPECT_EQ(json["cells"]["box2"]["count"], 80);
  EXPECT_EQ(json["cells"]["layer"]["count"], 40);
  EXPECT_EQ(json["cells"]["inside"]["count"], 10);
  EXPECT_DOUBLE_EQ(json["cells"]["layer"]["percent"], 40.0);
}

TEST(Report, JsonHoldsWhatTheReadmePromises) {
  const auto json = parsed(example());
  for (const char* key :
       {"lamina", "case", "layer", "sizes", "body", "cells", "points", "facets", "mesh_hash", "validation",
        "score", "worst_cells", "homotopy", "operators", "stages", "threads", "files", "warnings", "missed"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["lamina"], "1.2.3");
  EXPECT_EQ(json["case"]["body"]["file"], "body.stl");
  EXPECT_EQ(json["sizes"]["domain"], nlohmann::json({0.0, 0.0, 0.0, 1.0, 2.0, 3.0}));
  EXPECT_EQ(json["mesh_hash"], "0000000000abcdef");
  EXPECT_EQ(json["worst_cells"][0]["region"], "layer");
  EXPECT_EQ(json["worst_cells"][0]["center"], nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(json["homotopy"].size(), 2U);
  EXPECT_EQ(json["operators"][0]["accepted"], 4);
  EXPECT_DOUBLE_EQ(json["wall_seconds"], 3.5);
  EXPECT_DOUBLE_EQ(json["peak_bytes"], 300.0);
}

// Two seconds of four are serial on two threads: one thread would take 2 + 2 x 2.
TEST(Report, SerialFraction) {
  StageCost cost;
  cost.wall_seconds = 4.0;
  cost.serial_seconds = 2.0;
  EXPECT_DOUBLE_EQ(cost.serial_fraction(2), 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(cost.serial_fraction(1), 0.5);
  EXPECT_EQ(StageCost().serial_fraction(1), 0.0);
}

TEST(Report, HistogramBinsCoverAllLengths) {
  const auto bins = parsed(example())["score"]["length"]["histogram"];
  ASSERT_EQ(bins.size(), Score::kLengthBins.size());
  EXPECT_EQ(bins[0]["from"], 0.0);
  for (std::size_t i = 0; i + 1 < bins.size(); ++i) EXPECT_EQ(bins[i]["to"], bins[i + 1]["from"]);
  EXPECT_TRUE(bins.back()["to"].is_null());
  EXPECT_EQ(bins[3]["count"], 7);
}

TEST(Report, UndefinedNumbersAndForeignBytesStayValidJson) {
  Report r = example();
  r.score.quality_min = std::numeric_limits<double>::quiet_NaN();
  r.score.length_max = std::numeric_limits<double>::infinity();
  r.resolved.c.body =
      "b\xff"
      "ody.stl";
  const auto json = parsed(r);
  EXPECT_TRUE(json["score"]["quality"]["min"].is_null());
  EXPECT_TRUE(json["score"]["length"]["max"].is_null());
}

TEST(Report, AnEmptyReportPrints) {
  EXPECT_FALSE(report_table(Report()).empty());
  EXPECT_TRUE(parsed(Report())["cells"]["total"]["percent"] == 0.0);
}

TEST(Report, TableNamesCountsAndFiles) {
  const std::string table = report_table(example());
  for (const char* word : {"in Box2", "80.0 %", "40.0 %", "out.vtu", "90.0 %"})
    EXPECT_NE(table.find(word), std::string::npos) << word << "\n" << table;
  EXPECT_LE(std::count(table.begin(), table.end(), '\n'), 25);
}

TEST(Report, MissedProperties) {
  Score s;
  s.unit_share = kWantedUnitShare;
  s.quality_min = kWantedQuality;
  EXPECT_TRUE(missed_properties(s).empty());
  s.unit_share = 0.799;
  ASSERT_EQ(missed_properties(s).size(), 1U);
  EXPECT_EQ(missed_properties(s)[0], "unit edges: 79.9 %, wanted at least 80 %");
  s.quality_min = 0.01;
  s.worst = {{5, 0.01, Vec3(1, 2, 3)}};
  ASSERT_EQ(missed_properties(s).size(), 2U);
  EXPECT_EQ(missed_properties(s)[1], "worst quality: 0.01 near (1, 2, 3), wanted at least 0.02");
  s.unit_share = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(missed_properties(s).size(), 2U);
}

TEST(Report, TellsOfLayersRelativeToTheIdeal) {
  Report r = example();
  r.levels.points = 200;
  r.levels.on_level = 150;
  r.levels.on_wall = 40;
  r.levels.ideal_on_wall = 50.0;
  r.levels.edges = 700;
  r.levels.aligned = 200;
  r.levels.mean_offset = 0.125;
  const auto json = parsed(r)["levels"];
  EXPECT_EQ(json["on_level"], 150);
  EXPECT_NEAR(json["aligned_of_ideal"].get<double>(), 0.5, 1e-14);  // of 4/7
  const std::string table = report_table(r);
  for (const char* text :
       {"75.0 % of the 200 points", "mean offset 0.125", "80.0 % of the ideal", "50.0 % of what"})
    EXPECT_NE(table.find(text), std::string::npos) << text << "\n" << table;
}

}  // namespace
}  // namespace lamina
