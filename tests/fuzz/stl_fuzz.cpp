#include "tests/fuzz/surface_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lamina::fuzz_surface(lamina::detail::parse_stl, data, size);
  return 0;
}
