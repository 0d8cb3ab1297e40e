"""The same bytes on 1, 2, 3 and 8 threads and on repetition."""
import hashlib

import support
from support import COARSE, Case, lamina

ALL = (1, 2, 3, 8, 2)


class Determinism(Case):
    def check(self, flags, threads_of_runs, least_cells=0):
        body = self.sample("sphere")
        found = {}
        for turn, threads in enumerate(threads_of_runs):
            out = self.dir / f"run{turn}"
            out.mkdir()
            done = lamina("mesh", body, "-o", out / "a.meshb", "--metric-out", out / "a.solb",
                          "--report", out / "r.json", "--threads", threads, *flags, timeout=3000)
            self.assertIn(done.returncode, (0, 3), done.stderr)
            key = tuple(hashlib.sha256((out / name).read_bytes()).hexdigest() for name in ("a.meshb", "a.solb"))
            found.setdefault(key, []).append(threads)
            cells = support.read_json(out / "r.json")["cells"]["total"]["count"]
            self.assertGreaterEqual(cells, least_cells, "too small to need more than one block")
        self.assertEqual(len(found), 1, f"threads that agree with each other: {list(found.values())}")


# Above 16384 vertices, so that several blocks are adapted at the same time.
BLOCKS = ("--hmin", "4e-3", "--layers", "8", "--h2", "0.1", "--h1", "0.4", "--domain", -1, -1, -1, 1, 1, 1)


class Small(Determinism):
    def test_one_block(self):
        self.check(COARSE, ALL)


class Blocks(Determinism):
    def test_blocks_side_by_side(self):
        self.check(BLOCKS, (1, 3), least_cells=100_000)


class Large(Determinism):
    def test_every_thread_count(self):
        self.check(("--hmin", "1e-3", "--h2", "0.1", "--h1", "0.5"), ALL, least_cells=400_000)


if __name__ == "__main__":
    support.main()
