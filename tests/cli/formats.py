"""`lamina convert` judged by the programs whose formats it writes: meshio, VTK, h5py, Gmsh and OpenFOAM's checkMesh."""
import shutil
import subprocess

import numpy as np

from support import BAD_INPUT, COARSE, Case, lamina, main

try:
    import meshio
except ImportError:
    meshio = None

# Two tetrahedra with a wall, an inlet and two materials.
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.1]])
TETS = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [1, 4, 3]])
FACET_TAGS, CELL_TAGS = np.array([5, 5, 5, 7, 7, 7]), np.array([1, 2])


def write_gmf(path, points, triangles, tets):
    """The input is written by hand, so that no code under test makes it."""
    lines = ["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(points))]
    lines += [" ".join(repr(float(x)) for x in p) + " 0" for p in points]
    for name, cells, tags in (("Triangles", triangles, FACET_TAGS), ("Tetrahedra", tets, CELL_TAGS)):
        lines += [name, str(len(cells))]
        lines += [" ".join(str(v + 1) for v in c) + f" {t}" for c, t in zip(cells, tags)]
    path.write_text("\n".join(lines + ["End", ""]), encoding="ascii")


def stacked(mesh, kind):
    return np.vstack([c.data for c in mesh.cells if c.type == kind])


class Formats(Case):
    def setUp(self):
        super().setUp()
        self.mesh = self.dir / "in.mesh"
        write_gmf(self.mesh, CORNERS, TRIANGLES, TETS)

    def convert(self, name, *words):
        out = self.dir / name
        self.run_ok("convert", self.mesh, out, *words)
        return out

    def need_meshio(self):
        if meshio is None:
            self.skipTest("meshio is not installed")

    def test_meshio_reads_every_format_it_knows(self):
        self.need_meshio()
        for name, *words in (("a.msh",), ("b.msh", "--ascii"), ("c.msh", "--format-version", "2.2"),
                             ("d.msh", "--format-version", "2.2", "--ascii"), ("a.su2",), ("a.node",), ("a.lb8.ugrid",),
                             ("a.b8.ugrid",), ("a.ugrid",), ("a.vtu",), ("b.vtu", "--no-compress"), ("a.meshb",)):
            with self.subTest(name=name):
                read = meshio.read(self.convert(name, *words))
                # meshio takes the reals of an ascii UGRID in single precision
                np.testing.assert_array_equal(read.points, CORNERS.astype(read.points.dtype))
                np.testing.assert_array_equal(stacked(read, "tetra"), TETS)
                if name != "a.node":  # meshio reads no .face
                    found = np.sort(np.sort(stacked(read, "triangle"), axis=1), axis=0)
                    np.testing.assert_array_equal(found, np.sort(np.sort(TRIANGLES, axis=1), axis=0))

    def test_tags_as_meshio_sees_them(self):
        self.need_meshio()
        for name, key in (("a.msh", "gmsh:physical"), ("a.vtu", "region"), ("a.meshb", "medit:ref"),
                          ("a.lb8.ugrid", "ugrid:ref")):
            with self.subTest(name=name):
                read = meshio.read(self.convert(name))
                data = {}
                for cells, tags in zip(read.cells, read.cell_data[key]):
                    data.setdefault(cells.type, []).extend(tags)
                self.assertEqual(list(data["triangle"]), list(FACET_TAGS))
                if "ugrid" not in name:
                    self.assertEqual(list(data["tetra"]), list(CELL_TAGS))

    def test_what_meshio_writes_is_read(self):
        self.need_meshio()
        both = meshio.Mesh(CORNERS, [("triangle", TRIANGLES), ("tetra", TETS)], point_data={"phi": np.arange(5.0)},
                           cell_data={"gmsh:physical": [FACET_TAGS, CELL_TAGS], "gmsh:geometrical": [FACET_TAGS, CELL_TAGS]})
        alone = meshio.Mesh(CORNERS, [("tetra", TETS)], point_data={"phi": np.arange(5.0)})
        bare = meshio.Mesh(CORNERS, [("tetra", TETS)])
        cases = [("a.msh", both, {"file_format": "gmsh22", "binary": True}),
                 ("b.msh", both, {"file_format": "gmsh22", "binary": False}), ("c.msh", alone, {"file_format": "gmsh"}),
                 ("d.msh", alone, {"file_format": "gmsh", "binary": False}), ("a.xdmf", alone, {}),
                 ("b.xdmf", alone, {"data_format": "XML"}), ("a.su2", bare, {}), ("a.node", bare, {}),
                 ("a.lb8.ugrid", bare, {})]
        for name, mesh, words in cases:
            with self.subTest(name=name):
                out = self.dir / ("from_" + name)
                mesh.write(out, **words)
                again = self.dir / "again.vtu"
                self.run_ok("convert", out, again)
                read = meshio.read(again)
                np.testing.assert_allclose(read.points, CORNERS, rtol=1e-10)
                np.testing.assert_array_equal(stacked(read, "tetra"), TETS)
                if mesh is both:
                    self.assertEqual(sorted(stacked(read, "triangle").ravel()), sorted(TRIANGLES.ravel()))
                if mesh.point_data:
                    np.testing.assert_array_equal(read.point_data["phi"], np.arange(5.0))

    def test_xdmf_arrays(self):
        try:
            import h5py
        except ImportError:
            self.skipTest("h5py is not installed")
        self.convert("a.xdmf")
        with h5py.File(self.dir / "a.h5") as data:
            np.testing.assert_array_equal(data["/mesh/geometry"][()], CORNERS)
            np.testing.assert_array_equal(data["/mesh/topology"][()], TETS)
            np.testing.assert_array_equal(data["/facet_tags/topology"][()], TRIANGLES)
            np.testing.assert_array_equal(data["/facet_tags/values"][()], FACET_TAGS)

    def test_vtk_reads_cgns_and_openfoam(self):
        try:
            import vtk
            from vtk.util.numpy_support import vtk_to_numpy
        except ImportError:
            self.skipTest("VTK is not installed")
        (self.dir / "case").mkdir()
        for name, reader in (("a.cgns", vtk.vtkCGNSReader()), ("case/a.foam", vtk.vtkOpenFOAMReader())):
            with self.subTest(name=name):
                reader.SetFileName(str(self.convert(name)))
                reader.Update()
                block = reader.GetOutput()
                while block.IsA("vtkMultiBlockDataSet"):
                    block = block.GetBlock(0)
                np.testing.assert_array_equal(vtk_to_numpy(block.GetPoints().GetData()).astype(np.float32),
                                              CORNERS.astype(np.float32))
                self.assertEqual(block.GetNumberOfCells(), 2)

    def test_gmsh(self):
        if shutil.which("gmsh") is None:
            self.skipTest("gmsh is not installed")
        for name, *words in (("a.msh",), ("b.msh", "--ascii"), ("c.msh", "--format-version", "2.2")):
            with self.subTest(name=name):
                saved = self.dir / "saved.msh"
                done = subprocess.run(["gmsh", self.convert(name, *words), "-save", "-format", "msh41", "-o", saved],
                                      capture_output=True, text=True, check=False, timeout=60)
                self.assertNotIn("Error", done.stdout + done.stderr)
                self.run_ok("convert", saved, self.dir / "saved.meshb")
                read = meshio.read(self.dir / "saved.meshb")
                np.testing.assert_array_equal(stacked(read, "tetra"), TETS)
                self.assertEqual(sorted(np.concatenate(read.cell_data["medit:ref"])), sorted([*FACET_TAGS, *CELL_TAGS]))

    def test_check_mesh(self):
        for form in ("--ascii", "--binary"):
            with self.subTest(form=form):
                case = self.foam_case(form)
                self.run_ok("convert", self.mesh, case / "constant" / "polyMesh", form)
                told = self.check_foam(case)
                for name in ("facet_5", "facet_7", "zone_1", "zone_2"):
                    self.assertIn(name, told)

    def test_what_is_lost_is_told(self):
        done = lamina("convert", self.mesh, self.dir / "a.su2")
        self.assertEqual(done.returncode, 0)
        self.assertIn("a.su2 cannot hold cell tags", done.stderr)
        self.assertEqual(lamina("convert", self.mesh, self.dir / "a.meshb").stderr, "")

    def test_the_solution_goes_along(self):
        """Fields of a .sol beside a .mesh, through a format with names and back to the same numbers."""
        values = np.array([[0.1 * k, 1 + k, 2 * k, -k] for k in range(5)])
        rows = "\n".join(" ".join(map(repr, map(float, row))) for row in values)
        head = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n2 1 2\n"
        (self.dir / "in.sol").write_text(head + rows + "\nEnd\n", encoding="ascii")
        vtu = self.convert("a.vtu")
        done = lamina("convert", vtu, self.dir / "b.meshb")
        self.assertIn("1 sol_1, 2 sol_2", done.stderr)
        self.run_ok("convert", self.dir / "b.meshb", self.dir / "c.mesh")
        found = [float(x) for x in (self.dir / "c.sol").read_text(encoding="ascii").split("2 1 2")[1].split()[:-1]]
        self.assertEqual(found, list(values.ravel()))
        self.need_meshio()
        data = meshio.read(vtu).point_data
        np.testing.assert_array_equal(data["sol_1"], values[:, 0])
        np.testing.assert_array_equal(data["sol_2"], values[:, 1:])
        # The .sol is an input: another name of the same mesh must not replace it.
        done = lamina("convert", self.mesh, self.dir / "sub.su2")
        self.assertIn("the fields sol_1, sol_2", done.stderr)

    def markers(self, path):
        return {line.split()[1] for line in path.read_text(encoding="ascii").splitlines() if line.startswith("MARKER_TAG")}

    def test_a_mesh_without_facets_gets_its_boundary(self):
        """Of the two tetrahedra one face lies in each of z = 0, y = 0 and x = 0, three are slanted."""
        cells = self.convert("cells.vtu", "--cells-only")
        done = lamina("convert", cells, self.dir / "a.su2")
        self.assertEqual(done.returncode, 0)
        self.assertIn("the 6 of its boundary are tagged by the faces of its bounding box, xmin, ymin, zmin, boundary",
                      done.stderr)
        self.assertEqual(self.markers(self.dir / "a.su2"), {"xmin", "ymin", "zmin", "boundary"})
        done = lamina("convert", cells, self.dir / "a.su2", "--cells-only")
        self.assertEqual(done.returncode, 0)
        self.assertNotIn("facets", done.stderr)
        self.assertEqual(self.markers(self.dir / "a.su2"), set())

    def test_a_mesh_for_a_solver_names_the_faces_of_the_domain(self):
        out, foam, vtu = self.dir / "a.su2", self.dir / "constant" / "polyMesh", self.dir / "a.vtu"
        self.run_ok("mesh", self.sample(), "-o", out, "-o", foam, "-o", vtu, *COARSE, "-q")
        names = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}
        self.assertEqual(self.markers(out), names)
        patches = (foam / "boundary").read_text(encoding="ascii").split()
        self.assertEqual({word for word in patches if word in names}, names)
        # The .vtu names no facets; by way of it the same ones come out.
        self.run_ok("convert", vtu, self.dir / "b.su2")

        def facets(path):
            text, found, marker = path.read_text(encoding="ascii").splitlines(), set(), None
            for line in text:
                if line.startswith("MARKER_TAG"):
                    marker = line.split()[1]
                elif marker and line.startswith("5 "):
                    found.add((marker, tuple(sorted(map(int, line.split()[1:4])))))
            return found

        self.assertEqual(facets(self.dir / "b.su2"), facets(out))
        self.assertGreater(len(facets(out)), 100)

    def test_refusals_leave_nothing_behind(self):
        before = self.entries()
        for words, *needles in ((("a.xyz",), "a.xyz", ".su2"), (("a.su2", "--ascii"), "ascii"),
                                (("a.msh", "--format-version", "3"), "4.1, 2.2"), (("nowhere/a.su2",), "nowhere"),
                                (("nowhere/a.foam",), "nowhere")):
            with self.subTest(words=words):
                done = lamina("convert", self.mesh, self.dir / words[0], *words[1:])
                self.assert_one_error(done, BAD_INPUT, *needles)
                self.assertEqual(self.entries(), before)

    def test_input_is_not_overwritten(self):
        self.convert("a.node")
        done = lamina("convert", self.dir / "a.node", self.dir / "a.ele")
        self.assert_one_error(done, BAD_INPUT, "a.node", "overwrite the input")


if __name__ == "__main__":
    main()
