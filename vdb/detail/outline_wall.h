// The wall of a plane flow: curves that go on forever along z.
#pragma once

#include "core/box_tree.h"
#include "core/field.h"
#include "vdb/detail/curve.h"

namespace lamina::detail {

/// Everything is a function of x and y alone; `closest` keeps the z of the point it was asked for. The
/// normal lies in the plane, T1 along the curve, T2 = z. A corner of the curve is a sharp edge along z. k2
/// repeats k1: nothing is asked along z, and so no size along z is the smallest or the largest.
class OutlineWall : public WallField {
 public:
  /// REQUIRES paths that are apart (require_apart), solid to the left of closed ones.
  explicit OutlineWall(std::vector<Path> paths);

  [[nodiscard]] WallPoint at(const Vec3& x) const override;
  [[nodiscard]] double phi(const Vec3& x) const override;
  int others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const override;
  [[nodiscard]] Box<3> bounds() const override { return bounds_; }

  [[nodiscard]] std::int64_t corners() const;
  /// The curves as polylines: the ends of their arcs.
  [[nodiscard]] std::vector<std::vector<Vec2>> polylines() const;
  [[nodiscard]] double length() const;

 private:
  /// Arcs of all paths in one list.
  struct Piece {
    Arc arc;
    Index previous, next;  ///< of the same path; kNone beyond the ends of an open one
    double turn0, turn1;   ///< at its start and its end
    bool corner0, corner1;
    bool sheet;                                 ///< of an open path
    double sheet_side;                          ///< of a sheet: +1 in the fluid, -1 within a body
    std::array<Index, 2> corner{kNone, kNone};  ///< the corners next to it along its path
    std::array<Index, 2> bend{kNone, kNone};    ///< the bends next to it along its path
  };
  struct Corner {
    Vec2 place;
    double angle;
  };
  struct Hit {
    double d2 = std::numeric_limits<double>::infinity();
    Index piece = kNone;
    double u = 0.0;
    Vec2 point = Vec2::Zero(), offset = Vec2::Zero();
  };
  struct Bend {
    Vec2 place, tangent;
    double curvature;
  };

  void add(const Path& path, double sheet_side);
  void find_features(std::size_t first, const Path& path);
  void build_tree();
  [[nodiscard]] const Piece& piece(Index i) const { return pieces_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Hit closest(const Vec3& x) const;
  [[nodiscard]] Vec2 normal_at(const Hit& hit) const;
  [[nodiscard]] double sign(const Hit& hit) const;
  [[nodiscard]] bool on_corner(const Hit& hit, double sign, double& turn) const;
  [[nodiscard]] WallPoint describe(const Hit& hit, double sign, double z) const;
  void describe_beside(const Piece& piece, WallPoint& wall) const;
  [[nodiscard]] bool minimum_at_joint(Index i, bool end, const Vec2& x, Hit& hit) const;

  std::vector<Piece> pieces_;
  std::vector<Corner> corners_;
  std::vector<Bend> bends_;
  Box<3> bounds_;
  double tiny_ = 0.0;           ///< distances below this have no direction
  Vec3 origin_ = Vec3::Zero();  ///< the tree's coordinates are relative to this
  BoxTree tree_;
};

}  // namespace lamina::detail
