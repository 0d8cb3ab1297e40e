// Colour scales for pictures, safe for the common kinds of colour blindness: lightness alone orders the
// values.
#pragma once

#include <array>

namespace lamina {

/// Red, green, blue in [0, 1].
using Rgb = std::array<double, 3>;

/// 0 dark red over yellow to 1 blue-white: what needs attention is dark. t is clamped to [0, 1].
Rgb quality_color(double t);
/// 0 violet over green to 1 yellow, lightened so that thin dark lines stand out on it.
Rgb size_color(double t);
/// 0 blue over near-white at 0.5 to 1 red.
Rgb curvature_color(double t);
/// Inside the body, boundary layer, Box2, Box1; grey for any other number.
Rgb region_color(int region);
inline constexpr Rgb kPlainColor = {0.93, 0.93, 0.93};

}  // namespace lamina
