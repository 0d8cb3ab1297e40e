// The table of targets: rows, samples and CPU time. Each group of rows lives in its own source.
#pragma once

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"
#include "vdb/level_set.h"

namespace lamina::targets {

namespace fs = std::filesystem;

/// What a row says about the exit code: a time depends on the machine, a note on nothing.
enum class Kind { kAccuracy, kTime, kNote };

class Table {
 public:
  explicit Table(bool quick) : quick_(quick) {}
  void row(const std::string& id, const std::string& what, const std::string& target,
           const std::string& measured, bool met, Kind kind = Kind::kAccuracy);
  /// A row whose value must not exceed `most`; `unit` follows both numbers.
  void at_most(const std::string& id, const std::string& what, double measured, double most,
               const std::string& unit, const std::string& remark = "");
  /// A row whose rate, thousands of queries per CPU second, must reach `least`.
  void rate(const std::string& id, const std::string& what, double measured, double least);
  static void skipped(const std::string& id, const std::string& why);

  [[nodiscard]] std::size_t count(std::size_t full, std::size_t quick) const { return quick_ ? quick : full; }
  [[nodiscard]] bool quick() const { return quick_; }
  [[nodiscard]] int missed() const { return missed_; }

 private:
  bool quick_;
  int missed_ = 0;
};

/// CPU seconds of the process.
inline double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// The p-quantile; 0 of nothing.
double quantile(std::vector<double> values, double p);

/// A folder that goes with the object.
class Scratch {
 public:
  Scratch();
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] fs::path file(const std::string& name) const { return folder_ / name; }

 private:
  fs::path folder_;
};

void distance_rows(Table& table);    // A1, A3
void sign_rows(Table& table);        // A2
void throughput_rows(Table& table);  // A4
void wall_rows(Table& table);        // B1 to B5, C1
void grid_rows(Table& table);        // D1, D2
void reader_rows(Table& table);      // E1, E2

}  // namespace lamina::targets
