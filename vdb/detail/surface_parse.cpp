#include "vdb/detail/surface_parse.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "core/error.h"
#include "core/words.h"

namespace lamina::detail {
namespace {

/// Length of the valid UTF-8 sequence at the start of `text`, 0 if there is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0 ? 2 : first >= 0xE0 && first < 0xF0 ? 3 : 4;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  // Overlong forms, surrogates and values beyond U+10FFFF differ in the second byte only.
  const unsigned second = byte(1);
  if (first == 0xE0 && second < 0xA0) return 0;
  if (first == 0xED && second > 0x9F) return 0;
  if (first == 0xF0 && second < 0x90) return 0;
  if (first == 0xF4 && second > 0x8F) return 0;
  return length;
}

/// The value of a well-formed number that no double can hold: 0 or infinity.
double beyond_double(std::string_view text) {
  const bool negative = text.front() == '-';
  if (negative) text.remove_prefix(1);
  const std::size_t exponent = text.find_first_of("eE");
  const bool small = exponent != std::string_view::npos ? text.substr(exponent + 1, 1) == "-"
                                                        : text.front() == '0' || text.front() == '.';
  const double size = small ? 0.0 : std::numeric_limits<double>::infinity();
  return negative ? -size : size;
}

}  // namespace

bool parse_number(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return false;
  }
  double result = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, result);
  if (stop != end || error == std::errc::invalid_argument) return false;
  value = error == std::errc() ? result : beyond_double(text);
  return true;
}

bool parse_integer(std::string_view text, std::int64_t& value) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  std::int64_t result = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, result);
  if (stop != end || error != std::errc()) return false;
  value = result;
  return true;
}

bool equals_keyword(std::string_view text, std::string_view keyword) {
  if (text.size() != keyword.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i] >= 'A' && text[i] <= 'Z' ? static_cast<char>(text[i] - 'A' + 'a') : text[i];
    if (c != keyword[i]) return false;
  }
  return true;
}

std::string_view next_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_space(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_space(text[end])) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::int64_t line_at(std::string_view bytes, std::size_t offset) {
  return 1 + std::count(bytes.begin(),
                        bytes.begin() + static_cast<std::ptrdiff_t>(std::min(offset, bytes.size())), '\n');
}

bool looks_like_text(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, 512);
  return std::all_of(head.begin(), head.end(),
                     [](char c) { return static_cast<unsigned char>(c) >= 0x20 || is_space(c); });
}

std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty() && result.size() < 200) {
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text.front());
    const bool good = length > 0 && first >= 0x20 && first != 0x7F;
    const std::size_t step = std::max<std::size_t>(length, 1);
    if (good) {
      if (result.size() + step > 200) break;
      result.append(text.substr(0, step));
    } else {
      result.push_back('?');
    }
    text.remove_prefix(step);
  }
  return result;
}

void TagList::select(std::string_view name) {
  name_ = printable(trim(name));
  if (name_.empty()) name_ = kDefaultTag;
  current_ = kNone;
}

Index TagList::current() {
  if (current_ == kNone) {
    const auto [entry, is_new] = known_.emplace(name_, static_cast<Index>(surface_.tag_names.size()));
    if (is_new) surface_.tag_names.push_back(name_);
    current_ = entry->second;
  }
  return current_;
}

void add_fan(Surface& surface, const std::vector<Index>& corners, Index tag) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    surface.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    surface.tags.push_back(tag);
  }
}

std::int64_t drop_bad_corners(Surface& surface) {
  const auto limit = static_cast<Index>(surface.points.size());
  std::size_t kept = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& corners = surface.triangles[t];
    if (std::any_of(corners.begin(), corners.end(), [&](Index i) { return i < 0 || i >= limit; })) continue;
    surface.triangles[kept] = corners;
    surface.tags[kept] = surface.tags[t];
    ++kept;
  }
  const auto dropped = static_cast<std::int64_t>(surface.triangles.size() - kept);
  surface.triangles.resize(kept);
  surface.tags.resize(kept);
  return dropped;
}

std::string bad_corners_warning(const std::string& name, std::int64_t dropped, std::size_t points) {
  return fmt::format("{}: {} points beyond the {} of the file", name,
                     counted(dropped, "triangle dropped: it names", "triangles dropped: they name"), points);
}

void check_index_range(std::uint64_t count, const std::string& name, const char* what) {
  constexpr auto kLimit = static_cast<std::uint64_t>(std::numeric_limits<Index>::max());
  if (count > kLimit)
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: {} {}, limit {}; thin the surface out", name, count, what, kLimit));
}

}  // namespace lamina::detail
