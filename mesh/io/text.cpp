#include "mesh/io/text.h"

#include <fmt/format.h>

#include <charconv>

namespace lamina::io {
namespace {

constexpr std::uint8_t kBlank = 1, kComment = 2;

/// from_chars takes no plus sign.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

std::string shown(std::string_view word) {
  std::string text;
  for (const char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
  return text;
}

TextSource::TextSource(const Source& source, char comment, std::string_view separators)
    : source_(&source), comment_(comment) {
  for (const char c : {' ', '\n', '\t', '\r', '\f', '\v'}) kind_[static_cast<unsigned char>(c)] = kBlank;
  for (const char c : separators) kind_[static_cast<unsigned char>(c)] = kBlank;
  if (comment != '\0') kind_[static_cast<unsigned char>(comment)] = kComment;
}

void TextSource::skip_blanks() {
  const std::string_view text = source_->bytes;
  for (; at_ < text.size(); ++at_) {
    const std::uint8_t kind = kind_[static_cast<unsigned char>(text[at_])];
    if (kind == 0) break;
    if (kind == kComment) at_ = std::min(text.find('\n', at_), text.size()) - 1;
  }
}

std::string_view TextSource::word() {
  skip_blanks();
  const std::string_view text = source_->bytes;
  last_ = at_;
  while (at_ < text.size() && !parts(text[at_])) ++at_;
  return text.substr(last_, at_ - last_);
}

std::string_view TextSource::word_of_line() {
  const std::string_view text = source_->bytes;
  while (at_ < text.size() && text[at_] != '\n' && kind_[static_cast<unsigned char>(text[at_])] == kBlank)
    ++at_;
  if (at_ == text.size() || parts(text[at_])) return {};
  return word();
}

std::string_view TextSource::line() {
  const std::string_view text = source_->bytes;
  last_ = at_;
  const std::size_t end = std::min(text.find('\n', at_), text.size());
  std::string_view found = text.substr(at_, end - at_);
  at_ = std::min(end + 1, text.size());
  if (comment_ != '\0') found = found.substr(0, found.find(comment_));
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!found.empty() && blank(found.front())) found.remove_prefix(1);
  while (!found.empty() && blank(found.back())) found.remove_suffix(1);
  return found;
}

double TextSource::real() {
  const std::string_view w = without_plus(word());
  double value = 0.0;
  const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), value);
  // Out of range happens for denormals, too: both are taken as format errors rather than rounded to 0 or
  // infinity.
  if (error != std::errc() || end != w.data() + w.size())
    fail(fmt::format("expected a number, found \"{}\"", shown(w)));
  return value;
}

std::int64_t TextSource::integer() {
  const std::string_view w = without_plus(word());
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), value);
  if (error != std::errc() || end != w.data() + w.size())
    fail(fmt::format("expected an integer, found \"{}\"", shown(w)));
  return value;
}

std::int64_t TextSource::integer(std::int64_t lowest, std::int64_t highest) {
  const std::int64_t value = integer();
  if (value < lowest || value > highest)
    fail(fmt::format("the number {} must lie in {}..{}", value, lowest, highest));
  return value;
}

void TextSource::expect(std::int64_t records, std::int64_t numbers) {
  // A number takes a digit and a separator at least; the last one may lack the separator.
  const auto left = static_cast<std::int64_t>(source_->bytes.size() - at_);
  const std::int64_t most = (left + 1) / (2 * numbers);
  if (records < 0 || records > most || records > std::numeric_limits<Index>::max())
    fail(fmt::format("a count of {}, but the rest of the file has room for at most {}", records, most));
}

std::size_t TextSource::count(std::int64_t numbers) {
  const std::int64_t n = integer();
  expect(n, numbers);
  return static_cast<std::size_t>(n);
}

bool TextSource::at_end() {
  skip_blanks();
  return at_ == source_->bytes.size();
}

void ByteSource::expect(std::int64_t records, std::size_t size) const {
  const std::size_t left = at_ < source_->bytes.size() ? source_->bytes.size() - at_ : 0;
  if (records < 0 || (size > 0 && static_cast<std::size_t>(records) > left / size))
    fail(fmt::format("needs {} x {} bytes, but the file ends after {}", records, size, left));
}

void fail_index(std::int64_t value, const char* what, const Source& source, const std::string& place) {
  fail_format(source, place, fmt::format("the {} {} does not fit 32 bits", what, value));
}

}  // namespace lamina::io
