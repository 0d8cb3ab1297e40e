#include "mesh/io/usda.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "mesh/io/raw.h"
#include "mesh/io/records.h"

namespace lamina::io {
namespace {

class UsdaWriter {
 public:
  UsdaWriter(WriteJob& job, const Mesh<3>& mesh)
      : out_(job.files.add(job.path)), mesh_(mesh), lost_(job.lost) {}

  void write() {
    out_.write(
        "#usda 1.0\n(\n    defaultPrim = \"mesh\"\n    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n\ndef "
        "TetMesh \"mesh\"\n{\n");
    extent();
    array("point3f[] points", mesh_.points.size(), [&](std::size_t i, Records& to) {
      tuple(
          3, [&](int k) { to.single(static_cast<float>(mesh_.points[i][k])); }, to);
    });
    array("int4[] tetVertexIndices", mesh_.cells.size(), [&](std::size_t i, Records& to) {
      tuple(
          4, [&](int k) { to.integer(mesh_.cells[i][k]); }, to);
    });
    array("int3[] surfaceFaceVertexIndices", mesh_.facets.size(), [&](std::size_t i, Records& to) {
      tuple(
          3, [&](int k) { to.integer(mesh_.facets[i][k]); }, to);
    });
    out_.write("    uniform token orientation = \"rightHanded\"\n");
    if (!mesh_.point_tags.empty()) tags("vertex", mesh_.point_tags);
    if (!mesh_.cell_tags.empty()) tags("uniform", mesh_.cell_tags);
    for (const MeshField& f : mesh_.point_fields) field(f, "vertex", mesh_.points.size());
    for (const MeshField& f : mesh_.cell_fields) field(f, "uniform", mesh_.cells.size());
    if (!mesh_.cell_tags.empty())
      subsets(mesh_.cell_tags, mesh_.cells.size(), mesh_.cell_names, "zone", "tetrahedron");
    if (!mesh_.facet_tags.empty())
      subsets(mesh_.facet_tags, mesh_.facets.size(), mesh_.facet_names, "facet", "face");
    out_.write("}\n");
  }

 private:
  template <class Part>
  static void tuple(int n, Part&& part, Records& to) {
    to.character('(');
    for (int k = 0; k < n; ++k) {
      if (k > 0) to.text(", ");
      part(k);
    }
    to.character(')');
  }

  template <class Form>
  void array(const std::string& declaration, std::size_t n, Form&& form, const std::string& metadata = "") {
    out_.write(fmt::format("    {} = [", declaration));
    write_records(out_, n, [&](std::size_t i, Records& to) {
      if (i > 0) to.text(", ");
      form(i, to);
      if (i % 8 == 7) to.character('\n');
    });
    out_.write(fmt::format("]{}\n", metadata.empty() ? "" : fmt::format(" (\n        {}\n    )", metadata)));
  }

  void extent() {
    Box<3> box;
    for (const Vec3& x : mesh_.points) {
      box.lo = box.lo.cwiseMin(x);
      box.hi = box.hi.cwiseMax(x);
    }
    if (mesh_.points.empty()) return;
    Records to;
    const auto corner = [&](const Vec3& x) {
      tuple(
          3, [&](int k) { to.single(static_cast<float>(x[k])); }, to);
    };
    to.text("    float3[] extent = [");
    corner(box.lo);
    to.text(", ");
    corner(box.hi);
    to.text("]\n");
    out_.write(to.bytes());
  }

  /// Metadata that keeps a name which is no identifier.
  static std::string display_name(const std::string& id, const std::string& name) {
    if (id == name) return "";
    std::string text = "displayName = \"";
    for (const char c : name) {
      if (c == '"' || c == '\\') text += '\\';
      text += c == '\n' ? ' ' : c;
    }
    return text + "\"";
  }

  /// An identifier of USD that was not given before.
  std::string identifier(const std::string& name, const char* what) {
    std::string id = name;
    for (char& c : id)
      if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
    if (id.empty() || (id[0] >= '0' && id[0] <= '9')) id = fmt::format("_{}", id);
    while (!used_.insert(id).second) id += "_";
    if (id != name) lost_.push_back(fmt::format("the {} \"{}\" (now {})", what, name, id));
    return id;
  }

  void tags(const char* interpolation, const std::vector<Index>& values) {
    const std::string name = used_.insert("region").second ? "region" : "cell_region";
    array(
        fmt::format("int[] primvars:{}", name), values.size(),
        [&](std::size_t i, Records& to) { to.integer(values[i]); },
        fmt::format("interpolation = \"{}\"", interpolation));
  }

  static void real(double v, Records& to) {
    if (std::isnan(v)) return to.text("nan");
    if (std::isinf(v)) return to.text(v < 0 ? "-inf" : "inf");
    to.real(v);
  }

  void field(const MeshField& f, const char* interpolation, std::size_t count) {
    const std::string name = identifier(f.name, "name of the field");
    const std::string shown_as = display_name(name, f.name);
    const std::string about = fmt::format("{}{}interpolation = \"{}\"", shown_as,
                                          shown_as.empty() ? "" : "\n        ", interpolation);
    const auto n = static_cast<std::size_t>(f.components);
    if (n == 3) {
      array(
          fmt::format("double3[] primvars:{}", name), count,
          [&](std::size_t i, Records& to) {
            tuple(
                3, [&](int k) { real(f.values[3 * i + static_cast<std::size_t>(k)], to); }, to);
          },
          about);
      return;
    }
    array(
        fmt::format("double[] primvars:{}", name), count * n,
        [&](std::size_t i, Records& to) { real(f.values[i], to); },
        fmt::format("{}{}", n == 1 ? "" : fmt::format("elementSize = {}\n        ", n), about));
  }

  void subsets(const std::vector<Index>& values, std::size_t items, const TagNames& names, const char* kind,
               const char* element) {
    const TagGroups groups = group_by_tag(values, items);
    for (std::size_t k = 0; k < groups.tags.size(); ++k) {
      const std::string given = name_of_tag(names, groups.tags[k], kind);
      const std::string name = identifier(given, "name");
      const std::string shown_as = display_name(name, given);
      out_.write(fmt::format("    def GeomSubset \"{}\"{}\n    {{\n    uniform token elementType = \"{}\"\n",
                             name, shown_as.empty() ? "" : fmt::format(" (\n        {}\n    )", shown_as),
                             element));
      out_.write(fmt::format("    custom int tag = {}\n", groups.tags[k]));
      out_.write("    uniform token familyName = \"region\"\n");
      const std::size_t begin = groups.start[k];
      array("int[] indices", groups.start[k + 1] - begin,
            [&](std::size_t i, Records& to) { to.integer(groups.order[begin + i]); });
      out_.write("    }\n");
    }
  }

  OutputFile& out_;
  const Mesh<3>& mesh_;
  std::vector<std::string>& lost_;
  std::set<std::string> used_;
};

}  // namespace

void write_usda(WriteJob& job, const Mesh<3>& mesh) { UsdaWriter(job, mesh).write(); }

}  // namespace lamina::io
