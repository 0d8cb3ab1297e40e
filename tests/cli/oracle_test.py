"""The second opinion itself is right: values by hand, and laws."""
import struct

import numpy as np

import oracle
import support

REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
# Positive: right-handed.
CELL = np.array([[0, 1, 2, 3]]) if np.linalg.det(REGULAR[1:] - REGULAR[0]) > 0 else np.array([[0, 2, 1, 3]])
CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FIRST = np.array([[0, 1, 2, 3]])


def identity(count, dim=3):
    return np.repeat(np.eye(dim)[None], count, axis=0)


class Definitions(support.Case):
    def test_regular_simplices_have_quality_one(self):
        self.assertAlmostEqual(oracle.qualities(REGULAR, CELL, identity(4))[0], 1.0, places=14)
        triangle = np.array([[0.0, 0], [1, 0], [0.5, np.sqrt(0.75)]])
        self.assertAlmostEqual(oracle.qualities(triangle, np.array([[0, 1, 2]]), identity(3, 2))[0], 1.0, places=14)

    def test_corner_of_a_cube_by_hand(self):
        # V = 1/6, edges 1, 1, 1 and three of sqrt 2: 12 (1/2)^(2/3) / 9.
        self.assertAlmostEqual(oracle.qualities(CORNER, FIRST, identity(4))[0], 12 * 0.5 ** (2 / 3) / 9, places=14)
        # Smallest height 1/sqrt 3 over the slanted face, longest edge sqrt 2.
        self.assertAlmostEqual(oracle.aspects(CORNER, FIRST)[0], np.sqrt(6.0), places=14)
        self.assertAlmostEqual(oracle.volumes(CORNER, FIRST)[0], 1 / 6, places=15)

    def test_inverted_cell_is_negative(self):
        flipped = np.array([[0, 2, 1, 3]])
        self.assertAlmostEqual(oracle.qualities(CORNER, flipped, identity(4))[0],
                               -oracle.qualities(CORNER, FIRST, identity(4))[0], places=14)

    def test_a_stretched_cell_is_regular_in_the_metric_that_stretches_back(self):
        stretch = np.diag([1.0, 1e-2, 1e-4])
        metric = np.repeat((np.linalg.inv(stretch) @ np.linalg.inv(stretch))[None], 4, axis=0)
        self.assertAlmostEqual(oracle.qualities(REGULAR @ stretch, CELL, metric)[0], 1.0, places=12)

    def test_the_largest_determinant_decides(self):
        tensors = identity(4)
        tensors[2] = np.diag([100.0, 1, 1])
        only = np.repeat(tensors[2:3], 4, axis=0)
        self.assertEqual(oracle.qualities(CORNER, FIRST, tensors)[0], oracle.qualities(CORNER, FIRST, only)[0])

    def test_length_between_sizes_one_and_half(self):
        # la = 1, lb = 2: (1 - 2) / ln(1/2) = 1 / ln 2.
        tensors = np.stack([np.eye(3), 4 * np.eye(3)])
        length = oracle.edge_lengths(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]), tensors)
        self.assertAlmostEqual(length[0], 1 / np.log(2.0), places=14)

    def test_length_is_continuous_where_the_sizes_agree(self):
        points, edge = np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]])
        for gap in (1e-3, 1.0001e-4, 0.9999e-4, 1e-6, 0.0):
            tensors = np.stack([np.eye(3), np.exp(2 * gap) * np.eye(3)])
            expected = (np.expm1(gap) / gap) if gap else 1.0
            self.assertAlmostEqual(oracle.edge_lengths(points, edge, tensors)[0], expected, places=11)

    def test_score_of_two_cells(self):
        points = np.vstack([CORNER, [[1.0, 1, 1]]])
        cells = np.array([[0, 1, 2, 3], [4, 1, 3, 2]])
        self.assertTrue((oracle.volumes(points, cells) > 0).all())
        told = oracle.score(points, cells, identity(5))
        self.assertEqual((told["points"], told["cells"], told["edges"]), (5, 2, 9))
        self.assertAlmostEqual(told["volume"], 1 / 6 + 1 / 3, places=14)
        self.assertAlmostEqual(told["complexity"], told["volume"], places=14)
        # Edges of length 1 and of length sqrt 2, which is the upper end of "unit".
        self.assertAlmostEqual(told["length_max"], np.sqrt(2.0), places=14)
        self.assertEqual(len(oracle.boundary_facets(cells)), 6)

    def test_sol_files(self):
        values = np.array([[2.0, 0.1, 3.0, 0.2, 0.3, 4.0], [1, 0, 1, 0, 0, 1]])
        text = self.dir / "a.sol"
        text.write_text("MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n2\n1 3\n" +
                        "\n".join(" ".join(map(str, row)) for row in values) + "\nEnd\n")
        binary = self.dir / "a.solb"
        head = struct.pack("<iiiii", 1, 2, 3, 20, 3)
        binary.write_bytes(head + struct.pack("<iiiii", 62, 0, 2, 1, 3) + values.astype("<f8").tobytes())
        for path in (text, binary):
            tensors = oracle.read_sol(path)
            self.assertEqual(tensors.shape, (2, 3, 3))
            np.testing.assert_array_equal(tensors[0], [[2, 0.1, 0.2], [0.1, 3, 0.3], [0.2, 0.3, 4]])
        sizes = self.dir / "h.sol"
        sizes.write_text("MeshVersionFormatted 2\nDimension 2\nSolAtVertices\n1\n1 1\n0.5\nEnd\n")
        np.testing.assert_array_equal(oracle.read_sol(sizes)[0], 4 * np.eye(2))


if __name__ == "__main__":
    support.main()
