// Any bytes given to the XDMF reader, which finds no data file, are a mesh or an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/xdmf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    lamina::io::parse_xdmf({reinterpret_cast<const char*>(data), size}, "fuzz", "no/such/folder");
  } catch (const lamina::Error&) {
  }
  return 0;
}
