"""`lamina adapt` by the fields of a solution: errors of interpolation, fields carried along, metrics intersected.

The loop of a user: a field at the points, its Hessian as metric, the field on the new mesh, and so on. The error is
measured here, by a quadrature of its own, of the linear interpolant of a boundary layer and an oblique front.
"""
import json

import meshio
import numpy as np

import support
from support import BAD_INPUT, DONE, MISSED, Case, lamina, read_json

LAYER = 0.02


def front(x):
    """A boundary layer on y = 0 and a front five times as wide that crosses it."""
    return 1 - np.exp(-x[:, 1] / LAYER) + 0.5 * np.tanh((x[:, 0] + 0.5 * x[:, 1] - 0.7) / (5 * LAYER))


def square(n):
    """Points and triangles of the unit square."""
    points = np.array([(i / n, j / n) for j in range(n + 1) for i in range(n + 1)])
    corner = np.array([j * (n + 1) + i for j in range(n) for i in range(n)])
    lower = np.stack([corner, corner + 1, corner + n + 2], axis=1)
    upper = np.stack([corner, corner + n + 2, corner + n + 1], axis=1)
    return points, np.concatenate([lower, upper])


def write_mesh(path, points, cells):
    """A .mesh of triangles or tetrahedra."""
    kind = "Triangles" if cells.shape[1] == 3 else "Tetrahedra"
    rows = [f"MeshVersionFormatted 2\nDimension {points.shape[1]}\nVertices\n{len(points)}"]
    rows += [" ".join(map(repr, map(float, p))) + " 0" for p in points]
    rows += [kind, str(len(cells))] + [" ".join(map(str, c + 1)) + " 0" for c in cells]
    path.write_text("\n".join(rows) + "\nEnd\n", encoding="ascii")


def write_sol(path, dimension, *fields):
    """A .sol; scalars are arrays of one axis, the others of two."""
    columns = [f.reshape(len(f), -1) for f in fields]
    kinds = {1: 1, dimension: 2, dimension * (dimension + 1) // 2: 3}
    head = " ".join(str(kinds[c.shape[1]]) for c in columns)
    rows = [" ".join(map(repr, map(float, row))) for row in np.concatenate(columns, axis=1)]
    path.write_text(f"MeshVersionFormatted 2\nDimension {dimension}\nSolAtVertices\n{len(rows)}\n{len(fields)} {head}\n"
                    + "\n".join(rows) + "\nEnd\n", encoding="ascii")


def read_mesh(path):
    mesh = meshio.read(path)
    return mesh.points[:, :2], mesh.cells_dict["triangle"]


def interpolation_error(points, triangles, f):
    """L2 norm of f minus its linear interpolant: 36 points a triangle, of a square folded into it."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    nodes, weights = (nodes + 1) / 2, weights / 2
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    values = f(points)[triangles]
    total = 0.0
    for r, wr in zip(nodes, weights):
        for s, ws in zip((1 - r) * nodes, weights):
            at = a + r * (b - a) + s * (c - a)
            difference = f(at) - values @ np.array([1 - r - s, r, s])
            total += np.sum(wr * ws * (1 - r) * area * difference**2)
    return np.sqrt(total)


class Posteriori(Case):
    def start(self, n=8, name="a.mesh"):
        points, triangles = square(n)
        write_mesh(self.dir / name, points, triangles)
        return points

    def adapt(self, *words):
        done = lamina("adapt", *words, "-q")
        self.assertIn(done.returncode, (DONE, MISSED), done.stderr)

    def test_error_goes_down_with_the_cells(self):
        """Of second order in the size, that is one over N: halving N's error doubles N."""
        self.start()
        mesh, new = self.dir / "a.mesh", self.dir / "b.mesh"
        errors, cells = {}, {}
        for n in (300, 300, 300, 300, 600, 600, 1200, 1200, 2400, 2400):
            points, _ = read_mesh(mesh)
            write_sol(self.dir / "a.sol", 2, front(points))
            self.adapt(mesh, "--lp-hessian", "sol_1", 2, "--complexity", n, "-o", new)
            new.rename(mesh)
            points, triangles = read_mesh(mesh)
            errors[n], cells[n] = interpolation_error(points, triangles, front), len(triangles)
        for n in (300, 600, 1200):
            rate = np.log(errors[n] / errors[2 * n]) / np.log(cells[2 * n] / cells[n])
            self.assertGreater(rate, 0.9, f"N = {n}: {errors}")
            self.assertLess(rate, 1.4, f"N = {n}: {errors}")
        # A regular mesh of as many cells is worse by the square of the layer's width, and more.
        points, triangles = square(int(np.sqrt(cells[2400] / 2)))
        self.assertGreater(interpolation_error(points, triangles, front), 20 * errors[2400])

    def test_complexity_is_met_from_a_coarse_mesh(self):
        """Between points far apart a finer mesh sees other sizes than the points have."""
        for n in (4, 6, 10):
            points = self.start(n)
            write_sol(self.dir / "a.sol", 2, front(points))
            self.adapt(self.dir / "a.mesh", "--lp-hessian", "sol_1", 2, "--complexity", 500, "-o", self.dir / "b.vtu",
                       "--report", self.dir / "b.json")
            self.assertAlmostEqual(read_json(self.dir / "b.json")["score"]["complexity"], 500, delta=50)

    def test_same_bits_for_every_thread_count(self):
        points = self.start(20)
        write_sol(self.dir / "a.sol", 2, front(points))
        for threads in (1, 3):
            self.adapt(self.dir / "a.mesh", "--lp-hessian", "sol_1", 2, "--complexity", 500, "--threads", threads,
                       "-o", self.dir / f"{threads}.meshb")
        for kind in ("meshb", "solb"):
            self.assertEqual(*((self.dir / f"{t}.{kind}").read_bytes() for t in (1, 3)))

    def test_fields_go_along(self):
        points = self.start(12)
        linear = 2 + 3 * points[:, 0] - points[:, 1]
        write_sol(self.dir / "a.sol", 2, front(points), linear, points - 0.5)
        self.adapt(self.dir / "a.mesh", "--lp-hessian", "sol_1", 1, "--complexity", 300, "-o", self.dir / "b.vtu",
                   "-o", self.dir / "b.meshb", "--metric-out", self.dir / "b.solb", "--report", self.dir / "b.json")
        self.assertEqual(self.entries(), ["a.mesh", "a.sol", "b.fields.solb", "b.json", "b.meshb", "b.solb", "b.vtu"])
        mesh = meshio.read(self.dir / "b.vtu")
        x = mesh.points[:, :2]
        np.testing.assert_allclose(mesh.point_data["sol_2"], 2 + 3 * x[:, 0] - x[:, 1], atol=1e-13)
        np.testing.assert_allclose(mesh.point_data["sol_3"][:, :2], x - 0.5, atol=1e-13)
        told = {f["name"]: f for f in read_json(self.dir / "b.json")["fields"]}
        self.assertEqual(sorted(told), ["sol_1", "sol_2", "sol_3"])
        for f in told.values():
            self.assertLessEqual(f["range_before"][0], f["range"][0])
            self.assertGreaterEqual(f["range_before"][1], f["range"][1])
        self.assertEqual(told["sol_2"]["range"], [1.0, 5.0])

    def test_names_of_fields(self):
        """By name and by component, in a format that has names."""
        points, triangles = square(12)
        meshio.Mesh(np.column_stack([points, 0 * points[:, 0]]), [("triangle", triangles)],
                    point_data={"mach": front(points), "w": np.column_stack([0 * points, front(points)])}
                    ).write(self.dir / "a.vtu")
        write_sol(self.dir / "u.sol", 2, front(points))
        bytes_of = []
        for number, field in enumerate(("mach", "w:3", self.dir / "u.sol")):
            self.adapt(self.dir / "a.vtu", "--lp-hessian", field, 2, "--complexity", 300, "-o", self.dir / f"{number}.meshb")
            bytes_of.append((self.dir / f"{number}.meshb").read_bytes())
        self.assertEqual(len(set(bytes_of)), 1)
        out = ("--complexity", 300, "-o", self.dir / "b.meshb", "-q")
        for words, *needles in (
                (("--lp-hessian", "mash", 2, *out), "mash", "did you mean mach"),
                (("--lp-hessian", "w", 2, *out), "3 components", "w:1"),
                (("--lp-hessian", "w:4", 2, *out), "w:4", "3 components"),
                (("--lp-hessian", "mach", 0.5, *out), "0.5", "at least 1"),
                (("--lp-hessian", "mach", "two", *out), "two", "number"),
                (("--lp-hessian", "mach", 2, "-o", self.dir / "b.meshb"), "--complexity"),
                (("--lp-hessian", "mach", 2, "--analytic", "iso", *out), "--analytic"),
                (("--lp-hessian", self.dir / "u.sol", 2, "--complexity", 9, "-o", self.dir / "u.meshb", "--metric-out",
                  self.dir / "u.sol"), "u.sol", "overwrite")):
            with self.subTest(words=words):
                self.assert_one_error(lamina("adapt", self.dir / "a.vtu", *words), BAD_INPUT, *needles)

    def test_intersection(self):
        """Sizes .05 along x and .2 along y, with the other way round: .05 along both. By points and by meshes."""
        points = self.start(10)
        ones = np.ones(len(points))
        thin = {"x": np.column_stack([400 * ones, 0 * ones, 25 * ones]),
                "y": np.column_stack([25 * ones, 0 * ones, 400 * ones])}
        for name, tensor in thin.items():
            write_sol(self.dir / f"{name}.sol", 2, tensor)
            write_mesh(self.dir / f"{name}.mesh", *square(3 if name == "y" else 10))
        write_sol(self.dir / "y3.sol", 2, thin["y"][:16])
        (self.dir / "y.mesh").rename(self.dir / "y3.mesh")
        for other in ("y.sol", "y3.mesh"):
            self.adapt(self.dir / "a.mesh", "--metric", self.dir / "x.sol", "--intersect", self.dir / other, "-o",
                       self.dir / "b.vtu")
            score = json.loads(self.run_ok("score", self.dir / "b.vtu", "--json"))["score"]
            self.assertAlmostEqual(score["complexity"], 400, delta=1)
            self.assertGreater(score["unit_share"], 0.95)
            # In the one metric alone, given by a mesh: half of it.
            write_sol(self.dir / "a.sol", 2, thin["x"])
            alone = json.loads(self.run_ok("score", self.dir / "b.vtu", "--metric", self.dir / "a.mesh", "--json"))
            self.assertAlmostEqual(alone["score"]["complexity"], 100, delta=1)
            (self.dir / "a.sol").unlink()
            self.adapt(self.dir / "a.mesh", "--metric", self.dir / "x.sol", "--intersect", self.dir / other,
                       "--complexity", 1600, "-o", self.dir / "b.vtu")
            score = json.loads(self.run_ok("score", self.dir / "b.vtu", "--json"))["score"]
            self.assertAlmostEqual(score["complexity"], 1600, delta=20)
        write_sol(self.dir / "y.sol", 2, thin["y"][:5])
        self.assert_one_error(lamina("adapt", self.dir / "a.mesh", "--metric", self.dir / "x.sol", "--intersect",
                                     self.dir / "y.sol", "-o", self.dir / "b.vtu", "-q"), BAD_INPUT, "y.sol", "5 tensors")

    def circle(self):
        """A lattice with distances to a circle of radius 1/4 and a front beside it, and the circle as a profile."""
        points = self.start(30)
        distance = np.hypot(*(points - 0.5).T) - 0.25
        write_sol(self.dir / "a.sol", 2, distance, np.tanh((points[:, 0] - 0.9) / 0.05))
        angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)
        ring = 0.5 + 0.25 * np.column_stack([np.cos(angles), np.sin(angles)])
        rows = [f"{float(x)!r},{float(y)!r}" for x, y in np.vstack([ring, ring[:1]])]
        (self.dir / "circle.csv").write_text("\n".join(rows) + "\n", encoding="ascii")

    def test_layers_beside_a_solution(self):
        """By a field of distances, or by the body: the same layers, and the front has its cells too."""
        self.circle()
        layers = ("--hmin", 5e-3, "--layers", 4, "--hmax", 0.25, "--align", "layers")
        solution = ("--lp-hessian", "sol_2", 2, "--complexity", 1000)
        bare = {}
        for wall in ("sol_1", self.dir / "circle.csv"):
            scores = []
            for words in ((), solution):
                self.adapt(self.dir / "a.mesh", "--level-set", wall, "--spline", *layers, *words, "-o",
                           self.dir / "b.vtu", "--report", self.dir / "b.json")
                told = read_json(self.dir / "b.json")
                self.assertEqual(told["metric"]["layers"]["layers"], 4)
                self.assertGreater(told["levels"]["on_level"], 0.95 * told["levels"]["points"])
                self.assertLess(told["levels"]["mean_offset"], 0.02)
                self.assertGreater(told["score"]["unit_share"], 0.9)
                # On the wall: on the circle to a fraction of a layer.
                points, _ = read_mesh(self.dir / "b.vtu")
                height = np.abs(np.hypot(*(points - 0.5).T) - 0.25)
                on_wall = height < 1e-3
                self.assertGreater(on_wall.sum(), 0.8 * told["levels"]["ideal_on_wall"])
                self.assertLess(height[on_wall].max(), 2.5e-4)
                scores.append((told["score"]["complexity"], told["cells"]))
            self.assertAlmostEqual(scores[1][0], 1000, delta=100)
            bare[wall] = scores[0][0]
        by_field, by_body = bare.values()
        self.assertAlmostEqual(by_field, by_body, delta=0.03 * by_body)

    def test_bad_walls(self):
        self.circle()
        body = self.dir / "circle.csv"
        out = ("-o", self.dir / "b.meshb", "-q")
        for words, *needles in (
                (("--level-set", "phi"), "phi", "sol_1, sol_2"),
                (("--level-set", "sol_3"), "sol_3", "did you mean"),
                (("--level-set", self.dir / "a.mesh"), "not a body"),
                (("--level-set", body, "--layers", 3, "--complexity", 100), "--complexity", "--lp-hessian"),
                (("--lp-hessian", "sol_2", 2, "--complexity", 100, "--layers", 3), "--level-set"),
                (("--lp-hessian", "sol_2", 2, "--complexity", 100, "--align", "layers"), "--align layers", "--level-set"),
                (("--level-set", body, "--layers", 3, "--hmin", 5e-3, "--lp-hessian", "sol_2", 2, "--complexity", 10),
                 "--complexity", "layers of --level-set")):
            with self.subTest(words=words):
                self.assert_one_error(lamina("adapt", self.dir / "a.mesh", *words, *out), BAD_INPUT, *needles)
        write_sol(self.dir / "a.sol", 2, np.ones(31 * 31))
        self.assert_one_error(lamina("adapt", self.dir / "a.mesh", "--level-set", "sol_1", *out), BAD_INPUT,
                              "nowhere 0")
        self.sample("sphere")
        self.assert_one_error(lamina("adapt", self.dir / "a.mesh", "--level-set", self.dir / "sphere.stl", *out),
                              BAD_INPUT, "2 dimensions", "body in 3")

    def test_a_solution_of_another_mesh_is_left_out(self):
        self.start()
        write_sol(self.dir / "a.sol", 2, np.ones(5))
        done = lamina("adapt", self.dir / "a.mesh", "--analytic", "iso:h=0.2", "-o", self.dir / "b.mesh")
        self.assertEqual(done.returncode, DONE, done.stderr)
        self.assertIn("a.sol: holds values of 5 points", done.stderr)
        self.assertFalse((self.dir / "b.sol").exists())


if __name__ == "__main__":
    support.main()
