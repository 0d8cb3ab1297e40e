"""`lamina adapt`: what it writes, how it fails, and that a mesh scores by its files as by its formula."""
import json

import support
from support import BAD_INPUT, DONE, MISSED, Case, lamina, read_json

THIN = "tilted-plane:hmin=0.02,ht=0.25"


class Adapt(Case):
    def adapt(self, *words):
        done = lamina("adapt", *words)
        self.assertIn(done.returncode, (DONE, MISSED), done.stderr)
        return done

    def test_formula_without_a_mesh(self):
        mesh, metric, report = self.dir / "a.meshb", self.dir / "a.solb", self.dir / "a.json"
        done = self.adapt("--analytic", THIN, "-o", mesh, "-o", self.dir / "a.vtu", "--metric-out", metric,
                          "--report", report)
        self.assertEqual(self.entries(), ["a.json", "a.meshb", "a.solb", "a.vtu"])
        self.assertIn("unit edges", done.stdout)
        told = read_json(report)
        self.assertTrue(told["validation"]["valid"])
        self.assertEqual(told["metric"]["analytic"], THIN)
        scores = [json.loads(self.run_ok("score", *words, "--json"))["score"]
                  for words in ((mesh, "--metric", metric), (mesh, "--analytic", THIN), (self.dir / "a.vtu",))]
        for score in scores:
            self.assertEqual(score["cells"], told["cells"])
            for key in ("unit_share", "complexity"):
                self.assertAlmostEqual(score[key], told["score"][key], delta=1e-6 * told["score"][key])
            self.assertAlmostEqual(score["quality"]["min"], told["score"]["quality"]["min"], places=6)
        self.assertGreater(scores[0]["unit_share"], 0.95)

    def test_metric_of_files(self):
        first, metric = self.dir / "a.mesh", self.dir / "a.sol"
        self.adapt("--analytic", THIN, "-o", first, "--metric-out", metric, "-q")
        for number, words in enumerate((("--metric", metric), ("--metric", first), ())):
            out = self.dir / f"b{number}.meshb"
            self.adapt(first, *words, "-o", out, "-q")
        texts = {(self.dir / f"b{number}.meshb").read_bytes() for number in range(3)}
        self.assertEqual(len(texts), 1, "three ways to name one metric")

    def test_limits_and_complexity(self):
        out = self.dir / "a.vtu"
        for words, least, most in ((("--hmin", 0.1), 60, 700), (("--hmax", 0.08), 1953, 8000),
                                   (("--complexity", 500), 480, 520)):
            with self.subTest(words=words):
                self.adapt("--analytic", THIN, "-o", out, "-q", *words)
                complexity = json.loads(self.run_ok("score", out, "--json"))["score"]["complexity"]
                self.assertGreater(complexity, least)
                self.assertLess(complexity, most)

    def test_gradation(self):
        """A sharp cube, whose sizes jump at its edges: with a bound more cells, better ones."""
        scores = []
        for words in ((), ("--gradation", 1.5)):
            out = self.dir / "a.vtu"
            self.adapt("--analytic", "cube:hmin=0.01,H2=0.2", "-o", out, "-q", *words)
            scores.append(json.loads(self.run_ok("score", out, "--json"))["score"])
            self.adapt(out, "-o", self.dir / "b.vtu", "-q", *words)
        plain, graded = scores
        self.assertGreater(graded["cells"], plain["cells"])
        self.assertGreater(graded["unit_share"], plain["unit_share"])
        self.assertGreater(graded["quality"]["mean"], plain["quality"]["mean"])

    def test_threads_do_not_matter(self):
        for threads in (1, 3):
            self.adapt("--analytic", THIN, "-o", self.dir / f"{threads}.meshb", "--threads", threads, "-q")
        self.assertEqual((self.dir / "1.meshb").read_bytes(), (self.dir / "3.meshb").read_bytes())

    def test_two_dimensions(self):
        out = self.dir / "a.meshb"
        self.adapt("--analytic", "circle-bl:hmin=5e-3", "-o", out, "-q")
        self.assertEqual(json.loads(self.run_ok("score", out, "--json"))["dimension"], 2)

    def test_bad_input(self):
        out = ("-o", self.dir / "a.meshb")
        mesh = self.dir / "plain.meshb"
        self.adapt("--analytic", "iso:h=0.5", "-o", mesh, "-q")
        for words, *needles in (
                (("--analytic", "kube", *out), "kube", "known are", "tilted-plane"),
                (("--analytic", "cube:H=1", *out), "H", "half, hmin, H2, growth"),
                (("--analytic", "cube:hmin=thin", *out), "hmin", "not a number"),
                (("--analytic", "iso", "--metric", mesh, *out), "--metric"),
                (("--analytic", "iso"), "-o"),
                (out, "no mesh"),
                ((self.dir / "none.meshb", "--analytic", "iso", *out), "none.meshb"),
                (("--analytic", "iso", "--hmin", 2, "--hmax", 1, *out), "--hmax"),
                (("--analytic", "iso", "--gradation", 1, *out), "--gradation", "(1, 4]"),
                (("--analytic", "iso", "--hmin", -1, *out), "--hmin"),
                (("--analytic", "iso", "-o", self.dir / "a.stl"), "a.stl", ".meshb"),
                ((mesh, "--analytic", "iso", "-o", mesh), "overwrite")):
            with self.subTest(words=words):
                self.assert_one_error(lamina("adapt", *words, "-q"), BAD_INPUT, *needles)
        self.assert_one_error(lamina("adapt", mesh, *out, "-q"), BAD_INPUT, "no metric")
        self.assert_one_error(lamina("adapt", mesh, "--analytic", "circle-bl", *out, "-q"), BAD_INPUT, "2-dimensional")
        self.assertEqual(self.entries(), ["plain.meshb"])

    def test_suite(self):
        report = self.dir / "suite.json"
        done = lamina("bench", "--suite", "adapt", "--case", "circle-bl", "--json", report, "-q")
        row, = read_json(report)["cases"]
        self.assertEqual(done.returncode, MISSED if row["missed"] else DONE, done.stderr)
        self.assertEqual(row["unit_share"] < row["targets"]["unit_share"], "unit share" in row["missed"])
        self.assertEqual(row["user_seconds"] > row["targets"]["user_seconds"], "seconds" in row["missed"])
        header, line = done.stdout.splitlines()
        self.assertRegex(header, r"case +cells +unit % +Qmin +Qmean +user s +wall s +peak MiB")
        self.assertEqual(line.split()[:2], ["circle-bl", str(row["cells"])])
        self.assertEqual(line.count("!"), len(row["missed"]))
        for words, *needles in ((("--case", "circle"), "--case", "known are", "circle-bl"), (("body.stl",), "body.stl"),
                                (("--csv", self.dir / "a.csv"), "--csv")):
            self.assert_one_error(lamina("bench", "--suite", "adapt", *words), BAD_INPUT, *needles)
        self.assert_one_error(lamina("bench", "--suite", "mesh"), BAD_INPUT, "--suite", "adapt")
        self.assert_one_error(lamina("bench", "--large"), BAD_INPUT, "--suite")
        self.assertEqual(self.entries(), ["suite.json"])

    def test_layers(self):
        mesh, report = self.dir / "a.meshb", self.dir / "a.json"
        metric = "circle-bl:hmin=0.01,H2=0.1"
        told = {}
        for align in ("none", "layers"):
            self.adapt("--analytic", metric, "--align", align, "-o", mesh, "--report", report, "-q")
            told[align] = read_json(report)["levels"]
            self.assertEqual(json.loads(self.run_ok("score", mesh, "--analytic", metric, "--json"))["levels"], told[align])
        # Anywhere is a quarter of a layer away; the circle has 1.88 / sqrt(2 R hmin) = 24 points.
        self.assertAlmostEqual(told["none"]["mean_offset"], 0.25, delta=0.05)
        self.assertLess(told["layers"]["mean_offset"], 0.05)
        self.assertAlmostEqual(told["layers"]["ideal_on_wall"], 1.885 / 0.0781, delta=0.5)
        self.assertGreater(told["layers"]["on_wall"], 0.8 * told["layers"]["ideal_on_wall"])
        self.assertGreater(told["layers"]["aligned_of_ideal"], 0.75)
        self.assertGreater(told["layers"]["aligned_of_ideal"], 1.25 * told["none"]["aligned_of_ideal"])
        for metric in (("--analytic", "iso"), ("--metric", mesh)):
            self.assert_one_error(lamina("adapt", mesh, *metric, "--align", "layers", "-o", self.dir / "b.meshb", "-q"),
                                  BAD_INPUT, "--align layers", "-bl")

    def test_score_by_the_body(self):
        body, mesh = self.sample("sphere"), self.dir / "a.vtu"
        self.run_ok("mesh", body, *support.COARSE, "-o", mesh, "--report", self.dir / "a.json", "-q")
        told = read_json(self.dir / "a.json")
        score = json.loads(self.run_ok("score", mesh, "--case", self.dir / "a.case.toml", "--json"))
        self.assertEqual(score["wall"], told["wall"])
        # On a level the optimizer has the metric of the level itself: another rounding.
        for key, value in told["levels"].items():
            self.assertAlmostEqual(score["levels"][key], value, delta=0.01 * value, msg=key)
        self.assertEqual(score["wall"]["straddling_cells"], 0)
        # Another body in the same mesh: its wall is not there.
        small = self.dir / "small.stl"
        self.run_ok("sample", "cube", "-o", small)
        score = json.loads(self.run_ok("score", mesh, "--case", self.dir / "a.case.toml", "--body", small, "--json"))
        self.assertGreater(score["wall"]["anywhere"]["largest"], 0.05)
        self.assert_one_error(lamina("score", mesh, "--case", self.dir / "a.case.toml", "--analytic", "iso"), BAD_INPUT,
                              "--analytic")

    def test_scores_side_by_side(self):
        """Each column says what the mesh's own score says; the picture has its name's format."""
        meshes = [self.dir / "a.meshb", self.dir / "b.meshb"]
        metrics = [self.dir / "a.sol", self.dir / "b.sol"]
        for mesh, metric, h in zip(meshes, metrics, (0.5, 0.25)):
            self.adapt("--analytic", f"iso:h={h}", "-o", mesh, "--metric-out", metric, "-q")
        both = json.loads(self.run_ok("score", "--compare", *meshes, "--metric", metrics[0], "--metric", metrics[1],
                                      "--json"))["meshes"]
        alone = [json.loads(self.run_ok("score", mesh, "--metric", metric, "--json"))
                 for mesh, metric in zip(meshes, metrics)]
        self.assertEqual(both, alone)
        # Without --metric: the tensors beside each.
        lines = self.run_ok("score", *meshes, "--compare", "--picture", self.dir / "p.png").splitlines()
        cells = next(line.split() for line in lines if line.startswith("cells"))
        self.assertEqual(cells[1:], [str(s["score"]["cells"]) for s in alone])
        unit = next(line.split() for line in lines if line.startswith("unit edges"))
        self.assertEqual([unit[2], unit[4]], [f"{100 * s['score']['unit_share']:.2f}" for s in alone])
        self.run_ok("score", meshes[0], "--picture", self.dir / "p.svg")
        self.assertTrue((self.dir / "p.png").read_bytes().startswith(b"\x89PNG"))
        self.assertIn("<svg", (self.dir / "p.svg").read_text(encoding="utf-8"))
        for words, *needles in ((meshes, "--compare"), ((meshes[0], "--compare"), "two meshes"),
                                ((meshes[0], "--metric", metrics[0], "--metric", metrics[1]), "more metrics"),
                                ((meshes[0], "--picture", self.dir / "p.jpg"), "p.jpg", ".png"),
                                ((meshes[0], "--picture", meshes[0]), ".png")):
            self.assert_one_error(lamina("score", *words), BAD_INPUT, *needles)

    def test_score_takes_one_metric(self):
        mesh = self.dir / "a.meshb"
        self.adapt("--analytic", "iso:h=0.5", "-o", mesh, "-q")
        self.assert_one_error(lamina("score", mesh, "--analytic", "kube"), BAD_INPUT, "kube")
        self.assertIn("iso:h=0.5", self.run_ok("score", mesh, "--analytic", "iso:h=0.5"))


if __name__ == "__main__":
    support.main()
