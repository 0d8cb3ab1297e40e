#include "mesh/io/records.h"

#include <algorithm>

namespace lamina::io {
namespace {

constexpr std::size_t kChunk = 8192;
constexpr std::size_t kWave = 64;

}  // namespace

void write_chunks(OutputFile& out, std::size_t n,
                  FunctionRef<void(std::size_t, std::size_t, Records&)> form_records) {
  std::vector<Records> buffers(std::min(kWave, (n + kChunk - 1) / kChunk));
  for (std::size_t wave = 0; wave < n; wave += kWave * kChunk) {
    const std::size_t wave_end = std::min(n, wave + kWave * kChunk);
    const std::size_t chunks = (wave_end - wave + kChunk - 1) / kChunk;
    for_each_index(
        chunks,
        [&](std::size_t c) {
          const std::size_t begin = wave + c * kChunk;
          buffers[c].clear();
          form_records(begin, std::min(wave_end, begin + kChunk), buffers[c]);
        },
        1);
    for (std::size_t c = 0; c < chunks; ++c) out.write(buffers[c].bytes());
  }
}

}  // namespace lamina::io
