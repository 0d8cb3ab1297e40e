"""`lamina adapt` of meshes with several materials: regions keep their tags, names, volumes and borders in every format."""
import unittest

import support
from support import BAD_INPUT, DONE, MISSED, lamina

try:
    import numpy as np
except ImportError:
    np = None

RADIUS = 0.5


def two_materials(n):
    """A lattice of [-1, 1]^3, n even, in which a ball of radius 1/2 is material 2, all around it 1: points, tetrahedra,
    their tags, triangles between the two with tag 9."""
    side = np.arange(n + 1)
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3) * (2.0 / n) - 1.0
    origin = (x + (n + 1) * (y + (n + 1) * z))[:-1, :-1, :-1].ravel()
    steps = (1, n + 1, (n + 1) ** 2)
    cells = []
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)):
        corners = [origin, origin + steps[a], origin + steps[a] + steps[b], origin + sum(steps)]
        if (a, b, c) not in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            corners[2:] = corners[:1:-1]
        cells.append(np.stack(corners, axis=-1))
    cells = np.concatenate(cells)
    tags = np.where(np.abs(points[cells].mean(axis=1)).max(axis=1) < 0.5, 2, 1)
    largest = np.abs(points).max(axis=1)
    length = np.linalg.norm(points, axis=1)
    square = np.maximum(0.0, 2.0 * largest - 1.0)
    with np.errstate(invalid="ignore"):
        factor = np.where(largest > 0, square + (1.0 - square) * largest / length, 1.0)
    points = points * factor[:, None]
    return points, cells, tags, border(cells, tags)


def border(cells, tags):
    """Triangles between tetrahedra of two tags, each once."""
    faces = np.sort(np.concatenate([np.delete(cells, k, axis=1) for k in range(4)]), axis=1)
    order = np.lexsort(faces.T[::-1])
    faces, tags = faces[order], np.tile(tags, 4)[order]
    same = (faces[1:] == faces[:-1]).all(axis=1) & (tags[1:] != tags[:-1])
    return faces[1:][same]


def write_mesh(path, points, cells, tags, triangles=(), tag=9):
    rows = ["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(points))]
    rows += [f"{x!r} {y!r} {z!r} 0" for x, y, z in points.tolist()]
    rows += ["Tetrahedra", str(len(cells))]
    rows += [" ".join(str(v + 1) for v in c) + f" {t}" for c, t in zip(cells.tolist(), tags.tolist())]
    if len(triangles):
        rows += ["Triangles", str(len(triangles))]
        rows += [" ".join(str(v + 1) for v in t) + f" {tag}" for t in triangles.tolist()]
    path.write_text("\n".join(rows) + "\nEnd\n", encoding="ascii")


def read_mesh(path):
    words = path.read_text(encoding="ascii").split()

    def table(name, columns):
        if name not in words:
            return np.zeros((0, columns))
        at = words.index(name)
        count = int(words[at + 1])
        return np.array(words[at + 2:at + 2 + count * columns], dtype=float).reshape(count, columns)

    cells, triangles = table("Tetrahedra", 5).astype(int), table("Triangles", 4).astype(int)
    return table("Vertices", 4)[:, :3], cells[:, :4] - 1, cells[:, 4], triangles[:, :3] - 1, triangles[:, 3]


def volumes(points, cells, tags):
    x = points[cells]
    volume = np.linalg.det(x[:, 1:] - x[:, :1]) / 6.0
    return {int(t): volume[tags == t].sum() for t in np.unique(tags)}, volume.min()


@unittest.skipIf(np is None, "no numpy")
class Regions(support.Case):
    def adapt(self, *words):
        done = lamina("adapt", *words)
        self.assertIn(done.returncode, (DONE, MISSED), done.stderr)
        return done

    def judge(self, path, before, tolerance, sagitta):
        points, cells, tags, triangles, facet_tags = read_mesh(path)
        sums, least = volumes(points, cells, tags)
        self.assertGreater(least, 0.0)
        self.assertEqual(set(sums), {1, 2})
        self.assertAlmostEqual(sums[1] + sums[2], 8.0, places=10)
        self.assertAlmostEqual(sums[2], before[2], delta=4.0 * np.pi * RADIUS ** 2 * tolerance)
        between = border(cells, tags)
        for weights in ((1, 0, 0), (0.5, 0.5, 0), (1 / 3, 1 / 3, 1 / 3), (0.1, 0.2, 0.7)):
            radius = np.linalg.norm(np.einsum("i,fid->fd", weights, points[between]), axis=1)
            self.assertLess(radius.max(), RADIUS + 1e-12)
            self.assertGreater(radius.min(), RADIUS - sagitta - 1.1 * tolerance)
        return between, triangles[facet_tags == 9]

    def test_a_ball_within_a_box_in_every_format(self):
        points, cells, tags, between = two_materials(12)
        before, least = volumes(points, cells, tags)
        self.assertGreater(least, 0.0)
        sagitta = RADIUS - np.linalg.norm(points[between].mean(axis=1), axis=1).min()
        write_mesh(self.dir / "a.mesh", points, cells, tags, between)
        results = set()
        for ending in ("mesh", "meshb", "msh", "vtu", "xdmf", "cgns"):
            with self.subTest(ending=ending):
                start = self.dir / f"a.{ending}"
                if ending != "mesh":
                    self.run_ok("convert", self.dir / "a.mesh", start)
                out = self.dir / f"b.{ending}"
                self.adapt(start, "--analytic", "iso:h=0.2", "--hausdorff", 0.01, "-o", out, "-q")
                self.run_ok("convert", out, self.dir / f"c_{ending}.mesh")
                found, listed = self.judge(self.dir / f"c_{ending}.mesh", before, 0.01, sagitta)
                if ending == "vtu":  # which leaves the list of facets out
                    continue
                results.add((self.dir / f"c_{ending}.mesh").read_bytes())
                self.assertEqual({tuple(sorted(t)) for t in found.tolist()}, {tuple(sorted(t)) for t in listed.tolist()})
        self.assertLessEqual(len(results), 2, "the order of cells and facets may differ, by format, from the first")

    def test_same_bits_for_every_thread_count(self):
        write_mesh(self.dir / "a.mesh", *two_materials(8)[:3])
        for threads in (1, 2, 3, 8):
            self.adapt(self.dir / "a.mesh", "--analytic", "iso:h=0.15", "-o", self.dir / f"b{threads}.meshb", "-q",
                       "--threads", threads)
        self.assertEqual(len({(self.dir / f"b{threads}.meshb").read_bytes() for threads in (1, 2, 3, 8)}), 1)

    def test_listed_edges_and_corners_are_kept(self):
        points, cells, tags, _ = two_materials(4)
        path = self.dir / "a.mesh"
        write_mesh(path, points, cells, tags)
        edge = [int(np.flatnonzero((points == (x, -1.0, -1.0)).all(axis=1))[0]) + 1 for x in (-1.0, -0.5, 0.0, 0.5, 1.0)]
        rows = "".join(f"{a} {b} 7\n" for a, b in zip(edge, edge[1:]))
        text = path.read_text(encoding="ascii").replace("-1.0 -1.0 -1.0 0", "-1.0 -1.0 -1.0 5")
        path.write_text(text.replace("\nEnd", f"\nEdges\n4\n{rows}Corners\n1\n{edge[0]}\nEnd"), encoding="ascii")
        self.assertIn("edges                  4", lamina("info", path).stdout)
        for name in ("b.mesh", "c.msh", "d.msh"):
            words = ("--format-version", "2.2") if name == "d.msh" else ()
            if words:
                self.run_ok("convert", self.dir / "c.msh", self.dir / name, *words)
            else:
                done = self.adapt(path, "--analytic", "iso:h=0.3", "-o", self.dir / name)
                self.assertNotIn("warning", done.stderr)
            back = self.dir / "back.mesh"
            self.run_ok("convert", self.dir / name, back)
            words = back.read_text(encoding="ascii").split()
            at = words.index("Vertices")
            places = np.array(words[at + 2:at + 2 + 4 * int(words[at + 1])], dtype=float).reshape(-1, 4)
            at = words.index("Edges")
            edges = np.array(words[at + 2:at + 2 + 3 * int(words[at + 1])], dtype=int).reshape(-1, 3)
            self.assertEqual(set(edges[:, 2]), {7})
            ends = places[edges[:, :2] - 1]
            self.assertTrue((ends[..., 1:3] == -1.0).all())
            self.assertAlmostEqual(np.abs(ends[:, 0, 0] - ends[:, 1, 0]).sum(), 2.0, places=12)
            self.assertGreater(len(edges), 4)
            at = words.index("Corners")
            self.assertEqual(words[at + 1], "1")
            self.assertEqual(places[int(words[at + 2]) - 1].tolist(), [-1.0, -1.0, -1.0, 5.0])
        self.adapt(path, "--analytic", "iso:h=0.3", "--edges", "drop", "-o", self.dir / "e.mesh")
        self.assertNotIn("Edges", (self.dir / "e.mesh").read_text(encoding="ascii"))

    def test_tags_of_points_are_dropped_aloud(self):
        points, cells, tags, _ = two_materials(4)
        write_mesh(self.dir / "a.mesh", points, cells, tags)
        text = (self.dir / "a.mesh").read_text(encoding="ascii")
        (self.dir / "a.mesh").write_text(text.replace("-1.0 -1.0 -1.0 0", "-1.0 -1.0 -1.0 5"), encoding="ascii")
        done = self.adapt(self.dir / "a.mesh", "--analytic", "iso:h=0.5", "-o", self.dir / "b.mesh")
        self.assertIn("tag of a point is dropped", done.stderr)

    def test_tags_that_are_no_regions(self):
        points, cells, tags, between = two_materials(8)
        scattered = (np.arange(len(cells)) * 2654435761 >> 7) % 3
        write_mesh(self.dir / "a.mesh", points, cells, scattered)
        done = self.adapt(self.dir / "a.mesh", "--analytic", "iso:h=0.3", "-o", self.dir / "b.mesh")
        self.assertIn("--cell-tags drop", done.stderr)
        done = self.adapt(self.dir / "a.mesh", "--analytic", "iso:h=0.3", "--cell-tags", "drop", "-o",
                          self.dir / "b.mesh")
        self.assertNotIn("ragged", done.stderr)
        self.assertEqual(set(read_mesh(self.dir / "b.mesh")[2]), {0})
        # A facet that ends within a region.
        write_mesh(self.dir / "a.mesh", points, cells, tags * 0, between[:1])
        self.assert_one_error(lamina("adapt", self.dir / "a.mesh", "--analytic", "iso", "-o", self.dir / "c.mesh", "-q"),
                              BAD_INPUT, "1 tagged facet lies inside a region")
        self.assertNotIn("c.mesh", self.entries())


if __name__ == "__main__":
    support.main()
