// Tokens of a GMF file: the same interface over its ascii and its binary form, so that sections are read
// once.
//
// Both sources check, before a section is read, that its records can fit in what is left of the file; the
// reading of single numbers then needs no checks in binary, and allocations are bounded by the file size.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

#include "mesh/io/raw.h"
#include "mesh/io/text.h"

namespace lamina::io {

/// Keyword numbers of the format.
enum class Gmf : std::int32_t {
  kNone = 0,
  kDimension = 3,
  kVertices = 4,
  kEdges = 5,
  kTriangles = 6,
  kTetrahedra = 8,
  kCorners = 13,
  kRidges = 14,
  kRequiredVertices = 15,
  kRequiredEdges = 16,
  kRequiredTriangles = 17,
  kEnd = 54,
  kSolAtVertices = 62,
};

/// True when the bytes begin like a binary GMF file of either byte order.
bool is_binary_gmf(std::string_view bytes);

class BinaryGmf {
 public:
  /// Reads the header. Errors: kFileFormat, kFileUnsupported (version).
  explicit BinaryGmf(const Source& source);

  /// The next keyword; kEnd at the end. Skips what is left of the current section.
  Gmf next_keyword();
  /// A 32-bit number of a section header: dimension, number of solutions and their types.
  int word();
  /// Number of records of a section.
  std::int64_t count();
  /// Throws unless `records` of so many numbers are left in the section.
  void expect(std::int64_t records, int reals, int integers);
  double real() {
    if (version_ > 1) return get<double>();
    return get<float>();
  }
  std::int64_t integer() { return version_ > 3 ? get<std::int64_t>() : get<std::int32_t>(); }
  /// Where the last number was read.
  [[nodiscard]] std::string place() const { return byte_of(last_); }

 private:
  template <class T>
  T get() {
    T value;
    last_ = at_;
    if (!swap_) {
      std::memcpy(&value, source_->bytes.data() + at_, sizeof(T));
    } else {
      char turned[sizeof(T)];
      for (std::size_t i = 0; i < sizeof(T); ++i) turned[sizeof(T) - 1 - i] = source_->bytes[at_ + i];
      std::memcpy(&value, turned, sizeof(T));
    }
    at_ += sizeof(T);
    return value;
  }
  void need(std::size_t bytes);

  const Source* source_;
  std::size_t at_ = 0, last_ = 0, section_end_ = 0;
  int version_ = 2;
  bool swap_ = false;
};

class AsciiGmf {
 public:
  explicit AsciiGmf(const Source& source);

  Gmf next_keyword();
  int word() { return text_.index(); }
  std::int64_t count() { return text_.integer(); }
  void expect(std::int64_t records, int reals, int integers) { text_.expect(records, reals + integers); }
  double real() { return text_.real(); }
  std::int64_t integer() { return text_.integer(); }
  [[nodiscard]] std::string place() const { return text_.place(); }

 private:
  TextSource text_;
};

}  // namespace lamina::io
