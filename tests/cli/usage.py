"""Help, version and streams: what a script that calls the program relies on."""
import json

import support
from support import BAD_INPUT, COARSE, Case, lamina, read_json, write_stl

COMMANDS = ("mesh", "plan", "levelset", "adapt", "score", "view", "info", "sample", "convert", "bench")


def box(lo, hi):
    """Facets of an axis-aligned box, outward."""
    corner = [tuple((hi if c >> axis & 1 else lo)[axis] for axis in range(3)) for c in range(8)]
    for a, b, c, d in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)):
        yield [corner[a], corner[b], corner[c]]
        yield [corner[a], corner[c], corner[d]]


class Usage(Case):
    def test_help_of_every_command(self):
        top = self.run_ok("--help")
        for command in COMMANDS:
            with self.subTest(command=command):
                self.assertIn(command, top)
                text = self.run_ok(command, "--help")
                self.assertRegex(text, r"(?i)example")
                self.assertIn(f"lamina {command}", text)

    def test_help_of_mesh_names_units_and_defaults(self):
        text = self.run_ok("mesh", "--help")
        for flag in ("--re", "--length", "--yplus", "--growth", "--regime", "--velocity", "--viscosity", "--hmin",
                     "--delta", "--layers", "--h2", "--h1", "--box2", "--box2-margin", "--domain", "--voxel", "--seed",
                     "--threads", "--case", "--report", "--picture", "--quiet", "--verbose", "--unit"):
            with self.subTest(flag=flag):
                self.assertRegex(text, rf"(?<![\w-]){flag}(?![\w-])")
        self.assertRegex(text, r"(?i)default")

    def test_version(self):
        self.assertRegex(self.run_ok("--version"), r"\d+\.\d+\.\d+")

    def test_no_command(self):
        done = lamina()
        self.assertEqual((done.returncode, done.stdout), (BAD_INPUT, ""))
        self.assertIn("lamina COMMAND --help", done.stderr)

    def test_words_on_stderr_results_on_stdout(self):
        body = self.sample("sphere")
        out = self.dir / "a.vtu"
        done = lamina("mesh", body, "-o", out, *COARSE)
        self.assertIn(done.returncode, (0, 3), done.stderr)
        self.assertTrue(done.stdout.strip(), "a short table goes to stdout")
        self.assertNotIn("\r", done.stderr, "plain lines where stderr is no terminal")
        quiet = lamina("mesh", body, "-o", out, *COARSE, "--quiet")
        self.assertEqual(quiet.stderr, "")

    def test_info_json_of_a_sphere(self):
        info = json.loads(self.run_ok("info", self.sample("sphere"), "--json"))
        self.assertRegex(json.dumps(info), r'"watertight": true')
        self.assertEqual(info["crossings"]["pairs"], 0)
        self.assertTrue(info["crossings"]["complete"])
        self.assertIsNone(info["crossings"]["first"])
        self.assertEqual((info["sharp_edges"], info["corners"]), (0, 0))
        self.assertEqual(info["sag"]["smallest_h_min"], info["facet_sag"])
        self.assertIsNone(info["sag"]["per_h_min"])
        self.assertIn("merged", " ".join(info["repairs"]))
        self.assertEqual(info["warnings"], [])

    def test_info_tells_crossings(self):
        """A bar through a box: 16 pairs of facets, see tests/vdb/intersections_test.cpp."""
        path = self.dir / "boxes.stl"
        write_stl(path, [*box((0, 0, 0), (4, 4, 4)), *box((-1, 1, 1), (5, 3, 3))])
        info = json.loads(self.run_ok("info", path, "--json"))
        self.assertEqual(info["crossings"]["pairs"], 16)
        self.assertIn(info["crossings"]["first"][0], (0, 4))
        self.assertEqual((info["sharp_edges"], info["corners"]), (24, 16))
        self.assertIn("16 pairs of facets that cross or overlap", self.run_ok("info", path))

    def test_info_tells_repairs(self):
        path = self.dir / "turned.stl"
        facets = list(box((0, 0, 0), (1, 1, 1)))
        write_stl(path, [facets[0][::-1], *facets[1:], facets[1], [facets[0][0]] * 3])
        for text in (self.run_ok("info", path), self.run_ok("info", path, "--json")):
            for line in ("34 points merged", "1 triangle dropped: without area", "1 triangle dropped: duplicate",
                         "1 of 12 triangles turned to orient the shells outward: 1 shell in part"):
                self.assertEqual(text.count(line), 1, f"{line} in {text}")

    def test_info_judges_the_first_layer(self):
        body = self.sample("sphere")
        sag = json.loads(self.run_ok("info", body, "--json"))["facet_sag"]
        info = json.loads(self.run_ok("info", body, "--json", "--hmin", sag / 9))
        self.assertAlmostEqual(info["sag"]["per_h_min"], 9.0)
        self.assertIn("layers will follow the facets", info["sag"]["meaning"])
        self.assertIn("(edges shorter by 3)", self.run_ok("info", body, "--hmin", sag / 9))
        self.assertIn("they carry h_min", self.run_ok("info", body, "--hmin", 2 * sag))
        self.assertIn("they carry first layers of h_min >=", self.run_ok("info", body))

    def test_info_of_a_box_carries_every_layer(self):
        write_stl(self.dir / "box.stl", box((0, 0, 0), (1, 1, 1)))
        text = self.run_ok("info", self.dir / "box.stl", "--hmin", 1e-9)
        self.assertIn("first layers of any height", text)

    def test_info_with_units(self):
        path = self.dir / "box.stl"
        write_stl(path, box((0, 0, 0), (4096, 512, 256)))
        info = json.loads(self.run_ok("info", path, "--json"))
        self.assertEqual(info["extent"], 4096)
        self.assertEqual(info["unit_alternatives"], {"mm": 4.096, "cm": 40.96})
        self.assertIn("4.096 m with --unit mm", info["unit_guess"])
        scaled = json.loads(self.run_ok("info", path, "--json", "--unit", "mm"))
        self.assertEqual((scaled["extent"], scaled["unit"]), (4.096, "mm"))
        self.assertNotIn("unit_guess", scaled)

    def test_info_refuses_what_is_for_surfaces(self):
        body, mesh = self.sample("sphere"), self.dir / "a.mesh"
        self.assertIn(lamina("mesh", body, "-o", mesh, *COARSE).returncode, (0, 3))
        for flag in (("--hmin", 1e-3), ("--unit", "mm")):
            with self.subTest(flag=flag[0]):
                self.assert_one_error(lamina("info", mesh, *flag), BAD_INPUT, flag[0], "a.mesh", "surfaces")
        for value in ("0", "-1", "nan", "inf", "thin"):
            with self.subTest(value=value):
                self.assert_one_error(lamina("info", body, "--hmin", value), BAD_INPUT, "--hmin")

    def test_resolved_case_reproduces_the_run(self):
        body = self.sample("sphere")
        first, again = self.dir / "first", self.dir / "again"
        first.mkdir()
        again.mkdir()
        words = ("mesh", body, "-o", first / "a.meshb", "--report", first / "r.json", *COARSE)
        self.assertIn(lamina(*words).returncode, (0, 3))
        self.assertIn("a.case.toml", self.entries(first))
        done = lamina("mesh", "--case", first / "a.case.toml", "-o", again / "a.meshb", "--report", again / "r.json")
        self.assertIn(done.returncode, (0, 3), done.stderr)
        self.assertEqual((first / "a.meshb").read_bytes(), (again / "a.meshb").read_bytes())
        self.assertTrue(read_json(again / "r.json"))


if __name__ == "__main__":
    support.main()
