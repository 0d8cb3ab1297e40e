#include "vdb/size_grid.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/vdb/message_of.h"
#include "tests/vdb/openvdb_oracle.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/level_set.h"

namespace lamina {
namespace {

using namespace testing_surfaces;
namespace fs = std::filesystem;
using openvdb_oracle::Painted;
using openvdb_oracle::Transform;

class SizeGridTest : public testing::Test {
 protected:
  SizeGridTest() { fs::create_directories(folder_); }
  ~SizeGridTest() override { fs::remove_all(folder_); }

  SizeGrid grid(const Transform& transform, const std::vector<Painted>& boxes, double scale = 1.0) {
    openvdb_oracle::write_painted(path_, "size", transform, boxes);
    return SizeGrid::read(path_, "size", scale);
  }
  std::string refusal(const std::string& name, const std::vector<Painted>& boxes) {
    openvdb_oracle::write_painted(path_, "size", {}, boxes);
    return message_of(ErrorCode::kLevelSetGrid, [&] { (void)SizeGrid::read(path_, name); });
  }

  const fs::path folder_ = fs::temp_directory_path() / ("lamina_sizes_" + std::to_string(::getpid()));
  const fs::path path_ = folder_ / "paint.vdb";
};

/// From the definition, over all boxes.
double by_hand(const std::vector<Painted>& boxes, const Vec3& ijk, double rate, double limit) {
  for (const Painted& b : boxes) {
    double d2 = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = ijk[static_cast<int>(a)];
      const double out = std::max({b.lo[a] - 0.5 - x, x - b.hi[a] - 0.5, 0.0});
      d2 += out * out;
    }
    limit = std::min(limit, b.value + rate * std::sqrt(d2));
  }
  return limit;
}

// Single voxels, a box that OpenVDB keeps as tiles, and one that ends within leaves.
std::vector<Painted> some_boxes() {
  std::vector<Painted> boxes = {{{-128, 0, 0}, {-1, 127, 127}, 0.25}, {{10, 10, 10}, {25, 30, 17}, 0.0625}};
  Dice dice(3);
  for (int i = 0; i < 300; ++i) {
    const Vec3 at = dice.point({40, -60, -60}, {90, 60, 60});
    const std::array<int, 3> voxel = {int(at[0]), int(at[1]), int(at[2])};
    boxes.push_back({voxel, voxel, 0.03125 * (1 + i % 7)});
  }
  return boxes;
}

TEST_F(SizeGridTest, EqualsTheDefinition) {
  const std::vector<Painted> boxes = some_boxes();
  const double voxel = 0.5;
  const SizeGrid sizes = grid({voxel * Mat3::Identity(), {1.0, 2.0, 3.0}}, boxes);
  Dice dice(1);
  int below = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 ijk = dice.point({-150, -150, -150}, {150, 150, 150});
    for (const double rate : {0.02, 0.4, 1e6}) {
      const double limit = i % 2 == 0 ? 2.0 : 0.2;
      const double expected = by_hand(boxes, ijk, rate * voxel, limit);
      EXPECT_NEAR(sizes.bound(voxel * ijk + Vec3(1, 2, 3), rate, limit), expected, 1e-9 * expected);
      below += expected < limit;
    }
  }
  EXPECT_GT(below, 1000);
  EXPECT_EQ(sizes.range(), std::make_pair(0.03125, 0.25));
  EXPECT_NEAR(sizes.bounds().lo[0], 1.0 + voxel * -128.5, 1e-12);
  EXPECT_NEAR(sizes.bounds().hi[1], 2.0 + voxel * 127.5, 1e-12);
}

TEST_F(SizeGridTest, FollowsTurnedAndStretchedVoxels) {
  const std::vector<Painted> boxes = some_boxes();
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  Dice dice(2);
  const SizeGrid turned = grid({0.5 * turn, Vec3::Zero()}, boxes);
  for (int i = 0; i < 300; ++i) {
    const Vec3 ijk = dice.point({-150, -150, -150}, {150, 150, 150});
    EXPECT_NEAR(turned.bound(0.5 * turn * ijk, 0.3, 2.0), by_hand(boxes, ijk, 0.15, 2.0), 1e-9);
  }
  // Of stretched voxels the shortest edge counts: never above the definition, and exact within the voxels.
  const Mat3 stretch = Vec3(0.5, 1.0, 2.0).asDiagonal();
  const SizeGrid stretched = grid({stretch, Vec3::Zero()}, {boxes[1]});
  for (int i = 0; i < 300; ++i) {
    const Vec3 ijk = dice.point({0, 0, 0}, {40, 40, 40});
    Vec3 nearest = ijk;
    for (int a = 0; a < 3; ++a) {
      const auto k = static_cast<std::size_t>(a);
      nearest[a] = std::clamp(ijk[a], boxes[1].lo[k] - 0.5, boxes[1].hi[k] + 0.5);
    }
    const double definition = std::min(2.0, 0.0625 + 0.3 * (stretch * (ijk - nearest)).norm());
    const double bound = stretched.bound(stretch * ijk, 0.3, 2.0);
    EXPECT_LE(bound, definition + 1e-12);
    if (nearest == ijk) {
      EXPECT_EQ(bound, 0.0625);
    }
  }
}

TEST_F(SizeGridTest, UnitsScalePlacesAndSizes) {
  const std::vector<Painted> boxes = {{{0, 0, 0}, {9, 9, 9}, 0.5}};
  const SizeGrid sizes = grid({}, boxes, 1e-3);
  EXPECT_NEAR(sizes.bound(Vec3::Constant(4e-3), 0.2, 1.0), 0.5e-3, 1e-9);
  EXPECT_NEAR(sizes.bound(Vec3(12.5e-3, 4e-3, 4e-3), 0.2, 1.0), 0.5e-3 + 0.2 * 3e-3, 1e-9);
}

// A level set carries copies of painted grids, also where OpenVDB needs larger voxels than the body's.
TEST_F(SizeGridTest, LevelSetsCarryCopies) {
  const std::vector<Painted> boxes = some_boxes();
  for (const double unit : {1.0, 1e-7}) {
    const SizeGrid sizes = grid({}, boxes, unit);
    Surface body = sphere(0.5, 3);
    for (Vec3& p : body.points) p *= unit;
    const LevelSet wall = LevelSet::from_surface(std::move(body), {});
    const fs::path copy = folder_ / "copy.vdb";
    wall.write(copy, nullptr, {&sizes, 1});
    const SizeGrid back = SizeGrid::read(copy, "size");
    Dice dice(4);
    for (int i = 0; i < 500; ++i) {
      const Vec3 x = unit * dice.point({-150, -150, -150}, {150, 150, 150});
      const double expected = sizes.bound(x, 0.01, unit);
      EXPECT_NEAR(back.bound(x, 0.01, unit), expected, 1e-6 * expected);
    }
    const SizeGrid twice[2] = {sizes, sizes};
    EXPECT_NE(message_of(ErrorCode::kLevelSetGrid, [&] { wall.write(copy, nullptr, twice); }).find("'size'"),
              std::string::npos);
  }
}

TEST_F(SizeGridTest, RefusesWhatIsNoSize) {
  EXPECT_NE(refusal("size", {{{0, 0, 0}, {3, 3, 3}, 1.0}, {{5, 6, 7}, {5, 6, 7}, -2.0}})
                .find("holds -2 at (5, 6, 7)"),
            std::string::npos);
  EXPECT_NE(refusal("size", {{{0, 0, 0}, {3, 3, 3}, std::nan("")}}).find("nan"), std::string::npos);
  EXPECT_NE(refusal("size", {}).find("empty"), std::string::npos);
  EXPECT_NE(refusal("paint", {{{0, 0, 0}, {3, 3, 3}, 1.0}}).find("it holds 'size'"), std::string::npos);
  std::ofstream(path_) << "no grid";
  message_of(ErrorCode::kFileFormat, [&] { (void)SizeGrid::read(path_, "size"); });
  message_of(ErrorCode::kFileMissing, [&] { (void)SizeGrid::read(folder_ / "none.vdb", "size"); });
}

}  // namespace
}  // namespace lamina
