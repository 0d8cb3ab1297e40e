#include "vdb/outline.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "tests/vdb/message_of.h"
#include "vdb/detail/outline_parse.h"
#include "vdb/profiles.h"

namespace lamina {
namespace {

using detail::parse_aerofoil;
using detail::parse_points;

constexpr const char* kSelig = "NACA 0012\n 1.0 0.0\n 0.5 0.05\n 0.0 0.0\n 0.5 -0.05\n 1.0 0.0\n";

std::string refusal(Outline (*parse)(std::string_view, const std::string&), const std::string& text,
                    ErrorCode code = ErrorCode::kFileFormat) {
  return message_of(code, [&] { static_cast<void>(parse(text, "f")); });
}

TEST(Aerofoil, SeligAndLednicerGiveTheSameCurve) {
  const Outline selig = parse_aerofoil(kSelig, "f");
  const Outline lednicer =
      parse_aerofoil("0012\n  3.  3.\n\n0.0 0.0\n0.5 0.05\n1.0 0.0\n\n0.0 0.0\n0.5 -0.05\n1.0 0.0\n", "f");
  ASSERT_EQ(selig.curves.size(), 1u);
  ASSERT_EQ(lednicer.curves.size(), 1u);
  EXPECT_TRUE(selig.curves[0].smooth && selig.curves[0].closed);
  Outline a = selig, b = lednicer;
  EXPECT_EQ(clean(a, "f").duplicates, 0);
  EXPECT_EQ(clean(b, "f").duplicates, 1);  // the leading edge stands in both sides
  EXPECT_EQ(a.curves[0].points, b.curves[0].points);
}

TEST(Aerofoil, ReadsCommasCarriageReturnsAndNoTitle) {
  const Outline o = parse_aerofoil("1,0\r\n.5,.05\r\n0;0\r\n+5e-1\t-.05 0\r\n1 0\r\n", "f");
  EXPECT_EQ(o.curves[0].points, parse_aerofoil(kSelig, "f").curves[0].points);
}

TEST(Aerofoil, BluntEndsAreKept) {
  const Outline o = parse_aerofoil("1 .01\n.5 .05\n0 0\n.5 -.05\n1 -.01\n", "f");
  EXPECT_EQ(o.curves[0].points.size(), 5u);
}

TEST(Aerofoil, ElementsArePartedBy999) {
  const std::string body = "1 0\n.5 .05\n0 0\n.5 -.05\n1 0\n";
  EXPECT_EQ(parse_aerofoil("wing\n" + body + "999. 999.\n" + body, "f").curves.size(), 2u);
}

TEST(Aerofoil, SaysWhereItIsWrong) {
  EXPECT_NE(refusal(parse_aerofoil, "t\n1 0\n.5 0.o5\n0 0\n").find("f:3: \".5 0.o5\" is no point"),
            std::string::npos);
  EXPECT_NE(refusal(parse_aerofoil, "t\n1 0\n.5 nan\n0 0\n").find("f:3:"), std::string::npos);
  EXPECT_NE(refusal(parse_aerofoil, "t\n1 0\n.5 .1\n.3 .1\n0 0\n").find("does not close"), std::string::npos);
  EXPECT_NE(refusal(parse_aerofoil, "t\n3. 4.\n0 0\n.5 .1\n1 0\n0 0\n.5 -.1\n1 0\n").find("3 and 4 points"),
            std::string::npos);
  EXPECT_NE(refusal(parse_aerofoil, "only words\n", ErrorCode::kSurfaceEmpty).find("holds no points"),
            std::string::npos);
  EXPECT_NE(refusal(parse_aerofoil, "", ErrorCode::kSurfaceEmpty).find("holds no points"), std::string::npos);
}

TEST(Points, BlankLinesPartCurvesAndRepeatedFirstPointsCloseThem) {
  const Outline o = parse_points("x,y\n0,0\n1,0\n1,1\n0,0\n\n# a sheet\n2 0\n3 0\n", "f");
  ASSERT_EQ(o.curves.size(), 2u);
  EXPECT_TRUE(o.curves[0].closed);
  EXPECT_EQ(o.curves[0].points.size(), 3u);
  EXPECT_FALSE(o.curves[1].closed);
  EXPECT_FALSE(o.curves[1].smooth);
}

TEST(Points, SaysWhereTheyAreWrong) {
  EXPECT_NE(refusal(parse_points, "0 0\n1 2 3\n").find("f:2: 3 numbers"), std::string::npos);
  EXPECT_NE(refusal(parse_points, "0 0\n1 0\n\n5 5\n").find("f:4: a curve of one point"), std::string::npos);
  EXPECT_NE(refusal(parse_points, "0 0\nx y\n").find("f:2:"), std::string::npos);
}

TEST(Outline, CleaningOrientsSolidsAndHoles) {
  const std::vector<Vec2> outer{{0, 0}, {0, 3}, {3, 3}, {3, 0}}, inner{{1, 1}, {2, 1}, {2, 2}, {1, 2}};
  Outline o{{{.points = outer}, {.points = inner}}};
  const OutlineReport report = clean(o, "f");
  EXPECT_EQ(report.turned, 2);
  EXPECT_EQ(o.curves[0].points.front(), outer.back());
  EXPECT_EQ(o.curves[1].points.front(), inner.back());
}

TEST(Outline, CleaningKeepsCurvatureWithItsPoint) {
  Outline o{{{.points = {{0, 0}, {0, 0}, {0, 1}, {1, 0}, {0, 0}}, .curvature = {1, 9, 2, 3, 8}}}};
  EXPECT_EQ(clean(o, "f").duplicates, 2);
  EXPECT_EQ(o.curves[0].points, (std::vector<Vec2>{{1, 0}, {0, 1}, {0, 0}}));
  EXPECT_EQ(o.curves[0].curvature, (std::vector<double>{3, 2, 1}));
}

TEST(Outline, CleaningRefusesWhatIsNoCurve) {
  Outline dot{{{.points = {{1, 1}, {1, 1}}, .closed = false}}};
  EXPECT_THROW(clean(dot, "f"), Error);
  Outline flat{{{.points = {{0, 0}, {1, 0}, {2, 0}}}}};
  EXPECT_NE(message_of(ErrorCode::kSurfaceInvalid, [&] { clean(flat, "f"); }).find("encloses nothing"),
            std::string::npos);
}

TEST(Profiles, AreReadAsTheyWereWritten) {
  for (const auto& [name, help] : profile_list()) {
    const Outline made = make_profile(name);
    const bool smooth = made.curves[0].smooth;
    const std::string path = testing::TempDir() + "lamina_" + name + (smooth ? ".dat" : ".csv");
    write_outline(path, made, name);
    const Outline read = read_outline(path);
    ASSERT_EQ(read.curves.size(), made.curves.size()) << name;
    for (std::size_t i = 0; i < made.curves.size(); ++i) {
      EXPECT_EQ(read.curves[i].points, made.curves[i].points) << name;
      EXPECT_EQ(read.curves[i].closed, made.curves[i].closed) << name;
      EXPECT_EQ(read.curves[i].smooth, made.curves[i].smooth) << name;
    }
    std::filesystem::remove(path);
  }
}

}  // namespace
}  // namespace lamina
