"""Rules of the source tree: lint.py RULE ROOT, with RULE one of layering, text, size, citations, examples.

layering  a third-party header is included by one place only; arrows point core <- vdb, core <- mesh
text      no unfinished-work marks, no paths of one machine, no tabs or trailing blanks
size      no source file above 600 lines
citations every key cited as [Key2000] stands in assets/papers/references.bib
examples  every C++ block of a README is part of a source under tests/, which compiles and runs it

Prints one `file:line: what is wrong` per finding and exits with 1 if there is any.
"""
import re
import sys
from pathlib import Path

FOLDERS = ("core", "vdb", "mesh", "apps", "tests")
SOURCES = (".h", ".cpp")
TEXTS = SOURCES + (".py", ".sh", ".txt", ".cmake", ".in", ".toml", ".md", ".bib")
MAX_LINES = 600

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')

# (pattern of the included path, pattern of the files that may include it, rule in words)
EXCLUSIVE = (
    (r"(openvdb|nanovdb)/.*", r"(tests/)?vdb/[^/]+\.cpp|(tests/)?vdb/detail/[^/]+\.(h|cpp)",
     "OpenVDB belongs to vdb/*.cpp and vdb/detail/"),
    (r"(tbb|oneapi/tbb)/.*", r"core/parallel\.cpp", "TBB belongs to core/parallel.cpp"),
    (r"hdf5\.h", r"mesh/io/hdf5_file\.cpp", "HDF5 belongs to mesh/io/hdf5_file.cpp"),
    (r"cgnslib\.h", r"mesh/io/cgns\.cpp", "CGNS belongs to mesh/io/cgns.cpp"),
    (r"tetgen\.h", r"mesh/seed/tetgen\.cpp", "TetGen belongs to mesh/seed/tetgen.cpp"),
)
# (pattern of the including file, pattern of the included path, rule in words)
FORBIDDEN = (
    (r"core/.*", r"(vdb|mesh|apps)/.*", "core includes nothing above it"),
    (r"vdb/.*", r"(mesh|apps)/.*", "vdb sees core only"),
    (r"mesh/.*", r"(vdb|apps)/.*", "mesh sees core only"),
    (r"apps/pipeline/.*", r"apps/cli/.*", "the pipeline does not know the command line"),
    (r"apps/.*", r"(core|vdb|mesh)/[^/]+/.*", "one folder deeper is private to its library"),
    (r"vdb/.*", r"core/[^/]+/.*", "one folder deeper is private to its library"),
    (r"mesh/.*", r"core/[^/]+/.*", "one folder deeper is private to its library"),
)
# Spelled in pieces, so that this file does not break its own rule.
MARKS = re.compile(r"\b(" + "|".join(("TO" "DO", "FIX" "ME", "XX" "X", "HA" "CK")) + r")\b")
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:" + "|".join(("work", "farm", "home/[a-z]+", "root")) + r")/")

KEY = re.compile(r"^@\w+\{(\w+),", re.MULTILINE)
CPP_BLOCK = re.compile(r"^```cpp\n(.*?)^```", re.MULTILINE | re.DOTALL)
CITED = re.compile(r"\[([A-Z][A-Za-z]+(?:19|20)\d\d)\b")


def files_of(root, suffixes):
    """Files of the source folders and of the top level, relative to root, in a fixed order."""
    found = [p for folder in FOLDERS for p in (root / folder).rglob("*") if p.is_file()]
    found += [p for p in root.iterdir() if p.is_file()]
    found += [p for p in (root / "assets").rglob("*") if p.is_file()]
    return sorted(p.relative_to(root) for p in found if p.suffix in suffixes and "__pycache__" not in p.parts)


def lines_of(root, path):
    return (root / path).read_text(encoding="utf-8", errors="replace").splitlines()


def layering(root):
    for path in files_of(root, SOURCES):
        name = path.as_posix()
        for number, line in enumerate(lines_of(root, path), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            included = match.group(2)
            for target, allowed, words in EXCLUSIVE:
                if re.fullmatch(target, included) and not re.fullmatch(allowed, name):
                    yield f"{name}:{number}: includes {included}: {words}"
            for source, target, words in FORBIDDEN:
                if re.fullmatch(source, name) and re.fullmatch(target, included):
                    yield f"{name}:{number}: includes {included}: {words}"


def text(root):
    for path in files_of(root, TEXTS):
        for number, line in enumerate(lines_of(root, path), 1):
            where = f"{path.as_posix()}:{number}"
            if MARKS.search(line):
                yield f"{where}: a mark of unfinished work: file an issue or do it"
            if MACHINE_PATH.search(line):
                yield f"{where}: a path of one machine"
            if path.suffix in SOURCES and ("\t" in line or line != line.rstrip()):
                yield f"{where}: tab or trailing blank"


def size(root):
    for path in files_of(root, SOURCES + (".py",)):
        count = len(lines_of(root, path))
        if count > MAX_LINES:
            yield f"{path.as_posix()}:{count}: longer than {MAX_LINES} lines"


def citations(root):
    known = set(KEY.findall((root / "assets/papers/references.bib").read_text(encoding="utf-8")))
    for path in files_of(root, SOURCES + (".md",)):
        for number, line in enumerate(lines_of(root, path), 1):
            for key in CITED.findall(line):
                if key not in known:
                    yield f"{path.as_posix()}:{number}: cites {key}, which is not in references.bib"


def examples(root):
    tested = [(root / path).read_text(encoding="utf-8") for path in files_of(root, (".cpp",)) if path.parts[0] == "tests"]
    for path in files_of(root, (".md",)):
        content = (root / path).read_text(encoding="utf-8")
        for block in CPP_BLOCK.finditer(content):
            if not any(block.group(1) in source for source in tested):
                line = content.count("\n", 0, block.start()) + 1
                yield f"{path.as_posix()}:{line}: an example that no source under tests/ holds"


RULES = {"layering": layering, "text": text, "size": size, "citations": citations, "examples": examples}


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in RULES:
        sys.exit(__doc__)
    findings = list(RULES[sys.argv[1]](Path(sys.argv[2])))
    print("\n".join(findings) if findings else "clean")
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
