// Damaged files: every one is an error that names the place, and nothing crashes.
#include <gtest/gtest.h>

#include <functional>

#include "core/error.h"
#include "mesh/io.h"
#include "mesh/io/foam.h"
#include "mesh/io/houdini.h"
#include "mesh/io/msh.h"
#include "mesh/io/su2.h"
#include "mesh/io/tetgen_files.h"
#include "mesh/io/ugrid.h"
#include "mesh/io/usda.h"
#include "tests/mesh/rich_mesh.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

using Parse = std::function<AnyMesh(const std::string&)>;

std::string message_of(const Parse& parse, const std::string& bytes) {
  try {
    parse(bytes);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

void expect_told(const Parse& parse, const std::string& bytes, const std::string& words) {
  const std::string told = message_of(parse, bytes);
  EXPECT_NE(told.find(words), std::string::npos) << "\"" << words << "\" is not in \"" << told << "\"";
}

AnyMesh parse_msh(const std::string& bytes) { return io::parse_msh(bytes, "f"); }
AnyMesh parse_su2(const std::string& bytes) { return io::parse_su2(bytes, "f"); }
AnyMesh parse_geo(const std::string& bytes) { return io::parse_geo(bytes, "f"); }
AnyMesh parse_usda(const std::string& bytes) { return io::parse_usda(bytes, "f"); }
AnyMesh parse_ugrid(const std::string& bytes) { return io::parse_ugrid(bytes, "f", {.ascii = true}); }

TEST(DamagedFormats, MshErrorsNameTheLine) {
  const std::string head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  const std::string nodes = head + "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n";
  EXPECT_EQ(message_of(parse_msh, nodes + "$Elements\n1\n1 2 2 4 1 1 2 3\n$EndElements\n"), "");
  expect_told(parse_msh, "solid\n", "line 1: a MSH file starts with $MeshFormat");
  expect_told(parse_msh, "$MeshFormat\n1 0 8\n", "version 1;");
  expect_told(parse_msh, nodes + "$Elements\n1\n1 2 2 4 1 1 2 9\n$EndElements\n",
              "line 12: element 1 names node 9");
  expect_told(parse_msh, nodes + "$Elements\n1\n1 3 2 4 1 1 2 3 3\n$EndElements\n", "element type 3");
  expect_told(parse_msh, nodes + "$Elements\n1000000\n1 2 2 4 1 1 2 3\n", "room for at most");
  expect_told(parse_msh, nodes + "$Elements\n1\n1 2 2 4 1 1 2 3\n", "expected $EndElements");
  expect_told(parse_msh, head + "$Nodes\n2\n1 0 0 0\n1 1 0 0\n$EndNodes\n", "node 1 is given twice");
  expect_told(parse_msh, head, "has no $Nodes");
  expect_told(parse_msh, head + "$Elements\n0\n$EndElements\n", "$Elements before $Nodes");
}

TEST(DamagedFormats, MshNumbersNeedNotCountFromOneInOrder) {
  const auto mesh = std::get<Mesh<2>>(
      parse_msh("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n70 0 1 0\n7 0 0 0\n30 1 0 0\n$EndNodes\n"
                "$Elements\n2\n5 2 2 0 2 7 30 70\n4 1 2 0 9 7 30\n$EndElements\n"));
  EXPECT_EQ(mesh.points[2], Vec2(0, 1));
  EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 3>>{{0, 1, 2}}));
  EXPECT_EQ(mesh.facets, (std::vector<std::array<Index, 2>>{{0, 1}}));
}

TEST(DamagedFormats, Su2ErrorsNameTheLine) {
  const std::string body = "% by hand\nNDIME= 2\nNELEM= 1\n5 0 1 2 0\nNPOIN= 3\n0 0 0\n1 0 1\n0 1 2\n";
  const auto mesh = std::get<Mesh<2>>(parse_su2(
      body +
      "NMARK= 2\nMARKER_TAG= wall\nMARKER_ELEMS= 1\n3 0 1\nMARKER_TAG= marker_9\nMARKER_ELEMS= 1\n3 1 2\n"));
  EXPECT_EQ(mesh.facet_tags, (std::vector<Index>{1, 9}));
  EXPECT_EQ(mesh.facet_names, (TagNames{{1, "wall"}}));
  expect_told(parse_su2, "NELEM= 1\n", "NDIME must come first");
  expect_told(parse_su2, "NDIME= 4\n", "line 1: \"4\" must be a number in 2..3");
  expect_told(parse_su2, "NDIME= 2\nNELEM= 1\n9 0 1 2 3\n", "line 3: element type 9");
  expect_told(parse_su2, "NDIME= 2\nNELEM= 99999999\n5 0 1 2\n", "line 2: a count of 99999999");
  expect_told(parse_su2, "NDIME= 2\nNELEM= 1\n5 0 1 x\n", "line 3: expected an integer, found \"x\"");
  expect_told(parse_su2, "NDIME= 2\nNELEM= 1\n5 0 1 7\nNPOIN= 3\n0 0\n1 0\n0 1\n", "names point 7");
  expect_told(parse_su2, "", "has no NDIME");
}

TEST(DamagedFormats, UgridAndGeoAndTetgen) {
  expect_told(parse_ugrid, "4 0 0 1 0 0 0\n0 0 0 1 0 0 0 1 0 0 0 1\n1 2 3 5\n", "names point 4");
  expect_told(parse_ugrid, "4 0 0 1 0 0 1\n", "holds 1 hexahedra");
  expect_told(parse_ugrid, "4000000 0 0 1 0 0 0\n", "line 1: a count of 4000000");
  expect_told(parse_geo, "[\"topology\",", "byte ");
  expect_told(parse_geo, "[]", "\"topology\" is missing");
  expect_told(parse_geo, "\x7fNSJb", "binary .bgeo");
  const auto tetgen = [](const std::string& cells) {
    return io::parse_tetgen({{"3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n", "n"}, {cells, "e"}, {"", "f"}});
  };
  EXPECT_EQ(message_of(tetgen, "1 3 0\n0 0 1 2\n"), "");
  expect_told(tetgen, "1 3 0\n1 0 1 2\n", "e: line 2: number 1, expected 0");
  expect_told(tetgen, "1 6 0\n0 0 1 2 0 1 2\n", "cells of 6 nodes");
  expect_told(tetgen, "9 3 0\n0 0 1 2\n", "a count of 9");
}

const std::string kUsdaHead =
    "#usda 1.0\n(\n  upAxis = \"Z\"\n  customLayerData = {\n    string[] who = [\"a ) b\", \"c\"]\n  }\n)\n";

TEST(DamagedFormats, UsdaIsReadAsOthersWriteIt) {
  const auto mesh = std::get<Mesh<3>>(parse_usda(
      kUsdaHead +
      "def Xform \"World\" (\n  prepend apiSchemas = [\"A\"]\n  doc = \"\"\"two\nlines \"\"\"\n)\n{\n"
      "  float3 xformOp:translate = (1, 2, 3)\n  uniform token[] xformOpOrder = []\n"
      "  def TetMesh \"tet\" {\n"
      "    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1e0, 1., 1)] # five\n"
      "    int4[] tetVertexIndices = [(1, 0, 2, 3), (1, 2, 4, 3),]\n"
      "    int3[] surfaceFaceVertexIndices = [(0, 1, 2), (0, 3, 1)];\n"
      "    uniform token orientation = \"leftHanded\"\n"
      "    rel material:binding = </World/steel>\n    asset skin = @a b.png@\n"
      "    color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = \"constant\")\n"
      "    float[] primvars:heat = [4, nan, 2] (\n      interpolation = \"vertex\"\n    )\n"
      "    float2[] primvars:pair = [(1, 2), (3, 4)] ( interpolation = \"uniform\" )\n"
      "    int[] primvars:heat:indices = [2, 2, 1, 0, 0]\n"
      "    def GeomSubset \"lid\" {\n      uniform token elementType = \"face\"\n      int[] indices = [1]\n "
      "   }\n"
      "  }\n}\n"));
  EXPECT_EQ(mesh.points[4], Vec3(1, 1, 1));
  EXPECT_EQ(mesh.cells[0], (std::array<Index, 4>{0, 1, 2, 3}));
  EXPECT_EQ(mesh.facet_tags, (std::vector<Index>{0, 1}));
  EXPECT_EQ(mesh.facet_names, (TagNames{{1, "lid"}}));
  ASSERT_EQ(mesh.point_fields.size(), 1U);
  EXPECT_EQ(mesh.point_fields[0].values[3], 4.0);
  ASSERT_EQ(mesh.cell_fields.size(), 1U);
  EXPECT_EQ(mesh.cell_fields[0].components, 2);
}

TEST(DamagedFormats, UsdaErrorsNameTheLine) {
  const std::string begin = kUsdaHead + "def TetMesh \"m\"\n{\n";  // line 10 follows
  const std::string points = "point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (0,0,1)]\n";
  const std::string cells = "int4[] tetVertexIndices = [(0,1,2,3)]\n";
  EXPECT_EQ(message_of(parse_usda, begin + points + cells + "}\n"), "");
  expect_told(parse_usda, "solid", "line 1: a .usda file starts with #usda");
  expect_told(parse_usda, "PXR-USDC\0", "binary USD");
  expect_told(parse_usda, kUsdaHead + "def Mesh \"m\" {}\n", "has no TetMesh");
  expect_told(parse_usda, begin + "point3f[] points = [(0,0)]\n", "line 10: expected ',', found \")]");
  expect_told(parse_usda, begin + points + "int4[] tetVertexIndices = [(0,1,2,x)]\n",
              "line 11: \"x\" is no number");
  expect_told(parse_usda, begin + points + "int4[] tetVertexIndices = [(0,1,2,9)]\n}\n", "names point 9");
  expect_told(parse_usda, begin + points + "int4[] tetVertexIndices = [(0,1,2,.5)]\n}\n",
              "line 11: 0.5 is no integer");
  expect_told(parse_usda, begin + points + cells, "line 12: expected a word");
  expect_told(parse_usda, begin + points + "string a = \"b\n", "line 11: a string without an end");
  expect_told(parse_usda, begin + "point3f[] points.timeSamples = { 0: [(0,0,0)] }\n}\n",
              "changes with time");
  expect_told(parse_usda, begin + "uniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n", "transform");
  expect_told(parse_usda, begin + points + cells + "}\ndef TetMesh \"n\" {}\n", "several TetMeshes");
  expect_told(parse_usda,
              begin + points + cells + "float[] primvars:t = [1, 2] (interpolation = \"vertex\")\n}\n",
              "line 12: t holds 2 numbers, 1 for each of 4 points");
  expect_told(parse_usda,
              begin + points + cells +
                  "def GeomSubset \"s\" {\ntoken elementType = \"face\"\nint[] indices = [0]\n}\n}\n",
              "line 12: the subset s names face 0 of 0");
}

/// Cuts and changes every byte of what we write ourselves.
void damage(const std::string& name, const MeshWriteOptions& options, const Parse& parse, std::size_t step) {
  const Scratch folder;
  write_mesh(folder / name, rich_mesh<3>(1), options);
  const std::string good = read_text(folder / name);
  ASSERT_EQ(message_of(parse, good), "");
  int rejected = 0;
  for (std::size_t i = 0; i < good.size(); i += step) {
    message_of(parse, good.substr(0, i));
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x41);
    rejected += !message_of(parse, bad).empty();
  }
  EXPECT_GT(rejected, 20);
}

TEST(DamagedFormats, AnyDamageIsAnErrorOrAMeshNeverACrash) {
  damage("m.msh", {}, parse_msh, 3);
  damage("m.msh", {.ascii = true, .version = {}}, parse_msh, 3);
  damage("m.msh", {.ascii = {}, .version = "2.2"}, parse_msh, 3);
  damage("m.su2", {}, parse_su2, 1);
  damage("m.geo", {}, parse_geo, 7);
  damage("m.usda", {}, parse_usda, 7);
  damage("m.ugrid", {}, parse_ugrid, 1);
  damage(
      "m.lb8l.ugrid", {}, [](const std::string& b) { return io::parse_ugrid(b, "f", {.wide = true}); }, 1);
}

TEST(DamagedFormats, FoamErrorsNameFileAndPlace) {
  const Scratch folder;
  write_mesh(folder / "a.foam", rich_mesh<3>(1), {.ascii = true, .version = {}});
  const auto path = folder / "constant/polyMesh/owner";
  const std::string owner = read_text(path);
  const auto told = [&](const std::string& text) {
    write_text(path, text);
    return message_of([&](const std::string&) { return read_mesh(folder / "a.foam"); }, "");
  };
  EXPECT_EQ(told(owner), "");
  EXPECT_NE(told("oops").find("owner: line 1: an OpenFOAM file starts with FoamFile"), std::string::npos);
  EXPECT_NE(told(owner.substr(0, owner.size() - 8)).find("owner: line "), std::string::npos);
  std::string huge = owner;
  huge.replace(huge.find("}") + 3, 2, "99999999");
  EXPECT_NE(told(huge).find("a count of 99999999"), std::string::npos);
  std::filesystem::remove(path);
  EXPECT_NE(
      message_of([&](const std::string&) { return read_mesh(folder / "a.foam"); }, "").find("no such file"),
      std::string::npos);
}

}  // namespace
}  // namespace lamina
