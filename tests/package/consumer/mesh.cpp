// Links Lamina::mesh: the example of the README, and a seed mesh by every generator of this build.
// clang-format off
#include "mesh/seed.h"
#include "mesh/validate.h"

bool mesh_a_box(lamina::SeedKind kind) {
  lamina::Box<3> box;
  box.lo = {0, 0, 0};
  box.hi = {2, 1, 1};
  const lamina::Mesh<3> mesh = lamina::make_seed<3>(box, 0.5, kind);  // edges of about 0.5
  return lamina::validate<3>(mesh, box).ok();
}
// clang-format on

int main() {
  const bool good = mesh_a_box(lamina::SeedKind::kLattice) &&
                    (!lamina::have_tetgen() || mesh_a_box(lamina::SeedKind::kTetgen));
  return good ? 0 : 1;
}
