#include "apps/cli/help.h"

#include "apps/pipeline/text.h"

namespace lamina::cli {
namespace {

constexpr std::size_t kColumn = 26, kWidth = 100;

}  // namespace

std::string HelpFormatter::make_option(const CLI::Option* option, bool positional) const {
  std::string name = positional ? option->get_name(true) : option->get_name(false, true);
  if (const std::string type = option->get_type_name(); !positional && !type.empty()) name += " " + type;
  std::string out = "  " + name;
  const std::string indent(kColumn, ' ');
  if (out.size() + 2 > kColumn)
    out.append("\n").append(indent);
  else
    out.resize(kColumn, ' ');
  return out + wrapped(option->get_description(), kWidth, indent, kColumn) + "\n";
}

}  // namespace lamina::cli
