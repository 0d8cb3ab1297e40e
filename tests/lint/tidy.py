"""Runs clang-tidy over the compile database: tidy.py CLANG_TIDY SOURCE_DIR BUILD_DIR. One worker per processor."""
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


# clang-tidy 14 reports a parameter of a template in fmt's headers, without a place.
PLACELESS = "error: invalid case style for type template parameter 'expr-type'"


def is_finding(line):
    return re.search(r"(^|: )(error|warning): ", line) and not line.startswith(PLACELESS)


def check(tidy, build, source):
    # Flags that GCC knows and clang does not are no findings.
    command = [tidy, "-p", str(build), "--quiet", "--extra-arg=-Wno-unknown-warning-option", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    only_placeless = any(line.startswith(PLACELESS) for line in lines) and not any(map(is_finding, lines))
    failed = done.returncode != 0 and not only_placeless
    return failed, "\n".join(line for line in lines if not line.startswith(PLACELESS))


def main():
    tidy, root, build = sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
    database = json.loads((build / "compile_commands.json").read_text())
    files = sorted({Path(entry["file"]).resolve() for entry in database})
    ours = [f for f in files if re.match(r"(core|vdb|mesh|apps)/", str(f.relative_to(root)) if root in f.parents else "")]
    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for bad, output in pool.map(lambda f: check(tidy, build, f), ours):
            if bad:
                failed += 1
                print(output)
    print(f"{len(ours)} files, {failed} with findings")
    sys.exit(1 if failed or not ours else 0)


if __name__ == "__main__":
    main()
