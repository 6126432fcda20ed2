#!/usr/bin/env python3
"""Alembic of a USD file of the command line or the farm: run in Blender, or by a Python that has bpy.

    usd_to_alembic.py leaf.usda leaf.abc
    usd_to_alembic.py --fps 24 shot.usdc shot.abc

Points of every frame, faces and texture coordinates come along. Blender goes by z upward and turns what has y upward.
"""

import argparse
import re
import sys
from pathlib import Path

import bpy


def frames_a_second(source):
    """What a file in text says; None of one in bytes. Blender takes the range of frames from a file, and not their rate."""
    with open(source, "rb") as file:
        found = re.search(rb"\n\s*timeCodesPerSecond = ([0-9.e+-]+)", file.read(4096))
    return float(found[1]) if found else None


def convert(source, target, rate):
    """Reads the file into an empty scene, and exports all frames that it has."""
    bpy.ops.wm.read_homefile(use_empty=True)
    if bpy.ops.wm.usd_import(filepath=str(source), set_frame_range=True, import_cameras=False, import_lights=False) != {"FINISHED"}:
        sys.exit(f"usd_to_alembic: {source} could not be read")
    scene = bpy.context.scene
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    if not any(item.type == "MESH" for item in scene.objects):
        sys.exit(f"usd_to_alembic: {source} has no mesh; of a layer that lies over an asset, take the stage with both")
    bpy.ops.wm.alembic_export(filepath=str(target), start=scene.frame_start, end=scene.frame_end, uvs=True, normals=True,
                              as_background_job=False)
    print(f"usd_to_alembic: {target}: frames {scene.frame_start} to {scene.frame_end}")


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("source", type=Path, help="USD file")
    options.add_argument("target", type=Path, help="Alembic file to write")
    options.add_argument("--fps", type=float, help="frames a second (a .usda file says it)")
    given = options.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    if not given.source.is_file():
        sys.exit(f"usd_to_alembic: {given.source}: there is no such file")
    rate = given.fps or frames_a_second(given.source)
    if not rate:
        sys.exit(f"usd_to_alembic: {given.source} does not say its frames a second in text: give --fps")
    convert(given.source.resolve(), given.target.resolve(), rate)


if __name__ == "__main__":
    main()
