#!/usr/bin/env python3
"""A curtain on a rail of three bones, as in docs/guide/blender.md: run in Blender, or by a Python that has bpy.

    follow_scene.py --out out/blender [--addon ZIP] [--frames 60] [--size 400 300] [--samples 16]

The bones bend and sway; the curtain's upper rows follow them by an Armature modifier, the rest swings. It is baked and drawn:
follow.blend, follow.png.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
import numpy
from first_scene import choose, draw, empty_scene, install, paint, stage
from mathutils import Matrix

WIDTH, HEIGHT, COLUMNS, ROWS, BONES = 0.6, 0.4, 42, 28, 3
CLOTH, RAIL = (0.55, 0.12, 0.1, 1), (0.25, 0.25, 0.28, 1)
JOINT = 0.05  # m, over which one bone's weight gives way to the next


def weight(bone, x):
    """How much of a bone a place along the rail has."""
    length = WIDTH / BONES
    low = 1.0 if bone == 0 else min(1.0, max(0.0, (x - bone * length) / JOINT + 0.5))
    high = 1.0 if bone == BONES - 1 else min(1.0, max(0.0, ((bone + 1) * length - x) / JOINT + 0.5))
    return min(low, high)


def curtain(frames):
    """A sheet that hangs, its first two rows held, of heavy card."""
    points = [(WIDTH * i / COLUMNS, 0.0, -HEIGHT * j / ROWS) for j in range(ROWS + 1) for i in range(COLUMNS + 1)]
    wide = COLUMNS + 1
    quads = [(a, a + wide, a + wide + 1, a + 1) for j in range(ROWS) for a in range(wide * j, wide * j + COLUMNS)]
    mesh = bpy.data.meshes.new("curtain")
    mesh.from_pydata(points, [], quads)
    obj = bpy.data.objects.new("curtain", mesh)
    bpy.context.scene.collection.objects.link(obj)
    choose(obj)
    obj.vertex_groups.new(name="rail").add(list(range(2 * wide)), 1.0, "REPLACE")
    for bone in range(BONES):
        group = obj.vertex_groups.new(name=f"bone {bone}")
        for i, (x, _, _) in enumerate(points):
            group.add([i], weight(bone, x), "REPLACE")
    shell = obj.shellwarp
    shell.enabled, shell.fixed_group, shell.modes, shell.frame_end = True, "rail", 24, frames
    shell.density, shell.k_bend, shell.k_length, shell.k_area, shell.damping_ratio = 0.25, 4e-4, 2e3, 2e3, 0.08
    shell.method = "shell-implicit"
    return obj


def rail(frames):
    """Bones in a row: they bend about the vertical one after the other, and the first sways. Each carries a rod."""
    data = bpy.data.armatures.new("rail")
    rig = bpy.data.objects.new("rail", data)
    bpy.context.scene.collection.objects.link(rig)
    choose(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    for k in range(BONES):
        bone = data.edit_bones.new(f"bone {k}")
        bone.head, bone.tail = (WIDTH * k / BONES, 0, 0), (WIDTH * (k + 1) / BONES, 0, 0)
        if k:
            bone.parent, bone.use_connect = data.edit_bones[f"bone {k - 1}"], True
    bpy.ops.object.mode_set(mode="OBJECT")
    for k, bone in enumerate(rig.pose.bones):
        rest = bone.bone.matrix_local.to_3x3()
        for frame in range(1, frames + 1):
            t = (frame - 1) / 30
            swell = 1 - math.cos(math.pi * min(1.0, t))
            angle = swell * (0.12 * math.sin(4 * t) if k == 0 else 0.2 + 0.14 * math.sin(4 * t + k))
            bone.rotation_quaternion = (rest.inverted() @ Matrix.Rotation(angle, 3, "Z") @ rest).to_quaternion()
            bone.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.frame_set(1)
    for bone in rig.pose.bones:
        middle = (bone.head + bone.tail) / 2
        bpy.ops.mesh.primitive_cylinder_add(radius=0.008, depth=WIDTH / BONES, location=middle, rotation=(0, math.pi / 2, 0))
        rod = bpy.context.object
        there = rod.matrix_world.copy()
        rod.parent, rod.parent_type, rod.parent_bone = rig, "BONE", bone.name
        bpy.context.view_layer.update()
        rod.matrix_world = there
        paint(rod, RAIL)
    return rig


def missed(obj, frames):
    """How far the shell's held vertices are from where the armature alone has them, at worst, in metres."""
    twin = bpy.data.objects.new("twin", obj.data.copy())
    bpy.context.scene.collection.objects.link(twin)
    for group in obj.vertex_groups:
        twin.vertex_groups.new(name=group.name)
    twin.modifiers.new("Armature", "ARMATURE").object = obj.modifiers["Armature"].object
    worst = 0.0
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        places = [numpy.array([v.co for v in list(item.evaluated_get(graph).data.vertices)[:2 * (COLUMNS + 1)]]) for item in (obj, twin)]
        worst = max(worst, float(numpy.abs(places[0] - places[1]).max()))
    bpy.data.objects.remove(twin)
    return worst


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
    rig, obj = rail(given.frames), curtain(given.frames)
    obj.modifiers.new("Armature", "ARMATURE").object = rig
    choose(obj)
    bpy.ops.object.shade_smooth()
    paint(obj, CLOTH)
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / "follow.blend"))
    if bpy.ops.shellwarp.bake() != {"FINISHED"}:
        sys.exit("follow_scene: the curtain could not be baked")
    chosen = [1, given.frames // 2, given.frames]
    print(f"follow_scene: held vertices are within {missed(obj, chosen):.1g} m of the armature's; {obj.shellwarp.verdict}")
    scene.frame_set(1)
    stage(obj, (0.5, -1, 0.35), False)
    bpy.ops.wm.save_mainfile()
    draw(given.out / "follow.png", chosen, given.size, given.samples)


if __name__ == "__main__":
    main()
