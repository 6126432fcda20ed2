"""Reads from the scene what a shell needs: once its mesh and supports, every frame its pose, loads and handles.

The shell lives in world units: its rest positions are the object's times its scale, and the support frame is the object's
location and rotation. So the scale must be one number, the same on all axes, and constant; anything else has no rigid
frame and is refused. Positions come back in the object's own coordinates.
"""

import hashlib
from dataclasses import dataclass

import numpy

from . import colliders, fields, library, materials, stack
from .meshes import (DISABLED, SCALE_TOLERANCE, Refused, check_mesh, creases, evaluated, group_vertices, key_positions, loose_edges, present,
                     rest_positions, triangles, weights)


STRAIGHT = 1e-6  # of the mesh's size: a row of fixed vertices that is off a line by less is a hinge


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
    stiffness_factor: float
    force: tuple       # (3), at each vertex whose share is 1
    wind: tuple        # velocity (3), density, normal drag, tangential drag
    handles: tuple     # of Handle
    solids: tuple = ()  # of colliders.Solid
    fields: tuple = ()  # of fields.Field
    supports: bytes = b""  # where each supported vertex is in the world (float64), none where the pose carries them
    rest: bytes = b""  # the same of each vertex of a rest shape that is led


@dataclass(frozen=True)
class Output:
    """What is done to a frame before it is shown. The motion knows nothing of it."""

    correction_steps: int = 0
    push_out: bool = False


def read_output(settings):
    """What the settings ask for."""
    if settings.correction_steps and settings.push_out:
        raise Refused("correction steps and Push out both move what is shown: choose one")
    return Output(settings.correction_steps, settings.push_out)


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


@dataclass(frozen=True)
class Recipe:
    """How a model and its state are made, as the package takes it."""

    method: str
    integrator: str
    options: tuple     # of Model.precompute: names and values
    follows: bool      # shape keys and modifiers lead the pins
    moves_rest: bool = False  # and the whole rest shape with them
    frequency: float = 0.0   # Hz that the slowest swing is to have, 0: the material says all
    sag: tuple = ()          # how far the shell is to hang, and gravity in its axes (3); none: the same


BY_FIELDS = ("warp", "warp-virtual-work", "lma")  # methods that support_fields let follow pins that bend the shell


def follows_by_fields(settings):
    """The automatic choice takes the warp then; one by an error refuses."""
    return settings.method in BY_FIELDS or (settings.method == "auto" and not settings.auto_error)


def read_recipe(obj, depsgraph, package, free):
    """What the settings ask for. A choice of the method is made for the scene's gravity; a shell that moves freely is trained for its handles."""
    settings, scene = obj.shellwarp, depsgraph.scene
    gravity = abs(obj.evaluated_get(depsgraph).shellwarp.gravity) * scene.gravity.length if scene.use_gravity else 0.0
    needed = package.method.precompute_options(settings.method, settings.reduced_fields, settings.auto_error, gravity=gravity)
    follows = stack.leads(obj)
    moves_rest = follows and settings.follow_rest
    if follows and not moves_rest and follows_by_fields(settings):
        needed["support_fields"] = settings.support_fields
    method = package.method.find(settings.method)
    if free and (method.needs_fields or method.needs_choice):
        needed["handles"] = held_by_handles(obj)
    if settings.contact_patches:
        needed["contact_patches"] = tuple(group_vertices(obj, settings.contact_patches))
    return Recipe(settings.method, settings.integrator, (("modes", settings.modes), ("precision", settings.precision), *needed.items()), follows, moves_rest,
                  settings.frequency if settings.material == "FREQUENCY" else 0.0, read_sag(obj, depsgraph))


def read_sag(obj, depsgraph):
    """How far the shell is to hang, and gravity in the object's axes (3), where it stands now; none where its stiffness is another's."""
    settings, scene = obj.shellwarp, depsgraph.scene
    if settings.material != "SAG":
        return ()
    gravity = obj.evaluated_get(depsgraph).shellwarp.gravity * numpy.array(scene.gravity) if scene.use_gravity else numpy.zeros(3)
    if not gravity.any():
        raise Refused("the material is by sag, and there is no gravity")
    rotation = numpy.array(split_matrix(evaluated(obj, depsgraph))[1], numpy.float64).reshape(3, 3)
    return (settings.sag, *(float(g) for g in rotation.T @ gravity))


def held_by_handles(obj):
    """The vertices that handles place, ascending, let go now or not."""
    count = len(obj.data.vertices)
    return tuple(sorted({item.vertex for item in obj.shellwarp.handles if item.kind != "ORIENTATION" and any(item.axes) and item.vertex < count}))


def moves_freely(rest, fixed, clamped, axes, symmetric=None):
    """Whether supports leave a rigid motion, as where a point or a straight row is fixed, and no slope is held."""
    if len(clamped):
        return False
    planes = symmetric or {}
    by_axis = [*axes.items(), *planes.items()]
    rows = [(v, axis) for v in fixed for axis in range(3)] + [(v, "xyz".index(letter)) for v, letters in by_axis for letter in letters]
    turns = [letter for letter in "xyz" if any(set(letters) - {letter} for letters in planes.values())]  # a plane lets it turn about its normal alone
    if len(rows) + len(turns) < 6:
        return True
    points = (rest - rest.mean(axis=0)) / numpy.ptp(rest, axis=0).max()
    along = numpy.eye(3)[[axis for _, axis in rows]]
    motions = numpy.hstack([along, numpy.cross(points[[v for v, _ in rows]], along)])  # what each row sees of translations and turns
    held = numpy.hstack([numpy.zeros((len(turns), 3)), numpy.eye(3)[["xyz".index(letter) for letter in turns]].reshape(-1, 3)])
    return numpy.linalg.svd(numpy.vstack([motions, held]), compute_uv=False)[5] <= STRAIGHT


def read_axes(obj):
    """Of vertices that are held along axes of the object, which: letters by vertex; and of those on planes of symmetry."""
    held, planes = {}, {}
    for letter, name in axis_groups(obj.shellwarp).items():
        found = planes if obj.shellwarp.symmetric_axes["xyz".index(letter)] else held
        for vertex in group_vertices(obj, name):
            found[vertex] = found.get(vertex, "") + letter
    return held, planes


def axis_groups(settings):
    """Groups whose vertices are held along one axis, by its letter; those that are named."""
    names = {letter: getattr(settings, f"fixed_{letter}_group") for letter in "xyz"}
    return {letter: name for letter, name in names.items() if name}


def read_ties(settings, mesh):
    """What a Shell takes of ties: ends of loose edges, and a distance."""
    if not settings.tie_edges:
        return {"tie_distance": settings.tie_within}
    ends = loose_edges(mesh)
    if not len(ends):
        raise Refused("loose edges are to be ties, and the mesh has none: add edges without faces between what is to be held together")
    stiffness = (settings.tie_stiffness,) if settings.tie_stiffness else ()
    return {"ties": [(int(a), int(b), *stiffness) for a, b in ends], "tie_distance": settings.tie_within}


def read_shell(obj, depsgraph):
    """The Shell, the object's scale, the Recipe, and a key that changes with whatever would make another model."""
    package = library.package()
    check_mesh(obj)
    settings = obj.shellwarp
    scale = split_matrix(evaluated(obj, depsgraph))[2]
    rest = rest_positions(obj.data).astype(numpy.float64) * scale
    material = materials.read_material(settings, depsgraph.scene, package, rest, triangles(obj.data))
    maps = materials.read_maps(obj, material)
    fixed, clamped = (group_vertices(obj, name) for name in (settings.fixed_group, settings.clamped_group))
    unit = materials.metres(depsgraph.scene) if materials.is_real(settings) else 0.0
    folds = creases(obj.data, settings.crease_factors, settings.crease_angles, settings.crease_yields, settings.crease_flat)
    unstressed = key_positions(obj.data, settings.rest_shape).astype(numpy.float64) * scale if settings.rest_shape else None
    directions = materials.read_directions(obj, rest, package)
    (axes, symmetric), ties = read_axes(obj), read_ties(settings, obj.data)
    shell = package.Shell(rest, triangles(obj.data), material, fixed, clamped, maps, folds, unstressed, directions, axes=axes, symmetric=symmetric, **ties, metres_per_unit=unit)
    key = hashlib.blake2b(rest.tobytes() + shell.triangles.tobytes())
    recipe = read_recipe(obj, depsgraph, package, moves_freely(rest, fixed, clamped, axes, symmetric))
    for name, values in maps.items():
        key.update(name.encode() + values.tobytes())
    made = (settings.proxy_vertices, settings.proxy_thickness, settings.proxy_cut, settings.proxy_held) if settings.proxy_calibrated else ()
    key.update(repr((material, fixed, clamped, axes, symmetric, ties, recipe, folds, made)).encode())
    for array in (unstressed, directions):
        key.update(b"" if array is None else array.tobytes())
    return shell, scale, recipe, key.digest()


def groups_of(settings):
    """The vertex groups that the settings name, each with what it is for."""
    return {"fixed": settings.fixed_group, "clamped": settings.clamped_group,
            **{f"held along {letter}": getattr(settings, f"fixed_{letter}_group") for letter in "xyz"}, "contact patches": settings.contact_patches,
            "damping": settings.damping_group, "force": settings.force_group, **materials.group_names(settings)}


def read_force(settings, scene):
    """The force at a vertex in Blender units: of sheets the setting is in newtons."""
    unit = materials.metres(scene) if materials.is_real(settings) else 1.0
    return tuple(f / unit for f in settings.force) if settings.force_group else (0.0, 0.0, 0.0)


def read_shares(obj):
    """What damping by mass and ratio is multiplied by at each vertex, and the force (n); None for 1, and for 0 everywhere."""
    damping, force = obj.shellwarp.damping_group, obj.shellwarp.force_group
    return (weights(obj, damping, or_zero=True) if damping else None), (weights(obj, force, or_zero=True, outside=0.0) if force else None)


def check_there(obj):
    """Raises Refused where a group that the settings name does not exist."""
    for name in groups_of(obj.shellwarp).values():
        if name and name not in obj.vertex_groups:
            raise Refused(f"there is no vertex group “{name}”")


def check_named(obj):
    """Raises Refused where the settings name what there is not: a group, an empty, a mesh."""
    check_there(obj)
    for index, item in enumerate(obj.shellwarp.handles):
        check_handle(obj, index, item)
    for index, item in enumerate(obj.shellwarp.renders):
        if item.target is None:
            raise Refused(f"render mesh {index + 1} is gone: choose another, or remove it")


def check_groups(obj, made):
    """Raises Refused where a group does not exist or is another than the model was made with: the shell must not go on with that."""
    check_there(obj)
    for use, name in groups_of(obj.shellwarp).items():
        if name != made.get(use, ""):
            raise Refused(f"the group “{name}” ({use}) is another than at the start frame: go there")


def read_inputs(obj, scene, depsgraph, run):
    """What acts on the shell at the depsgraph's frame. `run` has the scale and colliders that it was made with."""
    check_groups(obj, run.groups)
    check_follows(obj, run)
    scale = run.scale
    settings = obj.evaluated_get(depsgraph).shellwarp
    origin, rotation, present = split_matrix(evaluated(obj, depsgraph))
    if abs(present - scale) > SCALE_TOLERANCE * scale:
        raise Refused(f"the object's scale changes, from {scale:.5g} to {present:.5g}: only its place and turn may move")
    factor = settings.gravity if scene.use_gravity else 0.0
    found = fields.read(obj, scene, depsgraph, settings.fields)
    return Inputs(
        origin, rotation, scene.render.fps_base / scene.render.fps, settings.steps_per_frame,
        tuple(factor * g for g in scene.gravity),
        (settings.damping_ratio, settings.damping_mass, settings.damping_stiffness), settings.stiffness_factor,
        read_force(settings, scene),
        (*settings.wind, air_density(settings, scene, found), settings.normal_drag, settings.tangential_drag),
        tuple(handle for i, item in enumerate(settings.handles) for handle in read_handle(obj, i, item, depsgraph)),
        colliders.read_solids(obj, depsgraph, run.solids), found, *read_led(obj, depsgraph, run))


def air_density(settings, scene, found):
    """Mass of the air per cubic Blender unit: of sheets the setting is in SI units. Where a field blows and none is set, it is air."""
    cube = materials.metres(scene) ** 3
    if not settings.air_density:
        return fields.AIR * cube if any(item.kind == "WIND" for item in found) else 0.0
    return settings.air_density * (cube if materials.is_real(settings) else 1.0)


def check_follows(obj, run):
    """Raises Refused where other things lead the pins than the model was made for."""
    now = stack.leads(obj)
    if now != run.recipe.follows:
        raise Refused("shape keys and modifiers lead the pins now: go to the start frame" if now else
                      "shape keys and modifiers do not lead the pins any more: go to the start frame")
    if now and obj.shellwarp.follow_rest != run.recipe.moves_rest:
        raise Refused("Rest shape follows was switched: go to the start frame")


def read_led(obj, depsgraph, run):
    """Where supported vertices, and where all vertices of the rest shape are led in the world, as bytes; none of what is not led."""
    if not run.recipe.follows:
        return b"", b""
    matrix = numpy.array(evaluated(obj, depsgraph), dtype=numpy.float64)
    led = stack.read(obj, depsgraph) @ matrix[:3, :3].T + matrix[:3, 3]
    return (b"", led.tobytes()) if run.recipe.moves_rest else (led[run.held].tobytes(), b"")


def check_handle(obj, index, item):
    """Raises Refused where a handle that is held has no empty, or no vertex."""
    if not item.held or not any(item.axes):
        return
    if item.target is None:
        raise Refused(f"the empty of handle {index + 1} is gone: choose another, or remove the handle")
    if item.vertex >= len(obj.data.vertices):
        raise Refused(f"handle {index + 1} holds vertex {item.vertex}, the mesh has {len(obj.data.vertices)}")


def read_handle(obj, index, item, depsgraph):
    """A handle as one or two constraints, none while it is let go."""
    axes = "".join(axis for axis, on in zip("xyz", item.axes) if on)
    if not item.held or not axes:
        return
    check_handle(obj, index, item)
    if not present(item.target.original, depsgraph):
        raise Refused(f"handle {index + 1}, “{item.target.name}”: {DISABLED}")
    matrix = evaluated(item.target.original, depsgraph)
    if item.kind != "ORIENTATION":
        yield Handle(2 * index, "position", item.vertex, axes, item.compliance, tuple(matrix.translation), ())
    if item.kind != "POSITION":
        rotation = tuple(x for row in matrix.to_3x3().normalized().to_quaternion().to_matrix() for x in row)
        yield Handle(2 * index + 1, "orientation", item.vertex, axes, item.compliance, (), rotation)
