// Writing many records of numbers, ascii or binary: formed in parallel, written in order.
#pragma once

#include <charconv>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include "core/file.h"
#include "core/parallel.h"

namespace lamina::io {

/// Bytes being formed.
class Records {
 public:
  void text(std::string_view s) {
    char* to = room(s.size());
    std::memcpy(to, s.data(), s.size());
    used_ += s.size();
  }
  void character(char c) {
    *room(1) = c;
    ++used_;
  }
  /// Shortest decimals that read back to the same bits.
  void real(double value) { print(value); }
  void integer(std::int64_t value) { print(value); }
  /// Shortest decimals of single precision.
  void single(float value) { print(value); }
  /// The bytes of a number, in the order of the machine or turned around.
  template <class T>
  void raw(T value, bool swap = false) {
    char* to = room(sizeof(T));
    std::memcpy(to, &value, sizeof(T));
    if (swap)
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(to[i], to[sizeof(T) - 1 - i]);
    used_ += sizeof(T);
  }
  [[nodiscard]] std::string_view bytes() const { return {data_.data(), used_}; }
  void clear() { used_ = 0; }

 private:
  static constexpr std::size_t kLongestNumber = 32;

  char* room(std::size_t n) {
    if (data_.size() - used_ < n) data_.resize(2 * data_.size() + n + 4096);
    return data_.data() + used_;
  }
  template <class T>
  void print(T value) {
    char* to = room(kLongestNumber);
    used_ += static_cast<std::size_t>(std::to_chars(to, to + kLongestNumber, value).ptr - to);
  }

  std::vector<char> data_;
  std::size_t used_ = 0;
};

/// Forms records [begin, end) for chunks of a fixed size, several at a time, and writes them in order: memory
/// stays bounded and the bytes do not depend on the threads.
void write_chunks(OutputFile& out, std::size_t n,
                  FunctionRef<void(std::size_t, std::size_t, Records&)> form_records);

/// form(i, to) forms record i.
template <class Form>
void write_records(OutputFile& out, std::size_t n, Form&& form) {
  write_chunks(out, n, [&](std::size_t begin, std::size_t end, Records& to) {
    for (std::size_t i = begin; i < end; ++i) form(i, to);
  });
}

}  // namespace lamina::io
