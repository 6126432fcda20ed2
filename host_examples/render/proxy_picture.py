#!/usr/bin/env python3
"""The picture of proxies in docs/guide/render_mesh.md: a leaf of quads with two sides, a shirt with buttons, a dinosaur of 200,000 vertices.

    proxy_picture.py --cli build/bin/shellwarp --out docs/guide/pictures/proxies.png
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from meshes import read_obj
from paint import INK, font
from pictures import read_cache, run
from raster import View, draw
from render_mesh_picture import fine_leaf, write

MESHES = Path(__file__).resolve().parents[2] / "tests" / "data" / "meshes"
SIZE = (430, 330)
COARSE = (150, 158, 170)
FRAME = 20


def with_buttons(points, triangles):
    """The shirt with a row of round, thick buttons on its front, which touch it nowhere."""
    faces = [list(face) for face in triangles]
    points = [points]
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    for height in np.linspace(96, 138, 6):
        front = points[0][(np.abs(points[0][:, 0]) < 1.5) & (np.abs(points[0][:, 1] - height) < 1.5)]
        x, y, z = 0.0, height, front[:, 2].max() + 0.25
        disc = np.stack([x + 0.9 * np.cos(turn), y + 0.9 * np.sin(turn), np.full(12, z)], axis=1)
        first = sum(len(p) for p in points)
        points += [disc, disc + [0, 0, 0.3]]
        faces += [[first + k for k in reversed(range(12))], [first + 12 + k for k in range(12)]]
        faces += [[first + k, first + (k + 1) % 12, first + 12 + (k + 1) % 12, first + 12 + k] for k in range(12)]
    return np.concatenate(points), faces


def subdivided(points, triangles):
    """Each triangle in four."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, place = np.unique(edges, axis=0, return_inverse=True)
    m = len(points) + place.reshape(-1, 3)
    a, b, c = triangles.T
    parts = [(a, m[:, 0], m[:, 2]), (m[:, 0], b, m[:, 1]), (m[:, 2], m[:, 1], c), (m[:, 0], m[:, 1], m[:, 2])]
    return np.concatenate([points, points[unique].mean(axis=1)]), np.concatenate([np.stack(part, axis=1) for part in parts])


def assets(folder):
    """Name, what it is, options of simulate, the view's angles and axis, colour."""
    write(folder / "leaf.obj", *fine_leaf(201, 61))
    write(folder / "shirt.obj", *with_buttons(*read_obj(MESHES / "shirt.obj")))
    write(folder / "dinosaur.obj", *subdivided(*subdivided(*read_obj(MESHES / "dinosaur.obj"))))
    yield "leaf", "quads with two sides and a rim", ["--proxy", 400, "--pin", "low-x", "--frequency", 0.9, "--gravity", 0, -2, -9.8], (-58, 24, 2), (92, 168, 74)
    yield ("shirt", "six buttons beside it", ["--proxy", 700, "--scale", 0.01, "--pin", "box:-1,1.44,-1,1,2,1", "--frequency", 1.2, "--gravity", 7, -4, 6],
           (25, 12, 1), (196, 120, 88))
    yield "dinosaur", "triangles", ["--proxy", 2000, "--scale", 0.01, "--pin", "low-y", "--frequency", 1.5, "--gravity", 3, -9.8, 5], (30, 14, 1), (120, 142, 92)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name, what, options, (azimuth, elevation, up), color in assets(folder):
            run(args.cli.resolve(), folder, "simulate", f"{name}.obj", *options, "--damping-ratio", 0.05, "--frames", FRAME, "--obj-frames", 0, "--no-certify", "--out", name)
            shapes = [(read_cache(folder / name / f"{name}{end}.pc2")[FRAME], read_obj(folder / name / f"{name}{end}_rest.obj")[1]) for end in ("", "_render")]
            everything = np.concatenate([points for points, _ in shapes])
            view = View(everything.min(axis=0), everything.max(axis=0), SIZE, azimuth=azimuth, elevation=elevation, up=up)
            low = everything[:, up].min() - 0.03 * np.ptp(everything)
            row = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
            for k, (points, triangles) in enumerate(shapes):
                words = f"{name}, drawn: {len(points):,} vertices, {what}" if k else f"simulated: {len(points):,} vertices"
                if k == 0:  # flat triangles, as they are
                    points, triangles = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
                row.paste(draw(view, [(points, triangles, color if k else COARSE)], low), (k * SIZE[0], 0))
                ImageDraw.Draw(row).text((k * SIZE[0] + 12, 10), words, fill=INK, font=font(14))
            rows.append(row)
    picture = Image.new("RGB", (2 * SIZE[0], len(rows) * SIZE[1]))
    for k, row in enumerate(rows):
        picture.paste(row, (0, k * SIZE[1]))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    picture.quantize(256).save(args.out, optimize=True)
    print(args.out)


if __name__ == "__main__":
    main()
