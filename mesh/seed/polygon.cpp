// Ears are cut off until a triangle is left: of all corners that turn left and whose triangle holds no other
// point of the border, the one with the best triangle goes next. By exact predicates every cell is positive;
// for a simple polygon there always are such corners. The optimizer makes good cells of these. Of the
// triangulators that Debian has, Triangle is not free and CGAL would be a dependency of its own for this.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/predicates.h"
#include "mesh/seed.h"

namespace lamina {
namespace {

bool cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const auto between = [](const Vec2& p, const Vec2& q, const Vec2& x) {
    return (x.array() >= p.cwiseMin(q).array()).all() && (x.array() <= p.cwiseMax(q).array()).all();
  };
  const double abc = orient2d(a, b, c), abd = orient2d(a, b, d), cda = orient2d(c, d, a),
               cdb = orient2d(c, d, b);
  if (((abc > 0.0 && abd < 0.0) || (abc < 0.0 && abd > 0.0)) &&
      ((cda > 0.0 && cdb < 0.0) || (cda < 0.0 && cdb > 0.0)))
    return true;
  return (abc == 0.0 && between(a, b, c)) || (abd == 0.0 && between(a, b, d)) ||
         (cda == 0.0 && between(c, d, a)) || (cdb == 0.0 && between(c, d, b));
}

class EarCutter {
 public:
  explicit EarCutter(const std::vector<Vec2>& x)
      : x_(x), next_(x.size()), before_(x.size()), worth_(x.size()) {
    const auto n = static_cast<Index>(x.size());
    for (Index i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      before_[i] = (i + n - 1) % n;
    }
    for (Index i = 0; i < n; ++i) worth_[i] = worth(i);
  }

  std::vector<std::array<Index, 3>> cut() {
    std::vector<std::array<Index, 3>> cells;
    std::vector<Index> left(x_.size());
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = static_cast<Index>(i);
    while (left.size() >= 3) {
      const auto best =
          std::max_element(left.begin(), left.end(), [&](Index a, Index b) { return worth_[a] < worth_[b]; });
      const Index i = *best;
      if (!(worth_[i] > 0.0))
        throw Error(ErrorCode::kDomain,
                    fmt::format("the border of the domain has a spike near {:g} {:g}", x_[i][0], x_[i][1]));
      cells.push_back({before_[i], i, next_[i]});
      left.erase(best);
      next_[before_[i]] = next_[i];
      before_[next_[i]] = before_[i];
      worth_[before_[i]] = worth(before_[i]);
      worth_[next_[i]] = worth(next_[i]);
    }
    return cells;
  }

 private:
  /// Quality of the ear at corner i; 0 when it is none.
  [[nodiscard]] double worth(Index i) const {
    const Vec2 &a = x_[before_[i]], &b = x_[i], &c = x_[next_[i]];
    const double area = orient2d(a, b, c);
    if (!(area > 0.0)) return 0.0;
    for (Index k = next_[next_[i]]; k != before_[i]; k = next_[k]) {
      const Vec2& p = x_[k];
      if (orient2d(a, b, p) >= 0.0 && orient2d(b, c, p) >= 0.0 && orient2d(c, a, p) >= 0.0) return 0.0;
    }
    return area / ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm());
  }

  const std::vector<Vec2>& x_;
  std::vector<Index> next_, before_;
  std::vector<double> worth_;
};

}  // namespace

void require_simple(const DomainBorder& border, const std::string& name) {
  const std::vector<Vec2>& x = border.points;
  const std::size_t n = x.size();
  if (n < 3)
    throw Error(ErrorCode::kDomain, fmt::format("{}: fewer than three points surround nothing", name));
  std::vector<std::size_t> by_left(n);  // segments, by their left ends
  for (std::size_t i = 0; i < n; ++i) by_left[i] = i;
  const auto left = [&](std::size_t i) { return std::min(x[i][0], x[(i + 1) % n][0]); };
  const auto right = [&](std::size_t i) { return std::max(x[i][0], x[(i + 1) % n][0]); };
  std::sort(by_left.begin(), by_left.end(), [&](std::size_t i, std::size_t j) { return left(i) < left(j); });
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = by_left[k];
    for (std::size_t l = k + 1; l < n && left(by_left[l]) <= right(i); ++l) {
      const std::size_t j = by_left[l];
      if ((i + 1) % n == j || (j + 1) % n == i) continue;
      if (cross(x[i], x[(i + 1) % n], x[j], x[(j + 1) % n]))
        throw Error(ErrorCode::kDomain,
                    fmt::format("{}: the border of the domain crosses itself near {:g} {:g}", name, x[i][0],
                                x[i][1]));
    }
  }
}

Mesh<2> make_seed(const DomainBorder& border) {
  require_simple(border, "the border of the domain");
  Mesh<2> mesh;
  mesh.points = border.points;
  mesh.cells = EarCutter(border.points).cut();
  const auto n = static_cast<Index>(border.points.size());
  for (Index i = 0; i < n; ++i) mesh.facets.push_back({i, (i + 1) % n});
  mesh.facet_tags = border.tags;
  mesh.facet_names = border.names;
  return mesh;
}

DomainBorder c_border(double radius, double length, double height) {
  if (!(radius > 0.0 && length > 0.0 && height > 0.0 && height <= 2.0 * radius))
    throw Error(
        ErrorCode::kDomain,
        fmt::format("--domain c {:g} {:g} {:g}: all must be positive, and the height at most twice the "
                    "radius",
                    radius, length, height));
  constexpr Index kInlet = 1, kOutlet = 2, kLower = 3, kUpper = 4;
  constexpr int kSegments = 128;  // of the arc: they stray from it by 8e-5 of the radius
  const double half = 0.5 * height, angle = std::asin(std::min(1.0, half / radius));
  DomainBorder border;
  border.names = {{kInlet, "inlet"}, {kOutlet, "outlet"}, {kLower, "lower"}, {kUpper, "upper"}};
  const auto add = [&](double x, double y, Index tag) {
    border.points.emplace_back(x, y);
    border.tags.push_back(tag);
  };
  add(-radius * std::cos(angle), -half, kLower);
  add(length, -half, kOutlet);
  add(length, half, kUpper);
  for (int k = 0; k < kSegments; ++k) {
    const double a = angle * (1.0 - 2.0 * k / kSegments);
    add(-radius * std::cos(a), k == 0 ? half : radius * std::sin(a), kInlet);
  }
  return border;
}

}  // namespace lamina
