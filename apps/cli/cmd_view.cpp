// `lamina view FILE`: a slice of a mesh, or the wall of a body, as a picture.
#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/picture.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/text.h"
#include "apps/pipeline/wall_picture.h"
#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"
#include "vdb/surface_io.h"

namespace lamina::cli {
namespace {

const std::vector<std::string> kBodyOptions = {"body.unit", "body.sheet", "body.grid", "body.iso",
                                               "levelset"};

struct State {
  explicit State(CLI::App& app) : body(app, kBodyOptions) {}
  CaseFlags body;
  std::string file, out, title;
  std::optional<std::string> color, plane, up;
  std::vector<std::string> window, from, look_at;
  std::optional<double> layer_top, zoom;
  int width = PictureOptions{}.width_px;
};

const std::vector<std::pair<std::string, PictureColor>> kColors = {{"quality", PictureColor::kQuality},
                                                                   {"region", PictureColor::kRegion},
                                                                   {"levels", PictureColor::kLevels},
                                                                   {"size", PictureColor::kSize},
                                                                   {"none", PictureColor::kPlain}};

const std::vector<std::pair<std::string, WallColor>> kWallColors = {{"curvature", WallColor::kCurvature},
                                                                    {"reliability", WallColor::kReliability},
                                                                    {"none", WallColor::kPlain}};

/// The levels of the layers as the resolved case beside the mesh says.
void set_levels_beside(const std::filesystem::path& mesh, PictureOptions& o) {
  std::filesystem::path path = mesh;
  path.replace_extension(".case.toml");
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) return;
  const Case c = read_case(path);
  if (!c.flow.h_min || !c.flow.layers || !c.flow.length) return;  // not a resolved case
  set_levels(o, resolve(c.flow, *c.flow.length), SizeOptions{}.mirrored_layers);
}

template <class Color>
Color color_of(const std::vector<std::pair<std::string, Color>>& colors,
               const std::optional<std::string>& wanted) {
  if (!wanted) return colors.front().second;
  std::vector<std::string> names;
  for (const auto& [known, color] : colors) {
    if (known == *wanted) return color;
    names.push_back(known);
  }
  throw Error(ErrorCode::kUsage, fmt::format("--color {}: must be one of {}{}", *wanted, join(names),
                                             did_you_mean(*wanted, names)));
}

template <std::size_t N>
std::array<double, N> numbers_of(const char* option, const std::vector<std::string>& words) {
  std::array<double, N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto number = parse_number(words[i]);
    if (!number)
      throw Error(ErrorCode::kUsage, fmt::format("{} {}: must be {} numbers", option, join(words, " "), N));
    out[i] = *number;
  }
  return out;
}

PictureOptions slice_options(const State& state) {
  PictureOptions o;
  if (state.plane) o.plane = parse_plane(*state.plane);
  o.color = color_of(kColors, state.color);
  o.title = state.title;
  o.width_px = state.width;
  if (state.layer_top)
    o.layer_top = *state.layer_top;
  else
    set_levels_beside(state.file, o);
  if (state.window.empty()) return o;
  const auto w = numbers_of<4>("--window", state.window);
  if (!(w[0] < w[2] && w[1] < w[3]))
    throw Error(ErrorCode::kUsage, fmt::format("--window {}: is empty; give U0 V0 U1 V1, lower corner first",
                                               join(state.window, " ")));
  o.window = w;
  return o;
}

WallPictureOptions wall_options(const State& state) {
  WallPictureOptions o;
  o.color = color_of(kWallColors, state.color);
  o.title = state.title;
  o.width_px = state.width;
  o.zoom = state.zoom.value_or(o.zoom);
  if (state.up) {
    const std::size_t axis = std::string_view("xyz").find(*state.up);
    if (state.up->size() != 1 || axis == std::string_view::npos)
      throw Error(ErrorCode::kUsage, fmt::format("--up {}: must be one of x, y, z", *state.up));
    o.up = static_cast<int>(axis);
  }
  if (!state.from.empty()) {
    const auto [azimuth, elevation] = numbers_of<2>("--from", state.from);
    o.azimuth = azimuth;
    o.elevation = elevation;
  }
  if (!state.look_at.empty()) {
    const auto [x, y, z] = numbers_of<3>("--look-at", state.look_at);
    o.look_at = {x, y, z};
  }
  return o;
}

/// Options of the other kind of file are refused: ignoring them would hide a mistake.
void check_kind(const State& state, bool body) {
  const auto refuse = [&](bool given, const char* option, const char* why) {
    if (given) throw Error(ErrorCode::kUsage, fmt::format("{}: {} {}", state.file, option, why));
  };
  constexpr const char* kSlices = "is for slices of meshes: this is a body, seen from outside";
  constexpr const char* kBodies = "is for bodies: a mesh is drawn as a slice";
  refuse(body && state.plane, "--plane", kSlices);
  refuse(body && !state.window.empty(), "--window", kSlices);
  refuse(body && state.layer_top, "--layer-top", kSlices);
  refuse(!body && !state.from.empty(), "--from", kBodies);
  refuse(!body && state.up, "--up", kBodies);
  refuse(!body && !state.look_at.empty(), "--look-at", kBodies);
  refuse(!body && state.zoom, "--zoom", kBodies);
  refuse(!body && state.body.given({"body", "levelset"}), "an option of bodies", kBodies);
}

int run(const State& state) {
  const std::string extension = lower_extension(state.out);
  if (extension != ".png" && extension != ".svg" && extension != ".pdf")
    throw Error(ErrorCode::kUsage, fmt::format("{}: a picture is written as .png, .svg or .pdf", state.out));
  const bool body = is_surface_file(state.file) || lower_extension(state.file) == ".vdb";
  check_kind(state, body);
  OutputSet outputs;
  outputs.expect(state.out, state.file);
  if (body) {
    const WallPictureOptions options = wall_options(state);
    Case c = state.body.read();
    c.body = state.file;
    const Body loaded = load_body(c, nullptr);
    outputs.write(state.out, [&](const auto& path) { draw_wall(path, loaded.level_set, options); });
  } else {
    const PictureOptions options = slice_options(state);
    const AnyMesh any = read_mesh(state.file);
    outputs.write(state.out, [&](const auto& path) {
      std::visit([&](const auto& mesh) { draw_slice(path, mesh, options); }, any);
    });
  }
  outputs.commit();
  return kDone;
}

}  // namespace

void add_view(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("view", "Draw a slice of a mesh, or a body coloured by its curvature");
  app->footer(
      "Of a mesh the wall is red, the top of the layers blue, levels far enough apart green, the last layer "
      "inside orange.\nExamples:\n"
      "  lamina view ahmed.vtu -o ahmed.png --plane y=0 --window -1.2 0 0.4 0.5 --color region --width 1600\n"
      "  lamina view ahmed.stl -o ahmed.png --from 215 25");
  auto state = std::make_shared<State>(*app);
  constexpr const char *kMeshes = "Slices of meshes", *kBodies = "Bodies seen from outside";
  app->add_option("FILE", state->file,
                  "a mesh (formats: lamina convert --help); a body: .stl, .obj, .ply or .vdb")
      ->required();
  app->add_option("-o,--out", state->out, "file to write: .png, .svg or .pdf")->required()->type_name("FILE");
  app->add_option(
         "--color", state->color,
         "of a mesh: quality | region | levels | size | none (default: quality); of a body: curvature | "
         "reliability | none (default: curvature)")
      ->type_name("NAME");
  app->add_option("--width", state->width, "width of the picture (pixels; in [200, 8000]; default: 1400)")
      ->type_name("N")
      ->check(CLI::Range(200, 8000));
  app->add_option("--title", state->title, "words above the picture")->type_name("TEXT");
  app->add_option("--plane", state->plane, "x=VALUE, y=VALUE or z=VALUE (m; default: y=0)")
      ->type_name("PLANE")
      ->group(kMeshes);
  app->add_option(
         "--window", state->window,
         "part of the plane, lower corner first; (u, v) = (y, z), (x, z) or (x, y) (m; default: all of it)")
      ->expected(4)
      ->type_name("U0 V0 U1 V1")
      ->group(kMeshes);
  app->add_option("--layer-top", state->layer_top,
                  "distance from the wall of the blue line (m; default: from the mesh's .case.toml)")
      ->type_name("X")
      ->group(kMeshes);
  app->add_option("--from", state->from,
                  "where the eye is: around the axis that points up (for z from +x to +y), and towards it "
                  "(degrees; default: 215 25)")
      ->expected(2)
      ->type_name("AZIMUTH ELEVATION")
      ->group(kBodies);
  app->add_option("--up", state->up, "axis that points up (x | y | z; default: z)")
      ->type_name("AXIS")
      ->group(kBodies);
  app->add_option("--look-at", state->look_at, "middle of the picture (m; default: the middle of the body)")
      ->expected(3)
      ->type_name("X Y Z")
      ->group(kBodies);
  app->add_option("--zoom", state->zoom, "enlargement (in [0.1, 1000]; default: 1)")
      ->type_name("X")
      ->group(kBodies);
  commands.push_back({app, [state] { return run(*state); }});
}

}  // namespace lamina::cli
