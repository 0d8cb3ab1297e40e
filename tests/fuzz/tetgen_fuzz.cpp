// Any bytes given to the TetGen reader, its three files parted by form feeds, are a mesh or an Error.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/tetgen_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::array<lamina::io::Source, 3> parts;
  for (lamina::io::Source& part : parts) {
    const std::size_t end = std::min(rest.find('\f'), rest.size());
    part = {rest.substr(0, end), "fuzz"};
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  try {
    lamina::io::parse_tetgen({parts[0], parts[1], parts[2]});
  } catch (const lamina::Error&) {
  }
  return 0;
}
