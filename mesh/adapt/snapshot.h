// The optimizer between two steps as bytes, and back: what a later run needs to go on with the same bits.
#pragma once

#include <string>
#include <string_view>

#include "mesh/adapt/blocks.h"
#include "mesh/adapt/boundary.h"

namespace lamina::adapt_detail {

/// Where the loop over the steps stands.
template <int D>
struct AdaptState {
  std::vector<double> floors;  ///< size floors of all steps
  std::size_t next = 0;        ///< the step to come
  int pass = 0;                ///< its first pass
  bool unit_already = false;   ///< from the start, so that there is one step only
  GlobalMesh<D> mesh;
  BoundaryTags tags;
  AdaptSummary summary;  ///< of the steps done
};

/// The options that results depend on are part of it.
template <int D>
std::string encode(const AdaptState<D>& state, const AdaptOptions& options);

/// Errors: kAdapt when the bytes were not made by encode() of this dimension, are not complete, or belong to
/// other options or sizes.
template <int D>
AdaptState<D> decode(std::string_view bytes, const AdaptOptions& options);

}  // namespace lamina::adapt_detail
