// Help texts wrapped to the width of a terminal.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lamina::cli {

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool positional) const override;
};

}  // namespace lamina::cli
