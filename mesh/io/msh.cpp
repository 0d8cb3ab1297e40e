#include "mesh/io/msh.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "mesh/io/text.h"

namespace lamina::io {
namespace {

/// Numbers of one section: text, or binary of version 2 or 4.
class Numbers {
 public:
  Numbers(TextSource& text, bool binary, bool swap)
      : text_(&text), bytes_(text.source(), text.position(), swap), binary_(binary) {}

  std::int64_t word() { return binary_ ? bytes_.get<std::int32_t>() : text_->integer(); }
  std::int64_t size() { return binary_ ? bytes_.get<std::int64_t>() : text_->integer(); }
  double real() { return binary_ ? bytes_.get<double>() : text_->real(); }
  /// Throws unless so many records of `words` integers, `sizes` long ones and `reals` can follow.
  void expect(std::int64_t n, int words, int sizes, int reals) {
    if (binary_) {
      bytes_.expect(n, 4 * static_cast<std::size_t>(words) + 8 * static_cast<std::size_t>(sizes + reals));
    } else {
      text_->expect(n, words + sizes + reals);
    }
    if (n > std::numeric_limits<Index>::max()) fail(fmt::format("a count of {} does not fit 31 bits", n));
  }
  [[noreturn]] void fail(const std::string& what) const { binary_ ? bytes_.fail(what) : text_->fail(what); }
  [[nodiscard]] std::string place() const { return binary_ ? bytes_.place() : text_->place(); }
  /// Sets the text behind what was read.
  void finish() {
    if (binary_) text_->seek(bytes_.position());
  }

 private:
  TextSource* text_;
  ByteSource bytes_;
  bool binary_;
};

/// Positions of the numbers that points or cells have in the file.
class Numbering {
 public:
  /// Sorts: order()[i] is the place in the file of the i-th by number. Errors: a number given twice.
  Numbering(std::vector<std::int64_t> numbers, const char* kind, const Source& source)
      : sorted_(std::move(numbers)) {
    const auto rises = [&] {
      return std::adjacent_find(sorted_.begin(), sorted_.end(), std::greater_equal<>()) == sorted_.end();
    };
    if (!rises()) {
      order_.resize(sorted_.size());
      std::iota(order_.begin(), order_.end(), Index{0});
      std::stable_sort(order_.begin(), order_.end(),
                       [&](Index a, Index b) { return sorted_[a] < sorted_[b]; });
      std::sort(sorted_.begin(), sorted_.end());
      const auto twice = std::adjacent_find(sorted_.begin(), sorted_.end());
      if (twice != sorted_.end())
        fail_format(source, "end", fmt::format("{} {} is given twice", kind, *twice));
    }
    // Unsigned, because numbers of a damaged file can be farther apart than 63 bits tell.
    const auto span = [](std::int64_t a, std::int64_t b) {
      return static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
    };
    consecutive_ = sorted_.empty() || span(sorted_.front(), sorted_.back()) == sorted_.size() - 1;
  }
  [[nodiscard]] const std::vector<Index>& order() const { return order_; }
  /// kNone when no such number is there.
  [[nodiscard]] Index find(std::int64_t number) const {
    if (sorted_.empty() || number < sorted_.front() || number > sorted_.back()) return kNone;
    if (consecutive_) return static_cast<Index>(number - sorted_.front());
    const auto at = std::lower_bound(sorted_.begin(), sorted_.end(), number);
    return *at == number ? static_cast<Index>(at - sorted_.begin()) : kNone;
  }

 private:
  std::vector<std::int64_t> sorted_;
  std::vector<Index> order_;  ///< empty: as in the file
  bool consecutive_ = false;
};

template <class T>
void reorder(std::vector<T>& values, const std::vector<Index>& order) {
  if (order.empty()) return;
  std::vector<T> sorted(values.size());
  for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = values[order[i]];
  values = std::move(sorted);
}

template <int N>
struct Elements {
  RawCells<N> raw;
  std::vector<Index> entities;
  std::vector<std::int64_t> numbers;
};

/// One $NodeData or $ElementData.
struct DataSection {
  std::string name;
  int components = 1;
  std::vector<std::int64_t> numbers;
  std::vector<double> values;
};

class MshReader {
 public:
  explicit MshReader(const Source& source) : source_(source), text_(source) {}

  AnyMesh read() {
    if (text_.word() != "$MeshFormat") text_.fail("a MSH file starts with $MeshFormat");
    read_format();
    while (!text_.at_end()) {
      const std::string_view section = text_.word();
      if (section.size() < 2 || section.front() != '$')
        text_.fail(fmt::format("expected a section, found \"{}\"", shown(section)));
      read_section(section);
    }
    if (!numbering_) fail_format(source_, "end", "has no $Nodes");
    return finish();
  }

 private:
  void read_section(std::string_view section) {
    static_cast<void>(text_.line());
    if (section == "$PhysicalNames") {
      read_names();
    } else if (section == "$Entities") {
      read_entities();
    } else if (section == "$PartitionedEntities") {
      fail_unsupported(source_, "is partitioned; save it as one part");
    } else if (section == "$Nodes") {
      if (numbering_) text_.fail("a second $Nodes");
      is_four_ ? read_nodes_4() : read_nodes_2();
    } else if (section == "$Elements") {
      if (!numbering_) text_.fail("$Elements before $Nodes");
      is_four_ ? read_elements_4() : read_elements_2();
    } else if (section == "$NodeData" || section == "$ElementData") {
      (section == "$NodeData" ? node_data_ : element_data_).push_back(read_data());
    } else {
      const std::string end = "$End" + std::string(section.substr(1));
      const std::size_t found = source_.bytes.find(end, text_.position());
      if (found == std::string_view::npos) text_.fail(fmt::format("{} is missing", shown(end)));
      text_.seek(found);
    }
    const std::string_view end = text_.word();
    if (end.substr(0, 4) != "$End" || end.substr(4) != section.substr(1))
      text_.fail(fmt::format("expected $End{}, found \"{}\"", shown(section.substr(1)), shown(end)));
  }

  void read_format() {
    const std::string version(text_.word());
    is_four_ = version == "4.1";
    if (!is_four_ && version != "2.2" && version != "2" && version != "2.1")
      fail_unsupported(source_, fmt::format("MSH version {}; 4.1 and 2.2 are read (gmsh -save -format msh41)",
                                            shown(version)));
    binary_ = text_.integer(0, 1) == 1;
    if (text_.integer() != 8) fail_unsupported(source_, "the size of numbers must be 8");
    static_cast<void>(text_.line());
    if (binary_) {
      ByteSource one(source_, text_.position(), false);
      const auto mark = one.get<std::int32_t>();
      swap_ = mark == 0x01000000;
      if (mark != 1 && !swap_) one.fail("the mark of the byte order is not 1");
      text_.seek(one.position());
    }
    if (text_.word() != "$EndMeshFormat") text_.fail("expected $EndMeshFormat");
  }

  void read_names() {
    const std::size_t n = text_.count(3);
    for (std::size_t i = 0; i < n; ++i) {
      const auto dimension = static_cast<int>(text_.integer(0, 3));
      const Index tag = text_.index();
      std::string_view name = text_.line();
      if (name.size() < 2 || name.front() != '"' || name.back() != '"')
        text_.fail("the name of a physical group must stand in quotes");
      name.remove_prefix(1);
      name.remove_suffix(1);
      names_[dimension][tag] = std::string(name);
    }
  }

  void read_entities() {
    Numbers in(text_, binary_, swap_);
    std::array<std::int64_t, 4> counts;
    for (auto& c : counts) c = in.size();
    for (int dimension = 0; dimension < 4; ++dimension) {
      const int reals = dimension == 0 ? 3 : 6;
      in.expect(counts[dimension], 1, dimension == 0 ? 1 : 2, reals);
      for (std::int64_t i = 0; i < counts[dimension]; ++i) {
        const std::int64_t tag = in.word();
        for (int k = 0; k < reals; ++k) in.real();
        const std::int64_t groups = in.size();
        in.expect(groups, 1, 0, 0);
        for (std::int64_t k = 0; k < groups; ++k) {
          const std::int64_t group = in.word();
          if (k == 0) groups_[dimension][tag] = group_tag(group, in);
        }
        if (dimension == 0) continue;
        const std::int64_t bounds = in.size();
        in.expect(bounds, 1, 0, 0);
        for (std::int64_t k = 0; k < bounds; ++k) in.word();
      }
    }
    in.finish();
  }

  /// The number of a physical group; negative ones stand for elements turned over.
  Index group_tag(std::int64_t group, const Numbers& in) const {
    const Index tag = to_index(group, "physical group", source_, in);
    if (tag == std::numeric_limits<Index>::min()) in.fail("a physical group beyond 31 bits");
    return std::abs(tag);
  }

  void add_point(Numbers& in) {
    Vec3 x;
    for (int k = 0; k < 3; ++k) x[k] = in.real();
    raw_.points.push_back(x);
  }
  void set_numbering(std::vector<std::int64_t> numbers) {
    numbering_.emplace(std::move(numbers), "node", source_);
    reorder(raw_.points, numbering_->order());
  }

  void read_nodes_4() {
    Numbers in(text_, binary_, swap_);
    const std::int64_t blocks = in.size(), n = in.size();
    in.size();
    in.size();
    in.expect(blocks, 3, 1, 0);
    in.expect(n, 0, 1, 3);
    std::vector<std::int64_t> numbers;
    numbers.reserve(n);
    raw_.points.reserve(n);
    for (std::int64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = in.word();
      in.word();
      const bool parametric = in.word() != 0;
      const std::int64_t count = in.size();
      in.expect(count, 0, 1, 3);
      for (std::int64_t i = 0; i < count; ++i) numbers.push_back(in.size());
      for (std::int64_t i = 0; i < count; ++i) {
        add_point(in);
        for (std::int64_t k = 0; parametric && k < std::min<std::int64_t>(dimension, 3); ++k) in.real();
      }
    }
    in.finish();
    set_numbering(std::move(numbers));
  }

  void read_nodes_2() {
    const std::int64_t n = text_.integer();
    static_cast<void>(text_.line());
    Numbers in(text_, binary_, swap_);
    in.expect(n, 1, 0, 3);
    std::vector<std::int64_t> numbers;
    numbers.reserve(n);
    raw_.points.reserve(n);
    for (std::int64_t i = 0; i < n; ++i) {
      numbers.push_back(in.word());
      add_point(in);
    }
    in.finish();
    set_numbering(std::move(numbers));
  }

  /// Nodes of an element type.
  int corners_of(std::int64_t type, const Numbers& in) const {
    switch (type) {
      case 1:
        return 2;
      case 2:
        return 3;
      case 4:
        return 4;
      case 15:
        return 1;
      default:
        fail_unsupported(source_,
                         fmt::format("{}: element type {}; lines (1), triangles (2), tetrahedra (4) and "
                                     "points (15) are read",
                                     in.place(), type));
    }
  }

  template <int N, class Next>
  void add_element(Elements<N>& to, const Numbers& in, std::int64_t number, Index tag, Index entity,
                   Next&& next) {
    std::array<Index, N> cell;
    for (Index& v : cell) {
      const std::int64_t node = next();
      v = numbering_->find(node);
      if (v == kNone) in.fail(fmt::format("element {} names node {}, which is not there", number, node));
    }
    to.raw.cells.push_back(cell);
    to.raw.tags.push_back(tag);
    to.entities.push_back(entity);
    to.numbers.push_back(number);
  }

  template <class Next>
  void add_any(int corners, const Numbers& in, std::int64_t number, Index tag, Index entity, Next&& next) {
    if (corners == 4) return add_element(tets_, in, number, tag, entity, next);
    if (corners == 3) return add_element(triangles_, in, number, tag, entity, next);
    if (corners == 2) return add_element(lines_, in, number, tag, entity, next);
    add_element(corners_, in, number, tag, entity, next);
  }

  void read_elements_4() {
    Numbers in(text_, binary_, swap_);
    const std::int64_t blocks = in.size(), n = in.size();
    in.size();
    in.size();
    in.expect(blocks, 3, 1, 0);
    in.expect(n, 0, 2, 0);
    for (std::int64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = in.word(), entity = in.word();
      const int corners = corners_of(in.word(), in);
      const std::int64_t count = in.size();
      in.expect(count, 0, corners + 1, 0);
      if (dimension != corners - 1)
        in.fail(fmt::format("elements of {} nodes in an entity of dimension {}", corners, dimension));
      const auto group = groups_[dimension].find(entity);
      const Index tag = group == groups_[dimension].end() ? 0 : group->second;
      for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t number = in.size();
        add_any(corners, in, number, tag, to_index(entity, "entity", source_, in), [&] { return in.size(); });
      }
    }
    in.finish();
  }

  void read_elements_2() {
    const std::int64_t n = text_.integer();
    static_cast<void>(text_.line());
    Numbers in(text_, binary_, swap_);
    in.expect(n, 2, 0, 0);
    std::int64_t type = 0, follow = 0, tags = 0;
    for (std::int64_t i = 0; i < n; ++i) {
      std::int64_t number = 0;
      if (binary_ && follow == 0) {
        type = in.word();
        follow = in.word();
        tags = in.word();
        if (follow < 1) in.fail("a block of no elements");
      }
      number = in.word();
      if (!binary_) {
        type = in.word();
        tags = in.word();
      }
      --follow;
      const int corners = corners_of(type, in);
      in.expect(tags, 1, 0, 0);
      Index tag = 0, entity = 0;
      for (std::int64_t k = 0; k < tags; ++k) {
        const std::int64_t value = in.word();
        if (k == 0) tag = group_tag(value, in);
        if (k == 1) entity = to_index(value, "entity", source_, in);
      }
      add_any(corners, in, number, tag, entity, [&] { return in.word(); });
    }
    in.finish();
  }

  DataSection read_data() {
    DataSection data;
    const std::int64_t strings = text_.integer(0, 100);
    static_cast<void>(text_.line());
    for (std::int64_t i = 0; i < strings; ++i) {
      std::string_view name = text_.line();
      if (name.size() > 1 && name.front() == '"' && name.back() == '"')
        name = name.substr(1, name.size() - 2);
      if (i == 0) data.name = std::string(name);
    }
    const std::int64_t reals = text_.integer(0, 100);
    for (std::int64_t i = 0; i < reals; ++i) text_.real();
    const std::int64_t integers = text_.integer(3, 100), step = text_.integer();
    data.components = static_cast<int>(text_.integer(1, 9));
    const std::int64_t n = text_.integer();
    for (std::int64_t i = 3; i < integers; ++i) text_.integer();
    static_cast<void>(text_.line());
    const auto same = [&](const DataSection& d) { return d.name == data.name; };
    if (std::any_of(node_data_.begin(), node_data_.end(), same)) data.name += fmt::format("@{}", step);
    Numbers in(text_, binary_, swap_);
    in.expect(n, 1, 0, data.components);
    data.numbers.reserve(n);
    data.values.reserve(n * data.components);
    for (std::int64_t i = 0; i < n; ++i) {
      data.numbers.push_back(in.word());
      for (int k = 0; k < data.components; ++k) data.values.push_back(in.real());
    }
    in.finish();
    return data;
  }

  /// Values in our order; none when the section is about other elements.
  static std::optional<MeshField> field_of(const DataSection& data, const Numbering& numbering,
                                           std::size_t count) {
    const auto n = static_cast<std::size_t>(data.components);
    MeshField field{data.name, data.components, {}};
    field.values.assign(count * n, std::nan(""));
    bool found = false;
    for (std::size_t i = 0; i < data.numbers.size(); ++i) {
      const Index at = numbering.find(data.numbers[i]);
      if (at == kNone) continue;
      found = true;
      std::copy_n(data.values.begin() + static_cast<std::ptrdiff_t>(i * n), n,
                  field.values.begin() + static_cast<std::ptrdiff_t>(at * n));
    }
    if (!found && count > 0) return std::nullopt;
    if (n == 9) make_symmetric(field, count);
    return field;
  }

  /// A field of 3 x 3 tensors that are all symmetric becomes one of six components.
  static void make_symmetric(MeshField& field, std::size_t count) {
    constexpr std::array<int, 6> kPlace = {0, 1, 4, 2, 5, 8}, kOther = {0, 3, 4, 6, 7, 8};
    const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    for (std::size_t i = 0; i < count; ++i)
      for (int k = 0; k < 6; ++k)
        if (!same(field.values[9 * i + kPlace[k]], field.values[9 * i + kOther[k]])) return;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<double, 6> ours;
      for (int k = 0; k < 6; ++k) ours[k] = field.values[9 * i + kPlace[k]];
      std::copy(ours.begin(), ours.end(), field.values.begin() + static_cast<std::ptrdiff_t>(6 * i));
    }
    field.values.resize(6 * count);
    field.components = 6;
  }

  /// Groups named tag_<number> stand for that tag.
  static void rename_tags(TagNames& names, std::vector<Index>& tags) {
    std::map<Index, Index> meant;
    for (auto name = names.begin(); name != names.end();) {
      const std::string_view text = name->second;
      Index tag = 0;
      const char* end = text.data() + text.size();
      const bool told = text.substr(0, kTagPrefix.size()) == kTagPrefix &&
                        std::from_chars(text.data() + kTagPrefix.size(), end, tag).ptr == end;
      if (told) meant[name->first] = tag;
      name = told ? names.erase(name) : std::next(name);
    }
    if (meant.empty()) return;
    for (Index& t : tags)
      if (const auto m = meant.find(t); m != meant.end()) t = m->second;
  }

  /// Sorts by number and decides on the tags.
  template <int N>
  Numbering settle(Elements<N>& elements) {
    Numbering numbering(std::move(elements.numbers), "element", source_);
    RawCells<N>& raw = elements.raw;
    raw.place = "$Elements";
    const auto zero = [](Index t) { return t == 0; };
    if (std::all_of(raw.tags.begin(), raw.tags.end(), zero) &&
        distinct_tags(elements.entities, elements.entities.size()).size() > 1)
      raw.tags = std::move(elements.entities);
    rename_tags(names_[N - 1], raw.tags);
    reorder(raw.cells, numbering.order());
    reorder(raw.tags, numbering.order());
    raw.names = names_[N - 1];
    return numbering;
  }

  AnyMesh finish() {
    const Numbering tets = settle(tets_), triangles = settle(triangles_);
    settle(lines_);
    settle(corners_);
    const Numbering& cells = tets_.raw.cells.empty() ? triangles : tets;
    const std::size_t count = tets_.raw.cells.empty() ? triangles_.raw.cells.size() : tets_.raw.cells.size();
    for (const DataSection& d : node_data_)
      if (auto field = field_of(d, *numbering_, raw_.points.size()))
        raw_.point_fields.push_back(std::move(*field));
    for (const DataSection& d : element_data_)
      if (auto field = field_of(d, cells, count)) raw_.cell_fields.push_back(std::move(*field));
    raw_.tets = std::move(tets_.raw);
    raw_.triangles = std::move(triangles_.raw);
    raw_.edges = std::move(lines_.raw);
    add_corners(corners_.raw, raw_);
    raw_.point_names = std::move(corners_.raw.names);
    return assemble(std::move(raw_), source_);
  }

  const Source& source_;
  TextSource text_;
  bool is_four_ = true, binary_ = false, swap_ = false;
  std::array<TagNames, 4> names_;
  std::array<std::map<std::int64_t, Index>, 4> groups_;
  std::optional<Numbering> numbering_;
  RawMesh raw_;
  Elements<4> tets_;
  Elements<3> triangles_;
  Elements<2> lines_;
  Elements<1> corners_;
  std::vector<DataSection> node_data_, element_data_;
};

}  // namespace

AnyMesh parse_msh(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  return MshReader(source).read();
}

}  // namespace lamina::io
