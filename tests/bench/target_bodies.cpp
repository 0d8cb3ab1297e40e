#include "tests/bench/target_bodies.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/vdb/test_surfaces.h"
#include "vdb/shapes.h"

namespace lamina::targets {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRound = 0.1,
                 kCore = 0.4;  // round cube: fillet radius, half edge of the cube it is swept over
constexpr int kFilletCells = 12, kFlatCells = 11;
const Vec3 kAxes(0.5, 0.35, 0.25);  // of the ellipsoid

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

void finish(Surface& s) {
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"wall"};
}

// Frame of the zero set of f from its gradient and Hessian.
Truth from_hessian(const Vec3& g, const Mat3& H) {
  Truth t;
  t.N = g.normalized();
  const Mat3 p = Mat3::Identity() - t.N * t.N.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(p * H * p / g.norm());
  // The normal's eigenvalue is zero; drop the eigenvector along it.
  int normal = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(solver.eigenvectors().col(i).dot(t.N)) >
        std::abs(solver.eigenvectors().col(normal).dot(t.N)))
      normal = i;
  const int a = normal == 0 ? 1 : 0, b = normal == 2 ? 1 : 2;
  const bool first = std::abs(solver.eigenvalues()[a]) >= std::abs(solver.eigenvalues()[b]);
  t.k1 = solver.eigenvalues()[first ? a : b];
  t.k2 = solver.eigenvalues()[first ? b : a];
  t.T1 = solver.eigenvectors().col(first ? a : b);
  return t;
}

Truth ellipsoid_truth(const Vec3& q) {
  const Eigen::Array3d a2 = kAxes.array().square();
  double t = 0.0;  // closest point a_i^2 q_i / (a_i^2 + t)
  for (int step = 0; step < 20; ++step) {
    const Eigen::Array3d w = kAxes.array() * q.array() / (a2 + t);
    const double f = w.square().sum() - 1.0, df = -2.0 * (w.square() / (a2 + t)).sum();
    t -= f / df;
  }
  const Vec3 p = (a2 * q.array() / (a2 + t)).matrix();
  const Vec3 inverse = (1.0 / a2).matrix();
  return from_hessian(2.0 * p.cwiseProduct(inverse), 2.0 * Mat3(inverse.asDiagonal()));
}

// Half thickness of the NACA 0012 of make_shape and its derivatives by s = sqrt(x), x = s^2.
struct Profile {
  double x, z, dx, dz, ddx, ddz;
};
Profile naca_profile(double s) {
  constexpr double c[5] = {0.298222773, -0.127125232, -0.357907906, 0.291984971, -0.105174606};
  constexpr int power[5] = {1, 2, 4, 6, 8};
  Profile p{s * s, 0.0, 2.0 * s, 0.0, 2.0, 0.0};
  for (int i = 0; i < 5; ++i) {
    const int n = power[i];
    p.z += 0.594689181 * c[i] * std::pow(s, n);
    p.dz += 0.594689181 * c[i] * n * std::pow(s, n - 1);
    if (n > 1) p.ddz += 0.594689181 * c[i] * n * (n - 1) * std::pow(s, n - 2);
  }
  return p;
}

std::optional<Truth> naca_truth(const Vec3& q, const Vec3& facet_normal) {
  if (std::abs(facet_normal[1]) > 0.9 || q[0] > 0.999) return {};  // tips; the sharp trailing edge
  const double x = q[0], z = std::abs(q[2]);
  double best = 0.0, least = 1e300;
  for (int i = 0; i <= 2000; ++i) {
    const double s = i / 2000.0;
    const Profile p = naca_profile(s);
    const double d = std::hypot(p.x - x, p.z - z);
    if (d < least) least = d, best = s;
  }
  for (int step = 0; step < 20; ++step) {
    const Profile p = naca_profile(best);
    const double g = (p.x - x) * p.dx + (p.z - z) * p.dz;
    const double h = p.dx * p.dx + p.dz * p.dz + (p.x - x) * p.ddx + (p.z - z) * p.ddz;
    best = std::clamp(best - g / h, 0.0, 1.0);
  }
  const Profile p = naca_profile(best);
  const double side = q[2] < 0.0 ? -1.0 : 1.0, speed = std::hypot(p.dx, p.dz);
  Truth t;
  t.N = Vec3(-p.dz, 0.0, side * p.dx) / speed;
  t.T1 = Vec3(p.dx, 0.0, side * p.dz) / speed;
  t.k1 = -(p.dx * p.ddz - p.dz * p.ddx) / (speed * speed * speed);
  return t;
}

std::optional<Truth> round_cube_truth(const Vec3& q) {
  const Vec3 core = q.cwiseMin(kCore).cwiseMax(-kCore), out = q - core;
  Truth t;
  t.N = out.normalized();
  int bent = 0, along = 0;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(q[i]) > kCore)
      ++bent;
    else
      along = i;
  }
  if (bent < 2) return {};
  t.k1 = 1.0 / kRound;
  t.k2 = bent == 3 ? t.k1 : 0.0;
  if (bent == 2) t.T1 = t.N.cross(Vec3::Unit(along));
  return t;
}

// Unit normals and core points meet at the seams with equal bits: tangents there are exactly 1.
Surface round_cube() {
  std::vector<std::array<double, 2>> line;  // core coordinate and tangent along one axis of a face
  for (int i = 0; i <= kFilletCells; ++i)
    line.push_back({-kCore, i == 0              ? -1.0
                            : i == kFilletCells ? 0.0
                                                : -std::tan(0.25 * kPi * (1.0 - i / double(kFilletCells)))});
  for (int i = 1; i < kFlatCells; ++i) line.push_back({-kCore + 2.0 * kCore * i / kFlatCells, 0.0});
  for (int i = kFilletCells; i >= 0; --i) {
    const auto& mirror = line[static_cast<std::size_t>(i)];
    line.push_back({kCore, mirror[1] == 0.0 ? 0.0 : -mirror[1]});
  }
  Surface s;
  const int n = static_cast<int>(line.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Index first = static_cast<Index>(s.points.size());
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          Vec3 d, c;
          d[axis] = side;
          c[axis] = side * kCore;
          d[(axis + 1) % 3] = line[static_cast<std::size_t>(i)][1];
          c[(axis + 1) % 3] = line[static_cast<std::size_t>(i)][0];
          d[(axis + 2) % 3] = line[static_cast<std::size_t>(j)][1];
          c[(axis + 2) % 3] = line[static_cast<std::size_t>(j)][0];
          // Summed in the order of size, so that the faces that share the point get equal bits.
          std::array<double, 3> squares{d[0] * d[0], d[1] * d[1], d[2] * d[2]};
          std::sort(squares.begin(), squares.end());
          s.points.push_back(c + d * (kRound / std::sqrt(squares[0] + squares[1] + squares[2])));
        }
      const auto node = [&](int i, int j) { return first + i * n + j; };
      for (int i = 0; i + 1 < n; ++i)
        for (int j = 0; j + 1 < n; ++j) {
          const std::array<Index, 4> c{node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)};
          if (side > 0.0) {
            s.triangles.push_back({c[0], c[1], c[2]});
            s.triangles.push_back({c[0], c[2], c[3]});
          } else {
            s.triangles.push_back({c[0], c[2], c[1]});
            s.triangles.push_back({c[0], c[3], c[2]});
          }
        }
    }
  finish(s);
  return cleaned(std::move(s));
}

}  // namespace

double Dice::gauss() {
  const double a = uniform(0.0, 1.0), b = uniform(0.0, 1.0);
  return std::sqrt(-2.0 * std::log(1.0 - a)) * std::cos(2.0 * kPi * b);
}

WallSampler::WallSampler(const Surface& surface, std::uint64_t seed) : surface_(surface), dice_(seed) {
  double sum = 0.0;
  for (const auto& t : surface.triangles) {
    const Vec3 a = surface.points[at(t[0])];
    sum += (surface.points[at(t[1])] - a).cross(surface.points[at(t[2])] - a).norm();
    cumulative_.push_back(sum);
  }
}

WallSampler::Sample WallSampler::next() {
  const double pick = dice_.uniform(0.0, cumulative_.back());
  const std::size_t f =
      std::min(cumulative_.size() - 1,
               static_cast<std::size_t>(std::upper_bound(cumulative_.begin(), cumulative_.end(), pick) -
                                        cumulative_.begin()));
  const auto& t = surface_.triangles[f];
  const Vec3 a = surface_.points[at(t[0])], ab = surface_.points[at(t[1])] - a,
             ac = surface_.points[at(t[2])] - a;
  double u = dice_.uniform(0.0, 1.0), v = dice_.uniform(0.0, 1.0);
  if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
  return {a + u * ab + v * ac, ab.cross(ac).normalized(), f};
}

Surface cleaned(Surface s) {
  clean(s, "target body");
  return s;
}

Surface shape(const std::string& name, double facet) {
  ShapeOptions options;
  options.facet = facet;
  return cleaned(make_shape(name, options));
}

Surface icosphere(int n) { return shape("sphere", 1.3231 * 0.5 / n * (1.0 + 1e-9)); }

Surface lumpy(int n) {
  Surface s = icosphere(n);
  for (Vec3& p : s.points)
    p *= 1.0 + 0.08 * std::sin(18.0 * p[0]) * std::sin(22.0 * p[1]) * std::sin(26.0 * p[2]);
  return s;
}

Surface strip_cylinder(int n) { return cleaned(testing_surfaces::cylinder(0.3, -0.5, 0.5, n)); }

Surface box(const Vec3& lo, const Vec3& hi) {
  Surface s = shape("cube");
  for (Vec3& p : s.points)
    for (int i = 0; i < 3; ++i) p[i] = p[i] < 0.0 ? lo[i] : hi[i];
  return s;
}

Surface joined(const Surface& a, const Surface& b) {
  Surface s = a;
  const Index shift = static_cast<Index>(a.points.size());
  s.points.insert(s.points.end(), b.points.begin(), b.points.end());
  for (const auto& t : b.triangles) s.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  finish(s);
  return s;
}

Surface turned(Surface s) {
  for (auto& t : s.triangles) std::swap(t[1], t[2]);
  return s;
}

Surface scaled(Surface s, double factor) {
  for (Vec3& p : s.points) p *= factor;
  return s;
}

double torus_distance(const Vec3& x) { return std::hypot(std::hypot(x[0], x[1]) - kMajor, x[2]) - kMinor; }

Truth torus_truth(const Vec3& q) {
  const double rho = std::hypot(q[0], q[1]);
  const Vec3 out(q[0] / rho, q[1] / rho, 0.0);
  const double c = rho - kMajor, length = std::hypot(c, q[2]), cosine = c / length, sine = q[2] / length;
  Truth t;
  t.N = cosine * out + sine * Vec3::UnitZ();
  t.T1 = -sine * out + cosine * Vec3::UnitZ();
  t.k1 = 1.0 / kMinor;
  t.k2 = cosine / (kMajor + kMinor * cosine);
  return t;
}

Body sphere_body(int n) {
  Surface s = icosphere(n);
  const std::string name = "sphere " + std::to_string(s.triangles.size());
  return {name, std::move(s), [](const Vec3& q, const Vec3&) -> std::optional<Truth> {
            return Truth{q.normalized(), 2.0, 2.0, Vec3::Zero()};
          }};
}

Body cylinder_body(int n) {
  return {"cylinder " + std::to_string(n) + " strips", strip_cylinder(n),
          [](const Vec3& q, const Vec3& facet_normal) -> std::optional<Truth> {
            if (std::abs(facet_normal[2]) > 0.5) return {};
            const Vec3 out = Vec3(q[0], q[1], 0.0).normalized();
            return Truth{out, 1.0 / 0.3, 0.0, Vec3::UnitZ().cross(out)};
          }};
}

Body torus_body() {
  Surface s = shape("torus", 0.0275);
  const std::string name = "torus " + std::to_string(s.triangles.size());
  return {name, std::move(s),
          [](const Vec3& q, const Vec3&) -> std::optional<Truth> { return torus_truth(q); }};
}

Body noisy_torus_body() {
  Body body = torus_body();
  double length = 0.0;
  for (const auto& t : body.surface.triangles)
    for (int k = 0; k < 3; ++k)
      length += (body.surface.points[at(t[static_cast<std::size_t>(k)])] -
                 body.surface.points[at(t[static_cast<std::size_t>((k + 1) % 3)])])
                    .norm();
  length /= 3.0 * static_cast<double>(body.surface.triangles.size());
  Dice dice(3);
  for (Vec3& p : body.surface.points) p += 0.02 * length * dice.gauss() * torus_truth(p).N;
  body.name += ", noise 2 % of the mean edge";
  return body;
}

Body ellipsoid_body() {
  Surface s = icosphere(22);
  for (Vec3& p : s.points) p = 2.0 * p.cwiseProduct(kAxes);
  const std::string name = "ellipsoid " + std::to_string(s.triangles.size());
  return {name, std::move(s),
          [](const Vec3& q, const Vec3&) -> std::optional<Truth> { return ellipsoid_truth(q); }};
}

Body round_cube_body() {
  Surface s = round_cube();
  const std::string name = "round cube " + std::to_string(s.triangles.size());
  return {name, std::move(s), [](const Vec3& q, const Vec3&) { return round_cube_truth(q); }};
}

Body naca_body() {
  Surface s = shape("naca0012", 0.026);
  const std::string name = "naca " + std::to_string(s.triangles.size());
  return {name, std::move(s), naca_truth};
}

double ahmed_margin(const Vec3& q, const Vec3& facet_normal) {
  constexpr double kSlant = 25.0 * kPi / 180.0, kTiny = 1e-9;
  const Vec3 slant(std::sin(kSlant), 0.0, std::cos(kSlant));
  const Vec3 ridge(1.044 - 0.222 * std::cos(kSlant), 0.0, 0.338);
  if (std::abs(q[0]) < kTiny)  // the front, inside its roundings
    return std::min({0.0945 - std::abs(q[1]), q[2] - 0.15, 0.238 - q[2]});
  const std::pair<Vec3, double> planes[] = {
      {{1, 0, 0}, 1.044},  {{0, 1, 0}, 0.1945},       {{0, -1, 0}, 0.1945}, {{0, 0, 1}, 0.338},
      {{0, 0, -1}, -0.05}, {slant, slant.dot(ridge)}, {{-1, 0, 0}, -0.1}};
  bool on = false;
  double margin = 1e300;
  for (const auto& [n, offset] : planes) {
    const double depth = offset - n.dot(q);
    if (std::abs(depth) < kTiny && n.dot(facet_normal) > 1.0 - 1e-9 && n[0] >= 0.0)
      on = true;
    else
      margin = std::min(margin, depth);
  }
  return on ? margin : -1.0;
}

double round_cube_margin(const Vec3& q) {
  int out = 0;
  double margin = 1e300;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(q[i]) > kCore + 0.999 * kRound)
      ++out;
    else
      margin = std::min(margin, kCore - std::abs(q[i]));
  }
  return out == 1 ? margin : -1.0;
}

double cube_margin(const Vec3& q) {
  std::array<double, 3> room{};
  for (std::size_t i = 0; i < 3; ++i) room[i] = 0.25 - std::abs(q[static_cast<Index>(i)]);
  std::sort(room.begin(), room.end());
  return room[1];
}

}  // namespace lamina::targets
