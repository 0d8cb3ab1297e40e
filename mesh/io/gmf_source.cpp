#include "mesh/io/gmf_source.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>
#include <utility>

namespace lamina::io {
namespace {

constexpr bool is_space(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}
constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// Keywords that are read; every other word starts a section to be skipped.
constexpr std::pair<std::string_view, Gmf> kKeywords[] = {
    {"Dimension", Gmf::kDimension},         {"Vertices", Gmf::kVertices},     {"Edges", Gmf::kEdges},
    {"Triangles", Gmf::kTriangles},         {"Tetrahedra", Gmf::kTetrahedra}, {"End", Gmf::kEnd},
    {"SolAtVertices", Gmf::kSolAtVertices},
};

/// from_chars takes no plus sign.
std::string_view without_plus(std::string_view token) {
  if (token.size() > 1 && token.front() == '+' && token[1] != '-') token.remove_prefix(1);
  return token;
}

/// At most 40 printable characters of a token, for messages.
std::string shown(std::string_view token) {
  std::string text;
  for (const char c : token.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
  return text;
}

}  // namespace

bool is_binary_gmf(std::string_view bytes) {
  return bytes.size() >= 4 && (bytes.substr(0, 4) == std::string_view("\1\0\0\0", 4) ||
                               bytes.substr(0, 4) == std::string_view("\0\0\0\1", 4));
}

BinaryGmf::BinaryGmf(const Source& source) : source_(&source), section_end_(source.bytes.size()) {
  need(8);
  swap_ = source.bytes[0] == '\0';
  at_ = 4;
  version_ = get<std::int32_t>();
  if (version_ < 1 || version_ > 4)
    fail_unsupported(source, fmt::format("binary GMF version {}; versions 1 to 4 are read", version_));
  section_end_ = at_;
}

Gmf BinaryGmf::next_keyword() {
  if (section_end_ == 0 || section_end_ == source_->bytes.size()) return Gmf::kEnd;
  at_ = section_end_;
  const std::size_t start = at_;
  section_end_ = source_->bytes.size();
  need(4);
  const auto keyword = get<std::int32_t>();
  if (keyword == static_cast<std::int32_t>(Gmf::kEnd)) return Gmf::kEnd;
  need(version_ > 2 ? 8 : 4);
  const std::int64_t next = version_ > 2 ? get<std::int64_t>() : get<std::int32_t>();
  last_ = start;
  if (next == 0) {
    section_end_ = 0;  // the last section, ended by the file
  } else if (next < static_cast<std::int64_t>(at_) ||
             next > static_cast<std::int64_t>(source_->bytes.size())) {
    fail_format(*source_, place(),
                fmt::format("keyword {} says the next section starts at byte {}, which must lie in {}..{}",
                            keyword, next, at_, source_->bytes.size()));
  } else {
    section_end_ = static_cast<std::size_t>(next);
  }
  return static_cast<Gmf>(keyword);
}

int BinaryGmf::word() {
  need(4);
  return get<std::int32_t>();
}

std::int64_t BinaryGmf::count() {
  need(version_ > 3 ? 8 : 4);
  return integer();
}

void BinaryGmf::expect(std::int64_t records, int reals, int integers) {
  const std::int64_t size = reals * (version_ > 1 ? 8 : 4) + integers * (version_ > 3 ? 8 : 4);
  const auto end = static_cast<std::int64_t>(section_end_ == 0 ? source_->bytes.size() : section_end_);
  const std::int64_t left = (end - static_cast<std::int64_t>(at_)) / size;
  if (records < 0 || records > left || records > std::numeric_limits<Index>::max())
    fail_format(*source_, place(),
                fmt::format("a count of {}, but the section has room for {}", records, left));
}

void BinaryGmf::need(std::size_t bytes) {
  const std::size_t end = section_end_ == 0 ? source_->bytes.size() : section_end_;
  if (at_ > end || end - at_ < bytes)
    fail_format(*source_, byte_of(at_), "the section or the file ends here");
}

AsciiGmf::AsciiGmf(const Source& source) : source_(&source) {
  if (token() != "MeshVersionFormatted")
    fail_format(source, place(),
                "a GMF file starts with MeshVersionFormatted (ascii) or the number 1 (binary)");
  integer();
}

std::string_view AsciiGmf::token() {
  const std::string_view text = source_->bytes;
  while (at_ < text.size()) {
    if (is_space(text[at_])) {
      ++at_;
    } else if (text[at_] == '#') {
      while (at_ < text.size() && text[at_] != '\n') ++at_;
    } else {
      break;
    }
  }
  last_ = at_;
  while (at_ < text.size() && !is_space(text[at_]) && text[at_] != '#') ++at_;
  return text.substr(last_, at_ - last_);
}

Gmf AsciiGmf::next_keyword() {
  for (std::string_view t = token(); !t.empty(); t = token()) {
    if (!is_letter(t.front())) continue;
    for (const auto& [name, keyword] : kKeywords)
      if (t == name) return keyword;
  }
  return Gmf::kEnd;
}

int AsciiGmf::word() {
  const std::int64_t value = integer();
  if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max())
    fail_format(*source_, place(), fmt::format("the number {} does not fit 32 bits", value));
  return static_cast<int>(value);
}

std::int64_t AsciiGmf::count() { return integer(); }

void AsciiGmf::expect(std::int64_t records, int reals, int integers) {
  // A number takes a digit and a separator at least; the last one may lack the separator.
  const auto left = static_cast<std::int64_t>(source_->bytes.size() - at_);
  const std::int64_t most = (left + 1) / (2 * (reals + integers));
  if (records < 0 || records > most || records > std::numeric_limits<Index>::max())
    fail_format(
        *source_, place(),
        fmt::format("a count of {}, but the rest of the file has room for at most {}", records, most));
}

double AsciiGmf::real() {
  const std::string_view t = without_plus(token());
  double value = 0.0;
  const auto [end, error] = std::from_chars(t.data(), t.data() + t.size(), value);
  // Out of range happens for denormals, too: both are taken as format errors rather than rounded to 0 or
  // infinity.
  if (error != std::errc() || end != t.data() + t.size())
    fail_format(*source_, place(), fmt::format("expected a number, found \"{}\"", shown(t)));
  return value;
}

std::int64_t AsciiGmf::integer() {
  const std::string_view t = without_plus(token());
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(t.data(), t.data() + t.size(), value);
  if (error != std::errc() || end != t.data() + t.size())
    fail_format(*source_, place(), fmt::format("expected an integer, found \"{}\"", shown(t)));
  return value;
}

}  // namespace lamina::io
