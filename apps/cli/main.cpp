// The command line of Lamina: parses, runs one subcommand, and turns every failure into one line and an exit
// code.
#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <new>

#include "apps/cli/command.h"
#include "apps/cli/help.h"
#include "apps/cli/terminal.h"
#include "apps/pipeline/report.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "mesh/seed.h"

namespace lamina::cli {
namespace {

/// "-.5" as "-0.5": the parser takes the former for a flag.
std::vector<std::string> arguments(int argc, char** argv) {
  std::vector<std::string> out(argv + 1, argv + argc);
  for (std::string& word : out)
    if (word.size() > 2 && word[0] == '-' && word[1] == '.' &&
        std::isdigit(static_cast<unsigned char>(word[2])) != 0)
      word.insert(1, "0");
  return out;
}

/// The parser's complaint, with the nearest known option or subcommand when one was mistyped.
std::string parse_message(const CLI::App& root, const CLI::ParseError& error) {
  const CLI::App* app = &root;
  if (const auto chosen = root.get_subcommands(); !chosen.empty()) app = chosen.front();
  std::vector<std::string> flags, commands;
  for (const CLI::Option* option : app->get_options())
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  for (const CLI::App* command : root.get_subcommands([](const CLI::App*) { return true; }))
    commands.push_back(command->get_name());
  const auto rest = root.remaining(true);
  if (app == &root && !rest.empty() && (rest.front().empty() || rest.front().front() != '-'))
    return fmt::format("unknown command {}{}; lamina --help lists them", rest.front(),
                       did_you_mean(rest.front(), commands));
  for (const std::string& word : rest)
    if (!word.empty() && word.front() == '-')
      return fmt::format("unknown option {}{}; lamina {}--help lists them", word, did_you_mean(word, flags),
                         app == &root ? "" : app->get_name() + " ");
  if (!rest.empty()) return fmt::format("unexpected argument {}", rest.front());
  // "--hmin: 1 required X missing"
  std::string what = error.what();
  const std::size_t colon = what.find(": "), required = what.find(" required "),
                    missing = what.find(" missing");
  if (colon != std::string::npos && required != std::string::npos && missing != std::string::npos)
    return fmt::format("{} needs {}", what.substr(0, colon),
                       what.substr(required + 10, missing - required - 10));
  return what;
}

void add_commands(CLI::App& root, Commands& commands) {
  add_mesh(root, commands);
  add_plan(root, commands);
  add_levelset(root, commands);
  add_adapt(root, commands);
  add_score(root, commands);
  add_view(root, commands);
  add_info(root, commands);
  add_sample(root, commands);
  add_convert(root, commands);
  add_bench(root, commands);
  add_completion(root, commands);
}

int run(int argc, char** argv) {
  CLI::App root("Anisotropic boundary-layer meshes of immersed bodies", "lamina");
  root.formatter(std::make_shared<HelpFormatter>());
  root.set_version_flag("--version", fmt::format("lamina {} (seed meshes: {})", version(),
                                                 have_tetgen() ? "tetgen, lattice" : "lattice"));
  root.footer(
      "lamina COMMAND --help tells the options of a command.\nExample:\n  lamina mesh body.stl -o body.vtu");
  root.require_subcommand(0, 1);
  Commands commands;
  add_commands(root, commands);
  std::vector<std::string> words = arguments(argc, argv);
  std::reverse(words.begin(), words.end());
  try {
    root.parse(words);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return root.exit(e);  // --help, --version
    print_error(parse_message(root, e));
    return kBadInput;
  }
  for (const Command& command : commands)
    if (command.app->parsed()) return command.run();
  fmt::print(stderr, "{}", root.help());
  return kBadInput;
}

int exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInternal:
    case ErrorCode::kMeshInvalid:
      return kFailed;
    case ErrorCode::kInterrupted:
      return kInterruptedByUser;
    default:
      return kBadInput;
  }
}

}  // namespace
}  // namespace lamina::cli

int main(int argc, char** argv) {
  using namespace lamina::cli;
  int code = kFailed;
  try {
    code = run(argc, argv);
  } catch (const lamina::Error& e) {
    print_error(e.what());
    code = exit_code(e.code());
  } catch (const std::bad_alloc&) {
    print_error("out of memory; a coarser case needs less: raise --hmin, --h2 or --voxel");
    code = kBadInput;
  } catch (const std::exception& e) {
    print_error(fmt::format("internal failure: {}", e.what()));
    code = kFailed;
  }
  // A full disk behind a redirected stdout must not pass for success.
  if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == kDone) {
    print_error("standard output cannot be written");
    code = kBadInput;
  }
  return code;
}
