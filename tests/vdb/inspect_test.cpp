#include "vdb/inspect.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/vdb/test_surfaces.h"

namespace lamina {
namespace {

using namespace testing_surfaces;

SurfaceInspection look(Surface s, const InspectOptions& options = {}) {
  const SurfaceReport report = clean(s, "s");
  return inspect(s, report, options);
}

TEST(Inspect, BoxByHand) {
  const SurfaceInspection i = look(box({0, 0, 0}, {1, 2, 3}), {.h_min = 1e-9});
  EXPECT_EQ(i.crossing_pairs, 0);
  EXPECT_TRUE(i.crossings_complete);
  EXPECT_FALSE(i.first_crossing);
  EXPECT_EQ(i.crossings_words, "no facet crosses or overlaps another");
  EXPECT_EQ(i.sharp_edges, 12);
  EXPECT_EQ(i.corners, 8);
  EXPECT_EQ(i.smallest_h_min, 0.0);
  EXPECT_EQ(i.sag_per_h_min, 0.0);
  EXPECT_EQ(i.sag_words, "no smooth edge bends: the facets carry first layers of any height");
}

TEST(Inspect, TheFeatureAngleMakesEdgesSharp) {
  const Surface prism = cylinder(1.0, 0.0, 1.0, 8);  // strips at 45 degrees, two rims of 8
  EXPECT_EQ(look(prism).sharp_edges, 24);
  EXPECT_EQ(look(prism, {.feature_angle_degrees = 50.0}).sharp_edges, 16);
}

TEST(Inspect, CrossingBoxes) {
  const Surface s = joined(box({0, 0, 0}, {4, 4, 4}), box({-1, 1, 1}, {5, 3, 3}));
  const SurfaceInspection i = look(s);
  EXPECT_EQ(i.crossing_pairs, 16);
  ASSERT_TRUE(i.first_crossing);
  EXPECT_TRUE(s.bounds().contains(*i.first_crossing));
  EXPECT_TRUE(
      i.crossings_words.starts_with("16 pairs of facets that cross or overlap each other, the first at ("));
}

TEST(Inspect, SagAgainstTheFirstLayer) {
  Surface ball = sphere(0.5, 10);
  const double sag = clean(ball, "ball").facet_sag;
  const auto told = [&](double h_min, const char* words) {
    const SurfaceInspection i = look(ball, {.h_min = h_min});
    EXPECT_EQ(i.smallest_h_min, sag);
    EXPECT_DOUBLE_EQ(i.sag_per_h_min.value_or(-1.0), sag / h_min);
    EXPECT_NE(i.sag_words.find(words), std::string::npos) << i.sag_words;
  };
  told(2.0 * sag, "0.5 of the first layer: they carry h_min");
  told(sag, "they carry h_min");
  told(sag / 9.0, "9 times the first layer");
  told(sag / 9.0, "(edges shorter by 3)");
  EXPECT_FALSE(look(ball).sag_per_h_min);
  EXPECT_NE(look(ball).sag_words.find("they carry first layers of h_min >= "), std::string::npos);
}

TEST(Inspect, RefusesOptionsOutOfRange) {
  for (const InspectOptions& bad :
       {InspectOptions{.feature_angle_degrees = 0.0}, InspectOptions{.h_min = 0.0},
        InspectOptions{.h_min = std::numeric_limits<double>::infinity()}}) {
    try {
      look(box({0, 0, 0}, {1, 1, 1}), bad);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kParameter);
    }
  }
}

}  // namespace
}  // namespace lamina
