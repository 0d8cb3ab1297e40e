// The subcommands of `lamina`: each adds its options to the parser and says what to run when it was chosen.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <vector>

namespace lamina::cli {

/// Exit codes that scripts may rely on.
enum ExitCode : int { kDone = 0, kFailed = 1, kBadInput = 2, kMissed = 3, kInterruptedByUser = 130 };

struct Command {
  CLI::App* app;
  std::function<int()> run;  ///< returns the exit code; throws Error
};
using Commands = std::vector<Command>;

void add_mesh(CLI::App& root, Commands& commands);
void add_adapt(CLI::App& root, Commands& commands);
void add_plan(CLI::App& root, Commands& commands);
void add_levelset(CLI::App& root, Commands& commands);
void add_score(CLI::App& root, Commands& commands);
void add_view(CLI::App& root, Commands& commands);
void add_info(CLI::App& root, Commands& commands);
void add_sample(CLI::App& root, Commands& commands);
void add_convert(CLI::App& root, Commands& commands);
void add_bench(CLI::App& root, Commands& commands);
void add_completion(CLI::App& root, Commands& commands);

}  // namespace lamina::cli
