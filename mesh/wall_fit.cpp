// The mesh's wall is walked cell by cell. Points of the exact wall are looked up in a tree of the cells that
// may hold some: those with a vertex no farther from the wall than the cell is long.
#include "mesh/wall_fit.h"

#include <algorithm>
#include <cmath>

#include "core/box_tree.h"
#include "mesh/topology/zero_surface.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 512;
constexpr std::size_t kWorst = 20;

template <int D>
Vec3 in_space(const Vec<D>& x) {
  Vec3 out = Vec3::Zero();
  out.template head<D>() = x;
  return out;
}

bool longer(const WallFit::Straddler& a, const WallFit::Straddler& b) {
  return a.length != b.length ? a.length > b.length : a.cell < b.cell;
}

void keep_worst(WallFit& fit) {
  std::sort(fit.worst.begin(), fit.worst.end(), longer);
  fit.worst.resize(std::min(fit.worst.size(), kWorst));
}

const WallFit::Worst& farther(const WallFit::Worst& a, const WallFit::Worst& b) {
  return b.distance > a.distance ? b : a;
}

WallFit join(WallFit a, const WallFit& b) {
  a.to_wall = farther(a.to_wall, b.to_wall);
  a.to_mesh = farther(a.to_mesh, b.to_mesh);
  a.anywhere = farther(a.anywhere, b.anywhere);
  a.mesh_points += b.mesh_points;
  a.wall_points += b.wall_points;
  a.outside += b.outside;
  a.straddling += b.straddling;
  a.worst.insert(a.worst.end(), b.worst.begin(), b.worst.end());
  keep_worst(a);
  return a;
}

template <int D>
class Fitter {
 public:
  Fitter(const Mesh<D>& mesh, const std::vector<double>& phi, const ExactWall<D>& wall)
      : mesh_(mesh), phi_(phi), wall_(wall) {}

  /// The mesh's wall.
  [[nodiscard]] WallFit walk() const {
    return reduce(
        mesh_.cells.size(), WallFit{},
        [&](std::size_t begin, std::size_t end) {
          WallFit fit;
          for (std::size_t c = begin; c < end; ++c) walk(c, fit);
          keep_worst(fit);
          return fit;
        },
        join, kGrain);
  }

  /// Points of the exact wall, and the cells that hold some of them.
  [[nodiscard]] WallFit look_up(const std::vector<Vec<D>>& points) const {
    const Tree tree = plant();
    std::vector<Index> holder(points.size(), kNone);
    WallFit fit = reduce(
        points.size(), WallFit{},
        [&](std::size_t begin, std::size_t end) {
          WallFit f;
          for (std::size_t i = begin; i < end; ++i) holder[i] = look_up(tree, points[i], f);
          return f;
        },
        join, kGrain);
    // Those cells whose vertices do not tell that the wall runs through; each once.
    std::vector<std::pair<Index, std::size_t>> hidden;
    for (std::size_t i = 0; i < holder.size(); ++i)
      if (holder[i] != kNone && zero_piece<D>(mesh_, phi_, static_cast<std::size_t>(holder[i])).count == 0)
        hidden.emplace_back(holder[i], i);
    std::sort(hidden.begin(), hidden.end());
    Index last = kNone;
    for (const auto& [cell, i] : hidden)
      if (std::exchange(last, cell) != cell) judge_size(static_cast<std::size_t>(cell), points[i], fit);
    keep_worst(fit);
    return fit;
  }

 private:
  struct Tree {
    Vec3 origin = Vec3::Zero();
    std::vector<Index> cells;
    detail::BoxTree boxes;
  };

  [[nodiscard]] const Vec<D>& corner(std::size_t c, int i) const { return mesh_.points[mesh_.cells[c][i]]; }

  [[nodiscard]] double longest_edge(std::size_t c) const {
    double longest = 0.0;
    for (const auto& [a, b] : kCellEdges<D>)
      longest = std::max(longest, (corner(c, b) - corner(c, a)).squaredNorm());
    return std::sqrt(longest);
  }

  void judge_size(std::size_t c, const Vec<D>& wall_point, WallFit& fit) const {
    const Metric<D> m = wall_.metric(wall_point);
    double longest = 0.0;
    for (const auto& [a, b] : kCellEdges<D>)
      longest = std::max(longest, m.length(corner(c, b) - corner(c, a)));
    if (longest <= WallFit::kTooLong) return;
    ++fit.straddling;
    fit.worst.push_back({static_cast<Index>(c), longest, in_space<D>(wall_point)});
    if (fit.worst.size() > 4 * kWorst) keep_worst(fit);
  }

  /// Whether the wall is smooth within a cell, as seen from some of its points.
  [[nodiscard]] static bool is_smooth(const WallProbe<D>* seen, int count, double extent) {
    for (int i = 0; i < count; ++i)
      if (!(seen[i].edge_distance > extent) || seen[i].normal.dot(seen[0].normal) < std::cos(WallFit::kKink))
        return false;
    return true;
  }

  void walk(std::size_t c, WallFit& fit) const {
    const ZeroPiece<D> piece = zero_piece<D>(mesh_, phi_, c);
    if (piece.count == 0) return;
    constexpr int kMost = 2 * (D - 1) + 1;  // points of the piece
    std::array<Vec<D>, kMost> x;
    std::array<WallProbe<D>, kMost + D + 1> seen;
    const int count = piece.count + 1;
    for (int i = 0; i < piece.count; ++i) x[i] = piece.corners[i];
    x[piece.count] = piece.centroid();
    for (int i = 0; i < count; ++i) seen[i] = wall_.probe(x[i]);
    for (int k = 0; k <= D; ++k) seen[count + k] = wall_.probe(corner(c, k));
    const bool smooth = is_smooth(seen.data(), count + D + 1, longest_edge(c));
    for (int i = 0; i < count; ++i) {
      const WallFit::Worst here{std::abs(seen[i].phi), in_space<D>(x[i])};
      fit.anywhere = farther(fit.anywhere, here);
      if (smooth) fit.to_wall = farther(fit.to_wall, here);
    }
    if (smooth) fit.mesh_points += count;
    judge_size(c, seen[piece.count].closest, fit);
  }

  [[nodiscard]] Tree plant() const {
    Tree tree;
    Box<3> bounds;
    for (const Vec<D>& x : mesh_.points) bounds.extend(in_space<D>(x));
    tree.origin = bounds.center();
    std::vector<std::uint8_t> near(mesh_.cells.size());
    for_each_index(near.size(), [&](std::size_t c) {
      const auto& cell = mesh_.cells[c];
      const double extent = longest_edge(c);
      near[c] = std::all_of(cell.begin(), cell.end(), [&](Index v) { return std::abs(phi_[v]) <= extent; });
    });
    for (std::size_t c = 0; c < near.size(); ++c)
      if (near[c] != 0) tree.cells.push_back(static_cast<Index>(c));
    std::vector<detail::BoxRef> refs(tree.cells.size());
    for_each_index(refs.size(), [&](std::size_t i) {
      std::array<Vec3, D + 1> x;
      for (int k = 0; k <= D; ++k)
        x[k] = in_space<D>(corner(static_cast<std::size_t>(tree.cells[i]), k)) - tree.origin;
      refs[i] = detail::BoxRef::around(x.data(), D + 1, tree.cells[i]);
    });
    tree.boxes = detail::build_box_tree(std::move(refs));
    return tree;
  }

  /// Barycentric coordinates of x in a cell.
  [[nodiscard]] Vec<D + 1> weights(std::size_t c, const Vec<D>& x) const {
    Mat<D> edges;
    for (int k = 0; k < D; ++k) edges.col(k) = corner(c, k + 1) - corner(c, 0);
    const Vec<D> inner = edges.partialPivLu().solve(x - corner(c, 0));
    Vec<D + 1> w;
    w << 1.0 - inner.sum(), inner;
    return w;
  }

  /// The cell that holds x, by the largest least weight.
  Index look_up(const Tree& tree, const Vec<D>& x, WallFit& fit) const {
    constexpr double kSlack = 1e-7;  // of a weight: facets of thin cells are known no better
    const Vec3 local = in_space<D>(x) - tree.origin;
    double zero = std::numeric_limits<double>::min();
    Index holder = kNone;
    double least = -kSlack, value = 0.0;
    detail::visit_nearest(tree.boxes, local.data(), zero, 1.0, [&](int begin, int count) {
      for (int i = begin; i < begin + count; ++i) {
        const Index c = tree.boxes.ids[static_cast<std::size_t>(i)];
        const Vec<D + 1> w = weights(static_cast<std::size_t>(c), x);
        const double inner = w.minCoeff();
        if (!(inner > least || (inner == least && c < holder))) continue;
        least = inner;
        holder = c;
        value = 0.0;
        for (int k = 0; k <= D; ++k) value += w[k] * phi_[mesh_.cells[static_cast<std::size_t>(c)][k]];
      }
    });
    if (holder == kNone) {
      ++fit.outside;
      return kNone;
    }
    const WallFit::Worst here{std::abs(value), in_space<D>(x)};
    fit.anywhere = farther(fit.anywhere, here);
    std::array<WallProbe<D>, D + 2> seen;
    seen[0] = wall_.probe(x);
    for (int k = 0; k <= D; ++k) seen[k + 1] = wall_.probe(corner(static_cast<std::size_t>(holder), k));
    if (is_smooth(seen.data(), D + 2, longest_edge(static_cast<std::size_t>(holder)))) {
      ++fit.wall_points;
      fit.to_mesh = farther(fit.to_mesh, here);
    }
    return holder;
  }

  const Mesh<D>& mesh_;
  const std::vector<double>& phi_;
  const ExactWall<D>& wall_;
};

}  // namespace

template <int D>
WallFit fit_wall(const Mesh<D>& mesh, const std::vector<double>& phi, const std::vector<Vec<D>>& wall_points,
                 const ExactWall<D>& wall) {
  const Fitter<D> fitter(mesh, phi, wall);
  return join(fitter.walk(), fitter.look_up(wall_points));
}

template WallFit fit_wall(const Mesh<2>&, const std::vector<double>&, const std::vector<Vec<2>>&,
                          const ExactWall<2>&);
template WallFit fit_wall(const Mesh<3>&, const std::vector<double>&, const std::vector<Vec<3>>&,
                          const ExactWall<3>&);

}  // namespace lamina
