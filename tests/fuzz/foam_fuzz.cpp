// Any bytes given to the OpenFOAM reader, its six files parted by form feeds, are a mesh or an Error.
#include <cstddef>
#include <cstdint>

#include "core/error.h"
#include "mesh/io/foam.h"
#include "tests/fuzz/parts.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parts = lamina::parts_of<6>(data, size);
  try {
    lamina::io::parse_foam({parts[0], parts[1], parts[2], parts[3], parts[4], parts[5]});
  } catch (const lamina::Error&) {
  }
  return 0;
}
