#include "mesh/io/vtu_data.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace lamina::io {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
constexpr std::size_t kWaveBytes = 16 * kBlockBytes;  // a multiple of every size of values
// Fastest level: on tetrahedra and coordinates level 6 saves a tenth of the bytes and takes several times as
// long. libdeflate, because on these data it packs 2.5 times as fast as zlib for 4 % more bytes (186 and 75
// MB/s a core) and unpacks 1.8 times as fast.
constexpr int kLevel = 1;
// No deflate stream expands by more than 1032 : 1; the rest covers its fixed overhead.
constexpr std::uint64_t kMaxExpansion = 1032;
constexpr std::uint64_t kExpansionSlack = 1024;

constexpr bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

std::size_t size_of(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUInt8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUInt16:
      return 2;
    case ScalarType::kInt32:
    case ScalarType::kUInt32:
    case ScalarType::kFloat32:
      return 4;
    default:
      return 8;
  }
}

/// An array of a file being read, and how to complain about it.
struct Context {
  const Source& source;
  const DataLayout& layout;
  const DataArray& array;

  [[noreturn]] void fail(const std::string& what) const {
    fail_format(source, line_of(source, array.place),
                fmt::format("data array \"{}\": {}", array.name.substr(0, 80), what));
  }
};

constexpr std::array<std::int8_t, 256> kBase64 = [] {
  std::array<std::int8_t, 256> table{};
  table.fill(-1);
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < digits.size(); ++i)
    table[static_cast<unsigned char>(digits[i])] = static_cast<std::int8_t>(i);
  return table;
}();

/// Decodes until `wanted` bytes are there or the text ends or stops being base64.
std::string decode_base64(std::string_view text, std::size_t wanted) {
  std::string bytes;
  bytes.reserve(std::min(wanted, text.size() / 4 * 3 + 3));
  std::uint32_t group = 0;
  int digits = 0, padding = 0;
  for (const char c : text) {
    if (is_blank(c)) continue;
    const int value = c == '=' && digits >= 2 ? 0 : kBase64[static_cast<unsigned char>(c)];
    if (value < 0 || (padding > 0 && c != '=')) break;
    if (c == '=') ++padding;
    group = group << 6 | static_cast<std::uint32_t>(value);
    if (++digits < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(group >> (16 - 8 * k) & 0xff);
    group = 0;
    digits = padding = 0;
    if (bytes.size() >= wanted) break;
  }
  if (bytes.size() > wanted) bytes.resize(wanted);
  return bytes;
}

/// The encoded bytes of an array: fetched as they are needed, because an array's length stands in its own
/// header.
class Bytes {
 public:
  explicit Bytes(const Context& c) : context_(c) {
    const bool appended = c.array.encoding == DataArray::Encoding::kAppended;
    base64_ = !appended || c.layout.base64;
    text_ = appended ? c.layout.appended : c.array.text;
    if (!appended) {
      while (!text_.empty() && is_blank(text_.front())) text_.remove_prefix(1);
      return;
    }
    if (c.array.offset > text_.size())
      c.fail(
          fmt::format("offset {} lies behind the {} bytes of appended data", c.array.offset, text_.size()));
    text_.remove_prefix(c.array.offset);
  }

  /// The first n bytes; fails when there are fewer. The view lives until the next call.
  std::string_view first(std::uint64_t n) {
    if (n > text_.size()) context_.fail(fmt::format("needs {} bytes, but the file ends before", n));
    if (!base64_) return text_.substr(0, n);
    if (decoded_.size() < n) decoded_ = decode_base64(text_, n);
    if (decoded_.size() < n)
      context_.fail(fmt::format("needs {} bytes of base64, found {}", n, decoded_.size()));
    return std::string_view(decoded_).substr(0, n);
  }

  /// Header word i.
  std::uint64_t word(std::size_t i) {
    const std::size_t size = context_.layout.wide_header ? 8 : 4;
    const std::string_view bytes = first((i + 1) * size);
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t at = i * size + (big_endian() ? k : size - 1 - k);
      value = value << 8 | static_cast<unsigned char>(bytes[at]);
    }
    return value;
  }

  [[nodiscard]] std::size_t available() const { return text_.size(); }
  [[nodiscard]] bool empty() const { return text_.empty(); }

 private:
  [[nodiscard]] bool big_endian() const { return context_.layout.swap; }

  Context context_;
  bool base64_ = false;
  std::string_view text_;
  std::string decoded_;
};

std::string deflate_block(const std::vector<char>& plain) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> deflate(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!deflate) throw std::bad_alloc();
  std::string packed(libdeflate_zlib_compress_bound(deflate.get(), plain.size()), '\0');
  packed.resize(
      libdeflate_zlib_compress(deflate.get(), plain.data(), plain.size(), packed.data(), packed.size()));
  if (packed.empty()) throw Error(ErrorCode::kInternal, "libdeflate failed to compress a block");
  packed.shrink_to_fit();
  return packed;
}

void inflate_block(const Context& c, std::string_view from, char* to, std::size_t size) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflate(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!inflate) throw std::bad_alloc();
  // Without a place for the number of bytes it must be `size`.
  const libdeflate_result status =
      libdeflate_zlib_decompress(inflate.get(), from.data(), from.size(), to, size, nullptr);
  if (status != LIBDEFLATE_SUCCESS)
    c.fail(fmt::format("a zlib block is damaged (status {})", static_cast<int>(status)));
}

std::vector<char> read_compressed(const Context& c, Bytes& bytes, std::uint64_t expected) {
  const std::uint64_t blocks = bytes.word(0), word = c.layout.wide_header ? 8 : 4;
  if (blocks > bytes.available() / word)
    c.fail(fmt::format("claims {} blocks, more than the file holds", blocks));
  if (blocks == 0) {
    if (expected != 0) c.fail(fmt::format("holds no data, expected {} bytes", expected));
    return {};
  }
  bytes.first((3 + blocks) * word);  // decodes the header once
  const std::uint64_t block = bytes.word(1), partial = bytes.word(2), last = partial == 0 ? block : partial;
  // Without overflow: (blocks - 1) * block + last == expected.
  if (last > expected ||
      (blocks > 1 &&
       (block == 0 || (expected - last) / block != blocks - 1 || (expected - last) % block != 0)) ||
      (blocks == 1 && last != expected))
    c.fail(fmt::format("{} blocks of {} bytes, the last of {}, where {} bytes are expected", blocks, block,
                       last, expected));
  std::vector<std::uint64_t> start(blocks + 1, (3 + blocks) * word);
  for (std::uint64_t i = 0; i < blocks; ++i) {
    const std::uint64_t size = bytes.word(3 + i), plain = i + 1 < blocks ? block : last;
    if (size > bytes.available() || plain > size * kMaxExpansion + kExpansionSlack)
      c.fail(fmt::format("block {} claims {} compressed bytes for {}", i, size, plain));
    start[i + 1] = start[i] + size;
  }
  const std::string_view data = bytes.first(start[blocks]);
  std::vector<char> plain(expected);
  for_each_index(
      blocks,
      [&](std::size_t i) {
        inflate_block(c, data.substr(start[i], start[i + 1] - start[i]), plain.data() + i * block,
                      i + 1 < blocks ? block : last);
      },
      1);
  return plain;
}

/// Converts one stored number; false when T cannot hold it.
template <class T, class S>
bool convert(S from, T& to) {
  if constexpr (std::is_floating_point_v<T>) {
    to = static_cast<T>(from);
    return true;
  } else if constexpr (std::is_floating_point_v<S>) {
    // The upper end is a power of two, thus exact in S, and itself too large.
    constexpr double end = 2.0 * static_cast<double>(std::numeric_limits<T>::max() / 2 + 1);
    if (!(from >= static_cast<S>(std::numeric_limits<T>::min()) && from < static_cast<S>(end)) ||
        from != std::floor(from))
      return false;
    to = static_cast<T>(from);
    return true;
  } else {
    to = static_cast<T>(from);
    return std::in_range<T>(from);
  }
}

template <class T, class S>
std::vector<T> convert_all(const Context& c, std::string_view bytes) {
  std::vector<T> values(bytes.size() / sizeof(S));
  if (std::is_same_v<T, S> && !c.layout.swap) {
    for_each_chunk(values.size(), 65536, [&](std::size_t begin, std::size_t end) {
      std::memcpy(values.data() + begin, bytes.data() + begin * sizeof(S), (end - begin) * sizeof(S));
    });
    return values;
  }
  for_each_index(
      values.size(),
      [&](std::size_t i) {
        char raw[sizeof(S)];
        std::memcpy(raw, bytes.data() + i * sizeof(S), sizeof(S));
        if (c.layout.swap) std::reverse(raw, raw + sizeof(S));
        S value;
        std::memcpy(&value, raw, sizeof(S));
        if (!convert(value, values[i]))
          c.fail(fmt::format("value {} is {}, out of the range of its kind", i, value));
      },
      65536);
  return values;
}

template <class T>
std::vector<T> convert_bytes(const Context& c, std::string_view bytes) {
  switch (c.array.type) {
    case ScalarType::kInt8:
      return convert_all<T, std::int8_t>(c, bytes);
    case ScalarType::kUInt8:
      return convert_all<T, std::uint8_t>(c, bytes);
    case ScalarType::kInt16:
      return convert_all<T, std::int16_t>(c, bytes);
    case ScalarType::kUInt16:
      return convert_all<T, std::uint16_t>(c, bytes);
    case ScalarType::kInt32:
      return convert_all<T, std::int32_t>(c, bytes);
    case ScalarType::kUInt32:
      return convert_all<T, std::uint32_t>(c, bytes);
    case ScalarType::kInt64:
      return convert_all<T, std::int64_t>(c, bytes);
    case ScalarType::kUInt64:
      return convert_all<T, std::uint64_t>(c, bytes);
    case ScalarType::kFloat32:
      return convert_all<T, float>(c, bytes);
    case ScalarType::kFloat64:
      return convert_all<T, double>(c, bytes);
  }
  c.fail("unknown type");
}

template <class T>
std::vector<T> read_ascii(const Context& c, std::size_t expected) {
  const std::string_view text = c.array.text;
  if (expected > text.size() / 2 + 1)
    c.fail(fmt::format("{} values are expected, but the text has {} characters", expected, text.size()));
  std::vector<T> values;
  values.reserve(expected);
  std::size_t at = 0;
  for (;;) {
    while (at < text.size() && is_blank(text[at])) ++at;
    if (at == text.size()) break;
    using Number = std::conditional_t<std::is_floating_point_v<T>, double, std::int64_t>;
    Number number = 0;
    if (text[at] == '+') ++at;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), number);
    T value{};
    if (error != std::errc() || !convert(number, value) ||
        (end != text.data() + text.size() && !is_blank(*end)))
      c.fail(fmt::format("value {} is not a number of its kind", values.size()));
    if (values.size() == expected) c.fail(fmt::format("holds more than the expected {} values", expected));
    values.push_back(value);
    at = static_cast<std::size_t>(end - text.data());
  }
  if (values.size() != expected) c.fail(fmt::format("holds {} values, expected {}", values.size(), expected));
  return values;
}

}  // namespace

template <class T>
std::vector<T> read_values(const Source& source, const DataLayout& layout, const DataArray& array,
                           std::size_t expected) {
  const Context c{source, layout, array};
  if (array.encoding == DataArray::Encoding::kAscii) return read_ascii<T>(c, expected);
  const std::size_t size = size_of(array.type);
  if (expected > std::numeric_limits<std::uint64_t>::max() / 16) c.fail("too many values");
  const std::uint64_t wanted = expected * size;
  Bytes bytes(c);
  if (wanted == 0 && bytes.empty()) return {};
  if (layout.compressed) {
    const std::vector<char> plain = read_compressed(c, bytes, wanted);
    return convert_bytes<T>(c, {plain.data(), plain.size()});
  }
  const std::uint64_t stored = bytes.word(0), word = layout.wide_header ? 8 : 4;
  if (stored != wanted) c.fail(fmt::format("holds {} bytes, expected {}", stored, wanted));
  if (stored > bytes.available()) c.fail(fmt::format("claims {} bytes, more than the file holds", stored));
  return convert_bytes<T>(c, bytes.first(word + stored).substr(word));
}

template std::vector<double> read_values<double>(const Source&, const DataLayout&, const DataArray&,
                                                 std::size_t);
template std::vector<Index> read_values<Index>(const Source&, const DataLayout&, const DataArray&,
                                               std::size_t);
template std::vector<std::int64_t> read_values<std::int64_t>(const Source&, const DataLayout&,
                                                             const DataArray&, std::size_t);
template std::vector<std::uint8_t> read_values<std::uint8_t>(const Source&, const DataLayout&,
                                                             const DataArray&, std::size_t);

std::uint64_t EncodedArray::size() const {
  std::uint64_t bytes = 8 * header.size();
  if (fill) bytes += values * value_size;
  for (const std::string& b : blocks) bytes += b.size();
  return bytes;
}

void EncodedArray::write(OutputFile& out) const {
  out.write(header.data(), 8 * header.size());
  for (const std::string& b : blocks) out.write(b);
  if (!fill) return;
  std::vector<char> plain(std::min(values * value_size, kWaveBytes));
  const std::size_t per_wave = kWaveBytes / value_size, per_chunk = kBlockBytes / value_size;
  for (std::size_t wave = 0; wave < values; wave += per_wave) {
    const std::size_t n = std::min(values - wave, per_wave);
    for_each_chunk(n, per_chunk, [&](std::size_t begin, std::size_t end) {
      fill(wave + begin, wave + end, plain.data() + begin * value_size);
    });
    out.write(plain.data(), n * value_size);
  }
}

EncodedArray encode_values(std::size_t n, std::size_t value_size, const FillValues& fill, bool compress) {
  EncodedArray encoded;
  if (!compress) {
    encoded.header = {n * value_size};
    encoded.values = n;
    encoded.value_size = value_size;
    encoded.fill = fill;
    return encoded;
  }
  const std::size_t per_block = kBlockBytes / value_size;
  const std::size_t blocks = (n + per_block - 1) / per_block;
  encoded.blocks.resize(blocks);
  for_each_index(
      blocks,
      [&](std::size_t b) {
        const std::size_t begin = b * per_block, end = std::min(n, begin + per_block);
        std::vector<char> plain((end - begin) * value_size);
        fill(begin, end, plain.data());
        encoded.blocks[b] = deflate_block(plain);
      },
      1);
  encoded.header = {blocks, kBlockBytes, n % per_block * value_size};
  for (const std::string& b : encoded.blocks) encoded.header.push_back(b.size());
  return encoded;
}

}  // namespace lamina::io
