// The wall of a triangle surface: exact distances, smoothed frames, sharp edges, and the other walls in
// reach.
#pragma once

#include "core/field.h"
#include "vdb/detail/bends.h"
#include "vdb/detail/bvh.h"
#include "vdb/detail/cone_tree.h"
#include "vdb/detail/curvature.h"
#include "vdb/detail/features.h"
#include "vdb/detail/graded_curvature.h"
#include "vdb/detail/sign.h"
#include "vdb/detail/topology.h"

namespace lamina::detail {

class FacetWall : public WallField {
 public:
  /// `feature_angle` in radians; `sheets` as in SignRule. REQUIRES a cleaned surface with at least one
  /// triangle.
  FacetWall(Surface surface, double feature_angle, bool sheets = false);

  [[nodiscard]] WallPoint at(const Vec3& x) const override;
  [[nodiscard]] WallPoint at_side(const Vec3& x, double sign) const override {
    return describe(bvh_.closest(x), sign);
  }
  [[nodiscard]] double phi(const Vec3& x) const override;
  [[nodiscard]] double distance(const Vec3& x, double eps) const override;
  int others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const override;
  int edges_beside(const WallPoint& wall, double reach, std::span<WallEdge> out) const override {
    return features_.beside(surface_, wall, reach, out);
  }
  int bends_beside(const WallPoint& wall, double reach, std::span<WallBend> out) const override {
    return bends_.beside(wall, reach, out);
  }
  [[nodiscard]] std::array<double, 2> graded_curvatures(const WallPoint& wall, double root) const override;
  [[nodiscard]] Box<3> bounds() const override { return bounds_; }

  /// phi(x), found faster when its absolute value is known to be below `limit`.
  [[nodiscard]] double phi_within(const Vec3& x, double limit) const;
  /// at(x), found faster when phi(x) is known to single precision; the same bits.
  [[nodiscard]] WallPoint at_known(const Vec3& x, double phi) const;

  [[nodiscard]] Vec3 closest_point(const Vec3& x) const { return bvh_.closest(x).point; }

  [[nodiscard]] const Surface& surface() const { return surface_; }
  [[nodiscard]] const Topology& topology() const { return topology_; }
  [[nodiscard]] const SignRule& sign_rule() const { return sign_; }
  [[nodiscard]] const Features& features() const { return features_; }
  [[nodiscard]] const Curvature& curvature() const { return curvature_; }
  /// Lets better estimates replace the curvature of the triangles.
  [[nodiscard]] Curvature& curvature() { return curvature_; }
  /// Finds where the present curvature falls faster than sizes can follow. Before the first call nowhere.
  void find_falls() {
    bends_ = Bends(surface_, topology_, curvature_);
    graded_ = GradedCurvature(surface_, curvature_);
  }

 private:
  struct Candidate {
    double d2;
    TriangleHit hit;
    Vec3 direction;  ///< from x to the closest point
  };
  [[nodiscard]] TriangleHit closest_within(const Vec3& x, double limit) const;
  [[nodiscard]] WallPoint describe(const TriangleHit& hit, double sign) const;
  [[nodiscard]] bool fill_ray(const TriangleHit& hit, double sign, WallPoint& wall) const;
  [[nodiscard]] bool on_sharp(const TriangleHit& hit, double sign, EdgePoint& edge, bool& corner) const;
  [[nodiscard]] Vec3 feature_normal(const TriangleHit& hit) const;
  [[nodiscard]] std::vector<ConePiece> make_pieces() const;
  [[nodiscard]] std::array<Cone, 2> normals_of(Index facet) const;
  [[nodiscard]] bool descends(const TriangleHit& hit) const;
  [[nodiscard]] bool is_local_minimum(const Vec3& x, const TriangleHit& hit) const;
  [[nodiscard]] bool faces(const TriangleHit& hit, double sign) const;
  void collect(const Vec3& x, double sign, double reach, const Vec3& main, std::vector<Candidate>& out) const;

  Surface surface_;
  Box<3> bounds_;
  double tiny_ = 0.0;  ///< distances below this have no direction
  Topology topology_;
  SignRule sign_;
  TriangleBvh bvh_;
  Features features_;
  Curvature curvature_;
  Bends bends_;
  GradedCurvature graded_;
  ConeTree cones_;  ///< the facets, in the leaf order of bvh_
};

}  // namespace lamina::detail
