"""Runs clang-tidy over the compile database: tidy.py CLANG_TIDY SOURCE_DIR BUILD_DIR. One worker per processor."""
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def check(tidy, build, source):
    # Flags that GCC knows and clang does not are no findings.
    command = [tidy, "-p", str(build), "--quiet", "--extra-arg=-Wno-unknown-warning-option", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def main():
    tidy, root, build = sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
    database = json.loads((build / "compile_commands.json").read_text())
    files = sorted({Path(entry["file"]).resolve() for entry in database})
    ours = [f for f in files if re.match(r"(core|vdb|mesh|apps)/", str(f.relative_to(root)) if root in f.parents else "")]
    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for code, output in pool.map(lambda f: check(tidy, build, f), ours):
            if code:
                failed += 1
                print(output)
    print(f"{len(ours)} files, {failed} with findings")
    sys.exit(1 if failed or not ours else 0)


if __name__ == "__main__":
    main()
