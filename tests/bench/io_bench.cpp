// Reading and writing mesh files. LAMINA_BENCH_LATTICE=119 gives 10 million tetrahedra.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "mesh/io.h"
#include "mesh/seed.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

const Mesh<3>& lattice() {
  static const Mesh<3> mesh = [] {
    const char* side = std::getenv("LAMINA_BENCH_LATTICE");
    return make_seed<3>({Vec3::Zero(), Vec3(1.0, 1.1, 1.2)}, 1.0 / (side != nullptr ? std::atoi(side) : 12),
                        SeedKind::kLattice);
  }();
  return mesh;
}

struct Form {
  const char* name;
  const char* file;
  bool compress = true;
};
constexpr Form kForms[] = {
    {"vtu", "m.vtu"},     {"vtu_plain", "m.vtu", false},
    {"meshb", "m.meshb"}, {"msh", "m.msh"},
    {"su2", "m.su2"},     {"mesh", "m.mesh"},
    {"tetgen", "m.node"}, {"ugrid", "m.lb8.ugrid"},
    {"foam", "m.foam"},   {"geo", "m.geo"},
    {"usda", "m.usda"},   {"xdmf", "m.xdmf"},
    {"cgns", "m.cgns"},
};

fs::path folder() { return fs::temp_directory_path() / ("lamina-io-bench-" + std::to_string(::getpid())); }

std::int64_t size_of(const fs::path& mesh) {
  std::int64_t bytes = 0;
  for (const fs::path& file : mesh_files(mesh))
    if (fs::exists(file)) bytes += static_cast<std::int64_t>(fs::file_size(file));
  return bytes;
}

void run(benchmark::State& state, const Form& form, bool reads) {
  fs::create_directories(folder());
  const fs::path path = folder() / form.file;
  MeshWriteOptions options;
  options.compress = form.compress;
  if (reads) write_mesh(path, lattice(), options);
  lattice();
  for (auto _ : state) {
    if (reads) {
      benchmark::DoNotOptimize(read_mesh(path));
    } else {
      write_mesh(path, lattice(), options);
    }
  }
  const std::int64_t bytes = size_of(path);
  state.SetBytesProcessed(state.iterations() * bytes);
  state.counters["MB"] = static_cast<double>(bytes) / 1e6;
  fs::remove_all(folder());
}

[[maybe_unused]] const bool registered = [] {
  for (const Form& form : kForms) {
    const std::string name = form.name;
    if (mesh_format(form.file) == nullptr) continue;  // built without
    benchmark::RegisterBenchmark(("write_" + name).c_str(),
                                 [&form](benchmark::State& s) { run(s, form, false); })
        ->UseRealTime()
        ->MeasureProcessCPUTime()
        ->Unit(benchmark::kMillisecond);
    if (mesh_format(form.file)->reads)
      benchmark::RegisterBenchmark(("read_" + name).c_str(),
                                   [&form](benchmark::State& s) { run(s, form, true); })
          ->UseRealTime()
          ->MeasureProcessCPUTime()
          ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace lamina
