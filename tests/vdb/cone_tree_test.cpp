#include "vdb/detail/cone_tree.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using testing_surfaces::Dice;

constexpr double kPi = std::numbers::pi;

// Small flat boxes all over space, each with a point of its own and a normal there to either side, of which
// its cones know that they are within `spread` of another direction.
struct Field {
  std::vector<Vec3> points, fronts, backs;
  std::vector<ConePiece> pieces;  // in leaf order
  BoxTree tree;
  ConeTree cones;

  Field(int n, double scale, double spread) {
    Dice dice(7);
    std::vector<BoxRef> refs;
    std::vector<std::array<Cone, 2>> normals;
    const auto direction = [&] { return Vec3(dice.point(-Vec3::Ones(), Vec3::Ones()).normalized()); };
    for (int i = 0; i < n; ++i) {
      const Vec3 at = scale * dice.point(-Vec3::Ones(), Vec3::Ones());
      const Vec3 half = scale * 0.05 * dice.point(Vec3::Zero(), Vec3::Ones());
      const Vec3 corners[2] = {at - half, at + half};
      refs.push_back(BoxRef::around(corners, 2, static_cast<Index>(i)));
      points.push_back(at + half.cwiseProduct(dice.point(-Vec3::Ones(), Vec3::Ones())));
      fronts.push_back(direction());
      backs.push_back(-fronts.back());
      const auto around = [&](const Vec3& n_at) {
        const double turn = spread * dice.point(Vec3::Zero(), Vec3::Ones())[0];
        const Vec3 axis = std::cos(turn) * n_at + std::sin(turn) * n_at.unitOrthogonal();
        return Cone::around(axis).widened(std::cos(spread));
      };
      normals.push_back({around(fronts.back()), i % 7 == 0 ? Cone::nothing() : around(backs.back())});
    }
    const std::vector<BoxRef> boxes = refs;
    tree = build_box_tree(std::move(refs));
    for (const Index id : tree.ids) {
      const BoxRef& b = boxes[static_cast<std::size_t>(id)];
      pieces.push_back(
          {{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}, normals[static_cast<std::size_t>(id)]});
    }
    cones = ConeTree(tree, pieces);
  }

  [[nodiscard]] std::set<Index> facing(const Vec3& x, double reach, bool front, bool back,
                                       const Vec3& known = Vec3::Zero()) const {
    std::set<Index> seen;
    cones.visit_facing(x, reach, front, back, known,
                       [&](int k) { seen.insert(tree.ids[static_cast<std::size_t>(k)]); });
    return seen;
  }
};

TEST(ConeTree, FindsAllThatFaceAPoint) {
  for (const int n : {1, 2, 5, 300})
    for (const double scale : {1e-25, 1e-3, 1.0, 1e25})
      for (const double spread : {0.0, 0.02, 0.5, 1.5}) {
        const Field field(n, scale, spread);
        Dice dice(8);
        for (int i = 0; i < 400; ++i) {
          const std::size_t k = static_cast<std::size_t>(i % n);
          const bool front = i % 2 == 0;
          if (!front && k % 7 == 0) continue;
          // On the ray from the point of a piece along its normal: at no, little, and much height.
          const double height = i % 5 == 0 ? 0.0 : scale * std::pow(10.0, -6.0 + 0.02 * i);
          const Vec3 x = field.points[k] + height * (front ? field.fronts : field.backs)[k];
          const double reach = (x - field.points[k]).norm();
          EXPECT_EQ(field.facing(x, reach, front, !front).count(static_cast<Index>(k)), 1U)
              << n << " " << scale << " " << spread << " " << height;
          EXPECT_EQ(field.facing(x, reach, true, true).count(static_cast<Index>(k)), 1U);
          // Unless the direction is known: this one differs by a bit more than what is taken for the same.
          const Vec3& normal = (front ? field.fronts : field.backs)[k];
          const double off = (ConeTree::kKnownDegrees + 0.01) * kPi / 180.0;
          const Vec3 known = std::cos(off) * normal + std::sin(off) * normal.unitOrthogonal();
          EXPECT_EQ(field.facing(x, reach, front, !front, known).count(static_cast<Index>(k)), 1U);
        }
      }
}

TEST(ConeTree, PassesOverThoseThatFaceElsewhereOrAreFar) {
  const Field field(3000, 1.0, 0.01);
  Dice dice(9);
  std::size_t seen = 0, near = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 x = dice.point(-Vec3::Ones(), Vec3::Ones());
    seen += field.facing(x, 10.0, true, false).size();
    near += field.facing(x, 0.1, true, true).size();
  }
  EXPECT_LT(seen, 100U * 60U);
  EXPECT_LT(near, 100U * 10U);
  ConeTree().visit_facing(Vec3::Zero(), 1.0, true, true, Vec3::UnitX(),
                          [](int) { FAIL() << "an empty tree"; });
}

// A plate of one normal: nothing but the known direction is to be found there.
TEST(ConeTree, PassesOverTheKnownDirection) {
  std::vector<BoxRef> refs;
  std::vector<ConePiece> pieces;
  for (int i = 0; i < 100; ++i) {
    const Vec3 corners[2] = {Vec3(i, 0, 0), Vec3(i + 1, 1, 0)};
    refs.push_back(BoxRef::around(corners, 2, static_cast<Index>(i)));
  }
  const std::vector<BoxRef> boxes = refs;
  const BoxTree tree = build_box_tree(std::move(refs));
  for (const Index id : tree.ids) {
    const BoxRef& b = boxes[static_cast<std::size_t>(id)];
    pieces.push_back({{b.lo[0], b.lo[1], b.lo[2]},
                      {b.hi[0], b.hi[1], b.hi[2]},
                      {Cone::around(Vec3::UnitZ()), Cone::around(-Vec3::UnitZ())}});
  }
  const ConeTree cones(tree, pieces);
  const auto visits = [&](double degrees, bool front) {
    int count = 0;
    const double angle = degrees * kPi / 180.0;
    const Vec3 x(50.5, 0.5, front ? 1.0 : -1.0), known(std::sin(angle), 0.0, std::cos(angle) * x[2]);
    cones.visit_facing(x, 10.0, front, !front, known, [&](int) { ++count; });
    return count;
  };
  for (const bool front : {true, false}) {
    EXPECT_EQ(visits(0.0, front), 0);
    EXPECT_EQ(visits(9.0, front), 0);
    EXPECT_GT(visits(11.0, front), 0);
    EXPECT_GT(visits(180.0, front), 0);
  }
}

TEST(ConeTree, Cones) {
  const Cone x = Cone::around(Vec3::UnitX()), y = Cone::around(Vec3::UnitY());
  const std::array<Cone, 3> three = {x, Cone::nothing(), y};
  const Cone both = merge(three);
  EXPECT_NEAR(both.cos_half, std::sqrt(0.5), 1e-5);
  EXPECT_NEAR(both.axis[0], both.axis[1], 1e-6);
  EXPECT_NEAR(both.widened(std::cos(0.1)).cos_half, std::cos(0.25 * kPi + 0.1), 1e-5);
  EXPECT_TRUE(both.widened(std::cos(1.0)).holds_all());
  EXPECT_TRUE(merge(std::array<Cone, 2>{x, Cone::around(-Vec3::UnitX())}).holds_all());
  EXPECT_TRUE(merge(std::array<Cone, 2>{x, Cone::everything()}).holds_all());
  EXPECT_TRUE(merge(std::array<Cone, 2>{Cone::nothing(), Cone::nothing()}).holds_nothing());
  EXPECT_TRUE(Cone::nothing().widened(0.5).holds_nothing());
}

}  // namespace
}  // namespace lamina::detail
