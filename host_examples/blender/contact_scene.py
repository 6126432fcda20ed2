#!/usr/bin/env python3
"""A leaf on a ball, as in docs/guide/blender.md: run in Blender, or by a Python that has bpy.

    contact_scene.py --out out/blender [--addon ZIP] [--frames 60] [--size 400 300] [--samples 16]

A leaf of card, clamped at its stem, falls on a ball that then rises. It is baked and drawn: contact.blend, contact.png.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
from first_scene import choose, draw, empty_scene, install, paint, stage

LENGTH, WIDTH, ROWS = 0.3, 0.14, 48  # m, m, and how many rows of eight quads along the leaf
LEAF, BALL = (0.12, 0.36, 0.06, 1), (0.8, 0.32, 0.08, 1)


def leaf(frames):
    """A pointed oval, its first rows clamped, of a known material."""
    points = []
    for i in range(ROWS + 1):
        t = i / ROWS
        half = WIDTH / 2 * math.sin(math.pi * (0.05 + 0.94 * t ** 0.8)) ** 0.8
        points += [(LENGTH * t, half * j / 4, 0.0) for j in range(-4, 5)]
    quads = [(a, a + 9, a + 10, a + 1) for i in range(ROWS) for a in range(9 * i, 9 * i + 8)]
    mesh = bpy.data.meshes.new("leaf")
    mesh.from_pydata(points, [], quads)
    obj = bpy.data.objects.new("leaf", mesh)
    bpy.context.scene.collection.objects.link(obj)
    choose(obj)
    obj.vertex_groups.new(name="stem").add(list(range(18)), 1.0, "REPLACE")
    shell = obj.shellwarp
    shell.enabled, shell.clamped_group, shell.modes, shell.frame_end = True, "stem", 32, frames
    shell.material, shell.preset, shell.thickness, shell.damping_ratio = "PRESET", "card", 1.5e-4, 0.15
    shell.method = "rotation-strain"
    return obj


def ball(frames):
    """It stands under the leaf and rises in the second half."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.06, location=(0.13, 0, -0.075))
    obj = bpy.context.object
    bpy.ops.object.shade_smooth()
    obj.keyframe_insert("location", frame=frames // 2)
    obj.location.z += 0.05
    obj.keyframe_insert("location", frame=frames - 5)
    role = obj.shellwarp_collider
    role.enabled, role.shape, role.friction, role.thickness = True, "SPHERE", 0.3, 1e-3
    paint(obj, BALL)
    return obj


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--addon", type=Path, help="the add-on's zip, to be installed first")
    options.add_argument("--frames", type=int, default=60)
    options.add_argument("--size", type=int, nargs=2, default=(400, 300))
    options.add_argument("--samples", type=int, default=16)
    given = options.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    given.out = given.out.resolve()
    given.out.mkdir(parents=True, exist_ok=True)
    install(given.addon)
    scene = empty_scene(given.frames)
    scene.gravity = (0, 0, -9.8)
    ball(given.frames)
    obj = leaf(given.frames)
    bpy.ops.object.shade_smooth()
    paint(obj, LEAF)
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / "contact.blend"))
    if bpy.ops.shellwarp.bake() != {"FINISHED"}:
        sys.exit("contact_scene: the leaf could not be baked")
    scene.frame_set(given.frames)
    stage(obj, (0.2, -1, 0.4), False)
    bpy.ops.wm.save_mainfile()
    draw(given.out / "contact.png", [1, given.frames // 2, given.frames], given.size, given.samples)


if __name__ == "__main__":
    main()
