#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/checkpoint.h"
#include "apps/pipeline/pipeline.h"
#include "core/error.h"

namespace lamina::cli {

void add_mesh(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("mesh", "Mesh the surroundings and the inside of a body with boundary layers");
  app->footer(
      "Example:\n"
      "  lamina mesh wing.stl --unit mm --velocity 30 --viscosity 1.5e-5 -o wing.vtu --report wing.json\n"
      "Exit codes: 0 done; 1 internal failure; 2 bad input; 3 mesh written, but a wanted property was "
      "missed.");
  struct State {
    explicit State(CLI::App& a) : flags(a, all_tables()) {}
    CaseFlags flags;
    std::string resume;
    bool markdown = false;
    [[nodiscard]] Case read() const {
      if (resume.empty()) return flags.read();
      if (!flags.case_word().empty())
        throw Error(ErrorCode::kUsage, "both --resume and --case are given: the folder holds the case");
      Case c = flags.read_over(read_case(checkpoint_case_path(resume)));
      c.checkpoint = resume;
      c.resume = true;
      return c;
    }
  };
  auto state = std::make_shared<State>(*app);
  app->add_flag("--help-markdown", state->markdown, "print the table of options as markdown")->group("");
  app->add_option(
         "--resume", state->resume,
         "folder of a run with --checkpoint: goes on from its last step, and makes the mesh that the "
         "run would have made")
      ->type_name("DIR");
  commands.push_back({app, [state] {
                        if (state->markdown) {
                          fmt::print("{}", options_markdown());
                          return kDone;
                        }
                        const Case c = state->read();
                        if (c.outputs.empty())
                          throw Error(ErrorCode::kUsage,
                                      "no output is given: name a mesh file with -o FILE.vtu");
                        Terminal terminal(state->flags.verbosity());
                        const Report report = run_case(c, &terminal);
                        fmt::print("{}", report_table(report));
                        for (const std::string& line : report.missed)
                          fmt::print(stderr, "lamina: missed: {}\n", line);
                        return report.missed.empty() ? kDone : kMissed;
                      }});
}

}  // namespace lamina::cli
