// Defaults that depend on the body. All multiples of its longest extent E, so that a body in any unit gets
// the same mesh: domain 2 E before and 4 E behind it in x (flow runs along +x), 2 E around it in y and z; h2
// = E / 20; h1 = 10 h2, at most a quarter of the domain's shortest side, so that the seed has cells to work
// with; Box2 = the body and the larger of 2 delta and E / 4 around it.
#include <fmt/format.h>

#include <algorithm>

#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/planar.h"
#include "core/words.h"
#include "mesh/io.h"
#include "vdb/outline.h"

namespace lamina {
namespace {

constexpr double kUpstream = 2.0, kDownstream = 4.0, kSideways = 2.0;  // extents
constexpr double kH2PerExtent = 1.0 / 20.0;
constexpr double kH1PerH2 = 10.0;
constexpr double kH1PerSide = 0.25;
constexpr double kBox2Deltas = 2.0, kBox2Extents = 0.25;

/// The box of a plane body goes on forever in z.
Box<3> as_domain(const Box<3>& b, bool planar) {
  return planar ? endless(b.lo.head<2>(), b.hi.head<2>()) : b;
}

Box<3> default_domain(const Box<3>& body, double extent, bool planar) {
  Box<3> d = body;
  d.lo -= extent * Vec3(kUpstream, kSideways, kSideways);
  d.hi += extent * Vec3(kDownstream, kSideways, kSideways);
  return as_domain(d, planar);
}

/// Boxes, faces and planes must be those of a plane body, or of one in space.
void check_dimension(const Case& c, bool planar) {
  const auto check = [&](const std::string& option, const Box<3>& box) {
    if (is_planar(box) == planar) return;
    throw Error(ErrorCode::kUsage, fmt::format("{} {}: {} is a body {}: give {}", option, box_text(box),
                                               c.body.string(), planar ? "of the plane" : "in space",
                                               planar ? "x0 y0 x1 y1" : "x0 y0 z0 x1 y1 z1"));
  };
  if (c.domain) check("--domain", *c.domain);
  if (!planar && (c.domain_c || c.border))
    throw Error(
        ErrorCode::kUsage,
        fmt::format("{}: {} is a body in space, whose domain is a box: give --domain x0 y0 z0 x1 y1 z1",
                    c.border ? "--border " + c.border->string() : "--domain c", c.body.string()));
  if (c.box2) check("--box2", *c.box2);
  if (c.box1) check("--box1", *c.box1);
  for (const SizedBox& b : c.boxes) check("--box " + b.name, b.box);
  if (!planar && c.extrude)
    throw Error(ErrorCode::kUsage,
                fmt::format("--extrude {:g}: {} is a body in space: leave it out, or cut it with --slice",
                            *c.extrude, c.body.string()));
  if (!planar) return;
  for (const auto& path : c.outputs)
    if (const MeshFormat* format = mesh_format(path); format != nullptr && !format->plane && !c.extrude)
      throw Error(ErrorCode::kUsage, fmt::format("{}: {} holds meshes in space: give this one of the plane a "
                                                 "height with --extrude",
                                                 path.string(), format->name));
  for (const std::size_t face : {4u, 5u})
    if (c.walls[face])
      throw Error(ErrorCode::kUsage, fmt::format("--wall {}: {} is a body of the plane: its domain has x-, "
                                                 "x+, y- and y+",
                                                 kFaceNames[face], c.body.string()));
  const Plane usual;
  const bool moved = c.picture_plane.axis != usual.axis || c.picture_plane.offset != usual.offset;
  if (moved && (c.picture_plane.axis != 2 || c.picture_plane.offset != 0.0))
    throw Error(ErrorCode::kUsage,
                fmt::format("--picture-plane {}: {} is a body of the plane, which is drawn "
                            "whole: leave it out",
                            plane_text(c.picture_plane), c.body.string()));
}

Box<3> cut(const Box<3>& a, const Box<3>& b) { return {a.lo.cwiseMax(b.lo), a.hi.cwiseMin(b.hi)}; }

/// True when the boxes share a volume.
bool meet(const Box<3>& a, const Box<3>& b) { return (cut(a, b).size().array() > 0.0).all(); }

/// As meet(), for a body that may be flat in some direction.
bool touches(const Box<3>& body, const Box<3>& domain) {
  return (body.hi.array() >= domain.lo.array()).all() && (body.lo.array() <= domain.hi.array()).all();
}

/// Of a plane domain that is no box.
std::optional<DomainBorder> border_of(const Case& c) {
  if (c.domain_c) return c_border((*c.domain_c)[0], (*c.domain_c)[1], (*c.domain_c)[2]);
  if (!c.border) return {};
  const std::string name = c.border->string();
  Outline outline = read_outline(*c.border);
  if (outline.curves.size() != 1 || !outline.curves[0].closed)
    throw Error(
        ErrorCode::kDomain,
        fmt::format("{}: the border of the domain must be one closed curve: {} here{}", name,
                    counted(static_cast<std::int64_t>(outline.curves.size()), "curve"),
                    outline.curves.size() == 1 ? ", an open one; repeat its first point at its end" : ""));
  for (Vec2& x : outline.curves[0].points) x *= unit_scale(c.unit);
  clean(outline, name);
  DomainBorder border;
  border.points = std::move(outline.curves[0].points);
  border.tags.assign(border.points.size(), 1);
  border.names = {{1, "farfield"}};
  require_simple(border, name);
  return border;
}

bool holds(const DomainBorder& border, const Vec2& x) {
  bool inside = false;
  const std::vector<Vec2>& p = border.points;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++)
    if ((p[i][1] > x[1]) != (p[j][1] > x[1]) &&
        x[0] < p[i][0] + (p[j][0] - p[i][0]) * (x[1] - p[i][1]) / (p[j][1] - p[i][1]))
      inside = !inside;
  return inside;
}

void check_border(ResolvedCase& r) {
  const Case& c = r.c;
  const std::string shape = c.border ? c.border->string() : "--domain c";
  if (std::find(c.walls.begin(), c.walls.end(), true) != c.walls.end())
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--wall names a face of a box, and the domain has the border {}: leave one of them "
                    "out, or make the wall a curve of the body",
                    shape));
  const Box<2> body = section<2>(r.body_bounds);
  const bool inside = holds(*r.border, body.lo) && holds(*r.border, body.hi) &&
                      holds(*r.border, {body.lo[0], body.hi[1]}) &&
                      holds(*r.border, {body.hi[0], body.lo[1]});
  if (!inside)
    r.warnings.push_back(
        fmt::format("the body ({}) may reach through the border of the domain: it is cut there",
                    box_text(r.body_bounds)));
}

void check_domain(ResolvedCase& r, const WallField& wall, const std::string& name) {
  const Box<3>& domain = r.sizes.domain;
  if (!touches(r.body_bounds, domain))
    throw Error(ErrorCode::kDomain,
                fmt::format("the body {} ({}) lies outside the domain ({}); move --domain, or check --unit",
                            name, box_text(r.body_bounds), box_text(domain)));
  std::vector<std::string> faces;
  for (int axis = 0; axis < 3; ++axis) {
    if (r.body_bounds.lo[axis] < domain.lo[axis]) faces.push_back(fmt::format("{}-", "xyz"[axis]));
    if (r.body_bounds.hi[axis] > domain.hi[axis]) faces.push_back(fmt::format("{}+", "xyz"[axis]));
  }
  if (static_cast<int>(faces.size()) == 2 * dimension_of(domain)) {
    // The wall may pass around the domain without meeting it: a hollow body, or one that swallows the domain.
    const double depth = wall.phi(domain.center());
    const double diagonal = is_planar(domain) ? section<2>(domain).diagonal() : domain.diagonal();
    if (std::abs(depth) > 0.5 * diagonal)
      throw Error(ErrorCode::kDomain,
                  fmt::format("the domain ({}) lies wholly {} the body {}; check --domain and --unit",
                              box_text(domain), depth < 0.0 ? "inside" : "in a hollow of", name));
  }
  if (!faces.empty())
    r.warnings.push_back(fmt::format("the body reaches through the domain's face{} {}: it is cut there",
                                     faces.size() > 1 ? "s" : "", join(faces)));
}

void resolve_box2(ResolvedCase& r, double extent) {
  Case& c = r.c;
  const Box<3>& domain = r.sizes.domain;
  if (c.box2) {
    if (!meet(*c.box2, domain))
      throw Error(ErrorCode::kDomain, fmt::format("--box2 ({}) lies outside the domain ({})",
                                                  box_text(*c.box2), box_text(domain)));
    const Box<3> inside = cut(*c.box2, domain);
    if (inside.lo != c.box2->lo || inside.hi != c.box2->hi)
      r.warnings.push_back(
          fmt::format("--box2 reaches beyond the domain and is cut to {}", box_text(inside)));
    c.box2 = inside;
  } else {
    const double margin =
        c.box2_margin.value_or(std::max(kBox2Deltas * r.layer.delta, kBox2Extents * extent));
    c.box2 = cut(as_domain(r.body_bounds.padded(margin), is_planar(domain)), domain);
    if (!meet(*c.box2, domain))
      throw Error(ErrorCode::kDomain,
                  fmt::format("no Box2 of margin {:g} fits into the domain ({}); give --box2", margin,
                              box_text(domain)));
  }
  c.box2_margin.reset();
  r.sizes.box2 = *c.box2;
  const Box<3> seen = cut(r.body_bounds, domain);
  if (!r.sizes.box2.contains(seen.lo) || !r.sizes.box2.contains(seen.hi))
    r.warnings.push_back(
        "Box2 does not hold the whole body: along its wall outside Box2 sizes grow beyond h2");
}

void resolve_sizes(ResolvedCase& r, double extent) {
  Case& c = r.c;
  const double h_min = r.layer.h_min;
  const double side = r.sizes.domain.size().minCoeff();
  if (!c.h2) {
    c.h2 = std::max(extent * kH2PerExtent, 2.0 * h_min);
    if (c.h1) c.h2 = std::min(*c.h2, *c.h1);
  }
  if (!c.h1) c.h1 = std::max(*c.h2, std::min(kH1PerH2 * *c.h2, kH1PerSide * side));
  if (!(h_min < *c.h2))
    throw Error(ErrorCode::kParameter,
                fmt::format("h_min = {:g} must be below h2 = {:g}: lower --hmin (or --yplus) or raise --h2",
                            h_min, *c.h2));
  if (!(*c.h2 <= *c.h1))
    throw Error(ErrorCode::kParameter,
                fmt::format("h2 = {:g} must not exceed h1 = {:g}: lower --h2 or raise --h1", *c.h2, *c.h1));
  if (r.layer.top_size() > *c.h2)
    r.warnings.push_back(
        fmt::format("the last layer's size {:.3g} exceeds h2 = {:g}, which bounds it: fewer "
                    "--layers, a smaller --growth or a larger --h2 fit better",
                    r.layer.top_size(), *c.h2));
  if (!c.box1) c.box1 = r.sizes.domain;
  const Box<3> domain = r.sizes.domain;
  r.sizes = size_options(c);
  r.sizes.domain = domain;
}

void check_user_sizes(ResolvedCase& r, const Body& body) {
  if (body.user && !meet(body.user->bounds, r.sizes.domain))
    r.warnings.push_back(
        fmt::format("the mesh of --metric ({}) lies outside the domain", box_text(body.user->bounds)));
  for (const SizeGrid& p : body.painted) {
    const auto [least, most] = p.range();
    if (!meet(p.bounds(), r.sizes.domain))
      r.warnings.push_back(fmt::format("size grid {} ({}) lies outside the domain: check --unit", p.name(),
                                       box_text(p.bounds())));
    else if (least >= r.sizes.h1)
      r.warnings.push_back(
          fmt::format("size grid {} asks for no size below {:g}, h1 is {:g}: it has no effect", p.name(),
                      least, r.sizes.h1));
    if (least < r.layer.h_min)
      r.warnings.push_back(fmt::format("size grid {} asks for sizes down to {:g}, below h_min = {:g}",
                                       p.name(), least, r.layer.h_min));
  }
}

}  // namespace

SizeOptions size_options(const Case& c) {
  SizeOptions sizes;
  sizes.h2 = c.h2.value();
  sizes.h1 = c.h1.value();
  if (c.domain) sizes.domain = *c.domain;  // else it has a border of its own
  sizes.box2 = c.box2.value();
  sizes.box1 = c.box1;
  sizes.profile = c.profile;
  sizes.growth_inside = c.growth_inside;
  sizes.corner_elements = c.corner_elements;
  sizes.edge_growth = c.edge_growth;
  sizes.gradation = c.gradation;
  sizes.chord = c.chord;
  sizes.boxes = c.boxes;
  sizes.walls = c.walls;
  return sizes;
}

ResolvedCase resolve_case(const Case& given, const Body& body) {
  ResolvedCase r;
  r.c = given;
  Case& c = r.c;
  check_dimension(c, body.planar());
  r.body_bounds = body.level_set.bounds();
  const double extent = r.body_bounds.size().maxCoeff();
  if (!(extent > 0.0))
    throw Error(ErrorCode::kSurfaceInvalid, fmt::format("{}: the body has no extent", given.body.string()));
  r.layer = resolve(c.flow, extent);
  // Written out in full, so that the resolved case does not depend on how they were derived.
  c.flow.length = r.layer.length;
  c.flow.h_min = r.layer.h_min;
  c.flow.delta = r.layer.delta;
  c.flow.layers = r.layer.layers;
  if (body.kind != BodyKind::kVdb) c.level_set.voxel = body.level_set.report().voxel;
  r.border = border_of(c);
  if (r.border) {
    Box<2> around;
    for (const Vec2& x : r.border->points) around.extend(x);
    r.sizes.domain = endless(around.lo, around.hi);
  } else {
    r.sizes.domain = c.domain.value_or(default_domain(r.body_bounds, extent, body.planar()));
    c.domain = r.sizes.domain;
  }
  check_domain(r, body.level_set, given.body.string());
  if (r.border) check_border(r);
  resolve_box2(r, extent);
  resolve_sizes(r, extent);
  check_user_sizes(r, body);
  if (body.planar()) c.picture_plane = {.axis = 2, .offset = 0.0};
  if (!c.picture_window && c.picture) {
    const int u = c.picture_plane.axis == 0 ? 1 : 0, v = c.picture_plane.axis == 2 ? 1 : 2;
    const Box<3>& b = r.sizes.box2;
    c.picture_window = {b.lo[u], b.lo[v], b.hi[u], b.hi[v]};
  }
  return r;
}

}  // namespace lamina
