#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "vdb/profiles.h"
#include "vdb/shapes.h"
#include "vdb/surface_io.h"

namespace lamina::cli {
namespace {

struct State {
  std::string shape, out;
  ShapeOptions options;
  bool list = false;
};

void print_list(const char* title, const std::vector<std::pair<std::string, std::string>>& list) {
  fmt::print("{}\n", title);
  for (const auto& [name, help] : list) fmt::print("{:<10} {}\n", name, help);
}

int write_profile(const State& state) {
  const Outline outline = make_profile(state.shape, state.options.facet);
  const auto smooth = [](const OutlineCurve& c) { return c.smooth; };
  const bool aerofoil = lower_extension(state.out) == ".dat";
  if (aerofoil != std::any_of(outline.curves.begin(), outline.curves.end(), smooth))
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: {} is {}: write it as {}", state.out, state.shape,
                            aerofoil ? "a polyline" : "smooth", aerofoil ? ".csv" : ".dat"));
  check_writable(state.out);
  write_outline(state.out, outline, fmt::format("{} made by Lamina", state.shape));
  const Vec3 size = bounds(outline).size();
  fmt::print("{}: {} curves, {:g} x {:g} m\n", state.out, outline.curves.size(), size[0], size[1]);
  return kDone;
}

int run(const State& state) {
  if (state.list) {
    print_list("bodies (.stl):", shape_list());
    print_list("profiles (.dat, .csv):", profile_list());
    return kDone;
  }
  const bool profile = is_outline_file(state.out);
  std::vector<std::string> names;
  for (const auto& [name, help] : profile ? profile_list() : shape_list()) names.push_back(name);
  if (state.shape.empty())
    throw Error(ErrorCode::kUsage, fmt::format("no shape is given: name one of {}", join(names)));
  if (std::find(names.begin(), names.end(), state.shape) == names.end())
    throw Error(ErrorCode::kUsage, fmt::format("unknown shape {}{}; known are {}", state.shape,
                                               did_you_mean(state.shape, names), join(names)));
  if (state.out.empty()) throw Error(ErrorCode::kUsage, "no output is given: name a file with -o FILE.stl");
  if (profile) return write_profile(state);
  if (lower_extension(state.out) != ".stl")
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: a body is written as .stl, a profile as .dat or .csv", state.out));
  check_writable(state.out);
  Surface surface = make_shape(state.shape, state.options);
  const SurfaceReport report = clean(surface, state.shape);
  write_stl(state.out, surface);
  const Vec3 size = surface.bounds().size();
  fmt::print("{}: {} triangles, {:g} x {:g} x {:g} m, facet sag {:.3g} m\n", state.out, report.triangles,
             size[0], size[1], size[2], report.facet_sag);
  return kDone;
}

}  // namespace

void add_sample(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand(
      "sample", "Write a reference body as .stl, or a profile as .dat or .csv, in metres");
  app->footer(
      "Example:\n  lamina sample ahmed --slant 25 --facet 0.005 -o ahmed.stl\n  lamina sample naca0012 -o "
      "naca0012.dat");
  auto state = std::make_shared<State>();
  app->add_option("SHAPE", state->shape, "name of the body; --list shows them");
  app->add_option("-o,--out", state->out, "file to write")->type_name("FILE");
  app->add_option("--facet", state->options.facet,
                  "largest facet edge on curved parts (m; > 0; default: by shape)")
      ->type_name("X");
  app->add_option("--slant", state->options.slant_degrees,
                  "slant angle of ahmed (degrees; in [0, 40]; default: 25)")
      ->type_name("X");
  app->add_flag("--stilts", state->options.stilts, "ahmed stands on its four stilts");
  app->add_flag("--list", state->list, "list the shapes and their dimensions");
  commands.push_back({app, [state] { return run(*state); }});
}

}  // namespace lamina::cli
