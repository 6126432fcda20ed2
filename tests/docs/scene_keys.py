"""docs/reference/scene.md lists the keys that the command-line program reads, table by table, and no others.

usage: scene_keys.py PROGRAM

For each table of the page a small scene is written that is right but for keys whose value no key accepts, a date. Of a key that it knows the
program says that the value is wrong, and only afterwards names the first key that it does not know. So each key of the page is tried by
itself, and all other words that the reader's source has in quotes together.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "scene.md"
SOURCES = [ROOT / "host_examples" / "cli" / name for name in ("scene.cpp", "read_collider.cpp", "material.cpp", "material_maps.cpp", "creases.cpp", "fibres.cpp", "ties.cpp", "read_where.cpp", "section.hpp")]
NO_VALUE = "1979-05-27"  # a date: no key takes one

MESH = {"mesh": '"none.obj"'}
GRAVITY = "[simulation]\ngravity = [0, 0, -1]\n"
SWEEP = '[comparison]\nmethods = ["warp"]\ngravities = [1]\n'
BONE = '[[bone]]\nname = "b"\n'
# By heading of the page: what stands before the table, its header, the keys that it needs.
TABLES = {
    "Top of the file": ("", "", MESH),
    "[material]": ('mesh = "none.obj"\n', "[material]", {}),
    "[material.map]": ('mesh = "none.obj"\n', "[material.map]", {}),
    "[[material.region]]": ('mesh = "none.obj"\n', "[[material.region]]", {"side": '"low-x"', "density": "1"}),
    "[[material.crease]]": ('mesh = "none.obj"\n', "[[material.crease]]", {"edges": "[[0, 1]]", "factor": "0"}),
    "[[support]]": ('mesh = "none.obj"\n', "[[support]]", {"vertices": "[0]"}),
    "[[support.key]]": ('mesh = "none.obj"\n[[support]]\nside = "low-x"\n', "[[support.key]]", {"time": "1"}),
    "[[tie]]": ('mesh = "none.obj"\n', "[[tie]]", {"vertices": "[[0, 1]]"}),
    "[simulation]": ('mesh = "none.obj"\n', "[simulation]", {}),
    "[damping]": ('mesh = "none.obj"\n', "[damping]", {}),
    "[[force]]": ('mesh = "none.obj"\n', "[[force]]", {"vertex": "0", "vector": "[0, 0, 1]"}),
    "[wind]": ('mesh = "none.obj"\n', "[wind]", {"velocity": "[0, 0, 1]"}),
    "[frame]": ('mesh = "none.obj"\n', "[frame]", {}),
    "[[frame.translate]]": ('mesh = "none.obj"\n', "[[frame.translate]]", {}),
    "[[frame.rotate_degrees]]": ('mesh = "none.obj"\n', "[[frame.rotate_degrees]]", {}),
    "[[handle]]": ('mesh = "none.obj"\n', "[[handle]]", {"vertex": "0"}),
    "[[handle.key]]": ('mesh = "none.obj"\n[[handle]]\nvertex = 0\nkind = "both"\n', "[[handle.key]]", {"time": "1"}),
    "[[collider]]": ('mesh = "none.obj"\n', "[[collider]]", {"kind": '"sphere"', "radius": "1"}),
    "[[collider.key]]": ('mesh = "none.obj"\n[[collider]]\nkind = "plane"\n', "[[collider.key]]", {"time": "1"}),
    "[[bone]]": ("", "[[bone]]", {"name": '"b"'}),
    "[[shell]]": (BONE, "[[shell]]", {"name": '"s"', **MESH}),
    "[[shell.attach]]": (BONE + '[[shell]]\nname = "s"\nmesh = "none.obj"\n', "[[shell.attach]]", {"bone": '"b"', "vertex": "0"}),
    "[comparison]": ('mesh = "none.obj"\n' + GRAVITY, "[comparison]", {"methods": '["warp"]', "gravities": "[1]"}),
    "[expect]": ('mesh = "none.obj"\n', "[expect]", {}),
    "[expect] of a comparison": ('mesh = "none.obj"\n' + GRAVITY + SWEEP, "[expect]", {}),
    "[expect.reference]": ('mesh = "none.obj"\n' + GRAVITY + SWEEP, "[expect.reference]", {"tolerance": "1"}),
    "[paper]": ('mesh = "none.obj"\n', "[paper]", {}),
}


def tables_of_the_page():
    """By heading, the keys in the first column."""
    sections = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)[1:]
    return {s.splitlines()[0].replace("`", ""): re.findall(r"^\| `(\w+)` \|", s, re.M) for s in sections}


def words_of_the_reader():
    """All that may be a key: what is in quotes. A comparison's numbers are called after methods, whose names the reader does not have."""
    sources = "".join(source.read_text(encoding="utf-8") for source in SOURCES)
    return set(re.findall(r'"([a-z]\w*)"', sources))


def complaint(program, scene, heading, keys):
    """What the program says of a table with these keys, all of them with a value that none takes."""
    before, header, needed = TABLES[heading]
    values = {**needed, **dict.fromkeys(keys, NO_VALUE)}
    scene.write_text("\n".join([before + header, *(f"{k} = {v}" for k, v in values.items())]) + "\n", encoding="utf-8")
    done = subprocess.run([program, "run", scene], capture_output=True, text=True)
    if done.returncode != 1 or f"{scene}:" not in done.stderr:
        raise SystemExit(f"{heading}: {sorted(keys)}: exit status {done.returncode}, {done.stderr.strip()}")
    return done.stderr


def known(program, scene, heading, keys):
    """Those that the program knows."""
    if not keys or f"unknown key '{min(keys)}'" in complaint(program, scene, heading, keys):
        return []
    if len(keys) == 1:
        return keys
    half = len(keys) // 2
    return known(program, scene, heading, keys[:half]) + known(program, scene, heading, keys[half:])


def main():
    program, page = sys.argv[1], tables_of_the_page()
    wrong = [f"the page and the test differ in tables: {set(page) ^ set(TABLES)}"] if set(page) != set(TABLES) else []
    words = words_of_the_reader() | {key for keys in page.values() for key in keys}
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        for heading, listed in page.items():
            read = {key for key in listed if known(program, scene, heading, [key])}
            more = known(program, scene, heading, sorted(words - set(listed)))
            wrong += [f"{heading}: the program reads {key}, the page lacks it" for key in more]
            wrong += [f"{heading}: the page lists {key}, the program does not read it" for key in sorted(set(listed) - read)]
            wrong += [f"{heading}: the page lists {key} twice" for key in set(listed) if listed.count(key) > 1]
    print("\n".join(wrong) if wrong else "scene keys: OK")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
