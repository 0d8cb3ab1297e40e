// A case: everything `lamina mesh` can be told, from flags, from a case file (TOML), or both.
//
// One table, case_options(), describes every option once: it drives the flags, the keys of the case file, the
// checks of types and ranges, the help texts and the file of the resolved case.
// Lengths are world units: the unit of the body's file after `unit` has scaled it (metres when it says so).
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/boundary_layer.h"
#include "core/wall_metric.h"
#include "mesh/adapt.h"
#include "mesh/seed.h"
#include "vdb/level_set.h"

namespace lamina {

/// Unit of the coordinates in the body's file.
enum class LengthUnit { kMetre, kMillimetre, kCentimetre, kInch, kFoot };
/// Metres per unit.
double unit_scale(LengthUnit unit);

/// What a body is read from.
enum class BodyKind { kSurface, kVdb, kProfile };

/// An axis-aligned plane, coordinate `axis` = `offset`.
struct Plane {
  int axis = 1;
  double offset = 0.0;
};
/// Reads "y=0", "x = -1.5". Errors: kUsage with the accepted form.
Plane parse_plane(std::string_view text);
std::string plane_text(const Plane& plane);

/// What was asked for; an empty optional is resolved by resolve_case() from the body.
struct Case {
  std::filesystem::path body;
  LengthUnit unit = LengthUnit::kMetre;
  bool polyline = false, spline = false;  ///< how the points of a profile are joined; neither: by its format
  std::vector<std::string> size_grids;    ///< "NAME" in the body's .vdb, or "FILE.vdb:NAME"
  Flow flow;
  std::optional<double> h2, h1, box2_margin, target_cells;
  std::optional<Box<3>> box2, box1, domain;       ///< in two dimensions endless in z, as the boxes below
  std::optional<std::array<double, 3>> domain_c;  ///< radius, length, height, see c_border()
  std::optional<std::filesystem::path> border;    ///< a closed curve around the domain
  Profile profile = Profile::kLayered;
  double corner_elements = SizeOptions{}.corner_elements;
  double edge_growth = SizeOptions{}.edge_growth;
  double gradation = SizeOptions{}.gradation;
  double growth_inside = SizeOptions{}.growth_inside;
  std::optional<std::filesystem::path> metric;  ///< a mesh with its own metric, see BackgroundMetric::read
  Chord chord = Chord::kLocal;
  std::vector<SizedBox> boxes;
  std::array<bool, 6> walls{};  ///< see SizeOptions::walls
  LevelSetOptions level_set;
  SeedKind seed = SeedKind::kTetgen;
  Align align = Align::kLayers;
  double quality_floor = 0.1;
  int threads = 0;                ///< 0: all; the mesh does not depend on it
  std::optional<Plane> slice;     ///< of a body in space: its section is the body of a plane mesh
  std::optional<double> extrude;  ///< plane meshes are written as one layer of cells of this height
  std::vector<std::filesystem::path> outputs;
  std::optional<std::filesystem::path> metric_out, levelset_out, report, picture;
  std::optional<std::filesystem::path> checkpoint;  ///< folder, see apps/pipeline/checkpoint.h
  bool resume = false;                              ///< go on from the last step in `checkpoint`
  Plane picture_plane;
  std::optional<std::array<double, 4>> picture_window;  ///< u0 v0 u1 v1 in the plane; DEFAULT: Box2
  std::filesystem::path source;  ///< the case file this came from; empty when there was none
};

/// A case with every default filled in: running `c` again gives the same files.
struct ResolvedCase {
  Case c;
  BoundaryLayer layer;
  SizeOptions sizes;
  std::optional<DomainBorder>
      border;  ///< of a plane domain that is no box; `sizes.domain` is the box around it
  Box<3> body_bounds;
  std::vector<std::string> warnings;
};

using OptionValue =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;
enum class OptionType { kFlag, kInteger, kReal, kText, kChoice, kReals, kTexts };

/// One option of a case.
struct CaseOption {
  std::string table, key;  ///< place in the case file
  std::string flags;       ///< "--hmin", "-o,--out"; the positional argument: "BODY"
  OptionType type = OptionType::kReal;
  int count = 1;              ///< numbers of kReals, words of each text of kTexts
  int planar_count = 0;       ///< as many will do in two dimensions; 0: no
  std::string unit;           ///< "m", "degrees", "" for a pure number
  std::string default_value;  ///< in words
  std::string help;
  double lo = -std::numeric_limits<double>::infinity(), hi = std::numeric_limits<double>::infinity();
  bool lo_open = false, hi_open = false;
  std::optional<double> off = {};  ///< allowed beside the range: turns the option off
  std::vector<std::string> choices = {};
  std::vector<std::string> replaces = {};  ///< keys of the same table that this one contradicts
  std::function<void(Case&, const OptionValue&)> set = {};
  std::function<std::optional<OptionValue>(const Case&)> get = {};
  std::function<void(Case&)> clear = {};  ///< forgets the value; empty where there is always one

  /// The long flag, or the name of the positional argument.
  [[nodiscard]] std::string name() const;
  /// "> 0", "in (1, 2]", "tetgen | lattice", or "".
  [[nodiscard]] std::string range_text() const;
  /// Unit, range and default in one phrase: "m; > 0; default: 1".
  [[nodiscard]] std::string notes() const;
};

/// All options, table by table, in the order they are listed to users.
const std::vector<CaseOption>& case_options();
/// Tables in order, each with one line of description.
const std::vector<std::pair<std::string, std::string>>& case_tables();

/// An option with its value and the words that say where it was given ("--hmin", "case.toml:3: flow.hmin").
struct GivenOption {
  const CaseOption* option;
  OptionValue value;
  std::string where;
};

/// Applies options from one source (a file, a command line). What they contradict in `c` is dropped;
/// contradictions among themselves, and values out of range, are errors. Errors: kUsage.
void apply_options(Case& c, const std::vector<GivenOption>& given);

/// Reads the words of a command line as a value of the option. Errors: kUsage naming `where` and the wanted
/// type.
OptionValue parse_option(const CaseOption& option, const std::vector<std::string>& words,
                         const std::string& where);

/// Reads a case file. Relative paths stay relative to the current folder.
/// Errors: kFileMissing, kUsage naming file, line, key, and the nearest known key.
Case read_case(const std::filesystem::path& path);
/// The same from text; `name` is used in messages.
Case parse_case(const std::string& text, const std::string& name);

/// The case as a commented case file; options without a value appear as comments.
/// GUARANTEES parse_case(case_text(c)) gives every value back, doubles to the bit.
std::string case_text(const Case& c);

/// The options as a markdown table.
std::string options_markdown();

}  // namespace lamina
