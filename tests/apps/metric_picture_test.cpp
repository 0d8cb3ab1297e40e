#include "apps/pipeline/metric_picture.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/apps/image.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

/// The half space z < 0.
class Floor : public WallField {
 public:
  WallPoint at(const Vec3& x) const override {
    WallPoint w;
    w.phi = x[2];
    w.closest = {x[0], x[1], 0.0};
    return w;
  }
  double phi(const Vec3& x) const override { return x[2]; }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  Box<3> bounds() const override { return {Vec3(-1, -1, -0.5), Vec3(1, 1, 0)}; }
};

WallMetric metric() {
  static const Floor wall;
  Flow flow;
  flow.h_min = 1e-2;
  flow.layers = 8;
  SizeOptions s;
  s.h2 = 0.2;
  s.h1 = 0.4;
  s.domain = {Vec3::Constant(-3), Vec3::Constant(3)};
  s.box2 = {Vec3::Constant(-2), Vec3::Constant(2)};
  return {wall, resolve(flow, 1.0), s};
}

MetricPictureOptions options() {
  MetricPictureOptions o;
  o.window = {-0.5, -0.25, 0.5, 0.25};
  o.width_px = 400;
  return o;
}

TEST(MetricPicture, WallLayersAndSizesAreWhereTheyBelong) {
  const Scratch scratch;
  MetricPictureOptions o = options();
  o.ellipses = false;
  draw_metric(scratch / "a.png", metric(), o);
  const Image image(scratch / "a.png");
  ASSERT_EQ(image.width(), 400);
  const auto row = [](double z) { return static_cast<int>((0.25 - z) * 400); };
  int red = 0, blue = 0;
  for (int x = 0; x < 400; ++x) {
    const auto wall = image.at(x, row(0.0) - 1), top = image.at(x, row(metric().layer().top()));
    red += wall[0] > 180 && wall[1] < 60;
    blue += (top[2] > 170 && top[0] < 70) || (image.at(x, row(metric().layer().top()) - 1)[2] > 170);
  }
  EXPECT_EQ(red, 400);
  EXPECT_EQ(blue, 400);
  const auto near = image.at(200, row(0.005)), far = image.at(200, row(0.24));
  EXPECT_LT(near[1] + 60, far[1]);  // small sizes are dark
}

TEST(MetricPicture, EllipsesLieAlongTheWall) {
  const Scratch scratch;
  MetricPictureOptions o = options();
  draw_metric(scratch / "with.png", metric(), o);
  o.ellipses = false;
  draw_metric(scratch / "without.png", metric(), o);
  const Image with(scratch / "with.png"), without(scratch / "without.png");
  int wide = 0, tall = 0;  // of what an ellipse changes
  for (int y = 0; y < 200; ++y) {
    int run = 0;
    for (int x = 0; x < 400; ++x) {
      run = with.at(x, y) != without.at(x, y) ? run + 1 : 0;
      wide = std::max(wide, run);
    }
  }
  for (int x = 0; x < 400; ++x) {
    int run = 0;
    for (int y = 0; y < 200; ++y) {
      run = with.at(x, y) != without.at(x, y) ? run + 1 : 0;
      tall = std::max(tall, run);
    }
  }
  EXPECT_GT(wide, tall);
}

TEST(MetricPicture, SameBytesForEveryThreadCount) {
  const Scratch scratch;
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    draw_metric(scratch / "a.png", metric(), options());
    if (first.empty()) first = read_text(scratch / "a.png");
    EXPECT_TRUE(read_text(scratch / "a.png") == first) << threads;
  }
}

TEST(MetricPicture, RefusesBadOptions) {
  const Scratch scratch;
  MetricPictureOptions o = options();
  EXPECT_THROW(draw_metric(scratch / "a.gif", metric(), o), Error);
  o.window = {0, 0, 0, 1};
  EXPECT_THROW(draw_metric(scratch / "a.png", metric(), o), Error);
  o = options();
  o.width_px = 20;
  EXPECT_THROW(draw_metric(scratch / "a.png", metric(), o), Error);
}

}  // namespace
}  // namespace lamina
