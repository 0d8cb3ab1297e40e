"""Bad input ends with one clear line, exit code 2, and nothing left behind."""
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import support
from support import BAD_INPUT, COARSE, Case, lamina, write_stl


class BadInput(Case):
    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        self.out.mkdir()
        self.sphere = self.sample("sphere")

    def refuse(self, *words, needles, code=BAD_INPUT):
        """The words must be refused, naming the needles, and the output folder stay empty."""
        before = self.entries()
        done = lamina(*words, cwd=self.dir)
        self.assert_one_error(done, code, *needles)
        self.assertEqual(self.entries(), before, "files appeared or vanished")

    def refuse_body(self, name, *needles):
        for words in (("mesh", name, "-o", self.out / "a.vtu"), ("levelset", name, "-o", self.out / "a.vdb"),
                      ("plan", name), ("info", name)):
            with self.subTest(command=words[0]):
                self.refuse(*words, needles=(str(name), *needles))

    def refuse_mesh(self, *flags, needles, body=None):
        self.refuse("mesh", body or self.sphere, "-o", self.out / "a.vtu", *flags, needles=needles)

    def test_missing_file(self):
        self.refuse_body("no_such_body.stl")
        self.refuse("score", "no_such_mesh.meshb", needles=("no_such_mesh.meshb",))
        self.refuse("view", "no_such_mesh.vtu", "-o", self.out / "a.png", needles=("no_such_mesh.vtu",))
        self.refuse("convert", "no_such_mesh.vtu", self.out / "a.mesh", needles=("no_such_mesh.vtu",))

    def test_directory(self):
        (self.dir / "folder.stl").mkdir()
        self.refuse_body("folder.stl", ("directory", "folder", "regular file"))

    def test_empty_file(self):
        (self.dir / "empty.stl").write_bytes(b"")
        self.refuse_body("empty.stl", "empty")

    def test_text_named_stl(self):
        (self.dir / "letter.stl").write_text("Dear reader,\nthis is not a surface.\n" * 20)
        self.refuse_body("letter.stl")

    def test_text_named_vdb(self):
        (self.dir / "letter.vdb").write_text("Dear reader,\nthis is not a level set.\n" * 20)
        self.refuse_body("letter.vdb")

    def test_random_bytes_as_mesh(self):
        for suffix in (".vtu", ".mesh", ".meshb"):
            name = "noise" + suffix
            (self.dir / name).write_bytes(bytes((i * i * 7 + i * 13) % 251 for i in range(4096)))
            with self.subTest(suffix=suffix):
                self.refuse("score", name, needles=(name,))

    def test_unknown_extension(self):
        shutil.copy(self.sphere, self.dir / "body.step")
        self.refuse("mesh", "body.step", "-o", self.out / "a.vtu", needles=(("body.step", ".step"),))
        self.refuse("mesh", self.sphere, "-o", self.out / "a.xyz", needles=(("a.xyz", ".xyz"),))

    def test_all_degenerate(self):
        points = [(0.1 * i, 0.2 * i, 0.3 * i) for i in range(3)]
        write_stl(self.dir / "flat.stl", [points, [points[0]] * 3, [points[2], points[0], points[1]]])
        for words in (("mesh", "flat.stl", "-o", self.out / "a.vtu"), ("plan", "flat.stl")):
            with self.subTest(command=words[0]):
                self.refuse(*words, needles=("flat.stl", ("degenerate", "without area")))

    def test_no_finite_corner(self):
        nan = float("nan")
        write_stl(self.dir / "nan.stl", [[(nan, 0, 0), (1, nan, 0), (0, 1, nan)]] * 4)
        self.refuse("mesh", "nan.stl", "-o", self.out / "a.vtu", needles=("nan.stl",))

    def test_body_outside_domain(self):
        self.refuse_mesh("--domain", 10, 10, 10, 12, 12, 12, needles=("domain",))

    def test_inverted_domain(self):
        self.refuse_mesh("--domain", 2, 2, 2, -2, -2, -2, needles=("domain",))

    def test_hmin_above_h2(self):
        self.refuse_mesh("--hmin", 0.2, "--h2", 0.1, "--h1", 0.5, needles=("0.2", "0.1"))

    def test_h2_above_h1(self):
        self.refuse_mesh("--hmin", 0.01, "--h2", 0.7, "--h1", 0.5, needles=("0.7", "0.5"))

    def test_numbers_out_of_range(self):
        for flag in ("--hmin", "--h2", "--h1", "--voxel", "--length", "--yplus", "--delta"):
            for value in ("-0.5", "0", "nan", "inf", "1e-400", "abc", ""):
                if (flag, value) == ("--voxel", "0"):
                    continue  # means: choose one
                with self.subTest(flag=flag, value=value):
                    self.refuse_mesh(f"{flag}={value}", needles=(flag,))
        for flag, value in (("--growth", "1"), ("--growth", "-1.2"), ("--layers", "0"), ("--layers", "-3"),
                            ("--layers", "2.5"), ("--re", "2e9"), ("--re", "-1"), ("--threads", "-2"),
                            ("--regime", "windy"), ("--seed", "magic"), ("--unit", "parsec")):
            with self.subTest(flag=flag, value=value):
                self.refuse_mesh(f"{flag}={value}", needles=(flag, (value, "2000000000")))

    def test_options_of_the_other_kind_of_body(self):
        self.refuse_mesh("--grid", "surface", needles=("--grid", ".vdb"))
        self.refuse_mesh("--iso", 0.5, needles=("--iso", ".vdb"))
        grid = self.dir / "other.vdb"
        self.run_ok("levelset", self.sphere, "-o", grid)
        for words in (("--voxel", 0.1), ("--sheet",)):
            with self.subTest(words=words):
                self.refuse("mesh", grid, *words, "-o", self.out / "a.vtu", needles=(words[0], "surfaces"))

    def test_painted_sizes(self):
        self.refuse_mesh("--size-grid", "paint", needles=("--size-grid", "FILE.vdb:paint"))
        self.refuse_mesh("--size-grid", "none.vdb:paint", needles=("none.vdb",))
        grid = self.dir / "painted.vdb"
        self.run_ok("levelset", self.sphere, "-o", grid)
        self.refuse_mesh("--size-grid", f"{grid}:paint", needles=("painted.vdb", "'paint'", "'surface'"))
        self.refuse_mesh("--size-grid", f"{grid}:N", needles=("painted.vdb", "'N'", "float"))
        self.refuse_mesh("--size-grid", f"{grid}:surface", needles=("painted.vdb", "'surface'", "length above 0"))

    def test_sizes_of_the_user(self):
        self.refuse_mesh("--box", "wake", 0, 0, 0, 1, 1, needles=("--box", "SIZE"))
        self.refuse_mesh("--box", "wake", 0, 0, 0, 1, 1, "x", 0.1, needles=("wake", "SIZE"))
        self.refuse_mesh("--box", "wake", 1, 0, 0, 0, 1, 1, 0.1, needles=("wake", "lower corner first"))
        self.refuse_mesh("--wall", "ground", needles=("--wall", "ground", "z-"))
        self.refuse_mesh("--chord", "long", needles=("--chord", "long"))
        self.refuse_mesh("--target-cells", 0, needles=("--target-cells",))
        self.refuse_mesh("--metric", "none.meshb", needles=("none.meshb",))
        mesh = self.dir / "bare.mesh"
        mesh.write_text("MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
                        "Tetrahedra\n1\n1 2 3 4 0\nEnd\n")
        self.refuse_mesh("--metric", mesh, needles=("bare.mesh", "no metric"))

    def test_view_of_the_other_kind(self):
        for words in (("--plane", "y=0"), ("--window", 0, 0, 1, 1), ("--layer-top", 0.1)):
            with self.subTest(words=words):
                self.refuse("view", self.sphere, *words, "-o", self.out / "a.png", needles=(words[0], "body"))
        mesh = self.dir / "m.mesh"
        mesh.write_text("MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 0\n1 0 0\n0 1 0\n"
                        "Triangles\n1\n1 2 3 0\nEnd\n")
        for words in (("--from", 0, 0), ("--up", "x"), ("--zoom", 2), ("--unit", "mm"), ("--look-at", 0, 0, 0)):
            with self.subTest(words=words):
                self.refuse("view", mesh, *words, "-o", self.out / "a.png", needles=("a mesh is drawn as a slice",))
        for words in (("--up", "w"), ("--from", "a", 0), ("--from", 0, 95), ("--zoom", 0), ("--color", "curvatur")):
            with self.subTest(words=words):
                self.refuse("view", self.sphere, *words, "-o", self.out / "a.png",
                            needles=((words[0].strip("-"), "elevation"),))

    def test_unknown_option(self):
        self.refuse_mesh("--hmim", 0.1, needles=("--hmim",))
        self.refuse("frobnicate", needles=("frobnicate",))

    def test_missing_words(self):
        self.refuse("mesh", "-o", self.out / "a.vtu", needles=(("BODY", "body"),))
        self.refuse("mesh", self.sphere, needles=("-o",))
        self.refuse("mesh", self.sphere, "--hmin", needles=("--hmin",))
        self.refuse("mesh", self.sphere, "--domain", 0, 0, 0, needles=("--domain",))

    def test_unknown_shape(self):
        self.refuse("sample", "teapot", "-o", self.out / "a.stl", needles=("teapot", "sphere"))

    def test_bad_case_file(self):
        (self.dir / "a.toml").write_text("[sizes]\nh2 = 0.1\nh3 = 0.5\n")
        self.refuse("mesh", "--case", "a.toml", "-o", self.out / "a.vtu", needles=("a.toml", "h3", "3"))
        (self.dir / "b.toml").write_text("[sizes\nh2 = 0.1\n")
        self.refuse("mesh", "--case", "b.toml", "-o", self.out / "a.vtu", needles=("b.toml", ("1", "2")))
        self.refuse("mesh", "--case", "no_such_case.toml", needles=("no_such_case.toml",))

    def test_missing_output_folder(self):
        self.refuse("mesh", self.sphere, "-o", self.dir / "nowhere" / "a.vtu", *COARSE, needles=("nowhere",))

    def test_output_is_a_folder(self):
        (self.dir / "taken.vtu").mkdir()
        self.refuse("mesh", self.sphere, "-o", self.dir / "taken.vtu", *COARSE, needles=("taken.vtu",))

    def test_unwritable_folder(self):
        locked = self.dir / "locked"
        locked.mkdir()
        locked.chmod(0o555)
        self.addCleanup(locked.chmod, 0o755)
        if os.access(locked, os.W_OK):
            # Rights do not bind root; a file system that takes no files does.
            locked = Path("/proc/self")
        self.refuse("mesh", self.sphere, "-o", locked / "a.vtu", *COARSE, needles=(str(locked / "a.vtu"),))

    def test_side_outputs_are_checked_before_the_run(self):
        for flag, name in (("--report", "r.json"), ("--picture", "p.png")):
            with self.subTest(flag=flag):
                self.refuse_mesh(*COARSE, flag, self.dir / "nowhere" / name, needles=("nowhere",))


class FullDisk(Case):
    """Outputs on a file system that is too small for them."""

    def setUp(self):
        super().setUp()
        self.disk = Path(tempfile.mkdtemp(prefix="lamina-disk-"))
        self.addCleanup(shutil.rmtree, self.disk, True)
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", self.disk], capture_output=True,
                                 text=True, check=False)
        if mounted.returncode:
            self.skipTest(f"a tmpfs cannot be mounted here: {mounted.stderr.strip()}")
        self.addCleanup(subprocess.run, ["umount", self.disk], check=True)

    def refuse(self, *words, name):
        done = lamina(*words)
        self.assert_one_error(done, BAD_INPUT, name)
        self.assertEqual(self.entries(self.disk), [], "a partial file stayed on the full disk")

    def test_mesh(self):
        sphere = self.sample("sphere")
        for name in ("a.vtu", "a.mesh", "a.meshb"):
            with self.subTest(name=name):
                self.refuse("mesh", sphere, "-o", self.disk / name, *COARSE, "--quiet", name=name)

    def test_levelset(self):
        sphere = self.sample("sphere")
        self.refuse("levelset", sphere, "-o", self.disk / "a.vdb", "--voxel", "0.02", name="a.vdb")

    def test_sample(self):
        self.refuse("sample", "sphere", "-o", self.disk / "a.stl", "--facet", "0.02", name="a.stl")

    def test_old_file_survives(self):
        sphere = self.sample("sphere")
        old = self.disk / "a.vtu"
        old.write_text("precious")
        done = lamina("mesh", sphere, "-o", old, *COARSE, "--quiet")
        self.assert_one_error(done, BAD_INPUT, "a.vtu")
        self.assertEqual(old.read_text(), "precious")
        self.assertEqual(self.entries(self.disk), ["a.vtu"])


if __name__ == "__main__":
    support.main()
