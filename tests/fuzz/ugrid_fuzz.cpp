// Any bytes given to the UGRID reader, in every form, are a mesh or an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "mesh/io/ugrid.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const lamina::io::UgridForm form :
       {lamina::io::UgridForm{.ascii = true}, lamina::io::UgridForm{},
        lamina::io::UgridForm{.big_endian = true}, lamina::io::UgridForm{.wide = true},
        lamina::io::UgridForm{.big_endian = true, .wide = true}}) {
    try {
      lamina::io::parse_ugrid({reinterpret_cast<const char*>(data), size}, "fuzz", form);
    } catch (const lamina::Error&) {
    }
  }
  return 0;
}
