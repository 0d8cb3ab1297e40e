// One list of members serves both ways: `visit` hands each to a writer or to a reader. Values are stored as
// they lie in memory, so a snapshot is for the machine and the build that made it; the head tells.
#include "mesh/adapt/snapshot.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "core/error.h"
#include "mesh/adapt/operators.h"

namespace lamina::adapt_detail {
namespace {

[[noreturn]] void reject(const char* why) {
  throw Error(ErrorCode::kAdapt, std::string("the snapshot to go on from ") + why);
}

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

class Writer {
 public:
  template <class T>
  void operator()(const T& value) {
    if constexpr (IsVector<T>::value || std::is_same_v<T, std::string>) {
      (*this)(static_cast<std::uint64_t>(value.size()));
      if constexpr (std::is_same_v<T, std::vector<OperatorStats>>)
        for (const OperatorStats& o : value) visit_operator(*this, o);
      else
        put(value.data(), value.size() * sizeof(typename T::value_type));
    } else {
      put(&value, sizeof value);
    }
  }
  template <class Visitor, class O>
  static void visit_operator(Visitor& v, O& o) {
    v(o.name);
    v(o.tried);
    v(o.accepted);
    v(o.rejected_quality);
    v(o.rejected_length);
    v(o.rejected_class);
    v(o.seconds);
  }
  std::string bytes;

 private:
  void put(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  void operator()(T& value) {
    if constexpr (IsVector<T>::value || std::is_same_v<T, std::string>) {
      std::uint64_t n = 0;
      (*this)(n);
      if (n > rest_.size()) reject("is cut short");
      value.resize(n);
      if constexpr (std::is_same_v<T, std::vector<OperatorStats>>)
        for (OperatorStats& o : value) Writer::visit_operator(*this, o);
      else
        get(value.data(), n * sizeof(typename T::value_type));
    } else {
      get(&value, sizeof value);
    }
  }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }

 private:
  void get(void* data, std::size_t size) {
    if (size > rest_.size()) reject("is cut short");
    if (size > 0) std::memcpy(data, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  std::string_view rest_;
};

constexpr std::uint64_t kFormat = 0x33'6e'73'61'6e'69'6d'61ULL;

// What must agree: format, dimension, sizes of what is stored as it lies in memory, options.
template <int D>
std::vector<std::uint64_t> head_of(const AdaptOptions& o) {
  return {kFormat,
          D,
          sizeof(Metric<D>),
          sizeof(AdaptStep),
          std::bit_cast<std::uint64_t>(o.quality_floor),
          std::bit_cast<std::uint64_t>(o.start_size),
          std::bit_cast<std::uint64_t>(o.end_size),
          static_cast<std::uint64_t>(o.passes_per_step),
          static_cast<std::uint64_t>(o.final_passes),
          static_cast<std::uint64_t>(o.align),
          static_cast<std::uint64_t>(o.block_vertices),
          std::bit_cast<std::uint64_t>(o.hausdorff),
          std::bit_cast<std::uint64_t>(o.ridge_angle),
          static_cast<std::uint64_t>(o.keep_cell_tags)};
}

template <class Visitor, class State>
void visit(Visitor& v, State& s) {
  v(s.floors);
  v(s.next);
  v(s.pass);
  v(s.unit_already);
  v(s.mesh.x);
  v(s.mesh.metric);
  v(s.mesh.pieces);
  v(s.mesh.level);
  v(s.mesh.changed);
  v(s.mesh.cells);
  v(s.mesh.facet_pieces);
  v(s.mesh.regions);
  v(s.mesh.kept.lines);
  v(s.mesh.kept.corners);
  v(s.mesh.kept.points);
  v(s.mesh.kept.facets);
  v(s.mesh.bounds);
  v(s.tags.of_piece);
  v(s.tags.listed);
  v(s.tags.tagged);
  v(s.tags.cell_tags);
  v(s.tags.lines);
  v(s.tags.corner_tags);
  v(s.tags.required_point_tags);
  v(s.summary.steps);
  v(s.summary.operators);
}

template <class Visitor, class Shape>
void visit_shape(Visitor& v, Shape& s) {
  v(s.normals);
  v(s.first_inner);
  v(s.points);
  v(s.facets);
  v(s.facet_pieces);
  v(s.ridges);
  v(s.ridge_pieces);
  v(s.line_edges);
  v(s.edge_lines);
  v(s.first_required);
  v(s.tolerance);
  v(s.least_cosine);
}

template <int D>
bool has_consistent_lines(const AdaptState<D>& s, const ShapeData<D>& shape) {
  const KeptParts<D>& kept = s.mesh.kept;
  const auto known = [&](PieceId line) {
    return line >= kFirstLine && static_cast<std::size_t>(line - kFirstLine) < s.tags.lines.size();
  };
  const auto is_point = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < s.mesh.x.size(); };
  const auto are_points = [&](const auto& list) { return std::all_of(list.begin(), list.end(), is_point); };
  return std::all_of(kept.lines.begin(), kept.lines.end(),
                     [&](const LineEdge& e) { return known(e.line) && is_point(e.a) && is_point(e.b); }) &&
         std::all_of(shape.edge_lines.begin(), shape.edge_lines.end(), known) &&
         shape.edge_lines.size() == shape.line_edges.size() && are_points(kept.corners) &&
         are_points(kept.points) && std::all_of(kept.facets.begin(), kept.facets.end(), are_points) &&
         s.tags.corner_tags.size() == kept.corners.size() &&
         s.tags.required_point_tags.size() == kept.points.size();
}

template <int D>
bool consistent(const AdaptState<D>& s, const ShapeData<D>& shape) {
  const std::size_t n = s.mesh.x.size(), cells = s.mesh.cells.size();
  if (s.next > s.floors.size() || s.mesh.metric.size() != n || s.mesh.pieces.size() != n ||
      s.mesh.level.size() != n || s.mesh.changed.size() != n || s.mesh.facet_pieces.size() != cells ||
      (!s.mesh.regions.empty() && s.mesh.regions.size() != cells))
    return false;
  for (const PieceId region : s.mesh.regions)
    if (region >= s.tags.cell_tags.size() && !s.tags.cell_tags.empty()) return false;
  for (const auto& cell : s.mesh.cells)
    for (const Index v : cell)
      if (v < 0 || static_cast<std::size_t>(v) >= n) return false;
  for (const auto& pieces : s.mesh.facet_pieces)
    for (const PieceId p : pieces)
      if (p >= s.tags.of_piece.size()) return false;
  const auto known = [&](PieceId p) { return p < s.tags.of_piece.size(); };
  if (shape.normals.size() != s.tags.of_piece.size() || shape.facet_pieces.size() != shape.facets.size() ||
      shape.ridge_pieces.size() != shape.ridges.size() ||
      !std::all_of(shape.facet_pieces.begin(), shape.facet_pieces.end(), known))
    return false;
  const auto has_points = [&](const auto& corners) {
    return std::all_of(corners.begin(), corners.end(),
                       [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < shape.points.size(); });
  };
  if (!std::all_of(shape.facets.begin(), shape.facets.end(), has_points) ||
      !std::all_of(shape.ridges.begin(), shape.ridges.end(), has_points) ||
      !std::all_of(shape.line_edges.begin(), shape.line_edges.end(), has_points))
    return false;
  if (!has_consistent_lines(s, shape)) return false;
  return cells > 0 && s.summary.operators.size() == kOperatorCount;
}

}  // namespace

template <int D>
std::string encode(const AdaptState<D>& state, const AdaptOptions& options) {
  static_assert(std::is_trivially_copyable_v<Metric<D>> && std::is_trivially_copyable_v<AdaptStep>);
  Writer writer;
  writer(head_of<D>(options));
  visit(writer, state);
  visit_shape(writer, state.mesh.shape->data());
  return std::move(writer.bytes);
}

template <int D>
AdaptState<D> decode(std::string_view bytes, const AdaptOptions& options) {
  Reader reader(bytes);
  std::vector<std::uint64_t> head;
  reader(head);
  const std::vector<std::uint64_t> wanted = head_of<D>(options);
  if (head.size() != wanted.size() || !std::equal(head.begin(), head.begin() + 4, wanted.begin()))
    reject("is not one of this build and dimension");
  if (head != wanted) reject("was made with other options");
  AdaptState<D> state;
  visit(reader, state);
  ShapeData<D> shape;
  visit_shape(reader, shape);
  if (!reader.at_end() || !consistent(state, shape)) reject("is damaged");
  state.mesh.shape = std::make_shared<const BoundaryShape<D>>(std::move(shape));
  return state;
}

template std::string encode(const AdaptState<2>&, const AdaptOptions&);
template std::string encode(const AdaptState<3>&, const AdaptOptions&);
template AdaptState<2> decode(std::string_view, const AdaptOptions&);
template AdaptState<3> decode(std::string_view, const AdaptOptions&);

}  // namespace lamina::adapt_detail
