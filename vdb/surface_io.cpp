#include "vdb/surface_io.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/file.h"
#include "vdb/detail/surface_parse.h"

namespace lamina {

bool is_surface_file(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".stl" || extension == ".obj" || extension == ".ply";
}

Surface read_surface(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  const std::string name = path.string();
  const std::string extension = lower_extension(path);
  const MappedFile file(path);
  if (extension == ".stl") return detail::parse_stl(file.bytes(), name, warnings);
  if (extension == ".obj") return detail::parse_obj(file.bytes(), name, warnings);
  if (extension == ".ply") return detail::parse_ply(file.bytes(), name, warnings);
  throw Error(ErrorCode::kFileUnsupported,
              fmt::format("{}: surfaces are read from .stl, .obj and .ply, not '{}'", name, extension));
}

void write_stl(const std::filesystem::path& path, const Surface& surface) {
  constexpr std::size_t kBlock = 4096;
  OutputFile file(path);
  // Readers that trust a leading "solid" would take the file for ascii.
  std::array<char, 84> header{};
  constexpr std::string_view kTitle = "binary STL written by Lamina";
  std::copy(kTitle.begin(), kTitle.end(), header.begin());
  const auto count = static_cast<std::uint32_t>(surface.triangles.size());
  std::memcpy(header.data() + 80, &count, sizeof count);
  file.write(header.data(), header.size());
  std::vector<char> block;
  block.reserve(50 * kBlock);
  for (const auto& triangle : surface.triangles) {
    std::array<Vec3, 4> v;
    for (std::size_t k = 0; k < 3; ++k) v[k + 1] = surface.points[static_cast<std::size_t>(triangle[k])];
    v[0] = (v[2] - v[1]).cross(v[3] - v[1]).stableNormalized();
    std::array<char, 50> record{};
    for (std::size_t k = 0; k < 4; ++k)
      for (int i = 0; i < 3; ++i) {
        if (k > 0 && !(std::abs(v[k][i]) <= std::numeric_limits<float>::max()))
          throw Error(ErrorCode::kFileWrite,
                      fmt::format("{}: coordinate {:g} does not fit the 32-bit floats of STL", path.string(),
                                  v[k][i]));
        const auto value = static_cast<float>(v[k][i]);
        std::memcpy(record.data() + 12 * k + 4 * static_cast<std::size_t>(i), &value, sizeof value);
      }
    block.insert(block.end(), record.begin(), record.end());
    if (block.size() == 50 * kBlock) {
      file.write(block.data(), block.size());
      block.clear();
    }
  }
  file.write(block.data(), block.size());
  file.commit();
}

}  // namespace lamina
