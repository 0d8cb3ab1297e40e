// Metrics as a written level set holds them, and one that is hard to store.
#pragma once

#include <filesystem>
#include <vector>

#include "core/wall_metric.h"
#include "tests/vdb/openvdb_oracle.h"

namespace lamina {

/// Over flat walls its sizes have ratios to 1e5 even at the distances of voxels. REQUIRES wall to outlive it.
inline WallMetric thin_metric(const WallField& wall) {
  BoundaryLayer layer;
  layer.h_min = 1e-6;
  layer.layers = 1;
  SizeOptions sizes;
  sizes.h2 = sizes.h1 = 0.1;
  sizes.domain = wall.bounds().padded(2e4);
  sizes.box2 = wall.bounds().padded(1e4);  // so far that sizes stay near h_min between the voxels
  sizes.gradation = 0.0;
  return {wall, layer, sizes};
}

struct StoredMetric {
  Vec3 x, h;
  Metric<3> metric;
};

/// Of all active voxels, as OpenVDB reads them.
inline std::vector<StoredMetric> stored_metrics(const std::filesystem::path& path) {
  const auto voxels = openvdb_oracle::active_voxels(path, "surface");
  const auto h = openvdb_oracle::active_vectors(path, "h");
  const auto diagonal = openvdb_oracle::active_vectors(path, "logM_diag");
  const auto off = openvdb_oracle::active_vectors(path, "logM_off");
  std::vector<StoredMetric> out;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const Vec3 &d = diagonal.at(i), &o = off.at(i);
    out.push_back({voxels[i].x, h.at(i), Metric<3>::from_log({d[0], o[0], d[1], o[1], o[2], d[2]})});
  }
  return out;
}

/// Largest relative difference of principal sizes.
inline double size_error(const Metric<3>& a, const Metric<3>& b) {
  return (a.principal().sizes.array() / b.principal().sizes.array() - 1.0).abs().maxCoeff();
}

inline double aspect_ratio(const Metric<3>& m) {
  const Vec3 sizes = m.principal().sizes;
  return sizes[2] / sizes[0];
}

}  // namespace lamina
