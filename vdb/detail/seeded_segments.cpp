#include "vdb/detail/seeded_segments.h"

#include "core/parallel.h"

namespace lamina::detail {

SeededSegments::SeededSegments(const Surface& surface, const std::vector<std::array<Vec3, 2>>& segments)
    : tree_(segments) {
  if (segments.empty()) return;
  nearest_.resize(surface.points.size());
  for_each_index(nearest_.size(),
                 [&](std::size_t v) { nearest_[v] = tree_.closest(surface.points[v]).segment; });
}

SegmentHit SeededSegments::closest(const Surface& surface, Index facet, const Vec3& x) const {
  SegmentHit best;
  Index last = kNone;
  for (const Index v : surface.triangles[static_cast<std::size_t>(facet)]) {
    const Index segment = nearest_[static_cast<std::size_t>(v)];
    if (segment == last) continue;
    last = segment;
    const SegmentHit hit = tree_.on_segment(segment, x);
    if (hit.d2 < best.d2) best = hit;
  }
  const SegmentHit nearer = tree_.closest(x, best.d2);
  return nearer.segment == kNone ? best : nearer;
}

}  // namespace lamina::detail
