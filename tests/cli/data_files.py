"""Every body of the data folder through `lamina levelset`: what a sensible tool makes of each is written down here.

The verdicts follow from what is known to be wrong with a file (INDEX.tsv of the data folder), not from what came out:
OK     exit 0 and no warning but the HINTS, which sound bodies may draw as well;
WARN   exit 0 and, for every entry of words, a warning that holds it (a tuple: any of its words);
ERROR  exit 2, one line `lamina: error: ...` that holds the words, nothing left behind.
A file that no table knows fails the test. A file in UNMET is known to miss its verdict, for the reason given; the test
fails once it meets it, so that the entry goes.
"""
import lzma
import resource
import subprocess
import time

import support
from support import BAD_INPUT, DATA, DONE, LAMINA, Case

SECONDS, BYTES = 120, 4 << 30
BODY = "<body>"  # stands for the file's path in messages: names of files hold the words that are looked for
OK, WARN, ERROR = "ok", "warn", "error"
HINTS = ("separate shells", "--unit", "second derivatives are rough")

OPEN = "not closed"
MANY = ("more than two triangles", "non-manifold")
SHELLS = ("overlap", "union", "cross")
TURNED = ("turned", "orient")
SHEET = ("sheet", OPEN)
SHORT = ("cut short", "truncated")
VOID = ("without a whole facet", "no facet", "no triangle", "empty")
FOG = ("--iso", "fog")

AERO = {
    "f1_2026_ccby.stl.xz": (WARN, OPEN, MANY, SHELLS, "duplicate"),
    "f1_torcs_openwheel.stl": (WARN, OPEN, MANY, SHELLS, TURNED),
    "ref_ahmed25_body.stl": (OK,),
    "ref_ahmed25_stilts_overlapping.stl": (WARN, SHELLS),
    "ref_circle_d0p6.stl": (OK,),
    "ref_naca0012_tmr.stl": (OK,),
    "ref_square_0p6.stl": (OK,),
    "turbine_unh_rvat.stl": (WARN, OPEN, SHELLS),
    "wing_HD_airframe_mm.stl": (WARN, OPEN, SHELLS, "--unit mm"),
    "wing_c172_open.stl": (WARN, OPEN, TURNED),
}

ORGANIC = {
    "gears_7comp.stl": (WARN, SHELLS),
    "spot.stl": (OK,),
    "utah_teapot.stl": (WARN, OPEN, SHELLS),
    "vase_thinwall.stl": (OK,),
}

# A grid made from facets is rough, and its reader says that it blurs it; it may say so of others as well.
VDB = {
    "arnold_grids.vdb": (ERROR, "density[0]", "density[2]", ("--grid", *FOG)),
    "arnold_pointgrid.vdb": (ERROR, "points"),
    "arnold_torus01.vdb": (ERROR, "voxel_fog_density", FOG),
    "gaffer_sphere_v223.vdb": (ERROR, "density", FOG),
    "made_bad_magic.vdb": (ERROR, ("not a VDB", "not readable")),
    "made_f1_torcs_levelset.vdb": (WARN, ("rough", "facets")),
    "made_sphere_blosc.vdb": (OK,),
    "made_sphere_fog.vdb": (ERROR, "density", FOG),
    "made_sphere_half.vdb": (OK,),
    "made_sphere_uncompressed.vdb": (OK,),
    "made_truncated.vdb": (ERROR, ("truncated", "cut short")),
    "made_two_levelsets.vdb": (ERROR, "ls_sphere", "second", "--grid"),
    "made_vec_only.vdb": (ERROR, "vel", "vec3s"),
    "openusd_densityAndHeat.vdb": (ERROR, "density", "heat", ("--grid", "--iso")),
    "openusd_smoke_empty.vdb": (ERROR, ("empty", "no active voxel", "holds nothing")),
    "openvdborg_sphere.vdb": (OK,),
    "tinyvdb_sphere-div1.vdb": (ERROR, "density"),
    "zeno_sphere.vdb": (OK,),
}

# Facet normals and names of solids say nothing a body needs: files wrong in them alone are sound.
HOSTILE = {
    "assimp_3dsmax.STL": (WARN, MANY, SHELLS),
    "assimp_empty_solid.stl": (WARN, SHEET),
    "assimp_sphereWithHole.stl": (WARN, OPEN),
    "assimp_two_solids.stl": (WARN, SHEET),
    "npstl_CubeInvalidUnicode.stl": (OK,),
    "npstl_Moon_Chinese.stl": (OK,),
    "stlmodels_empty.stl": (ERROR, "empty"),
    "stlmodels_faceless.ascii.stl": (ERROR, VOID),
    "stlmodels_fourVertices.ascii.stl": (WARN, ("more than three", "four")),
    "stlmodels_incorrectFaceCounter.bin.stl": (WARN, "66"),
    "stlmodels_missingEndsolid.ascii.stl": (WARN, "endsolid"),
    "stlmodels_missingFace.ascii.stl": (WARN, OPEN),
    "stlmodels_missingNormal.ascii.stl": (OK,),
    # Bytes of the facets went through a text codec: sizes and coordinates are noise.
    "stlmodels_multiWordName.bin.stl": (ERROR, ("not finite", "do not fit", "corrupt")),
    "stlmodels_namelessSolid.ascii.stl": (OK,),
    "stlmodels_notANumberNormal.ascii.stl": (OK,),
    "stlmodels_quad.ascii.stl": (WARN, ("more than three", "four")),
    "stlmodels_singleFace.ascii.stl": (WARN, SHEET),
    "stlmodels_solidNameMismatch.ascii.stl": (OK,),
    "stlmodels_twoVertices.ascii.stl": (WARN, ("fewer than three", "two vertices"), OPEN),
    "stlmodels_wrongHeader.bin.stl": (OK,),
    "stlmodels_wrongNormal.ascii.stl": (OK,),
    "stlmodels_wrongNormals.ascii.stl": (OK,),
    "trimesh_empty.stl": (ERROR, VOID),
    "trimesh_featuretype.STL": (WARN, OPEN),
    "trimesh_multibody.stl": (WARN, TURNED),
    "trimesh_octagonal_pocket.stl": (WARN, OPEN),
    "trimesh_origin_inside.STL": (OK,),
    "trimesh_shared.STL": (WARN, MANY),
    "trimesh_soup.stl": (WARN, OPEN),
    "trimesh_stl_empty_bin.stl": (ERROR, VOID),
    "trimesh_two_objects_mixed_case_names.stl": (OK,),
}

MADE = {
    "asc_crlf_tabs_upper.stl": (OK,),
    "asc_cut_in_number.stl": (WARN, SHORT, OPEN),
    "asc_inf_vertex.stl": (WARN, "not finite", OPEN),
    "asc_nan_vertex.stl": (WARN, "not finite", OPEN),
    "asc_no_endsolid.stl": (WARN, "endsolid"),
    "bin_count_ffffffff.stl": (WARN, "4294967295"),
    "bin_count_too_big.stl": (WARN, "5000"),
    "bin_count_too_small.stl": (WARN, "1000"),
    "bin_header_only.stl": (ERROR, VOID),
    "bin_nan_inf.stl": (WARN, "not finite", OPEN),
    "bin_solid_header.stl": (OK,),
    "bin_truncated.stl": (WARN, SHORT, OPEN),
    "cube_huge_1e9.stl": (WARN, "unit"),
    "cube_tiny_1e-9.stl": (WARN, "unit"),
    "cube_zero_area.stl": (WARN, ("without area", "degenerate")),
    "cubes_share_face.stl": (WARN, ("duplicate", "coincide")),
    "cubes_share_vertex.stl": (OK,),
    "empty_0_bytes.stl": (ERROR, "empty"),
    "plate_thin_1e-4.stl": (OK,),
    "sheet_open.stl": (WARN, SHEET),
    "sphere_dup_all.stl": (WARN, "duplicate"),
    "sphere_far_1e7.stl": (WARN, "origin"),
    "sphere_half_flipped.stl": (WARN, TURNED),
    "sphere_in_sphere_shell.stl": (OK,),
    "sphere_inside_out.stl": (WARN, TURNED),
    "sphere_one_missing.stl": (WARN, OPEN),
    "text_not_stl.stl": (ERROR, ("neither", "not an STL")),
    "tiny_40_bytes.stl": (ERROR, ("40 bytes", "too short")),
    "two_spheres_overlap.stl": (WARN, SHELLS),
}

UNMET = {}


def bounded():
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))


class Folder(Case):
    """One folder, without its subfolders, against its table."""
    folder, table = "", {}

    def test_folder(self):
        root = DATA / self.folder
        if not root.is_dir():
            self.skipTest(f"NO REAL INPUTS at {root}: nothing was tested")
        there = sorted(p.name for p in root.iterdir() if p.is_file())
        with self.subTest("every file has a verdict"):
            self.assertEqual([name for name in there if name not in self.table], [])
        for name in sorted(set(self.table) - set(there)):
            print(f"{name}: not there, nothing was tested")
        for name in there:
            if name in self.table:
                with self.subTest(name):
                    self.check(root / name)

    def check(self, path):
        reason = UNMET.get(path.name)
        if reason is None:
            self.judge(path, *self.table[path.name])
            return
        try:
            self.judge(path, *self.table[path.name])
        except AssertionError:
            print(f"UNMET {path.name}: {reason}")
            return
        self.fail(f"{path.name} meets its verdict now: remove it from UNMET")

    def judge(self, path, verdict, *words):
        done, left = self.run_on(path)
        if verdict == ERROR:
            self.assert_one_error(done, BAD_INPUT, BODY, *words)
            self.assertEqual(left, [], "a refused body left files behind")
            return
        self.assertEqual(done.returncode, DONE, done.stderr)
        self.assertEqual(left, ["out.vdb"])
        warnings = [line for line in done.stderr.splitlines() if line.startswith("lamina: warning: ")]
        self.assertNotIn("error", done.stderr.replace("\n".join(warnings), ""))
        if verdict == OK:
            self.assertEqual([w for w in warnings if not any(hint in w for hint in HINTS)], [])
        for entry in words:
            choices = entry if isinstance(entry, tuple) else (entry,)
            self.assertTrue(any(c in w for c in choices for w in warnings), f"none of {choices} in:\n{done.stderr}")

    def run_on(self, path):
        """Runs `lamina levelset` with bounded time and memory; what it printed, and the files it left."""
        if path.suffix == ".xz":
            plain = self.dir / path.stem
            plain.write_bytes(lzma.decompress(path.read_bytes()))
            path = plain
        out = self.dir / "out"
        out.mkdir(exist_ok=True)
        start = time.monotonic()
        try:
            done = subprocess.run([LAMINA, "levelset", path, "-o", out / "out.vdb"], timeout=SECONDS, preexec_fn=bounded,
                                  capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
        except subprocess.TimeoutExpired:
            self.fail(f"no end after {SECONDS} s")
        left = self.entries(out)
        for name in left:
            (out / name).unlink()
        print(f"{path.name}: exit {done.returncode}, {time.monotonic() - start:.1f} s")
        done.stderr = done.stderr.replace(str(path), BODY)
        return done, left


class Aero(Folder):
    folder, table = "aero", AERO


class Organic(Folder):
    folder, table = "organic", ORGANIC


class Vdb(Folder):
    folder, table = "vdb", VDB


class Hostile(Folder):
    folder, table = "hostile", HOSTILE

    def test_no_other_folders(self):
        """Files in a folder that no class walks would go untested."""
        if not DATA.is_dir():
            self.skipTest(f"NO REAL INPUTS at {DATA}: nothing was tested")
        walked = {DATA / folder for folder in ("aero", "organic", "vdb", "hostile", "hostile/made")}
        found = {p.parent for folder in ("aero", "organic", "vdb", "hostile") for p in (DATA / folder).rglob("*")
                 if p.is_file()}
        self.assertEqual(sorted(found - walked), [])


class Made(Folder):
    folder, table = "hostile/made", MADE


# The classes to run; the base class has no folder.
del Folder

if __name__ == "__main__":
    support.main()
