// Any bytes given to the USD reader are a mesh or an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/usda.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    lamina::io::parse_usda({reinterpret_cast<const char*>(data), size}, "fuzz");
  } catch (const lamina::Error&) {
  }
  return 0;
}
