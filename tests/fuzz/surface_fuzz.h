// What every surface parser must do with any bytes: return a consistent surface or throw Error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/error.h"
#include "vdb/detail/surface_parse.h"

namespace lamina {

using SurfaceParser = Surface (*)(std::string_view, const std::string&, std::vector<std::string>&);

/// Aborts, which the fuzzer reports as a finding.
inline void require(bool condition) {
  if (!condition) std::abort();
}

inline void fuzz_surface(SurfaceParser parse, const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> warnings;
  try {
    Surface surface = parse({reinterpret_cast<const char*>(data), size}, "fuzz", warnings);
    require(!surface.triangles.empty() && surface.tags.size() == surface.triangles.size());
    require(surface.triangles.size() <= size && surface.points.size() <= size);
    for (const auto& triangle : surface.triangles)
      for (const Index v : triangle) require(v >= 0 && static_cast<std::size_t>(v) < surface.points.size());
    for (const Index tag : surface.tags)
      require(tag >= 0 && static_cast<std::size_t>(tag) < surface.tag_names.size());
    const SurfaceReport report = clean(surface, "fuzz");
    require(report.triangles == static_cast<std::int64_t>(surface.triangles.size()) && report.triangles > 0);
    require(report.triangles + report.nonfinite + report.degenerate + report.duplicate ==
            report.triangles_read);
  } catch (const Error& e) {
    require(e.code() != ErrorCode::kInternal);
  }
  for (const std::string& warning : warnings) require(warning.find('\n') == std::string::npos);
}

}  // namespace lamina
