"""What shells of a job touch: `collider` tables as of scene files, checked, prepared and moved from step to step."""

import functools
import math
import os

import numpy
import shellwarp

from .content import content_hash
from .errors import SceneError
from .mesh_file import read_mesh
from .motion import rotation_matrix

# What a kind needs, and what it may have beside what all have.
KINDS = {"plane": ((), ("normal",)), "sphere": (("radius",), ()), "capsule": (("half_length", "radius"), ()),
         "box": (("half_extents",), ()), "hull": (("mesh",), ()), "mesh": (("mesh",), ("cells",))}
COMMON = {"kind", "friction", "thickness", "position", "rotate_degrees", "key"}
KEYS = COMMON | {key for needed, more in KINDS.values() for key in needed + more}
MOTION = {"time", "offset", "rotate_degrees"}
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
    for key in ("position", "rotate_degrees", "normal", "half_extents"):
        _check_vector(where, item, key)
    if "normal" in item and not any(item["normal"]):
        raise SceneError(f"{where}: the normal is 0")
    times = [key.get("time") for key in item.get("key", [])]
    if None in times or any(a >= b for a, b in zip(times, times[1:])):
        raise SceneError(f"{where}: each key needs a time, and times must ascend: they are {times}")
    for key in item.get("key", []):
        if unknown := sorted(set(key) - MOTION):
            raise SceneError(f"{where}: unknown key {unknown[0]!r} of a key; known: {', '.join(sorted(MOTION))}")
        _check_vector(where, key, "offset")
        _check_vector(where, key, "rotate_degrees")


def _check_vector(where, table, key):
    value = table.get(key, [0, 0, 0])
    if not isinstance(value, list) or len(value) != 3 or not all(isinstance(x, (int, float)) for x in value):
        raise SceneError(f"{where}: {key} is {value!r}, expected three numbers")


def content(items):
    """Hash of all that the colliders are, with the meshes in their files."""
    meshes = [[*read_mesh(item["mesh"])] if "mesh" in item else None for item in items]
    return content_hash([[{key: value for key, value in item.items() if key != "mesh"} for item in items], meshes])


def put(state, items):
    """Gives the colliders to a state, each by its place in the list; SceneError names the one that is no solid."""
    shapes = []
    for number, item in enumerate(items, 1):
        try:
            shapes.append(_shape(item))
        except shellwarp.ShellwarpError as error:
            raise SceneError(f"collider {number}, a {item['kind']}: {error}") from None
    state.set_colliders(shapes)


def move(state, items, seconds, teleport=False):
    """Where the colliders are at a time."""
    for number, item in enumerate(items):
        state.move_collider(number, *pose(item, seconds), teleport=teleport)


def pose(item, seconds):
    """Origin (3) and rotation (3 x 3) of a collider at a time, as the command line has them."""
    offset, turn = _at(item.get("key", []), seconds)
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


def _at(keys, seconds):
    """Offset and rotation vector in degrees at a time: Steffen's interpolation, which does not overshoot."""
    keys = [(key["time"], numpy.array([*key.get("offset", (0, 0, 0)), *key.get("rotate_degrees", (0, 0, 0))], float)) for key in keys]
    if not keys or keys[0][0] > 0:
        keys.insert(0, (0.0, numpy.zeros(6)))  # at its place at time 0
    if seconds <= keys[0][0]:
        return keys[0][1][:3], keys[0][1][3:]
    if seconds >= keys[-1][0]:
        return keys[-1][1][:3], keys[-1][1][3:]
    k = next(i for i in range(len(keys) - 1) if seconds < keys[i + 1][0])
    h, mean = _span(keys, k)
    s, v0, v1 = (seconds - keys[k][0]) / h, _velocity(keys, k), _velocity(keys, k + 1)
    value = keys[k][1] + h * s * (v0 + s * (3 * mean - 2 * v0 - v1 + s * (v0 + v1 - 2 * mean)))
    return value[:3], value[3:]


def _span(keys, k):
    """Seconds from a key to the next, and the mean velocity between."""
    h = keys[k + 1][0] - keys[k][0]
    return h, (keys[k + 1][1] - keys[k][1]) / h


def _velocity(keys, k):
    """At a key: 0 at the ends, else Steffen's."""
    if k in (0, len(keys) - 1):
        return numpy.zeros(6)
    (h0, before), (h1, after) = _span(keys, k - 1), _span(keys, k)
    parabola = (before * h1 + after * h0) / (h0 + h1)
    return (numpy.sign(before) + numpy.sign(after)) * numpy.minimum(numpy.minimum(abs(before), abs(after)), abs(parabola) / 2)


def _shape(item):
    numbers = [float(item.get(key, 0)) for key in ("friction", "thickness", "radius", "half_length")]
    facts = os.stat(item["mesh"]) if "mesh" in item and os.path.isfile(item["mesh"]) else None
    stamp = (facts.st_mtime_ns, facts.st_size) if facts else None
    return _made(item["kind"], *numbers, tuple(item.get("half_extents", ())), item.get("mesh"), stamp, item.get("cells", 0))


@functools.lru_cache(maxsize=KEPT)
def _made(kind, friction, thickness, radius, half_length, half_extents, mesh, _stamp, cells):
    """A prepared solid; a mesh takes seconds, so that it is kept until its file changes."""
    make, common = shellwarp.Collider, {"friction": friction, "thickness": thickness}
    if mesh is not None:
        positions, triangles = read_mesh(mesh)
        return make.hull(positions, **common) if kind == "hull" else make.mesh(positions, triangles, cells=cells, **common)
    return {"plane": lambda: make.plane(**common), "sphere": lambda: make.sphere(radius, **common),
            "capsule": lambda: make.capsule(half_length, radius, **common), "box": lambda: make.box(half_extents, **common)}[kind]()
