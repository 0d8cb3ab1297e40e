// Links Lamina::pipeline: a case that names a missing body is refused with the numbered error.
#include "apps/pipeline/pipeline.h"

int main() {
  lamina::Case c;
  c.body = "no_such_body.stl";
  try {
    lamina::load_body(c, nullptr);
  } catch (const lamina::Error& e) {
    return e.code() == lamina::ErrorCode::kFileMissing ? 0 : 1;
  }
  return 1;
}
