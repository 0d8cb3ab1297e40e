"""Other people's readers open every output, and an independent computation agrees with `lamina score`."""
import json
import shutil
import tempfile
from pathlib import Path

import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

import oracle
import support
from support import COARSE, DOMAIN, Case, lamina


def read_vtk(path):
    """Points, cells, point data and cell data of a .vtu through VTK."""
    errors = []
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    if errors or grid.GetNumberOfCells() == 0:
        raise ValueError(f"VTK does not read {path}")
    tets = grid.GetCells()
    if set(vtk_to_numpy(grid.GetCellTypesArray())) != {vtk.VTK_TETRA}:
        raise ValueError("cells other than tetrahedra")

    def arrays(data):
        return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}

    return (vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(tets.GetConnectivityArray()).reshape(-1, 4),
            arrays(grid.GetPointData()), arrays(grid.GetCellData()))


def flat(score):
    """A score of the program under the names of oracle.score."""
    length, quality = score["length"], score["quality"]
    return {**{key: score[key] for key in ("points", "cells", "edges", "complexity", "unit_share")},
            **{f"length_{key}": length[key] for key in ("min", "max", "mean")},
            "short_share": length["share_below_half"], "long_share": length["share_above_2"],
            "quality_min": quality["min"], "quality_mean": quality["mean"], "aspect_max": score["aspect"]["max"]}


class Oracle(Case):
    """One run, written in every format; each test looks at it from another side."""

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="lamina-oracle-")
        cls.addClassCleanup(holder.cleanup)
        cls.made = Path(holder.name)
        words = ["sample", "sphere", "-o", cls.made / "sphere.stl"]
        assert lamina(*words).returncode == 0
        outputs = [word for suffix in ("vtu", "mesh", "meshb") for word in ("-o", cls.made / f"a.{suffix}")]
        done = lamina("mesh", cls.made / "sphere.stl", *outputs, *COARSE, "--metric-out", cls.made / "a.solb",
                      "--report", cls.made / "r.json")
        assert done.returncode in (0, 3), done.stderr
        read = meshio.read(cls.made / "a.meshb")
        cls.points, cls.cells = read.points.astype(float), read.cells_dict["tetra"].astype(np.int64)

    def own_score(self, mesh, *words):
        return json.loads(self.run_ok("score", mesh, "--json", *words))

    def test_formats_hold_the_same_mesh(self):
        text = meshio.read(self.made / "a.mesh")
        np.testing.assert_array_equal(text.points, self.points)
        np.testing.assert_array_equal(text.cells_dict["tetra"], self.cells)
        zipped = meshio.read(self.made / "a.vtu")
        np.testing.assert_array_equal(zipped.points, self.points)
        np.testing.assert_array_equal(zipped.cells_dict["tetra"], self.cells)
        points, cells, _, _ = read_vtk(self.made / "a.vtu")
        np.testing.assert_array_equal(points, self.points)
        np.testing.assert_array_equal(cells, self.cells)

    def test_the_box_is_filled(self):
        volumes = oracle.volumes(self.points, self.cells)
        self.assertGreater(volumes.min(), 0.0)
        lo, hi = np.array(DOMAIN[:3]), np.array(DOMAIN[3:])
        self.assertLess(abs(volumes.sum() / np.prod(hi - lo) - 1), 1e-10)
        np.testing.assert_array_equal(self.points.min(axis=0), lo)
        np.testing.assert_array_equal(self.points.max(axis=0), hi)
        self.assertEqual(len(np.unique(self.cells)), len(self.points))

    def test_the_boundary_is_the_box_and_is_listed(self):
        facets = oracle.boundary_facets(self.cells)
        x = self.points[facets]
        on_face = np.zeros(len(facets), bool)
        for axis in range(3):
            for value in (DOMAIN[axis], DOMAIN[axis + 3]):
                on_face |= (x[:, :, axis] == value).all(axis=1)
        self.assertTrue(on_face.all())
        listed = meshio.read(self.made / "a.meshb").cells_dict["triangle"]
        np.testing.assert_array_equal(np.unique(np.sort(listed, axis=1), axis=0), facets)
        area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()
        size = np.array(DOMAIN[3:]) - np.array(DOMAIN[:3])
        self.assertLess(abs(area / (2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0])) - 1), 1e-10)

    def test_point_and_cell_data(self):
        points, cells, point_data, cell_data = read_vtk(self.made / "a.vtu")
        self.assertLessEqual({"phi", "N"}, set(point_data))
        self.assertLessEqual({"region", "quality"}, set(cell_data))
        phi, N = point_data["phi"], point_data["N"]
        # The facets of the sphere miss it by their sag; away from its centre the normal is radial.
        radius = np.linalg.norm(points, axis=1)
        sphere = float(np.linalg.norm(meshio.read(self.made / "sphere.stl").points, axis=1).max())
        self.assertLess(np.abs(phi - (radius - sphere)).max(), 0.01 * sphere)
        near = np.abs(radius - sphere) < 0.2 * sphere
        self.assertGreater(near.sum(), 100)
        cosine = np.einsum("ij,ij->i", N[near], points[near]) / radius[near]
        self.assertGreater(cosine.min(), 0.99)
        self.assertEqual(set(np.unique(cell_data["region"])), {0, 1, 2, 3})
        self.assertGreater(np.ravel(cell_data["quality"]).min(), 0.0)

    def agree(self, told, expected):
        """Counts exactly, numbers to rounding; where a count depends on the last bit, to one edge."""
        told = flat(told)
        for key in ("points", "cells", "edges"):
            self.assertEqual(told[key], expected[key], key)
        for key in ("complexity", "length_min", "length_max", "length_mean", "quality_min", "quality_mean",
                    "aspect_max"):
            self.assertLess(abs(told[key] / expected[key] - 1), 1e-8, f"{key}: {told[key]} and {expected[key]}")
        for key in ("unit_share", "short_share", "long_share"):
            self.assertLess(abs(told[key] - expected[key]), 1.5 / expected["edges"], key)

    def test_score_agrees(self):
        expected = oracle.score(self.points, self.cells, oracle.read_sol(self.made / "a.solb"))
        for suffix in ("vtu", "mesh", "meshb"):
            with self.subTest(suffix=suffix):
                told = self.own_score(self.made / f"a.{suffix}", "--metric", self.made / "a.solb")
                self.agree(told["score"], expected)
                self.assertLess(abs(told["validation"]["volume"] / expected["volume"] - 1), 1e-12)
                self.assertEqual(told["worst_cells"][0]["cell"], expected["worst_cell"])

    def test_score_finds_the_metric_beside_a_mesh(self):
        expected = oracle.score(self.points, self.cells, oracle.read_sol(self.made / "a.solb"))
        for suffix in ("vtu", "meshb"):
            with self.subTest(suffix=suffix):
                self.agree(self.own_score(self.made / f"a.{suffix}")["score"], expected)

    def test_score_without_metric_is_euclidean(self):
        identity = np.repeat(np.eye(3)[None], len(self.points), axis=0)
        expected = oracle.score(self.points, self.cells, identity)
        bare = self.made / "bare.meshb"  # no metric beside it
        shutil.copyfile(self.made / "a.meshb", bare)
        told = self.own_score(bare)["score"]
        self.assertEqual((told["points"], told["cells"]), (expected["points"], expected["cells"]))
        for found, key in ((told["quality"]["min"], "quality_min"), (told["quality"]["mean"], "quality_mean"),
                           (told["aspect"]["max"], "aspect_max")):
            self.assertLess(abs(found / expected[key] - 1), 1e-8, key)
        self.assertNotIn("unit_share", told, "a share of unit edges in no metric means nothing")

    def test_score_of_random_cells_in_random_metrics(self):
        """Ratios up to 1e4 in any direction, cells of any shape."""
        rng = np.random.default_rng(7)
        points = rng.uniform(-1, 1, (400, 3))
        cells = np.array([rng.permutation(400)[:4] for _ in range(900)])
        volumes = oracle.volumes(points, cells)
        cells[volumes < 0] = cells[volumes < 0][:, [0, 2, 1, 3]]
        axes = np.linalg.qr(rng.normal(size=(400, 3, 3)))[0]
        sizes = 10.0 ** rng.uniform(-4, 0, (400, 3))
        tensors = np.einsum("nki,nk,nkj->nij", axes, sizes**-2.0, axes)
        used = np.unique(cells)
        place = np.full(400, -1)
        place[used] = np.arange(len(used))
        points, cells, tensors = points[used], place[cells], tensors[used]
        mesh, sol = self.dir / "r.mesh", self.dir / "r.sol"
        with open(mesh, "w", encoding="ascii") as out:
            out.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n")
            out.writelines(f"{x!r} {y!r} {z!r} 0\n" for x, y, z in points.tolist())
            out.write(f"Tetrahedra\n{len(cells)}\n")
            out.writelines(" ".join(str(i + 1) for i in cell) + " 0\n" for cell in cells.tolist())
            out.write("End\n")
        rows = [[M[i, j] for i, j in oracle.TENSOR_PLACES] for M in tensors]
        with open(sol, "w", encoding="ascii") as out:
            out.write(f"MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n{len(points)}\n1 3\n")
            out.writelines(" ".join(repr(float(v)) for v in row) + "\n" for row in rows)
            out.write("End\n")
        done = lamina("score", mesh, "--metric", sol, "--json")
        self.assertIn(done.returncode, (0, 3), done.stderr)
        told = json.loads(done.stdout)
        expected = oracle.score(points, cells, oracle.read_sol(sol))
        self.agree(told["score"], expected)
        self.assertEqual(told["validation"]["nonpositive_cells"], 0)

    def test_score_finds_inverted_cells(self):
        cells = self.cells.copy()
        turned = np.arange(0, len(cells), 97)
        cells[turned] = cells[turned][:, [0, 2, 1, 3]]
        mesh = self.dir / "i.mesh"
        meshio.write(mesh, meshio.Mesh(self.points, [("tetra", cells)]))
        told = json.loads(self.run_ok("score", mesh, "--json", code=support.MISSED))
        self.assertEqual(told["validation"]["nonpositive_cells"], len(turned))
        self.assertLess(told["score"]["quality"]["min"], 0.0)

    def test_convert_keeps_everything(self):
        for source, target in (("vtu", "meshb"), ("meshb", "mesh"), ("mesh", "vtu")):
            with self.subTest(source=source, target=target):
                out = self.dir / f"b.{target}"
                self.run_ok("convert", self.made / f"a.{source}", out)
                read = meshio.read(out)
                np.testing.assert_array_equal(read.points, self.points)
                np.testing.assert_array_equal(read.cells_dict["tetra"], self.cells)

    def test_report_counts_are_the_mesh(self):
        report = support.read_json(self.made / "r.json")
        cells = report["cells"]
        self.assertGreaterEqual(cells["total"]["count"], cells["box2"]["count"])
        self.assertGreaterEqual(cells["box2"]["count"], cells["layer"]["count"] + cells["inside"]["count"])
        self.assertEqual(report["cells"]["total"]["count"], len(self.cells))
        self.assertEqual(report["points"], len(self.points))

    def openvdb(self):
        try:
            import pyopenvdb
        except ImportError:
            self.skipTest("no pyopenvdb for this Python")
        return pyopenvdb

    def painted_box(self, vdb):
        """A .vdb of a grid that asks for 0.07 in the box [0.7, 1.1] x [-0.2, 0.2]^2, in voxels of 0.1."""
        grid = vdb.FloatGrid(0.0)
        grid.name = "density"
        grid.transform = vdb.createLinearTransform(0.1)
        grid.fill((8, -1, -1), (10, 1, 1), 0.07, True)
        path = self.dir / "paint.vdb"
        vdb.write(str(path), grids=[grid])
        return path

    def test_painted_sizes_are_honoured_and_copied(self):
        vdb = self.openvdb()
        paint = self.painted_box(vdb)
        edges = []
        for words in ((), ("--size-grid", f"{paint}:density")):
            out = self.dir / f"m{len(words)}.meshb"
            self.run_ok("mesh", self.made / "sphere.stl", *support.COARSE, *words, "-q", "-o", out)
            mesh = meshio.read(out)
            cells = mesh.cells_dict["tetra"]
            pairs = mesh.points[oracle.edges_of(cells)]
            middle = pairs.mean(axis=1)
            inside = (np.abs(middle - (0.9, 0, 0)) < 0.15).all(axis=1)
            edges.append(np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1)[inside])
        self.assertGreater(len(edges[1]), 3 * len(edges[0]))
        self.assertGreater((edges[1] < 0.07 * np.sqrt(2)).mean(), 0.9)
        self.assertLess(np.median(edges[1]), 0.07 * 1.1)
        copy = self.dir / "copy.vdb"
        self.run_ok("levelset", self.made / "sphere.stl", "--voxel", "0.05", "--size-grid", f"{paint}:density",
                    "-o", copy)
        grids = {grid.name: grid for grid in vdb.readAll(str(copy))[0]}
        self.assertEqual(set(grids), {"surface", "N", "T1", "k", "density"})
        self.assertEqual(grids["density"].activeVoxelCount(), 27)
        self.assertAlmostEqual(grids["density"].getConstAccessor().getValue((9, 0, 0)), 0.07, places=7)

    def test_metric_grids_open_in_openvdb(self):
        vdb = self.openvdb()
        out = self.dir / "m.vdb"
        self.run_ok("levelset", self.made / "sphere.stl", "--voxel", "0.05", "--hmin", "1e-6", "--h2", "0.4", "-q",
                    "-o", out)
        grids = {grid.name: grid for grid in vdb.readAll(str(out))[0]}
        self.assertEqual(set(grids), {"surface", "N", "T1", "k", "h", "logM_diag", "logM_off"})
        reach = {name: grid.getConstAccessor() for name, grid in grids.items()}
        voxels = [item.min for item in grids["surface"].citerOnValues() if item.count == 1][::50]
        read = {name: np.array([a.getValue(ijk) for ijk in voxels]) for name, a in reach.items()}
        place = np.array([grids["surface"].transform.indexToWorld(ijk) for ijk in voxels])
        radial = place / np.linalg.norm(place, axis=1)[:, None]
        self.assertLess(np.abs(np.einsum("ni,ni->n", radial, read["N"]) - 1).max(), 0.01)
        self.assertTrue(((read["k"][:, 2] >= 0) & (read["k"][:, 2] <= 1)).all())
        logarithm = np.empty((len(voxels), 3, 3))
        for column, (i, j) in enumerate(((0, 0), (1, 1), (2, 2))):
            logarithm[:, i, j] = read["logM_diag"][:, column]
        for column, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
            logarithm[:, i, j] = logarithm[:, j, i] = read["logM_off"][:, column]
        sizes = np.sort(np.exp(-0.5 * np.linalg.eigvalsh(logarithm)), axis=1)
        np.testing.assert_allclose(sizes, np.sort(read["h"], axis=1), rtol=2e-6)
        self.assertGreater((sizes[:, 2] / sizes[:, 0]).max(), 20)

    def test_levelset_opens_in_openvdb(self):
        vdb = self.openvdb()
        out = self.dir / "a.vdb"
        self.run_ok("levelset", self.made / "sphere.stl", "-o", out, "--voxel", "0.05")
        grids = {grid.name: grid for grid in vdb.readAll(str(out))[0]}
        self.assertLessEqual({"surface", "N", "k"}, set(grids))
        surface = grids["surface"]
        self.assertEqual(surface.gridClass, vdb.GridClass.LEVEL_SET)
        self.assertAlmostEqual(surface.transform.voxelSize()[0], 0.05, places=12)
        values = [(item.min, item.value) for item in surface.citerOnValues() if item.count == 1]
        place = np.array([surface.transform.indexToWorld(ijk) for ijk, _ in values])
        phi = np.array([value for _, value in values])
        sphere = float(np.linalg.norm(meshio.read(self.made / "sphere.stl").points, axis=1).max())
        self.assertLess(np.abs(phi - (np.linalg.norm(place, axis=1) - sphere)).max(), 0.01 * sphere)

    def test_two_triangles_are_a_2d_mesh(self):
        mesh = self.dir / "q.mesh"
        mesh.write_text("MeshVersionFormatted 2\nDimension 2\nVertices\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                        "Triangles\n2\n1 2 3 0\n1 3 4 0\nEnd\n")
        told = self.own_score(mesh)["score"]
        points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
        expected = oracle.score(points, np.array([[0, 1, 2], [0, 2, 3]]), np.repeat(np.eye(2)[None], 4, axis=0))
        self.assertEqual((told["cells"], told["edges"]), (2, 5))
        self.assertAlmostEqual(told["quality"]["min"], expected["quality_min"], places=12)


if __name__ == "__main__":
    support.main()
