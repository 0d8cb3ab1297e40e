// The table of options, and what binds its rows to the members of Case.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <type_traits>

#include "apps/pipeline/case.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/planar.h"

namespace lamina {
namespace {

using Path = std::filesystem::path;
using std::optional;

// Members of a Case and the values of options, one pair of functions per type of member.
OptionValue fetch(bool m) { return m; }
OptionValue fetch(double m) { return m; }
OptionValue fetch(int m) { return std::int64_t{m}; }
OptionValue fetch(const std::string& m) { return m; }
OptionValue fetch(const Path& m) { return m.string(); }
OptionValue fetch(const Plane& m) { return plane_text(m); }
OptionValue fetch(const std::array<double, 4>& m) { return std::vector<double>(m.begin(), m.end()); }
OptionValue fetch(const std::array<double, 3>& m) { return std::vector<double>(m.begin(), m.end()); }
OptionValue fetch(const Box<3>& m) { return box_numbers(m); }
OptionValue fetch(const std::vector<std::string>& m) { return m; }
OptionValue fetch(const std::vector<SizedBox>& m) {
  std::vector<std::string> v;
  for (const SizedBox& b : m) {
    v.push_back(b.name);
    for (const double x : box_numbers(b.box)) v.back() += fmt::format(" {}", x);
    v.back() += fmt::format(" {}", b.size);
  }
  return v;
}
OptionValue fetch(const std::array<bool, 6>& m) {
  std::vector<std::string> v;
  for (std::size_t face = 0; face < 6; ++face)
    if (m[face]) v.emplace_back(kFaceNames[face]);
  return v;
}
OptionValue fetch(const std::vector<Path>& m) {
  std::vector<std::string> v;
  for (const Path& p : m) v.push_back(p.string());
  return v;
}

void assign(bool& m, const OptionValue& v) { m = std::get<bool>(v); }
void assign(double& m, const OptionValue& v) { m = std::get<double>(v); }
void assign(int& m, const OptionValue& v) { m = static_cast<int>(std::get<std::int64_t>(v)); }
void assign(std::string& m, const OptionValue& v) { m = std::get<std::string>(v); }
void assign(Path& m, const OptionValue& v) { m = std::get<std::string>(v); }
void assign(Plane& m, const OptionValue& v) { m = parse_plane(std::get<std::string>(v)); }
void assign(std::array<double, 4>& m, const OptionValue& v) {
  const auto& x = std::get<std::vector<double>>(v);
  m = {x[0], x[1], x[2], x[3]};
}
void assign(std::array<double, 3>& m, const OptionValue& v) {
  const auto& x = std::get<std::vector<double>>(v);
  m = {x[0], x[1], x[2]};
}
/// Of four or six numbers.
Box<3> box_of(const std::vector<double>& x) {
  if (x.size() == 4) return endless({x[0], x[1]}, {x[2], x[3]});
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}
void assign(Box<3>& m, const OptionValue& v) { m = box_of(std::get<std::vector<double>>(v)); }
void assign(std::vector<std::string>& m, const OptionValue& v) { m = std::get<std::vector<std::string>>(v); }
// "NAME x0 y0 z0 x1 y1 z1 SIZE", or without z
SizedBox parse_box(const std::string& text) {
  std::istringstream words(text);
  const std::vector<std::string> all{std::istream_iterator<std::string>(words), {}};
  std::vector<double> x;
  bool good = all.size() == 8 || all.size() == 6;
  for (std::size_t i = 1; good && i < all.size(); ++i) {
    const auto number = parse_number(all[i]);
    good = number.has_value();
    x.push_back(number.value_or(0.0));
  }
  good = good && x.back() > 0.0;
  for (std::size_t i = 0, half = x.size() / 2; good && i < half; ++i) good = x[i] < x[half + i];
  if (!good)
    throw Error(
        ErrorCode::kUsage,
        fmt::format(
            "--box \"{}\": must be NAME X0 Y0 Z0 X1 Y1 Z1 SIZE (in two dimensions without Z0 and Z1), "
            "lower corner first, size above 0",
            text));
  const double size = x.back();
  x.pop_back();
  return {all[0], box_of(x), size};
}
void assign(std::vector<SizedBox>& m, const OptionValue& v) {
  m.clear();
  for (const std::string& text : std::get<std::vector<std::string>>(v)) m.push_back(parse_box(text));
}
void assign(std::array<bool, 6>& m, const OptionValue& v) {
  m.fill(false);
  for (const std::string& name : std::get<std::vector<std::string>>(v)) {
    const auto* at = std::find(kFaceNames.begin(), kFaceNames.end(), name);
    if (at == kFaceNames.end())
      throw Error(ErrorCode::kUsage, fmt::format("--wall {}: must be one of {}", name,
                                                 join({kFaceNames.begin(), kFaceNames.end()})));
    m[static_cast<std::size_t>(at - kFaceNames.begin())] = true;
  }
}
void assign(std::vector<Path>& m, const OptionValue& v) {
  const auto& x = std::get<std::vector<std::string>>(v);
  m.assign(x.begin(), x.end());
}

bool unset(const Path& m) { return m.empty(); }
bool unset(const std::string& m) { return m.empty(); }
bool unset(const std::vector<Path>& m) { return m.empty(); }
bool unset(const std::vector<std::string>& m) { return m.empty(); }
bool unset(const std::vector<SizedBox>& m) { return m.empty(); }
bool unset(const std::array<bool, 6>& m) {
  return std::none_of(m.begin(), m.end(), [](bool wall) { return wall; });
}
template <class T>
bool unset(const T&) {
  return false;
}

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<optional<T>> : std::true_type {};

/// Binds the member that `member` returns a reference to. Enumerators are numbered in the order of the
/// choices.
template <class Member>
CaseOption bind(CaseOption o, Member member) {
  using T = std::remove_reference_t<decltype(member(std::declval<Case&>()))>;
  const std::vector<std::string> choices = o.choices;
  o.set = [member, choices](Case& c, const OptionValue& v) {
    if constexpr (std::is_enum_v<T>) {
      const auto at = std::find(choices.begin(), choices.end(), std::get<std::string>(v));
      member(c) = static_cast<T>(at - choices.begin());
    } else if constexpr (IsOptional<T>::value) {
      assign(member(c).emplace(), v);
    } else {
      assign(member(c), v);
    }
  };
  if constexpr (IsOptional<T>::value) o.clear = [member](Case& c) { member(c).reset(); };
  o.get = [member, choices](const Case& c) -> optional<OptionValue> {
    const T& value = member(const_cast<Case&>(c));  // the accessor is shared with set and changes nothing
    if constexpr (std::is_enum_v<T>) {
      return choices[static_cast<std::size_t>(value)];
    } else if constexpr (IsOptional<T>::value) {
      if (!value) return std::nullopt;
      return fetch(*value);
    } else {
      if (unset(value)) return std::nullopt;
      return fetch(value);
    }
  };
  return o;
}

CaseOption real(std::string table, std::string key, std::string flags, std::string unit, std::string standard,
                std::string help) {
  return {.table = std::move(table),
          .key = std::move(key),
          .flags = std::move(flags),
          .unit = std::move(unit),
          .default_value = std::move(standard),
          .help = std::move(help)};
}

/// A real number above zero.
CaseOption positive(std::string table, std::string key, std::string flags, std::string unit,
                    std::string standard, std::string help) {
  CaseOption o = real(std::move(table), std::move(key), std::move(flags), std::move(unit),
                      std::move(standard), std::move(help));
  o.lo = 0.0;
  o.lo_open = true;
  return o;
}

CaseOption numbers(CaseOption o, int count) {
  o.type = OptionType::kReals;
  o.count = count;
  return o;
}
/// The corners of a box.
CaseOption corners(CaseOption o) {
  o.planar_count = 4;
  return numbers(std::move(o), 6);
}
CaseOption typed(CaseOption o, OptionType type) {
  o.type = type;
  return o;
}
CaseOption choice(CaseOption o, std::vector<std::string> choices) {
  o.type = OptionType::kChoice;
  o.choices = std::move(choices);
  return o;
}
CaseOption within(CaseOption o, double lo, double hi, bool lo_open = false, bool hi_open = false) {
  o.lo = lo;
  o.hi = hi;
  o.lo_open = lo_open;
  o.hi_open = hi_open;
  return o;
}
CaseOption against(CaseOption o, std::vector<std::string> keys) {
  o.replaces = std::move(keys);
  return o;
}

using Options = std::vector<CaseOption>;

void add_body(Options& o) {
  o.push_back(bind(typed(real("body", "file", "BODY", "", "",
                              "the body: .stl, .obj, .ply or .vdb; in two dimensions a profile: .dat (an "
                              "aerofoil), .csv or .txt"),
                         OptionType::kText),
                   [](Case& c) -> Path& { return c.body; }));
  o.push_back(bind(choice(real("body", "unit", "--unit", "", "",
                               "unit of the coordinates in the body's file; they are turned into metres (m "
                               "leaves them as they are)"),
                          {"m", "mm", "cm", "in", "ft"}),
                   [](Case& c) -> LengthUnit& { return c.unit; }));
  o.push_back(bind(typed(real("body", "sheet", "--sheet", "",
                              "sheets are told from solids with holes by their winding number",
                              "every open shell of a surface is a two-sided wall of no thickness"),
                         OptionType::kFlag),
                   [](Case& c) -> bool& { return c.level_set.sheets; }));
  o.push_back(bind(typed(real("body", "grid", "--grid", "", "the only level set, else \"surface\"",
                              "name of the grid of a .vdb body"),
                         OptionType::kText),
                   [](Case& c) -> std::string& { return c.level_set.grid; }));
  o.push_back(bind(real("body", "iso", "--iso", "", "", "iso value of the wall in a .vdb body of fog class"),
                   [](Case& c) -> optional<double>& { return c.level_set.iso; }));
}

void add_profile(Options& o) {
  o.push_back(bind(typed(real("body", "polyline", "--polyline", "",
                              "aerofoils (.dat) are splines, lists of points (.csv, .txt) polylines",
                              "the points of a profile are joined by straight lines"),
                         OptionType::kFlag),
                   [](Case& c) -> bool& { return c.polyline; }));
  o.push_back(
      bind(typed(real("body", "spline", "--spline", "", "as for --polyline",
                      "the points of a profile are joined by a cubic spline, with corners where it turns "
                      "sharply"),
                 OptionType::kFlag),
           [](Case& c) -> bool& { return c.spline; }));
}

void add_slice(Options& o) {
  o.push_back(bind(typed(real("body", "slice", "--slice", "", "",
                              "plane x=VALUE, y=VALUE or z=VALUE (m) that cuts the body: a mesh in two "
                              "dimensions around the section, with the plane's axes in the order x, y, z"),
                         OptionType::kText),
                   [](Case& c) -> optional<Plane>& { return c.slice; }));
}

void add_painted(Options& o) {
  o.push_back(
      bind(typed(real("body", "size_grids", "--size-grid", "", "",
                      "grid of painted sizes, NAME in the body's .vdb or FILE.vdb:NAME: no element is "
                      "larger than the value of the voxel it is in; may be repeated"),
                 OptionType::kTexts),
           [](Case& c) -> std::vector<std::string>& { return c.size_grids; }));
}

void add_flow(Options& o) {
  CaseOption re = bind(against(within(real("flow", "re", "--re", "", "", "Reynolds number of the length L"),
                                      10, 1e9, true, true),
                               {"velocity", "viscosity"}),
                       [](Case& c) -> double& { return c.flow.reynolds; });
  // With a velocity the Reynolds number is derived: listing both would be a contradiction when read back.
  re.get = [](const Case& c) -> optional<OptionValue> {
    return c.flow.velocity ? std::nullopt : optional<OptionValue>(c.flow.reynolds);
  };
  o.push_back(re);
  o.push_back(bind(positive("flow", "length", "--length", "m", "longest extent of the body",
                            "characteristic length L of the flow"),
                   [](Case& c) -> optional<double>& { return c.flow.length; }));
  o.push_back(bind(
      positive("flow", "velocity", "--velocity", "m/s", "", "velocity u; with --viscosity instead of --re"),
      [](Case& c) -> optional<double>& { return c.flow.velocity; }));
  o.push_back(
      bind(positive("flow", "viscosity", "--viscosity", "m2/s", "", "kinematic viscosity nu; Re = u L / nu"),
           [](Case& c) -> optional<double>& { return c.flow.viscosity; }));
  o.push_back(bind(positive("flow", "yplus", "--yplus", "", "", "wanted y+ of the first height; gives h_min"),
                   [](Case& c) -> double& { return c.flow.y_plus; }));
  o.push_back(
      bind(within(real("flow", "growth", "--growth", "", "", "thickness ratio alpha of neighbouring layers"),
                  1, 2, true),
           [](Case& c) -> double& { return c.flow.growth; }));
  o.push_back(bind(
      choice(real("flow", "regime", "--regime", "", "", "law of the thickness delta of the boundary layer"),
             {"laminar", "turbulent"}),
      [](Case& c) -> Regime& { return c.flow.regime; }));
  o.push_back(bind(positive("flow", "hmin", "--hmin", "m", "from Re, L and y+",
                            "thickness h_min of the first layer, instead of the derived one"),
                   [](Case& c) -> optional<double>& { return c.flow.h_min; }));
  o.push_back(bind(positive("flow", "delta", "--delta", "m", "from Re, L and the regime",
                            "thickness delta the layers fill, instead of the derived one"),
                   [](Case& c) -> optional<double>& { return c.flow.delta; }));
  o.push_back(bind(within(typed(real("flow", "layers", "--layers", "", "as many as fill delta",
                                     "number of layers, instead of the derived one"),
                                OptionType::kInteger),
                          1, 200),
                   [](Case& c) -> optional<int>& { return c.flow.layers; }));
}

void add_sizes(Options& o) {
  o.push_back(bind(positive("sizes", "h2", "--h2", "m", "longest extent of the body / 20",
                            "largest size in Box2, the box around the body"),
                   [](Case& c) -> optional<double>& { return c.h2; }));
  o.push_back(
      bind(positive("sizes", "h1", "--h1", "m", "10 h2, at most a quarter of the domain's shortest side",
                    "largest size at the border of the domain (Box1)"),
           [](Case& c) -> optional<double>& { return c.h1; }));
  o.push_back(bind(positive("sizes", "target_cells", "--target-cells", "", "",
                            "number of cells to aim at: h2 and h1 are scaled, h_min is not"),
                   [](Case& c) -> optional<double>& { return c.target_cells; }));
  o.push_back(
      bind(against(corners(real("sizes", "box2", "--box2", "m", "the body and --box2-margin around it",
                                "corners x0 y0 z0 x1 y1 z1 of Box2, in two dimensions x0 y0 x1 y1")),
                   {"box2_margin"}),
           [](Case& c) -> optional<Box<3>>& { return c.box2; }));
  o.push_back(bind(against(positive("sizes", "box2_margin", "--box2-margin", "m",
                                    "the larger of 2 delta and a quarter of the longest extent",
                                    "distance from the body to the border of Box2"),
                           {"box2"}),
                   [](Case& c) -> optional<double>& { return c.box2_margin; }));
  o.push_back(bind(corners(real("sizes", "box1", "--box1", "m", "the domain",
                                "corners of the box at whose border sizes have grown to h1: for domains much "
                                "larger than the body")),
                   [](Case& c) -> optional<Box<3>>& { return c.box1; }));
  o.push_back(bind(choice(real("sizes", "profile", "--profile", "", "",
                               "normal size: constant in each layer, or growing continuously"),
                          {"layered", "continuous"}),
                   [](Case& c) -> Profile& { return c.profile; }));
  o.push_back(
      bind(choice(real("sizes", "chord", "--chord", "", "",
                       "size that chords along curved walls are measured by: the local normal size, or "
                       "h_min at every height (two to four times the elements)"),
                  {"local", "wall"}),
           [](Case& c) -> Chord& { return c.chord; }));
  o.push_back(
      bind(typed(real("sizes", "metric", "--metric", "", "",
                      "a mesh with a metric at its vertices, of a solution for example (.vtu with point data "
                      "\"metric\", or .mesh, .meshb with a .sol, .solb of the same name): no size exceeds "
                      "it, once its "
                      "growth is bounded by --gradation. Its coordinates are those of the domain"),
                 OptionType::kText),
           [](Case& c) -> optional<Path>& { return c.metric; }));
  CaseOption box =
      typed(real("sizes", "boxes", "--box", "m", "",
                 "a box in which no element is larger than SIZE, a wake for example; sizes grow by "
                 "the gradation outside of it; may be repeated"),
            OptionType::kTexts);
  box.count = 8;
  box.planar_count = 6;
  o.push_back(bind(box, [](Case& c) -> std::vector<SizedBox>& { return c.boxes; }));
  o.push_back(
      bind(typed(real("sizes", "walls", "--wall", "", "",
                      "face of the domain that carries layers like the body, the ground of a channel: x-, "
                      "x+, y-, y+, z- or z+; may be repeated"),
                 OptionType::kTexts),
           [](Case& c) -> std::array<bool, 6>& { return c.walls; }));
  o.push_back(bind(within(real("sizes", "corner_elements", "--corner-elements", "", "",
                               "elements per 90 degrees around a sharp edge in the first layer"),
                          1, 16),
                   [](Case& c) -> double& { return c.corner_elements; }));
  o.push_back(bind(within(real("sizes", "edge_growth", "--edge-growth", "", "",
                               "growth per element along the wall, away from sharp edges and from where two "
                               "walls meet"),
                          1, 4, true),
                   [](Case& c) -> double& { return c.edge_growth; }));
  CaseOption gradation = within(real("sizes", "gradation", "--gradation", "", "",
                                     "largest ratio of sizes per element beyond the layers; 0: no bound"),
                                1, 4, true);
  gradation.off = 0.0;
  o.push_back(bind(gradation, [](Case& c) -> double& { return c.gradation; }));
  o.push_back(bind(within(real("sizes", "growth_inside", "--growth-inside", "", "",
                               "growth per layer inside the body, below the mirrored layers"),
                          1, 4, true),
                   [](Case& c) -> double& { return c.growth_inside; }));
}

void add_domain(Options& o) {
  o.push_back(
      bind(against(corners(real("domain", "box", "--domain", "m",
                                "the body with 2 L before, 4 L behind it in x, and 2 L around it in y and z "
                                "(L: longest extent)",
                                "corners x0 y0 z0 x1 y1 z1 of the meshed box, in two dimensions x0 y0 x1 y1, "
                                "or c RADIUS LENGTH HEIGHT, see --domain-c")),
                   {"c", "border"}),
           [](Case& c) -> optional<Box<3>>& { return c.domain; }));
  CaseOption c_shape = numbers(positive("domain", "c", "--domain-c", "m", "",
                                        "in two dimensions: radius, length and height of a half disc left of "
                                        "the origin and a rectangle right of it; the height is at most twice "
                                        "the radius and cuts the disc"),
                               3);
  o.push_back(bind(against(std::move(c_shape), {"box", "border"}),
                   [](Case& c) -> optional<std::array<double, 3>>& { return c.domain_c; }));
  o.push_back(bind(against(typed(real("domain", "border", "--border", "", "",
                                      "in two dimensions: a closed curve around the domain, .csv, .txt or "
                                      ".dat, in the unit of the body"),
                                 OptionType::kText),
                           {"box", "c"}),
                   [](Case& c) -> optional<Path>& { return c.border; }));
}

void add_level_set(Options& o) {
  o.push_back(
      bind(within(real("levelset", "voxel", "--voxel", "m", "longest extent of the body / 200",
                       "voxel edge of the level set; 0: the default, coarser when the memory asks for it"),
                  0, 1e300),
           [](Case& c) -> double& { return c.level_set.voxel; }));
  o.push_back(
      bind(positive("levelset", "max_memory", "--max-memory", "bytes", "", "memory the level set may take"),
           [](Case& c) -> double& { return c.level_set.max_memory; }));
}

void add_mesh(Options& o) {
  o.push_back(bind(choice(real("mesh", "seed", "--seed", "", "", "how the first, coarse mesh is made"),
                          {"tetgen", "lattice"}),
                   [](Case& c) -> SeedKind& { return c.seed; }));
  o.push_back(
      bind(choice(real("mesh", "align", "--align", "", "",
                       "where vertices go: anywhere, which makes the most regular cells in the metric, "
                       "or on the levels of the layers"),
                  {"none", "layers"}),
           [](Case& c) -> Align& { return c.align; }));
  o.push_back(bind(within(real("mesh", "quality_floor", "--quality-floor", "", "",
                               "quality (mean ratio, 1 is best) below which no operation may bring a cell"),
                          0, 0.5),
                   [](Case& c) -> double& { return c.quality_floor; }));
  o.push_back(
      bind(within(typed(real("mesh", "threads", "--threads", "", "",
                             "worker threads; 0: all of the machine's. The mesh does not depend on it"),
                        OptionType::kInteger),
                  0, 4096),
           [](Case& c) -> int& { return c.threads; }));
}

void add_output(Options& o) {
  const auto file = [](std::string key, std::string flags, std::string help) {
    return typed(real("output", std::move(key), std::move(flags), "", "", std::move(help)),
                 OptionType::kText);
  };
  o.push_back(bind(
      typed(
          file(
              "files", "-o,--out",
              "mesh to write (formats: lamina convert --help); may be repeated. The resolved case is written "
              "beside the first one, as NAME.case.toml"),
          OptionType::kTexts),
      [](Case& c) -> std::vector<Path>& { return c.outputs; }));
  o.push_back(
      bind(positive("output", "extrude", "--extrude", "m", "",
                    "two dimensions: write the mesh as one layer of cells of this height above z = 0: "
                    "prisms for OpenFOAM, else tetrahedra, three for each prism"),
           [](Case& c) -> optional<double>& { return c.extrude; }));
  o.push_back(bind(file("metric", "--metric-out", "metric at the vertices to write: .sol or .solb"),
                   [](Case& c) -> optional<Path>& { return c.metric_out; }));
  o.push_back(bind(file("levelset", "--levelset", "level set to write: .vdb"),
                   [](Case& c) -> optional<Path>& { return c.levelset_out; }));
  o.push_back(bind(file("report", "--report", "report to write: .json"),
                   [](Case& c) -> optional<Path>& { return c.report; }));
  o.push_back(bind(file("picture", "--picture", "picture of a slice to write: .png, .svg or .pdf"),
                   [](Case& c) -> optional<Path>& { return c.picture; }));
  o.push_back(
      bind(file("checkpoint", "--checkpoint",
                "folder that gets a checkpoint after every step of the optimizer; lamina mesh --resume "
                "goes on from the last"),
           [](Case& c) -> optional<Path>& { return c.checkpoint; }));
  CaseOption plane =
      file("picture_plane", "--picture-plane", "plane of the picture: x=VALUE, y=VALUE or z=VALUE");
  o.push_back(bind(plane, [](Case& c) -> Plane& { return c.picture_plane; }));
  o.push_back(bind(numbers(real("output", "picture_window", "--picture-window", "m", "Box2",
                                "part of the plane to draw: u0 v0 u1 v1 ((u, v) = (y, z), (x, z) or (x, y))"),
                           4),
                   [](Case& c) -> optional<std::array<double, 4>>& { return c.picture_window; }));
}

/// The value a fresh Case has, in words; "" where there is none.
std::string standard_value(const CaseOption& o) {
  const optional<OptionValue> value = o.get(Case());
  if (!value) return {};
  if (const auto* real_value = std::get_if<double>(&*value)) return fmt::format("{:g}", *real_value);
  if (const auto* integer = std::get_if<std::int64_t>(&*value)) return std::to_string(*integer);
  if (const auto* text = std::get_if<std::string>(&*value)) return *text;
  return {};
}

}  // namespace

const std::vector<CaseOption>& case_options() {
  static const Options options = [] {
    Options o;
    add_body(o);
    add_profile(o);
    add_slice(o);
    add_painted(o);
    add_flow(o);
    add_sizes(o);
    add_domain(o);
    add_level_set(o);
    add_mesh(o);
    add_output(o);
    for (CaseOption& option : o)
      if (option.default_value.empty()) option.default_value = standard_value(option);
    return o;
  }();
  return options;
}

const std::vector<std::pair<std::string, std::string>>& case_tables() {
  static const std::vector<std::pair<std::string, std::string>> tables = {
      {"body", "The body, immersed in the domain"},
      {"flow", "The boundary layer: from the flow, or given"},
      {"sizes", "Sizes of the elements"},
      {"domain", "What is meshed: a box, in two dimensions also a C or any closed curve"},
      {"levelset", "The level set of a triangle surface"},
      {"mesh", "How the mesh is made"},
      {"output", "Files to write"},
  };
  return tables;
}

}  // namespace lamina
