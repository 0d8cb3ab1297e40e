// STL. The format has no magic number: binary files may begin with "solid", counts may be wrong, files may be
// cut. A file whose size is 84 + 50 count is binary whatever it contains; else text is ascii and anything
// else is binary with a wrong count. The ascii reader goes by keywords, so that line breaks, missing normals
// and missing closing keywords do not matter; stored normals are ignored, the order of the corners decides.
#include <fmt/core.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/surface_parse.h"

namespace lamina::detail {
namespace {

static_assert(std::endian::native == std::endian::little, "STL is read by memcpy");

constexpr std::size_t kHeader = 84;
constexpr std::size_t kRecord = 50;
/// Coordinates beyond it in a file whose size is wrong as well say that this is no STL at all.
constexpr double kAbsurd = 1e15;

Vec3 corner_of(const char* record, int corner) {
  float xyz[3];
  std::memcpy(xyz, record + 12 + 12 * corner, sizeof xyz);
  return {xyz[0], xyz[1], xyz[2]};
}

/// A name for content that is something else, by its first bytes; empty if unknown.
std::string other_content(std::string_view bytes) {
  if (bytes.starts_with("\x1f\x8b")) return " (it is gzip-compressed: unpack it first)";
  if (bytes.starts_with("\xfd"
                        "7zXZ"))
    return " (it is xz-compressed: unpack it first)";
  if (bytes.starts_with("PK\x03\x04")) return " (it is a zip archive: unpack it first)";
  return {};
}

std::uint32_t claimed_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

/// Number of facets to take from a binary file, with a warning where the header disagrees with the size.
std::size_t facets_to_take(std::string_view bytes, const std::string& name,
                           std::vector<std::string>& warnings) {
  const std::size_t claimed = claimed_count(bytes);
  const std::size_t room = bytes.size() - kHeader;
  const std::size_t whole = room / kRecord;
  if (room == claimed * kRecord) return claimed;
  if (claimed > whole) {
    warnings.push_back(
        fmt::format("{}: cut short or wrong count: the header promises {}, the file holds {}{}", name,
                    counted(static_cast<std::int64_t>(claimed), "facet"), whole,
                    room % kRecord != 0 ? " and a piece" : ""));
    return whole;
  }
  if (room % kRecord == 0 || claimed == 0) {
    warnings.push_back(fmt::format("{}: the header promises {}, the file holds {}: all taken", name,
                                   counted(static_cast<std::int64_t>(claimed), "facet"), whole));
    return whole;
  }
  warnings.push_back(fmt::format("{}: {} behind the last facet ignored", name,
                                 counted(static_cast<std::int64_t>(room - claimed * kRecord), "byte")));
  return claimed;
}

/// Random bytes read as floats are absurd almost surely; so are most files that are not STL.
void check_plausible(const Surface& surface, const std::string& name, std::string_view bytes) {
  const auto absurd = [](const Vec3& p) { return !(p.cwiseAbs().maxCoeff() < kAbsurd); };
  std::size_t count = 0, first = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!absurd(surface.points[3 * t]) && !absurd(surface.points[3 * t + 1]) &&
        !absurd(surface.points[3 * t + 2]))
      continue;
    if (count++ == 0) first = t;
  }
  if (4 * count > surface.triangles.size())
    throw Error(
        ErrorCode::kFileFormat,
        fmt::format("{}: neither binary nor ascii STL{}: {} bytes do not fit {} facets, and facet {} at byte "
                    "{} has coordinates that are not finite or beyond {:g}",
                    name, other_content(bytes), bytes.size(), claimed_count(bytes), first + 1,
                    kHeader + kRecord * first, kAbsurd));
}

Surface parse_binary(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings) {
  if (bytes.size() < kHeader)
    throw Error(ErrorCode::kFileFormat,
                fmt::format("{}: neither binary nor ascii STL{}: {} bytes, a binary file has at least {}",
                            name, other_content(bytes), bytes.size(), kHeader));
  const bool fits = bytes.size() - kHeader == claimed_count(bytes) * kRecord;
  const std::size_t count = facets_to_take(bytes, name, warnings);
  check_index_range(3 * static_cast<std::uint64_t>(count), name, "corners");
  Surface surface;
  surface.points.resize(3 * count);
  surface.triangles.resize(count);
  surface.tags.assign(count, 0);
  if (count > 0) surface.tag_names.emplace_back(kDefaultTag);
  for (std::size_t t = 0; t < count; ++t) {
    const char* record = bytes.data() + kHeader + kRecord * t;
    const auto first = static_cast<Index>(3 * t);
    for (int k = 0; k < 3; ++k) surface.points[3 * t + static_cast<std::size_t>(k)] = corner_of(record, k);
    surface.triangles[t] = {first, first + 1, first + 2};
  }
  if (!fits) check_plausible(surface, name, bytes);
  return surface;
}

/// Reads one ascii file. Offsets are bytes from its start.
class AsciiReader {
 public:
  AsciiReader(std::string_view bytes, const std::string& name)
      : bytes_(bytes), name_(name), tags_(surface_) {}

  Surface read(std::vector<std::string>& warnings);

 private:
  std::string_view word();
  [[nodiscard]] std::size_t offset_of(std::string_view word) const {
    return static_cast<std::size_t>(word.data() - bytes_.data());
  }
  std::string_view rest_of_line();
  void vertex(std::string_view keyword);
  void finish_facet();
  void handle(std::string_view keyword);
  void report(std::vector<std::string>& warnings) const;
  void warn(std::vector<std::string>& warnings, const Flaw& flaw, const char* text) const;

  enum class State { kOutside, kHead, kLoop, kTail };

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  Surface surface_;
  TagList tags_;
  State state_ = State::kOutside;
  std::size_t facet_offset_ = 0;
  std::vector<Vec3> corners_;
  bool bad_corner_ = false;
  bool solid_open_ = false, cut_ = false;
  Flaw bad_number_, few_corners_, many_corners_, unknown_;
};

std::string_view AsciiReader::word() {
  while (at_ < bytes_.size() && is_space(bytes_[at_])) ++at_;
  const std::size_t begin = at_;
  while (at_ < bytes_.size() && !is_space(bytes_[at_])) ++at_;
  return bytes_.substr(begin, at_ - begin);
}

std::string_view AsciiReader::rest_of_line() {
  const std::size_t begin = at_;
  at_ = std::min(bytes_.find_first_of("\r\n", at_), bytes_.size());
  return bytes_.substr(begin, at_ - begin);
}

void AsciiReader::vertex(std::string_view keyword) {
  Vec3 p;
  for (int k = 0; k < 3; ++k) {
    const std::size_t before = at_;
    const std::string_view text = word();
    if (text.empty()) {
      cut_ = true;
      return;
    }
    if (parse_number(text, p[k])) continue;
    if (at_ == bytes_.size()) {  // the last word of the file, broken: the cut, not a misprint
      cut_ = true;
      return;
    }
    bad_number_.note(offset_of(keyword));
    bad_corner_ = true;
    // A keyword in place of a number is read again as a keyword.
    if (equals_keyword(text, "vertex") || equals_keyword(text, "endloop") || equals_keyword(text, "endfacet"))
      at_ = before;
    return;
  }
  corners_.push_back(p);
}

void AsciiReader::finish_facet() {
  if (!bad_corner_) {
    if (corners_.size() < 3) {
      few_corners_.note(facet_offset_);
    } else {
      if (corners_.size() > 3) many_corners_.note(facet_offset_);
      const auto first = static_cast<Index>(surface_.points.size());
      check_index_range(surface_.points.size() + corners_.size(), name_, "corners");
      surface_.points.insert(surface_.points.end(), corners_.begin(), corners_.end());
      const Index tag = tags_.current();
      for (Index k = 2; k < static_cast<Index>(corners_.size()); ++k) {
        surface_.triangles.push_back({first, first + k - 1, first + k});
        surface_.tags.push_back(tag);
      }
    }
  }
  corners_.clear();
  bad_corner_ = false;
}

void AsciiReader::handle(std::string_view keyword) {
  if (state_ == State::kLoop && equals_keyword(keyword, "vertex")) {
    vertex(keyword);
  } else if (equals_keyword(keyword, "endloop") || equals_keyword(keyword, "endfacet")) {
    if (state_ == State::kLoop || (state_ == State::kHead && equals_keyword(keyword, "endfacet")))
      finish_facet();
    state_ = equals_keyword(keyword, "endfacet") ? State::kOutside : State::kTail;
  } else if (equals_keyword(keyword, "facet")) {
    if (state_ == State::kHead || state_ == State::kLoop) finish_facet();
    state_ = State::kHead;
    facet_offset_ = offset_of(keyword);
  } else if (state_ == State::kHead) {
    // The normal is skipped whatever it holds; a loop begins the corners.
    if (equals_keyword(keyword, "loop")) state_ = State::kLoop;
  } else if (equals_keyword(keyword, "solid") || equals_keyword(keyword, "endsolid")) {
    if (state_ == State::kLoop) finish_facet();
    state_ = State::kOutside;
    solid_open_ = equals_keyword(keyword, "solid");
    const std::string_view solid_name = rest_of_line();
    if (solid_open_) tags_.select(solid_name);
  } else {
    unknown_.note(offset_of(keyword));
  }
}

void AsciiReader::warn(std::vector<std::string>& warnings, const Flaw& flaw, const char* text) const {
  if (flaw.count > 0)
    warnings.push_back(
        fmt::format("{}: line {}: {} ({} in all)", name_, line_at(bytes_, flaw.offset), text, flaw.count));
}

void AsciiReader::report(std::vector<std::string>& warnings) const {
  if (cut_ || state_ == State::kLoop || state_ == State::kHead)
    warnings.push_back(
        fmt::format("{}: cut short: the file ends inside a facet (line {}); {} kept", name_,
                    line_at(bytes_, facet_offset_),
                    counted(static_cast<std::int64_t>(surface_.triangles.size()), "whole facet")));
  else if (solid_open_)
    warnings.push_back(fmt::format("{}: no endsolid at the end: the file may be cut short", name_));
  warn(warnings, bad_number_, "facet dropped: a coordinate is missing or not a number");
  warn(warnings, few_corners_, "facet dropped: fewer than three vertices");
  warn(warnings, many_corners_, "facet of more than three vertices cut into triangles");
  warn(warnings, unknown_, "unknown word skipped");
}

Surface AsciiReader::read(std::vector<std::string>& warnings) {
  // Facets take about 190 bytes; a wrong guess costs a copy.
  surface_.points.reserve(bytes_.size() / 64);
  surface_.triangles.reserve(bytes_.size() / 192);
  surface_.tags.reserve(bytes_.size() / 192);
  while (!cut_) {
    const std::string_view keyword = word();
    if (keyword.empty()) break;
    handle(keyword);
  }
  if (surface_.triangles.empty()) {
    const Flaw* const flaw = bad_number_.count > 0 ? &bad_number_ : unknown_.count > 0 ? &unknown_ : nullptr;
    if (flaw != nullptr) {
      std::string_view line = bytes_.substr(flaw->offset);
      line = line.substr(0, std::min<std::size_t>(line.find_first_of("\r\n"), 60));
      throw Error(ErrorCode::kFileFormat, fmt::format("{}: neither binary nor ascii STL: line {} reads '{}'",
                                                      name_, line_at(bytes_, flaw->offset), printable(line)));
    }
  }
  report(warnings);
  return std::move(surface_);
}

}  // namespace

Surface parse_stl(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings) {
  if (bytes.empty())
    throw Error(ErrorCode::kSurfaceEmpty, fmt::format("{}: the file is empty (0 bytes)", name));
  const bool fits = bytes.size() >= kHeader && bytes.size() - kHeader == claimed_count(bytes) * kRecord;
  Surface surface;
  if (!fits && looks_like_text(bytes)) {
    std::string_view text = bytes;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // the mark some editors put before UTF-8
    std::string_view rest = text;
    const std::string_view first = next_word(rest);
    if (!equals_keyword(first, "solid") && !equals_keyword(first, "facet"))
      throw Error(
          ErrorCode::kFileFormat,
          fmt::format("{}: neither binary nor ascii STL: text that begins with '{}' instead of 'solid'", name,
                      printable(first.substr(0, 40))));
    surface = AsciiReader(text, name).read(warnings);
  } else {
    surface = parse_binary(bytes, name, warnings);
  }
  if (surface.triangles.empty())
    throw Error(ErrorCode::kSurfaceEmpty,
                fmt::format("{}: an STL file without a whole facet ({} bytes)", name, bytes.size()));
  return surface;
}

}  // namespace lamina::detail
