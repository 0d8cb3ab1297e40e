// Words around numbers in messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lamina {

/// "1 edge", "3 edges": the count and the noun, which takes an s in the plural unless `plural` is given
/// ("vertex", "vertices").
std::string counted(std::int64_t n, std::string_view noun, std::string_view plural = {});

}  // namespace lamina
