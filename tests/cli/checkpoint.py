"""`lamina mesh --checkpoint DIR` and `--resume DIR`: the same bits as a run that nobody interrupted."""
import signal
import subprocess
import time

import support
from support import BAD_INPUT, INTERRUPTED, LAMINA, Case, lamina

SIZES = ("--hmin", "0.02", "--layers", "3", "--h2", "0.2", "--h1", "0.5", "--voxel", "0.05",
         "--domain", *map(str, support.DOMAIN))


class Checkpoint(Case):
    def setUp(self):
        super().setUp()
        self.body = self.sample("sphere")
        self.saved = self.dir / "saved"

    def mesh(self, name):
        return (self.dir / name).read_bytes()

    def steps(self):
        return sorted(p.name for p in self.saved.glob("*.checkpoint"))

    def test_the_same_bits(self):
        self.run_ok("mesh", self.body, *SIZES, "-o", self.dir / "whole.vtu", "--checkpoint", self.saved, "-q")
        steps = self.steps()
        self.assertGreater(len(steps), 3)
        self.assertEqual(steps[0], "step-01.checkpoint")
        self.run_ok("mesh", "--case", self.dir / "whole.case.toml", "-o", self.dir / "plain.vtu", "-q")
        self.assertEqual(self.mesh("plain.vtu"), self.mesh("whole.vtu"))
        # From the last step, from an early one on another number of threads, and from none.
        for kept, threads in ((len(steps), 2), (2, 1), (0, 2)):
            for name in self.steps()[kept:]:
                (self.saved / name).unlink()
            with self.subTest(kept=kept):
                self.run_ok("mesh", "--resume", self.saved, "-o", self.dir / "again.vtu", "--threads", threads, "-q")
                self.assertEqual(self.mesh("again.vtu"), self.mesh("whole.vtu"))
                self.assertEqual(self.steps(), steps)

    def test_after_an_interrupt(self):
        words = [LAMINA, "mesh", self.body, *SIZES, "-o", self.dir / "a.vtu", "--checkpoint", self.saved, "-q"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
            while run.poll() is None and len(self.steps()) < 3:
                time.sleep(0.02)
            run.send_signal(signal.SIGINT)
            _, told = run.communicate(timeout=120)
            self.assertEqual(run.returncode, INTERRUPTED, told)
        self.assertFalse((self.dir / "a.vtu").exists())
        self.assertEqual([p.name for p in self.saved.iterdir() if p.suffix not in (".checkpoint", ".toml")], [])
        self.run_ok("mesh", "--resume", self.saved, "-q")
        self.run_ok("mesh", "--case", self.dir / "a.case.toml", "-o", self.dir / "b.vtu", "-q")
        self.assertEqual(self.mesh("a.vtu"), self.mesh("b.vtu"))

    def test_refusals(self):
        self.run_ok("mesh", self.body, *support.COARSE, "-o", self.dir / "a.vtu", "--checkpoint", self.saved, "-q")
        resume = ("mesh", "--resume", self.saved, "-q")
        self.assert_one_error(lamina("mesh", self.body, *support.COARSE, "-o", self.dir / "b.vtu", "--checkpoint",
                                     self.saved, "-q"), BAD_INPUT, "--checkpoint", "--resume")
        self.assert_one_error(lamina(*resume, "--hmin", "0.04"), BAD_INPUT, "another case")
        self.assert_one_error(lamina("mesh", "--resume", self.dir / "nowhere", "-q"), BAD_INPUT, "nowhere")
        self.assert_one_error(lamina(*resume, "--case", self.dir / "a.case.toml"), BAD_INPUT, "--resume", "--case")
        last = self.saved / self.steps()[-1]
        whole = last.read_bytes()
        for damaged in (whole[:-1], whole[:30], b"", whole[:-9] + bytes([whole[-9] ^ 1]) + whole[-8:]):
            last.write_bytes(damaged)
            self.assert_one_error(lamina(*resume), BAD_INPUT, last.name, "damaged")
        last.unlink()
        self.run_ok(*resume, "-o", self.dir / "c.vtu")
        self.assertEqual(self.mesh("c.vtu"), self.mesh("a.vtu"))
        self.body.write_bytes(self.body.read_bytes()[:-1] + b"\1")
        self.assert_one_error(lamina(*resume), BAD_INPUT, "another case")


if __name__ == "__main__":
    support.main()
