// The closest arc is found by a tree of boxes, its closest point by Newton's method. On a corner that opens
// towards x the frame is that of the ray from it; anywhere else it is that of the curve.
#include "vdb/detail/outline_wall.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lamina::detail {
namespace {

constexpr double kTiny = 1e-11;  // of the bounding box's diagonal

Vec3 in_space(const Vec2& v) { return {v[0], v[1], 0.0}; }
/// To the right: out of a solid to the left.
Vec2 right_of(const Vec2& tangent) { return {tangent[1], -tangent[0]}; }

/// +1 where x lies in the fluid around closed paths, -1 inside of them; by the rays to the right of x.
double side_of(const std::vector<Path>& paths, const Vec2& x) {
  bool inside = false;
  for (const Path& path : paths) {
    if (!path.closed) continue;
    for (std::size_t i = 0; i < path.arcs.size(); ++i) {
      const Vec2 a = path.arcs[i].at(0.0), b = path.arcs[path.next_joint(i)].at(0.0);
      if ((a[1] > x[1]) != (b[1] > x[1]) && x[0] < a[0] + (x[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]))
        inside = !inside;
    }
  }
  return inside ? -1.0 : 1.0;
}

}  // namespace

OutlineWall::OutlineWall(std::vector<Path> paths) {
  for (const Path& path : paths) {
    for (const Arc& arc : path.arcs) {
      const Box<2> box = arc.bounds();
      bounds_.extend(in_space(box.lo));
      bounds_.extend(in_space(box.hi));
    }
  }
  tiny_ = kTiny * bounds_.diagonal();
  origin_ = bounds_.center();
  for (const Path& path : paths) add(path, path.closed ? 1.0 : side_of(paths, path.arcs.front().at(0.5)));
  build_tree();
}

void OutlineWall::add(const Path& path, double sheet_side) {
  const std::size_t first = pieces_.size(), n = path.arcs.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Joint &start = path.joints[i], &end = path.joints[path.next_joint(i)];
    const auto id = [&](std::size_t k) { return static_cast<Index>(first + k % n); };
    pieces_.push_back({.arc = path.arcs[i],
                       .previous = i > 0 || path.closed ? id(i + n - 1) : kNone,
                       .next = i + 1 < n || path.closed ? id(i + 1) : kNone,
                       .turn0 = start.turn,
                       .turn1 = end.turn,
                       .corner0 = start.corner,
                       .corner1 = end.corner,
                       .sheet = !path.closed,
                       .sheet_side = sheet_side});
  }
  find_features(first, path);
}

// Corners, and bends: ends of arcs where curvature falls too fast for sizes to follow. Each arc is given the
// next ones before and behind it by walking twice around the path.
void OutlineWall::find_features(std::size_t first, const Path& path) {
  constexpr double kFall = 4.0;     // ratio of curvatures along an arc that is a fall: sizes double
  constexpr double kMildest = 1.0;  // curvature times diagonal below which no bend is worth a source
  const std::size_t n = path.arcs.size();
  const double least = kMildest / bounds_.diagonal();
  std::vector<std::array<Index, 2>> corner(n, {kNone, kNone}), bend(n, {kNone, kNone});  // at both ends
  for (std::size_t i = 0; i < n; ++i) {
    const Arc& arc = path.arcs[i];
    if (path.joints[i].corner) {
      corner[i][0] = static_cast<Index>(corners_.size());
      if (i > 0 || path.closed) corner[(i + n - 1) % n][1] = corner[i][0];
      corners_.push_back({arc.at(0.0), std::abs(path.joints[i].turn)});
    }
    const std::array<Bend2, 2> ends{arc.bend(0.0), arc.bend(1.0)};
    const std::size_t steep = std::abs(ends[0].curvature) > std::abs(ends[1].curvature) ? 0 : 1;
    const double most = std::abs(ends[steep].curvature);
    const double before = std::abs(path.arcs[(i + n - 1) % n].bend(1.0).curvature);
    const double after = std::abs(path.arcs[(i + 1) % n].bend(0.0).curvature);
    const auto falls = [&](double to) { return most > least && most >= kFall * std::abs(to); };
    const bool jumps =
        falls(steep == 0 ? before : after) && !path.joints[steep == 0 ? i : path.next_joint(i)].corner;
    if (!falls(ends[1 - steep].curvature) && !jumps) continue;
    bend[i][steep] = static_cast<Index>(bends_.size());
    bends_.push_back({arc.at(static_cast<double>(steep)), ends[steep].tangent, ends[steep].curvature});
  }
  if (!path.closed) {
    corner[n - 1][1] = static_cast<Index>(corners_.size());
    corners_.push_back({path.arcs.back().at(1.0), std::numbers::pi});
  }
  const std::size_t rounds = path.closed ? 2 : 1;
  Index last_corner = kNone, last_bend = kNone, next_corner = kNone, next_bend = kNone;
  for (std::size_t k = 0; k < rounds * n; ++k) {
    const std::size_t i = k % n, j = n - 1 - i;
    Piece &ahead = pieces_[first + i], &behind = pieces_[first + j];
    const auto meet = [](Index& last, const std::array<Index, 2>& ends, std::size_t near, Index& of_piece) {
      if (ends[near] != kNone) last = ends[near];
      of_piece = last;
      if (ends[1 - near] != kNone) last = ends[1 - near];
    };
    meet(last_corner, corner[i], 0, ahead.corner[0]);
    meet(last_bend, bend[i], 0, ahead.bend[0]);
    meet(next_corner, corner[j], 1, behind.corner[1]);
    meet(next_bend, bend[j], 1, behind.bend[1]);
  }
  for (std::size_t i = 0; i < n; ++i)  // a bend at the far end of an arc is next to all of it
    for (const std::size_t end : {0u, 1u})
      if (bend[i][end] != kNone) pieces_[first + i].bend[end] = bend[i][end];
}

void OutlineWall::build_tree() {
  std::vector<BoxRef> refs;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Box<2> box = pieces_[i].arc.bounds();
    const std::array<Vec3, 2> ends{in_space(box.lo) - origin_, in_space(box.hi) - origin_};
    refs.push_back(BoxRef::around(ends.data(), 2, static_cast<Index>(i)));
  }
  tree_ = build_box_tree(std::move(refs));
}

OutlineWall::Hit OutlineWall::closest(const Vec3& x) const {
  const Vec3 from(x[0] - origin_[0], x[1] - origin_[1], 0.0);
  const Vec2 at(x[0], x[1]);
  Hit hit;
  visit_nearest(tree_, from.data(), hit.d2, 1.0, [&](int begin, int count) {
    for (int k = begin; k < begin + count; ++k) {
      const Index i = tree_.ids[static_cast<std::size_t>(k)];
      const ArcPoint p = closest_on(piece(i).arc, at);
      if (p.d2 < hit.d2) hit = {p.d2, i, p.u, p.point, p.offset};
    }
  });
  return hit;
}

// Of the curve itself, not of the wall that chords stand for; at a joint the mean of both sides. At the end
// of a sheet away from it.
Vec2 OutlineWall::normal_at(const Hit& hit) const {
  const Piece& p = piece(hit.piece);
  const Vec2 own = p.arc.slope(hit.u).normalized();
  if (hit.u > 0.0 && hit.u < 1.0) return right_of(own);
  const bool start = hit.u == 0.0;
  const Index beside = start ? p.previous : p.next;
  if (beside == kNone) return start ? Vec2(-own) : own;
  const Vec2 other = piece(beside).arc.slope(start ? 1.0 : 0.0).normalized();
  const Vec2 sum = own + other;
  // A cusp points along the curve.
  return sum.norm() > 1e-6 ? right_of(sum.normalized()) : Vec2(start ? other : own);
}

double OutlineWall::sign(const Hit& hit) const {
  const Piece& p = piece(hit.piece);
  if (p.sheet) return p.sheet_side;
  return normal_at(hit).dot(hit.offset) < 0.0 ? -1.0 : 1.0;
}

// Is the closest point on a corner that stands out to the side of x?
bool OutlineWall::on_corner(const Hit& hit, double sign, double& turn) const {
  const Piece& p = piece(hit.piece);
  if (hit.u > 0.0 && hit.u < 1.0) return false;
  if (!(hit.u == 0.0 ? p.corner0 : p.corner1)) return false;
  turn = hit.u == 0.0 ? p.turn0 : p.turn1;
  return p.sheet || turn * sign > 0.0;
}

WallPoint OutlineWall::describe(const Hit& hit, double sign, double z) const {
  const Piece& p = piece(hit.piece);
  const double d = std::sqrt(hit.d2);
  WallPoint wall;
  wall.phi = sign * d;
  wall.closest = {hit.point[0], hit.point[1], z};
  wall.T2 = Vec3::UnitZ();
  double turn = 0.0;
  if (on_corner(hit, sign, turn)) {
    wall.feature = WallFeature::kEdge;
    wall.N = in_space(d > tiny_ ? Vec2(sign / d * hit.offset) : normal_at(hit));
    wall.k1 = std::numeric_limits<double>::infinity();
    wall.reliability = 0.0;
  } else {
    const Bend2 bend = p.arc.bend(hit.u);
    const double side = p.sheet && right_of(bend.tangent).dot(hit.offset) * sign < 0.0 ? -1.0 : 1.0;
    wall.N = in_space(side * right_of(bend.tangent));
    wall.k1 = side * bend.curvature;
  }
  wall.k2 = wall.k1;
  wall.T1 = wall.T2.cross(wall.N);
  describe_beside(p, wall);
  return wall;
}

void OutlineWall::describe_beside(const Piece& p, WallPoint& wall) const {
  const Vec2 at = wall.closest.head<2>();
  for (const Index i : p.corner) {
    if (i == kNone) continue;
    const Corner& c = corners_[static_cast<std::size_t>(i)];
    const double d = (c.place - at).norm();
    if (!(d < wall.edge_distance)) continue;
    wall.edge_distance = d;
    wall.edge_direction = Vec3::UnitZ();
    wall.edge_angle = c.angle;
  }
  if (wall.feature == WallFeature::kEdge) wall.edge_distance = 0.0;
  for (const Index i : p.bend) {
    if (i == kNone) continue;
    const Bend& b = bends_[static_cast<std::size_t>(i)];
    const double d = (b.place - at).norm();
    if (!(d < wall.bend_distance)) continue;
    wall.bend_distance = d;
    wall.bend_direction = in_space(b.tangent);
    wall.bend_k1 = wall.N.head<2>().dot(right_of(b.tangent)) < 0.0 ? -b.curvature : b.curvature;
    wall.bend_k2 = wall.bend_k1;
  }
}

WallPoint OutlineWall::at(const Vec3& x) const {
  const Hit hit = closest(x);
  return describe(hit, sign(hit), x[2]);
}

double OutlineWall::phi(const Vec3& x) const {
  const Hit hit = closest(x);
  return sign(hit) * std::sqrt(hit.d2);
}

// Does the distance from x have a local minimum at the start (or, at the last joint of an open path, the end)
// of a piece?
bool OutlineWall::minimum_at_joint(Index i, bool end, const Vec2& x, Hit& hit) const {
  const Piece& p = piece(i);
  const Vec2 place = p.arc.at(end ? 1.0 : 0.0), offset = x - place;
  const Index before = end ? i : p.previous, after = end ? p.next : i;
  if (before != kNone && offset.dot(piece(before).arc.slope(1.0)) < 0.0) return false;
  if (after != kNone && offset.dot(piece(after).arc.slope(0.0)) > 0.0) return false;
  hit = {offset.squaredNorm(), i, end ? 1.0 : 0.0, place, offset};
  return true;
}

int OutlineWall::others(const Vec3& x, const WallPoint& nearest, double reach,
                        std::span<WallPoint> out) const {
  constexpr double kSeparation = 0.98480775301220806;  // cos 10 degrees
  if (out.empty() || !(std::abs(nearest.phi) <= reach)) return 0;
  const double side = nearest.phi < 0.0 ? -1.0 : 1.0;
  const Vec2 at(x[0], x[1]);
  Vec2 main = (nearest.closest - x).head<2>();
  main = main.norm() > tiny_ ? Vec2(main.normalized()) : Vec2(-side * nearest.N.head<2>());
  thread_local std::vector<std::pair<Hit, Vec2>> found;
  found.clear();
  const auto consider = [&](const Hit& hit) {
    if (!(hit.d2 <= reach * reach)) return;
    const double d = std::sqrt(hit.d2);
    const Vec2 to = d > tiny_ ? Vec2(-hit.offset / d) : Vec2(-side * normal_at(hit));
    if (to.dot(main) > kSeparation || sign(hit) != side) return;
    found.emplace_back(hit, to);
  };
  const Vec3 from(x[0] - origin_[0], x[1] - origin_[1], 0.0);
  double limit = reach * reach * (1.0 + 1e-12);
  visit_nearest(tree_, from.data(), limit, 1.0, [&](int begin, int count) {
    for (int k = begin; k < begin + count; ++k) {
      const Index i = tree_.ids[static_cast<std::size_t>(k)];
      ArcPoint p;
      Hit hit;
      if (interior_minimum(piece(i).arc, at, p)) consider({p.d2, i, p.u, p.point, p.offset});
      if (minimum_at_joint(i, false, at, hit)) consider(hit);
      if (piece(i).next == kNone && minimum_at_joint(i, true, at, hit)) consider(hit);
    }
  });
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.first.d2 != b.first.d2 ? a.first.d2 < b.first.d2 : a.first.piece < b.first.piece;
  });
  std::size_t count = 0;
  std::array<Vec2, 16> kept;
  for (const auto& [hit, to] : found) {
    if (count == std::min(out.size(), kept.size())) break;
    bool apart = true;
    for (std::size_t i = 0; i < count; ++i) apart = apart && to.dot(kept[i]) <= kSeparation;
    if (!apart) continue;
    kept[count] = to;
    out[count++] = describe(hit, side, x[2]);
  }
  return static_cast<int>(count);
}

std::int64_t OutlineWall::corners() const { return static_cast<std::int64_t>(corners_.size()); }

double OutlineWall::length() const {
  double sum = 0.0;
  for (const Piece& p : pieces_) sum += (p.arc.at(1.0) - p.arc.at(0.0)).norm();
  return sum;
}

std::vector<std::vector<Vec2>> OutlineWall::polylines() const {
  std::vector<std::vector<Vec2>> lines;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Piece& p = pieces_[i];
    if (p.previous == kNone || p.previous >= static_cast<Index>(i)) lines.emplace_back();
    lines.back().push_back(p.arc.at(0.0));
    if (p.next == kNone || p.next <= static_cast<Index>(i)) lines.back().push_back(p.arc.at(1.0));
  }
  return lines;
}

}  // namespace lamina::detail
