// The files of a format that takes several, parted by form feeds in what the fuzzer gives.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "mesh/io/raw.h"

namespace lamina {

template <std::size_t N>
std::array<io::Source, N> parts_of(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::array<io::Source, N> parts;
  for (io::Source& part : parts) {
    const std::size_t end = std::min(rest.find('\f'), rest.size());
    part = {rest.substr(0, end), "fuzz"};
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return parts;
}

}  // namespace lamina
