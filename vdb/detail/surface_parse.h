// The parsers behind read_surface(): bytes in, triangles out. They take any bytes whatsoever (they are
// fuzzed) and need memory in proportion to the number of bytes, whatever counts these claim.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "vdb/surface.h"

namespace lamina::detail {

/// `name` is used in messages only. Findings that leave a usable surface are appended to `warnings`, one line
/// each. Errors: kFileFormat, kFileUnsupported, kSurfaceEmpty.
Surface parse_stl(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);
Surface parse_obj(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);
Surface parse_ply(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings);

/// Tag of triangles that belong to no named solid or group.
inline constexpr const char* kDefaultTag = "surface";

/// What the text of a number holds. std::from_chars: the same result in every locale.
/// Accepts a leading '+', "nan" and "inf"; a value beyond double becomes +-infinity, one below it 0.
/// Returns false, leaving `value` alone, when the text is anything else or has something behind the number.
bool parse_number(std::string_view text, double& value);

/// An integer of 64 bits that fills the whole text; false otherwise.
bool parse_integer(std::string_view text, std::int64_t& value);

/// True for the white space of the C locale.
inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Equality with a lower-case ASCII keyword, ignoring case.
bool equals_keyword(std::string_view text, std::string_view keyword);

/// Cuts the next white-space separated word off `text`; empty at its end.
std::string_view next_word(std::string_view& text);

std::string_view trim(std::string_view text);

/// 1-based number of the line that holds byte `offset`.
std::int64_t line_at(std::string_view bytes, std::size_t offset);

/// True when `bytes` begin like text: no control characters among the first 512 but white space.
bool looks_like_text(std::string_view bytes);

/// A text from a file made fit for messages and JSON: at most 200 bytes, valid UTF-8, no control characters
/// ('?' stands for what was not).
std::string printable(std::string_view text);

/// Hands out tag numbers by name; a tag exists once a triangle uses it.
class TagList {
 public:
  explicit TagList(Surface& surface) : surface_(surface) {}
  /// Names the tag of the triangles to come.
  void select(std::string_view name);
  /// Tag of the next triangle.
  Index current();

 private:
  Surface& surface_;
  std::string name_ = kDefaultTag;
  Index current_ = kNone;
  std::map<std::string, Index> known_;
};

/// A kind of flaw, counted, with the place of its first occurrence.
struct Flaw {
  std::int64_t count = 0;
  std::size_t offset = 0;
  void note(std::size_t at) {
    if (count++ == 0) offset = at;
  }
};

/// Appends the triangles of a fan around the first corner. Corners out of [0, points) are looked for later,
/// by drop_bad_corners().
void add_fan(Surface& surface, const std::vector<Index>& corners, Index tag);

/// Removes triangles with a corner out of [0, points.size()); returns how many.
std::int64_t drop_bad_corners(Surface& surface);

/// The warning that says so, of a file with `points` points.
std::string bad_corners_warning(const std::string& name, std::int64_t dropped, std::size_t points);

/// Throws kFileUnsupported when `count` points or triangles exceed what Index can number.
void check_index_range(std::uint64_t count, const std::string& name, const char* what);

}  // namespace lamina::detail
