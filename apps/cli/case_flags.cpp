#include "apps/cli/case_flags.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace lamina::cli {
namespace {

std::string described(const CaseOption& o) {
  const std::string notes = o.notes();
  return notes.empty() ? o.help : fmt::format("{} ({})", o.help, notes);
}

std::string value_name(const CaseOption& o) {
  switch (o.type) {
    case OptionType::kFlag:
      return "";
    case OptionType::kInteger:
      return "N";
    case OptionType::kReal:
      return "X";
    case OptionType::kChoice:
      return "NAME";
    case OptionType::kReals:
      if (o.count == 3) return "RADIUS LENGTH HEIGHT";
      return o.count == 6 ? "X0 Y0 Z0 X1 Y1 Z1" : "U0 V0 U1 V1";
    case OptionType::kText:
      return (o.table == "output" && o.key != "picture_plane") || o.key == "border" ? "FILE" : "TEXT";
    case OptionType::kTexts:
      if (o.count == 8) return "NAME X0 Y0 Z0 X1 Y1 Z1 SIZE";
      return o.table == "sizes" ? "FACE" : "FILE";
  }
  return {};
}

}  // namespace

CaseFlags::CaseFlags(CLI::App& app, const std::vector<std::string>& tables) {
  for (const CaseOption& o : case_options())
    if (std::any_of(tables.begin(), tables.end(),
                    [&](const std::string& t) { return t == o.table || t == o.table + "." + o.key; }))
      words_.push_back({.option = &o});
  // The parser keeps references to `words`: the vector is complete before the first is handed out.
  for (Words& w : words_) {
    const CaseOption& o = *w.option;
    const bool positional = o.flags.front() != '-';
    if (o.type == OptionType::kFlag) {
      w.flag = app.add_flag_callback(
          o.flags, [] {}, described(o));  // its count is all there is to it
    } else {
      w.flag = app.add_option(o.flags, w.words, described(o));
      const bool several = o.type == OptionType::kReals || o.type == OptionType::kTexts;
      w.flag->type_size(!several ? 1 : o.planar_count > 0 ? o.planar_count : o.count, several ? o.count : 1);
      w.flag->expected(1);
      w.flag->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
      w.flag->type_name(positional ? "" : value_name(o));
    }
    if (positional) continue;
    const auto& names = case_tables();
    const auto table =
        std::find_if(names.begin(), names.end(), [&](const auto& entry) { return entry.first == o.table; });
    w.flag->group(table->second);
  }
  app.add_option("--case", case_file_, "case file with any of these options; flags win over it")
      ->type_name("FILE.toml");
  auto* quiet = app.add_flag("-q,--quiet", quiet_, "no progress and no warnings on stderr");
  app.add_flag("-v,--verbose", verbose_, "more progress on stderr")->excludes(quiet);
}

Case CaseFlags::read() const { return with_flags(case_file_.empty() ? Case{} : read_case(case_file_)); }

Case CaseFlags::with_flags(Case c) const {
  std::vector<GivenOption> given;
  for (const Words& w : words_) {
    if (w.flag->count() == 0) continue;
    const std::string name = w.option->name();
    if (name.front() != '-' && w.words.size() > 1)
      throw Error(ErrorCode::kUsage,
                  fmt::format("unexpected argument {}: one {} is enough", w.words[1], name));
    std::vector<std::string> words = w.words;
    if (w.option->planar_count > 0) std::erase(words, "");  // the parser ends lists of any length with one
    if (name == "--domain" && words.front() == "c") {       // a shape by its name
      words.erase(words.begin());
      const auto c_shape = std::find_if(words_.begin(), words_.end(),
                                        [](const Words& o) { return o.option->name() == "--domain-c"; });
      given.push_back({c_shape->option, parse_option(*c_shape->option, words, "--domain c"), "--domain c"});
      continue;
    }
    given.push_back({w.option, parse_option(*w.option, words, name), name});
  }
  apply_options(c, given);
  return c;
}

bool CaseFlags::given(const std::vector<std::string>& tables) const {
  return !case_file_.empty() || std::any_of(words_.begin(), words_.end(), [&](const Words& w) {
    return w.flag->count() > 0 && std::find(tables.begin(), tables.end(), w.option->table) != tables.end();
  });
}

Verbosity CaseFlags::verbosity() const {
  if (quiet_) return Verbosity::kQuiet;
  return verbose_ ? Verbosity::kVerbose : Verbosity::kNormal;
}

std::vector<std::string> all_tables() {
  std::vector<std::string> out;
  for (const auto& [name, help] : case_tables()) out.push_back(name);
  return out;
}

}  // namespace lamina::cli
