#!/usr/bin/env python3
"""Makes the README's animation: docs/pictures/shellwarp.webp. `make pictures` calls it.

    pictures.py --cli build/bin/shellwarp --out docs/pictures/shellwarp.webp

On the left the leaf of `shellwarp new-scene`, led around by its tip; on the right the scene `character`, whose trousers touch its legs as in
`character_body`. Both repeat after 2.5 s, of which the second turn is shown. Takes about two minutes on one core; the renderer is not needed.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import figure
from meshes import read_obj
from paint import INK, font
from raster import View, draw

PERIOD, RATE = 2.5, 20       # seconds until all repeats; pictures a second
SIZE = (380, 360)            # of either half
LEAF, BALL = (92, 168, 74), (240, 185, 11)
SHELLS = {"character_hat": (116, 76, 190), "character_torso": (205, 66, 54), "character_body_leg_left": (52, 104, 184), "character_body_leg_right": (52, 104, 184)}
SCENES = Path(__file__).resolve().parents[2] / "tests" / "scenes"


def read_cache(path):
    """Positions (samples x points x 3) of a PC2 file."""
    data = Path(path).read_bytes()
    points, samples = np.frombuffer(data, "<i4", 1, 16)[0], np.frombuffer(data, "<i4", 1, 28)[0]
    return np.frombuffer(data, "<f4", samples * points * 3, 32).reshape(samples, points, 3).astype(float)


def run(cli, folder, *arguments):
    done = subprocess.run([cli, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"pictures: {' '.join(map(str, arguments))} failed:\n{done.stdout}{done.stderr}")


def leaf_path(folder):
    """The way of the tip, twice around: metres from its rest place. The leaf is lifted, laid over and let down."""
    turn = 2 * np.pi * np.arange(0, 2 * PERIOD + 0.05, 0.05) / PERIOD
    x, y, z = -0.026 * (1 - np.cos(turn)) / 2 - 0.004, 0.034 * np.sin(turn), 0.012 + 0.030 * np.sin(turn - 0.7)
    swell = np.minimum(1, np.arange(len(turn)) * 0.05 / 0.5)
    rows = np.stack([np.arange(len(turn)) * 0.05, swell * x, swell * y, swell * z], axis=-1)
    (folder / "path.txt").write_text("\n".join(" ".join(f"{v:.6f}" for v in row) for row in rows) + "\n", encoding="utf-8")
    return rows


def ball(center, radius, color):
    points, triangles = figure.ball()
    return center + radius * points, triangles, color


def leaf_frames(cli, folder):
    """Shapes of each picture, and the box that holds them."""
    run(cli, folder, "new-scene", "leaf.toml")
    path = leaf_path(folder)
    run(cli, folder, "simulate", "leaf.obj", "--pin", "low-x", "--up", "z", "--frequency", 5, "--density", 0.2, "--method", "polynomial-shell",
        "--damping-ratio", 0.1, "--handle", "high-x:path.txt", "--duration", 2 * PERIOD, "--step", 1 / 60, "--out", ".", "--no-certify", "-q")
    motion, (rest, triangles) = read_cache(folder / "leaf.pc2"), read_obj(folder / "leaf_rest.obj")
    tip_rest = rest[np.argmin(np.linalg.norm(rest - rest[rest[:, 0] > 0.0999].mean(axis=0), axis=1))]
    frames = []
    for k in range(round(PERIOD * RATE)):
        seconds = PERIOD + k / RATE
        tip = tip_rest + [np.interp(seconds, path[:, 0], path[:, c]) for c in (1, 2, 3)]
        frames.append([(motion[round(60 * seconds)], triangles, LEAF), ball(tip, 0.0022, BALL)])
    return frames, View(motion[150:].min(axis=(0, 1)), motion[150:].max(axis=(0, 1)), SIZE, azimuth=-62, elevation=20, up=2)


def character_frames(cli, folder):
    for scene in ("character", "character_body"):
        run(cli, folder, "run", SCENES / f"{scene}.toml", "--out", ".", "--frames", 450, "--no-certify", "-q")
    motions = {name: read_cache(folder / f"{name}.pc2") for name in SHELLS}
    triangles = {name: read_obj(folder / f"{name}_rest.obj")[1] for name in SHELLS}
    frames = []
    for k in range(round(PERIOD * RATE)):
        frame = round(60 * (2 * PERIOD + k / RATE))
        body = figure.write_body(figure.read_bones(folder / "character_bones.csv", frame), folder / "body")
        solids = [(*read_obj(path), tuple(int(color[c:c + 2], 16) for c in (1, 3, 5))) for path, color in body]
        frames.append([(motions[name][frame], triangles[name], color) for name, color in SHELLS.items()] + solids)
    points = np.concatenate([shape[0] for shapes in frames for shape in shapes])
    return frames, View(points.min(axis=0), points.max(axis=0), SIZE, azimuth=24, elevation=14, up=1, margin=1.06)


def level(view, frames):
    return min((shape[0] @ view.up).min() for shapes in frames for shape in shapes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", required=True, type=Path, help="the command-line program")
    parser.add_argument("--out", type=Path, default=Path("docs/pictures/shellwarp.webp"))
    parser.add_argument("--frames", type=int, help="only so many pictures, for a test")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, cli = Path(name), args.cli.resolve()
        leaf, leaf_view = leaf_frames(cli, folder)
        dancer, dancer_view = character_frames(cli, folder)
        low = level(leaf_view, leaf) - 0.02, level(dancer_view, dancer)
        pictures = []
        for k in range(args.frames or len(leaf)):
            picture = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
            picture.paste(draw(leaf_view, leaf[k], low[0]), (0, 0))
            picture.paste(draw(dancer_view, dancer[k], low[1]), (SIZE[0], 0))
            pen = ImageDraw.Draw(picture)
            for x, words in ((14, "a leaf, led by its tip"), (SIZE[0] + 14, "hat, shirt and trousers on a dancer")):
                pen.text((x, 12), words, fill=INK, font=font(15))
            pictures.append(picture)
            print(f"\rpictures: {k + 1} of {args.frames or len(leaf)}", end="", flush=True)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    pictures[0].save(args.out, save_all=True, append_images=pictures[1:], duration=1000 // RATE, loop=0, quality=72, method=6)
    print(f"\npictures: {args.out}, {args.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
