#!/usr/bin/env python3
"""The pictures of docs/tutorials, drawn of what the tutorials' commands wrote when their tests ran.

    tutorial_pictures.py --ran build/tests/c/tutorials --out docs/tutorials/pictures
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from meshes import read_obj
from paint import INK, font
from pictures import read_cache
from raster import View, draw

SIZE = (300, 260)
# Folder, colour, view, and the panels: a caption and an OBJ file, or a cache's name and frame.
PAGES = {
    "leaf_in_wind": ((92, 168, 74), {"azimuth": -62, "elevation": 18, "up": 2},
                     [("at rest", "leaf/leaf.pc2", 0), ("in an even wind", "leaf/leaf.pc2", 90), ("in a gust", "gust.obj", None)]),
    "drag_in_c": ((70, 130, 180), {"azimuth": -50, "elevation": 22, "up": 2},
                  [("at rest", "sheet_rest.obj", None), ("dragged by its corner", "sheet_dragged.obj", None), ("a second later", "sheet_free.obj", None)]),
    "hat_on_head": ((116, 76, 190), {"azimuth": 24, "elevation": 12, "up": 1},
                    [("at rest", "hat/hat_felt.pc2", 0), ("0.7 s", "hat/hat_felt.pc2", 42), ("1.1 s", "hat/hat_felt.pc2", 66), ("2 s", "hat/hat_felt.pc2", 120)]),
    "sheet_metal_panel": ((150, 158, 168), {"azimuth": -60, "elevation": 16, "up": 2},
                          [("at rest", "bent/panel.pc2", 0), ("under 50 N", "bent/panel.pc2", 1), ("folded, under 50 N", "folded/channel.pc2", 1)]),
    "bake_in_blender": ((190, 80, 60), {"azimuth": -55, "elevation": 20, "up": 2},
                        [("frame 1", "flag_1.obj", None), ("frame 12", "flag_12.obj", None), ("frame 60", "flag_60.obj", None)]),
}


def shape(folder, file, frame):
    if frame is None:
        return read_obj(folder / file)
    cache = folder / file
    return read_cache(cache)[frame], read_obj(cache.with_name(f"{cache.stem}_rest.obj"))[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ran", type=Path, required=True, help="the folder of the tests' folders")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("pages", nargs="*", default=list(PAGES))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for page in args.pages:
        color, view, panels = PAGES[page]
        shapes = [shape(args.ran / page, file, frame) for _, file, frame in panels]
        points = np.concatenate([p for p, _ in shapes])
        view = View(points.min(axis=0), points.max(axis=0), SIZE, **view)
        low = (points @ view.up).min() - 0.1 * np.ptp(points @ view.up)
        row = Image.new("RGB", (SIZE[0] * len(panels), SIZE[1]))
        for k, ((words, _, _), (p, triangles)) in enumerate(zip(panels, shapes)):
            row.paste(draw(view, [(p, triangles, color)], low), (k * SIZE[0], 0))
            ImageDraw.Draw(row).text((k * SIZE[0] + 12, 10), words, fill=INK, font=font(15))
        row.quantize(128).save(args.out / f"{page}.png", optimize=True)
        print(args.out / f"{page}.png")


if __name__ == "__main__":
    main()
