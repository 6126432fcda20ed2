#!/usr/bin/env python3
"""The picture of docs/guide/moving_supports.md: a scarf held at both ends, of which one turns, by the warp and by the full shell.

    moving_supports_picture.py --cli build/bin/shellwarp --out docs/guide/pictures/moving_supports.png
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

SIZE = (400, 300)
CLOTH, HELD = (198, 92, 84), (60, 66, 78)
LONG, WIDE, ROWS, COLUMNS = 1.0, 0.24, 51, 13
SCENE = """mesh = "scarf.obj"
[material]
k_area = 4000
k_length = 300
k_bend = 0.015
density = 0.2
[[support]]
box = [0, -1, -1, 0.03, 1, 1]
[[support]]
box = [0.97, -1, -1, 2, 1, 1]
key = [{{ time = 0 }}, {{ time = 1, rotate_degrees = [90, 0, 0], offset = [-0.02, 0, 0] }}]
[simulation]
method = "{method}"
static = true
duration = 1
gravity = [0, 0, -0.5]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    x, y = np.meshgrid(np.linspace(0, LONG, ROWS), np.linspace(-WIDE / 2, WIDE / 2, COLUMNS), indexing="ij")
    corner = 1 + np.arange(ROWS - 1)[:, None] * COLUMNS + np.arange(COLUMNS - 1)
    faces = np.stack([corner, corner + COLUMNS, corner + COLUMNS + 1, corner + 1], axis=-1).reshape(-1, 4)
    lines = [f"v {a:.6f} {b:.6f} 0" for a, b in zip(x.ravel(), y.ravel())] + ["f " + " ".join(map(str, face)) for face in faces]
    shapes = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "scarf.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
        triangles = read_obj(folder / "scarf.obj")[1]
        for method, name in (("warp", "warp"), ("shell-implicit", "full shell")):
            (folder / "scene.toml").write_text(SCENE.format(method=method), encoding="utf-8")
            run(args.cli.resolve(), folder, "run", "scene.toml", "--out", method, "--no-certify")
            cache = read_cache(folder / method / "scene.pc2")
            if not shapes:
                shapes.append((cache[0], "at rest"))
            shapes.append((cache[-1], name))
    held = np.isin(np.arange(len(x.ravel())), np.flatnonzero((x.ravel() < 0.03) | (x.ravel() > 0.97)))
    ends = held[triangles].all(axis=1)
    everything = np.concatenate([points for points, _ in shapes])
    view = View(everything.min(axis=0), everything.max(axis=0), SIZE, azimuth=-62, elevation=26, up=2)
    low = everything[:, 2].min() - 0.03
    row = Image.new("RGB", (len(shapes) * SIZE[0], SIZE[1]))
    for k, (points, what) in enumerate(shapes):
        row.paste(draw(view, [(points, triangles[~ends], CLOTH), (points, triangles[ends], HELD)], low), (k * SIZE[0], 0))
        ImageDraw.Draw(row).text((k * SIZE[0] + 12, 10), what, fill=INK, font=font(15))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    row.quantize(128).save(args.out, optimize=True)
    print(args.out)


if __name__ == "__main__":
    main()
