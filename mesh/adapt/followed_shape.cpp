#include "mesh/adapt/followed_shape.h"

#include <utility>

#include "core/error.h"

namespace lamina::adapt_detail {
namespace {

template <int D>
struct Remembered : FollowedShape {
  GlobalMesh<D> mesh;  // without what the mesh itself holds and what metrics decide
  BoundaryTags tags;
};

}  // namespace

template <int D>
std::shared_ptr<const FollowedShape> remember_shape(GlobalMesh<D>& global, BoundaryTags& tags) {
  auto shape = std::make_shared<Remembered<D>>();
  shape->mesh.pieces = std::move(global.pieces);
  shape->mesh.facet_pieces = std::move(global.facet_pieces);
  shape->mesh.regions = std::move(global.regions);
  shape->mesh.kept = std::move(global.kept);
  shape->mesh.shape = global.shape;
  shape->mesh.bounds = global.bounds;
  shape->tags = std::move(tags);
  return shape;
}

template <int D>
GlobalMesh<D> recall_mesh(const Mesh<D>& mesh, const FollowedShape& shape, BoundaryTags& tags) {
  const auto* known = dynamic_cast<const Remembered<D>*>(&shape);
  if (known == nullptr || known->mesh.pieces.size() != mesh.points.size() ||
      known->mesh.facet_pieces.size() != mesh.cells.size())
    throw Error(ErrorCode::kAdapt, "the shape to follow is that of another mesh");
  GlobalMesh<D> global = known->mesh;
  global.x = mesh.points;
  global.cells = mesh.cells;
  tags = known->tags;
  return global;
}

template std::shared_ptr<const FollowedShape> remember_shape(GlobalMesh<2>&, BoundaryTags&);
template std::shared_ptr<const FollowedShape> remember_shape(GlobalMesh<3>&, BoundaryTags&);
template GlobalMesh<2> recall_mesh(const Mesh<2>&, const FollowedShape&, BoundaryTags&);
template GlobalMesh<3> recall_mesh(const Mesh<3>&, const FollowedShape&, BoundaryTags&);

}  // namespace lamina::adapt_detail
