"""Help, version and streams: what a script that calls the program relies on."""
import json

import support
from support import BAD_INPUT, COARSE, Case, lamina, read_json

COMMANDS = ("mesh", "plan", "levelset", "score", "view", "info", "sample", "convert", "bench")


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
