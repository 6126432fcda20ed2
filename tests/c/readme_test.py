"""README.md is true: every command in it runs, in its order and in one folder, and so does its program in Python.

usage: readme_test.py FOLDER BUILD

The folder gets links to what a checkout has after `make native`. `make` and `cc` lines are of the build and of the test readme_snippet; their
targets must exist. A browser is replaced by a program that does nothing.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def library(build):
    return next(path for path in sorted((build / "lib").iterdir()) if path.name in ("libshellwarp.so", "libshellwarp.dylib"))


def has_numpy(python):
    return Path(python).exists() and subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0


def main():
    folder, build = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "bin").mkdir(parents=True)
    for name in ("xdg-open", "open"):
        (folder / "bin" / name).write_text("#!/bin/sh\ntest -s \"$1\"\n", encoding="utf-8")
        (folder / "bin" / name).chmod(0o755)
    for name in ("include", "host_examples", "tests"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "build").symlink_to(build)
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "TMPDIR": str(folder),
                   "PYTHONPATH": str(ROOT / "host_examples" / "python"), "SHELLWARP_LIBRARY": str(library(build))}
    outside = re.sub(r"^```.*?^```", "", page, flags=re.S | re.M)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    ran = 0
    for line in re.findall(r"^    (\S.*)$", outside, re.M):
        words = line.split()
        if words[0] == "make":
            assert words[1] in targets, line
            continue
        if words[0] == "cc":
            continue
        done = subprocess.run(line, shell=True, cwd=folder, env=environment, capture_output=True, text=True)
        print(f"$ {line}\n{done.stdout[-600:]}{done.stderr[-300:]}")
        assert done.returncode == 0, line
        assert "--view" not in line or "page: " in done.stdout, line
        # The first motion that a reader sees is neither too small to see nor wild.
        assert "cannot be seen" not in done.stdout and "no held shell" not in done.stdout, line
        ran += 1
    assert ran >= 4, ran
    program = re.search(r"^```python\n(.*?)^```", page, re.S | re.M).group(1)
    pythons = [python for python in (str(ROOT / ".venv" / "bin" / "python"), sys.executable) if has_numpy(python)]
    if not pythons:
        print("skipped: the program in Python, which needs numpy")
        return
    done = subprocess.run([pythons[0], "-c", program], cwd=folder, env=environment, capture_output=True, text=True)
    print(done.stdout, done.stderr)
    hangs, off = map(float, re.search(r"hangs ([\d.]+) cm low, off by ([\d.e-]+)", done.stdout).groups())
    assert done.returncode == 0 and 0.1 < hangs < 12 and off < 0.2, done.stdout   # within the leaf's length and the certificate's range


if __name__ == "__main__":
    main()
