// The one exception type of Lamina. Libraries never print, exit or abort: bad input and failed I/O throw
// Error.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace lamina {

/// Numbered by stage, in blocks of 100; a number is never reused for another meaning.
enum class ErrorCode : int {
  kInternal = 1,           ///< a broken invariant: a defect of Lamina
  kInterrupted = 2,        ///< cancelled by the user
  kFileMissing = 100,      ///< the file does not exist or is not a regular file
  kFileUnreadable = 101,   ///< the file exists but cannot be opened or read
  kFileFormat = 102,       ///< the content does not follow the format
  kFileUnsupported = 103,  ///< a valid file that holds something Lamina does not take
  kFileWrite = 110,        ///< the output cannot be created, written or renamed
  kSurfaceEmpty = 200,     ///< no usable triangle is left
  kSurfaceInvalid = 201,   ///< a surface that no repair makes usable
  kLevelSetGrid = 300,     ///< a grid that cannot serve as level set
  kLevelSetBudget = 301,   ///< voxels or memory beyond the budget
  kParameter = 400,        ///< a number outside its range or against another
  kDomain = 401,           ///< body, domain and boxes do not fit together
  kSeed = 500,             ///< the seed mesh could not be built
  kAdapt = 600,            ///< the optimizer cannot work on this mesh
  kMeshInvalid = 700,      ///< a mesh that breaks positivity or conformity
  kUsage = 800,            ///< command line or case file
};

/// Thrown for bad input and failed I/O. The message is one line and names file, place, value, limit and
/// remedy where they exist.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  [[nodiscard]] ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace lamina

/// Checks an invariant in debug and CI builds (LAMINA_CHECKS); a failure is a defect of Lamina.
#ifdef LAMINA_CHECKS
#define LAMINA_STRINGIZE_(x) #x
#define LAMINA_STRINGIZE(x) LAMINA_STRINGIZE_(x)
#define LAMINA_ASSERT(cond)                                                                             \
  do {                                                                                                  \
    if (!(cond))                                                                                        \
      throw ::lamina::Error(::lamina::ErrorCode::kInternal,                                             \
                            "broken invariant at " __FILE__ ":" LAMINA_STRINGIZE(__LINE__) ": " #cond); \
  } while (false)
#else
#define LAMINA_ASSERT(cond) static_cast<void>(0)
#endif
