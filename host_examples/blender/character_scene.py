#!/usr/bin/env python3
"""The scene `character` of the command-line host in Blender: hat, shirt and trouser legs that float freely and are led at
their joints by empties, which hang on the bones of a dancing skeleton.

    character_scene.py --out out/blender [--addon ZIP] [--frames 130] [--size 300 400] [--samples 16]

Each bone is an empty under its parent, keyed from tests/scenes/character.toml; each shell's object hangs on the bone that is
its support frame, each of its handles on the bone that leads it. The body is what the shells touch. Writes character.blend, the caches, character.abc and
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
from first_scene import ROOT, box, choose, draw, empty_scene, install, paint, stage

sys.path.insert(0, str(ROOT / "host_examples" / "render"))
import figure  # noqa: E402 - the body that the command line's pictures have

SCENE = ROOT / "tests" / "scenes" / "character.toml"
# The legs of the trousers are tubes that are open at the top: a dome closes each, and a seat joins them, in which they turn. Drawn alone.
DOMES = [figure.ellipsoid(f"thigh_{side}", (8.4 * s, 87.8, -6.6), (7.55, 5.5, 9.5), figure.DENIM) for side, s in (("left", 1), ("right", -1))]
SEAT = ("pelvis", numpy.array((0, 83.0, -6.5)), numpy.array((0, 87.0, -6.5)), numpy.array((16.2, 5.5, 11)), figure.DENIM)
TOUCHED = {"hat": ("head",), "torso": (), "leg_left": ("thigh_left", "shin_left"), "leg_right": ("thigh_right", "shin_right")}  # bones
CLOTH, FRICTION = 0.2, 0.3  # half a thickness by which shells stay off the body, cm
SHOWS = 0.01  # cm of skin that nobody sees
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
    """The body of the other pictures, but for what fills its hips, and what closes the trousers; the solids of each bone that shells touch."""
    found = {}
    hips = [solid for solid in figure.SOLIDS if solid[-1] == figure.DENIM and (solid[1] == solid[2]).all()]
    for number, solid in enumerate(solid for solid in figure.SOLIDS if all(solid is not hip for hip in hips)):
        found.setdefault(solid[0], []).append(touched(add_solid(f"body_{number}", *solid[1:], *bones[solid[0]])))
    for number, solid in enumerate([SEAT, *DOMES]):
        add_solid(f"trousers_{number}", *solid[1:], *bones[solid[0]])
    return found


def touched(solid):
    """Gives a solid the role of a collider."""
    role, sides = solid.shellwarp_collider, numpy.array(solid.dimensions)
    role.enabled, role.friction, role.thickness = True, FRICTION, CLOTH
    role.shape = "CAPSULE" if sides[2] > 1.01 * sides[:2].max() and abs(sides[0] - sides[1]) < 0.01 * sides[0] else "MESH"
    return solid


def add_solid(name, start, end, radii, colour, empty, joint):
    """A solid on a bone, its z axis along its way, as colliders have capsules."""
    way = Vector(end - start)
    turn = way.to_track_quat("Z", "Y").to_matrix() if way.length else Matrix.Identity(3)
    middle = (start + end) / 2
    points, triangles = figure.solid_mesh(start, end, radii)
    mesh = bpy.data.meshes.new(name)
    kept, numbers = numpy.unique(points.round(6), axis=0, return_inverse=True)  # one vertex a pole, so that it is closed
    mesh.from_pydata(((kept - middle) @ numpy.array(turn)).tolist(), [], numbers.ravel()[triangles].tolist())
    mesh.shade_smooth()
    solid = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(solid)
    solid.parent, solid.location, solid.rotation_euler = empty, Vector(middle) - joint, turn.to_euler()
    paint(solid, COLOURS["leg_left"] if colour == figure.DENIM else linear(colour))
    return solid


def linear(colour):
    """#rrggbb as Blender's shaders take it."""
    shares = [int(colour[k:k + 2], 16) / 255 for k in (1, 3, 5)]
    return tuple(s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares) + (1,)


def add_shell(shell, data, bones, solids, frames):
    """One shell on its bone, with its handles and the solids that it touches."""
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
    settings.push_out = True  # what the modes leave inside is not shown
    settings.collision_collection = bpy.data.collections.new(f"{obj.name} touches")
    for solid in (solid for name in TOUCHED[obj.name] for solid in solids[name]):
        settings.collision_collection.objects.link(solid)
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


def depth(obj, frames):
    """How deep the capsules of its limbs come through a shell in the frames, at most: what would be seen as skin."""
    limbs = [solid for solid in obj.shellwarp.collision_collection.objects if solid.shellwarp_collider.shape == "CAPSULE"]
    deepest = 0.0
    for frame in range(1, frames + 1):
        bpy.context.scene.frame_set(frame)
        points = box(obj)[2]
        for solid in limbs:
            to_limb = numpy.array(solid.matrix_world.inverted())
            local = points @ to_limb[:3, :3].T + to_limb[:3, 3]
            radius, half = solid.dimensions.x / 2, solid.dimensions.z / 2
            local[:, 2] -= numpy.clip(local[:, 2], radius - half, half - radius)
            deepest = max(deepest, radius - float(numpy.linalg.norm(local, axis=1).min()))
    return deepest


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
    solids = add_body(bones)
    shells = [add_shell(shell, data, bones, solids, given.frames) for shell in data["shell"]]
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out / "character.blend"))
    for obj in shells:
        choose(obj)
        if bpy.ops.shellwarp.bake() != {"FINISHED"}:
            sys.exit(f"character_scene: {obj.name} could not be baked")
        shows = depth(obj, given.frames)
        print(f"character_scene: {obj.name}: {obj.shellwarp.verdict}; limbs come through by {shows:.2g} cm")
        if shows > SHOWS:
            sys.exit(f"character_scene: skin shows through {obj.name}")
    for obj in shells:
        obj.select_set(True)
    bpy.ops.shellwarp.export(filepath=str(given.out / "character.abc"))
    scene.frame_set(1)
    stage(shells[1], (0.5, -1, 0.12), False)
    scene.camera.location = Vector((-30, 0, 105)) + Vector((0.45, -1, 0.1)).normalized() * 345
    scene.camera.rotation_euler = (Vector((0, 6, 95)) - scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.mesh.primitive_plane_add(size=4000, location=(0, 0, 0))
    paint(bpy.context.object, (0.5, 0.5, 0.52, 1))
    bpy.ops.wm.save_mainfile()
    draw(given.out / "character.png", [1, given.frames * 43 // 130, given.frames * 100 // 130, given.frames], given.size, given.samples)


if __name__ == "__main__":
    main()
