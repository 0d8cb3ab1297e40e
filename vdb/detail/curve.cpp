#include "vdb/detail/curve.h"

#include <fmt/format.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/predicates.h"

namespace lamina::detail {
namespace {

constexpr double kArcTurn = 0.1;  // radians; no arc turns by more

double angle_between(const Vec2& a, const Vec2& b) { return std::atan2(cross(a, b), a.dot(b)); }

/// Points as arcs: knots of a spline, or chords.
using Points = std::vector<Vec2>;

// ---- splines ----

/// Second derivatives of the spline through `p` at its knots, which lie h apart.
std::vector<Vec2> second_derivatives(const Points& p, const std::vector<double>& h, bool periodic) {
  const auto n = static_cast<Eigen::Index>(p.size());
  std::vector<Vec2> out(p.size(), Vec2::Zero());
  if (n < 3) return out;
  const auto chord = [&](Eigen::Index i) -> Vec2 {
    return (p[static_cast<std::size_t>((i + 1) % n)] - p[static_cast<std::size_t>(i)]) /
           h[static_cast<std::size_t>(i)];
  };
  if (n == 3 && !periodic) {
    out.assign(3, 2.0 * (chord(1) - chord(0)) / (h[0] + h[1]));
    return out;
  }
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(n, 2);
  const auto step = [&](Eigen::Index i) { return h[static_cast<std::size_t>(i)]; };
  for (Eigen::Index i = periodic ? 0 : 1; i < (periodic ? n : n - 1); ++i) {
    const Eigen::Index before = (i + n - 1) % n, after = (i + 1) % n;
    entries.emplace_back(i, before, step(before));
    entries.emplace_back(i, i, 2.0 * (step(before) + step(i)));
    entries.emplace_back(i, after, step(i));
    right.row(i) = 6.0 * (chord(i) - chord(before)).transpose();
  }
  if (!periodic) {
    // Equal third derivatives on both sides of the second and of the last but one knot.
    for (const Eigen::Index row : {Eigen::Index{0}, n - 1}) {
      const Eigen::Index inner = row == 0 ? 1 : n - 2, from = row == 0 ? 0 : n - 3;
      entries.emplace_back(row, inner - 1, step(from + 1));
      entries.emplace_back(row, inner, -step(from) - step(from + 1));
      entries.emplace_back(row, inner + 1, step(from));
    }
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success)
    throw Error(ErrorCode::kInternal, "the equations of a spline have no solution");
  const Eigen::MatrixX2d solution = solver.solve(right);
  for (Eigen::Index i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = solution.row(i).transpose();
  return out;
}

/// The part of an arc over [a, b].
Arc part_of(const Arc& arc, double a, double b) {
  const double w = b - a;
  Arc part;
  part.straight = false;
  part.c = {arc.at(a), w * arc.slope(a), 0.5 * w * w * arc.second(a), w * w * w * arc.c[3]};
  return part;
}

void add_cut(const Arc& arc, std::vector<Arc>& out) {
  constexpr int kSamples = 8, kMost = 128;
  double turn = 0.0;
  for (int i = 0; i < kSamples; ++i)
    turn += std::abs(angle_between(arc.slope(static_cast<double>(i) / kSamples),
                                   arc.slope(static_cast<double>(i + 1) / kSamples)));
  const int n = static_cast<int>(std::clamp(std::ceil(turn / kArcTurn), 1.0, static_cast<double>(kMost)));
  for (int i = 0; i < n; ++i)
    out.push_back(part_of(arc, static_cast<double>(i) / n, static_cast<double>(i + 1) / n));
}

/// Spline through points; a periodic one returns to the first.
void add_spline(const Points& p, bool periodic, std::vector<Arc>& out) {
  const std::size_t spans = periodic ? p.size() : p.size() - 1;
  if (spans == 1) {
    Arc line;
    line.c = {p[0], p[1] - p[0], Vec2::Zero(), Vec2::Zero()};
    line.ends.fill({line.c[1].normalized(), 0.0});
    out.push_back(line);
    return;
  }
  std::vector<double> h(spans);
  for (std::size_t i = 0; i < spans; ++i) h[i] = (p[(i + 1) % p.size()] - p[i]).norm();
  const std::vector<Vec2> m = second_derivatives(p, h, periodic);
  for (std::size_t i = 0; i < spans; ++i) {
    const std::size_t j = (i + 1) % p.size();
    const double w = h[i] * h[i];
    Arc arc;
    arc.straight = false;
    arc.c = {p[i], p[j] - p[i] - w / 6.0 * (2.0 * m[i] + m[j]), 0.5 * w * m[i], w / 6.0 * (m[j] - m[i])};
    add_cut(arc, out);
  }
}

std::vector<std::uint8_t> find_corners(const OutlineCurve& curve, double feature_angle) {
  constexpr double kAlways = 75.0 / 180.0 * std::numbers::pi;
  constexpr double kAlone = 3.0;  // times the turn of a neighbour
  const Points& p = curve.points;
  const std::size_t n = p.size();
  std::vector<double> turn(n, 0.0);
  for (std::size_t i = curve.closed ? 0 : 1; i < (curve.closed ? n : n - 1); ++i)
    turn[i] = std::abs(angle_between(p[i] - p[(i + n - 1) % n], p[(i + 1) % n] - p[i]));
  std::vector<std::uint8_t> corner(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double beside = std::min(turn[(i + n - 1) % n], turn[(i + 1) % n]);
    corner[i] = turn[i] > feature_angle && (!curve.smooth || turn[i] > kAlways || turn[i] > kAlone * beside);
  }
  if (!curve.closed) corner.front() = corner.back() = 1;
  return corner;
}

Path spline_path(const OutlineCurve& curve, const std::vector<std::uint8_t>& corner) {
  Path path;
  path.closed = curve.closed;
  const std::size_t n = curve.points.size();
  std::vector<std::size_t> cuts;
  for (std::size_t i = 0; i < n; ++i)
    if (corner[i]) cuts.push_back(i);
  if (cuts.empty()) {
    add_spline(curve.points, true, path.arcs);
    path.joints.resize(path.arcs.size());
    return path;
  }
  if (curve.closed) cuts.push_back(cuts.front() + n);
  std::vector<std::size_t> starts;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    Points run;
    for (std::size_t i = cuts[k]; i <= cuts[k + 1]; ++i) run.push_back(curve.points[i % n]);
    starts.push_back(path.arcs.size());
    add_spline(run, false, path.arcs);
  }
  path.joints.resize(path.arcs.size() + (curve.closed ? 0 : 1));
  for (const std::size_t start : starts) path.joints[start].corner = true;
  if (!curve.closed) path.joints.back().corner = true;
  return path;
}

// ---- chords ----

/// Unit tangent of the wall at the joint of two chords: that of the circle through the three points, but
/// that of the longer chord where it is a flat face beside a fillet.
Vec2 tangent_between(const Arc& before, const Arc& after) {
  constexpr double kFace = 3.0;  // times the other's length
  const double a = before.c[1].norm(), b = after.c[1].norm();
  const Vec2 ta = before.c[1] / a, tb = after.c[1] / b;
  if (a > kFace * b) return ta;
  if (b > kFace * a) return tb;
  return (b * ta + a * tb).normalized();
}

/// Tangents and curvatures at the ends of the chords.
void smooth_chords(Path& path) {
  constexpr double kFlat = 1e-6;  // radians along a chord
  const std::size_t n = path.arcs.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = path.next_joint(i);
    path.arcs[i].ends.fill({path.arcs[i].c[1].normalized(), 0.0});
    if (!path.joints[i].corner)
      path.arcs[i].ends[0].tangent = tangent_between(path.arcs[(i + n - 1) % n], path.arcs[i]);
    if (!path.joints[j].corner)
      path.arcs[i].ends[1].tangent = tangent_between(path.arcs[i], path.arcs[(i + 1) % n]);
  }
  const auto curvature = [&](std::size_t i) {
    const Arc& arc = path.arcs[i % n];
    const double turn = angle_between(arc.ends[0].tangent, arc.ends[1].tangent);
    return std::abs(turn) < kFlat ? 0.0 : turn / arc.c[1].norm();
  };
  for (std::size_t i = 0; i < n; ++i) {
    const double own = curvature(i);
    if (own == 0.0) continue;
    const auto at_joint = [&](std::size_t joint, std::size_t neighbour) {
      const double other = path.joints[joint].corner ? 0.0 : curvature(neighbour);
      return other == 0.0 ? own : 0.5 * (own + other);
    };
    path.arcs[i].ends[0].curvature = at_joint(i, i + n - 1);
    path.arcs[i].ends[1].curvature = at_joint(path.next_joint(i), i + 1);
  }
}

Path chord_path(const OutlineCurve& curve, const std::vector<std::uint8_t>& corner) {
  Path path;
  path.closed = curve.closed;
  const std::size_t n = curve.points.size();
  for (std::size_t i = 0; i < (curve.closed ? n : n - 1); ++i)
    add_spline({curve.points[i], curve.points[(i + 1) % n]}, false, path.arcs);
  path.joints.resize(n);
  for (std::size_t i = 0; i < n; ++i) path.joints[i].corner = corner[i] != 0;
  smooth_chords(path);
  if (!curve.curvature.empty())
    for (std::size_t i = 0; i < path.arcs.size(); ++i)
      for (const std::size_t end : {std::size_t{0}, std::size_t{1}})
        path.arcs[i].ends[end].curvature = curve.curvature[(i + end) % n];
  return path;
}

void measure_turns(Path& path) {
  const std::size_t n = path.arcs.size();
  for (std::size_t i = path.closed ? 0 : 1; i < n; ++i)
    path.joints[i].turn = angle_between(path.arcs[(i + n - 1) % n].slope(1.0), path.arcs[i].slope(0.0));
  if (!path.closed) path.joints.front().turn = path.joints.back().turn = std::numbers::pi;
}

// ---- crossings ----

struct Chord {
  Vec2 a, b;
  double left, right;
  std::size_t path, arc;
};

bool touch(const Chord& s, const Chord& t) {
  if (std::max(s.a[1], s.b[1]) < std::min(t.a[1], t.b[1])) return false;
  if (std::max(t.a[1], t.b[1]) < std::min(s.a[1], s.b[1])) return false;
  const auto apart = [](const Chord& p, const Chord& q) {
    const double a = orient2d(p.a, p.b, q.a), b = orient2d(p.a, p.b, q.b);
    return (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0);
  };
  return !apart(s, t) && !apart(t, s);
}

bool follow(const Chord& s, const Chord& t, const std::vector<Path>& paths) {
  if (s.path != t.path) return false;
  const std::size_t n = paths[s.path].arcs.size(), gap = s.arc < t.arc ? t.arc - s.arc : s.arc - t.arc;
  return gap == 1 || (paths[s.path].closed && gap + 1 == n);
}

}  // namespace

Bend2 Arc::bend(double u) const {
  if (straight)
    return {((1.0 - u) * ends[0].tangent + u * ends[1].tangent).normalized(),
            (1.0 - u) * ends[0].curvature + u * ends[1].curvature};
  const Vec2 d = slope(u);
  const double speed = d.norm();
  return {d / speed, cross(d, second(u)) / (speed * speed * speed)};
}

Box<2> Arc::bounds() const {
  Box<2> box;
  box.extend(at(0.0));
  box.extend(at(1.0));
  for (int axis = 0; axis < 2; ++axis) {
    // Roots of the slope, in the form that loses no digits.
    const double a = 3.0 * c[3][axis], b = c[2][axis], e = c[1][axis];
    const double root = b * b - a * e;
    if (root < 0.0) continue;
    const double q = -(b + std::copysign(std::sqrt(root), b));
    for (const double u : {a != 0.0 ? q / a : -1.0, q != 0.0 ? e / q : -1.0})
      if (u > 0.0 && u < 1.0) box.extend(at(u));
  }
  return box;
}

bool interior_minimum(const Arc& arc, const Vec2& x, ArcPoint& out) {
  const Vec2 to = arc.c[0] - x;
  const double f0 = to.dot(arc.c[1]);
  if (!(f0 < 0.0)) return false;
  if (arc.straight) {
    const double length2 = arc.c[1].squaredNorm();
    if (!(-f0 < length2)) return false;
    out.u = -f0 / length2;
  } else {
    const double f1 = (arc.at(1.0) - x).dot(arc.slope(1.0));
    if (!(f1 > 0.0)) return false;
    double lo = 0.0, hi = 1.0, u = f0 / (f0 - f1);
    constexpr int kMost = 60;
    for (int i = 0; i < kMost; ++i) {
      const Vec2 r = arc.at(u) - x, d = arc.slope(u);
      const double f = r.dot(d), slope = d.squaredNorm() + r.dot(arc.second(u));
      (f < 0.0 ? lo : hi) = u;
      double next = slope > 0.0 ? u - f / slope : 0.5 * (lo + hi);
      if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
      const bool done = std::abs(next - u) < 1e-15;
      u = next;
      if (done || !(hi - lo > 1e-16)) break;
    }
    out.u = u;
  }
  out.point = arc.at(out.u);
  out.offset = x - out.point;
  if (arc.straight) {  // the offset of a foot is normal to the chord, whatever its rounding
    const Vec2 normal = Vec2(-arc.c[1][1], arc.c[1][0]).normalized();
    out.offset = normal.dot(-to) * normal;
  }
  out.d2 = out.offset.squaredNorm();
  return true;
}

ArcPoint closest_on(const Arc& arc, const Vec2& x) {
  ArcPoint p;
  if (interior_minimum(arc, x, p)) return p;
  const Vec2 a = arc.c[0], b = arc.at(1.0);
  const double da = (x - a).squaredNorm(), db = (x - b).squaredNorm();
  if (da <= db) return {da, 0.0, a, x - a};
  return {db, 1.0, b, x - b};
}

std::vector<Path> make_paths(const Outline& outline, double feature_angle) {
  std::vector<Path> paths;
  for (const OutlineCurve& curve : outline.curves) {
    const std::vector<std::uint8_t> corner = find_corners(curve, feature_angle);
    paths.push_back(curve.smooth ? spline_path(curve, corner) : chord_path(curve, corner));
    measure_turns(paths.back());
  }
  return paths;
}

void require_apart(const std::vector<Path>& paths, const std::string& name) {
  std::vector<Chord> chords;
  for (std::size_t p = 0; p < paths.size(); ++p)
    for (std::size_t i = 0; i < paths[p].arcs.size(); ++i) {
      const Vec2 a = paths[p].arcs[i].at(0.0);
      const std::size_t j = i + 1 < paths[p].arcs.size() ? i + 1 : 0;
      const Vec2 b = paths[p].closed || j != 0 ? paths[p].arcs[j].at(0.0) : paths[p].arcs[i].at(1.0);
      chords.push_back({a, b, std::min(a[0], b[0]), std::max(a[0], b[0]), p, i});
    }
  std::stable_sort(chords.begin(), chords.end(),
                   [](const Chord& s, const Chord& t) { return s.left < t.left; });
  const auto reject = [&](const Chord& s, const Chord& t, const char* what) {
    throw Error(
        ErrorCode::kSurfaceInvalid,
        fmt::format(
            "{}: curve {} {} near ({:g}, {:g}): walls must not touch; move the curves apart, "
            "or join them into one; a part of a .vdb's section thinner than its voxels needs finer ones",
            name, s.path + 1,
            s.path == t.path ? std::string(what) : fmt::format("meets curve {}", t.path + 1),
            0.5 * (t.a[0] + t.b[0]), 0.5 * (t.a[1] + t.b[1])));
  };
  constexpr double kBack = 1e-7;  // radians
  std::vector<const Chord*> open;
  for (const Chord& s : chords) {
    if (paths[s.path].arcs[s.arc].straight &&
        std::abs(paths[s.path].joints[s.arc].turn) > std::numbers::pi - kBack && paths[s.path].closed)
      reject(s, s, "doubles back on itself");
    std::erase_if(open, [&](const Chord* t) { return t->right < s.left; });
    for (const Chord* t : open)
      if (!follow(s, *t, paths) && touch(s, *t)) reject(s, *t, "crosses itself");
    open.push_back(&s);
  }
}

}  // namespace lamina::detail
