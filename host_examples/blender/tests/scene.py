"""Scenes for the tests, made as a user's script would: data, properties, operators."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import bpy
import numpy

ROOT = Path(__file__).resolve().parents[3]
LIBRARY = os.environ.pop("SHELLWARP_LIBRARY")  # for the judge and the zip; the add-on has to find its own copy
MODULE = "bl_ext.user_default.shellwarp"
N = 124  # vertices of the strip


def install(folder):
    """Builds the zip from the sources and installs it as a user does: Preferences > Get Extensions > Install from Disk."""
    made = subprocess.run([sys.executable, ROOT / "host_examples" / "blender" / "build_addon.py", "--out", folder,
                           "--library", LIBRARY], stdout=subprocess.PIPE, text=True, check=True)
    bpy.ops.extensions.package_install_files(filepath=made.stdout.strip(), repo="user_default", enable_on_install=True)


def ours():
    """This machine's platform, as Blender calls it."""
    system = {"linux": "linux", "darwin": "macos"}.get(sys.platform, "windows")
    return f"{system}-{'arm64' if platform.machine().lower() in ('arm64', 'aarch64') else 'x64'}"


def empty_file():
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 30, 1.0
    scene.gravity = (0, 0, -9.8)
    return scene


def strip_mesh():
    """The README's strip of card, 30 x 3 cm along x, in quads."""
    points = [(0.01 * i, 0.01 * j, 0.0) for i in range(31) for j in range(4)]
    quads = [(a, a + 4, a + 5, a + 1) for i in range(30) for a in range(4 * i, 4 * i + 3)]
    mesh = bpy.data.meshes.new("strip")
    mesh.from_pydata(points, [], quads)
    return mesh


def add_strip(name="Strip"):
    """A shell held at one end, gravity and damping on."""
    obj = bpy.data.objects.new(name, strip_mesh())
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    obj.vertex_groups.new(name="held").add(list(range(8)), 1.0, "REPLACE")
    settings = obj.shellwarp
    settings.enabled = True
    settings.fixed_group, settings.method = "held", "warp"  # the default trains for seconds
    settings.density, settings.k_bend, settings.k_length, settings.k_area = 0.3, 2.7e-3, 5e3, 5e3
    settings.damping_ratio = 0.1
    settings.frame_end = 20
    return obj


def add_dinosaur():
    """The demo's dinosaur, upright, its feet held."""
    bpy.ops.wm.obj_import(filepath=str(ROOT / "tests" / "data" / "meshes" / "dinosaur.obj"))
    obj = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = obj
    feet = [v.index for v in obj.data.vertices if v.co.y < 0.02]
    obj.vertex_groups.new(name="feet").add(feet, 1.0, "REPLACE")
    settings = obj.shellwarp
    settings.enabled, settings.fixed_group, settings.modes, settings.method = True, "feet", 4, "warp"
    settings.k_area, settings.k_length, settings.k_bend, settings.density = 1e6, 1e6, 1e4, 0.5
    settings.damping_ratio, settings.gravity = 0.04, 0.0
    return obj


def play(last, first=1):
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)


def shown(obj, world=False):
    """What is seen: the evaluated mesh, modifiers and keys included."""
    item = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    out = numpy.empty((len(item.data.vertices), 3), numpy.float32)
    item.data.vertices.foreach_get("co", out.ravel())
    if not world:
        return out
    matrix = numpy.array(item.matrix_world)
    return out @ matrix[:3, :3].T + matrix[:3, 3]


def key(obj, path, values, index=-1):
    """Keyframes {frame: value}, straight between."""
    for frame, value in values.items():
        setattr(obj, path, value)
        obj.keyframe_insert(path, frame=frame, index=index)
