// First height, thickness and number of layers from boundary-layer theory [Billon2016, section 2].
//
// Two slips of the paper matter here: the layer counts of its section 5.1 come out only when delta omits L
// (eq. 8 gives delta / L); we use delta = 0.38 L Re^-1/5 and let `layers` or `delta` be given instead.
#pragma once

#include <optional>
#include <vector>

namespace lamina {

enum class Regime { kLaminar, kTurbulent };

/// What the user says of the flow. Lengths in world units; every optional value overrides the derived one.
struct Flow {
  double reynolds = 1e5;            ///< Re_L, in [1e3, 1e9)
  std::optional<double> length;     ///< characteristic length L > 0; DEFAULT the body's longest extent
  std::optional<double> velocity;   ///< u_inf > 0; with `viscosity` replaces `reynolds` by u L / nu
  std::optional<double> viscosity;  ///< kinematic viscosity nu > 0, length^2 / time
  double y_plus = 1.0;              ///< target y+ of the first height, > 0
  double growth = 1.2;              ///< thickness ratio of neighbouring layers, in (1, 2]
  Regime regime = Regime::kTurbulent;
  std::optional<double> h_min, delta;
  std::optional<int> layers;
};

/// The resolved boundary layer. Layer k = 1..layers lies between levels s_{k-1} and s_k.
struct BoundaryLayer {
  double reynolds = 0.0, length = 0.0, growth = 1.2;
  double skin_friction = 0.0;  ///< C_F, eq. 5; 0 when h_min was given
  double h_min = 0.0;
  double delta = 0.0;  ///< eq. 7 / 8, or the height of `layers` layers when those were given
  int layers = 0;      ///< eq. 9 rounded up

  /// s_k = h_min (growth^k - 1) / (growth - 1): height of the first k layers [eq. in section 3.2.2].
  [[nodiscard]] double level(int k) const;
  /// The real number k with level(k) = height: whole on the levels. REQUIRES height >= 0.
  [[nodiscard]] double level_at(double height) const;
  /// The level of 0..last that is nearest to a height; of layers thinner than `floor` (to 20 %) that of the
  /// wall, 0, up to half the floor. None elsewhere. REQUIRES height >= 0.
  [[nodiscard]] std::optional<int> nearest_level(double height, int last, double floor) const;
  /// s_layers.
  [[nodiscard]] double top() const { return level(layers); }
  /// Normal size of the last layer.
  [[nodiscard]] double top_size() const;
};

/// C_F = (2 log10 Re - 0.65)^-2.3 [eq. 5]. Errors: kParameter outside (10, 1e9).
double skin_friction(double reynolds);
/// h_min = L y+ / (Re sqrt(C_F / 2)) [eq. 6].
double first_height(double reynolds, double length, double y_plus);
/// 5 L Re^-1/2 [eq. 7] or 0.38 L Re^-1/5 [eq. 8].
double layer_thickness(double reynolds, double length, Regime regime);
/// ceil(ln(1 + delta (growth - 1) / h_min) / ln growth) [eq. 9], at least 1.
int layer_count(double delta, double h_min, double growth);

/// Resolves a flow for a body of extent `body_length`. Errors: kParameter naming option, value and range.
BoundaryLayer resolve(const Flow& flow, double body_length);

}  // namespace lamina
