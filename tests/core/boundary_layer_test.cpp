// Expected values: the five cases of [Billon2016, section 5]; layer counts as recomputed with delta = 0.38 L
// Re^-1/5.
#include "core/boundary_layer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

namespace lamina {
namespace {

TEST(BoundaryLayer, SkinFrictionByHand) {
  // Re = 1e6: 2 * 6 - 0.65 = 11.35; 11.35^-2.3.
  EXPECT_NEAR(skin_friction(1e6), std::pow(11.35, -2.3), 1e-15);
  EXPECT_THROW((void)skin_friction(1e9), Error);
  EXPECT_THROW((void)skin_friction(-1.0), Error);
}

struct PaperCase {
  const char* name;
  double length, reynolds, y_plus, h_min;
  int layers;
};

class PaperCases : public testing::TestWithParam<PaperCase> {};

TEST_P(PaperCases, FirstHeightToThreeDigits) {
  const PaperCase c = GetParam();
  EXPECT_NEAR(first_height(c.reynolds, c.length, c.y_plus) / c.h_min, 1.0, 0.011) << c.name;
}

TEST_P(PaperCases, LayerCountWithDeltaTimesLength) {
  const PaperCase c = GetParam();
  Flow flow;
  flow.reynolds = c.reynolds;
  flow.length = c.length;
  flow.y_plus = c.y_plus;
  const BoundaryLayer b = resolve(flow, 123.0);
  EXPECT_EQ(b.layers, c.layers) << c.name;
  EXPECT_GE(b.top(), b.delta);
  EXPECT_LT(b.level(b.layers - 1), b.delta);
}

INSTANTIATE_TEST_SUITE_P(Billon2016, PaperCases,
                         testing::Values(PaperCase{"plate", 4.0, 1e4, 1.0, 5.61e-3, 13},
                                         PaperCase{"circle", 0.6, 1e5, 1.0, 1.11e-4, 21},
                                         PaperCase{"square", 0.6, 1e5, 1.0, 1.11e-4, 21},
                                         PaperCase{"naca0012", 1.0, 6e6, 1.0, 4.46e-6, 37},
                                         PaperCase{"ahmed", 1.0, 4.25e6, 5.0, 3.1e-5, 27}),
                         [](const auto& i) { return i.param.name; });

TEST(BoundaryLayer, LevelsByHand) {
  BoundaryLayer b;
  b.h_min = 0.1;
  b.growth = 1.2;
  b.layers = 3;
  EXPECT_DOUBLE_EQ(b.level(0), 0.0);
  EXPECT_NEAR(b.level(1), 0.1, 1e-15);
  EXPECT_NEAR(b.level(2), 0.22, 1e-15);
  EXPECT_NEAR(b.top(), 0.1 + 0.12 + 0.144, 1e-15);
  EXPECT_NEAR(b.top_size(), 0.144, 1e-15);
}

TEST(BoundaryLayer, LevelAtUndoesLevel) {
  BoundaryLayer b;
  b.h_min = 1e-4;
  b.growth = 1.2;
  for (const int k : {0, 1, 7, 30}) EXPECT_NEAR(b.level_at(b.level(k)), k, 1e-12);
  EXPECT_NEAR(b.level_at(1.1e-4), std::log(1.22) / std::log(1.2), 1e-12);
}

TEST(BoundaryLayer, OverridesWin) {
  Flow flow;
  flow.h_min = 1e-3;
  flow.layers = 7;
  const BoundaryLayer b = resolve(flow, 2.0);
  EXPECT_EQ(b.h_min, 1e-3);
  EXPECT_EQ(b.layers, 7);
  EXPECT_EQ(b.length, 2.0);
  EXPECT_EQ(b.delta, b.top());
  flow.layers.reset();
  flow.delta = b.top();
  EXPECT_EQ(resolve(flow, 2.0).layers, 7) << "a delta that is a level gives back its count";
}

TEST(BoundaryLayer, ReynoldsFromVelocityAndViscosity) {
  Flow flow;
  flow.velocity = 40.0;
  flow.viscosity = 1.5e-5;
  flow.length = 1.044;
  EXPECT_NEAR(resolve(flow, 1.0).reynolds, 40.0 * 1.044 / 1.5e-5, 1e-6);
  flow.viscosity.reset();
  EXPECT_THROW((void)resolve(flow, 1.0), Error);
}

TEST(BoundaryLayer, RefusalsNameTheOption) {
  const auto message = [](auto change) {
    Flow flow;
    change(flow);
    try {
      (void)resolve(flow, 1.0);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kParameter);
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(message([](Flow& f) { f.growth = 1.0; }).find("--growth"), std::string::npos);
  EXPECT_NE(message([](Flow& f) { f.y_plus = 0.0; }).find("--yplus"), std::string::npos);
  EXPECT_NE(message([](Flow& f) { f.h_min = -1.0; }).find("--hmin"), std::string::npos);
  EXPECT_NE(message([](Flow& f) { f.layers = 0; }).find("--layers"), std::string::npos);
  EXPECT_NE(message([](Flow& f) { f.length = -2.0; }).find("--length"), std::string::npos);
  EXPECT_NE(message([](Flow& f) { f.reynolds = 1e10; }).find("1e+10"), std::string::npos);
}

}  // namespace
}  // namespace lamina
