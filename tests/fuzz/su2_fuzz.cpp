// Any bytes given to the SU2 reader are a mesh or an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/su2.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    lamina::io::parse_su2({reinterpret_cast<const char*>(data), size}, "fuzz");
  } catch (const lamina::Error&) {
  }
  return 0;
}
