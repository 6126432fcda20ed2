#!/usr/bin/env python3
"""The picture of docs/guide/render_mesh.md: a coarse leaf that is simulated, and a fine leaf of quads with thickness that follows it.

    render_mesh_picture.py --cli build/bin/shellwarp --out docs/guide/pictures/render_mesh.png
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

SIZE = (430, 340)
LENGTH, WIDTH, THICKNESS = 1.0, 0.42, 0.012
LEAF, COARSE = (92, 168, 74), (150, 158, 170)
FRAME = 22


def surface(along, across):
    """A pointed, arched leaf over two unit coordinates."""
    s, t = np.meshgrid(along, across, indexing="ij")
    half = WIDTH / 2 * np.sin(np.pi * (0.06 + 0.93 * s)) ** 0.75
    x, y = LENGTH * s, half * (2 * t - 1)
    return np.stack([x, y, 0.35 * x * (LENGTH - x) + 1.2 * y * y], axis=-1)


def quads(n, m, start=0):
    corner = start + np.arange(n - 1)[:, None] * m + np.arange(m - 1)
    return np.stack([corner, corner + m, corner + m + 1, corner + 1], axis=-1).reshape(-1, 4)


def write(path, points, faces):
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points] + ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def fine_leaf(n, m):
    """Both sides and the rim between them: points, quads."""
    middle = surface(np.linspace(0, 1, n), np.linspace(0, 1, m))
    normal = np.cross(np.gradient(middle, axis=0), np.gradient(middle, axis=1))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    sides = [(middle + sign * THICKNESS / 2 * normal).reshape(-1, 3) for sign in (1, -1)]
    count = n * m
    ring = np.concatenate([np.arange(m), np.arange(1, n) * m + m - 1, (n - 1) * m + np.arange(m - 2, -1, -1), np.arange(n - 2, 0, -1) * m])
    rim = np.stack([ring, np.roll(ring, -1), np.roll(ring, -1) + count, ring + count], axis=-1)
    return np.concatenate(sides), np.concatenate([quads(n, m), quads(n, m, count)[:, ::-1], rim])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        coarse = surface(np.linspace(0, 1, 13), np.linspace(0, 1, 6)).reshape(-1, 3)
        write(folder / "coarse.obj", coarse, [f for a, b, c, d in quads(13, 6) for f in ((a, b, c), (a, c, d))])
        points, faces = fine_leaf(201, 61)
        write(folder / "leaf.obj", points, faces)
        run(args.cli.resolve(), folder, "simulate", "coarse.obj", "--render", "leaf.obj", "--pin", "low-x", "--frequency", 0.9, "--thickness", 0.004,
            "--gravity", 0, -2, -9.8, "--damping-ratio", 0.1, "--frames", FRAME, "--obj-frames", 0, "--no-certify", "--out", "out")
        shapes = [(read_cache(folder / "out" / f"coarse{name}.pc2")[FRAME], read_obj(folder / "out" / f"coarse{name}_rest.obj")[1], color)
                  for name, color in (("", COARSE), ("_render", LEAF))]
    everything = np.concatenate([p for p, _, _ in shapes])
    view = View(everything.min(axis=0), everything.max(axis=0), SIZE, azimuth=-58, elevation=24, up=2)
    low = everything[:, 2].min() - 0.05
    row = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    for k, (shape, what) in enumerate(zip(shapes, ("simulated", "drawn"))):
        points, triangles, color = shape
        if k == 0:  # flat triangles, as they are
            points, triangles = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
        row.paste(draw(view, [(points, triangles, color)], low), (k * SIZE[0], 0))
        words = f"{what}: {len(shape[0]):,} vertices"
        ImageDraw.Draw(row).text((k * SIZE[0] + 12, 10), words, fill=INK, font=font(15))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    row.quantize(128).save(args.out, optimize=True)
    print(args.out)


if __name__ == "__main__":
    main()
