// Reference bodies. Each builder shares its points by construction (or makes the bits of shared points equal
// and lets weld() join them), so that the surface is watertight without tolerance, and orders corners
// counter-clockwise seen from outside. Curved parts are cut so that no facet edge exceeds `facet`; a
// quadrilateral cell of a curved part therefore has sides of at most facet / sqrt 2.
#include "vdb/shapes.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "vdb/detail/surface_topology.h"

namespace lamina {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Number of pieces of length <= `step` that make `length`, at least `least`.
int pieces(double length, double step, int least = 1) {
  return std::max(least, static_cast<int>(std::ceil(length / step * (1.0 - 1e-12))));
}

/// Collects points and triangles.
class Builder {
 public:
  Index point(const Vec3& p) {
    surface_.points.push_back(p);
    return static_cast<Index>(surface_.points.size() - 1);
  }
  /// Corners counter-clockwise from outside.
  void triangle(Index a, Index b, Index c) {
    surface_.triangles.push_back({a, b, c});
    surface_.tags.push_back(static_cast<Index>(surface_.tag_names.size() - 1));
  }
  void quad(Index a, Index b, Index c, Index d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }
  void tag(const std::string& name) { surface_.tag_names.push_back(name); }
  [[nodiscard]] const Vec3& operator[](Index i) const { return surface_.points[at(i)]; }
  Surface take() { return std::move(surface_); }

 private:
  Surface surface_;
};

/// Boundary of the cells of a rectilinear grid that `filled` names. REQUIRES no two filled cells to touch
/// along an edge or corner alone.
template <class Filled>
void add_blocks(Builder& builder, const std::array<std::vector<double>, 3>& grid, Filled&& filled) {
  using Cell = std::array<int, 3>;
  std::map<Cell, Index> known;
  const auto point = [&](const Cell& c) {
    const auto [entry, is_new] = known.emplace(c, kNone);
    if (is_new) entry->second = builder.point({grid[0][at(c[0])], grid[1][at(c[1])], grid[2][at(c[2])]});
    return entry->second;
  };
  const auto count = [&](std::size_t axis) { return static_cast<int>(grid[axis].size()) - 1; };
  const auto is_filled = [&](const Cell& c) {
    for (std::size_t i = 0; i < 3; ++i)
      if (c[i] < 0 || c[i] >= count(i)) return false;
    return filled(c[0], c[1], c[2]);
  };
  for (int z = 0; z < count(2); ++z)
    for (int y = 0; y < count(1); ++y)
      for (int x = 0; x < count(0); ++x) {
        const Cell cell{x, y, z};
        if (!is_filled(cell)) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (const int side : {0, 1}) {
            Cell neighbour = cell;
            neighbour[axis] += side == 1 ? 1 : -1;
            if (is_filled(neighbour)) continue;
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::array<Index, 4> q{};
            for (int k = 0; k < 4; ++k) {
              Cell c = cell;
              c[axis] += side;
              c[u] += k == 1 || k == 2 ? 1 : 0;
              c[v] += k >= 2 ? 1 : 0;
              q[static_cast<std::size_t>(k)] = point(c);
            }
            if (side == 1)
              builder.quad(q[0], q[1], q[2], q[3]);
            else
              builder.quad(q[0], q[3], q[2], q[1]);
          }
      }
}

/// The i-th of n + 1 evenly spaced values; lo and hi themselves at the ends.
double between(double lo, double hi, int i, int n) { return i == n ? hi : lo + (hi - lo) * i / n; }

std::vector<double> even(double lo, double hi, int n) {
  std::vector<double> values;
  for (int i = 0; i <= n; ++i) values.push_back(between(lo, hi, i, n));
  return values;
}

/// A disc bounded by `rim`, whose points run counter-clockwise about `axis` through the centre; its number of
/// points is m 2^k with m < 12. Rings of half as many points each keep the triangles near equilateral towards
/// the centre.
void add_disc(Builder& builder, std::vector<Index> rim, const Vec3& centre, bool reverse) {
  const auto face = [&](Index a, Index b, Index c) {
    reverse ? builder.triangle(a, c, b) : builder.triangle(a, b, c);
  };
  while (rim.size() >= 12) {
    const std::size_t n = rim.size();
    const double scale = 1.0 - 2.0 * std::sin(M_PI / static_cast<double>(n));  // one chord further in
    std::vector<Index> inner;
    for (std::size_t i = 0; i < n; i += 2)
      inner.push_back(builder.point(centre + scale * (builder[rim[i]] - centre)));
    for (std::size_t i = 0; i < n / 2; ++i) {
      const Index a = rim[2 * i], b = rim[2 * i + 1], c = rim[(2 * i + 2) % n];
      const Index p = inner[i], q = inner[(i + 1) % (n / 2)];
      face(a, b, p);
      face(b, q, p);
      face(b, c, q);
    }
    rim = std::move(inner);
  }
  const Index middle = builder.point(centre);
  for (std::size_t i = 0; i < rim.size(); ++i) face(rim[i], rim[(i + 1) % rim.size()], middle);
}

/// Points around a circle for a given chord: at least `least`, and m 2^k with 6 <= m < 12 for add_disc.
int circle_points(double radius, double chord, int least) {
  int n = pieces(2.0 * M_PI * radius, chord, least), factor = 1;
  while ((n + factor - 1) / factor >= 12) factor *= 2;
  return (n + factor - 1) / factor * factor;
}

/// Closed cylinder from `base` along the unit vector `axis`; `u`, `axis` x `u` span its discs.
struct CylinderSpec {
  Vec3 base, axis, u;
  double radius, length, facet;
  int least;
};
void add_cylinder(Builder& builder, const CylinderSpec& spec) {
  const double step = spec.facet / std::sqrt(2.0);
  const int n = circle_points(spec.radius, step, spec.least);
  const int rows = pieces(spec.length, 2.0 * M_PI * spec.radius / n);
  const Vec3 v = spec.axis.cross(spec.u);
  std::vector<std::vector<Index>> ring(static_cast<std::size_t>(rows) + 1);
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i < n; ++i) {
      const double angle = 2.0 * M_PI * i / n;
      ring[at(j)].push_back(builder.point(spec.base + spec.axis * (spec.length * j / rows) +
                                          spec.radius * (std::cos(angle) * spec.u + std::sin(angle) * v)));
    }
  for (std::size_t j = 0; j < at(rows); ++j)
    for (std::size_t i = 0; i < at(n); ++i) {
      const std::size_t k = (i + 1) % at(n);
      builder.quad(ring[j][i], ring[j][k], ring[j + 1][k], ring[j + 1][i]);
    }
  add_disc(builder, ring.front(), spec.base, true);
  add_disc(builder, ring.back(), spec.base + spec.length * spec.axis, false);
}

/// Diameter 0.6, span 0.2 along y, centred at the origin: the circle of [Billon2016, section 5.1] with a
/// span.
void build_cylinder(Builder& builder, double facet) {
  add_cylinder(builder, {{0.0, -0.1, 0.0}, Vec3::UnitY(), Vec3::UnitZ(), 0.3, 0.2, facet, 16});
}

/// Radius 0.5 at the origin: an icosahedron whose faces are cut into f^2 triangles and pushed onto the
/// sphere.
void build_sphere(Builder& builder, double facet) {
  constexpr double kRadius = 0.5;
  // The longest edge lies at the middle of a face: 1.3231 R / f.
  const int f = pieces(1.3231 * kRadius, facet);
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  const std::array<Vec3, 12> corner{Vec3{-1, g, 0}, Vec3{1, g, 0}, Vec3{-1, -g, 0}, Vec3{1, -g, 0},
                                    Vec3{0, -1, g}, Vec3{0, 1, g}, Vec3{0, -1, -g}, Vec3{0, 1, -g},
                                    Vec3{g, 0, -1}, Vec3{g, 0, 1}, Vec3{-g, 0, -1}, Vec3{-g, 0, 1}};
  constexpr std::array<std::array<int, 3>, 20> kFaces{
      {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (const auto& face : kFaces) {
    // The weights are summed in the order of the corner numbers, so that both faces of an edge get equal
    // bits.
    const auto point = [&](int i, int j) {
      std::array<std::pair<int, int>, 3> term{{{face[0], f - i - j}, {face[1], i}, {face[2], j}}};
      std::sort(term.begin(), term.end());
      Vec3 p = Vec3::Zero();
      for (const auto& [c, weight] : term) p += weight * corner[at(c)];
      return builder.point(kRadius * p.normalized());
    };
    for (int i = 0; i < f; ++i)
      for (int j = 0; i + j < f; ++j) {
        builder.triangle(point(i, j), point(i + 1, j), point(i, j + 1));
        if (i + j + 1 < f) builder.triangle(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
      }
  }
}

/// Major radius 0.35, minor radius 0.15, axis z, centred at the origin.
void build_torus(Builder& builder, double facet) {
  constexpr double kMajor = 0.35, kMinor = 0.15;
  const double step = facet / std::sqrt(2.0);
  // Multiples of four: the extents are met.
  const int nu = 4 * pieces(0.5 * M_PI * (kMajor + kMinor), step, 2);
  const int nv = 4 * pieces(0.5 * M_PI * kMinor, step, 2);
  std::vector<Index> id;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const double u = 2.0 * M_PI * i / nu, v = 2.0 * M_PI * j / nv;
      const double r = kMajor + kMinor * std::cos(v);
      id.push_back(builder.point({r * std::cos(u), r * std::sin(u), kMinor * std::sin(v)}));
    }
  const auto node = [&](int i, int j) { return id[at((i % nu) * nv + j % nv)]; };
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) builder.quad(node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
}

/// Edge 0.5, centred at the origin.
void build_cube(Builder& builder) {
  const std::vector<double> axis = even(-0.25, 0.25, 1);
  add_blocks(builder, {axis, axis, axis}, [](int, int, int) { return true; });
}

/// 1 x 0.2 x 0.01 with sharp edges: x from 0, centred in y and z.
void build_plate(Builder& builder) {
  add_blocks(builder, {even(0.0, 1.0, 20), even(-0.1, 0.1, 4), even(-0.005, 0.005, 1)},
             [](int, int, int) { return true; });
}

/// Backward-facing step, span 0.2: height 0.2 for x in [0, 0.5], 0.1 for x in [0.5, 1]; the foot of the step
/// is a concave edge. Floor at z = 0.
void build_step(Builder& builder) {
  add_blocks(builder, {even(0.0, 1.0, 20), even(-0.1, 0.1, 4), even(0.0, 0.2, 4)},
             [](int x, int, int z) { return x < 10 || z < 2; });
}

/// Half thickness of the NACA 0012 with sharp trailing edge as used by the NASA turbulence modelling resource
/// (the formula of the series, scaled so that it closes at chord 1).
double naca0012_half_thickness(double x) {
  return 0.594689181 * (0.298222773 * std::sqrt(x) - 0.127125232 * x - 0.357907906 * x * x +
                        0.291984971 * x * x * x - 0.105174606 * x * x * x * x);
}

/// Chord 1 along x, span 0.2 along y, thickness along z; flat tips. Stations crowd at both ends like cosines.
void build_naca0012(Builder& builder, double facet) {
  const double step = facet / std::sqrt(2.0);
  const int m = pieces(0.5 * M_PI, step, 16);  // the longest station interval is pi / (2 m)
  const int span = pieces(0.2, step, 4);
  // Stations 0..m run along the upper side from the leading to the trailing edge, m..2m back along the lower
  // one.
  const int n = 2 * m;
  std::vector<std::vector<Index>> ring(at(span) + 1);
  for (int j = 0; j <= span; ++j)
    for (int i = 0; i < n; ++i) {
      const int station = std::min(i, n - i);
      const double s = std::sin(0.5 * M_PI * station / m);
      const double x = station == m ? 1.0 : s * s;
      const double z = station == 0 || station == m ? 0.0 : naca0012_half_thickness(x);
      ring[at(j)].push_back(builder.point({x, between(-0.1, 0.1, j, span), i <= m ? z : -z}));
    }
  for (std::size_t j = 0; j < at(span); ++j)
    for (std::size_t i = 0; i < at(n); ++i) {
      const std::size_t k = (i + 1) % at(n);
      builder.quad(ring[j][i], ring[j][k], ring[j + 1][k], ring[j + 1][i]);
    }
  const auto cap = [&](const std::vector<Index>& tip, bool reverse) {
    const auto face = [&](Index a, Index b, Index c) {
      reverse ? builder.triangle(a, c, b) : builder.triangle(a, b, c);
    };
    for (int i = 0; i < m; ++i) {
      const Index up = tip[at(i)], up_next = tip[at(i + 1)];
      const Index low = tip[at((n - i) % n)], low_next = tip[at(n - i - 1)];
      if (i > 0) face(low, low_next, up);
      if (i + 1 < m) face(up, low_next, up_next);
    }
  };
  cap(ring.front(), false);
  cap(ring.back(), true);
}

/// Ahmed body [Ahmed1984]: length 1.044, width 0.389, height 0.288, floor at z = 0.05, nose at x = 0; all
/// four edges of the front have radius 0.1 in plan and in elevation, so that every cross-section is a
/// rectangle and the roundings meet in mitred corners; slant 0.222 long along itself at the rear of the roof.
namespace ahmed {
constexpr double kLength = 1.044, kWidth = 0.389, kHeight = 0.288, kRadius = 0.1, kFloor = 0.05,
                 kSlant = 0.222;
constexpr double kStiltRadius = 0.015, kStiltY = 0.1635, kStiltIntoBody = 0.01;
constexpr std::array<double, 2> kStiltX{0.202, 0.672};

/// Cross-section at one x.
struct Section {
  double x, half_width, bottom, top;
};

std::vector<Section> sections(double step, double slant) {
  std::vector<Section> result;
  const double top = kFloor + kHeight;
  const int arcs = pieces(0.5 * M_PI * kRadius, step, 4);
  for (int i = 0; i <= arcs; ++i) {
    const double angle = 0.5 * M_PI * i / arcs;
    const double inset = i == arcs ? 0.0 : kRadius * (1.0 - std::sin(angle));
    const double x = i == arcs ? kRadius : kRadius * (1.0 - std::cos(angle));
    result.push_back({x, 0.5 * kWidth - inset, kFloor + inset, top - inset});
  }
  // Plane sides take cells up to three times as long as wide.
  const double break_x = kLength - kSlant * std::cos(slant);
  const auto run = [&](double from, double to, double z_from, double z_to) {
    const int n = pieces(to - from, 3.0 * step);
    for (int i = 1; i <= n; ++i)
      result.push_back({between(from, to, i, n), 0.5 * kWidth, kFloor, between(z_from, z_to, i, n)});
  };
  run(kRadius, break_x, top, top);
  run(break_x, kLength, top, top - kSlant * std::sin(slant));
  return result;
}

void build(Builder& builder, double facet, double slant, bool stilts) {
  const double step = facet / std::sqrt(2.0);
  const std::vector<Section> section = sections(step, slant);
  const int ny = pieces(kWidth, step, 4), nz = pieces(kHeight, step, 4), n = 2 * (ny + nz);
  const auto node = [&](const Section& s, int j, int k) {
    return Vec3{s.x, s.half_width * ((2.0 * j - ny) / ny), between(s.bottom, s.top, k, nz)};
  };
  // Around a section, counter-clockwise in the yz plane: floor, right, roof, left.
  const auto ring_place = [&](int i) -> std::pair<int, int> {
    if (i < ny) return {i, 0};
    if (i < ny + nz) return {ny, i - ny};
    if (i < 2 * ny + nz) return {2 * ny + nz - i, nz};
    return {0, n - i};
  };
  std::vector<std::vector<Index>> ring(section.size());
  for (std::size_t s = 0; s < section.size(); ++s)
    for (int i = 0; i < n; ++i) {
      const auto [j, k] = ring_place(i);
      ring[s].push_back(builder.point(node(section[s], j, k)));
    }
  for (std::size_t s = 0; s + 1 < ring.size(); ++s)
    for (std::size_t i = 0; i < at(n); ++i) {
      const std::size_t k = (i + 1) % at(n);
      builder.quad(ring[s][i], ring[s][k], ring[s + 1][k], ring[s + 1][i]);
    }
  for (const bool front : {true, false}) {
    const std::size_t s = front ? 0 : ring.size() - 1;
    std::vector<Index> id(at((ny + 1) * (nz + 1)), kNone);
    const auto place = [&](int j, int k) -> Index& { return id[at(k * (ny + 1) + j)]; };
    for (int i = 0; i < n; ++i) place(ring_place(i).first, ring_place(i).second) = ring[s][at(i)];
    for (int k = 1; k < nz; ++k)
      for (int j = 1; j < ny; ++j) place(j, k) = builder.point(node(section[s], j, k));
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        if (front)
          builder.quad(place(j, k), place(j, k + 1), place(j + 1, k + 1), place(j + 1, k));
        else
          builder.quad(place(j, k), place(j + 1, k), place(j + 1, k + 1), place(j, k + 1));
  }
  if (!stilts) return;
  builder.tag("stilts");
  for (const double x : kStiltX)
    for (const double y : {-kStiltY, kStiltY})
      add_cylinder(
          builder,
          {{x, y, 0.0}, Vec3::UnitZ(), Vec3::UnitX(), kStiltRadius, kFloor + kStiltIntoBody, facet, 32});
}
}  // namespace ahmed

struct ShapeEntry {
  const char* name;
  const char* text;
  double default_facet;  ///< 0: no curved part
  double extent;
  void (*build)(Builder&, double facet, const ShapeOptions&);
};

const std::vector<ShapeEntry>& entries() {
  static const std::vector<ShapeEntry> list{
      {"ahmed",
       "Ahmed body 1.044 x 0.389 x 0.288 m, floor at z = 0.05, slant 25 degrees (option), stilts (option)",
       0.01, 1.044,
       [](Builder& b, double facet, const ShapeOptions& o) {
         ahmed::build(b, facet, o.slant_degrees * M_PI / 180.0, o.stilts);
       }},
      {"naca0012", "NACA 0012, sharp trailing edge, chord 1 along x, span 0.2 along y, thickness along z",
       0.01, 1.0, [](Builder& b, double facet, const ShapeOptions&) { build_naca0012(b, facet); }},
      {"sphere", "sphere of radius 0.5 at the origin", 0.02, 1.0,
       [](Builder& b, double facet, const ShapeOptions&) { build_sphere(b, facet); }},
      {"cylinder", "cylinder of diameter 0.6, span 0.2 along y, at the origin", 0.01, 0.6,
       [](Builder& b, double facet, const ShapeOptions&) { build_cylinder(b, facet); }},
      {"torus", "torus of radii 0.35 and 0.15 about z, at the origin", 0.02, 1.0,
       [](Builder& b, double facet, const ShapeOptions&) { build_torus(b, facet); }},
      {"cube", "cube of edge 0.5 at the origin", 0.0, 0.5,
       [](Builder& b, double, const ShapeOptions&) { build_cube(b); }},
      {"plate", "sharp-edged plate 1 x 0.2 x 0.01, x from 0", 0.0, 1.0,
       [](Builder& b, double, const ShapeOptions&) { build_plate(b); }},
      {"step", "backward-facing step, 1 x 0.2 x 0.2 with a step of 0.1 down at x = 0.5", 0.0, 1.0,
       [](Builder& b, double, const ShapeOptions&) { build_step(b); }},
  };
  return list;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> shape_list() {
  std::vector<std::pair<std::string, std::string>> result;
  for (const ShapeEntry& entry : entries()) result.emplace_back(entry.name, entry.text);
  return result;
}

Surface make_shape(const std::string& name, const ShapeOptions& options) {
  const auto& list = entries();
  const auto entry =
      std::find_if(list.begin(), list.end(), [&](const ShapeEntry& e) { return name == e.name; });
  if (entry == list.end()) {
    std::string known;
    for (const ShapeEntry& e : list) known += (known.empty() ? "" : ", ") + std::string(e.name);
    throw Error(ErrorCode::kParameter, fmt::format("unknown shape '{}'; known are {}", name, known));
  }
  const double least = entry->extent / 1000.0, most = entry->extent / 4.0;
  if (options.facet != 0.0 && !(options.facet >= least && options.facet <= most))
    throw Error(ErrorCode::kParameter,
                fmt::format("facet = {} of shape {} is outside [{}, {}]; 0 takes the default", options.facet,
                            name, least, most));
  if (!(options.slant_degrees >= 0.0 && options.slant_degrees <= 40.0))
    throw Error(ErrorCode::kParameter,
                fmt::format("slant_degrees = {} is outside [0, 40]", options.slant_degrees));
  Builder builder;
  builder.tag(name);
  entry->build(builder, options.facet == 0.0 ? entry->default_facet : options.facet, options);
  Surface surface = builder.take();
  detail::weld(surface);
  return surface;
}

}  // namespace lamina
