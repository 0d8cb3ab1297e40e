// Reading text and binary numbers from the bytes of a file, with the place of what is wrong.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "mesh/io/raw.h"

namespace lamina::io {

/// At most 40 printable characters, for messages.
std::string shown(std::string_view word);

/// Words of a text, parted by blanks and by the characters of `separators`; comments run from `comment` to
/// the end of the line.
class TextSource {
 public:
  explicit TextSource(const Source& source, char comment = '\0', std::string_view separators = {});

  /// The next word, empty at the end of the file.
  std::string_view word();
  /// The next word if it is on the current line, else empty; the end of the line is not passed.
  std::string_view word_of_line();
  /// What is left of the current line without its comment, trimmed; goes on to the next line.
  std::string_view line();
  /// Numbers; errors: kFileFormat naming what stands there.
  double real();
  std::int64_t integer();
  std::int64_t integer(std::int64_t lowest, std::int64_t highest);
  /// A tag or another number of 32 bits.
  Index index() {
    return static_cast<Index>(integer(std::numeric_limits<Index>::min(), std::numeric_limits<Index>::max()));
  }
  /// Throws unless `records` records of so many numbers can stand in what is left of the file.
  void expect(std::int64_t records, std::int64_t numbers);
  /// A count that expect() finds possible.
  std::size_t count(std::int64_t numbers);

  [[nodiscard]] bool at_end();
  [[nodiscard]] std::size_t position() const { return at_; }
  void seek(std::size_t position) { at_ = position; }
  /// Line of the last word or number.
  [[nodiscard]] std::string place() const { return line_of(*source_, last_); }
  [[noreturn]] void fail(const std::string& what) const { fail_format(*source_, place(), what); }
  [[nodiscard]] const Source& source() const { return *source_; }

 private:
  [[nodiscard]] bool parts(char c) const { return kind_[static_cast<unsigned char>(c)] != 0; }
  void skip_blanks();

  const Source* source_;
  std::size_t at_ = 0, last_ = 0;
  char comment_;
  std::array<std::uint8_t, 256> kind_{};  ///< 1 blank or separator, 2 the start of a comment
};

/// Binary numbers one after another.
class ByteSource {
 public:
  ByteSource(const Source& source, std::size_t at, bool swap) : source_(&source), at_(at), swap_(swap) {}

  /// Throws unless `records` records of `size` bytes are left; then next() may be called for them.
  void expect(std::int64_t records, std::size_t size) const;
  template <class T>
  T get() {
    expect(1, sizeof(T));
    return next<T>();
  }
  /// Without a check of the end.
  template <class T>
  T next() {
    char raw[sizeof(T)];
    std::memcpy(raw, source_->bytes.data() + at_, sizeof(T));
    at_ += sizeof(T);
    if (swap_)
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }
  void skip(std::size_t bytes) {
    expect(1, bytes);
    at_ += bytes;
  }
  [[nodiscard]] std::size_t position() const { return at_; }
  [[nodiscard]] std::string place() const { return byte_of(at_); }
  [[noreturn]] void fail(const std::string& what) const { fail_format(*source_, place(), what); }

 private:
  const Source* source_;
  std::size_t at_;
  bool swap_;
};

[[noreturn]] void fail_index(std::int64_t value, const char* what, const Source& source,
                             const std::string& place);

/// Throws unless `value` fits an Index; `where` is a place in words or something that has one.
template <class Where>
Index to_index(std::int64_t value, const char* what, const Source& source, const Where& where) {
  if (value == static_cast<Index>(value)) return static_cast<Index>(value);
  if constexpr (std::is_convertible_v<Where, std::string>) {
    fail_index(value, what, source, where);
  } else {
    fail_index(value, what, source, where.place());
  }
}

}  // namespace lamina::io
