// The picture shows what the bins hold: areas per bin, the unit band, one colour per mesh.
#include "apps/pipeline/score_picture.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/apps/image.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

bool blue(const std::array<int, 3>& c) { return c[2] > c[0] + 40; }
bool orange(const std::array<int, 3>& c) { return c[0] > c[2] + 60; }

Score with_quality(std::size_t bin) {
  Score s;
  s.cells = 10;
  s.quality_histogram[bin] = 10;
  s.length_histogram[6] = 5;
  s.length_histogram[7] = 5;
  return s;
}

TEST(ScorePicture, BarsStandWhereTheirBinsAre) {
  const Scratch folder;
  const auto middle = [&](std::size_t bin) {
    draw_scores(folder / "a.png", {{"a", true, with_quality(bin)}});
    const Image image(folder / "a.png");
    double sum = 0.0, n = 0.0;
    for (int y = 100; y < image.height() - 70; ++y)
      for (int x = image.width() / 2; x < image.width(); ++x)
        if (blue(image.at(x, y))) sum += x, n += 1.0;
    EXPECT_GT(n, 0.0);
    return sum / n;
  };
  const double low = middle(0), high = middle(9);
  EXPECT_NEAR(high - low, 0.9 * 460.0, 3.0);
}

TEST(ScorePicture, TwoMeshesInTwoColours) {
  const Scratch folder;
  draw_scores(folder / "one.png", {{"a", true, with_quality(8)}});
  draw_scores(folder / "two.png", {{"a", true, with_quality(8)}, {"b", true, with_quality(9)}});
  EXPECT_EQ(Image(folder / "one.png").count(orange), 0);
  EXPECT_GT(Image(folder / "two.png").count(orange), 500);
}

TEST(ScorePicture, WithoutAMetricThereAreNoLengths) {
  const Scratch folder;
  const auto left = [&](bool has_metric) {
    draw_scores(folder / "a.png", {{"a", has_metric, with_quality(8)}});
    const Image image(folder / "a.png");
    int n = 0;
    for (int y = 80; y < image.height(); ++y)
      for (int x = 0; x < image.width() / 2; ++x) n += blue(image.at(x, y));
    return n;
  };
  EXPECT_GT(left(true), 1000);
  EXPECT_EQ(left(false), 0);
  EXPECT_THROW(draw_scores(folder / "a.txt", {{"a", true, Score{}}}), Error);
}

}  // namespace
}  // namespace lamina
