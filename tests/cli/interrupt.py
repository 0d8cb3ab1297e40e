"""Ctrl-C ends a run cleanly: exit code 130 and no file, whole or half, in the output folder."""
import signal
import subprocess
import time

import support
from support import INTERRUPTED, Case, LAMINA


class Interrupt(Case):
    def interrupted(self, delay):
        """Starts a run of many seconds, sends SIGINT after its first words and `delay` more; gives back its end."""
        out = self.dir / "out"
        out.mkdir(exist_ok=True)
        words = [LAMINA, "mesh", self.body, "-o", out / "a.vtu", "--report", out / "r.json", "--hmin", "1e-3", "--h2",
                 "0.03", "--h1", "0.3"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
            first = run.stderr.readline()
            time.sleep(delay)
            self.assertIsNone(run.poll(), "the run ended before it could be interrupted: " + first)
            run.send_signal(signal.SIGINT)
            _, rest = run.communicate(timeout=60)
            return run.returncode, first + rest

    def test_nothing_is_left(self):
        self.body = self.sample("sphere")
        for delay in (0.0, 1.0, 4.0):
            with self.subTest(delay=delay):
                code, words = self.interrupted(delay)
                self.assertEqual(code, INTERRUPTED, words)
                self.assertEqual(self.entries(self.dir / "out"), [])


if __name__ == "__main__":
    support.main()
