// Position along a Hilbert curve: points near in space get near keys.
#pragma once

#include <cstdint>

#include "core/types.h"

namespace lamina {

/// Key of x in `box` along the Hilbert curve with 2^(63 / D) cells per axis; points outside are clamped.
template <int D>
std::uint64_t hilbert_key(const Vec<D>& x, const Box<D>& box);

}  // namespace lamina
