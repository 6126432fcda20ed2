#!/usr/bin/env python3
"""The first scene of docs/guide/blender.md, step by step, without a window: run in Blender, or by a Python that has bpy.

    first_scene.py --out out/blender [--frames 90] [--size 400 300] [--samples 16]

The dinosaur stands on its feet, is shaken, baked, exported to Alembic and USD, read back, and drawn; a sheet of paper is
led by an empty in the wind. The add-on must be installed; with --addon ZIP it is installed first. What is written: the
blend files, caches, exports, stills, and dinosaur.png, sheet.png of three stills each.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
import numpy
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[2]
CLAY, PAPER, GROUND = (0.16, 0.33, 0.2, 1), (0.6, 0.5, 0.33, 1), (0.5, 0.5, 0.52, 1)


def install(addon):
    """Installs the add-on from a zip, if one is given: Blender as a module begins without the user's add-ons."""
    if addon:
        bpy.ops.extensions.package_install_files(filepath=str(addon), repo="user_default", enable_on_install=True)


def empty_scene(frames):
    """A new file of `frames` frames at 30 a second."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, frames, 30
    return scene


def shake(obj, frames):
    """Keys a motion that swells and dies away, as a hand that holds the feet would make it."""
    for frame in range(1, frames + 1):
        t, end = (frame - 1) / 30, (frames - 1) / 30
        swell = math.sin(math.pi * t / end) ** 2
        obj.location = (swell * (5 * math.sin(4.2 * t) + 2 * math.sin(8.6 * t + 0.7)), swell * 4 * math.sin(5.1 * t), 0)
        obj.keyframe_insert("location", frame=frame)


def dinosaur(frames):
    """Steps 1 to 4 of the page: mesh, feet, settings, motion. Centimetres, grams, seconds."""
    bpy.ops.wm.obj_import(filepath=str(ROOT / "tests" / "data" / "meshes" / "dinosaur.obj"))
    obj = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = obj
    feet = [v.index for v in obj.data.vertices if v.co.y < 0.02]
    obj.vertex_groups.new(name="feet").add(feet, 1.0, "REPLACE")
    shell = obj.shellwarp
    shell.enabled, shell.fixed_group, shell.modes, shell.gravity = True, "feet", 4, 0.0
    shell.density, shell.k_bend, shell.k_length, shell.k_area = 0.5, 1e4, 1e6, 1e6
    shell.damping_ratio, shell.frame_end = 0.04, frames
    shake(obj, frames)
    return obj


def sheet(frames):
    """A sheet of paper, 30 x 20 cm, clamped along an edge, a corner led round by an empty, in the wind. Metres, kilograms."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=45, y_subdivisions=30, size=1)
    obj = bpy.context.object
    obj.scale = (0.3, 0.2, 1)
    bpy.ops.object.transform_apply(scale=True)
    edge = [v.index for v in obj.data.vertices if v.co.x < -0.149]
    obj.vertex_groups.new(name="edge").add(edge, 1.0, "REPLACE")
    shell = obj.shellwarp
    shell.enabled, shell.clamped_group, shell.modes, shell.damping_ratio = True, "edge", 24, 0.08
    shell.density, shell.k_bend, shell.k_length, shell.k_area = 0.2, 3e-4, 2e3, 2e3
    shell.wind, shell.air_density, shell.frame_end = (0, 0.8, 0.3), 1.2, frames
    corner = max(obj.data.vertices, key=lambda v: v.co.x + v.co.y).index
    bpy.ops.shellwarp.add_handle(vertex=corner)
    lead = obj.shellwarp.handles[0].target
    start = lead.location.copy()
    for frame in range(1, frames + 1):
        t = min(1.0, (frame - 1) / 45)
        lead.location = start + Vector((-0.012, 0, 0.07)) * (t * t * (3 - 2 * t)) + Vector((0, 0.008, 0)) * math.sin(0.12 * frame) * t
        lead.keyframe_insert("location", frame=frame)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.005)  # so that the empty is seen in the picture
    ball = bpy.context.object
    ball.parent, ball.location = lead, (0, 0, 0)
    bpy.ops.object.shade_smooth()
    paint(ball, (0.9, 0.55, 0.05, 1))
    choose(obj)
    return obj


def choose(obj):
    """Selects an object, no other, and makes it the active one."""
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def paint(obj, colour):
    material = bpy.data.materials.new(obj.name)
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = colour
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.6
    obj.data.materials.clear()
    obj.data.materials.append(material)


def box(obj):
    """What is seen of an object, in the world: its lowest and highest corner, and its points."""
    item = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = numpy.empty((len(item.data.vertices), 3), numpy.float32)
    item.data.vertices.foreach_get("co", points.ravel())
    m = numpy.array(item.matrix_world)
    points = points @ m[:3, :3].T + m[:3, 3]
    return points.min(axis=0), points.max(axis=0), points


def stage(obj, direction, floor):
    """Camera, sun, sky and, with `floor`, a ground for an object at rest."""
    scene, (low, high, _) = bpy.context.scene, box(obj)
    middle, size = Vector((low + high) / 2), float(numpy.linalg.norm(high - low))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = middle + Vector(direction).normalized() * size * 1.65
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.clip_start, camera.data.clip_end = size * 1e-3, size * 100
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 2.4, 0.15, (0.7, 0.25, 0.9)
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.75, 0.82, 0.9, 1)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.6
    if floor:
        bpy.ops.mesh.primitive_plane_add(size=size * 30, location=(*middle.xy, float(low[2])))
        paint(bpy.context.object, GROUND)


def draw(path, frames, size, samples):
    """Stills of these frames side by side, by Cycles on the processor."""
    scene = bpy.context.scene
    render = scene.render
    render.engine, scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CYCLES", "CPU", samples, 1
    scene.cycles.use_denoising = True
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    scene.view_settings.view_transform = "Standard"
    stills = []
    for frame in frames:
        scene.frame_set(frame)
        render.filepath = str(path.with_name(f"{path.stem}_{frame:04d}.png"))
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(render.filepath)
        stills.append(numpy.array(image.pixels[:], numpy.float32).reshape(size[1], size[0], 4))
    joined = numpy.concatenate(stills, axis=1)
    out = bpy.data.images.new(path.stem, joined.shape[1], joined.shape[0])
    out.pixels.foreach_set(joined.ravel())
    out.filepath_raw, out.file_format = str(path), "PNG"
    out.save()


def difference(obj, path, frames, load):
    """The largest difference in the world between a shell and its export read back into the same file, frame by frame."""
    scene, known = bpy.context.scene, set(bpy.data.objects)
    load(filepath=str(path))
    back = next(o for o in set(bpy.data.objects) - known if o.type == "MESH")
    worst = 0.0
    for frame in frames:
        scene.frame_set(frame)
        worst = max(worst, float(numpy.abs(box(obj)[2] - box(back)[2]).max()))
    for item in set(bpy.data.objects) - known:
        bpy.data.objects.remove(item)
    choose(obj)
    return worst


def make(name, build, colour, direction, floor, given):
    """One scene from the empty file to the pictures."""
    scene = empty_scene(given.frames)
    obj = build(given.frames)
    obj.name = name
    bpy.ops.object.shade_smooth()
    paint(obj, colour)
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / f"{name}.blend"))
    for press in (bpy.ops.shellwarp.precompute, bpy.ops.shellwarp.bake):
        if press() != {"FINISHED"}:
            sys.exit(f"{press.idname()} failed")
    chosen = [1, given.frames // 2, given.frames * 3 // 4]
    for ending, load in (("abc", lambda **k: bpy.ops.wm.alembic_import(as_background_job=False, **k)), ("usdc", bpy.ops.wm.usd_import)):
        path = given.out / f"{name}.{ending}"
        bpy.ops.shellwarp.export(filepath=str(path))
        print(f"first_scene: {path.name} comes back within {difference(obj, path, chosen, load):.2g} of a size of "
              f"{max(obj.dimensions):.3g}")
    scene.frame_set(1)
    stage(obj, direction, floor)
    bpy.ops.wm.save_mainfile()
    draw(given.out / f"{name}.png", chosen, given.size, given.samples)


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--addon", type=Path, help="the add-on's zip, to be installed first")
    options.add_argument("--frames", type=int, default=90)
    options.add_argument("--size", type=int, nargs=2, default=(400, 300))
    options.add_argument("--samples", type=int, default=16)
    given = options.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    given.out = given.out.resolve()
    given.out.mkdir(parents=True, exist_ok=True)
    install(given.addon)
    make("dinosaur", dinosaur, CLAY, (0.75, -1, 0.35), True, given)
    make("sheet", sheet, PAPER, (0.7, -1, 0.75), False, given)


if __name__ == "__main__":
    main()
