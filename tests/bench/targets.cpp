// levelset_targets [--quick]: the accuracy and speed the level set is held to, one row each: what, target,
// measured.
//
// References do not come from the code under test: formulas, brute force over all triangles in long double,
// ray crossings, OpenVDB's own checks. Exit code 1 when a row that is not about time is missed.
#include "tests/bench/targets.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace lamina::targets {

void Table::row(const std::string& id, const std::string& what, const std::string& target,
                const std::string& measured, bool met, Kind kind) {
  const char* verdict = kind == Kind::kNote ? "note" : met ? "met" : "MISSED";
  if (kind == Kind::kAccuracy && !met) ++missed_;
  fmt::print("{:<3} {:<60} {:<19} {:<58} {}\n", id, what, target, measured, verdict);
  std::fflush(stdout);
}

void Table::at_most(const std::string& id, const std::string& what, double measured, double most,
                    const std::string& unit, const std::string& remark) {
  row(id, what, fmt::format("<= {:.3g}{}", most, unit),
      fmt::format("{:.3g}{}{}{}", measured, unit, remark.empty() ? "" : ", ", remark), measured <= most);
}

void Table::rate(const std::string& id, const std::string& what, double measured, double least) {
  row(id, what, fmt::format(">= {:g} kq/s", least), fmt::format("{:.4g} kq/s", measured), measured >= least,
      Kind::kTime);
}

void Table::skipped(const std::string& id, const std::string& why) {
  fmt::print("{:<3} SKIPPED: {}\n", id, why);
}

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return 0.0;
  const std::size_t k =
      std::min(values.size() - 1, static_cast<std::size_t>(p * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(k), values.end());
  return values[k];
}

Scratch::Scratch() : folder_(fs::temp_directory_path() / ("lamina_targets_" + std::to_string(::getpid()))) {
  fs::create_directories(folder_);
}
Scratch::~Scratch() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace lamina::targets

int main(int argc, char** argv) {
  using namespace lamina::targets;
  const bool quick = argc > 1 && std::strcmp(argv[1], "--quick") == 0;
  if (argc > 2 || (argc == 2 && !quick)) {
    fmt::print(stderr, "usage: levelset_targets [--quick]\n");
    return 2;
  }
  Table table(quick);
  fmt::print("{:<3} {:<60} {:<19} {:<58} {}\n", "id", "what", "target", "measured", "verdict");
  for (const auto rows : {distance_rows, sign_rows, throughput_rows, wall_rows, grid_rows, reader_rows})
    rows(table);
  return table.missed() == 0 ? 0 : 1;
}
