#include "mesh/io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "mesh/io/gmf.h"
#include "mesh/io/vtu.h"
#include "mesh/solution.h"
#include "tests/mesh/rich_mesh.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

template <int D>
void round_trip(const std::string& name) {
  const Scratch folder;
  const Mesh<D> mesh = rich_mesh<D>(5);
  write_mesh(folder / name, mesh);
  const Mesh<D> back = std::get<Mesh<D>>(read_mesh(folder / name));
  expect_same_geometry(mesh, back);
  if (lower_extension(name) == ".vtu") {
    EXPECT_TRUE(back.facets.empty());
    expect_same_fields(mesh.point_fields, back.point_fields);
    expect_same_fields(mesh.cell_fields, back.cell_fields);
  } else {
    EXPECT_EQ(mesh.facets, back.facets);
    EXPECT_EQ(mesh.facet_tags, back.facet_tags);
    EXPECT_EQ(mesh.point_tags, back.point_tags);
  }
}

TEST(MeshIo, RoundTripKeepsEveryBit) {
  for (const char* name : {"m.vtu", "m.mesh", "m.meshb", "m.VTU"}) {
    SCOPED_TRACE(name);
    round_trip<2>(name);
    round_trip<3>(name);
  }
}

TEST(MeshIo, AsciiKeepsExtremeCoordinates) {
  const Scratch folder;
  Mesh<2> mesh;
  const double tiny = std::numeric_limits<double>::denorm_min(), huge = std::numeric_limits<double>::max();
  mesh.points = {{0.1 + 0.2, -0.0}, {tiny, huge}, {-huge, 1.0 / 3.0}};
  mesh.cells = {{0, 1, 2}};
  for (const char* name : {"m.mesh", "m.meshb", "m.vtu"}) {
    write_mesh(folder / name, mesh);
    const auto back = std::get<Mesh<2>>(read_mesh(folder / name));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(mesh.points[i], back.points[i]) << name;
    EXPECT_TRUE(std::signbit(back.points[0][1])) << name;
  }
}

TEST(MeshIo, ExtensionsAndMissingFiles) {
  EXPECT_TRUE(is_readable_mesh("a/b.VTU"));
  EXPECT_TRUE(is_readable_mesh("b.mesh"));
  EXPECT_TRUE(is_writable_mesh("b.meshb"));
  EXPECT_FALSE(is_readable_mesh("b.stl"));
  EXPECT_FALSE(is_writable_mesh("vtu"));
  const auto code = [](auto&& call) {
    try {
      call();
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::kInternal;
  };
  const Scratch folder;
  EXPECT_EQ(code([&] { read_mesh(folder / "none.vtu"); }), ErrorCode::kFileMissing);
  EXPECT_EQ(code([&] { read_mesh(folder / "none.xyz"); }), ErrorCode::kFileUnsupported);
  EXPECT_EQ(code([&] { write_mesh(folder / "no" / "m.vtu", lattice<2>(1)); }), ErrorCode::kFileWrite);
  Mesh<2> wrong = lattice<2>(1);
  wrong.cell_tags = {1};
  EXPECT_EQ(code([&] { write_mesh(folder / "m.vtu", wrong); }), ErrorCode::kParameter);
  EXPECT_FALSE(std::filesystem::exists(folder / "m.vtu"));
}

// ---- GMF
// --------------------------------------------------------------------------------------------------------

std::string message_of(const std::string& bytes) {
  try {
    io::parse_gmf(bytes, "f");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Gmf, ReadsForeignAscii) {
  const std::string text =
      "# a comment\n MeshVersionFormatted\t1 Dimension\n2\nIdentifier \"x\"\nVertices 3 # count\n"
      "0 0 1\n+1 0. 0\n0 1e0 2\nCorners 2 1 2 RequiredVertices\n1\n3\n"
      "Edges\n1\n1 2 7\nTriangles 1\n1 2 3 9\nEnd\nTriangles 5";
  const auto mesh = std::get<Mesh<2>>(io::parse_gmf(text, "f"));
  ASSERT_EQ(mesh.points.size(), 3u);
  EXPECT_EQ(mesh.points[1], Vec2(1, 0));
  EXPECT_EQ(mesh.point_tags, (std::vector<Index>{1, 0, 2}));
  EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 3>>{{0, 1, 2}}));
  EXPECT_EQ(mesh.cell_tags, std::vector<Index>{9});
  EXPECT_EQ(mesh.facets, (std::vector<std::array<Index, 2>>{{0, 1}}));
  EXPECT_EQ(mesh.facet_tags, std::vector<Index>{7});
}

TEST(Gmf, FlatTrianglesInSpaceAreAPlaneMesh) {
  const std::string head = "MeshVersionFormatted 2\nDimension 3\nVertices\n3\n0 0 0 0\n1 0 0 0\n0 1 ";
  const std::string tail = " 0\nTriangles\n1\n1 2 3 0\nEnd\n";
  EXPECT_EQ(std::get<Mesh<2>>(io::parse_gmf(head + "0" + tail, "f")).cells.size(), 1u);
  EXPECT_NE(message_of(head + "0.5" + tail).find("surface in space"), std::string::npos);
}

TEST(Gmf, AsciiErrorsNameTheLine) {
  const std::string head = "MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_NE(message_of(head + "Triangles\n1\n1 2 x 0\n").find("line 10"), std::string::npos);
  EXPECT_NE(message_of(head + "Triangles\n1\n1 2 0 0\n").find("line 10: vertex number 0"), std::string::npos);
  EXPECT_NE(message_of(head + "Triangles\n1\n1 2 4 0\n").find("names point 3 but there are 3"),
            std::string::npos);
  EXPECT_NE(message_of(head + "Triangles\n2000000000\n1 2 3 0\n").find("room for at most"),
            std::string::npos);
  EXPECT_NE(message_of(head + "Triangles\n-1\n1 2 3 0\n").find("count of -1"), std::string::npos);
  EXPECT_NE(message_of(head + "Triangles\n1\n1 2 3    \n").find("expected an integer"), std::string::npos);
  EXPECT_NE(message_of(head + head.substr(23)).find("second"), std::string::npos);
  EXPECT_NE(message_of("solid body\n").find("line 1"), std::string::npos);
  EXPECT_NE(message_of("").find("line 1"), std::string::npos);
  EXPECT_NE(message_of("MeshVersionFormatted 2\nDimension 4\n").find("line 2: dimension 4"),
            std::string::npos);
  EXPECT_NE(message_of("MeshVersionFormatted 2\nDimension 2\nVertices\n1\n1 nan 0\nEnd").find("not finite"),
            std::string::npos);
}

/// Builds a binary file by hand, in a version and a byte order.
class BinaryFile {
 public:
  BinaryFile(int version, bool big) : version_(version), big_(big) {
    put<std::int32_t>(1);
    put<std::int32_t>(version);
  }
  void keyword(int code, std::int64_t header_words, std::int64_t reals, std::int64_t integers) {
    put<std::int32_t>(code);
    const std::int64_t next = static_cast<std::int64_t>(bytes.size()) + (version_ > 2 ? 8 : 4) +
                              header_words * 4 + reals * (version_ > 1 ? 8 : 4) +
                              integers * (version_ > 3 ? 8 : 4);
    position(next);
  }
  void position(std::int64_t p) {
    version_ > 2 ? put<std::int64_t>(p) : put<std::int32_t>(static_cast<std::int32_t>(p));
  }
  void word(int v) { put<std::int32_t>(v); }
  void real(double v) { version_ > 1 ? put<double>(v) : put<float>(static_cast<float>(v)); }
  void integer(std::int64_t v) {
    version_ > 3 ? put<std::int64_t>(v) : put<std::int32_t>(static_cast<std::int32_t>(v));
  }

  std::string bytes;

 private:
  template <class T>
  void put(T v) {
    char raw[sizeof(T)];
    std::memcpy(raw, &v, sizeof(T));
    if (big_) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
  }
  int version_;
  bool big_;
};

/// One tetrahedron behind a section of an unknown keyword.
std::string one_tet(int version, bool big) {
  BinaryFile f(version, big);
  f.keyword(3, 1, 0, 0);
  f.word(3);
  f.keyword(999, 3, 0, 0);
  for (int i = 0; i < 3; ++i) f.word(-1);
  f.keyword(4, 0, 12, 5);
  f.integer(4);
  const double x[4][3] = {{0, 0, 0}, {1.5, 0, 0}, {0, 1, 0}, {0, 0, 0.25}};
  for (int i = 0; i < 4; ++i) {
    for (const double c : x[i]) f.real(c);
    f.integer(i);
  }
  f.keyword(8, 0, 0, 6);
  f.integer(1);
  for (const int v : {1, 2, 3, 4, 5}) f.integer(v);
  f.word(54);
  return f.bytes;
}

TEST(Gmf, ReadsEveryBinaryVersionInBothByteOrders) {
  for (int version = 1; version <= 4; ++version) {
    for (const bool big : {false, true}) {
      SCOPED_TRACE(version * 10 + big);
      const auto mesh = std::get<Mesh<3>>(io::parse_gmf(one_tet(version, big), "f"));
      ASSERT_EQ(mesh.points.size(), 4u);
      EXPECT_EQ(mesh.points[1], Vec3(1.5, 0, 0));
      EXPECT_EQ(mesh.points[3], Vec3(0, 0, 0.25));
      EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 4>>{{0, 1, 2, 3}}));
      EXPECT_EQ(mesh.cell_tags, std::vector<Index>{5});
      EXPECT_EQ(mesh.point_tags, (std::vector<Index>{0, 1, 2, 3}));
    }
  }
}

TEST(Gmf, DamagedBinaryFilesAreErrorsNeverCrashes) {
  const std::string good = one_tet(2, false);
  for (std::size_t n = 0; n + 4 < good.size(); ++n) EXPECT_FALSE(message_of(good.substr(0, n)).empty()) << n;
  int rejected = 0;
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const char c : {'\0', '\1', '\x7f', '\xff'}) {
      std::string bad = good;
      bad[i] = c;
      rejected += !message_of(bad).empty();
    }
  }
  EXPECT_GT(rejected, 100);
}

TEST(Gmf, PositionsMustGrow) {
  BinaryFile f(2, false);
  f.word(3);
  f.position(8);  // of itself: an endless chain
  f.word(3);
  EXPECT_NE(message_of(f.bytes).find("byte 8: keyword 3"), std::string::npos);
  BinaryFile g(2, false);
  g.word(3);
  g.position(1000);
  g.word(3);
  EXPECT_NE(message_of(g.bytes).find("must lie in 16..20"), std::string::npos);
}

TEST(Gmf, SectionsEndWhereTheirPositionSays) {
  BinaryFile f(2, false);
  f.keyword(3, 1, 0, 0);
  f.word(3);
  f.keyword(4, 0, 3, 2);  // room for one vertex
  f.integer(2);           // but two are claimed, and the bytes of a second follow
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) f.real(0.0);
    f.integer(0);
  }
  EXPECT_NE(message_of(f.bytes).find("a count of 2, but the section has room for 1"), std::string::npos);
}

TEST(Gmf, WritesWidePositions) {
  const Scratch folder;
  const Mesh<3> mesh = rich_mesh<3>(3);
  for (const io::GmfForm form : {io::GmfForm{}, io::GmfForm{.version = 3}}) {
    OutputFile out(folder / "m.meshb");
    io::write_gmf(out, mesh, form);
    out.commit();
    const std::string bytes = read_text(folder / "m.meshb");
    EXPECT_EQ(bytes[4], form.version == 0 ? 2 : 3);
    const auto back = std::get<Mesh<3>>(io::parse_gmf(bytes, "f"));
    expect_same_geometry(mesh, back);
    EXPECT_EQ(mesh.facets, back.facets);
  }
}

template <int D>
std::vector<Metric<D>> sample_metrics() {
  std::vector<Metric<D>> metrics;
  for (int i = 0; i < 50; ++i) {
    Mat<D> A = Mat<D>::Identity() * (1.0 + i);
    for (int r = 0; r < D; ++r)
      for (int c = 0; c < D; ++c)
        A(r, c) += 0.3 * noise(static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(r * D + c));
    metrics.push_back(Metric<D>::from_factor(A));
  }
  return metrics;
}

template <int D>
void metric_round_trip() {
  const Scratch folder;
  const auto metrics = sample_metrics<D>();
  for (const char* name : {"m.sol", "m.solb"}) {
    write_metric(folder / name, metrics);
    const auto back = read_metric<D>(folder / name);
    ASSERT_EQ(back.size(), metrics.size());
    const std::string bytes = read_text(folder / name);
    const io::GmfSolution raw = io::parse_gmf_solution(bytes, name);
    EXPECT_EQ(raw.components, std::vector<int>{kSymSize<D>});
    for (std::size_t i = 0; i < metrics.size(); ++i) {
      const Sym<D> a = metrics[i].tensor(), b = back[i].tensor();
      for (std::size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k], raw.values[i * a.size() + k]);
        EXPECT_NEAR(a[k], b[k], 1e-12 * a[0]);
      }
    }
  }
}

TEST(Gmf, MetricRoundTrip) {
  metric_round_trip<2>();
  metric_round_trip<3>();
}

TEST(Gmf, MetricErrors) {
  const Scratch folder;
  const auto message = [&](const std::string& body) {
    write_text(folder / "m.sol", "MeshVersionFormatted 2\nDimension 2\n" + body);
    try {
      read_metric<2>(folder / "m.sol");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("SolAtVertices 2\n1 1\n0.5 2\nEnd"), "");
  EXPECT_EQ(read_metric<2>(folder / "m.sol")[1].size_along(Vec2(1, 0)), 2.0);
  EXPECT_NE(message("SolAtVertices 2\n1 1\n0.5 -2\n").find("vertex 1 (counted from 0) is -2"),
            std::string::npos);
  EXPECT_NE(message("SolAtVertices 1\n1 3\n1 2 1\n").find("not positive definite"), std::string::npos);
  EXPECT_NE(message("SolAtVertices 1\n1 2\n1 2\n").find("a vector a vertex"), std::string::npos);
  EXPECT_NE(message("SolAtVertices 1\n2 1 1\n1 2\n").find("2 solutions"), std::string::npos);
  EXPECT_NE(message("Vertices 0\n").find("no SolAtVertices"), std::string::npos);
  EXPECT_THROW(read_metric<3>(folder / "m.sol"), Error);
}

// ---- VTU
// --------------------------------------------------------------------------------------------------------

TEST(Vtu, SameBytesForEveryThreadCount) {
  const Scratch folder;
  const Mesh<3> mesh = rich_mesh<3>(28);  // 132 k tetrahedra: several blocks an array
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    write_mesh(folder / "m.vtu", mesh);
    const std::string bytes = read_text(folder / "m.vtu");
    if (first.empty()) first = bytes;
    EXPECT_TRUE(first == bytes) << threads << " threads";
  }
  expect_same_geometry(mesh, std::get<Mesh<3>>(read_mesh(folder / "m.vtu")));
}

std::string vtu_message(const std::string& bytes) {
  try {
    io::parse_vtu(bytes, "f");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

/// A .vtu of two triangles; `cells` replaces the contents of <Cells>.
std::string ascii_vtu(const std::string& points = "0 0 0 1 0 0 1 1 0 0 1 0",
                      const std::string& connectivity = "0 1 2 0 2 3", const std::string& types = "5 5",
                      const std::string& offsets = "3 6",
                      const std::string& counts = "4\" NumberOfCells=\"2") {
  return "<?xml version='1.0'?><!-- by hand --><VTKFile type='UnstructuredGrid' "
         "version='0.1'>\n<UnstructuredGrid>\n"
         "<FieldData><Array type='String' Name='x'>1 2</Array></FieldData>\n"
         "<Piece NumberOfPoints=\"" +
         counts + "\"><Points>\n<DataArray type='Float32' NumberOfComponents='3'>" + points +
         "<InformationKey name='a'>7</InformationKey></DataArray></Points><Cells>\n"
         "<DataArray type='Int64' Name='connectivity'>" +
         connectivity + "</DataArray>\n<DataArray type='Int64' Name='offsets'>" + offsets +
         "</DataArray>\n<DataArray type='UInt8' Name='types'>" + types +
         "</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>\n";
}

TEST(Vtu, ReadsHandWrittenAscii) {
  const auto mesh = std::get<Mesh<2>>(io::parse_vtu(ascii_vtu(), "f"));
  ASSERT_EQ(mesh.points.size(), 4u);
  EXPECT_EQ(mesh.points[2], Vec2(1, 1));
  EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Vtu, ErrorsNameArrayAndLine) {
  EXPECT_NE(vtu_message(ascii_vtu("0.00 0.00 0.00 1.00 0.00 0.00"))
                .find("line 5: data array \"\": holds 6 values, expected 12"),
            std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu("0 0 0 1 0 0 1 1 0 0 x 0")).find("value 10"), std::string::npos);
  const std::string square = "0 0 0 1 0 0 1 1 0 0 1 0";
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 0 2 4")).find("names point 4"), std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 0 2 -3")).find("names point -3"), std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 3", "9 5")).find("VTK type 9"), std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 0 2 3", "5 5", "3 7")).find("ends at offset 7"),
            std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 0 2 3", "5 5", "3 6", "4000000000\" NumberOfCells=\"2"))
                .find("0..2147"),
            std::string::npos);
  EXPECT_NE(vtu_message(ascii_vtu(square, "0 1 2 0 2 3", "5 5", "3 6", "2000000000\" NumberOfCells=\"2"))
                .find("characters"),
            std::string::npos);
  EXPECT_NE(vtu_message("<VTKFile type='PolyData'></VTKFile>").find("another type"), std::string::npos);
  EXPECT_NE(vtu_message("<a></b>").find("XML"), std::string::npos);
  EXPECT_NE(vtu_message("").find("not a VTKFile"), std::string::npos);
}

TEST(Vtu, DamagedFilesAreErrorsNeverCrashes) {
  const Scratch folder;
  write_mesh(folder / "m.vtu", rich_mesh<3>(2));
  const std::string good = read_text(folder / "m.vtu");
  const std::size_t data = good.find("_");
  for (std::size_t n = 0; n < good.size() - 40; n += 7)
    EXPECT_FALSE(vtu_message(good.substr(0, n)).empty()) << n;
  int rejected = 0;
  for (std::size_t i = data; i < good.size(); i += 3) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x55);
    rejected += !vtu_message(bad).empty();
  }
  EXPECT_GT(rejected, 100);
}

constexpr const char* kVtkWriter = R"(
import vtk
import numpy as np
from vtk.util.numpy_support import numpy_to_vtk
grid = vtk.vtkUnstructuredGrid()
points = vtk.vtkPoints()
points.SetDataTypeToDouble()
for x in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.1, 0.7, -1 / 3)]:
    points.InsertNextPoint(x)
grid.SetPoints(points)
for cell in [(0, 1, 2, 3), (0, 2, 1, 4)]:
    grid.InsertNextCell(vtk.VTK_TETRA, 4, cell)
grid.InsertNextCell(vtk.VTK_TRIANGLE, 3, (1, 2, 3))
grid.InsertNextCell(vtk.VTK_VERTEX, 1, (0,))
def add(to, name, array):
    a = numpy_to_vtk(np.ascontiguousarray(array), deep=1)
    a.SetName(name)
    to.AddArray(a)
add(grid.GetPointData(), 'phi', np.arange(5) * 0.1)
add(grid.GetPointData(), 'tensor', np.arange(30).reshape(5, 6) * 1.0)
add(grid.GetCellData(), 'region', np.array([3, 1, 2, 0], dtype=np.int32))
add(grid.GetCellData(), 'q', np.array([.5, .25, 9, 9]))
n = 0
for mode in ('ascii', 'binary', 'appended'):
    for zlib in (0, 1):
        for wide in (32, 64):
            for big in (0, 1):
                for encode in (0, 1):
                    w = vtk.vtkXMLUnstructuredGridWriter()
                    w.SetInputData(grid)
                    w.SetFileName('vtk%d.vtu' % n)
                    getattr(w, 'SetDataModeTo' + mode.capitalize())()
                    w.SetEncodeAppendedData(encode)
                    w.SetHeaderTypeToUInt32() if wide == 32 else w.SetHeaderTypeToUInt64()
                    w.SetByteOrderToBigEndian() if big else w.SetByteOrderToLittleEndian()
                    w.SetCompressorTypeToZLib() if zlib else w.SetCompressorTypeToNone()
                    w.SetBlockSize(64)
                    assert w.Write() == 1
                    n += 1
)";

TEST(Vtu, ReadsWhatVtkWrites) {
  const Scratch folder;
  if (!python_has(folder, "vtk, numpy"))
    GTEST_SKIP() << "python3 with vtk and numpy is not installed: NOT TESTED";
  ASSERT_EQ(run_python(folder, kVtkWriter), 0) << read_text(folder / "log.txt");
  for (int n = 0; n < 48; ++n) {
    SCOPED_TRACE(n);
    const auto mesh = std::get<Mesh<3>>(read_mesh(folder / ("vtk" + std::to_string(n) + ".vtu")));
    ASSERT_EQ(mesh.points.size(), 5u);
    EXPECT_EQ(mesh.points[4], Vec3(0.1, 0.7, -1.0 / 3.0));
    EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 4>>{{0, 1, 2, 3}, {0, 2, 1, 4}}));
    EXPECT_EQ(mesh.cell_tags, (std::vector<Index>{3, 1}));
    EXPECT_EQ(mesh.facets, (std::vector<std::array<Index, 3>>{{1, 2, 3}}));
    EXPECT_EQ(mesh.facet_tags, std::vector<Index>{2});
    ASSERT_NE(mesh.point_field("phi"), nullptr);
    EXPECT_EQ(mesh.point_field("phi")->values[3], 3 * 0.1);
    const auto& tensor = mesh.point_field("tensor")->values;  // xx xy yy xz yz zz of the first point
    EXPECT_EQ(std::vector<double>(tensor.begin(), tensor.begin() + 6),
              (std::vector<double>{0, 3, 1, 5, 4, 2}));
    ASSERT_EQ(mesh.cell_fields.size(), 1u);
    EXPECT_EQ(mesh.cell_fields[0].values, (std::vector<double>{0.5, 0.25}));
  }
}

constexpr const char* kMeshioWriter = R"(
import meshio
import numpy as np
x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.7, -1 / 3]])
n = 0
for binary in (True, False):
    for compression in (None, 'zlib'):
        m = meshio.Mesh(x, [('tetra', np.array([[0, 1, 2, 3], [0, 2, 1, 4]]))], point_data={'phi': np.arange(5) * .1},
                        cell_data={'region': [np.array([3, 1])]})
        m.write('meshio%d.vtu' % n, binary=binary, compression=compression)
        n += 1
flat = meshio.Mesh(x[:3, :2], [('line', np.array([[0, 1]])), ('triangle', np.array([[0, 1, 2]]))])
flat.write('flat.vtu')
)";

TEST(Vtu, ReadsWhatMeshioWrites) {
  const Scratch folder;
  if (!python_has(folder, "meshio, numpy"))
    GTEST_SKIP() << "python3 with meshio is not installed: NOT TESTED";
  ASSERT_EQ(run_python(folder, kMeshioWriter), 0) << read_text(folder / "log.txt");
  for (int n = 0; n < 4; ++n) {
    SCOPED_TRACE(n);
    const auto mesh = std::get<Mesh<3>>(read_mesh(folder / ("meshio" + std::to_string(n) + ".vtu")));
    ASSERT_EQ(mesh.points.size(), 5u);
    if (n < 2) {
      EXPECT_EQ(mesh.points[4], Vec3(0.1, 0.7, -1.0 / 3.0));  // its ascii has 11 digits
    }
    EXPECT_EQ(mesh.cells, (std::vector<std::array<Index, 4>>{{0, 1, 2, 3}, {0, 2, 1, 4}}));
    EXPECT_EQ(mesh.cell_tags, (std::vector<Index>{3, 1}));
  }
  const auto flat = std::get<Mesh<2>>(read_mesh(folder / "flat.vtu"));
  EXPECT_EQ(flat.cells.size(), 1u);
  EXPECT_EQ(flat.facets, (std::vector<std::array<Index, 2>>{{0, 1}}));
}

constexpr const char* kReader = R"(
import sys, vtk, meshio
import numpy as np
from vtk.util.numpy_support import vtk_to_numpy
r = vtk.vtkXMLUnstructuredGridReader()
r.SetFileName('m.vtu')
r.Update()
g = r.GetOutput()
t = vtk_to_numpy(g.GetPointData().GetArray('metric'))
assert g.GetPointData().GetArray('metric').GetComponentName(5) == 'XZ'
m = meshio.read('m.vtu')
assert (m.points == vtk_to_numpy(g.GetPoints().GetData())).all()
assert (m.cells_dict['tetra'].ravel() == vtk_to_numpy(g.GetCells().GetConnectivityArray())).all()
b = meshio.read('m.meshb')
assert (m.points == b.points).all() and (m.cells_dict['tetra'] == b.cells_dict['tetra']).all()
a = meshio.read('m.mesh')
assert (m.points == a.points).all() and (m.cells_dict['tetra'] == a.cells_dict['tetra']).all()
q = vtk_to_numpy(g.GetCellData().GetArray('quality'))
region = vtk_to_numpy(g.GetCellData().GetArray('region'))
print(g.GetNumberOfPoints(), g.GetNumberOfCells(), repr(float(t[7][4])), repr(float(q[11])), region[6])
)";

TEST(Vtu, VtkAndMeshioReadWhatWeWrite) {
  const Scratch folder;
  if (!python_has(folder, "vtk, meshio, numpy"))
    GTEST_SKIP() << "python3 with vtk and meshio is not installed: NOT TESTED";
  const Mesh<3> mesh = rich_mesh<3>(4);
  for (const char* name : {"m.vtu", "m.mesh", "m.meshb"}) write_mesh(folder / name, mesh);
  ASSERT_EQ(run_python(folder, kReader), 0) << read_text(folder / "log.txt");
  std::istringstream log(read_text(folder / "log.txt"));
  std::size_t points = 0, cells = 0;
  double yz = 0.0, quality = 0.0;
  int region = 0;
  log >> points >> cells >> yz >> quality >> region;
  EXPECT_EQ(points, mesh.points.size());
  EXPECT_EQ(cells, mesh.cells.size());
  EXPECT_EQ(yz, mesh.point_field("metric")->values[7 * 6 + 4]);
  EXPECT_EQ(quality, mesh.cell_fields[0].values[11]);
  EXPECT_EQ(region, mesh.cell_tags[6]);
}

}  // namespace
}  // namespace lamina
