// The writing half of mesh/io/msh.h.
#include <fmt/format.h>

#include <algorithm>

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

template <int D>
class MshWriter {
 public:
  MshWriter(OutputFile& out, const Mesh<D>& mesh, bool ascii, bool four)
      : out_(out),
        mesh_(mesh),
        ascii_(ascii),
        four_(four),
        facets_(group_by_tag(mesh.facet_tags, mesh.facets.size())),
        cells_(group_by_tag(mesh.cell_tags, mesh.cells.size())) {
    const bool needed = !mesh.facet_tags.empty() || !mesh.cell_tags.empty();
    facet_groups_ = physical(facets_, mesh.facet_names, needed);
    cell_groups_ = physical(cells_, mesh.cell_names, needed);
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
    for (const MeshField& f : mesh_.point_fields) data("Node", f, mesh_.points.size(), 1);
    for (const MeshField& f : mesh_.cell_fields)
      data("Element", f, mesh_.cells.size(), mesh_.facets.size() + 1);
  }

 private:
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
    const auto add = [&](const Physical& groups, int dimension) {
      for (const auto& [number, name] : groups.names) {
        std::string plain = name;
        std::replace_if(
            plain.begin(), plain.end(), [](char c) { return c == '"' || c == '\n'; }, '\'');
        text += fmt::format("{} {} \"{}\"\n", dimension, number, plain);
        ++n;
      }
    };
    add(facet_groups_, D - 1);
    add(cell_groups_, D);
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
      size(0, to);
      if (D == 3) size(0, to);
      size(facets_.tags.size(), to);
      size(cells_.tags.size(), to, D == 3 ? '\n' : ' ');
      if (D == 2) size(0, to, '\n');
      for (const Physical* groups : {&facet_groups_, &cell_groups_}) {
        for (std::size_t k = 0; k < groups->numbers.size(); ++k) {
          word(static_cast<std::int64_t>(k + 1), to);
          for (const Vec3& corner : {box.lo, box.hi})
            for (int j = 0; j < 3; ++j) real(corner[j], to);
          const std::int64_t number = groups->numbers[k];
          size(number > 0 ? 1 : 0, to);
          if (number > 0) word(number, to);
          size(0, to, '\n');
        }
      }
    });
    end("Entities");
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

  template <std::size_t N>
  void blocks_4(const std::vector<std::array<Index, N>>& cells, const TagGroups& groups, std::size_t first) {
    for (std::size_t k = 0; k < groups.tags.size(); ++k) {
      const std::size_t begin = groups.start[k], n = groups.start[k + 1] - begin;
      line([&](Records& to) {
        word(N - 1, to);
        word(static_cast<std::int64_t>(k + 1), to);
        word(N == 4 ? 4 : N - 1, to);
        size(n, to, '\n');
      });
      write_records(out_, n, [&](std::size_t i, Records& to) {
        const Index cell = groups.order[begin + i];
        size(first + static_cast<std::size_t>(cell), to);
        for (std::size_t j = 0; j < N; ++j)
          size(static_cast<std::size_t>(cells[cell][j]) + 1, to, j + 1 < N ? ' ' : '\n');
      });
    }
  }

  template <std::size_t N>
  void block_2(const std::vector<std::array<Index, N>>& cells, const std::vector<Index>& tags,
               const TagGroups& groups, const std::vector<std::int64_t>& numbers, std::size_t first) {
    if (cells.empty()) return;
    constexpr int type = N == 4 ? 4 : N - 1;
    if (!ascii_)
      line([&](Records& to) {
        word(type, to);
        word(static_cast<std::int64_t>(cells.size()), to);
        word(2, to);
      });
    write_records(out_, cells.size(), [&](std::size_t i, Records& to) {
      word(static_cast<std::int64_t>(first + i), to);
      if (ascii_) {
        word(type, to);
        word(2, to);
      }
      const Index tag = tags.empty() ? 0 : tags[i];
      const auto k = std::lower_bound(groups.tags.begin(), groups.tags.end(), tag) - groups.tags.begin();
      word(numbers[k], to);
      word(k + 1, to);
      for (std::size_t j = 0; j < N; ++j) word(cells[i][j] + 1, to, j + 1 < N ? ' ' : '\n');
    });
  }

  void elements() {
    const std::size_t n = mesh_.facets.size() + mesh_.cells.size(), first_cell = mesh_.facets.size() + 1;
    out_.write("$Elements\n");
    if (four_) {
      line([&](Records& to) {
        size(facets_.tags.size() + cells_.tags.size(), to);
        size(n, to);
        size(1, to);
        size(n, to, '\n');
      });
      blocks_4(mesh_.facets, facets_, 1);
      blocks_4(mesh_.cells, cells_, first_cell);
    } else {
      out_.write(fmt::format("{}\n", n));
      block_2(mesh_.facets, mesh_.facet_tags, facets_, facet_groups_.numbers, 1);
      block_2(mesh_.cells, mesh_.cell_tags, cells_, cell_groups_.numbers, first_cell);
    }
    end("Elements");
  }

  void data(const char* kind, const MeshField& field, std::size_t n, std::size_t first) {
    const int ours = field.components;
    if (ours != 1 && ours != D && ours != kSymSize<D>) return;
    const int stored = ours == 1 ? 1 : (ours == D ? 3 : 9);
    std::string name = field.name;
    std::replace(name.begin(), name.end(), '"', '\'');
    out_.write(fmt::format("${}Data\n1\n\"{}\"\n1\n0\n3\n0\n{}\n{}\n", kind, name, stored, n));
    write_records(out_, n, [&](std::size_t i, Records& to) {
      const double* v = field.values.data() + i * static_cast<std::size_t>(ours);
      word(static_cast<std::int64_t>(first + i), to);
      for (int k = 0; k < stored; ++k) {
        const int from = stored == 9 ? kFullTensor<D>[k] : (k < ours ? k : -1);
        real(from < 0 ? 0.0 : v[from], to, k + 1 < stored ? ' ' : '\n');
      }
    });
    end(fmt::format("{}Data", kind));
  }

  OutputFile& out_;
  const Mesh<D>& mesh_;
  bool ascii_, four_;
  TagGroups facets_, cells_;
  Physical facet_groups_, cell_groups_;
};

}  // namespace

template <int D>
void write_msh(WriteJob& job, const Mesh<D>& mesh) {
  MshWriter<D>(job.files.add(job.path), mesh, job.ascii(), job.options.version != "2.2").write();
}

template void write_msh<2>(WriteJob&, const Mesh<2>&);
template void write_msh<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io
