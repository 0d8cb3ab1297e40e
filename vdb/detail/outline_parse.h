// The parsers behind read_outline(): bytes in, curves out. They take any bytes whatsoever (they are fuzzed).
#pragma once

#include <string>
#include <string_view>

#include "vdb/outline.h"

namespace lamina::detail {

/// `name` is used in messages only. Errors: kFileFormat, kSurfaceEmpty.
Outline parse_aerofoil(std::string_view bytes, const std::string& name);
Outline parse_points(std::string_view bytes, const std::string& name);

}  // namespace lamina::detail
