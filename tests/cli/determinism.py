"""The same bytes on 1, 2, 3 and 8 threads and on repetition."""
import hashlib

import support
from support import COARSE, Case, lamina

THREADS = (1, 2, 3, 8, 2)


class Determinism(Case):
    flags = ()
    least_cells = 0
    shape = "sphere"

    def check(self):
        body = self.sample(self.shape)
        found = {}
        for turn, threads in enumerate(THREADS):
            out = self.dir / f"run{turn}"
            out.mkdir()
            done = lamina("mesh", body, "-o", out / "a.meshb", "--metric-out", out / "a.solb", "--report", out / "r.json",
                          "--threads", threads, *self.flags, timeout=3000)
            self.assertIn(done.returncode, (0, 3), done.stderr)
            key = tuple(hashlib.sha256((out / name).read_bytes()).hexdigest() for name in ("a.meshb", "a.solb"))
            found.setdefault(key, []).append(threads)
            cells = support.read_json(out / "r.json")["cells"]["total"]["count"]
            self.assertGreaterEqual(cells, self.least_cells, "too small to need more than one block")
        self.assertEqual(len(found), 1, f"threads that agree with each other: {list(found.values())}")


class Small(Determinism):
    flags = COARSE

    def test_same_bytes(self):
        self.check()


class Large(Determinism):
    """Several blocks of 16384 vertices, so that blocks are adapted at the same time."""
    flags = ("--hmin", "2e-3", "--h2", "0.05", "--h1", "0.3")
    least_cells = 100_000

    def test_same_bytes(self):
        self.check()


if __name__ == "__main__":
    support.main()
