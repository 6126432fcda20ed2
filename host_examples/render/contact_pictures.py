#!/usr/bin/env python3
"""The picture of docs/guide/contact.md: a leaf on a ball, a flag on a pole, a hat on the floor, and trousers on their legs.

    contact_pictures.py --cli build/bin/shellwarp --out docs/guide/pictures/contact.png

It prints how deep each shell was in a collider, as the program tells, and how deep the trousers' vertices are in the legs, by itself.
The trousers are tests/scenes/character_body.toml, and the same without its colliders.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import figure
from meshes import read_obj
from paint import INK, font
from pictures import LEAF, read_cache
from raster import View, draw

SIZE = (400, 340)
ROOT = Path(__file__).resolve().parents[2]
SOLID, FLAG, HAT, DENIM, LEG = (150, 158, 170), (205, 66, 54), (116, 76, 190), (52, 104, 184), (236, 178, 60)
SHEET = """mesh = "flag.obj"
[material]
k_area = 4000
k_length = 4000
k_bend = 4e-4
density = 0.12
[[support]]
box = [-0.001, -1, -1, 0.001, 1, 1]
[simulation]
method = "rotation-strain"
modes = 24
duration = 2
frame_rate = 60
gravity = [0, 0, -9.8]
[damping]
ratio = 0.2
[[collider]]
kind = "capsule"
radius = 0.02
half_length = 0.3
position = [0.06, 0.05, 0.1]
friction = 0.3
thickness = 0.001
key = [{ time = 0.2 }, { time = 1.0, offset = [0, -0.1, 0] }]
"""
FELT = """mesh = "%s"
[material]
k_area = 2e5
k_length = 2e5
k_bend = 2e4
density = 0.05
[simulation]
method = "rotation-strain"
modes = 24
duration = 1.0
frame_rate = 60
gravity = [0, -981, 0]
[damping]
ratio = 0.1
[[collider]]
kind = "plane"
position = [0, 140, -6]
normal = [0.2, 1, 0.1]
friction = 0.4
"""


def run(cli, folder, *arguments):
    done = subprocess.run([cli, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"contact_pictures: {' '.join(map(str, arguments))} failed:\n{done.stdout}{done.stderr}")
    print(*(f"  {line}" for line in done.stdout.splitlines() if line.startswith("touched")), sep="\n")


def ball(center, radius, stretch=None):
    """A ball, or a capsule whose middles are `stretch` to either side of the center."""
    points, triangles = figure.ball()
    way = np.zeros(3) if stretch is None else np.asarray(stretch, float)
    side = np.sign(points @ way)[:, None] * way if way.any() else 0
    return np.asarray(center) + radius * points + side, triangles


def sheet(path, long, high, columns, rows):
    x, z = np.meshgrid(np.linspace(0, long, columns), np.linspace(0, high, rows), indexing="ij")
    corner = 1 + np.arange(columns - 1)[:, None] * rows + np.arange(rows - 1)
    faces = np.stack([corner, corner + rows, corner + rows + 1, corner + 1], axis=-1).reshape(-1, 4)
    lines = [f"v {a:.6f} 0 {b:.6f}" for a, b in zip(x.ravel(), z.ravel())] + ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def leaf(cli, folder):
    run(cli, folder, "new-scene", "leaf.toml")
    run(cli, folder, "simulate", "leaf.obj", "--pin", "low-x", "--up", "z", "--frequency", 4, "--damping-ratio", 0.2, "--duration", 2,
        "--collider", "sphere:0.02@0.08,0,-0.045:friction=0.4", "--out", ".", "--no-certify")
    points = read_cache(folder / "leaf.pc2")[-1]
    return [(points, read_obj(folder / "leaf_rest.obj")[1], LEAF), (*ball((0.08, 0, -0.045), 0.02), SOLID)], (-62, 16, 2)


def flag(cli, folder):
    sheet(folder / "flag.obj", 0.36, 0.24, 31, 21)
    (folder / "flag.toml").write_text(SHEET, encoding="utf-8")
    run(cli, folder, "run", "flag.toml", "--out", ".", "--no-certify")
    points, triangles = read_cache(folder / "flag.pc2")[-1], read_obj(folder / "flag_rest.obj")[1]
    return [(points, triangles, FLAG), (*ball((0.06, -0.05, 0.1), 0.02, (0, 0, 0.22)), SOLID)], (-30, 24, 2)


def hat(cli, folder):
    (folder / "hat.toml").write_text(FELT % (ROOT / "tests/data/meshes/character_hat.obj"), encoding="utf-8")
    run(cli, folder, "run", "hat.toml", "--out", ".", "--no-certify")
    points, triangles = read_cache(folder / "hat.pc2")[-1], read_obj(folder / "hat_rest.obj")[1]
    up = np.array([0.2, 1, 0.1]) / np.linalg.norm([0.2, 1, 0.1])
    x = np.cross(up, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    middle = points.mean(axis=0)
    middle -= ((middle - [0, 140, -6]) @ up) * up
    corners = np.array([middle + 34 * (a * x + b * np.cross(x, up)) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return [(points, triangles, HAT), (corners, np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]), SOLID)], (30, 14, 1)


def legs(bones, side):
    """Of a frame: start, end and radius of the capsules of a leg."""
    for bone, start, end, radii, _ in figure.SOLIDS:
        if bone in (f"thigh_{side}", f"shin_{side}") and not np.array_equal(start, end):
            rest, joint, axes = bones[bone]
            yield joint + (start - rest) @ axes, joint + (end - rest) @ axes, radii[0]


def tell_depth(folder):
    """How deep vertices are in the legs, by closed form."""
    for side in ("left", "right"):
        deepest = []
        for frame, points in enumerate(read_cache(folder / f"character_body_leg_{side}.pc2")):
            deepest.append(0.0)
            for start, end, radius in legs(figure.read_bones(folder / "character_body_bones.csv", frame), side):
                way = end - start
                share = np.clip((points - start) @ way / (way @ way), 0, 1)
                deepest[-1] = max(deepest[-1], radius - np.linalg.norm(points - start - share[:, None] * way, axis=1).min())
        print(f"  {side} leg: in {np.count_nonzero(np.array(deepest) > 0)} of {len(deepest)} frames, at most {max(deepest):.2g} cm")


def trousers(cli, folder, colliders):
    """The frame at which the cloth without colliders is deepest in a leg."""
    scene = (ROOT / "tests/scenes/character_body.toml").read_text(encoding="utf-8").replace("../data", str(ROOT / "tests/data"))
    if not colliders:
        scene = re.sub(r"\[\[collider\]\]\n(?:.+\n)+", "", scene)
    (folder / "character_body.toml").write_text(scene, encoding="utf-8")
    run(cli, folder, "run", "character_body.toml", "--out", ".", "--no-certify")
    tell_depth(folder)
    shapes = []
    for side in ("left", "right"):
        title = f"character_body_leg_{side}"
        shapes.append((read_cache(folder / f"{title}.pc2")[FRAME], read_obj(folder / f"{title}_rest.obj")[1], DENIM))
        for start, end, radius in legs(figure.read_bones(folder / "character_body_bones.csv", FRAME), side):
            shapes.append((*figure.solid_mesh(start, end, np.full(3, radius)), LEG))
    return shapes, (24, 6, 1)


FRAME = 290
PICTURES = [
    ("a leaf on a ball", leaf),
    ("a flag that a pole is pushed into", flag),
    ("a hat thrown on a slope", hat),
    ("trousers without colliders", lambda cli, folder: trousers(cli, folder, False)),
    ("trousers on their legs", lambda cli, folder: trousers(cli, folder, True)),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    row = Image.new("RGB", (len(PICTURES) * SIZE[0], SIZE[1]))
    for k, (what, make) in enumerate(PICTURES):
        print(what, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            shapes, (azimuth, elevation, up) = make(args.cli.resolve(), Path(folder))
        everything = np.concatenate([shape[0] for shape in shapes])
        view = View(everything.min(axis=0), everything.max(axis=0), SIZE, azimuth=azimuth, elevation=elevation, up=up)
        row.paste(draw(view, shapes, (everything @ view.up).min()), (k * SIZE[0], 0))
        ImageDraw.Draw(row).text((k * SIZE[0] + 12, 10), what, fill=INK, font=font(15))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    row.save(args.out, optimize=True)
    print(args.out)


if __name__ == "__main__":
    main()
