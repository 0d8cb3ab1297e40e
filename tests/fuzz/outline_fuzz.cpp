#include "core/error.h"
#include "tests/fuzz/surface_fuzz.h"
#include "vdb/detail/outline_parse.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lamina;
  for (const auto parse : {detail::parse_aerofoil, detail::parse_points}) {
    try {
      Outline outline = parse({reinterpret_cast<const char*>(data), size}, "fuzz");
      require(!outline.curves.empty());
      for (const OutlineCurve& curve : outline.curves) {
        require(curve.points.size() >= 2 && curve.points.size() <= size);
        for (const Vec2& x : curve.points) require(x.allFinite());
      }
      const OutlineReport report = clean(outline, "fuzz");
      require(report.points + report.duplicates == report.points_read);
    } catch (const Error& e) {
      require(e.code() != ErrorCode::kInternal);
    }
  }
  return 0;
}
