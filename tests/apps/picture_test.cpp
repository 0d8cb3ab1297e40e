#include "apps/pipeline/picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "apps/pipeline/detail/color_map.h"
#include "core/error.h"
#include "tests/apps/image.h"
#include "tests/mesh/lattice.h"
#include "tests/mesh/scratch.h"

// fontconfig keeps a few hundred bytes of its caches; only the leak sanitizer calls this.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig"; }

namespace lamina {
namespace {

/// A lattice around a ball of radius 0.25 with everything a picture can show.
template <int D>
Mesh<D> ball_mesh(int n) {
  Mesh<D> mesh = lattice<D>(n, 0.12);
  MeshField phi{"phi", 1, {}}, hn{"hn", 1, {}}, quality{"quality", 1, {}};
  for (const Vec<D>& x : mesh.points) {
    phi.values.push_back((x - Vec<D>::Constant(0.5)).norm() - 0.25);
    hn.values.push_back(0.001 + 0.2 * std::abs(phi.values.back()));
  }
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    double mean = 0.0;
    for (const Index v : mesh.cells[i]) mean += phi.values[static_cast<std::size_t>(v)] / (D + 1);
    mesh.cell_tags.push_back(mean < 0 ? 0 : (mean < 0.1 ? 1 : (mean < 0.3 ? 2 : 3)));
    quality.values.push_back(0.5 + 0.5 * noise(i, 3));
  }
  mesh.point_fields = {phi, hn};
  mesh.cell_fields = {quality};
  return mesh;
}

PictureOptions half_way() {
  PictureOptions o;
  o.plane = {1, 0.5};
  o.width_px = 400;
  o.layer_top = 0.1;
  return o;
}

bool is_red(const std::array<int, 3>& c) { return c[0] > 180 && c[1] < 60 && c[2] < 70; }
bool is_blue(const std::array<int, 3>& c) { return c[2] > 170 && c[0] < 70 && c[1] < 110; }

TEST(Picture, WallAndLayerTopAreWhereTheyBelong) {
  const Scratch folder;
  PictureOptions o = half_way();
  o.color = PictureColor::kPlain;
  o.width_px = 1400;
  draw_slice(folder / "a.png", ball_mesh<3>(24), o);
  const Image image(folder / "a.png");
  ASSERT_EQ(image.width(), 1400);
  // The drawing is square, 12 pixels from the left and the top.
  const double side = 1400 - 24.0;
  int red = 0, blue = 0, red_off = 0, blue_off = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double r = std::hypot((x + 0.5 - 12.0) / side - 0.5, (y + 0.5 - 12.0) / side - 0.5);
      if (is_red(image.at(x, y))) (std::abs(r - 0.25) < 0.005 ? red : red_off) += 1;
      if (is_blue(image.at(x, y))) (std::abs(r - 0.35) < 0.005 ? blue : blue_off) += 1;
    }
  }
  EXPECT_GT(red, 1500);
  EXPECT_GT(blue, 1500);
  EXPECT_EQ(red_off, 0);
  EXPECT_EQ(blue_off, 0);
}

TEST(Picture, EveryFormatColorAndDimension) {
  const Scratch folder;
  const Mesh<3> solid = ball_mesh<3>(6);
  const Mesh<2> plane = ball_mesh<2>(12);
  for (const char* name : {"a.png", "a.svg", "a.pdf", "a.PNG"}) {
    for (const PictureColor color :
         {PictureColor::kPlain, PictureColor::kQuality, PictureColor::kRegion, PictureColor::kSize}) {
      PictureOptions o = half_way();
      o.color = color;
      o.title = "a title";
      draw_slice(folder / name, solid, o);
      EXPECT_GT(std::filesystem::file_size(folder / name), 2000u);
      draw_slice(folder / name, plane, o);
      EXPECT_GT(std::filesystem::file_size(folder / name), 2000u);
    }
  }
}

TEST(Picture, SameBytesTwice) {
  const Scratch folder;
  const Mesh<3> mesh = ball_mesh<3>(8);
  for (const std::string extension : {".png", ".svg", ".pdf"}) {
    draw_slice(folder / ("a" + extension), mesh, half_way());
    draw_slice(folder / ("b" + extension), mesh, half_way());
    EXPECT_TRUE(read_text(folder / ("a" + extension)) == read_text(folder / ("b" + extension))) << extension;
  }
}

int pixels_of_region(const Image& image, int region) {
  const Rgb c = region_color(region);
  return image.count([&](const std::array<int, 3>& p) {
    for (std::size_t k = 0; k < 3; ++k)
      if (std::abs(p[k] - 255 * c[k]) > 2) return false;
    return true;
  });
}

TEST(Picture, RegionsKeepTheirColors) {
  const Scratch folder;
  PictureOptions o = half_way();
  o.color = PictureColor::kRegion;
  draw_slice(folder / "a.png", ball_mesh<3>(6), o);  // large cells: most pixels are far from any line
  const Image image(folder / "a.png");
  for (int region = 0; region < 4; ++region) {
    const int pixels = pixels_of_region(image, region);
    EXPECT_GT(pixels, 1000) << region;
  }
}

// Two tags have the first two colours, and the legend shows no others.
TEST(Picture, RegionsOfOtherMeshesAreTheirTags) {
  const Scratch folder;
  PictureOptions o = half_way();
  o.color = PictureColor::kRegion;
  Mesh<3> mesh = ball_mesh<3>(6);
  mesh.point_fields.clear();
  for (Index& tag : mesh.cell_tags) tag = tag == 0 ? -5 : 1000;
  mesh.cell_names = {{1000, "steel"}};
  draw_slice(folder / "a.png", mesh, o);
  const Image image(folder / "a.png");
  for (int region = 0; region < 4; ++region) {
    const int pixels = pixels_of_region(image, region);
    EXPECT_EQ(pixels > 0, region < 2) << region << ": " << pixels;
  }
}

TEST(Picture, DenseLayersDoNotTurnBlackOrWhite) {
  // 2000 layers in 400 pixels, all of quality 0.5: the picture must show that quality's colour nearly
  // everywhere.
  const Scratch folder;
  Mesh<2> mesh;
  const int n = 2000;
  MeshField quality{"quality", 1, {}};
  for (int i = 0; i <= n; ++i) {
    mesh.points.emplace_back(0.0, static_cast<double>(i) / n);
    mesh.points.emplace_back(1.0, static_cast<double>(i) / n);
  }
  for (Index i = 0; i < n; ++i) {
    mesh.cells.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    mesh.cells.push_back({2 * i, 2 * i + 3, 2 * i + 2});
    quality.values.insert(quality.values.end(), {0.5, 0.5});
  }
  mesh.cell_fields = {quality};
  PictureOptions o = half_way();
  draw_slice(folder / "a.png", mesh, o);
  const Image image(folder / "a.png");
  const Rgb c = quality_color(0.5);
  int good = 0, all = 0;
  for (int y = 20; y < 380; ++y) {
    for (int x = 20; x < 380; ++x, ++all) {
      const auto p = image.at(x, y);
      good += std::abs(p[0] - 255 * c[0]) < 40 && std::abs(p[1] - 255 * c[1]) < 40 &&
              std::abs(p[2] - 255 * c[2]) < 40;
    }
  }
  EXPECT_GT(good, all * 95 / 100);
}

TEST(Picture, WindowMuchSmallerThanACell) {
  const Scratch folder;
  PictureOptions o = half_way();
  o.color = PictureColor::kRegion;
  o.window = {0.75 - 1e-7, 0.5 - 1e-7, 0.75 + 1e-7, 0.5 + 1e-7};
  draw_slice(folder / "a.png", ball_mesh<3>(2), o);
  const Image image(folder / "a.png");
  EXPECT_GT(image.count([](const std::array<int, 3>& p) {
    return p != std::array<int, 3>{255, 255, 255};
  }),
            380 * 380);
}

TEST(Picture, VectorFilesStaySmall) {
  const Scratch folder;
  const Mesh<2> mesh = ball_mesh<2>(160);  // 51 k triangles of less than a pixel
  draw_slice(folder / "a.svg", mesh, half_way());
  draw_slice(folder / "a.pdf", mesh, half_way());
  EXPECT_LT(std::filesystem::file_size(folder / "a.pdf"), 4u << 20);
  EXPECT_LT(std::filesystem::file_size(folder / "a.svg"), 20u << 20);
}

TEST(Picture, MissingDataFallsBackToGrey) {
  const Scratch folder;
  const Mesh<3> mesh = lattice<3>(3);
  for (const PictureColor color : {PictureColor::kQuality, PictureColor::kRegion, PictureColor::kSize}) {
    PictureOptions o = half_way();
    o.color = color;
    EXPECT_NO_THROW(draw_slice(folder / "a.png", mesh, o));
  }
}

TEST(Picture, Errors) {
  const Scratch folder;
  const Mesh<3> mesh = lattice<3>(2);
  const auto code = [&](const std::string& name, const PictureOptions& o) {
    try {
      draw_slice(folder / name, mesh, o);
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::kInternal;
  };
  PictureOptions o = half_way();
  EXPECT_EQ(code("a.jpg", o), ErrorCode::kFileUnsupported);
  EXPECT_EQ(code("no/a.png", o), ErrorCode::kFileWrite);
  EXPECT_EQ(code("no/a.pdf", o), ErrorCode::kFileWrite);
  o.plane.offset = 7.0;
  EXPECT_EQ(code("a.png", o), ErrorCode::kParameter);
  o = half_way();
  o.window = {3, 3, 4, 4};
  EXPECT_EQ(code("a.png", o), ErrorCode::kParameter);
  o.window = {1, 0, 0, 1};
  EXPECT_EQ(code("a.png", o), ErrorCode::kParameter);
  o = half_way();
  o.width_px = 10;
  EXPECT_EQ(code("a.png", o), ErrorCode::kParameter);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(ColorMap, EndsAndOrder) {
  EXPECT_EQ(quality_color(-1.0), quality_color(0.0));
  EXPECT_EQ(size_color(2.0), size_color(1.0));
  EXPECT_EQ(quality_color(std::nan("")), quality_color(0.0));
  const auto lightness = [](const Rgb& c) { return 0.3 * c[0] + 0.59 * c[1] + 0.11 * c[2]; };
  for (int i = 0; i < 100; ++i) {
    EXPECT_LT(lightness(size_color(i / 100.0)), lightness(size_color((i + 1) / 100.0)));
    EXPECT_LE(lightness(quality_color(i / 100.0)), lightness(quality_color((i + 1) / 100.0)) + 0.02);
  }
}

}  // namespace
}  // namespace lamina
