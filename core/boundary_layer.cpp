#include "core/boundary_layer.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"

namespace lamina {
namespace {

[[noreturn]] void reject(const char* option, double value, const char* range) {
  throw Error(ErrorCode::kParameter, fmt::format("{} = {:g} is out of range: {}", option, value, range));
}

void require_positive(const char* option, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) reject(option, value, "must be > 0");
}

// The real number k of layers that reach up to a height.
double level_number(double height, double h_min, double growth) {
  return std::log1p(height * (growth - 1.0) / h_min) / std::log(growth);
}

}  // namespace

double BoundaryLayer::level(int k) const { return h_min * (std::pow(growth, k) - 1.0) / (growth - 1.0); }

double BoundaryLayer::level_at(double height) const { return level_number(height, h_min, growth); }

std::optional<int> BoundaryLayer::nearest_level(double height, int last, double floor) const {
  constexpr double kTooThin = 0.8;
  const int below = static_cast<int>(std::min(level_at(height), static_cast<double>(last)));
  const int number = height - level(below) < level(below + 1) - height ? below : below + 1;
  if (number > last) return std::nullopt;
  if (h_min * std::pow(growth, number) >= kTooThin * floor) return number;
  if (height > 0.5 * floor) return std::nullopt;
  return 0;
}

double BoundaryLayer::top_size() const { return h_min * std::pow(growth, layers - 1); }

double skin_friction(double reynolds) {
  if (!(reynolds > 10.0 && reynolds < 1e9))
    reject("Re", reynolds,
           "the skin-friction law [Billon2016, eq. 5] holds for 10 < Re < 1e9; give --hmin instead");
  return std::pow(2.0 * std::log10(reynolds) - 0.65, -2.3);
}

double first_height(double reynolds, double length, double y_plus) {
  return length * y_plus / (reynolds * std::sqrt(0.5 * skin_friction(reynolds)));
}

double layer_thickness(double reynolds, double length, Regime regime) {
  return regime == Regime::kLaminar ? 5.0 * length / std::sqrt(reynolds)
                                    : 0.38 * length / std::pow(reynolds, 0.2);
}

int layer_count(double delta, double h_min, double growth) {
  // The small slack keeps a delta that is a level itself (given back by --layers) at its own count.
  constexpr double kSlack = 1e-9;
  const double n = level_number(delta, h_min, growth);
  return std::max(1, static_cast<int>(std::ceil(n - kSlack)));
}

BoundaryLayer resolve(const Flow& flow, double body_length) {
  BoundaryLayer b;
  b.length = flow.length.value_or(body_length);
  require_positive("--length", b.length);
  if (!(flow.growth > 1.0 && flow.growth <= 2.0)) reject("--growth", flow.growth, "must be in (1, 2]");
  b.growth = flow.growth;
  require_positive("--yplus", flow.y_plus);
  if (flow.velocity.has_value() != flow.viscosity.has_value())
    throw Error(ErrorCode::kParameter, fmt::format("--{} is given without --{}: give both, or --re",
                                                   flow.velocity ? "velocity" : "viscosity",
                                                   flow.velocity ? "viscosity" : "velocity"));
  b.reynolds = flow.reynolds;
  if (flow.velocity) {
    require_positive("--velocity", *flow.velocity);
    require_positive("--viscosity", *flow.viscosity);
    b.reynolds = *flow.velocity * b.length / *flow.viscosity;
  }
  if (flow.h_min) {
    require_positive("--hmin", *flow.h_min);
    require_positive("--re", b.reynolds);
    b.h_min = *flow.h_min;
  } else {
    b.skin_friction = skin_friction(b.reynolds);
    b.h_min = first_height(b.reynolds, b.length, flow.y_plus);
  }
  if (flow.layers) {
    constexpr int kMaxLayers = 200;
    if (*flow.layers < 1 || *flow.layers > kMaxLayers)
      reject("--layers", *flow.layers, "must be in [1, 200]");
    b.layers = *flow.layers;
    b.delta = flow.delta.value_or(b.top());
    require_positive("--delta", b.delta);
  } else {
    b.delta = flow.delta.value_or(layer_thickness(b.reynolds, b.length, flow.regime));
    require_positive("--delta", b.delta);
    b.layers = layer_count(b.delta, b.h_min, b.growth);
  }
  return b;
}

}  // namespace lamina
