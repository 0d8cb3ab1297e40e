// Links Lamina::mesh: a seed mesh by every generator of this build, checked.
#include "mesh/seed.h"
#include "mesh/validate.h"

int main() {
  lamina::Box<3> box;
  box.lo = {0, 0, 0};
  box.hi = {2, 1, 1};
  const auto kind = lamina::have_tetgen() ? lamina::SeedKind::kTetgen : lamina::SeedKind::kLattice;
  const auto mesh = lamina::make_seed<3>(box, 0.5, kind);
  return lamina::validate<3>(mesh, box).ok() ? 0 : 1;
}
