// Any bytes given to the TetGen reader, its three files parted by form feeds, are a mesh or an Error.
#include <cstddef>
#include <cstdint>

#include "core/error.h"
#include "mesh/io/tetgen_files.h"
#include "tests/fuzz/parts.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parts = lamina::parts_of<3>(data, size);
  try {
    lamina::io::parse_tetgen({parts[0], parts[1], parts[2]});
  } catch (const lamina::Error&) {
  }
  return 0;
}
