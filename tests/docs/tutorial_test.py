"""A tutorial is true: its files are written, its commands run, in its order and in one folder, and what it says of the results holds.

usage: tutorial_test.py PAGE FOLDER BUILD

A block with title="NAME" is the file NAME. Lines of sh blocks are run where links lead to what a checkout has after `make native`, but:
`make` lines only need such a target, and `pip` lines such a folder (the test python_wheel installs it). `python` is the Python that runs this,
and so is `blender --background --python`, which must have bpy. Any other block is an error: nothing in a tutorial is untried.
"""

import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.M | re.S)


def number(pattern, text):
    return float(re.search(pattern, text)[1])


def errors(said):
    """Percent that the worst frame and the last are off the full shell."""
    of = r"certified: (?:about|less than) ([\d.]+) % of the largest displacement off .*(?:; (?:about|less than) ([\d.]+) % in the last one|in the last frame)"
    return [float(percent) for percent in re.search(of, said).groups() if percent]


def leaf_in_wind(said, folder):
    assert "page: " in said and (folder / "leaf" / "leaf.pc2").stat().st_size > 90 * 12, said
    assert number(r"moved: up to [\d.]+ m, ([\d.]+) % of its size", said) > 5, said   # seen to blow
    assert max(errors(said)) < 20, said                                                # the certificate's range
    low, high = map(float, re.search(r"moved between (-?[\d.]+) and (-?[\d.]+) cm", said).groups())
    assert -10 < low < high - 0.5 and high < 10, said     # a leaf of 10 cm, that is seen to move
    assert number(r"cm; off by (\d+) %", said) < 20, said   # the certificate's range


def drag_in_c(said, folder):
    heights = [float(h) for h in re.findall(r"corner is (-?[\d.]+) cm high", said)]
    assert heights[:2] == [5.0, 10.0], said               # led there without compliance
    assert heights[-1] < 1, said                          # let go, it falls below where it was led
    assert number(r"off the full shell by ([\d.]+) %", said) < 20, said
    assert {"sheet_rest.obj", "sheet_dragged.obj", "sheet_free.obj"} <= set(os.listdir(folder))


def hat_on_head(said, folder):
    assert number(r"moved: up to [\d.]+, ([\d.]+) % of its size", said) > 1.5, said   # seen to swing
    assert max(errors(said)) < 20 and number(r"cm; off by (\d+) %", said) < 20, said
    assert (folder / "hat" / "hat_felt.pc2").exists() and (folder / "hat.html").stat().st_size > 1e5
    assert 1 < number(r"the brim swings by ([\d.]+) cm", said) < 20, said   # visible, and no more than the brim's width
    assert number(r"(\d+) vertices are held", said) > 20, said


def bake_in_blender(said, folder):
    size = int(re.search(r"flag.pc2 has (\d+) bytes", said)[1])
    assert size == 32 + 60 * 31 * 21 * 12, said           # PC2: a head of 32 bytes, and three floats a vertex and frame
    assert 0.5 < number(r"hangs ([\d.]+) cm low", said) < 30, said


def sheet_metal_panel(said, folder):
    assert "panel.obj: 400 across" in said and "--scale 0.001" in said, said
    flat, folded = map(float, re.findall(r"^  frequency 1 +([\d.]+) Hz", said, re.M))
    # Kirchhoff's plate twice as long as wide, Poisson's ratio 0.3; of a mesh of 10 mm one part in a hundred.
    plates = (ROOT / "tests" / "data" / "reference" / "plate_kirchhoff_CFFF_ritz.csv").read_text(encoding="utf-8")
    eigenvalue = float(re.search(r"^2,0\.3,([\d.]+)", plates, re.M)[1])
    young, poisson, density, thickness, length = 2.07e11, 0.3, 7850, 1e-3, 0.4
    theory = eigenvalue / (2 * math.pi * length**2) * math.sqrt(young * thickness**2 / (12 * (1 - poisson**2) * density))
    assert abs(flat / theory - 1) < 0.01 and f"{eigenvalue:.3f} {theory:.2f}" == "3.439 5.32", (flat, theory)
    bent, stiff = map(float, re.findall(r"^  largest displacement +([\d.]+) m", said, re.M))
    beam = 50 * length**3 / (3 * young * 0.2 * thickness**3 / 12)
    assert f"{beam:.2f}" == "0.31" and 0.15 < bent < 0.25, (beam, bent)
    assert bent / 6 < stiff < bent / 4 and 0.035 < stiff < 0.045 and 2 * flat < folded < 2.5 * flat, said
    assert said.count("creased edges") == 1 and re.search(r"with a rest angle +80$", said, re.M), said
    assert (folder / "panel.html").stat().st_size > 3e4 and (folder / "folded" / "channel.pc2").exists()


CLAIMS = {claim.__name__: claim for claim in (leaf_in_wind, drag_in_c, hat_on_head, bake_in_blender, sheet_metal_panel)}


def steps(page):
    """Each file of a page and each command, in order."""
    for language, title, text in BLOCK.findall(page):
        if title:
            yield title, text
            continue
        assert language == "sh", f"a block is neither a file nor commands: {text[:60]}"
        yield from ((None, line) for line in text.splitlines())


def prepare(folder, build):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("include", "host_examples", "tests"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "build").symlink_to(build)
    return {**os.environ, "PYTHONPATH": str(ROOT / "host_examples" / "python"), "TMPDIR": str(folder)}


def add_on(folder, build, environment):
    """Blender with an empty home and the add-on's zip, as `make blender-addon` packs it."""
    library = next(path for path in (build / "lib").iterdir() if path.name in ("libshellwarp.so.0", "libshellwarp.dylib"))
    done = subprocess.run([sys.executable, ROOT / "host_examples" / "blender" / "build_addon.py", "--library", library, "--out", folder / "add_on"],
                          capture_output=True, text=True, check=True)
    return {**environment, "SHELLWARP_ADDON": done.stdout.strip(), "BLENDER_USER_RESOURCES": str(folder / "home")}


def translated(line, targets):
    """The command to run for a line of a page; None where its being there is enough."""
    words = line.split()
    if words[0] == "make":
        assert words[1] in targets, line
        return None
    if words[:2] == ["pip", "install"]:
        assert (ROOT / words[2] / "pyproject.toml").exists(), line
        return None
    line = line.replace("blender --background --python", sys.executable) if words[0] == "blender" else line
    return re.sub(r"^python ", f"{sys.executable} ", line)


def main():
    page, folder, build = (Path(word).resolve() for word in sys.argv[1:4])
    environment = prepare(folder, build)
    if page.stem == "bake_in_blender":
        environment = add_on(folder, build, environment)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    said = ""
    for name, text in steps(page.read_text(encoding="utf-8")):
        if name:
            (folder / name).write_text(text, encoding="utf-8")
            continue
        command = translated(text, targets)
        if command:
            done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            said += done.stdout
            print(f"$ {text}\n{done.stdout[-1200:]}{done.stderr[-600:]}")
            assert done.returncode == 0, text
    CLAIMS[page.stem](said, folder)


if __name__ == "__main__":
    main()
