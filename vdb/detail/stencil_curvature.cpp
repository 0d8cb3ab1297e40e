// A grid finer than the facets sees the facets: its second derivatives are zero on them and huge at their
// edges. So the level of a pyramid (voxel dx, 2 dx, 4 dx, 8 dx) is picked by the width of the facets around a
// vertex, one Gaussian pass blurs the rest, and the stencil is the Hessian of the cubic B-spline through the
// blurred values, evaluated at the vertex. It is asked for where the tensor of the triangles scatters from
// vertex to vertex - noisy scans, fillets of few facets - since on clean triangulations that tensor is the
// sharper of the two; and it is taken when its kernel sees neither a sharp edge nor another side of the body,
// the blur is narrow against the radius of curvature, and the field under it is that of a distance. Next to
// flat faces the triangles keep the word: no scan has any, and the blur would carry a fillet's curvature into
// them.
#include "vdb/detail/stencil_curvature.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr int kLevels = 4;
constexpr double kFinest = 1.2;    // facet widths per voxel of the level that is tried first
constexpr double kCoarsest = 3.2;  // facet widths per voxel beyond which the facets show through
constexpr double kReach = 3.0 * kGaussianSigma + 1.5;  // voxels the kernel sees
constexpr double kBias = 0.04;                         // largest square of sigma times curvature
constexpr double kGradient = 0.06;                     // deviation of |grad| from 1
constexpr double kSkew = 0.12;                         // |H n| in voxels
constexpr double kAlign = 0.94;                        // cosine to the normal of the triangles
constexpr double kScatter =
    0.05;  // relative scatter of the triangles' curvature above which the grids are asked
// Relative difference of levels that asks for the coarser one, whose bias, sigma times curvature squared,
// must not be more than that.
constexpr double kNoisy = 0.06;

struct Estimate {
  Vec3 normal = Vec3::Zero();
  Mat3 shape = Mat3::Zero();
  bool valid = false;
};

struct Vertex {
  Index group;
  int first = 0;          ///< coarsest level to accept
  double room = 0.0;      ///< free distance around, world units
  Estimate above, taken;  ///< of level first + 1, and of the first level accepted
};

double size_of(const Mat3& shape) { return shape.norm(); }

bool room_for(const FacetWall& wall, const CornerGroup& g, const Vec3& n, double radius) {
  const Vec3& q = wall.surface().points[static_cast<std::size_t>(g.vertex)];
  if (wall.features().sharp_distance(q, radius) < radius) return false;
  for (const double side : {1.0, -1.0})
    if (wall.distance(q + side * radius * n, 0.02) < 0.85 * radius) return false;
  return true;
}

// Calls visit(facet, shape of the next corner) for the facets around the vertex of a group.
template <class Visit>
void visit_facets(const FacetWall& wall, const CornerGroup& g, Visit&& visit) {
  for (const Index corner : wall.topology().star_of(g.vertex)) {
    const std::array<Index, 3>& ids = wall.curvature().corner_shapes[static_cast<std::size_t>(corner / 4)];
    if (ids[static_cast<std::size_t>(corner % 4)] == g.shape)
      visit(static_cast<std::size_t>(corner / 4),
            static_cast<std::size_t>(ids[static_cast<std::size_t>((corner % 4 + 1) % 3)]));
  }
}

template <class Visit>
void visit_ring(const FacetWall& wall, const CornerGroup& g, Visit&& visit) {
  visit_facets(wall, g, [&](std::size_t, std::size_t shape) { visit(shape); });
}

// Which shapes lie within two rings of a vertex all facets of which lie in one plane.
std::vector<std::uint8_t> near_flat(const FacetWall& wall) {
  const Curvature& c = wall.curvature();
  constexpr double kOnePlane = 1e-6;  // radians
  std::vector<std::uint8_t> near(c.shapes.size(), 0);
  for_each_index(c.groups.size(), [&](std::size_t i) {
    const Vec3* first = nullptr;
    bool flat = true;
    visit_facets(wall, c.groups[i], [&](std::size_t facet, std::size_t) {
      const Vec3& n = wall.topology().normals[facet];
      if (first == nullptr) first = &n;
      flat = flat && (n - *first).norm() < kOnePlane;
    });
    near[static_cast<std::size_t>(c.groups[i].shape)] = flat;
  });
  for (int ring = 0; ring < 2; ++ring) {
    const std::vector<std::uint8_t> before = near;
    for_each_index(c.groups.size(), [&](std::size_t i) {
      const std::size_t self = static_cast<std::size_t>(c.groups[i].shape);
      visit_ring(wall, c.groups[i], [&](std::size_t j) { near[self] = near[self] | before[j]; });
    });
  }
  return near;
}

// How far the curvature of each shape is off the mean of its neighbours', relative, averaged over the
// neighbours.
std::vector<double> scatter(const FacetWall& wall) {
  const Curvature& c = wall.curvature();
  struct Invariants {
    double trace, size;
  };
  std::vector<Invariants> own(c.shapes.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Mat3 m = to_matrix<3>(c.shapes[i].shape);
    own[i] = {m.trace(), size_of(m)};
  }
  const auto over_ring = [&](const CornerGroup& g, auto&& visit) { visit_ring(wall, g, visit); };
  std::vector<double> first(c.shapes.size(), 0.0), second(c.shapes.size(), 0.0);
  for_each_index(c.groups.size(), [&](std::size_t i) {
    const std::size_t self = static_cast<std::size_t>(c.groups[i].shape);
    double trace = 0.0, size = 0.0, largest = own[self].size;
    int n = 0;
    over_ring(c.groups[i], [&](std::size_t j) {
      trace += own[j].trace;
      size += own[j].size;
      largest = std::max(largest, own[j].size);
      ++n;
    });
    if (n > 0 && largest > 0.0)
      first[self] =
          0.5 * (std::abs(own[self].trace - trace / n) + std::abs(own[self].size - size / n)) / largest;
  });
  for_each_index(c.groups.size(), [&](std::size_t i) {
    const std::size_t self = static_cast<std::size_t>(c.groups[i].shape);
    double sum = first[self];
    int n = 1;
    over_ring(c.groups[i], [&](std::size_t j) {
      sum += first[j];
      ++n;
    });
    second[self] = sum / n;
  });
  return second;
}

std::vector<Vertex> candidates(const FacetWall& wall, double voxel) {
  const Curvature& c = wall.curvature();
  const std::vector<double> rough = scatter(wall);
  const std::vector<std::uint8_t> flat = near_flat(wall);
  std::vector<Vertex> all(c.groups.size());
  for_each_index(
      all.size(),
      [&](std::size_t i) {
        const CornerGroup& g = c.groups[i];
        all[i].group = kNone;
        if (rough[static_cast<std::size_t>(g.shape)] < kScatter || flat[static_cast<std::size_t>(g.shape)])
          return;
        if (!(g.facet_width > 0.0) || g.parts > 1 || g.facet_width > kCoarsest * voxel * 8.0) return;
        for (const Index corner : wall.topology().star_of(g.vertex))
          for (const Index e : wall.topology().facet_edges[static_cast<std::size_t>(corner / 4)])
            if (wall.topology().edges[static_cast<std::size_t>(e)].kind != EdgeKind::kSmooth) return;
        const Vec3& n = c.shapes[static_cast<std::size_t>(g.shape)].normal;
        for (int l = 0; l < kLevels; ++l) {
          const double dx = voxel * (1 << l);
          if (!room_for(wall, g, n, kReach * dx)) break;
          all[i].room = kReach * dx;
          if (l > 0 && g.facet_width >= kFinest * dx) all[i].first = l;
        }
        if (all[i].room > 0.0) all[i].group = static_cast<Index>(i);
      },
      64);
  std::erase_if(all, [](const Vertex& v) { return v.group == kNone; });
  return all;
}

// `bias`: the largest relative one to accept.
Estimate estimate(const SparseGrid& grid, const Lattice& lattice, const Vec3& q, const VertexShape& of_facets,
                  double bias) {
  Estimate e;
  const double dx = lattice.A(0, 0);
  const SplineSample s = grid.spline((q - lattice.origin) / dx);
  const double g = s.g.norm();
  if (!s.active || !(std::abs(g - 1.0) < kGradient)) return e;
  e.normal = s.g / g;
  if (e.normal.dot(of_facets.normal) < kAlign || (s.H * e.normal).norm() > kSkew) return e;
  const Mat3 p = Mat3::Identity() - e.normal * e.normal.transpose();
  e.shape = p * s.H * p / (g * dx);
  const Frame f = principal_frame(e.normal, to_sym<3>(e.shape));
  const double turn = kGaussianSigma * dx * f.k1;
  e.valid = turn * turn < bias;
  return e;
}

double difference(const Mat3& a, const Mat3& b) {
  const double scale = std::max(size_of(a), size_of(b));
  return scale > 0.0 ? size_of(a - b) / scale : 0.0;
}

// Returns true when the vertex takes the estimate of the grids. In the normal the noise of the finer level is
// about the bias of the coarser one: their mean has less of both.
bool settle(const Vertex& v, VertexShape& shape) {
  if (!v.taken.valid) return false;
  const Mat3 facets = to_matrix<3>(shape.shape);
  const bool noisy = v.above.valid && difference(v.taken.shape, v.above.shape) > kNoisy &&
                     difference(v.taken.shape, facets) > kNoisy && difference(v.above.shape, facets) > kNoisy;
  shape.normal = noisy ? Vec3((v.taken.normal + v.above.normal).normalized()) : v.taken.normal;
  const Mat3 p = Mat3::Identity() - shape.normal * shape.normal.transpose();
  shape.shape = to_sym<3>(noisy ? Mat3(p * v.above.shape * p) : v.taken.shape);
  return true;
}

BandGrid make_level(const FacetWall& wall, const BandGrid& base, int level, double half_width_vox) {
  if (level == 0) return base.copy();
  BandGrid grid = BandGrid::from_surface(wall.surface(), base.voxel() * (1 << level), half_width_vox,
                                         base.lattice().origin);
  grid.polish([&](const Vec3& x, double bound) { return wall.phi_within(x, bound); });
  return grid;
}

void rate_shapes(FacetWall& wall) {
  const std::vector<double> rough = scatter(wall);
  Curvature& c = wall.curvature();
  for (const CornerGroup& g : c.groups) {
    VertexShape& v = c.shapes[static_cast<std::size_t>(g.shape)];
    const double bend = principal_frame(v.normal, v.shape).k1;
    v.reliability = reliability(g.facet_width * bend, rough[static_cast<std::size_t>(g.shape)]);
  }
}

}  // namespace

std::int64_t refine_by_stencils(FacetWall& wall, const BandGrid& base, double half_width_vox,
                                Progress* progress) {
  std::vector<Vertex> vertices = candidates(wall, base.voxel());
  Curvature& curvature = wall.curvature();
  const auto width_of = [&](const Vertex& v) {
    return curvature.groups[static_cast<std::size_t>(v.group)].facet_width;
  };
  for (int level = kLevels - 1; level >= 0; --level) {
    const double dx = base.voxel() * (1 << level);
    const auto wants = [&](const Vertex& v) {
      return level <= v.first + 1 && v.room >= 0.999 * kReach * dx && width_of(v) <= kCoarsest * dx &&
             !v.taken.valid;
    };
    if (progress != nullptr) progress->check_cancelled();
    if (!std::any_of(vertices.begin(), vertices.end(), wants)) continue;
    BandGrid grid = make_level(wall, base, level, std::max(half_width_vox, 6.0));
    grid.smooth();
    const SparseGrid values = grid.extract();
    for_each_index(
        vertices.size(),
        [&](std::size_t i) {
          Vertex& v = vertices[i];
          if (!wants(v)) return;
          const CornerGroup& g = curvature.groups[static_cast<std::size_t>(v.group)];
          const bool above = level == v.first + 1;
          (above ? v.above : v.taken) =
              estimate(values, grid.lattice(), wall.surface().points[static_cast<std::size_t>(g.vertex)],
                       curvature.shapes[static_cast<std::size_t>(g.shape)], above ? kNoisy : kBias);
        },
        256);
  }
  std::int64_t replaced = 0;
  for (const Vertex& v : vertices)
    replaced += settle(
        v, curvature
               .shapes[static_cast<std::size_t>(curvature.groups[static_cast<std::size_t>(v.group)].shape)]);
  rate_shapes(wall);
  return replaced;
}

}  // namespace lamina::detail
