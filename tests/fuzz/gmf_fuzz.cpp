// Any bytes given to the GMF readers are a mesh, a solution or an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/gmf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    lamina::io::parse_gmf(bytes, "fuzz");
  } catch (const lamina::Error&) {
  }
  try {
    lamina::io::parse_gmf_solution(bytes, "fuzz");
  } catch (const lamina::Error&) {
  }
  return 0;
}
