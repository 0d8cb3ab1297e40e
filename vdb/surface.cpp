// clean() in order: weld, cut neighbours at slivers, drop degenerate and duplicate triangles, orient,
// measure, warn.
#include "vdb/surface.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "vdb/detail/surface_topology.h"

namespace lamina {
namespace {

using detail::EdgeTable;
using detail::triangle_of;

/// Edges with a larger dihedral angle are sharp by intent, not chords of a round wall.
constexpr double kSmoothAngle = 40.0 * M_PI / 180.0;

/// Half-edges are numbered 3 t + k.
constexpr std::int64_t kMostTriangles = std::numeric_limits<Index>::max() / 3;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::string text(const Vec3& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]); }

Vec3 area_vector(const Surface& surface, Index t) {
  const auto& v = surface.triangles[at(t)];
  const Vec3& a = surface.points[at(v[0])];
  return 0.5 * (surface.points[at(v[1])] - a).cross(surface.points[at(v[2])] - a);
}

/// What the edges of a surface show, with one place for each kind of flaw.
struct EdgeFindings {
  double open_length = 0.0;
  Vec3 open_at = Vec3::Zero();
  Vec3 nonmanifold_at = Vec3::Zero();
};

/// How far the chord over the edge h of facet width e misses a round wall: e theta / 8; 0 for sharp edges.
double sag(const Surface& surface, Index h, Index opposite, double length) {
  const Vec3 a = area_vector(surface, triangle_of(h)), b = area_vector(surface, triangle_of(opposite));
  const double theta = std::atan2(a.cross(b).norm(), a.dot(b));
  const double width = 2.0 * std::min(a.norm(), b.norm()) / length;
  return theta < kSmoothAngle ? width * theta / 8.0 : 0.0;
}

EdgeFindings examine_edges(const Surface& surface, const EdgeTable& edges, SurfaceReport& report) {
  EdgeFindings findings;
  report.shortest_edge = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Index h = edges.half_edges[static_cast<std::size_t>(edges.first[e])];
    const auto& v = surface.triangles[at(triangle_of(h))];
    const Index ia = v[at(h % 3)], ib = v[at((h + 1) % 3)];
    const Vec3& a = surface.points[at(ia)];
    const Vec3& b = surface.points[at(ib)];
    const double length = (b - a).norm();
    report.shortest_edge = std::min(report.shortest_edge, length);
    report.longest_edge = std::max(report.longest_edge, length);
    const Index other = edges.opposite[at(h)];
    if (other == detail::kOpen) {
      if (report.open_edges++ == 0) findings.open_at = 0.5 * (a + b);
      findings.open_length += length;
    } else if (other == detail::kNonManifold) {
      if (report.nonmanifold_edges++ == 0) findings.nonmanifold_at = 0.5 * (a + b);
    } else if (surface.triangles[at(triangle_of(other))][at(other % 3)] == ia) {
      ++report.misoriented_edges;  // both run the same way
    } else {
      report.facet_sag = std::max(report.facet_sag, sag(surface, h, other, length));
    }
  }
  return findings;
}

void examine_triangles(const Surface& surface, SurfaceReport& report) {
  const Vec3 centre = surface.bounds().center();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 area = area_vector(surface, static_cast<Index>(t));
    report.area += area.norm();
    report.volume += area.dot(surface.points[at(surface.triangles[t][0])] - centre) / 3.0;
  }
  if (report.open_edges > 0) report.volume = 0.0;
}

void warn_of_size(const Surface& surface, const std::string& name, SurfaceReport& report) {
  const Box<3> box = surface.bounds();
  const double extent = box.size().maxCoeff();
  if (extent > 1e6)
    report.warnings.push_back(fmt::format("{}: huge: longest extent {:.4g}; check the unit", name, extent));
  else if (extent > 100.0)
    report.warnings.push_back(
        fmt::format("{}: longest extent {:.4g}; looks like millimetres: --unit mm", name, extent));
  else if (extent < 1e-3)
    report.warnings.push_back(fmt::format("{}: tiny: longest extent {:.4g}; check the unit", name, extent));
  const double far = std::max(box.lo.cwiseAbs().maxCoeff(), box.hi.cwiseAbs().maxCoeff());
  if (far > 1e4 * extent)
    report.warnings.push_back(
        fmt::format("{}: the body of extent {:.4g} lies {:.4g} from the origin, where 32-bit "
                    "coordinates are {:.2g} apart; move it to the origin before export",
                    name, extent, far, far * std::numeric_limits<float>::epsilon()));
  if (box.size().minCoeff() == 0.0)
    report.warnings.push_back(fmt::format("{}: a flat sheet: its extent along one axis is 0", name));
}

void warn(const Surface& surface, const std::string& name, const EdgeFindings& findings,
          SurfaceReport& report) {
  auto& warnings = report.warnings;
  if (report.nonfinite + report.degenerate + report.duplicate > 0)
    warnings.push_back(fmt::format(
        "{}: {} of {} triangles dropped: {} with coordinates that are not finite, {} without area, {} "
        "duplicate",
        name, report.nonfinite + report.degenerate + report.duplicate, report.triangles_read,
        report.nonfinite, report.degenerate, report.duplicate));
  if (report.flipped > 0)
    warnings.push_back(fmt::format("{}: {} of {} triangles turned to orient the shells outward", name,
                                   report.flipped, report.triangles));
  if (report.open_edges > 0)
    warnings.push_back(fmt::format("{}: not closed: {} open edges, {:.4g} long in all, one at {}", name,
                                   report.open_edges, findings.open_length, text(findings.open_at)));
  if (report.nonmanifold_edges > 0)
    warnings.push_back(fmt::format("{}: {} edges with more than two triangles, one at {}", name,
                                   report.nonmanifold_edges, text(findings.nonmanifold_at)));
  if (report.misoriented_edges > 0)
    warnings.push_back(
        fmt::format("{}: {} edges whose triangles cannot be oriented alike (a one-sided surface)", name,
                    report.misoriented_edges));
  if (report.shells > 1)
    warnings.push_back(
        fmt::format("{}: {} separate shells; where they overlap their union is meant", name, report.shells));
  warn_of_size(surface, name, report);
}

}  // namespace

Box<3> Surface::bounds() const {
  Box<3> box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

SurfaceReport clean(Surface& surface, const std::string& name) {
  SurfaceReport report;
  report.triangles_read = static_cast<std::int64_t>(surface.triangles.size());
  surface.tags.resize(surface.triangles.size(), 0);
  if (surface.tag_names.empty()) surface.tag_names.emplace_back("surface");
  if (report.triangles_read > kMostTriangles)
    throw Error(ErrorCode::kSurfaceInvalid, fmt::format("{}: {} triangles, limit {}; thin the surface out",
                                                        name, report.triangles_read, kMostTriangles));
  report.nonfinite = detail::weld(surface);
  const std::int64_t cut = detail::cut_at_slivers(surface);
  report.degenerate = detail::drop_degenerate(surface);
  report.duplicate = detail::drop_duplicates(surface);
  if (surface.triangles.empty())
    throw Error(
        ErrorCode::kSurfaceEmpty,
        fmt::format("{}: no usable triangle among {}: {} with coordinates that are not finite, {} without "
                    "area, {} duplicate",
                    name, report.triangles_read, report.nonfinite, report.degenerate, report.duplicate));
  if (cut + report.degenerate + report.duplicate > 0) detail::number_points(surface);
  EdgeTable edges(surface);
  report.flipped = detail::orient(surface, edges);
  if (report.flipped > 0) {
    detail::number_points(surface);
    edges = EdgeTable(surface);
  }
  std::vector<Index> shell;
  report.shells = detail::find_shells(surface, edges, shell);
  report.points = static_cast<std::int64_t>(surface.points.size());
  report.triangles = static_cast<std::int64_t>(surface.triangles.size());
  const EdgeFindings findings = examine_edges(surface, edges, report);
  examine_triangles(surface, report);
  warn(surface, name, findings, report);
  if (cut > 0)
    report.warnings.push_back(
        fmt::format("{}: {} triangles without area replaced by a cut of their neighbour", name, cut));
  return report;
}

}  // namespace lamina
