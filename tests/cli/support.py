"""What the scripts share: running the program, files of known content, and an exit code that tells skipped from passed.

Environment: LAMINA the program, LAMINA_DATA a folder of real inputs (may be absent), LAMINA_ASSETS the assets folder.
"""
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

LAMINA = os.environ.get("LAMINA", "lamina")
DATA = Path(os.environ.get("LAMINA_DATA", "missing"))
ASSETS = Path(os.environ.get("LAMINA_ASSETS", Path(__file__).resolve().parents[2] / "assets"))

# Exit codes of the program.
DONE, BAD_INPUT, MISSED, INTERNAL, INTERRUPTED = 0, 2, 3, 1, 130
# What ctest reads as "skipped".
SKIPPED = 77

# A mesh of the sphere of diameter 1, of a few thousand cells.
DOMAIN = (-1.0, -1.125, -0.875, 1.25, 1.0, 1.0)
COARSE = ("--hmin", "0.05", "--layers", "2", "--h2", "0.4", "--h1", "0.7", "--voxel", "0.05",
          "--domain", *map(str, DOMAIN))


def lamina(*words, cwd=None, timeout=600, env=None):
    """Runs the program to its end; stdout and stderr as text."""
    return subprocess.run([LAMINA, *map(str, words)], cwd=cwd, timeout=timeout, capture_output=True, text=True,
                          env={**os.environ, **(env or {})}, stdin=subprocess.DEVNULL, check=False)


class Case(unittest.TestCase):
    """A test with a folder of its own, `self.dir`, that must hold nothing but what the test put there."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="lamina-test-")
        self.addCleanup(holder.cleanup)
        self.dir = Path(holder.name)

    def entries(self, folder=None):
        root = folder or self.dir
        return sorted(p.relative_to(root).as_posix() for p in root.rglob("*"))

    def run_ok(self, *words, code=DONE, **keywords):
        """Runs and expects `code`; gives back stdout."""
        done = lamina(*words, **keywords)
        self.assertEqual(done.returncode, code, f"lamina {' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
        return done.stdout

    def assert_one_error(self, done, code, *needles):
        """One line on stderr, `lamina: error: ...`, that holds every needle (a tuple: any of its words)."""
        told = f"exit {done.returncode}\nstdout: {done.stdout}\nstderr: {done.stderr}"
        self.assertEqual(done.returncode, code, told)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, told)
        self.assertTrue(lines[0].startswith("lamina: error: "), told)
        for needle in needles:
            choices = needle if isinstance(needle, tuple) else (needle,)
            self.assertTrue(any(choice in lines[0] for choice in choices), f"none of {choices} in: {told}")

    def sample(self, shape="sphere", name=None, *words):
        path = self.dir / (name or f"{shape}.stl")
        self.run_ok("sample", shape, "-o", path, *words)
        return path

    def foam_case(self, name):
        """The folder of an OpenFOAM case that only lacks its mesh."""
        case = self.dir / name
        (case / "system").mkdir(parents=True)
        (case / "constant").mkdir()
        for file in ("controlDict", "fvSchemes", "fvSolution"):
            (case / "system" / file).write_text(
                f"FoamFile {{ version 2.0; format ascii; class dictionary; object {file}; }}\n"
                "startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeInterval 1;\n"
                "ddtSchemes{} gradSchemes{} divSchemes{} laplacianSchemes{} interpolationSchemes{} snGradSchemes{}\n",
                encoding="ascii")
        return case

    def check_foam(self, case):
        """What OpenFOAM's checkMesh, which must find nothing wrong, tells of a case."""
        if shutil.which("checkMesh") is None:
            self.skipTest("OpenFOAM's checkMesh is not installed")
        root = Path("/usr/share/openfoam")
        done = subprocess.run(["checkMesh", "-case", case], capture_output=True, text=True, check=False, timeout=60,
                              env={**os.environ, **({"WM_PROJECT_DIR": str(root)} if root.is_dir() else {})})
        self.assertIn("Mesh OK.", done.stdout + done.stderr)
        return done.stdout

    def data(self, name):
        """A real input; the test is skipped, saying why, where the folder is not there."""
        path = DATA / name
        if not path.is_file():
            self.skipTest(f"no {name} in {DATA}")
        return path


def write_stl(path, triangles):
    """Binary STL with zero normals from an iterable of three corners each."""
    triangles = list(triangles)
    with open(path, "wb") as out:
        out.write(b"\0" * 80 + struct.pack("<I", len(triangles)))
        for corners in triangles:
            out.write(struct.pack("<12fH", 0, 0, 0, *(x for corner in corners for x in corner), 0))


def read_json(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


def main():
    """unittest.main with exit code 77 when tests were skipped and none ran."""
    program = unittest.main(argv=[sys.argv[0], *sys.argv[1:]], verbosity=2, exit=False)
    result = program.result
    if not result.wasSuccessful() or result.testsRun == 0:
        sys.exit(1)
    for test, reason in result.skipped:
        print(f"SKIPPED {test}: {reason}")
    sys.exit(SKIPPED if len(result.skipped) == result.testsRun else 0)
