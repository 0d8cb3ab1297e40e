#include "mesh/io/foam.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "mesh/io/text.h"

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

fs::path polymesh_folder(const fs::path& path) {
  if (lower_extension(path) == ".foam") return path.parent_path() / "constant" / "polyMesh";
  return path.has_filename() ? path : path.parent_path();
}

/// A file of OpenFOAM behind its header.
class FoamFile {
 public:
  explicit FoamFile(const Source& source) : source_(source), text_(source, '\0', "();") {
    skip_comments();
    if (text_.word() != "FoamFile") text_.fail("an OpenFOAM file starts with FoamFile");
    bool open = false;
    for (std::string_view w = next();; w = next()) {
      if (w.empty()) text_.fail("the header FoamFile does not end");
      if (w == "{") open = true;
      if (w == "}") break;
      if (!open) text_.fail("expected { behind FoamFile");
      if (w == "format") {
        binary_ = next() == "binary";
      } else if (w == "class") {
        class_ = next();
      } else if (w == "arch") {
        read_arch(text_.line());
      }
    }
    skip_comments();
  }

  [[nodiscard]] std::string_view kind() const { return class_; }
  TextSource& text() { return text_; }

  /// The next word, comments passed over.
  std::string_view next() {
    skip_comments();
    return text_.word();
  }

  /// Labels of a list "N(...)".
  std::vector<Index> labels() {
    const std::int64_t n = count(binary_ ? label_size_ : 2);
    if (n > 0 && !binary_ && !text_.at_end() && source_.bytes[text_.position()] == '{')
      fail_unsupported(source_, "a list in the short form N{value}");
    std::vector<Index> list(static_cast<std::size_t>(n));
    if (!binary_) {
      text_.expect(n, 1);
      for (Index& v : list) v = text_.index();
      return list;
    }
    ByteSource in = bytes(n, label_size_);
    for (Index& v : list)
      v = to_index(label_size_ == 8 ? in.next<std::int64_t>() : in.next<std::int32_t>(), "label", source_,
                   in.place());
    text_.seek(in.position());
    return list;
  }

  std::vector<Vec3> vectors() {
    const std::int64_t n = count(binary_ ? 3 * scalar_size_ : 6);
    std::vector<Vec3> list(static_cast<std::size_t>(n));
    if (!binary_) {
      text_.expect(n, 3);
      for (Vec3& x : list)
        for (int k = 0; k < 3; ++k) x[k] = text_.real();
      return list;
    }
    ByteSource in = bytes(n, 3 * scalar_size_);
    for (Vec3& x : list)
      for (int k = 0; k < 3; ++k) x[k] = scalar_size_ == 8 ? in.next<double>() : in.next<float>();
    return list;
  }

  /// Triangles of a faceList (ascii) or a faceCompactList.
  std::vector<std::array<Index, 3>> triangles() {
    std::vector<std::array<Index, 3>> list;
    if (!binary_) {
      const std::int64_t n = count(8);
      list.resize(static_cast<std::size_t>(n));
      for (auto& face : list) {
        check_corners(text_.integer());
        for (Index& v : face) v = text_.index();
      }
      return list;
    }
    const std::vector<Index> offsets = labels();
    close_list();
    const std::vector<Index> corners = labels();
    for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
      check_corners(static_cast<std::int64_t>(offsets[i + 1]) - offsets[i]);
      if (offsets[i] < 0 || static_cast<std::size_t>(offsets[i]) + 3 > corners.size())
        fail_format(source_, byte_of(text_.position()),
                    fmt::format("face {} ends behind the list of corners", i));
      list.push_back({corners[offsets[i]], corners[offsets[i] + 1], corners[offsets[i] + 2]});
    }
    return list;
  }

 private:
  void check_corners(std::int64_t n) const {
    if (n != 3) fail_unsupported(source_, fmt::format("a face of {} corners; tetrahedra are read", n));
  }

  void skip_comments() {
    for (;;) {
      if (text_.at_end()) return;
      const std::string_view rest = source_.bytes.substr(text_.position());
      if (rest.substr(0, 2) == "//") {
        static_cast<void>(text_.line());
      } else if (rest.substr(0, 2) == "/*") {
        const std::size_t end = rest.find("*/");
        if (end == std::string_view::npos) text_.fail("a comment that does not end");
        text_.seek(text_.position() + end + 2);
      } else {
        return;
      }
    }
  }

  void read_arch(std::string_view line) {
    if (line.find("MSB") != std::string_view::npos) fail_unsupported(source_, "big-endian OpenFOAM files");
    if (line.find("label=64") != std::string_view::npos) label_size_ = 8;
    if (line.find("scalar=32") != std::string_view::npos) scalar_size_ = 4;
  }

  /// The number in front of a list; its items take `size` bytes at least.
  std::int64_t count(std::size_t size) {
    skip_comments();
    const std::int64_t n = text_.integer(0, std::numeric_limits<Index>::max());
    const std::size_t left = source_.bytes.size() - text_.position();
    // The last item of a list in ascii may lack its blank.
    if (static_cast<std::size_t>(n) > (left + 1) / size)
      text_.fail(fmt::format("a count of {}, but the rest of the file has room for at most {}", n,
                             (left + 1) / size));
    return n;
  }

  /// Binary items stand right behind a parenthesis.
  ByteSource bytes(std::int64_t n, std::size_t size) {
    std::size_t at = text_.position();
    if (n > 0) {
      at = source_.bytes.find('(', at);
      if (at == std::string_view::npos) text_.fail("expected ( before binary data");
      ++at;
    }
    ByteSource in(source_, at, false);
    in.expect(n, size);
    return in;
  }
  void close_list() {
    const std::size_t at = source_.bytes.find(')', text_.position());
    if (at == std::string_view::npos) text_.fail("expected ) behind a list");
    text_.seek(at + 1);
  }

  const Source& source_;
  TextSource text_;
  bool binary_ = false;
  std::string_view class_;
  std::size_t label_size_ = 4, scalar_size_ = 8;
};

/// One patch.
struct Patch {
  std::string name;
  std::optional<Index> tag;
  std::int64_t start = -1, faces = -1;
};

/// Skips a block in braces whose entries are not read.
void skip_block(FoamFile& file) {
  for (int depth = 1; depth > 0;) {
    const std::string_view w = file.next();
    if (w.empty()) file.text().fail("a block in braces does not end");
    depth += w == "{";
    depth -= w == "}";
  }
}

std::vector<Patch> read_boundary(const Source& source) {
  FoamFile file(source);
  const std::size_t n = file.text().count(2);
  std::vector<Patch> patches(n);
  for (Patch& p : patches) {
    p.name = std::string(file.next());
    if (file.next() != "{") file.text().fail("expected { behind the name of a patch");
    for (std::string_view w = file.next(); w != "}"; w = file.next()) {
      if (w.empty()) file.text().fail("a patch does not end");
      if (w == "{") skip_block(file);
      if (w == "nFaces") p.faces = file.text().integer(0, std::numeric_limits<Index>::max());
      if (w == "startFace") p.start = file.text().integer(0, std::numeric_limits<Index>::max());
      if (w == "tag") p.tag = file.text().index();
    }
    if (p.faces < 0 || p.start < 0) file.text().fail("a patch without nFaces or startFace");
  }
  return patches;
}

void read_zones(const Source& source, RawCells<4>& cells) {
  FoamFile file(source);
  const std::size_t n = file.text().count(2);
  std::vector<std::string> names;
  std::vector<std::optional<Index>> given;
  std::vector<std::vector<Index>> members;
  for (std::size_t i = 0; i < n; ++i) {
    names.emplace_back(file.next());
    given.emplace_back();
    members.emplace_back();
    if (file.next() != "{") file.text().fail("expected { behind the name of a zone");
    for (std::string_view w = file.next(); w != "}"; w = file.next()) {
      if (w.empty()) file.text().fail("a zone does not end");
      if (w == "tag") given.back() = file.text().index();
      if (w != "cellLabels") continue;
      const std::string_view type = file.next();
      if (type != "List<label>") file.text().fail("expected List<label>");
      members.back() = file.labels();
    }
  }
  cells.tags.assign(cells.cells.size(), 0);
  const std::vector<Index> tags = tags_of_names(names, given, "zone", cells.names);
  for (std::size_t k = 0; k < n; ++k) {
    for (const Index c : members[k]) {
      if (c < 0 || static_cast<std::size_t>(c) >= cells.cells.size())
        fail_format(source, "zone " + names[k], fmt::format("names cell {} of {}", c, cells.cells.size()));
      cells.tags[c] = tags[k];
    }
  }
}

/// Cells from their four faces: the corners of the first, seen so that the fourth vertex is inside.
std::vector<std::array<Index, 4>> make_cells(const std::vector<std::array<Index, 3>>& faces,
                                             const std::vector<Index>& owner,
                                             const std::vector<Index>& neighbour, const FoamTexts& texts) {
  Index last = -1;
  for (const auto* list : {&owner, &neighbour})
    for (const Index c : *list) last = std::max(last, c);
  // As many cells as faces would have too few faces each.
  if (static_cast<std::size_t>(last) + 1 > faces.size() && last >= 0)
    fail_format(texts.owner, "end", fmt::format("names cell {}, but there are {} faces", last, faces.size()));
  const auto count = static_cast<std::size_t>(last + 1);
  std::vector<std::array<Index, 4>> cells(count, {kNone, kNone, kNone, kNone});
  std::vector<std::uint8_t> seen(count, 0);
  const auto add = [&](Index cell, std::array<Index, 3> face, bool outward, const Source& source) {
    if (cell < 0) fail_format(source, "end", fmt::format("names cell {}", cell));
    auto& corners = cells[cell];
    if (seen[cell]++ == 0) {
      // Facet 3 of a cell, (0, 2, 1), points outward.
      corners = outward ? std::array<Index, 4>{face[0], face[2], face[1], kNone}
                        : std::array<Index, 4>{face[0], face[1], face[2], kNone};
      return;
    }
    for (const Index v : face)
      if (std::find(corners.begin(), corners.begin() + 3, v) == corners.begin() + 3) {
        if (corners[3] != kNone && corners[3] != v) seen[cell] = 5;
        corners[3] = v;
      }
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    add(owner[f], faces[f], true, texts.owner);
    if (f < neighbour.size()) add(neighbour[f], faces[f], false, texts.neighbour);
  }
  for (std::size_t c = 0; c < count; ++c)
    if (seen[c] != 4 || cells[c][3] == kNone)
      fail_unsupported(texts.owner, fmt::format("cell {} (counted from 0) is not a tetrahedron", c));
  return cells;
}

}  // namespace

AnyMesh parse_foam(const FoamTexts& texts) {
  RawMesh raw;
  raw.points = FoamFile(texts.points).vectors();
  const std::vector<std::array<Index, 3>> faces = FoamFile(texts.faces).triangles();
  const std::vector<Index> owner = FoamFile(texts.owner).labels(),
                           neighbour = FoamFile(texts.neighbour).labels();
  if (owner.size() != faces.size() || neighbour.size() > faces.size())
    fail_format(
        texts.owner, "end",
        fmt::format("{} owners and {} neighbours of {} faces", owner.size(), neighbour.size(), faces.size()));
  raw.tets.cells = make_cells(faces, owner, neighbour, texts);
  raw.tets.place = raw.triangles.place = "faces";
  if (!texts.zones.bytes.empty()) read_zones(texts.zones, raw.tets);
  const std::vector<Patch> patches = read_boundary(texts.boundary);
  std::vector<std::string> names;
  std::vector<std::optional<Index>> given;
  for (const Patch& p : patches) {
    names.push_back(p.name);
    given.push_back(p.tag);
  }
  const std::vector<Index> tags = tags_of_names(names, given, "facet", raw.triangles.names);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const Patch& p = patches[k];
    if (p.start + p.faces > static_cast<std::int64_t>(faces.size()))
      fail_format(texts.boundary, "patch " + p.name,
                  fmt::format("faces {} to {} of {}", p.start, p.start + p.faces, faces.size()));
    if (p.name == "defaultFaces") {
      raw.triangles.names.erase(tags[k]);
      continue;  // faces that were no facets
    }
    for (std::int64_t f = p.start; f < p.start + p.faces; ++f) {
      raw.triangles.cells.push_back(faces[f]);
      raw.triangles.tags.push_back(tags[k]);
    }
  }
  return assemble(std::move(raw), texts.owner);
}

AnyMesh read_foam(const fs::path& path) {
  const fs::path folder = polymesh_folder(path);
  const std::array<const char*, 6> names = {"points", "faces", "owner", "neighbour", "boundary", "cellZones"};
  std::array<std::unique_ptr<MappedFile>, 6> files;
  std::array<Source, 6> sources;
  std::error_code ec;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const fs::path file = folder / names[i];
    if (!fs::exists(file, ec) && fs::exists(file.string() + ".gz", ec))
      throw Error(ErrorCode::kFileUnsupported,
                  fmt::format("{}.gz: compressed; unpack it with gunzip first", file.string()));
    if (i == 5 && !fs::exists(file, ec)) continue;
    files[i] = std::make_unique<MappedFile>(file);
    sources[i] = {files[i]->bytes(), file.string()};
  }
  return parse_foam({sources[0], sources[1], sources[2], sources[3], sources[4], sources[5]});
}

std::vector<fs::path> foam_files(const fs::path& path) {
  const fs::path folder = polymesh_folder(path);
  std::vector<fs::path> files;
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary", "cellZones"})
    files.push_back(folder / name);
  if (lower_extension(path) == ".foam") files.push_back(path);
  return files;
}

}  // namespace lamina::io
