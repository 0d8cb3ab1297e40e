// Validation in three sweeps: indices, then cells (orientation, volume), then facets. A facet is met at its
// smallest vertex: the cells around that vertex give all copies of it, which are sorted and compared there.
// So the memory is one vertex-to-cell list (4 bytes an entry), where a sorted list of all facets would take
// four times as much.
#include "mesh/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/parallel.h"
#include "core/predicates.h"
#include "mesh/topology/incidence.h"
#include "mesh/topology/sum.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr double kTolerance = 1e-10;  // of sums over millions of cells that are each right to rounding

template <std::size_t N>
bool bad_simplex(const std::array<Index, N>& s, std::size_t points) {
  for (std::size_t i = 0; i < N; ++i) {
    if (s[i] < 0 || static_cast<std::size_t>(s[i]) >= points) return true;
    for (std::size_t j = 0; j < i; ++j)
      if (s[i] == s[j]) return true;
  }
  return false;
}

template <std::size_t N>
std::int64_t count_bad(const std::vector<std::array<Index, N>>& simplices, std::size_t points) {
  return reduce(
      simplices.size(), std::int64_t{0},
      [&](std::size_t begin, std::size_t end) {
        std::int64_t bad = 0;
        for (std::size_t i = begin; i < end; ++i) bad += bad_simplex(simplices[i], points);
        return bad;
      },
      [](std::int64_t a, std::int64_t b) { return a + b; }, kGrain);
}

/// One copy of a facet at its smallest vertex.
template <int D>
struct FacetCopy {
  std::array<Index, D - 1> rest;  ///< the other vertices, ascending
  bool odd;                       ///< parity of the permutation that sorts the facet
  std::int32_t label;             ///< tag of a listed facet; unused for a cell's

  bool operator<(const FacetCopy& o) const {
    return std::tie(rest, odd, label) < std::tie(o.rest, o.odd, o.label);
  }
};

/// The copy of `facet` at v, if v is its smallest vertex.
template <int D>
bool facet_copy(std::array<Index, D> facet, Index v, FacetCopy<D>& copy) {
  bool odd = false;
  for (int i = 1; i < D; ++i) {
    for (int j = i; j > 0 && facet[j] < facet[j - 1]; --j) {
      std::swap(facet[j], facet[j - 1]);
      odd = !odd;
    }
  }
  if (facet[0] != v) return false;
  std::copy(facet.begin() + 1, facet.end(), copy.rest.begin());
  copy.odd = odd;
  copy.label = 0;
  return true;
}

template <int D>
double facet_area(const std::array<Vec<D>, D>& x) {
  if constexpr (D == 2) {
    return (x[1] - x[0]).norm();
  } else {
    return 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm();
  }
}

/// Every vertex has the same coordinate, exactly that of a face of the box.
template <int D>
bool in_box_face(const std::array<Vec<D>, D>& x, const Box<D>& box) {
  for (int axis = 0; axis < D; ++axis) {
    for (const double face : {box.lo[axis], box.hi[axis]})
      if (std::all_of(x.begin(), x.end(), [&](const Vec<D>& p) { return p[axis] == face; })) return true;
  }
  return false;
}

struct FacetTally {
  std::int64_t overshared = 0, misoriented = 0, boundary = 0, mismatch = 0, inward = 0, off_box = 0,
               unused = 0;
  CompensatedSum area;
};

FacetTally operator+(FacetTally a, const FacetTally& b) {
  a.overshared += b.overshared;
  a.misoriented += b.misoriented;
  a.boundary += b.boundary;
  a.mismatch += b.mismatch;
  a.inward += b.inward;
  a.off_box += b.off_box;
  a.unused += b.unused;
  a.area.add(b.area);
  return a;
}

template <int D>
class FacetCheck {
 public:
  FacetCheck(const Mesh<D>& mesh, const std::optional<Box<D>>& box, bool any_bad) : mesh_(mesh), box_(box) {
    const std::size_t n = mesh.points.size();
    cells_ =
        incidence(n, mesh.cells, [&](std::size_t i) { return any_bad && bad_simplex(mesh.cells[i], n); });
    facets_ =
        incidence(n, mesh.facets, [&](std::size_t i) { return any_bad && bad_simplex(mesh.facets[i], n); });
  }

  FacetTally run() const {
    return reduce(
        mesh_.points.size(), FacetTally{},
        [&](std::size_t begin, std::size_t end) {
          FacetTally tally;
          std::vector<FacetCopy<D>> found, listed;
          for (std::size_t v = begin; v < end; ++v) {
            gather(static_cast<Index>(v), found, listed);
            tally.unused += cells_.of(v).empty();
            compare(static_cast<Index>(v), found, listed, tally);
          }
          return tally;
        },
        [](const FacetTally& a, const FacetTally& b) { return a + b; }, kGrain);
  }

 private:
  void gather(Index v, std::vector<FacetCopy<D>>& found, std::vector<FacetCopy<D>>& listed) const {
    found.clear();
    listed.clear();
    FacetCopy<D> copy;
    for (const Index c : cells_.of(v)) {
      for (const auto& corners : kCellFacets<D>) {
        std::array<Index, D> facet;
        for (int k = 0; k < D; ++k) facet[k] = mesh_.cells[c][corners[k]];
        if (facet_copy<D>(facet, v, copy)) found.push_back(copy);
      }
    }
    for (const Index f : facets_.of(v)) {
      if (!facet_copy<D>(mesh_.facets[f], v, copy)) continue;
      copy.label = mesh_.facet_tags.empty() ? 0 : mesh_.facet_tags[f];
      listed.push_back(copy);
    }
    std::sort(found.begin(), found.end());
    std::sort(listed.begin(), listed.end());
  }

  /// Walks both sorted lists group by group.
  void compare(Index v, const std::vector<FacetCopy<D>>& found, const std::vector<FacetCopy<D>>& listed,
               FacetTally& tally) const {
    auto in_list = listed.begin();
    for (auto group = found.begin(); group != found.end();) {
      const auto end = std::find_if(group, found.end(), [&](const auto& c) { return c.rest != group->rest; });
      for (; in_list != listed.end() && in_list->rest < group->rest; ++in_list) ++tally.mismatch;
      const auto list_begin = in_list;
      while (in_list != listed.end() && in_list->rest == group->rest) ++in_list;
      const auto copies = end - group, entries = in_list - list_begin;
      if (copies > 2) ++tally.overshared;
      if (copies == 2 && group->odd == group[1].odd) ++tally.misoriented;
      if (copies == 1) {
        count_boundary(v, *group, tally);
        if (!mesh_.facets.empty()) tally.mismatch += std::abs(entries - 1);
        if (entries == 1 && list_begin->odd != group->odd) ++tally.inward;
      } else if (entries > 0) {
        tally.mismatch += list_begin->label != 0 ? entries - 1 : entries;
      }
      group = end;
    }
    tally.mismatch += listed.end() - in_list;
  }

  void count_boundary(Index v, const FacetCopy<D>& copy, FacetTally& tally) const {
    std::array<Vec<D>, D> x;
    x[0] = mesh_.points[v];
    for (int k = 1; k < D; ++k) x[k] = mesh_.points[copy.rest[k - 1]];
    ++tally.boundary;
    tally.area.add(facet_area<D>(x));
    if (box_ && !in_box_face<D>(x, *box_)) ++tally.off_box;
  }

  const Mesh<D>& mesh_;
  const std::optional<Box<D>>& box_;
  Incidence cells_, facets_;
};

struct CellTally {
  std::int64_t nonpositive = 0;
  CompensatedSum volume;
};

template <int D>
CellTally check_cells(const Mesh<D>& mesh, bool any_bad) {
  return reduce(
      mesh.cells.size(), CellTally{},
      [&](std::size_t begin, std::size_t end) {
        CellTally tally;
        for (std::size_t i = begin; i < end; ++i) {
          if (any_bad && bad_simplex(mesh.cells[i], mesh.points.size())) continue;
          std::array<Vec<D>, D + 1> x;
          for (int k = 0; k <= D; ++k) x[k] = mesh.points[mesh.cells[i][k]];
          const double det = orient<D>(x);
          // What the predicate says of coordinates that are not finite means nothing.
          const bool finite = std::all_of(x.begin(), x.end(), [](const Vec<D>& p) { return p.allFinite(); });
          tally.nonpositive += !(finite && det > 0.0);
          tally.volume.add(det);
        }
        return tally;
      },
      [](CellTally a, const CellTally& b) {
        a.nonpositive += b.nonpositive;
        a.volume.add(b.volume);
        return a;
      },
      kGrain);
}

template <int D>
double surface_of(const Box<D>& box) {
  const Vec<D> s = box.size();
  if constexpr (D == 2) {
    return 2.0 * (s[0] + s[1]);
  } else {
    return 2.0 * (s[0] * s[1] + s[1] * s[2] + s[2] * s[0]);
  }
}

}  // namespace

bool Validation::ok() const {
  return nonpositive_cells == 0 && bad_indices == 0 && overshared_facets == 0 && misoriented_facets == 0 &&
         boundary_mismatch == 0 && off_box_facets == 0 && volume_error < kTolerance &&
         boundary_area_error < kTolerance;
}

std::string Validation::summary() const {
  if (ok()) return "valid";
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "invalid: " : ", ") + part; };
  if (bad_indices > 0) add(fmt::format("{} cells or facets with a missing or repeated vertex", bad_indices));
  if (nonpositive_cells > 0) add(fmt::format("{} cells not positive", nonpositive_cells));
  if (overshared_facets > 0) add(fmt::format("{} facets shared by more than two cells", overshared_facets));
  if (misoriented_facets > 0)
    add(fmt::format("{} facets whose two cells overlap or are turned over", misoriented_facets));
  if (boundary_mismatch > 0) add(fmt::format("{} listed facets differ from the boundary", boundary_mismatch));
  if (off_box_facets > 0) add(fmt::format("{} boundary facets not in a face of the box", off_box_facets));
  if (!(volume_error < kTolerance)) add(fmt::format("volume off by a fraction of {:.3g}", volume_error));
  if (!(boundary_area_error < kTolerance))
    add(fmt::format("boundary off by a fraction of {:.3g}", boundary_area_error));
  return text;
}

template <int D>
Validation validate(const Mesh<D>& mesh, const std::optional<Box<D>>& box) {
  constexpr double kParallelepiped = D == 2 ? 2.0 : 6.0;  // the determinant over the volume of the simplex
  Validation v;
  v.bad_indices = count_bad(mesh.cells, mesh.points.size()) + count_bad(mesh.facets, mesh.points.size());
  const bool any_bad = v.bad_indices > 0;
  const CellTally cells = check_cells(mesh, any_bad);
  v.nonpositive_cells = cells.nonpositive;
  v.volume = cells.volume.value() / kParallelepiped;
  const FacetTally facets = FacetCheck<D>(mesh, box, any_bad).run();
  v.overshared_facets = facets.overshared;
  v.misoriented_facets = facets.misoriented;
  v.unused_points = facets.unused;
  v.boundary_facets = facets.boundary;
  v.boundary_mismatch = facets.mismatch;
  v.inward_facets = facets.inward;
  v.off_box_facets = facets.off_box;
  if (box) {
    v.volume_error = std::abs(v.volume / box->volume() - 1.0);
    v.boundary_area_error = std::abs(facets.area.value() / surface_of<D>(*box) - 1.0);
  }
  return v;
}

template Validation validate<2>(const Mesh<2>&, const std::optional<Box<2>>&);
template Validation validate<3>(const Mesh<3>&, const std::optional<Box<3>>&);

}  // namespace lamina
