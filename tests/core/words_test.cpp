#include "core/words.h"

#include <gtest/gtest.h>

namespace lamina {
namespace {

TEST(Counted, OneIsSingularAllElsePlural) {
  EXPECT_EQ(counted(1, "open edge"), "1 open edge");
  EXPECT_EQ(counted(0, "open edge"), "0 open edges");
  EXPECT_EQ(counted(2, "open edge"), "2 open edges");
  EXPECT_EQ(counted(5000000000, "cell"), "5000000000 cells");
}

TEST(Counted, IrregularPlural) {
  EXPECT_EQ(counted(1, "vertex", "vertices"), "1 vertex");
  EXPECT_EQ(counted(3, "vertex", "vertices"), "3 vertices");
}

}  // namespace
}  // namespace lamina
