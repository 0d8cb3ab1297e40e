// `lamina view MESH`: a slice of a mesh as a picture.
#include <fmt/format.h>

#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/picture.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"

namespace lamina::cli {
namespace {

struct State {
  std::string mesh, out, plane = "y=0", color = "quality", title;
  std::vector<std::string> window;
  std::optional<double> layer_top;
  int width = PictureOptions{}.width_px;
};

const std::vector<std::pair<std::string, PictureColor>> kColors = {{"quality", PictureColor::kQuality},
                                                                   {"region", PictureColor::kRegion},
                                                                   {"size", PictureColor::kSize},
                                                                   {"none", PictureColor::kPlain}};

/// The top of the layers as the resolved case beside the mesh says; 0 when there is none.
double layer_top_beside(const std::filesystem::path& mesh) {
  std::filesystem::path path = mesh;
  path.replace_extension(".case.toml");
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) return 0.0;
  const Case c = read_case(path);
  if (!c.flow.h_min || !c.flow.layers || !c.flow.length) return 0.0;  // not a resolved case
  return resolve(c.flow, *c.flow.length).top();
}

PictureColor color_of(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& [known, color] : kColors) {
    if (known == name) return color;
    names.push_back(known);
  }
  throw Error(ErrorCode::kUsage,
              fmt::format("--color {}: must be one of {}{}", name, join(names), did_you_mean(name, names)));
}

PictureOptions options_of(const State& state) {
  PictureOptions o;
  o.plane = parse_plane(state.plane);
  o.color = color_of(state.color);
  o.title = state.title;
  o.width_px = state.width;
  o.layer_top = state.layer_top ? *state.layer_top : layer_top_beside(state.mesh);
  if (state.window.empty()) return o;
  std::array<double, 4> w{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = parse_number(state.window[i]);
    if (!number)
      throw Error(ErrorCode::kUsage, fmt::format("--window {}: must be 4 numbers", join(state.window, " ")));
    w[i] = *number;
  }
  if (!(w[0] < w[2] && w[1] < w[3]))
    throw Error(ErrorCode::kUsage, fmt::format("--window {}: is empty; give U0 V0 U1 V1, lower corner first",
                                               join(state.window, " ")));
  o.window = w;
  return o;
}

int run(const State& state) {
  const PictureOptions options = options_of(state);
  const std::string extension = lower_extension(state.out);
  if (extension != ".png" && extension != ".svg" && extension != ".pdf")
    throw Error(ErrorCode::kUsage, fmt::format("{}: a picture is written as .png, .svg or .pdf", state.out));
  OutputSet outputs;
  outputs.expect(state.out, state.mesh);
  const AnyMesh any = read_mesh(state.mesh);
  outputs.write(state.out, [&](const auto& path) {
    std::visit([&](const auto& mesh) { draw_slice(path, mesh, options); }, any);
  });
  outputs.commit();
  return kDone;
}

}  // namespace

void add_view(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("view", "Draw a slice of a mesh: the wall red, the top of the layers blue");
  app->footer(
      "Example:\n"
      "  lamina view ahmed.vtu -o ahmed.png --plane y=0 --window -1.2 0 0.4 0.5 --color region --width 1600");
  auto state = std::make_shared<State>();
  app->add_option("MESH", state->mesh, ".vtu (with fields), .mesh or .meshb")->required();
  app->add_option("-o,--out", state->out, "file to write: .png, .svg or .pdf")->required()->type_name("FILE");
  app->add_option("--plane", state->plane, "x=VALUE, y=VALUE or z=VALUE (m; default: y=0)")
      ->type_name("PLANE");
  app->add_option(
         "--window", state->window,
         "part of the plane, lower corner first; (u, v) = (y, z), (x, z) or (x, y) (m; default: all of it)")
      ->expected(4)
      ->type_name("U0 V0 U1 V1");
  app->add_option("--color", state->color, "quality | region | size | none (default: quality)")
      ->type_name("NAME");
  app->add_option("--width", state->width, "width of the picture (pixels; in [200, 8000]; default: 1400)")
      ->type_name("N")
      ->check(CLI::Range(200, 8000));
  app->add_option("--layer-top", state->layer_top,
                  "distance from the wall of the blue line (m; default: from MESH's .case.toml)")
      ->type_name("X");
  app->add_option("--title", state->title, "words above the picture")->type_name("TEXT");
  commands.push_back({app, [state] { return run(*state); }});
}

}  // namespace lamina::cli
