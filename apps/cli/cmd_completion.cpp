// `lamina completion`: a bash completion script, made from the parser itself. The build installs its output.
#include <fmt/format.h>

#include "apps/cli/command.h"

namespace lamina::cli {
namespace {

std::string flags_of(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    for (const std::string& name : option->get_lnames()) out += (out.empty() ? "--" : " --") + name;
    for (const std::string& name : option->get_snames()) out += (out.empty() ? "-" : " -") + name;
  }
  return out;
}

std::string script(const CLI::App& root) {
  std::string commands, cases;
  for (const CLI::App* app : root.get_subcommands([](const CLI::App*) { return true; })) {
    if (app->get_group().empty()) continue;
    commands += (commands.empty() ? "" : " ") + app->get_name();
    cases += fmt::format("    {}) words=\"{}\" ;;\n", app->get_name(), flags_of(*app));
  }
  return fmt::format(
      "# bash completion for lamina; made by `lamina completion`.\n"
      "_lamina() {{\n"
      "  local word=\"${{COMP_WORDS[COMP_CWORD]}}\" before=\"${{COMP_WORDS[COMP_CWORD-1]}}\" words=\"\"\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
      "    COMPREPLY=($(compgen -W \"{} --help --version\" -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  case \"$before\" in\n"
      "    --regime) words=\"laminar turbulent\" ;;\n"
      "    --profile) words=\"layered continuous\" ;;\n"
      "    --seed) words=\"tetgen lattice\" ;;\n"
      "    --unit) words=\"m mm cm in ft\" ;;\n"
      "    --suite) words=\"adapt\" ;;\n"
      "    --color) words=\"quality region size none\" ;;\n"
      "  esac\n"
      "  if [ -n \"$words\" ]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  case \"${{COMP_WORDS[1]}}\" in\n{}  esac\n"
      "  if [[ \"$word\" == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      "  else\n"
      "    compopt -o filenames 2>/dev/null\n"
      "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
      "  fi\n"
      "}}\n"
      "complete -F _lamina lamina\n",
      commands, cases);
}

}  // namespace

void add_completion(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("completion", "Print a completion script for bash")->group("");
  app->footer("Example:\n  source <(lamina completion)");
  commands.push_back({app, [&root] {
                        fmt::print("{}", script(root));
                        return kDone;
                      }});
}

}  // namespace lamina::cli
