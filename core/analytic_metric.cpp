// Every metric is a frame and sizes along it, so that sizes can be raised, scaled and clamped without any
// decomposition. The definitions are told with each class; keys are looked up once, when a metric is made.
#include "core/analytic_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include "core/boundary_layer.h"
#include "core/error.h"

namespace lamina {
namespace {

constexpr double kDerived = std::numeric_limits<double>::quiet_NaN();
constexpr double kAnyReal = -std::numeric_limits<double>::infinity();

using Values = std::map<std::string, double, std::less<>>;

/// A direct orthonormal frame whose first axis is n.
template <int D>
Mat<D> frame_of(const Vec<D>& n) {
  Mat<D> axes;
  axes.row(0) = n.transpose();
  if constexpr (D == 2) {
    axes.row(1) = Vec2(-n[1], n[0]).transpose();
  } else {
    const Vec3 t = n.unitOrthogonal();
    axes.row(1) = t.transpose();
    axes.row(2) = n.cross(t).transpose();
  }
  return axes;
}

template <int D>
Box<D> unit_box() {
  return {Vec<D>::Zero(), Vec<D>::Ones()};
}

template <int D>
class OnUnitBox : public AnalyticMetric<D> {
 public:
  explicit OnUnitBox(double start_size = 0.1) : start_size_(start_size) {}
  [[nodiscard]] Box<D> domain() const override { return unit_box<D>(); }
  [[nodiscard]] double start_size() const override { return start_size_; }

 private:
  double start_size_;
};

/// Size h everywhere.
template <int D>
class Isotropic : public OnUnitBox<D> {
 public:
  explicit Isotropic(const Values& p) : h_(p.at("h")) {}
  [[nodiscard]] SizedFrame<D> frame(const Vec<D>& /*x*/) const override {
    return {Mat<D>::Identity(), Vec<D>::Constant(h_)};
  }
  [[nodiscard]] double smallest() const override { return h_; }

 private:
  double h_;
};

/// h_x = h_y = 0.1, h_z from h0 at z = 1/2 to 0.1 at the faces, linearly [Ibanez2017].
class CubeLinear : public OnUnitBox<3> {
 public:
  explicit CubeLinear(const Values& p) : OnUnitBox(1.0 / 3.0), h0_(p.at("h0")) {}
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    return {Mat3::Identity(), {kFar, kFar, h0_ + 2.0 * (kFar - h0_) * std::abs(x[2] - 0.5)}};
  }
  [[nodiscard]] double smallest() const override { return std::min(h0_, kFar); }

 private:
  static constexpr double kFar = 0.1;
  double h0_;
};

/// Thin along the radius at r = 1/2 around the z axis; polar-2 is finer around the axis there too. All sizes
/// are divided by `scale`.
class Polar : public OnUnitBox<3> {
 public:
  Polar(const Values& p, bool second) : h0_(p.at("h0")), scale_(p.at("scale")), second_(second) {}
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    const double r = std::hypot(x[0], x[1]);
    const double off = std::abs(r - 0.5);
    const double blend = second_ ? std::min(10.0 * off, 1.0) : 1.0;
    const Vec3 sizes(h0_ + 2.0 * (kFar - h0_) * off, kFar * blend + kFine * (1.0 - blend), kFar);
    const Vec3 radial = r > 0.0 ? Vec3(x[0] / r, x[1] / r, 0.0) : Vec3(Vec3::UnitX());
    Mat3 axes;
    axes << radial.transpose(), Vec3(-radial[1], radial[0], 0.0).transpose(), Vec3::UnitZ().transpose();
    return {axes, sizes / scale_};
  }
  [[nodiscard]] double smallest() const override { return std::min(h0_, second_ ? kFine : kFar) / scale_; }

 private:
  static constexpr double kFar = 0.1, kFine = 0.025;
  double h0_, scale_;
  bool second_;
};

/// Walls in the unit cube: h_n = min(H, hmin + growth |s|) along the normal; a tangential size is
/// min(H, max(h_n, sqrt(2 R hmin + hmin^2))) with the radius R of the wall's distance there.
class UnitCubeWall : public OnUnitBox<3> {
 public:
  UnitCubeWall(const Values& p, double largest) : h_min_(p.at("hmin")), rate_(p.at("growth")), h_(largest) {}
  [[nodiscard]] double smallest() const override { return std::min(h_min_, h_); }

 protected:
  [[nodiscard]] double normal_size(double s) const { return std::min(h_, h_min_ + rate_ * std::abs(s)); }
  [[nodiscard]] double tangential_size(double radius, double s) const {
    return std::min(h_, std::max(normal_size(s), std::sqrt(2.0 * radius * h_min_ + h_min_ * h_min_)));
  }
  [[nodiscard]] double largest() const { return h_; }
  static Vec3 from_center(const Vec3& x) { return x - Vec3::Constant(0.5); }

 private:
  double h_min_, rate_, h_;
};

class TiltedPlane : public UnitCubeWall {
 public:
  explicit TiltedPlane(const Values& p)
      : UnitCubeWall(p, p.at("ht")), normal_(Vec3(0.3, 0.2, 1.0).normalized()), axes_(frame_of<3>(normal_)) {}
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    return {axes_, {normal_size(normal_.dot(from_center(x))), largest(), largest()}};
  }

 private:
  Vec3 normal_;
  Mat3 axes_;
};

class SphereWall : public UnitCubeWall {
 public:
  explicit SphereWall(const Values& p) : UnitCubeWall(p, p.at("H2")), radius_(p.at("R")) {}
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    constexpr double kSmallest = 1e-3;  // radius of the smallest sphere whose curvature counts
    const Vec3 y = from_center(x);
    const double r = y.norm(), s = r - radius_;
    const double ht = tangential_size(std::max(r, kSmallest), s);
    return {frame_of<3>(r > 0.0 ? Vec3(y / r) : Vec3(Vec3::UnitX())), {normal_size(s), ht, ht}};
  }

 private:
  double radius_;
};

/// The exact distance to a cube: inside to the nearest face, outside to the nearest face, edge or corner.
class CubeWall : public UnitCubeWall {
 public:
  explicit CubeWall(const Values& p) : UnitCubeWall(p, p.at("H2")), half_(p.at("half")) {}
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    const Vec3 y = from_center(x);
    const Vec3 sign = y.unaryExpr([](double v) { return v < 0.0 ? -1.0 : 1.0; });
    const Vec3 q = y.cwiseAbs() - Vec3::Constant(half_);
    const Vec3 out = q.cwiseMax(0.0);
    const double distance = out.norm();
    if (distance == 0.0) {
      int axis = 0;
      const double s = q.maxCoeff(&axis);
      return {frame_of<3>(sign[axis] * Vec3::Unit(axis)), {normal_size(s), largest(), largest()}};
    }
    const Vec3 n = sign.cwiseProduct(out) / distance;
    const double hn = normal_size(distance), round = tangential_size(distance, distance);
    const auto beyond = (out.array() > 0.0).count();
    if (beyond == 3) return {frame_of<3>(n), {hn, round, round}};
    if (beyond == 1) return {frame_of<3>(n), {hn, largest(), largest()}};
    int along = 0;
    out.minCoeff(&along);
    Mat3 axes;
    axes << n.transpose(), Vec3::Unit(along).transpose(), n.cross(Vec3::Unit(along)).transpose();
    return {axes, {hn, largest(), round}};
  }

 private:
  double half_;
};

/// The normal size that makes every layer one unit thick, see the head of the header.
struct UnitLayers {
  explicit UnitLayers(double h_min, double growth)
      : start(h_min * std::log(growth) / (growth - 1.0)), rate(std::log(growth)) {}
  [[nodiscard]] double size(double distance) const { return start + rate * distance; }
  double start, rate;
};

/// A stack of layers on a wall: thickness hmin alpha^(k-1) in layer k.
BoundaryLayer stack(double h_min, double growth) {
  BoundaryLayer b;
  b.h_min = h_min;
  b.growth = growth;
  return b;
}

/// The level nearest to a point at signed distance s from a wall with unit normal n, of `outside` levels
/// before it and `inside` ones behind.
template <int D>
std::optional<Level<D>> level_of(const BoundaryLayer& layer, int outside, int inside, double s,
                                 const Vec<D>& n, double floor) {
  const int side = s < 0.0 ? -1 : 1;
  const auto number = layer.nearest_level(std::abs(s), side > 0 ? outside : inside, floor);
  if (!number) return std::nullopt;
  Level<D> level;
  level.number = side * *number;
  level.way = (side * layer.level(*number) - s) * n;
  level.normal = n;
  return level;
}

/// Layers on both sides of the plane z = z0, up to normal size hmax; ht along it.
class PlaneLayers : public OnUnitBox<3> {
 public:
  explicit PlaneLayers(const Values& p)
      : layers_(p.at("hmin"), p.at("alpha")),
        stack_(stack(p.at("hmin"), p.at("alpha"))),
        z0_(p.at("z0")),
        h_max_(p.at("hmax")),
        ht_(p.at("ht")) {
    constexpr double kSlack = 1e-9;
    stack_.layers = 1 + static_cast<int>(std::floor(std::max(
                            0.0, std::log(h_max_ / stack_.h_min) / std::log(stack_.growth) + kSlack)));
  }
  [[nodiscard]] std::optional<Level<3>> level(const Vec3& x, double floor) const override {
    return level_of<3>(stack_, stack_.layers, stack_.layers, x[2] - z0_, Vec3::UnitZ(), floor);
  }
  [[nodiscard]] std::optional<double> wall_distance(const Vec3& x) const override { return x[2] - z0_; }
  [[nodiscard]] SizedFrame<3> frame(const Vec3& x) const override {
    return {Mat3::Identity(), {ht_, ht_, std::min(layers_.size(std::abs(x[2] - z0_)), h_max_)}};
  }
  [[nodiscard]] double smallest() const override { return std::min({layers_.start, h_max_, ht_}); }

 private:
  UnitLayers layers_;
  BoundaryLayer stack_;
  double z0_, h_max_, ht_;
};

/// A circle or sphere of radius R immersed in a box (Box1), layers on it, and Box2 = its bounds + infl
/// [Billon2016, sections 2 to 4]: from the top of the layers linear to H2 at the border of Box2, geometric to
/// H1 at the farthest corner of Box1; inside, nin layers mirrored and then growth alphain per layer up to H2.
/// The tangential size is that of the wall [eq. 29], isotropic outside Box2.
template <int D>
class RoundBody : public AnalyticMetric<D> {
 public:
  RoundBody(const Values& p, const Vec<D>& extent, double start_size)
      : radius_(p.at("R")),
        h_min_(std::isnan(p.at("hmin")) ? first_height(p.at("Re"), p.at("L"), p.at("yplus")) : p.at("hmin")),
        layers_(h_min_, p.at("alpha")),
        stack_(stack(h_min_, p.at("alpha"))),
        mirrored_layers_(static_cast<int>(p.at("nin"))),
        inside_rate_(std::log(p.at("alphain"))),
        h2_(p.at("H2")),
        h1_(p.at("H1")),
        domain_{Vec<D>::Zero(), extent},
        start_size_(start_size) {
    const double delta = std::isnan(p.at("delta"))
                             ? layer_thickness(p.at("Re"), p.at("L"), Regime::kTurbulent)
                             : p.at("delta");
    stack_.layers = layer_count(delta, h_min_, stack_.growth);
    top_ = stack_.top();
    mirrored_ = stack_.level(mirrored_layers_);
    center_[0] = p.at("cx");
    center_[1] = p.at("cy");
    if constexpr (D == 3) center_[2] = p.at("cz");
    box2_ = Box<D>{center_, center_}.padded(radius_ + p.at("infl"));
    farthest_ = (box2_.lo - domain_.lo).cwiseMax(domain_.hi - box2_.hi).cwiseMax(0.0).norm();
    ht_ = std::min(std::sqrt(2.0 * radius_ * h_min_ + h_min_ * h_min_), h2_);
  }
  [[nodiscard]] SizedFrame<D> frame(const Vec<D>& x) const override {
    const Vec<D> y = x - center_;
    const double r = y.norm();
    const double h = normal_size(x, r - radius_);
    const double ht = box2_.contains(x) ? std::max(ht_, h) : h;
    Vec<D> sizes = Vec<D>::Constant(ht);
    sizes[0] = h;
    return {frame_of<D>(direction(y)), sizes};
  }
  [[nodiscard]] std::optional<Level<D>> level(const Vec<D>& x, double floor) const override {
    const Vec<D> y = x - center_;
    return level_of<D>(stack_, stack_.layers, mirrored_layers_, y.norm() - radius_, direction(y), floor);
  }
  [[nodiscard]] std::optional<double> wall_distance(const Vec<D>& x) const override {
    return (x - center_).norm() - radius_;
  }
  [[nodiscard]] double smallest() const override { return std::min({layers_.start, h2_, h1_}); }
  [[nodiscard]] Box<D> domain() const override { return domain_; }
  [[nodiscard]] double start_size() const override { return start_size_; }

 private:
  static Vec<D> direction(const Vec<D>& y) {
    const double r = y.norm();
    return r > 0.0 ? Vec<D>(y / r) : Vec<D>(Vec<D>::UnitX());
  }
  [[nodiscard]] double normal_size(const Vec<D>& x, double s) const {
    if (s < 0.0) {
      const double beyond = std::max(0.0, -s - mirrored_);
      return std::min(layers_.size(std::min(-s, mirrored_)) + inside_rate_ * beyond, h2_);
    }
    if (s <= top_) return layers_.size(s);
    if (!box2_.contains(x)) return h2_ * std::pow(h1_ / h2_, box2_.outer_distance(x) / farthest_);
    const double h_top = layers_.size(top_), above = s - top_;
    return h_top + (h2_ - h_top) * above / (above + box2_.inner_distance(x));
  }

  double radius_, h_min_;
  UnitLayers layers_;
  BoundaryLayer stack_;
  int mirrored_layers_;
  double inside_rate_, h2_, h1_, top_ = 0.0, mirrored_ = 0.0, farthest_ = 0.0, ht_ = 0.0;
  Vec<D> center_;
  Box<D> domain_, box2_;
  double start_size_;
};

std::vector<AnalyticKey> round_keys(const std::vector<AnalyticKey>& own, double h1, double h_min) {
  std::vector<AnalyticKey> keys = {{"R", 0.3}, {"hmin", h_min}};
  keys.insert(keys.end(), own.begin(), own.end());
  for (const AnalyticKey& key : std::initializer_list<AnalyticKey>{{"Re", 1e5},
                                                                   {"L", 0.6},
                                                                   {"yplus", 1.0},
                                                                   {"alpha", 1.2, 1.0},
                                                                   {"delta", kDerived},
                                                                   {"nin", 3.0},
                                                                   {"alphain", 1.5, 1.0},
                                                                   {"H2", 0.05},
                                                                   {"H1", h1},
                                                                   {"infl", 0.3}})
    keys.push_back(key);
  return keys;
}

const AnalyticName& find_name(std::string_view spec) {
  const std::string_view name = spec.substr(0, spec.find(':'));
  std::string known;
  for (const AnalyticName& n : analytic_names()) {
    if (n.name == name) return n;
    known += (known.empty() ? "" : ", ") + n.name;
  }
  throw Error(ErrorCode::kUsage, fmt::format("no analytic metric \"{}\"; known are {}", name, known));
}

[[noreturn]] void reject_key(const AnalyticName& name, const std::string& what) {
  std::string known;
  for (const AnalyticKey& k : name.keys) known += (known.empty() ? "" : ", ") + k.name;
  throw Error(ErrorCode::kUsage,
              fmt::format("analytic metric {}: {}; its keys are {}", name.name, what, known));
}

/// Defaults with "key=value,key=value" over them.
Values parse_keys(const AnalyticName& name, std::string_view text) {
  Values values;
  std::vector<std::string_view> given;
  for (const AnalyticKey& k : name.keys) values[k.name] = k.value;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    const std::size_t equal = word.find('=');
    if (equal == std::string_view::npos)
      reject_key(name, fmt::format("\"{}\" is not of the form key=value", word));
    const std::string_view key = word.substr(0, equal), number = word.substr(equal + 1);
    const auto found =
        std::find_if(name.keys.begin(), name.keys.end(), [&](const AnalyticKey& k) { return k.name == key; });
    if (found == name.keys.end()) reject_key(name, fmt::format("no key \"{}\"", key));
    if (std::find(given.begin(), given.end(), key) != given.end())
      reject_key(name, fmt::format("{} is given twice", key));
    given.push_back(key);
    double value = 0.0;
    const auto [rest, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc() || rest != number.data() + number.size() || !std::isfinite(value))
      reject_key(name, fmt::format("{} = \"{}\" is not a number", key, number));
    if (!(value > found->low))
      reject_key(name, fmt::format("{} = {:g} is out of range: must be > {:g}", key, value, found->low));
    values[found->name] = value;
  }
  return values;
}

std::unique_ptr<const AnalyticMetric<2>> make(const AnalyticName& name, const Values& p, Vec2* /*tag*/) {
  if (name.name == "iso") return std::make_unique<Isotropic<2>>(p);
  return std::make_unique<RoundBody<2>>(p, Vec2(8.5, 2.75), 0.5);
}

std::unique_ptr<const AnalyticMetric<3>> make(const AnalyticName& name, const Values& p, Vec3* /*tag*/) {
  if (name.name == "iso") return std::make_unique<Isotropic<3>>(p);
  if (name.name == "cube-linear") return std::make_unique<CubeLinear>(p);
  if (name.name == "polar-1") return std::make_unique<Polar>(p, false);
  if (name.name == "polar-2") return std::make_unique<Polar>(p, true);
  if (name.name == "tilted-plane") return std::make_unique<TiltedPlane>(p);
  if (name.name == "sphere") return std::make_unique<SphereWall>(p);
  if (name.name == "cube") return std::make_unique<CubeWall>(p);
  if (name.name == "plane-bl") return std::make_unique<PlaneLayers>(p);
  return std::make_unique<RoundBody<3>>(p, Vec3(2.0, 1.5, 1.5), 0.15);
}

}  // namespace

const std::vector<AnalyticName>& analytic_names() {
  static const std::vector<AnalyticKey> sphere_center = {
      {"cx", 1.0, kAnyReal}, {"cy", 0.75, kAnyReal}, {"cz", 0.75, kAnyReal}};
  static const std::vector<AnalyticName> names = {
      {"iso", 0, "one size everywhere", {{"h", 0.1}}},
      {"tilted-plane", 3, "a tilted plane in the unit cube", {{"hmin", 1e-4}, {"ht", 0.1}, {"growth", 0.2}}},
      {"sphere", 3, "a sphere in the unit cube", {{"R", 0.3}, {"hmin", 2e-3}, {"H2", 0.1}, {"growth", 0.2}}},
      {"cube",
       3,
       "a sharp cube in the unit cube",
       {{"half", 0.25}, {"hmin", 2e-4}, {"H2", 0.1}, {"growth", 0.2}}},
      {"cube-linear", 3, "thin at z = 1/2 of the unit cube", {{"h0", 1e-3}}},
      {"polar-1", 3, "thin at a cylinder in the unit cube", {{"h0", 1e-3}, {"scale", 1.0}}},
      {"polar-2", 3, "the same, finer around its axis too", {{"h0", 1e-3}, {"scale", 1.0}}},
      {"plane-bl",
       3,
       "layers on both sides of a plane",
       {{"z0", 0.5, kAnyReal}, {"hmin", 1e-4}, {"alpha", 1.2, 1.0}, {"ht", 0.05}, {"hmax", 0.05}}},
      {"sphere-bl", 3, "layers on a sphere in a box of 2 x 1.5 x 1.5",
       round_keys(sphere_center, 0.25, kDerived)},
      {"sphere-bl-mild", 3, "the same, with a first layer of 1e-3", round_keys(sphere_center, 0.25, 1e-3)},
      {"circle-bl", 2, "layers on a circle in a box of 8.5 x 2.75",
       round_keys({{"cx", 2.0, kAnyReal}, {"cy", 1.375, kAnyReal}}, 0.5, kDerived)},
  };
  return names;
}

std::string analytic_list() {
  std::string out;
  for (const AnalyticName& n : analytic_names()) {
    std::string keys;
    for (const AnalyticKey& k : n.keys)
      keys += (keys.empty() ? "" : ",") + k.name + (std::isnan(k.value) ? "" : fmt::format("={:g}", k.value));
    out += fmt::format("  {}:{}\n      {}{}\n", n.name, keys, n.help, n.dimension == 2 ? " (2D)" : "");
  }
  return out;
}

int analytic_dimension(std::string_view spec) { return find_name(spec).dimension; }

template <int D>
std::unique_ptr<const AnalyticMetric<D>> make_analytic_metric(std::string_view spec) {
  const AnalyticName& name = find_name(spec);
  if (name.dimension != 0 && name.dimension != D)
    throw Error(ErrorCode::kUsage,
                fmt::format("analytic metric {} is {}-dimensional, the mesh {}-dimensional", name.name,
                            name.dimension, D));
  const std::size_t colon = spec.find(':');
  const Values values = parse_keys(name, colon == std::string_view::npos ? "" : spec.substr(colon + 1));
  return make(name, values, static_cast<Vec<D>*>(nullptr));
}

template std::unique_ptr<const AnalyticMetric<2>> make_analytic_metric(std::string_view);
template std::unique_ptr<const AnalyticMetric<3>> make_analytic_metric(std::string_view);

}  // namespace lamina
