// Wavefront OBJ: v and f statements, names from o and g; everything else (normals, texture, materials,
// free-form curves) is passed over. A broken v keeps its number as a point that is not finite, so that the
// numbering of the others holds; clean() drops the triangles that use it.
#include <fmt/core.h>

#include <limits>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/surface_parse.h"

namespace lamina::detail {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name), tags_(surface_) {}

  Surface read(std::vector<std::string>& warnings);

 private:
  bool next_statement(std::string_view& statement);
  void point(std::string_view arguments, std::size_t offset);
  void face(std::string_view arguments, std::size_t offset);
  void warn(std::vector<std::string>& warnings, const Flaw& flaw, const char* text) const;

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  std::string joined_;  ///< a statement whose lines were joined
  Surface surface_;
  TagList tags_;
  std::vector<Index> corners_;
  Flaw bad_point_, bad_face_, few_corners_, unknown_;
};

/// The next line without its comment; lines ending with a backslash are joined.
bool ObjReader::next_statement(std::string_view& statement) {
  joined_.clear();
  while (at_ < bytes_.size()) {
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view line = trim(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    const bool goes_on = !line.empty() && line.back() == '\\';
    if (goes_on) line.remove_suffix(1);
    if (!goes_on && joined_.empty()) {
      statement = line.substr(0, line.find('#'));
      return true;
    }
    joined_.append(line).push_back(' ');
    if (goes_on) continue;
    break;
  }
  if (joined_.empty()) return false;
  statement = std::string_view(joined_).substr(0, joined_.find('#'));
  return true;
}

void ObjReader::point(std::string_view arguments, std::size_t offset) {
  Vec3 p;
  for (int k = 0; k < 3; ++k) {
    if (parse_number(next_word(arguments), p[k])) continue;
    bad_point_.note(offset);
    p.setConstant(std::numeric_limits<double>::quiet_NaN());
    break;
  }
  surface_.points.push_back(p);
}

void ObjReader::face(std::string_view arguments, std::size_t offset) {
  const auto points = static_cast<std::int64_t>(surface_.points.size());
  corners_.clear();
  for (std::string_view word = next_word(arguments); !word.empty(); word = next_word(arguments)) {
    std::int64_t index = 0;
    // v, v/vt, v//vn or v/vt/vn; a negative index counts back from the latest point.
    const bool good = parse_integer(word.substr(0, word.find('/')), index) && index != 0 &&
                      (index > 0 || index >= -points) && index < std::numeric_limits<Index>::max();
    if (!good) {
      bad_face_.note(offset);
      return;
    }
    corners_.push_back(static_cast<Index>(index > 0 ? index - 1 : points + index));
  }
  if (corners_.size() < 3) {
    few_corners_.note(offset);
    return;
  }
  check_index_range(surface_.triangles.size() + corners_.size(), name_, "triangles");
  add_fan(surface_, corners_, tags_.current());
}

void ObjReader::warn(std::vector<std::string>& warnings, const Flaw& flaw, const char* text) const {
  if (flaw.count > 0)
    warnings.push_back(
        fmt::format("{}: line {}: {} ({} in all)", name_, line_at(bytes_, flaw.offset), text, flaw.count));
}

Surface ObjReader::read(std::vector<std::string>& warnings) {
  std::int64_t statements = 0;
  std::string_view statement;
  for (std::size_t offset = at_; next_statement(statement); offset = at_) {
    const std::string_view keyword = next_word(statement);
    if (keyword.empty()) continue;
    ++statements;
    if (keyword == "v") {
      check_index_range(surface_.points.size() + 1, name_, "points");
      point(statement, offset);
    } else if (keyword == "f" || keyword == "fo") {
      face(statement, offset);
    } else if (keyword == "g" || keyword == "o") {
      tags_.select(statement);
    } else if (keyword != "vn" && keyword != "vt" && keyword != "vp" && keyword != "s" &&
               keyword != "usemtl" && keyword != "mtllib" && keyword != "l" && keyword != "p") {
      unknown_.note(offset);
    }
  }
  const std::int64_t dropped = drop_bad_corners(surface_);
  if (surface_.triangles.empty()) {
    if (surface_.points.empty() && unknown_.count > 0)
      throw Error(ErrorCode::kFileFormat,
                  fmt::format("{}: not an OBJ file: {} of {} statements are unknown, the "
                              "first at line {}",
                              name_, unknown_.count, statements, line_at(bytes_, unknown_.offset)));
    if (bad_face_.count > 0 || dropped > 0)
      throw Error(
          ErrorCode::kFileFormat,
          fmt::format("{}: no usable face: {} name points beyond the {} of the file, {} cannot be read",
                      name_, dropped, surface_.points.size(), bad_face_.count));
    throw Error(ErrorCode::kSurfaceEmpty,
                fmt::format("{}: an OBJ file with {} and no face", name_,
                            counted(static_cast<std::int64_t>(surface_.points.size()), "point")));
  }
  warn(warnings, bad_point_, "point without three coordinates; the faces that use it are dropped");
  warn(warnings, bad_face_, "face dropped: an index cannot be read or counts back before the first point");
  warn(warnings, few_corners_, "face dropped: fewer than three corners");
  warn(warnings, unknown_, "unknown statement skipped");
  if (dropped > 0) warnings.push_back(bad_corners_warning(name_, dropped, surface_.points.size()));
  return std::move(surface_);
}

}  // namespace

Surface parse_obj(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings) {
  if (trim(bytes).empty())
    throw Error(ErrorCode::kSurfaceEmpty,
                fmt::format("{}: the file is empty ({} bytes)", name, bytes.size()));
  if (!looks_like_text(bytes))
    throw Error(ErrorCode::kFileFormat, fmt::format("{}: not an OBJ file: binary content", name));
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);  // the mark some editors put before UTF-8
  return ObjReader(bytes, name).read(warnings);
}

}  // namespace lamina::detail
