"""What shells of a job touch: `collider` tables as of scene files, checked, prepared and moved from step to step."""

import functools
import math
import os

import numpy
import shellwarp

from . import samples, way
from .content import content_hash
from .errors import SceneError
from .mesh_file import read_mesh
from .motion import rotation_matrix

# What a kind needs, and what it may have beside what all have.
KINDS = {"plane": ((), ("normal",)), "sphere": (("radius",), ()), "capsule": (("half_length", "radius"), ()),
         "box": (("half_extents",), ()), "hull": (("mesh",), ()), "mesh": (("mesh",), ("cells", "one_sided", "depth")),
         "deforming": (("mesh",), ("motion", "one_sided", "depth"))}
COMMON = {"kind", "friction", "thickness", "position", "rotate_degrees", "key"}
KEYS = COMMON | {key for needed, more in KINDS.values() for key in needed + more}
KEPT = 16  # shapes that a worker keeps prepared


def check(where, item):
    """SceneError unless the table is a collider's; all of its keys are known."""
    if item.get("kind") not in KINDS:
        raise SceneError(f"{where}: the kind is {item.get('kind')!r}, expected one of {', '.join(KINDS)}")
    needed, more = KINDS[item["kind"]]
    for key in needed:
        if key not in item:
            raise SceneError(f"{where}: a {item['kind']} needs {key}")
    if wrong := sorted(set(item) - COMMON - set(needed) - set(more)):
        raise SceneError(f"{where}: a {item['kind']} has no {wrong[0]}")
    if "normal" in item and "rotate_degrees" in item:
        raise SceneError(f"{where}: normal does not go with rotate_degrees")
    if not isinstance(item.get("one_sided", False), bool):
        raise SceneError(f"{where}: one_sided is {item['one_sided']!r}, expected true or false")
    if "depth" in item and not item.get("one_sided"):
        raise SceneError(f"{where}: depth goes with one_sided = true")
    for key in ("position", "rotate_degrees", "normal", "half_extents"):
        way.check_vector(where, item, key)
    if "normal" in item and not any(item["normal"]):
        raise SceneError(f"{where}: the normal is 0")
    way.check(where, item.get("key", []))


def content(items):
    """Hash of all that the colliders are, with the meshes in their files."""
    meshes = [[*read_mesh(item["mesh"])] if "mesh" in item else None for item in items]
    moving = [[*samples.samples(item.get("motion", item["mesh"]), item["mesh"])] if item["kind"] == "deforming" else None for item in items]
    return content_hash([[{key: value for key, value in item.items() if key not in ("mesh", "motion")} for item in items], meshes, moving])


def put(state, items):
    """Gives the colliders to a state, each by its place in the list; SceneError names the one that is no solid."""
    state.set_colliders(_shapes(items))


def patches_near(shell, distance, most, items):
    """Vertices of a shell that rest no farther than this from colliders, which are where they stand first; SceneError where there are none."""
    with shellwarp.Model(shell) as model:
        poses = [(origin, tuple(rotation.ravel())) for origin, rotation in (pose(item, 0.0) for item in items)]
        found = model.patches_near(_shapes(items), distance, most, poses)
    if not found:
        raise SceneError("contact_patches_near: no vertex that moves is so near to a collider at the start")
    return found


def _shapes(items):
    shapes = []
    for number, item in enumerate(items, 1):
        try:
            shapes.append(_shape(item))
        except shellwarp.ShellwarpError as error:
            raise SceneError(f"collider {number}, a {item['kind']}: {error}") from None
    return shapes


def move(state, items, seconds, frame_rate, teleport=False):
    """Where the colliders are at a time, and of what shape those that deform."""
    for number, item in enumerate(items):
        state.move_collider(number, *pose(item, seconds), teleport=teleport)
    deform(state, items, seconds, frame_rate, teleport)


def deform(state, items, seconds, frame_rate, teleport=False):
    """Of what shape colliders are at a time, of those that deform."""
    for number, item in enumerate(items):
        if item["kind"] == "deforming":
            state.deform_collider(number, samples.points_at(item.get("motion", item["mesh"]), item["mesh"], seconds, frame_rate), teleport)


def pose(item, seconds):
    """Origin (3) and rotation (3 x 3) of a collider at a time, as the command line has them."""
    offset, turn = way.at(item.get("key", []), seconds)
    own = _to_normal(item["normal"]) if "normal" in item else numpy.radians(numpy.array(item.get("rotate_degrees", (0, 0, 0)), float))
    return numpy.array(item.get("position", (0, 0, 0)), float) + offset, rotation_matrix(numpy.radians(turn)) @ rotation_matrix(own)


def _to_normal(normal):
    """The rotation vector that turns z to a direction by the least angle."""
    n = numpy.array(normal, float) / numpy.linalg.norm(normal)
    axis = numpy.cross((0.0, 0.0, 1.0), n)
    size = numpy.linalg.norm(axis)
    if size == 0:
        return numpy.array((0.0 if n[2] > 0 else math.pi, 0.0, 0.0))
    return axis / size * math.atan2(size, n[2])


def _shape(item):
    numbers = [float(item.get(key, 0)) for key in ("friction", "thickness", "radius", "half_length")]
    facts = os.stat(item["mesh"]) if "mesh" in item and os.path.isfile(item["mesh"]) else None
    stamp = (facts.st_mtime_ns, facts.st_size) if facts else None
    return _made(item["kind"], *numbers, tuple(item.get("half_extents", ())), item.get("mesh"), stamp, item.get("cells", 0),
                 item.get("one_sided", False), float(item.get("depth", 0)))


@functools.lru_cache(maxsize=KEPT)
def _made(kind, friction, thickness, radius, half_length, half_extents, mesh, _stamp, cells, one_sided, depth):
    """A prepared solid; a mesh takes seconds, so that it is kept until its file changes."""
    make, common = shellwarp.Collider, {"friction": friction, "thickness": thickness}
    if mesh is not None:
        positions, triangles = read_mesh(mesh)
        sheet = {"one_sided": one_sided, "depth": depth}
        return {"hull": lambda: make.hull(positions, **common), "mesh": lambda: make.mesh(positions, triangles, cells=cells, **common, **sheet),
                "deforming": lambda: make.deforming(positions, triangles, **common, **sheet)}[kind]()
    return {"plane": lambda: make.plane(**common), "sphere": lambda: make.sphere(radius, **common),
            "capsule": lambda: make.capsule(half_length, radius, **common), "box": lambda: make.box(half_extents, **common)}[kind]()
