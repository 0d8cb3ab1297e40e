// A folder for the files of one test, and other programs to compare with.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace lamina {

/// A fresh folder that goes with the object.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "lamina-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for test files");
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// Runs a Python program with the interpreter of the system; its output goes to log.txt beside it.
inline int run_python(const Scratch& folder, const std::string& program, const std::string& arguments = "") {
  write_text(folder / "program.py", program);
  const std::string command =
      "cd '" + folder.path().string() + "' && /usr/bin/python3 program.py " + arguments + " > log.txt 2>&1";
  return std::system(command.c_str());
}

/// True when the system's Python can import `modules` ("vtk", "numpy, meshio").
inline bool python_has(const Scratch& folder, const std::string& modules) {
  return run_python(folder, "import " + modules) == 0;
}

}  // namespace lamina
