// Build by recursive binned SAH splits. An inner node that splits the references at position m is stored in
// slot m of a scratch array - no two nodes share a split position - so that subtrees can be built at the same
// time without a shared counter; the scratch is then walked once, depth first, into its final order.
#include "core/box_tree.h"

#include <array>
#include <cmath>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr int kBins = 16;
constexpr int kLeafSize = 4;
constexpr int kParallelSize = 8192;
constexpr int kMedianDepth = 60;  // deeper nodes are halved, so that the depth stays below kTreeStack

// One step beyond the rounded value, whichever way it was rounded: comparing the float with the double it
// came from is not safe, GCC 12's vectorizer may leave out the rounding in between.
float round_down(double v) {
  return std::nextafter(static_cast<float>(v), -std::numeric_limits<float>::infinity());
}

float round_up(double v) {
  return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity());
}

struct Bounds {
  std::array<float, 3> lo{3e38f, 3e38f, 3e38f}, hi{-3e38f, -3e38f, -3e38f};
  void add(const float* l, const float* h) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], l[a]);
      hi[a] = std::max(hi[a], h[a]);
    }
  }
  void add(const Bounds& b) { add(b.lo.data(), b.hi.data()); }
  [[nodiscard]] double half_area() const {
    const double x = double(hi[0]) - lo[0], y = double(hi[1]) - lo[1], z = double(hi[2]) - lo[2];
    return x < 0.0 ? 0.0 : x * y + y * z + z * x;
  }
};

double middle(const BoxRef& r, int axis) { return 0.5 * (double(r.lo[axis]) + double(r.hi[axis])); }

struct Split {
  double cost = std::numeric_limits<double>::infinity();
  int axis = -1, bin = 0;
};

struct Builder {
  std::vector<BoxRef> refs;
  std::vector<BoxNode> scratch;

  struct Built {
    std::int32_t code = 0;
    Bounds box;
  };

  Split best_split(std::size_t b, std::size_t e, const double* lo, const double* width) const;
  std::size_t partition(std::size_t b, std::size_t e, int depth);
  Built build(std::size_t b, std::size_t e, int depth);
  std::int32_t flatten(std::int32_t code, BoxTree& out);
};

Split Builder::best_split(std::size_t b, std::size_t e, const double* lo, const double* width) const {
  std::array<std::array<Bounds, kBins>, 3> box;
  std::array<std::array<int, kBins>, 3> count{};
  for (std::size_t i = b; i < e; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(width[a] > 0.0)) continue;
      const double t = (middle(refs[i], static_cast<int>(a)) - lo[a]) / width[a];
      const std::size_t k = static_cast<std::size_t>(std::clamp(t * kBins, 0.0, kBins - 1.0));
      box[a][k].add(refs[i].lo, refs[i].hi);
      ++count[a][k];
    }
  }
  Split best;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(width[a] > 0.0)) continue;
    std::array<double, kBins> right{};
    Bounds sum;
    int n = 0;
    for (std::size_t k = kBins - 1; k > 0; --k) {
      sum.add(box[a][k]);
      n += count[a][k];
      right[k] = sum.half_area() * n;
    }
    sum = {};
    n = 0;
    for (std::size_t k = 0; k + 1 < kBins; ++k) {
      sum.add(box[a][k]);
      n += count[a][k];
      const double cost = sum.half_area() * n + right[k + 1];
      if (n > 0 && n < static_cast<int>(e - b) && cost < best.cost)
        best = {cost, static_cast<int>(a), static_cast<int>(k) + 1};
    }
  }
  return best;
}

std::size_t Builder::partition(std::size_t b, std::size_t e, int depth) {
  double lo[3], hi[3], width[3];
  for (int a = 0; a < 3; ++a) {
    lo[a] = std::numeric_limits<double>::infinity();
    hi[a] = -lo[a];
    for (std::size_t i = b; i < e; ++i) {
      lo[a] = std::min(lo[a], middle(refs[i], a));
      hi[a] = std::max(hi[a], middle(refs[i], a));
    }
    width[a] = hi[a] - lo[a];
  }
  const Split s = depth < kMedianDepth ? best_split(b, e, lo, width) : Split{};
  if (s.axis < 0) return b + (e - b) / 2;
  const auto in_left = [&](const BoxRef& r) {
    const double t = (middle(r, s.axis) - lo[s.axis]) / width[s.axis];
    return static_cast<int>(std::clamp(t * kBins, 0.0, kBins - 1.0)) < s.bin;
  };
  const auto first = refs.begin();
  return static_cast<std::size_t>(std::partition(first + static_cast<std::ptrdiff_t>(b),
                                                 first + static_cast<std::ptrdiff_t>(e), in_left) -
                                  first);
}

Builder::Built Builder::build(std::size_t b, std::size_t e, int depth) {
  Built out;
  if (e - b <= kLeafSize) {
    for (std::size_t i = b; i < e; ++i) out.box.add(refs[i].lo, refs[i].hi);
    out.code = ~static_cast<std::int32_t>(b << 3 | (e - b));
    return out;
  }
  const std::size_t m = partition(b, e, depth);
  Built part[2];
  const auto left = [&] { part[0] = build(b, m, depth + 1); };
  const auto right = [&] { part[1] = build(m, e, depth + 1); };
  if (e - b > kParallelSize) {
    invoke_both(left, right);
  } else {
    left();
    right();
  }
  BoxNode& node = scratch[m];
  for (std::size_t c = 0; c < 2; ++c) {
    for (std::size_t a = 0; a < 3; ++a) {
      node.lo[a][c] = part[c].box.lo[a];
      node.hi[a][c] = part[c].box.hi[a];
    }
    node.child[c] = part[c].code;
    out.box.add(part[c].box);
  }
  out.code = static_cast<std::int32_t>(m);
  return out;
}

std::int32_t Builder::flatten(std::int32_t code, BoxTree& out) {
  if (code < 0) return code;
  const std::size_t at = out.nodes.size();
  out.nodes.push_back(scratch[static_cast<std::size_t>(code)]);
  for (int c = 0; c < 2; ++c) out.nodes[at].child[c] = flatten(out.nodes[at].child[c], out);
  return static_cast<std::int32_t>(at);
}

}  // namespace

BoxRef BoxRef::around(const Vec3* points, int count, Index id) {
  BoxRef r;
  r.id = id;
  for (int a = 0; a < 3; ++a) {
    double lo = points[0][a], hi = points[0][a];
    for (int k = 1; k < count; ++k) {
      lo = std::min(lo, points[k][a]);
      hi = std::max(hi, points[k][a]);
    }
    r.lo[a] = round_down(lo);
    r.hi[a] = round_up(hi);
  }
  return r;
}

BoxTree build_box_tree(std::vector<BoxRef> refs) {
  BoxTree tree;
  if (refs.empty()) return tree;
  Builder builder;
  builder.refs = std::move(refs);
  builder.scratch.resize(builder.refs.size() + 1);
  const Builder::Built built = builder.build(0, builder.refs.size(), 0);
  tree.nodes.reserve(builder.refs.size() / 2 + 1);
  tree.root = builder.flatten(built.code, tree);
  tree.ids.reserve(builder.refs.size());
  for (const BoxRef& r : builder.refs) tree.ids.push_back(r.id);
  return tree;
}

}  // namespace lamina::detail
