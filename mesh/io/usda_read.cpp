// A scanner of the text form: prims with properties are walked through, values that are not wanted passed
// over by their brackets and quotes.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "mesh/io/raw.h"
#include "mesh/io/text.h"
#include "mesh/io/usda.h"

namespace lamina::io {
namespace {

/// Numbers of one value of that type (3 of point3f); 0: it has none that a mesh could hold.
int width_of(std::string_view type) {
  static const std::map<std::string_view, int> kOnes = {{"half", 1}, {"float", 1}, {"double", 1}, {"int", 1},
                                                        {"uint", 1}, {"int64", 1}, {"uchar", 1}};
  static const std::map<std::string_view, int> kRoles = {{"point3", 3},   {"vector3", 3}, {"normal3", 3},
                                                         {"color3", 3},   {"color4", 4},  {"texCoord2", 2},
                                                         {"texCoord3", 3}};
  if (const auto one = kOnes.find(type); one != kOnes.end()) return 1;
  if (type.empty()) return 0;
  const char last = type.back();
  const std::string_view front = type.substr(0, type.size() - 1);
  if (last >= '2' && last <= '4' && kOnes.count(front) > 0) return last - '0';
  const auto role = kRoles.find(front);
  return role != kRoles.end() && (last == 'f' || last == 'd' || last == 'h') ? role->second : 0;
}

struct Metadata {
  std::string display_name, interpolation;
  std::int64_t element_size = 1;
};

struct Subset {
  std::string name, element;
  std::vector<double> indices;
  std::optional<Index> tag;
  std::string place;
};

struct Primvar {
  std::string name;
  int width = 1;
  std::vector<double> values;
  Metadata about;
  std::string place;
};

class UsdaReader {
 public:
  explicit UsdaReader(const Source& source) : source_(source) {}

  AnyMesh read() {
    if (source_.bytes.substr(0, 8) == "PXR-USDC")
      fail_unsupported(source_, "is binary USD (crate); usdcat writes it as .usda");
    if (source_.bytes.substr(0, 5) != "#usda") fail("a .usda file starts with #usda");
    skip();
    if (peek() == '(') pass_value();
    while (at_ < source_.bytes.size()) prim();
    if (!found_) fail_unsupported(source_, "has no TetMesh");
    return assemble(finish(), source_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { fail_format(source_, line_of(source_, at_), what); }

  [[nodiscard]] char peek() const { return at_ < source_.bytes.size() ? source_.bytes[at_] : '\0'; }

  /// Passes blanks, semicolons and comments.
  void skip() {
    for (; at_ < source_.bytes.size(); ++at_) {
      const char c = source_.bytes[at_];
      if (c == '#')
        at_ = std::min(source_.bytes.find('\n', at_), source_.bytes.size() - 1);
      else if (c != ' ' && c != '\t' && c != '\n' && c != '\r' && c != ';')
        return;
    }
  }

  bool take(char c) {
    if (peek() != c) return false;
    ++at_;
    skip();
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail(fmt::format("expected '{}', found \"{}\"", c, shown(source_.bytes.substr(at_, 20))));
  }

  /// Letters, digits and what joins names and types.
  std::string_view word() {
    const std::size_t begin = at_;
    const auto belongs = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
             c == ':' || c == '.' || c == '-' || c == '+';
    };
    while (at_ < source_.bytes.size() && belongs(source_.bytes[at_])) ++at_;
    if (at_ == begin)
      fail(fmt::format("expected a word, found \"{}\"", shown(source_.bytes.substr(at_, 20))));
    const std::string_view found = source_.bytes.substr(begin, at_ - begin);
    skip();
    return found;
  }

  std::string string() {
    const char quote = peek();
    if (quote != '"' && quote != '\'') fail("expected a string");
    const std::string three(3, quote);
    const bool is_long = source_.bytes.substr(at_, 3) == three;
    const std::size_t begin = at_;
    at_ += is_long ? 3 : 1;
    std::string text;
    for (;;) {
      if (at_ >= source_.bytes.size() || (!is_long && source_.bytes[at_] == '\n')) {
        at_ = begin;
        fail("a string without an end");
      }
      const char c = source_.bytes[at_];
      if (is_long ? source_.bytes.substr(at_, 3) == three : c == quote) break;
      if (c == '\\' && at_ + 1 < source_.bytes.size()) ++at_;
      text += source_.bytes[at_++];
    }
    at_ += is_long ? 3 : 1;
    skip();
    return text;
  }

  /// Passes what lies between two delimiters that are the same character.
  void pass_quoted(char c) {
    const std::size_t end = source_.bytes.find(c, at_ + 1);
    if (end == std::string_view::npos) fail(fmt::format("a {} without an end", c));
    at_ = end + 1;
    skip();
  }

  /// Passes a value with all that is nested in it.
  void pass_value() {
    std::string open;  // the brackets that wait for their end
    const std::size_t begin = at_;
    do {
      const char c = peek();
      if (c == '"' || c == '\'') {
        string();
      } else if (c == '@') {
        pass_quoted('@');
      } else if (c == '<') {
        pass_quoted('>');
      } else if (c == '[' || c == '(' || c == '{') {
        open += c == '[' ? ']' : c == '(' ? ')' : '}';
        take(c);
      } else if (!open.empty() && c == open.back()) {
        open.pop_back();
        take(c);
      } else if (!open.empty() && (c == ',' || c == '=' || c == ':')) {
        take(c);
      } else if (c == '\0') {
        at_ = begin;
        fail("a value without an end");
      } else {
        word();
      }
    } while (!open.empty());
  }

  double number() {
    const std::string_view text = word();
    double v = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
    if (error != std::errc() || end != text.data() + text.size())
      fail(fmt::format("\"{}\" is no number", shown(text)));
    return v;
  }

  /// An array of numbers or of tuples of so many.
  std::vector<double> array(int width) {
    std::vector<double> values;
    expect('[');
    while (!take(']')) {
      if (width > 1) expect('(');
      for (int k = 0; k < width; ++k) {
        if (k > 0) expect(',');
        values.push_back(number());
      }
      if (width > 1) expect(')');
      if (peek() != ']') expect(',');
    }
    return values;
  }

  Metadata metadata() {
    Metadata about;
    if (!take('(')) return about;
    while (!take(')')) {
      if (peek() == '"' || peek() == '\'') {  // a comment
        string();
        continue;
      }
      std::string_view key = word();
      if (key == "prepend" || key == "append" || key == "delete" || key == "add" || key == "reorder")
        key = word();
      expect('=');
      if (key == "displayName")
        about.display_name = string();
      else if (key == "interpolation")
        about.interpolation = string();
      else if (key == "elementSize")
        about.element_size = static_cast<std::int64_t>(std::clamp(number(), 0.0, 1e9));
      else
        pass_value();
    }
    return about;
  }

  /// `def`, `over` or `class` with its body.
  void prim() {
    const std::string_view kind = word();
    if (kind != "def" && kind != "over" && kind != "class")
      fail(fmt::format("expected def, over or class, found \"{}\"", shown(kind)));
    const std::string type = peek() == '"' || peek() == '\'' ? std::string() : std::string(word());
    Subset subset;
    subset.place = line_of(source_, at_);
    subset.name = string();
    const Metadata about = metadata();
    if (!about.display_name.empty()) subset.name = about.display_name;
    const bool is_mesh = type == "TetMesh" && kind == "def";
    if (is_mesh && found_) fail_unsupported(source_, "has several TetMeshes; one is read");
    found_ = found_ || is_mesh;
    const bool is_subset = in_mesh_ && type == "GeomSubset";
    constexpr int kDeepest = 64;
    if (++depth_ > kDeepest) fail("prims are nested too deeply");
    const bool outer = std::exchange(in_mesh_, is_mesh);
    expect('{');
    while (!take('}')) {
      const std::size_t begin = at_;
      const std::string_view first = word();
      if (first == "def" || first == "over" || first == "class") {
        at_ = begin;
        prim();
      } else if (first == "variantSet") {
        string();
        expect('=');
        pass_value();
      } else if (first == "reorder") {
        word();
        expect('=');
        pass_value();
      } else {
        at_ = begin;
        property(is_mesh, is_subset ? &subset : nullptr);
      }
    }
    in_mesh_ = outer;
    --depth_;
    if (is_subset) subsets_.push_back(std::move(subset));
  }

  /// NAME of primvars:NAME:indices, else nothing.
  static std::string_view indexed_primvar(std::string_view name) {
    constexpr std::string_view kHead = "primvars:", kTail = ":indices";
    if (name.size() <= kHead.size() + kTail.size() || name.substr(0, kHead.size()) != kHead ||
        name.substr(name.size() - kTail.size()) != kTail)
      return {};
    return name.substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  }

  void property(bool of_mesh, Subset* subset) {
    static const std::vector<std::string_view> kBefore = {"custom",  "uniform", "varying", "config",
                                                          "prepend", "append",  "delete",  "add"};
    std::string_view type = word();
    while (std::find(kBefore.begin(), kBefore.end(), type) != kBefore.end()) type = word();
    const bool is_array = take('[');
    if (is_array) expect(']');
    const std::string place = line_of(source_, at_);
    const std::string_view name = word();
    const bool holds = take('=');
    const int width = width_of(type);
    const bool primvar = of_mesh && name.substr(0, 9) == "primvars:" && is_array && width > 0 &&
                         name.find(':', 9) == std::string_view::npos &&
                         name.find('.') == std::string_view::npos;
    if (!holds) {
      metadata();
    } else if (of_mesh && (name == "points.timeSamples" || name == "tetVertexIndices.timeSamples")) {
      fail_unsupported(source_, fmt::format("has {}: a mesh that changes with time", name));
    } else if (name == "xformOpOrder") {
      const std::size_t begin = at_;
      pass_value();
      if (source_.bytes.substr(begin, at_ - begin).find('"') != std::string_view::npos)
        fail_unsupported(source_, "has a transform (xformOpOrder), which is not applied; flatten it");
      metadata();
    } else if (of_mesh && name == "points") {
      points_ = array(3);
      metadata();
    } else if (of_mesh && name == "tetVertexIndices") {
      raw_.tets.place = place;
      raw_.tets.cells = simplices<4>(place);
    } else if (of_mesh && name == "surfaceFaceVertexIndices") {
      raw_.triangles.place = place;
      raw_.triangles.cells = simplices<3>(place);
    } else if (of_mesh && name == "orientation") {
      left_handed_ = string() == "leftHanded";
      metadata();
    } else if (subset != nullptr && name == "elementType") {
      subset->element = string();
      metadata();
    } else if (subset != nullptr && name == "indices" && is_array) {
      subset->indices = array(1);
      metadata();
    } else if (subset != nullptr && name == "tag" && !is_array) {
      subset->tag = integer(number(), place);
      metadata();
    } else if (const std::string_view indexed = of_mesh && is_array ? indexed_primvar(name) : "";
               !indexed.empty() && peek() == '[') {
      indices_[std::string(indexed)] = array(1);
      metadata();
    } else if (primvar && peek() == '[') {
      Primvar p;
      p.place = place;
      p.name = name.substr(9);
      p.width = width;
      p.values = array(width);
      p.about = metadata();
      primvars_.push_back(std::move(p));
    } else {
      pass_value();
      metadata();
    }
  }

  Index integer(double v, const std::string& place) const {
    if (!(std::abs(v) < 9e15) || v != std::floor(v))
      fail_format(source_, place, fmt::format("{} is no integer", v));
    return to_index(static_cast<std::int64_t>(v), "number", source_, place);
  }

  template <int N>
  std::vector<std::array<Index, N>> simplices(const std::string& place) {
    const std::vector<double> values = array(N);
    metadata();
    std::vector<std::array<Index, N>> cells(values.size() / N);
    for (std::size_t i = 0; i < values.size(); ++i) cells[i / N][i % N] = integer(values[i], place);
    return cells;
  }

  RawMesh finish() {
    for (std::size_t i = 0; i + 2 < points_.size(); i += 3)
      raw_.points.emplace_back(points_[i], points_[i + 1], points_[i + 2]);
    if (left_handed_) {
      for (auto& cell : raw_.tets.cells) std::swap(cell[0], cell[1]);
      for (auto& facet : raw_.triangles.cells) std::swap(facet[0], facet[1]);
    }
    for (Primvar& p : primvars_) add_primvar(p);
    name_subsets("tetrahedron", "zone", raw_.tets);
    name_subsets("face", "facet", raw_.triangles);
    return std::move(raw_);
  }

  /// Values of an indexed primvar are stored once each.
  void apply_indices(Primvar& p) const {
    const auto indices = indices_.find(p.name);
    if (indices == indices_.end()) return;
    const auto size = static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.about.element_size);
    const std::size_t count = size > 0 ? p.values.size() / size : 0;
    std::vector<double> values;
    for (const double v : indices->second) {
      if (!(v >= 0.0 && v < static_cast<double>(count)) || v != std::floor(v))
        fail_format(source_, p.place,
                    fmt::format("an index of {} is {} of {} values", shown(p.name), v, count));
      const auto first = p.values.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(v) * size);
      values.insert(values.end(), first, first + static_cast<std::ptrdiff_t>(size));
    }
    p.values = std::move(values);
  }

  void add_primvar(Primvar& p) {
    const bool of_points = p.about.interpolation == "vertex" || p.about.interpolation == "varying";
    if (!of_points && p.about.interpolation != "uniform") return;
    const std::size_t items = of_points ? raw_.points.size() : raw_.tets.cells.size();
    const std::int64_t components = p.width * p.about.element_size;
    constexpr std::int64_t kMost = 1024;
    if (components >= 1 && components <= kMost) apply_indices(p);
    if (components < 1 || components > kMost ||
        p.values.size() != items * static_cast<std::size_t>(components))
      fail_format(source_, p.place,
                  fmt::format("{} holds {} numbers, {} for each of {} {} are needed", shown(p.name),
                              p.values.size(), components, items, of_points ? "points" : "cells"));
    const std::string& name = p.about.display_name.empty() ? p.name : p.about.display_name;
    std::vector<Index>& tags = of_points ? raw_.point_tags : raw_.tets.tags;
    if (components == 1 && (p.name == "region" || (!of_points && p.name == "cell_region")) && tags.empty()) {
      for (const double v : p.values) tags.push_back(integer(v, p.place));
    } else {
      (of_points ? raw_.point_fields : raw_.cell_fields)
          .push_back({name, static_cast<int>(components), std::move(p.values)});
    }
  }

  /// Tags by subsets where no primvar has them, and their names.
  template <int N>
  void name_subsets(std::string_view element, std::string_view kind, RawCells<N>& cells) {
    std::vector<std::string> names;
    std::vector<std::optional<Index>> given;
    std::vector<const Subset*> of_kind;
    const bool tagged = !cells.tags.empty();
    for (const Subset& s : subsets_) {
      if (s.element != element) continue;
      for (const double v : s.indices)
        if (!(v >= 0.0 && v < static_cast<double>(cells.cells.size())) || v != std::floor(v))
          fail_format(
              source_, s.place,
              fmt::format("the subset {} names {} {} of {}", shown(s.name), element, v, cells.cells.size()));
      names.push_back(s.name);
      given.push_back(tagged && !s.indices.empty() ? cells.tags[static_cast<std::size_t>(s.indices[0])]
                                                   : s.tag);
      of_kind.push_back(&s);
    }
    if (of_kind.empty()) return;
    const std::vector<Index> tags = tags_of_names(names, given, kind, cells.names);
    if (tagged) return;
    cells.tags.assign(cells.cells.size(), 0);
    for (std::size_t k = 0; k < tags.size(); ++k)
      for (const double v : of_kind[k]->indices) cells.tags[static_cast<std::size_t>(v)] = tags[k];
  }

  const Source& source_;
  std::size_t at_ = 0;
  int depth_ = 0;
  bool found_ = false, in_mesh_ = false, left_handed_ = false;
  std::vector<double> points_;
  std::vector<Primvar> primvars_;
  std::vector<Subset> subsets_;
  std::map<std::string, std::vector<double>> indices_;
  RawMesh raw_;
};

}  // namespace

AnyMesh parse_usda(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  return UsdaReader(source).read();
}

}  // namespace lamina::io
