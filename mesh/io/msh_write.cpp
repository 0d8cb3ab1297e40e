// The writing half of mesh/io/msh.h.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "mesh/io/msh.h"
#include "mesh/io/raw.h"
#include "mesh/io/records.h"

namespace lamina::io {
namespace {

/// Numbers of physical groups and their names; 0 where there are none.
struct Physical {
  std::vector<std::int64_t> numbers;
  std::vector<std::pair<std::int64_t, std::string>> names;
};

Physical physical(const TagGroups& groups, const TagNames& names, bool needed) {
  Physical p;
  std::int64_t free = 1 + (groups.tags.empty() ? 0 : std::max<std::int64_t>(groups.tags.back(), 0));
  for (const Index tag : groups.tags) {
    p.numbers.push_back(!needed ? 0 : (tag > 0 ? tag : free++));
    const auto known = names.find(tag);
    if (!needed) continue;
    if (known != names.end()) {
      p.names.emplace_back(p.numbers.back(), known->second);
    } else if (tag <= 0) {
      p.names.emplace_back(p.numbers.back(), fmt::format("{}{}", kTagPrefix, tag));
    }
  }
  return p;
}

/// Row-major 3 x 3 places of our xx xy yy (xz yz zz); -1: zero.
template <int D>
constexpr std::array<int, 9> kFullTensor = D == 3 ? std::array<int, 9>{0, 1, 3, 1, 2, 4, 3, 4, 5}
                                                  : std::array<int, 9>{0, 1, -1, 1, 2, -1, -1, -1, -1};

/// Elements of one kind, in the order they are numbered in.
template <std::size_t N>
struct Kind {
  const std::vector<std::array<Index, N>>& elements;
  const std::vector<Index>& tags;
  TagGroups groups;
  Physical physical_groups;
  std::size_t first = 1;  ///< number of the first

  Kind(const std::vector<std::array<Index, N>>& list, const std::vector<Index>& their_tags)
      : elements(list), tags(their_tags), groups(group_by_tag(their_tags, list.size())) {}
};

/// Corners as elements of one node, with the tags of their points.
template <int D>
struct CornerElements {
  std::vector<std::array<Index, 1>> elements;
  std::vector<Index> tags;

  explicit CornerElements(const Mesh<D>& mesh) {
    for (const Index v : mesh.corners) {
      elements.push_back({v});
      if (!mesh.point_tags.empty()) tags.push_back(mesh.point_tags[v]);
    }
    if (std::all_of(tags.begin(), tags.end(), [](Index t) { return t == 0; })) tags.clear();
  }
};

template <int D>
class MshWriter {
 public:
  MshWriter(OutputFile& out, const Mesh<D>& mesh, bool ascii, bool four)
      : out_(out),
        mesh_(mesh),
        ascii_(ascii),
        four_(four),
        corner_elements_(mesh),
        corners_(corner_elements_.elements, corner_elements_.tags),
        edges_(mesh.edges, mesh.edge_tags),
        facets_(mesh.facets, mesh.facet_tags),
        cells_(mesh.cells, mesh.cell_tags) {
    bool needed = false;
    for_each_kind([&](const auto& kind) { needed = needed || !kind.tags.empty(); });
    corners_.physical_groups = physical(corners_.groups, mesh.point_names, needed);
    edges_.physical_groups = physical(edges_.groups, mesh.edge_names, needed);
    facets_.physical_groups = physical(facets_.groups, mesh.facet_names, needed);
    cells_.physical_groups = physical(cells_.groups, mesh.cell_names, needed);
    for_each_kind([&](auto& kind) {
      kind.first = 1 + elements_count_;
      elements_count_ += kind.elements.size();
    });
  }

  void write() {
    out_.write(fmt::format("$MeshFormat\n{} {} 8\n", four_ ? "4.1" : "2.2", ascii_ ? 0 : 1));
    if (!ascii_) {
      line([](Records& to) { to.raw<std::int32_t>(1); });
      out_.write("\n");
    }
    out_.write("$EndMeshFormat\n");
    names();
    if (four_) entities();
    nodes();
    elements();
    for (const MeshField& f : mesh_.point_fields) node_data(f);
    for (const MeshField& f : mesh_.cell_fields) element_data(f);
  }

 private:
  template <class Visit>
  void for_each_kind(Visit&& visit) {
    visit(corners_);
    if constexpr (D == 3) visit(edges_);
    visit(facets_);
    visit(cells_);
  }

  void word(std::int64_t v, Records& to, char end = ' ') const {
    if (!ascii_) return to.raw(static_cast<std::int32_t>(v));
    to.integer(v);
    to.character(end);
  }
  void size(std::size_t v, Records& to, char end = ' ') const {
    if (!ascii_) return to.raw(static_cast<std::uint64_t>(v));
    to.integer(static_cast<std::int64_t>(v));
    to.character(end);
  }
  void real(double v, Records& to, char end = ' ') const {
    if (!ascii_) return to.raw(v);
    to.real(v);
    to.character(end);
  }
  template <class Form>
  void line(Form&& form) {
    Records to;
    form(to);
    out_.write(to.bytes());
  }
  void end(std::string_view section) { out_.write(fmt::format("{}$End{}\n", ascii_ ? "" : "\n", section)); }

  void names() {
    std::string text;
    std::size_t n = 0;
    int dimension = 0;
    for_each_kind([&](const auto& kind) {
      for (const auto& [number, name] : kind.physical_groups.names) {
        std::string plain = name;
        std::replace_if(
            plain.begin(), plain.end(), [](char c) { return c == '"' || c == '\n'; }, '\'');
        text += fmt::format("{} {} \"{}\"\n", dimension, number, plain);
        ++n;
      }
      ++dimension;
    });
    if (n > 0) out_.write(fmt::format("$PhysicalNames\n{}\n{}$EndPhysicalNames\n", n, text));
  }

  void entities() {
    Box<3> box{Vec3::Zero(), Vec3::Zero()};
    for (int k = 0; k < D && !mesh_.points.empty(); ++k) {
      const auto [lo, hi] =
          std::minmax_element(mesh_.points.begin(), mesh_.points.end(),
                              [k](const Vec<D>& a, const Vec<D>& b) { return a[k] < b[k]; });
      box.lo[k] = (*lo)[k];
      box.hi[k] = (*hi)[k];
    }
    out_.write("$Entities\n");
    line([&](Records& to) {
      for_each_kind(
          [&](const auto& kind) { size(kind.groups.tags.size(), to, D == 3 && is_last(kind) ? '\n' : ' '); });
      if (D == 2) size(0, to, '\n');
      for_each_kind([&](const auto& kind) {
        for (std::size_t k = 0; k < kind.groups.tags.size(); ++k) entity(kind, k, box, to);
      });
    });
    end("Entities");
  }

  template <std::size_t N>
  static constexpr bool is_last(const Kind<N>&) {
    return N == D + 1;
  }

  template <std::size_t N>
  void entity(const Kind<N>& kind, std::size_t k, const Box<3>& box, Records& to) const {
    word(static_cast<std::int64_t>(k + 1), to);
    if constexpr (N == 1) {
      const Index point = kind.elements[kind.groups.order[kind.groups.start[k]]][0];
      for (int j = 0; j < 3; ++j) real(j < D ? mesh_.points[point][j] : 0.0, to);
    } else {
      for (const Vec3& corner : {box.lo, box.hi})
        for (int j = 0; j < 3; ++j) real(corner[j], to);
    }
    const std::int64_t number = kind.physical_groups.numbers[k];
    size(number > 0 ? 1 : 0, to, N == 1 && number == 0 ? '\n' : ' ');
    if (number > 0) word(number, to, N == 1 ? '\n' : ' ');
    if (N > 1) size(0, to, '\n');
  }

  void coordinates(std::size_t i, Records& to) const {
    for (int k = 0; k < 3; ++k) real(k < D ? mesh_.points[i][k] : 0.0, to, k < 2 ? ' ' : '\n');
  }

  void nodes() {
    const std::size_t n = mesh_.points.size();
    out_.write("$Nodes\n");
    if (four_) {
      line([&](Records& to) {
        for (const std::size_t v : {std::size_t{1}, n, std::size_t{1}}) size(v, to);
        size(n, to, '\n');
        for (const int v : {D, 1, 0}) word(v, to);
        size(n, to, '\n');
      });
      write_records(out_, n, [&](std::size_t i, Records& to) { size(i + 1, to, '\n'); });
      write_records(out_, n, [&](std::size_t i, Records& to) { coordinates(i, to); });
    } else {
      out_.write(fmt::format("{}\n", n));
      write_records(out_, n, [&](std::size_t i, Records& to) {
        word(static_cast<std::int64_t>(i + 1), to);
        coordinates(i, to);
      });
    }
    end("Nodes");
  }

  /// Elements of one group that follow each other in the file.
  struct Block {
    std::size_t group, begin, count;
  };

  /// Of version 4.1: runs of cells, of others whole groups.
  template <std::size_t N>
  std::vector<Block> blocks_of(const Kind<N>& kind) const {
    std::vector<Block> blocks;
    const TagGroups& groups = kind.groups;
    if (!is_last(kind) || groups.tags.size() == 1) {
      for (std::size_t k = 0; k < groups.tags.size(); ++k)
        blocks.push_back({k, groups.start[k], groups.start[k + 1] - groups.start[k]});
      return blocks;
    }
    for (std::size_t i = 0; i < kind.tags.size(); ++i) {
      if (i == 0 || kind.tags[i] != kind.tags[i - 1]) {
        const auto group = std::lower_bound(groups.tags.begin(), groups.tags.end(), kind.tags[i]);
        blocks.push_back({static_cast<std::size_t>(group - groups.tags.begin()), i, 0});
      }
      ++blocks.back().count;
    }
    return blocks;
  }

  template <std::size_t N>
  static constexpr int type_of(const Kind<N>&) {
    return N == 1 ? 15 : N == 4 ? 4 : static_cast<int>(N) - 1;
  }

  template <std::size_t N>
  void blocks_4(const Kind<N>& kind) {
    const TagGroups& groups = kind.groups;
    const bool keep_order = is_last(kind);
    for (const Block& block : blocks_of(kind)) {
      line([&](Records& to) {
        word(N - 1, to);
        word(static_cast<std::int64_t>(block.group + 1), to);
        word(type_of(kind), to);
        size(block.count, to, '\n');
      });
      write_records(out_, block.count, [&](std::size_t i, Records& to) {
        const std::size_t place = block.begin + i;
        const Index cell = keep_order ? static_cast<Index>(place) : groups.order[place];
        size(kind.first + place, to);
        for (std::size_t j = 0; j < N; ++j)
          size(static_cast<std::size_t>(kind.elements[cell][j]) + 1, to, j + 1 < N ? ' ' : '\n');
      });
    }
  }

  template <std::size_t N>
  void block_2(const Kind<N>& kind) {
    if (kind.elements.empty()) return;
    if (!ascii_)
      line([&](Records& to) {
        word(type_of(kind), to);
        word(static_cast<std::int64_t>(kind.elements.size()), to);
        word(2, to);
      });
    write_records(out_, kind.elements.size(), [&](std::size_t i, Records& to) {
      word(static_cast<std::int64_t>(kind.first + i), to);
      if (ascii_) {
        word(type_of(kind), to);
        word(2, to);
      }
      const Index tag = kind.tags.empty() ? 0 : kind.tags[i];
      const auto& tags = kind.groups.tags;
      const auto k = std::lower_bound(tags.begin(), tags.end(), tag) - tags.begin();
      word(kind.physical_groups.numbers[k], to);
      word(k + 1, to);
      for (std::size_t j = 0; j < N; ++j) word(kind.elements[i][j] + 1, to, j + 1 < N ? ' ' : '\n');
    });
  }

  void elements() {
    out_.write("$Elements\n");
    if (four_) {
      std::size_t blocks = 0;
      for_each_kind([&](const auto& kind) { blocks += blocks_of(kind).size(); });
      line([&](Records& to) {
        size(blocks, to);
        size(elements_count_, to);
        size(1, to);
        size(elements_count_, to, '\n');
      });
      for_each_kind([&](const auto& kind) { blocks_4(kind); });
    } else {
      out_.write(fmt::format("{}\n", elements_count_));
      for_each_kind([&](const auto& kind) { block_2(kind); });
    }
    end("Elements");
  }

  /// Components as the format has them; 0: it does not hold the field.
  static int stored(const MeshField& field) {
    const int ours = field.components;
    if (ours != 1 && ours != D && ours != kSymSize<D>) return 0;
    return ours == 1 ? 1 : (ours == D ? 3 : 9);
  }

  void data_head(const char* kind, const MeshField& field, std::size_t n) {
    std::string name = field.name;
    std::replace(name.begin(), name.end(), '"', '\'');
    out_.write(fmt::format("${}Data\n1\n\"{}\"\n1\n0\n3\n0\n{}\n{}\n", kind, name, stored(field), n));
  }

  void value(const MeshField& field, std::size_t i, std::size_t number, Records& to) const {
    const int n = stored(field), ours = field.components;
    const double* v = field.values.data() + i * static_cast<std::size_t>(ours);
    word(static_cast<std::int64_t>(number), to);
    for (int k = 0; k < n; ++k) {
      const int from = n == 9 ? kFullTensor<D>[k] : (k < ours ? k : -1);
      real(from < 0 ? 0.0 : v[from], to, k + 1 < n ? ' ' : '\n');
    }
  }

  void node_data(const MeshField& field) {
    if (stored(field) == 0) return;
    const std::size_t n = mesh_.points.size();
    data_head("Node", field, n);
    write_records(out_, n, [&](std::size_t i, Records& to) { value(field, i, i + 1, to); });
    end("NodeData");
  }

  void element_data(const MeshField& field) {
    const int n = stored(field);
    if (n == 0) return;
    data_head("Element", field, elements_count_);
    const double none = std::numeric_limits<double>::quiet_NaN();
    for_each_kind([&](const auto& kind) {
      write_records(out_, kind.elements.size(), [&](std::size_t i, Records& to) {
        if (is_last(kind)) return value(field, i, kind.first + i, to);
        word(static_cast<std::int64_t>(kind.first + i), to);
        for (int k = 0; k < n; ++k) real(none, to, k + 1 < n ? ' ' : '\n');
      });
    });
    end("ElementData");
  }

  OutputFile& out_;
  const Mesh<D>& mesh_;
  bool ascii_, four_;
  CornerElements<D> corner_elements_;
  Kind<1> corners_;
  Kind<2> edges_;  // none in 2D
  Kind<D> facets_;
  Kind<D + 1> cells_;
  std::size_t elements_count_ = 0;
};

}  // namespace

template <int D>
void write_msh(WriteJob& job, const Mesh<D>& mesh) {
  MshWriter<D>(job.files.add(job.path), mesh, job.ascii(), job.options.version != "2.2").write();
}

template void write_msh<2>(WriteJob&, const Mesh<2>&);
template void write_msh<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io
