#include "apps/pipeline/wall_picture.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/apps/image.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

/// A ball of radius 0.5 around (1, 0, 0) with a sharp equator z = 0.
class Ball : public WallField {
 public:
  WallPoint at(const Vec3& x) const override {
    WallPoint w;
    const Vec3 out = x - center_;
    w.phi = out.norm() - 0.5;
    w.N = out.normalized();
    w.closest = center_ + 0.5 * w.N;
    w.k1 = w.k2 = 2.0;
    w.edge_distance = std::abs(w.closest[2]);
    w.reliability = x[2] > 0.0 ? 1.0 : 0.0;
    return w;
  }
  double phi(const Vec3& x) const override { return at(x).phi; }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  Box<3> bounds() const override { return {center_ - Vec3::Constant(0.5), center_ + Vec3::Constant(0.5)}; }

 private:
  const Vec3 center_{1.0, 0.0, 0.0};
};

WallPictureOptions from_x() {
  WallPictureOptions o;
  o.azimuth = 0.0;
  o.elevation = 0.0;
  o.width_px = 200;
  return o;
}

bool is_white(const std::array<int, 3>& c) { return c == std::array<int, 3>{255, 255, 255}; }

TEST(WallPicture, ShowsTheOutlineColoursAndEdges) {
  const Scratch scratch;
  draw_wall(scratch / "a.png", Ball(), from_x());
  const Image image(scratch / "a.png");
  ASSERT_EQ(image.width(), 200);
  const double radius = 100.0 / 1.04;
  const auto at = [&](double y, double z) {  // of the radius
    return image.at(static_cast<int>(100.0 + radius * y), static_cast<int>(100.0 - radius * z));
  };
  EXPECT_TRUE(is_white(at(0.75, 0.75)));
  EXPECT_FALSE(is_white(at(0.65, 0.65)));
  EXPECT_TRUE(is_white(at(0.0, 1.03)));
  for (const double z : {0.5, -0.5}) EXPECT_GT(at(0.0, z)[0], at(0.0, z)[2] + 10);  // convex: red
  EXPECT_LT(at(0.3, 0.0)[0], 80);                                                   // the edge
  EXPECT_GT(at(-0.4, 0.5)[1], at(0.4, -0.5)[1]);  // light falls from above, left
}

TEST(WallPicture, EyeAndAxisAreFreeToChoose) {
  const Scratch scratch;
  WallPictureOptions o = from_x();
  o.color = WallColor::kReliability;
  o.elevation = 90.0;
  draw_wall(scratch / "above.png", Ball(), o);
  const auto above = Image(scratch / "above.png").at(100, 100);
  EXPECT_GT(above[2], above[0]);  // reliability 1: bluish
  o.elevation = -90.0;
  draw_wall(scratch / "below.png", Ball(), o);
  const auto below = Image(scratch / "below.png").at(100, 100);
  EXPECT_GT(below[0], 3 * below[1]);  // 0: dark red
  o.elevation = 90.0;
  o.up = 0;  // the eye at +x: the equator is a line again
  draw_wall(scratch / "x.png", Ball(), o);
  int dark = 0;
  const Image image(scratch / "x.png");
  for (int i = 20; i < 180; ++i)
    dark += image.at(i, 100)[0] < 80 || image.at(i, 99)[0] < 80 || image.at(100, i)[0] < 80 ||
            image.at(99, i)[0] < 80;
  EXPECT_GT(dark, 150);
  o = from_x();
  o.zoom = 100.0;
  draw_wall(scratch / "near.png", Ball(), o);
  EXPECT_FALSE(is_white(Image(scratch / "near.png").at(2, 2)));
}

TEST(WallPicture, SameBytesForEveryThreadCount) {
  const Scratch scratch;
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    for (const char* name : {"a.png", "a.svg", "a.pdf"}) draw_wall(scratch / name, Ball(), from_x());
    const std::string all =
        read_text(scratch / "a.png") + read_text(scratch / "a.svg") + read_text(scratch / "a.pdf");
    if (first.empty()) first = all;
    EXPECT_TRUE(all == first) << threads;
  }
  EXPECT_GT(first.size(), 3000U);
}

TEST(WallPicture, RefusesBadOptions) {
  const Scratch scratch;
  const auto code_of = [&](const char* name, auto&& change) {
    WallPictureOptions o = from_x();
    change(o);
    try {
      draw_wall(scratch / name, Ball(), o);
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(code_of("a.jpg", [](auto&) {}), ErrorCode::kFileUnsupported);
  EXPECT_EQ(code_of("a.png", [](auto& o) { o.elevation = 91.0; }), ErrorCode::kParameter);
  EXPECT_EQ(code_of("a.png", [](auto& o) { o.zoom = 0.0; }), ErrorCode::kParameter);
  EXPECT_EQ(code_of("a.png", [](auto& o) { o.width_px = 10; }), ErrorCode::kParameter);
  EXPECT_EQ(code_of("a.png", [](auto& o) { o.up = 3; }), ErrorCode::kParameter);
  EXPECT_EQ(code_of("no/folder/a.png", [](auto&) {}), ErrorCode::kFileWrite);
}

}  // namespace
}  // namespace lamina
