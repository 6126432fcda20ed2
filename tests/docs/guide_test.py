"""The commands of docs/guide and docs/reference that run `shellwarp` do, their scenes are right, and the program of docs/guide/python.md runs.

usage: guide_test.py FOLDER BUILD

In the folder stand what the pages name: `leaf.obj` is the leaf of `new-scene` with a group `stem`, `leaf_cm.obj` the
same in centimetres with y up, `coarse.obj` and `garment.ply` are others. A browser is
replaced by a program that does nothing. Programs in C and C++ are compiled by the tests guide_snippet and docs_cmake.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import scene_schema

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "c"))
from readme_test import has_numpy, library

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*(ROOT / "docs" / "guide").glob("*.md"), *(ROOT / "docs" / "reference").glob("*.md")])
COMMAND = re.compile(r"^    (?:build/bin/)?(shellwarp (?:run|simulate|check|new-scene|proxy) .*)$", re.M)
# A scene's lines: indented or fenced, they begin with a table of the scene file. The farm's lists have tables of their own.
INDENTED = re.compile(r"(?:^    \[.*\n)(?:^(?:    .*)?\n)*", re.M)
FENCED = re.compile(r"^```toml\n(.*?)^```", re.M | re.S)
PROGRAM = re.compile(r"^```python\n(.*?)^```", re.M | re.S)


def prepare(folder, build):
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "bin").mkdir(parents=True)
    for name in ("xdg-open", "open"):
        (folder / "bin" / name).write_text("#!/bin/sh\ntest -s \"$1\"\n", encoding="utf-8")
        (folder / "bin" / name).chmod(0o755)
    (folder / "tests").symlink_to(ROOT / "tests")
    environment = {**os.environ, "PATH": f"{folder / 'bin'}:{build / 'bin'}:{os.environ['PATH']}", "TMPDIR": str(folder),
                   "PYTHONPATH": str(ROOT / "host_examples" / "python"), "SHELLWARP_LIBRARY": str(library(build))}
    subprocess.run(["shellwarp", "new-scene", "leaf.toml"], cwd=folder, env=environment, check=True, capture_output=True)
    leaf = (folder / "leaf.obj").read_text(encoding="utf-8")
    (folder / "coarse.obj").write_text(leaf, encoding="utf-8")
    before, first, rest = leaf.partition("\nf ")
    stem, others = (first + rest).strip("\n").split("\n")[:20], (first + rest).strip("\n").split("\n")[20:]
    (folder / "leaf.obj").write_text("\n".join([before, "g stem", *stem, "g blade", *others, ""]), encoding="utf-8")
    turned = re.sub(r"^v (\S+) (\S+) (\S+)$", lambda m: f"v {100 * float(m[1])} {100 * float(m[3])} {-100 * float(m[2])}",
                    (folder / "leaf.obj").read_text(encoding="utf-8"), flags=re.M)
    (folder / "leaf_cm.obj").write_text(turned, encoding="utf-8")
    shutil.copy(ROOT / "tests" / "c" / "meshes" / "strip_ascii.ply", folder / "garment.ply")
    return environment


def run_commands(page, text, folder, environment):
    ran = 0
    for command in COMMAND.findall(text):
        done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        print(f"{page.name}: $ {command}\n{done.stdout[-300:]}{done.stderr[-200:] if done.returncode else ''}")
        assert done.returncode == 0, command
        # What a page shows moves, and by a method that is right for it.
        assert not re.search("every vertex is held|nothing has moved|; use --method", done.stdout), command
        ran += 1
    return ran


def check_scenes(page, text):
    schema, checked = json.loads(scene_schema.SCHEMA.read_text(encoding="utf-8")), 0
    for scene in [re.sub(r"^    ", "", block, flags=re.M) for block in INDENTED.findall(text)] + FENCED.findall(text):
        found = scene_schema.faults(tomllib.loads(scene), schema, schema)
        assert not found, (page.name, scene, found)
        checked += 1
    return checked


def run_python(environment, folder):
    program = PROGRAM.search((ROOT / "docs" / "guide" / "python.md").read_text(encoding="utf-8"))[1]
    pythons = [python for python in (str(ROOT / ".venv" / "bin" / "python"), sys.executable) if has_numpy(python)]
    if not pythons:
        print("skipped: the program of docs/guide/python.md, which needs numpy")
        return
    done = subprocess.run([pythons[0], "-c", program], cwd=folder, env=environment, capture_output=True, text=True, check=False)
    print(done.stdout, done.stderr)
    # The corner was led to 1.9, 1, 0.36 m.
    x, y, z = map(float, re.search(r"\[\s*([\d.-]+)\s+([\d.-]+)\s+([\d.-]+)\s*\]", done.stdout.splitlines()[-1]).groups())
    assert done.returncode == 0 and abs(x - 1.9) < 0.01 and abs(y - 1) < 0.01 and abs(z - 0.356) < 0.01, done.stdout


def main():
    folder, build = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    environment = prepare(folder, build)
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    ran = sum(run_commands(page, text, folder, environment) for page, text in texts.items())
    checked = sum(check_scenes(page, text) for page, text in texts.items() if page.stem != "farm")
    assert ran >= 12 and checked >= 5, (ran, checked)
    run_python(environment, folder)
    print(f"guides: {ran} commands, {checked} scenes")


if __name__ == "__main__":
    main()
