#!/usr/bin/env python3
"""The scene `character` of the command-line host in Blender: hat, shirt and trouser legs that float freely and are led at
their joints by empties, which hang on the bones of a dancing skeleton.

    character_scene.py --out out/blender [--addon ZIP] [--frames 130] [--size 300 400] [--samples 16]

Each bone is an empty under its parent, keyed from tests/scenes/character.toml; each shell's object hangs on the bone that is
its support frame, each of its handles on the bone that leads it. Writes character.blend, the caches, character.abc and
character.png. The add-on must be installed; with --addon ZIP it is installed first.
"""

import argparse
import math
import sys
import tomllib
from pathlib import Path

import bpy
import numpy
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).resolve().parent))
from first_scene import ROOT, choose, draw, empty_scene, install, paint, stage

sys.path.insert(0, str(ROOT / "host_examples" / "render"))
import figure  # noqa: E402 - the body that the command line's pictures have

SCENE = ROOT / "tests" / "scenes" / "character.toml"
RATE = 30  # frames a second; the scene steps at 60, so two steps a frame
COLOURS = {"hat": (0.42, 0.23, 0.08, 1), "torso": (0.55, 0.1, 0.08, 1), "leg_left": (0.06, 0.11, 0.25, 1),
           "leg_right": (0.06, 0.11, 0.25, 1)}


def swell(bone, t):
    """The envelope of frame_motion.hpp: rises and falls back with two continuous derivatives."""
    def ramp(x):
        x = min(1.0, max(0.0, x))
        return x * x * x * (10 - 15 * x + 6 * x * x)
    return ramp(t / bone["rise"]) * ramp((bone["end"] - t) / bone["fall"])


def waves(terms, t):
    """Sum of the sinusoids of a motion, a vector."""
    total = Vector()
    for term in terms:
        phase = math.radians(term.get("phase_degrees", 0))
        total += Vector(term["axis"]) * term["amplitude"] * math.sin(2 * math.pi * term["frequency"] * t + phase)
    return total


def add_bones(data, frames):
    """Empties under a root that turns y up into Blender's z up; at frame 1 all are at rest."""
    root = bpy.data.objects.new("skeleton", None)
    root.rotation_euler = (math.pi / 2, 0, 0)
    bpy.context.scene.collection.objects.link(root)
    bones = {}
    for bone in data["bone"]:
        parent, joint = bones.get(bone.get("parent")), Vector(bone["joint"])
        empty = bpy.data.objects.new(bone["name"], None)
        bpy.context.scene.collection.objects.link(empty)
        empty.rotation_mode, empty.empty_display_size = "QUATERNION", 4
        empty.parent = parent[0] if parent else root
        rest = joint - (parent[1] if parent else Vector())
        for frame in range(1, frames + 1):
            t = (frame - 1) / RATE
            turn = swell(bone, t) * waves(bone.get("rotate_degrees", []), t) * (math.pi / 180)
            empty.location = rest + swell(bone, t) * waves(bone.get("translate", []), t)
            empty.rotation_quaternion = Matrix.Rotation(turn.length, 3, turn if turn.length else Vector((1, 0, 0))).to_quaternion()
            empty.keyframe_insert("location", frame=frame)
            empty.keyframe_insert("rotation_quaternion", frame=frame)
        bones[bone["name"]] = (empty, joint)
    bpy.context.scene.frame_set(1)
    return bones


def add_body(bones):
    """The body of the other pictures, so that somebody wears the shells."""
    for number, (name, start, end, radii, colour) in enumerate(figure.SOLIDS):
        points, triangles = figure.solid_mesh(start, end, radii)
        empty, joint = bones[name]
        mesh = bpy.data.meshes.new(f"body_{number}")
        mesh.from_pydata((points - numpy.array(joint)).tolist(), [], triangles.tolist())
        mesh.shade_smooth()
        solid = bpy.data.objects.new(mesh.name, mesh)
        bpy.context.scene.collection.objects.link(solid)
        solid.parent = empty
        paint(solid, COLOURS["leg_left"] if colour == figure.DENIM else linear(colour))


def linear(colour):
    """#rrggbb as Blender's shaders take it."""
    shares = [int(colour[k:k + 2], 16) / 255 for k in (1, 3, 5)]
    return tuple(s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares) + (1,)


def add_shell(shell, data, bones, frames):
    """One shell on its bone, with its handles."""
    bpy.ops.wm.obj_import(filepath=str((SCENE.parent / shell["mesh"]).resolve()), forward_axis="Y", up_axis="Z")
    obj = bpy.context.selected_objects[0]
    bpy.ops.object.shade_smooth()
    obj.name = shell["name"]
    obj.parent, joint = bones[shell["frame"]]
    obj.location = -joint
    choose(obj)
    settings, material, simulation = obj.shellwarp, shell["material"], data["simulation"]
    settings.enabled, settings.live, settings.modes = True, False, shell["modes"]
    settings.density, settings.k_bend = material["density"], material["k_bend"]
    settings.k_length, settings.k_area = material["k_length"], material["k_area"]
    settings.damping_ratio, settings.integrator = shell["damping"]["ratio"], simulation["integrator"]
    settings.steps_per_frame, settings.frame_end = simulation["frame_rate"] // RATE, frames
    points = numpy.array([v.co for v in obj.data.vertices])
    for attach in shell["attach"]:
        vertex = int(((points - attach["nearest"]) ** 2).sum(axis=1).argmin())
        bpy.ops.shellwarp.add_handle(vertex=vertex)
        item = settings.handles[-1]
        item.kind = attach["kind"].upper()
        item.target.empty_display_size = 2
        bone = bones[attach["bone"]][0]
        item.target.parent, item.target.matrix_parent_inverse = bone, bone.matrix_world.inverted()
    paint(obj, COLOURS[shell["name"]])
    return obj


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--addon", type=Path, help="the add-on's zip, to be installed first")
    options.add_argument("--frames", type=int, default=130)
    options.add_argument("--size", type=int, nargs=2, default=(300, 400))
    options.add_argument("--samples", type=int, default=16)
    given = options.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    given.out = given.out.resolve()
    given.out.mkdir(parents=True, exist_ok=True)
    install(given.addon)
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    scene = empty_scene(given.frames)
    scene.gravity = (0, 0, data["simulation"]["gravity"][1])
    bones = add_bones(data, given.frames)
    shells = [add_shell(shell, data, bones, given.frames) for shell in data["shell"]]
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / "character.blend"))
    for obj in shells:
        choose(obj)
        if bpy.ops.shellwarp.bake() != {"FINISHED"}:
            sys.exit(f"character_scene: {obj.name} could not be baked")
    for obj in shells:
        obj.select_set(True)
    bpy.ops.shellwarp.export(filepath=str(given.out / "character.abc"))
    scene.frame_set(1)
    add_body(bones)
    stage(shells[1], (0.5, -1, 0.12), False)
    scene.camera.location = Vector((-30, 0, 105)) + Vector((0.45, -1, 0.1)).normalized() * 345
    scene.camera.rotation_euler = (Vector((0, 6, 95)) - scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.mesh.primitive_plane_add(size=4000, location=(0, 0, 0))
    paint(bpy.context.object, (0.5, 0.5, 0.52, 1))
    bpy.ops.wm.save_mainfile()
    draw(given.out / "character.png", [1, given.frames * 43 // 130, given.frames * 100 // 130, given.frames], given.size, given.samples)


if __name__ == "__main__":
    main()
