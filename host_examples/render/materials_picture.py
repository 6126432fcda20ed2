#!/usr/bin/env python3
"""The pictures of docs/reference/materials.md: what thickness, creases, growth and materials do to a leaf, a card, a disk and a hat.

    materials_picture.py --cli build/bin/shellwarp --out docs/reference/pictures

Writes materials_leaf.png, materials_growth.png and materials_hat.png. All shapes are equilibria under gravity, of the full shell.
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

SIZE = (400, 320)
LEAF, VEIN, CARD = (104, 168, 84), (208, 220, 150), (222, 196, 150)
ROWS, COLUMNS = 49, 21                   # of the leaf, along and across
LONG, WIDE = 0.12, 0.05                  # of the leaf, m
CURL = 0.013                             # radius that it is rolled to across, without a stretch, m
HAT = Path(__file__).resolve().parents[2] / "tests" / "data" / "meshes" / "character_hat.obj"

END = """[simulation]
method = "shell-implicit"
static = true
duration = 1
gravity = {gravity}
"""
LEAF_SCENE = """mesh = "leaf.obj"
[[support]]
kind = "clamped"
box = [-1, -1, -1, 0.003, 1, 1]
[material]
young = 1e8
poisson = 0.3
thickness = 2.5e-4
volume_density = 800
"""
VEINS = """[[material.region]]
list = "side.txt"
thickness = 5e-4
[[material.region]]
list = "middle.txt"
thickness = 1.2e-3
[[material.crease]]
list = "fold.txt"
angle_degrees = -25
"""
CURLED = """rest_shape = "curled.obj"
[[material.region]]
list = "side.txt"
thickness = 5e-4
[[material.region]]
list = "middle.txt"
thickness = 8e-4
"""
CARD_SCENE = """mesh = "card.obj"
[[support]]
kind = "clamped"
box = [-1, -1, -1, 0.001, 1, 1]
[material]
preset = "card"
[[material.crease]]
box = [0.0999, -1, -1, 0.1001, 1, 1]
factor = 0.3
angle_degrees = 90
"""
STIFF_LEAF = LEAF_SCENE.replace("1e8", "1e9")
GROWN = '[material.map]\ngrowth = "{}.txt"\n'
DISK_SCENE = """mesh = "disk.obj"
[[support]]
box = [-0.007, -0.007, -1, 0.007, 0.007, 1]
[material]
young = 1e9
poisson = 0.3
thickness = 2.5e-4
volume_density = 800
"""
RINGS, AROUND, RADIUS = 20, 96, 0.05     # of the disk, m
HAT_SCENE = """mesh = "hat.obj"
scale = 0.01
up = "y"
[[support]]
box = [-0.097, 1.65, -0.165, 0.097, 1.72, 0.045]
[material]
"""
FELT = "young = 4e5\npoisson = 0.2\nthickness = 2.5e-3\nvolume_density = 220\n"
STEEL = 'preset = "steel"\n'
BRIM = "[[material.region]]\nlist = \"brim.txt\"\nyoung = 2e7\n"


def write_mesh(path, points, triangles):
    lines = ["v {:.7f} {:.7f} {:.7f}".format(*point) for point in points] + ["f {} {} {}".format(*(1 + t)) for t in triangles]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def grid(rows, columns):
    """Triangles of a grid, numbered row by row; diagonals point away from the middle column."""
    triangles = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a, b, c, d = i * columns + j, (i + 1) * columns + j, (i + 1) * columns + j + 1, i * columns + j + 1
            triangles += [[a, b, c], [a, c, d]] if j >= columns // 2 else [[a, b, d], [b, c, d]]
    return np.array(triangles)


def write_list(path, rows):
    path.write_text("\n".join(" ".join(map(str, np.atleast_1d(row))) for row in rows) + "\n", encoding="utf-8")


def make_leaf(folder):
    """A flat leaf along x, the same rolled up along its length, and its veins: the middle, and side veins along the diagonals. Returns the triangles and the veins' vertices."""
    s, t = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(-1, 1, COLUMNS), indexing="ij")
    half = WIDE / 2 * (0.08 + 0.92 * np.sin(np.pi * np.clip(0.02 + 0.96 * s, 0, 1)) ** 0.8)
    points = np.stack([LONG * s, half * t, 0 * s], axis=-1).reshape(-1, 3)
    write_mesh(folder / "leaf.obj", points, grid(ROWS, COLUMNS))
    x, y = points[:, 0], points[:, 1]
    write_mesh(folder / "curled.obj", np.stack([x, CURL * np.sin(y / CURL), CURL * (1 - np.cos(y / CURL))], axis=-1), grid(ROWS, COLUMNS))
    middle = COLUMNS // 2
    ridge = [i * COLUMNS + middle for i in range(ROWS)]
    side = [(i + k) * COLUMNS + middle + sign * k for i in range(4, ROWS - 10, 6) for k in range(1, middle) for sign in (-1, 1) if i + k < ROWS]
    write_list(folder / "middle.txt", ridge)
    write_list(folder / "side.txt", side)
    write_list(folder / "fold.txt", zip(ridge[4:-1], ridge[5:]))
    return grid(ROWS, COLUMNS), ridge + side


def make_card(folder):
    """20 cm by 8 cm, flat, with a row of edges across its middle."""
    x, y = np.meshgrid(np.linspace(0, 0.2, 41), np.linspace(-0.04, 0.04, 17), indexing="ij")
    write_mesh(folder / "card.obj", np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), grid(41, 17))
    return grid(41, 17)


def make_disk(folder):
    """Rings of triangles about a middle vertex, and how much of its radius each vertex has."""
    ring, k = np.meshgrid(np.arange(1, RINGS + 1), np.arange(AROUND), indexing="ij")
    angle, share = 2 * np.pi * (k + 0.5 * (ring % 2)) / AROUND, ring / RINGS
    points = np.stack([RADIUS * share * np.cos(angle), RADIUS * share * np.sin(angle), 0 * share], axis=-1).reshape(-1, 3)
    at = lambda r, k: 1 + (r - 1) * AROUND + k % AROUND  # noqa: E731
    triangles = [[0, at(1, k), at(1, k + 1)] for k in range(AROUND)]
    for r in range(1, RINGS):
        for k in range(AROUND):
            low, high = [at(r, k), at(r, k + 1)], [at(r + 1, k + r % 2), at(r + 1, k + r % 2 + 1)]
            triangles += [[low[0], high[0], low[1]], [low[1], high[0], high[1]]]
    write_mesh(folder / "disk.obj", np.concatenate([np.zeros((1, 3)), points]), np.array(triangles))
    return np.array(triangles), np.concatenate([[0.0], share.ravel()])


def make_hat(folder):
    """The hat of the character, and the outer half of its brim."""
    (folder / "hat.obj").write_text(HAT.read_text(encoding="utf-8"), encoding="utf-8")
    points, triangles = read_obj(HAT)
    write_list(folder / "brim.txt", np.flatnonzero((points[:, 1] < 171) & (np.hypot(points[:, 0], points[:, 2] + 6) > 11)))
    return triangles


def shape(cli, folder, name, scene, gravity):
    """Positions at rest under gravity."""
    (folder / f"{name}.toml").write_text(scene + END.format(gravity=gravity), encoding="utf-8")
    run(cli, folder, "run", f"{name}.toml", "--out", name, "--no-certify")
    return read_cache(folder / name / f"{name}.pc2")[-1]


def panel(view, shapes, level, words):
    picture = draw(view, shapes, level)
    ImageDraw.Draw(picture).text((12, 10), words, fill=INK, font=font(15))
    return picture


def save(path, panels):
    row = Image.new("RGB", (len(panels) * SIZE[0], SIZE[1]))
    for k, one in enumerate(panels):
        row.paste(one, (k * SIZE[0], 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    row.quantize(256).save(path, optimize=True)
    print(path)


def view_of(all_points, up, **angles):
    points = np.concatenate(all_points)
    return View(points.min(axis=0), points.max(axis=0), SIZE, up=up, **angles), points[:, up].min() - 0.02 * np.ptp(points[:, 0])


def draw_leaf_and_card(cli, folder, out):
    down = "[0, 0, -9.81]"
    triangles, veins = make_leaf(folder)
    colors = np.tile(np.array(LEAF), (2, ROWS * COLUMNS, 1))  # of vertices, and between them
    colors[1, veins] = VEIN
    leaves = [(shape(cli, folder, name, LEAF_SCENE + more, down), words)
              for name, more, words in (("plain", "", "a leaf of one thickness"), ("veined", VEINS, "thicker veins, folded by 25°"), ("curled", CURLED, "thicker veins, rests curled"))]
    view, level = view_of([points for points, _ in leaves], 2, azimuth=-50, elevation=24)
    panels = [panel(view, [(points, triangles, colors[min(k, 1)][triangles])], level, words) for k, (points, words) in enumerate(leaves)]
    faces = make_card(folder)
    card = shape(cli, folder, "card", CARD_SCENE, down)
    halves = [(card, half, CARD) for half in np.split(faces, 2)]  # each shaded by itself, so that the fold is sharp
    view, level = view_of([card], 2, azimuth=-60, elevation=24)
    save(out / "materials_leaf.png", panels + [panel(view, halves, level, "a card folded to 90°")])


def draw_growth(cli, folder, out):
    down = "[0, 0, -9.81]"
    triangles, _ = make_leaf(folder)
    along, across = np.repeat(np.linspace(0, 1, ROWS), COLUMNS), np.abs(np.tile(np.linspace(-1, 1, COLUMNS), ROWS))
    write_list(folder / "rim.txt", np.round(1 + 0.2 * across ** 6 * np.sin(np.pi * along), 6))
    leaves = [(shape(cli, folder, name, STIFF_LEAF + more, down), words)
              for name, more, words in (("flat", "", "a leaf as it is drawn"), ("ruffled", GROWN.format("rim"), "its rim grew by 20 %"))]
    view, level = view_of([points for points, _ in leaves], 2, azimuth=-50, elevation=30)
    panels = [panel(view, [(points, triangles, LEAF)], level, words) for points, words in leaves]
    faces, share = make_disk(folder)
    write_list(folder / "edge.txt", np.round(1 + 0.25 * share ** 6, 6))
    write_list(folder / "middle_grew.txt", np.round(1.1 - 0.1 * share ** 2, 6))
    disks = [(shape(cli, folder, name, DISK_SCENE + GROWN.format(grown), down), words)
             for name, grown, words in (("rim", "edge", "a disk whose rim grew by 25 %"), ("bowl", "middle_grew", "whose middle grew by 10 %"))]
    view, level = view_of([points for points, _ in disks], 2, azimuth=-50, elevation=30)
    panels += [panel(view, [(points, faces, (206, 150, 120))], level, words) for points, words in disks]
    save(out / "materials_growth.png", panels)


def draw_hats(cli, folder, out):
    triangles = make_hat(folder)
    kinds = (("felt", FELT, "felt", (116, 76, 190)), ("brim", FELT + BRIM, "felt with a stiff brim", (150, 84, 160)), ("steel", STEEL, "steel", (146, 156, 170)))
    hats = [(shape(cli, folder, name, HAT_SCENE + more, "[0, -9.81, 0]"), words, color) for name, more, words, color in kinds]
    view, level = view_of([points for points, _, _ in hats], 1, azimuth=30, elevation=12)
    save(out / "materials_hat.png", [panel(view, [(points, triangles, color)], level, words) for points, words, color in hats])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        draw_leaf_and_card(args.cli.resolve(), Path(folder), args.out)
        draw_growth(args.cli.resolve(), Path(folder), args.out)
        draw_hats(args.cli.resolve(), Path(folder), args.out)


if __name__ == "__main__":
    main()
