"""The lint rules find what they forbid and leave alone what they allow."""
import tempfile
import unittest
from pathlib import Path

import lint


class Rules(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = Path(self.folder.name)
        (self.root / "assets").mkdir()

    def tearDown(self):
        self.folder.cleanup()

    def findings(self, rule, name, content):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
        found = list(lint.RULES[rule](self.root))
        path.unlink()
        return found

    def test_third_party_headers_have_one_place(self):
        cases = (
            ("mesh/a.cpp", "#include <openvdb/openvdb.h>", 1),
            ("vdb/a.h", "#include <openvdb/openvdb.h>", 1),
            ("vdb/a.cpp", "#include <openvdb/openvdb.h>", 0),
            ("vdb/detail/a.h", "#include <openvdb/openvdb.h>", 0),
            ("core/metric.cpp", "#include <tbb/parallel_for.h>", 1),
            ("core/parallel.cpp", "#include <tbb/parallel_for.h>", 0),
            ("mesh/adapt/a.cpp", "#  include <oneapi/tbb/parallel_for.h>", 1),
            ("mesh/seed.cpp", "#include <tetgen.h>", 1),
            ("mesh/seed/tetgen.cpp", "#include <tetgen.h>", 0),
        )
        for name, line, count in cases:
            with self.subTest(name=name, line=line):
                self.assertEqual(len(self.findings("layering", name, line + "\n")), count)

    def test_arrows_point_one_way(self):
        cases = (
            ("core/a.h", '#include "mesh/mesh.h"', 1),
            ("mesh/a.h", '#include "vdb/surface.h"', 1),
            ("vdb/a.cpp", '#include "mesh/mesh.h"', 1),
            ("mesh/a.h", '#include "core/types.h"', 0),
            ("apps/pipeline/a.cpp", '#include "mesh/mesh.h"', 0),
            ("apps/pipeline/a.cpp", '#include "mesh/adapt/cavity.h"', 1),
            ("mesh/a.cpp", '#include "mesh/adapt/cavity.h"', 0),
            ("mesh/a.cpp", '// "vdb/surface.h" is the other side', 0),
        )
        for name, line, count in cases:
            with self.subTest(name=name, line=line):
                self.assertEqual(len(self.findings("layering", name, line + "\n")), count)

    def test_examples_are_tested(self):
        tested = self.root / "tests/a.cpp"
        tested.parent.mkdir()
        tested.write_text("// one\nint f();\nint g();\n")
        self.assertEqual(self.findings("examples", "README.md", "See\n```cpp\nint f();\n```\n"), [])
        found = self.findings("examples", "vdb/README.md", "See\n\n```cpp\nint h();\n```\n```\nplain\n```\n")
        self.assertEqual(len(found), 1)
        self.assertTrue(found[0].startswith("vdb/README.md:3:"), found)

    def test_text(self):
        self.assertEqual(len(self.findings("text", "core/a.h", "// TO" + "DO later\n")), 1)
        self.assertEqual(len(self.findings("text", "README.md", "see /ho" + "me/someone/data\n")), 1)
        self.assertEqual(len(self.findings("text", "core/a.h", "int a; \n\tint b;\n")), 2)
        self.assertEqual(self.findings("text", "core/a.h", "int network;  // a/wo" + "rk/b\n"), [])

    def test_citations(self):
        bib = self.root / "assets" / "papers" / "references.bib"
        bib.parent.mkdir()
        bib.write_text("@article{Known2000,\n}\n")
        self.assertEqual(self.findings("citations", "core/a.h", "// as [Known2000, eq. 1] has it\n"), [])
        self.assertEqual(len(self.findings("citations", "core/a.h", "// [Unknown1999]\n")), 1)

    def test_size(self):
        self.assertEqual(self.findings("size", "core/a.h", "\n" * 600), [])
        self.assertEqual(len(self.findings("size", "core/a.h", "\n" * 601)), 1)


if __name__ == "__main__":
    unittest.main()
