// The boundary layer of --level-set: a wall in the mesh that is adapted, from a body or a field of distances.
#pragma once

#include <memory>

#include "apps/pipeline/adaptation.h"
#include "apps/pipeline/detail/carrier.h"
#include "apps/pipeline/pipeline.h"
#include "mesh/adapt.h"

namespace lamina {

template <int D>
class AdaptWall {
 public:
  /// `input` is the mesh as read, where --level-set names a field of it. The domain is the bounds of `mesh`.
  /// Errors: kUsage when Adaptation::level_set is neither a field nor a body, those of load_body and
  /// resolve_case, kParameter.
  AdaptWall(const Adaptation& a, const Carrier<D>* input, const Mesh<D>& mesh, Progress& progress);

  [[nodiscard]] std::unique_ptr<const AdaptMetric<D>> family() const { return metric_family<D>(*metric_); }
  [[nodiscard]] double smallest() const { return smallest_; }
  [[nodiscard]] const BoundaryLayer& layer() const { return metric_->layer(); }

 private:
  void from_field(const Adaptation& a, Case c, const Carrier<D>& input, Progress& progress);
  void from_body(const Adaptation& a, Case c, Progress& progress);

  std::unique_ptr<const Body> body_;        ///< of a body
  std::unique_ptr<const WallField> field_;  ///< of a field
  std::unique_ptr<const WallMetric> metric_;
  double smallest_ = 0.0;
};

}  // namespace lamina
