#!/usr/bin/env python3
"""The pictures of docs/guide/maya.md and docs/guide/houdini.md: what the plug-ins gave in the stand-ins for their hosts.

    make native && . build/tools.sh && "$PYTHON" host_examples/render/host_pages.py --build build --out docs/guide/pictures
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

RENDER = Path(__file__).with_name("render.py")
LED = 16  # the point of the banner that is led

# name: test program, plug-in, OBJ files, the frames shown, what render.py is told
PAGES = {
    "maya": ("maya_node_test", "maya/shellWarp.so", "frame_{}.obj", (1, 5, 9, 72),
             ["--range", "0", "20", "--caption", "moved, cm", "--gap", "0.6", "--view", "25", "12"]),
    "houdini": ("houdini_sop_test", "houdini/SOP_ShellWarp.so", "banner_{}.obj", (1, 12, 24),
                ["--range", "0", "0.4", "--caption", "moved", "--gap", "0.1", "--view", "45", "20"]),
}


def run(*command):
    if subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, check=False).returncode:
        sys.exit(f"host_pages.py: failed: {' '.join(str(word) for word in command)}")


def sphere(mesh):
    """A handle is shown where it led its point; the argument parser takes no -5.9e-11 for a number."""
    lines = [line.split()[1:] for line in mesh.read_text().splitlines() if line.startswith("v ")]
    return [f"{round(float(x), 4) + 0.0:.4f}" for x in lines[LED]] + ["0.03"]


def page(name, build, out, work):
    program, plugin, pattern, frames, options = PAGES[name]
    tests = build / "tests" / "hosts"
    shipped = {"maya": [RENDER.parents[1] / "maya" / "module" / "scripts"]}
    run(tests / program, tests / plugin, RENDER.parents[2] / "docs" / "guide" / f"{name}.md", *shipped.get(name, []), work)
    meshes = [work / pattern.format(frame) for frame in frames]
    stills = []
    for mesh in meshes:
        stills.append(mesh.with_suffix(".png"))
        spheres = ["--spheres", *sphere(mesh)] if name == "houdini" else []
        run(sys.executable, RENDER, "--out", stills[-1], "--size", 400, 340, "--displacement", meshes[0], *options,
            "--frame-on", meshes[0], "--frame-on", meshes[2], *spheres, "--", mesh)
    run(sys.executable, RENDER, "--out", out / f"{name}_first_scene.png", "--contact-sheet", "--columns", len(frames),
        "--labels", *[f"frame {frame}" for frame in frames], *stills)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, required=True, help="CMake's build directory")
    parser.add_argument("--out", type=Path, required=True, help="the folder for the pictures")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for name in PAGES:
        with tempfile.TemporaryDirectory() as work:
            page(name, args.build.resolve(), args.out.resolve(), Path(work))
        print(f"wrote {args.out / name}_first_scene.png")


if __name__ == "__main__":
    main()
