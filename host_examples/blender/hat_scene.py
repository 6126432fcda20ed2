#!/usr/bin/env python3
"""A hat on a head, linked from an asset's file, as in docs/guide/blender.md: run in Blender, or by a Python that has bpy.

    hat_scene.py --out out/blender [--addon ZIP] [--frames 72] [--size 400 360] [--samples 16]

hat_asset.blend has a felt hat whose crown is pinned, on an empty with a head that it touches. hat.blend links it as a library override: the
shot keys the empty to nod, and a ball lifts the brim. The override is baked and drawn: hat.png. Centimetres, grams, seconds.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
from first_scene import ROOT, choose, draw, empty_scene, install, paint, stage

FELT, SKIN, BALL = (0.42, 0.23, 0.08, 1), (0.62, 0.42, 0.32, 1), (0.1, 0.3, 0.55, 1)
NECK = (0, 6, 146)  # the head turns about it


def collide(obj, shape):
    """Lets shells touch an object."""
    role = obj.shellwarp_collider
    role.enabled, role.shape, role.friction, role.thickness = True, shape, 0.3, 0.2


def asset(path, frames):
    """The file of the asset: the hat, the head that it sits on, and the empty that carries both."""
    scene = empty_scene(frames)
    bpy.ops.wm.obj_import(filepath=str(ROOT / "tests" / "data" / "meshes" / "character_hat.obj"), forward_axis="NEGATIVE_Z", up_axis="Y")
    hat = bpy.context.selected_objects[0]
    choose(hat)
    bpy.ops.object.transform_apply(rotation=True)
    bpy.ops.object.shade_smooth()
    hat.name = "hat"
    paint(hat, FELT)
    crown = [v.index for v in hat.data.vertices if v.co.z > 172]
    hat.vertex_groups.new(name="crown").add(crown, 1.0, "REPLACE")
    shell = hat.shellwarp
    shell.enabled, shell.fixed_group, shell.modes, shell.frame_end = True, "crown", 32, frames
    shell.density, shell.k_bend, shell.k_length, shell.k_area, shell.damping_ratio = 0.05, 1400, 2e5, 2e5, 0.08
    shell.method, shell.reduced_fields, shell.steps_per_frame = "polynomial-shell", 40, 2
    bpy.ops.mesh.primitive_uv_sphere_add(segments=20, ring_count=12, radius=1, location=(0, 6, 163))  # a hull has at most 512 triangles
    head = bpy.context.object
    head.name, head.scale = "face", (9.5, 11, 14)
    bpy.ops.object.transform_apply(scale=True)
    bpy.ops.object.shade_smooth()
    paint(head, SKIN)
    collide(head, "HULL")
    neck = bpy.data.objects.new("head", None)
    neck.location, neck.empty_display_size = NECK, 20
    scene.collection.objects.link(neck)
    bpy.context.view_layer.update()
    for item in (hat, head):
        item.parent, item.matrix_parent_inverse = neck, neck.matrix_world.inverted()
    whole = bpy.data.collections.new("hat and head")
    scene.collection.children.link(whole)
    for item in (neck, hat, head):
        scene.collection.objects.unlink(item)
        whole.objects.link(item)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def shot(path, frames):
    """The file of the shot: the asset as an override, which nods; a ball."""
    scene = empty_scene(frames)
    scene.gravity = (0, 0, -981)
    with bpy.data.libraries.load(str(path), link=True) as (_, data):
        data.collections = ["hat and head"]
    data.collections[0].override_hierarchy_create(scene, bpy.context.view_layer)
    there = {item.name: item for item in scene.objects}
    neck = there["head"]
    for frame in range(1, frames + 1):
        t = (frame - 1) / (frames - 1)
        swell = math.sin(math.pi * min(1.0, 1.6 * t)) ** 2 if t < 0.625 else 0.0
        neck.rotation_euler = (0.28 * swell * math.sin(11 * t), 0.2 * swell * math.sin(17 * t), 0.5 * swell * math.sin(6 * t))
        neck.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=4, location=(-17, -8, 140))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    paint(ball, BALL)
    collide(ball, "SPHERE")
    for frame, height in ((frames // 2, 140), (frames - 6, 164)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    choose(there["hat"])
    return there["hat"], ball


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--addon", type=Path, help="the add-on's zip, to be installed first")
    options.add_argument("--frames", type=int, default=72)
    options.add_argument("--size", type=int, nargs=2, default=(400, 360))
    options.add_argument("--samples", type=int, default=16)
    given = options.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    given.out = given.out.resolve()
    given.out.mkdir(parents=True, exist_ok=True)
    install(given.addon)
    library = given.out / "hat_asset.blend"
    asset(library, given.frames)
    before = library.read_bytes()
    hat, _ball = shot(library, given.frames)
    hat.shellwarp.cache = str(given.out / "hat.pc2")
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / "hat.blend"))
    if bpy.ops.shellwarp.bake() != {"FINISHED"}:
        sys.exit("hat_scene: the hat could not be baked")
    print(f"hat_scene: {hat.shellwarp.verdict}")
    if library.read_bytes() != before:
        sys.exit("hat_scene: the asset was written to")
    bpy.context.scene.frame_set(1)
    stage(hat, (0.25, -1, 0.02), False)
    camera = bpy.context.scene.camera
    camera.location.z -= 4
    camera.data.lens = 66
    bpy.ops.wm.save_mainfile()
    draw(given.out / "hat.png", [1, given.frames * 22 // 72, given.frames], given.size, given.samples)


if __name__ == "__main__":
    main()
