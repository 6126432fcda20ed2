"""Reads from the scene what a shell needs: once its mesh and supports, every frame its pose, loads and handles.

The shell lives in world units: its rest positions are the object's times its scale, and the support frame is the object's
location and rotation. So the scale must be one number, the same on all axes, and constant; anything else has no rigid
frame and is refused. Positions come back in the object's own coordinates.
"""

import hashlib
from dataclasses import dataclass

import numpy

from . import library

SHAPE_KEY = "shellwarp"
SCALE_TOLERANCE = 1e-4  # of the scale: matrices are float32, and the library takes rotations good to 1e-4


class Refused(Exception):
    """The scene asks for what cannot be; the text tells the user what to do."""


@dataclass(frozen=True)
class Handle:
    """Where one vertex is led, in the world."""

    number: int
    kind: str          # "position" or "orientation"
    vertex: int
    axes: str
    compliance: float
    position: tuple    # (3), or () with an orientation
    rotation: tuple    # (9) row-major, or ()


@dataclass(frozen=True)
class Inputs:
    """All that acts on the shell at one time. Equal inputs and an equal past mean an equal result."""

    origin: tuple
    rotation: tuple    # (9) row-major
    seconds: float     # length of a frame
    steps_per_frame: int
    gravity: tuple
    damping: tuple     # ratio, mass, stiffness
    wind: tuple        # velocity (3), density, normal drag, tangential drag
    handles: tuple     # of Handle


def rest_positions(mesh):
    """The basis shape, object coordinates (n x 3) float32."""
    out = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    points = mesh.shape_keys.reference_key.data if mesh.shape_keys else mesh.vertices
    points.foreach_get("co", out.ravel())
    return out


def triangles(mesh):
    """Blender's own triangulation (n x 3)."""
    mesh.calc_loop_triangles()
    out = numpy.empty((len(mesh.loop_triangles), 3), numpy.int32)
    mesh.loop_triangles.foreach_get("vertices", out.ravel())
    return out


def group_vertices(obj, name):
    """Vertices of a group with weights above a half; none when no group is named."""
    if not name:
        return []
    group = obj.vertex_groups.get(name)
    if group is None:
        raise Refused(f"there is no vertex group “{name}”")
    index = group.index
    found = [v.index for v in obj.data.vertices if any(g.group == index and g.weight > 0.5 for g in v.groups)]
    if not found:
        raise Refused(f"no vertex has more than half a weight in “{name}”")
    return found


def split_matrix(matrix):
    """Origin (3), rotation (9, row-major) and scale of a world matrix; Refused unless it is rigid times one scale."""
    m = numpy.array(matrix, dtype=numpy.float64)
    linear = m[:3, :3]
    scale = float(numpy.cbrt(numpy.linalg.det(linear)))
    if not scale > 0:
        raise Refused("the object's scale is zero or mirrored: apply it (Ctrl+A, Scale)")
    rotation = linear / scale
    if numpy.abs(rotation.T @ rotation - numpy.eye(3)).max() > SCALE_TOLERANCE:
        raise Refused("the object's scale differs between axes, or it is sheared: apply it (Ctrl+A, Scale)")
    left, _, right = numpy.linalg.svd(rotation)  # the nearest rotation: float32 matrices are only nearly one
    return tuple(m[:3, 3].tolist()), tuple((left @ right).ravel().tolist()), scale


def evaluated(obj, depsgraph):
    """World matrix at the present frame, animation and constraints included."""
    return obj.evaluated_get(depsgraph).matrix_world


def check_object(obj):
    """Raises Refused where the object cannot be a shell."""
    if obj.type != "MESH":
        raise Refused("only meshes can be shells")
    if obj.mode == "EDIT":
        raise Refused("leave edit mode first")
    if obj.data.users > 1:
        raise Refused("the mesh is shared by several objects: make it single-user")


@dataclass(frozen=True)
class Recipe:
    """How a model and its state are made, as the package takes it."""

    method: str
    integrator: str
    options: tuple     # of Model.precompute: names and values


def read_recipe(obj, depsgraph, package):
    """What the settings ask for. A choice of the method is made for the scene's gravity."""
    settings, scene = obj.shellwarp, depsgraph.scene
    gravity = abs(obj.evaluated_get(depsgraph).shellwarp.gravity) * scene.gravity.length if scene.use_gravity else 0.0
    needed = package.method.precompute_options(settings.method, settings.reduced_fields, settings.auto_error, gravity=gravity)
    return Recipe(settings.method, settings.integrator, (("modes", settings.modes), *needed.items()))


def read_shell(obj, depsgraph):
    """The Shell, the object's scale, the Recipe, and a key that changes with whatever would make another model."""
    package = library.package()
    check_object(obj)
    settings = obj.shellwarp
    scale = split_matrix(evaluated(obj, depsgraph))[2]
    rest = rest_positions(obj.data).astype(numpy.float64) * scale
    material = package.Material(settings.k_area, settings.k_length, settings.k_bend, settings.density)
    fixed, clamped = (group_vertices(obj, name) for name in (settings.fixed_group, settings.clamped_group))
    shell = package.Shell(rest, triangles(obj.data), material, fixed, clamped)
    key = hashlib.blake2b(rest.tobytes() + shell.triangles.tobytes())
    recipe = read_recipe(obj, depsgraph, package)
    key.update(repr((material, fixed, clamped, recipe)).encode())
    return shell, scale, recipe, key.digest()


def read_inputs(obj, scene, depsgraph, scale):
    """What acts on the shell at the depsgraph's frame. `scale` is what the model was made with."""
    settings = obj.evaluated_get(depsgraph).shellwarp
    origin, rotation, present = split_matrix(evaluated(obj, depsgraph))
    if abs(present - scale) > SCALE_TOLERANCE * scale:
        raise Refused(f"the object's scale changes, from {scale:.5g} to {present:.5g}: only its place and turn may move")
    factor = settings.gravity if scene.use_gravity else 0.0
    return Inputs(
        origin, rotation, scene.render.fps_base / scene.render.fps, settings.steps_per_frame,
        tuple(factor * g for g in scene.gravity),
        (settings.damping_ratio, settings.damping_mass, settings.damping_stiffness),
        (*settings.wind, settings.air_density, settings.normal_drag, settings.tangential_drag),
        tuple(handle for i, item in enumerate(settings.handles) for handle in read_handle(obj, i, item, depsgraph)))


def read_handle(obj, index, item, depsgraph):
    """A handle as one or two constraints, none while it is let go."""
    axes = "".join(axis for axis, on in zip("xyz", item.axes) if on)
    if item.target is None or not item.held or not axes:
        return
    if item.vertex >= len(obj.data.vertices):
        raise Refused(f"handle {index + 1} holds vertex {item.vertex}, the mesh has {len(obj.data.vertices)}")
    matrix = evaluated(item.target.original, depsgraph)
    if item.kind != "ORIENTATION":
        yield Handle(2 * index, "position", item.vertex, axes, item.compliance, tuple(matrix.translation), ())
    if item.kind != "POSITION":
        rotation = tuple(x for row in matrix.to_3x3().normalized().to_quaternion().to_matrix() for x in row)
        yield Handle(2 * index + 1, "orientation", item.vertex, axes, item.compliance, (), rotation)
