// The options of a case as command-line flags, made from the table of options.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/terminal.h"
#include "apps/pipeline/case.h"

namespace lamina::cli {

/// Adds the options of some tables, --case, --quiet and --verbose to a subcommand. Must live until it has
/// run.
class CaseFlags {
 public:
  /// Of `tables` an entry is a whole table ("flow") or one option ("mesh.threads").
  CaseFlags(CLI::App& app, const std::vector<std::string>& tables);
  CaseFlags(const CaseFlags&) = delete;
  CaseFlags& operator=(const CaseFlags&) = delete;

  /// The case file, if any, with the flags over it. Errors: kUsage, kFileMissing.
  [[nodiscard]] Case read() const;
  /// The flags over a case from elsewhere. Errors: kUsage.
  [[nodiscard]] Case read_over(Case c) const { return with_flags(std::move(c)); }
  /// The flags alone.
  [[nodiscard]] Case read_flags() const { return with_flags({}); }
  /// The word after --case.
  [[nodiscard]] const std::string& case_word() const { return case_file_; }
  [[nodiscard]] Verbosity verbosity() const;
  /// True when an option of one of these tables may have been given: as a flag, or by a case file.
  [[nodiscard]] bool given(const std::vector<std::string>& tables) const;

 private:
  struct Words {
    const CaseOption* option;
    CLI::Option* flag = nullptr;
    std::vector<std::string> words = {};
  };
  [[nodiscard]] Case with_flags(Case c) const;

  std::vector<Words> words_;
  std::string case_file_;
  bool quiet_ = false, verbose_ = false;
};

/// All tables of the case file.
std::vector<std::string> all_tables();

}  // namespace lamina::cli
