// The data arrays of VTK XML files: ascii, base64 inline, or appended (raw or base64), compressed by zlib or
// not.
//
// Layout of one binary array: uncompressed, a header word with the number of bytes and the bytes; compressed,
// header words [blocks, bytes of a block, bytes of the last block or 0 when it is full, compressed bytes of
// each block] and the compressed blocks. A header word is UInt32 or UInt64 as the file says. In base64,
// header and data may be encoded apart or together: decoding four characters at a time, each group ending
// where its padding says, serves both.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/file.h"
#include "core/parallel.h"
#include "core/types.h"
#include "mesh/io/raw.h"

namespace lamina::io {

enum class ScalarType {
  kInt8,
  kUInt8,
  kInt16,
  kUInt16,
  kInt32,
  kUInt32,
  kInt64,
  kUInt64,
  kFloat32,
  kFloat64
};

constexpr bool is_integer(ScalarType type) {
  return type != ScalarType::kFloat32 && type != ScalarType::kFloat64;
}

/// One <DataArray>.
struct DataArray {
  enum class Encoding { kAscii, kInline, kAppended };
  std::string name;
  ScalarType type = ScalarType::kFloat64;
  int components = 1;
  Encoding encoding = Encoding::kAscii;
  std::string_view text;     ///< for kAscii and kInline
  std::uint64_t offset = 0;  ///< for kAppended, from the byte behind the underscore
  std::size_t place = 0;     ///< of the element in the file
};

/// What all arrays of a file share.
struct DataLayout {
  bool swap = false;  ///< the file's byte order is not the host's
  bool wide_header = false;
  bool compressed = false;
  bool base64 = false;        ///< of the appended data
  std::string_view appended;  ///< bytes behind the underscore
};

/// Values of an array that must hold `expected` of them. T: double, Index, std::int64_t or std::uint8_t;
/// numbers that T cannot hold are a format error. Errors: kFileFormat naming array and place. Never allocates
/// more than the bytes present can describe (for zlib at most 1032 times their number).
template <class T>
std::vector<T> read_values(const Source& source, const DataLayout& layout, const DataArray& array,
                           std::size_t expected);

/// Stores values [begin, end) of an array.
using FillValues = std::function<void(std::size_t, std::size_t, char*)>;

/// A binary array ready to be written: header words and compressed blocks, or the values themselves, which
/// are asked for when they are written.
struct EncodedArray {
  std::vector<std::uint64_t> header;
  std::vector<std::string> blocks;
  std::size_t values = 0, value_size = 0;
  FillValues fill;                           ///< of an array that is not compressed
  [[nodiscard]] std::uint64_t size() const;  ///< bytes in the file
  void write(OutputFile& out) const;
};

/// n values of `value_size` bytes, compressed in blocks of 1 MiB, in parallel; the bytes do not depend on the
/// number of threads. Not compressed: `fill` is kept.
EncodedArray encode_values(std::size_t n, std::size_t value_size, const FillValues& fill, bool compress);

}  // namespace lamina::io
