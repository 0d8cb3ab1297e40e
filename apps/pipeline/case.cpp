#include "apps/pipeline/case.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <toml.hpp>

#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"

namespace lamina {
namespace {

[[noreturn]] void reject(const std::string& message) { throw Error(ErrorCode::kUsage, message); }

std::string wanted(const CaseOption& o) {
  switch (o.type) {
    case OptionType::kFlag:
      return "true or false";
    case OptionType::kInteger:
      return "a whole number";
    case OptionType::kReal:
      return "a number";
    case OptionType::kText:
      return "a text";
    case OptionType::kChoice:
      return fmt::format("one of {}", join(o.choices));
    case OptionType::kReals:
      return fmt::format("{} numbers{}", o.count,
                         o.planar_count > 0 ? fmt::format(", or {} in two dimensions", o.planar_count) : "");
    case OptionType::kTexts:
      if (o.planar_count > 0)
        return fmt::format("{} words each time, or {} in two dimensions", o.count, o.planar_count);
      return o.count > 1 ? fmt::format("{} words each time", o.count) : "one or more texts";
  }
  return {};
}

void check_range(const CaseOption& o, double value, const std::string& where) {
  if (o.off == value) return;
  const bool low = o.lo_open ? !(value > o.lo) : !(value >= o.lo);
  const bool high = o.hi_open ? !(value < o.hi) : !(value <= o.hi);
  if (low || high || !std::isfinite(value))
    reject(fmt::format("{} = {} is out of range: must be {}", where, shortest(value), o.range_text()));
}

void check_value(const GivenOption& g) {
  const CaseOption& o = *g.option;
  if (const auto* integer = std::get_if<std::int64_t>(&g.value)) {
    check_range(o, static_cast<double>(*integer), g.where);
  } else if (const auto* real = std::get_if<double>(&g.value)) {
    check_range(o, *real, g.where);
  } else if (const auto* reals = std::get_if<std::vector<double>>(&g.value)) {
    for (const double x : *reals) check_range(o, x, g.where);
    // Lists of numbers are boxes, lower corner first, but for the three of --domain-c.
    const std::size_t half = reals->size() % 2 == 0 ? reals->size() / 2 : 0;
    for (std::size_t i = 0; i < half; ++i)
      if (!((*reals)[i] < (*reals)[half + i]))
        reject(fmt::format("{} is an empty box: {} must be below {} (number {} below number {})", g.where,
                           shortest((*reals)[i]), shortest((*reals)[half + i]), i + 1, half + i + 1));
  } else if (const auto* text = std::get_if<std::string>(&g.value); text && o.type == OptionType::kChoice) {
    if (std::find(o.choices.begin(), o.choices.end(), *text) == o.choices.end())
      reject(fmt::format("{} = {}: must be {}{}", g.where, *text, wanted(o), did_you_mean(*text, o.choices)));
  }
}

// ---- case file, in ----

/// Whether an option takes so many numbers, or words of each text.
bool fits(const CaseOption& o, std::size_t count) {
  return count == static_cast<std::size_t>(o.count) ||
         (o.planar_count > 0 && count == static_cast<std::size_t>(o.planar_count));
}

/// The words of a command line as texts of several words. Where their number may vary, each begins with a
/// name and goes on with numbers. Empty where they do not fit.
std::vector<std::string> texts_of(const CaseOption& o, const std::vector<std::string>& words) {
  std::vector<std::vector<std::string>> texts;
  for (const std::string& word : words) {
    const bool starts = texts.empty() ||
                        (o.planar_count > 0 ? !parse_number(word).has_value() : fits(o, texts.back().size()));
    if (starts) texts.emplace_back();
    texts.back().push_back(word);
  }
  std::vector<std::string> out;
  for (const auto& text : texts) {
    // A single one with a word in a number's place is left to those who read it.
    if (!fits(o, text.size()))
      return fits(o, words.size()) ? std::vector<std::string>{join(words, " ")} : std::vector<std::string>();
    out.push_back(join(text, " "));
  }
  return out;
}

std::string place(const std::string& file, const toml::value& value) {
  return fmt::format("{}:{}", file, value.location().line());
}

/// What a value is, in the words of wanted().
std::string kind(const toml::value& v) {
  switch (v.type()) {
    case toml::value_t::integer:
      return "a whole number";
    case toml::value_t::floating:
      return "a number with a fraction";
    case toml::value_t::string:
      return "a text";
    case toml::value_t::array:
      return "a list";
    case toml::value_t::table:
      return "a table";
    case toml::value_t::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

double real_of(const toml::value& v, const std::string& where, const CaseOption& o) {
  if (v.is_integer()) return static_cast<double>(v.as_integer());
  if (v.is_floating()) return v.as_floating();
  reject(fmt::format("{}: must be {}, not {}", where, wanted(o), kind(v)));
}

std::string text_of(const toml::value& v, const std::string& where, const CaseOption& o) {
  if (v.is_string()) return v.as_string().str;
  reject(fmt::format("{}: must be {}, not {}", where, wanted(o), kind(v)));
}

OptionValue value_of(const toml::value& v, const CaseOption& o, const std::string& where) {
  switch (o.type) {
    case OptionType::kFlag:
      if (!v.is_boolean()) reject(fmt::format("{}: must be {}, not {}", where, wanted(o), kind(v)));
      return v.as_boolean();
    case OptionType::kInteger:
      if (!v.is_integer()) reject(fmt::format("{}: must be {}, not {}", where, wanted(o), kind(v)));
      return std::int64_t{v.as_integer()};
    case OptionType::kReal:
      return real_of(v, where, o);
    case OptionType::kText:
    case OptionType::kChoice:
      return text_of(v, where, o);
    case OptionType::kReals: {
      std::vector<double> reals;
      if (v.is_array())
        for (const toml::value& x : v.as_array()) reals.push_back(real_of(x, where, o));
      if (!v.is_array() || !fits(o, reals.size()))
        reject(fmt::format("{}: must be a list of {}", where, wanted(o)));
      return reals;
    }
    case OptionType::kTexts: {
      if (!v.is_array()) return std::vector<std::string>{text_of(v, where, o)};
      std::vector<std::string> texts;
      for (const toml::value& x : v.as_array()) texts.push_back(text_of(x, where, o));
      return texts;
    }
  }
  return {};
}

/// The keys of a table, or all tables when `table` is empty.
std::vector<std::string> known_names(const std::string& table) {
  std::vector<std::string> names;
  if (table.empty())
    for (const auto& [name, help] : case_tables()) names.push_back(name);
  else
    for (const CaseOption& o : case_options())
      if (o.table == table) names.push_back(o.key);
  return names;
}

/// Entries of a table in the order of the file, so that the first mistake is the one reported.
std::vector<std::pair<std::string, toml::value>> in_order(const toml::value& table) {
  std::vector<std::pair<std::string, toml::value>> entries(table.as_table().begin(), table.as_table().end());
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    const auto la = a.second.location(), lb = b.second.location();
    return std::make_tuple(la.line(), la.column(), a.first) <
           std::make_tuple(lb.line(), lb.column(), b.first);
  });
  return entries;
}

/// A key outside its table: says in which table it belongs, if any.
std::string belongs_to(const std::string& key) {
  for (const CaseOption& o : case_options())
    if (o.key == key) return fmt::format(" (it belongs into [{}])", o.table);
  return {};
}

void collect(const toml::value& root, const std::string& file, std::vector<GivenOption>& given) {
  for (const auto& [table, content] : in_order(root)) {
    const std::vector<std::string> tables = known_names("");
    if (std::find(tables.begin(), tables.end(), table) == tables.end())
      reject(fmt::format("{}: unknown {} {}{}", place(file, content), content.is_table() ? "table" : "key",
                         table, content.is_table() ? did_you_mean(table, tables) : belongs_to(table)));
    if (!content.is_table())
      reject(fmt::format("{}: {} must be a table: [{}]", place(file, content), table, table));
    for (const auto& [key, value] : in_order(content)) {
      const auto option =
          std::find_if(case_options().begin(), case_options().end(),
                       [&, &t = table, &k = key](const CaseOption& o) { return o.table == t && o.key == k; });
      const std::string where = fmt::format("{}: {}.{}", place(file, value), table, key);
      if (option == case_options().end()) {
        const std::string near = did_you_mean(key, known_names(table));
        reject(fmt::format("{}: unknown key{}", where, near.empty() ? belongs_to(key) : near));
      }
      given.push_back({&*option, value_of(value, *option, where), where});
    }
  }
}

/// The line of a syntax error: toml11 puts it into its drawing, "\n 12 | text".
std::string syntax_message(const std::string& file, const std::string& what) {
  std::string first = what.substr(0, what.find('\n'));
  if (const auto end_of_tag = first.find("] "); end_of_tag != std::string::npos)
    first.erase(0, end_of_tag + 2);
  if (first.rfind("toml::", 0) == 0)
    if (const auto colon = first.find(": "); colon != std::string::npos) first.erase(0, colon + 2);
  for (std::size_t at = what.find('\n'); at != std::string::npos; at = what.find('\n', at + 1)) {
    std::size_t digit = what.find_first_not_of(' ', at + 1);
    int line = 0;
    if (digit == std::string::npos) break;
    const auto [rest, error] = std::from_chars(what.data() + digit, what.data() + what.size(), line);
    if (error == std::errc() && std::string_view(rest).substr(0, 2) == " |")
      return fmt::format("{}:{}: not valid TOML: {}", file, line, first);
  }
  return fmt::format("{}: not valid TOML: {}", file, first);
}

// ---- case file, out ----

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    else
      out += c;
  }
  return out + "\"";
}

struct TomlText {
  std::string operator()(bool v) const { return v ? "true" : "false"; }
  std::string operator()(std::int64_t v) const { return std::to_string(v); }
  std::string operator()(double v) const {
    std::string s = shortest(v);
    // A number beyond the range of TOML's integers must look like a float.
    if (s.find_first_of(".e") == std::string::npos) s += ".0";
    return s;
  }
  std::string operator()(const std::string& v) const { return quoted(v); }
  template <class T>
  std::string operator()(const std::vector<T>& v) const {
    std::vector<std::string> words;
    for (const T& x : v) words.push_back((*this)(x));
    return fmt::format("[{}]", join(words));
  }
};

}  // namespace

double unit_scale(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMetre:
      return 1.0;
    case LengthUnit::kMillimetre:
      return 1e-3;
    case LengthUnit::kCentimetre:
      return 1e-2;
    case LengthUnit::kInch:
      return 0.0254;
    case LengthUnit::kFoot:
      return 0.3048;
  }
  return 1.0;
}

Plane parse_plane(std::string_view text) {
  std::string packed;
  for (const char c : text)
    if (c != ' ') packed += c;
  const std::size_t axis = packed.empty() ? std::string::npos : std::string_view("xyz").find(packed[0]);
  if (axis != std::string::npos && packed.size() > 2 && packed[1] == '=')
    if (const auto offset = parse_number(std::string_view(packed).substr(2)))
      return {static_cast<int>(axis), *offset};
  reject(fmt::format("{}: not a plane; give x=VALUE, y=VALUE or z=VALUE, for example y=0", text));
}

std::string plane_text(const Plane& plane) {
  return fmt::format("{}={}", "xyz"[plane.axis], shortest(plane.offset));
}

std::string CaseOption::name() const {
  const std::size_t comma = flags.find(',');
  return comma == std::string::npos ? flags : flags.substr(comma + 1);
}

std::string CaseOption::range_text() const {
  if (type == OptionType::kChoice) return join(choices, " | ");
  const bool low = std::isfinite(lo), high = std::isfinite(hi) && hi < 1e300;
  if (low && high)
    return fmt::format("{}in {}{:g}, {:g}{}", off ? fmt::format("{:g} or ", *off) : "", lo_open ? '(' : '[',
                       lo, hi, hi_open ? ')' : ']');
  if (low) return fmt::format("{} {:g}", lo_open ? ">" : ">=", lo);
  if (high) return fmt::format("{} {:g}", hi_open ? "<" : "<=", hi);
  return type == OptionType::kReal || type == OptionType::kReals ? "finite" : "";
}

std::string CaseOption::notes() const {
  std::vector<std::string> parts;
  if (!unit.empty()) parts.push_back(unit);
  if (const std::string range = range_text(); !range.empty() && range != "finite") parts.push_back(range);
  if (!default_value.empty()) parts.push_back(fmt::format("default: {}", default_value));
  return join(parts, "; ");
}

void apply_options(Case& c, const std::vector<GivenOption>& given) {
  for (const GivenOption& g : given) {
    check_value(g);
    for (const GivenOption& other : given) {
      if (&other == &g) continue;
      if (other.option == g.option) reject(fmt::format("{} is given twice ({})", g.where, other.where));
      const auto& r = g.option->replaces;
      if (other.option->table == g.option->table &&
          std::find(r.begin(), r.end(), other.option->key) != r.end())
        reject(fmt::format("{} contradicts {}: give one of them", g.where, other.where));
    }
  }
  for (const GivenOption& g : given) {
    // What is given now wins over what an earlier source said about the same thing.
    for (const CaseOption& o : case_options()) {
      const auto& r = g.option->replaces;
      if (o.table == g.option->table && o.clear && std::find(r.begin(), r.end(), o.key) != r.end())
        o.clear(c);
    }
    g.option->set(c, g.value);
  }
}

OptionValue parse_option(const CaseOption& option, const std::vector<std::string>& words,
                         const std::string& where) {
  const auto number = [&](const std::string& word) {
    const auto value = parse_number(word);
    if (!value) reject(fmt::format("{} {}: must be {}", where, join(words, " "), wanted(option)));
    return *value;
  };
  if (option.type == OptionType::kFlag) return true;  // a flag has no words
  const auto texts = option.type == OptionType::kTexts ? texts_of(option, words) : std::vector<std::string>();
  if (option.type == OptionType::kTexts ? texts.empty() : !fits(option, words.size()))
    reject(fmt::format("{} {}: needs {}, {} given", where, join(words, " "), wanted(option), words.size()));
  switch (option.type) {
    case OptionType::kFlag:
      break;
    case OptionType::kInteger: {
      const double value = number(words[0]);
      if (value != std::floor(value) || std::abs(value) > 9e15)
        reject(fmt::format("{} {}: must be {}", where, words[0], wanted(option)));
      return static_cast<std::int64_t>(value);
    }
    case OptionType::kReal:
      return number(words[0]);
    case OptionType::kText:
    case OptionType::kChoice:
      return words[0];
    case OptionType::kReals: {
      std::vector<double> reals;
      for (const std::string& word : words) reals.push_back(number(word));
      return reals;
    }
    case OptionType::kTexts:
      return texts;
  }
  return {};
}

Case parse_case(const std::string& text, const std::string& name) {
  toml::value root;
  std::istringstream stream(text);
  try {
    root = toml::parse(stream, name);
  } catch (const std::exception& e) {
    reject(syntax_message(name, e.what()));
  }
  std::vector<GivenOption> given;
  collect(root, name, given);
  Case c;
  apply_options(c, given);
  return c;
}

Case read_case(const std::filesystem::path& path) {
  const MappedFile file(path);
  constexpr std::size_t kLargestCase = 1 << 20;  // a case is a page; a megabyte is a wrong file
  if (file.bytes().size() > kLargestCase)
    reject(fmt::format("{}: {} bytes is too large for a case file", path.string(), file.bytes().size()));
  Case c = parse_case(std::string(file.bytes()), path.string());
  c.source = path;
  return c;
}

std::string case_text(const Case& c) {
  constexpr std::size_t kWidth = 110;
  std::string out =
      "# Lamina case file: lamina mesh --case FILE. Flags on the command line win over what stands here.\n"
      "# Lengths in metres (the body's own unit when body.unit is \"m\"); paths from the current folder.\n";
  for (const auto& [table, help] : case_tables()) {
    out += fmt::format("\n# {}.\n[{}]\n", help, table);
    for (const CaseOption& o : case_options()) {
      if (o.table != table) continue;
      const std::string notes = o.notes();
      const std::string line = notes.empty() ? o.help : fmt::format("{} ({})", o.help, notes);
      out += fmt::format("# {}\n", wrapped(line, kWidth, "# ", 2));
      const auto value = o.get(c);
      out += value ? fmt::format("{} = {}\n", o.key, std::visit(TomlText(), *value))
                   : fmt::format("# {} =\n", o.key);
    }
  }
  return out;
}

std::string options_markdown() {
  const auto cell = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2)
      text.insert(at, 1, '\\');
    return text;
  };
  std::string out = "| flag | case file | unit | range | default | meaning |\n|---|---|---|---|---|---|\n";
  for (const CaseOption& o : case_options())
    out += fmt::format("| `{}` | `{}.{}` | {} | {} | {} | {} |\n", o.flags, o.table, o.key, cell(o.unit),
                       cell(o.range_text() == "finite" ? "" : o.range_text()), cell(o.default_value),
                       cell(o.help));
  return out;
}

}  // namespace lamina
