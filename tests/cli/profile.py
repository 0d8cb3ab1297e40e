"""Two dimensions: the paper's cases through the program, judged by bounds in metric space that are requirements."""
import json

import support
from support import ASSETS, BAD_INPUT, Case, lamina


class Profile(Case):
    def run_case(self, name, file, *flags):
        self.run_ok("sample", name, "-o", self.dir / file)
        self.run_ok("mesh", "--case", ASSETS / "cases" / f"{name}.toml", *flags, cwd=self.dir)
        told = support.read_json(self.dir / f"{name}.json")
        self.assertTrue(told["validation"]["valid"])
        self.assertLess(told["validation"]["volume_error"], 1e-10)
        return told

    def judge(self, told, unit, worst, mean):
        score = told["score"]
        self.assertGreaterEqual(score["unit_share"], unit)
        self.assertGreaterEqual(score["quality"]["min"], worst)
        self.assertGreaterEqual(score["quality"]["mean"], mean)

    def test_plate(self):
        self.judge(self.run_case("plate", "plate.csv"), 0.99, 0.4, 0.93)

    def test_square(self):
        self.judge(self.run_case("square", "square.csv"), 0.99, 0.4, 0.93)

    def test_circle(self):
        # 99 % and .93 are wanted; apps/README.md tells what stands in the way.
        self.judge(self.run_case("circle", "circle.dat"), 0.97, 0.4, 0.90)

    def test_naca0012(self):
        self.judge(self.run_case("naca0012", "naca0012.dat", "--align", "none"), 0.985, 0.3, 0.9)

    def test_gaps_between_three_curves(self):
        self.judge(self.run_case("highlift", "highlift.dat"), 0.985, 0.3, 0.9)

    def test_the_same_bits_for_every_thread_count(self):
        hashes = {self.run_case("square", "square.csv", "--threads", n)["mesh_hash"] for n in (1, 2, 3, 8)}
        self.assertEqual(len(hashes), 1)

    def test_extruded_mesh_is_valid_in_space(self):
        self.run_ok("sample", "square", "-o", self.dir / "s.csv")
        self.run_ok("mesh", self.dir / "s.csv", "--hmin", 1e-2, "--layers", 4, "--extrude", 0.1, "-o",
                    self.dir / "e.vtu")
        told = json.loads(self.run_ok("info", self.dir / "e.vtu", "--json"))
        self.assertEqual(told["dimension"], 3)
        self.assertTrue(told["validation"]["valid"])

    def test_section_of_a_body(self):
        body = self.sample("cylinder")
        self.run_ok("mesh", body, "--slice", "z=0", "--hmin", 1e-2, "--layers", 4, "-o", self.dir / "c.vtu")
        self.assertEqual(json.loads(self.run_ok("info", self.dir / "c.vtu", "--json"))["dimension"], 2)
        missed = lamina("mesh", body, "--slice", "z=1e3", "-o", self.dir / "d.vtu")
        self.assert_one_error(missed, BAD_INPUT, "misses the body")

    def test_bad_profiles_say_what_to_do(self):
        for text, flags, words in (("t\n1 0\n.5 0.o5\n", (), "a.dat:3:"),
                                   ("t\n1 0\n.5 .1\n0 0\n.5 -.1\n1 0\n", ("--domain", 0, 0, 0, 1, 1, 1), "x0 y0 x1 y1"),
                                   ("t\n1 0\n.5 .1\n0 0\n.5 -.1\n1 0\n", ("--wall", "z-"), "--wall z-"),
                                   ("t\n1 0\n.5 .1\n0 0\n.5 -.1\n1 0\n", ("--sheet",), "--sheet"),
                                   ("t\n1 0\n.5 .1\n0 0\n.5 -.1\n1 0\n", ("--slice", "z=0"), "--slice"),
                                   ("t\n1 0\n.5 .1\n.2 .1\n0 0\n", (), "does not close")):
            (self.dir / "a.dat").write_text(text, encoding="utf-8")
            done = lamina("mesh", self.dir / "a.dat", "-o", self.dir / "a.vtu", *flags)
            self.assert_one_error(done, BAD_INPUT, words)
            self.assertEqual(self.entries(), ["a.dat"])


if __name__ == "__main__":
    support.main()
