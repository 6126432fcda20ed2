"""Meshes that follow a shell: they are drawn where the shell is only a proxy for them.

Each is bound once, at the start frame, where it is beside the shell then. It may have any faces and modifiers; only its
vertices move. Where it goes later does not matter: its vertices are led in the world.
"""

import hashlib
from dataclasses import dataclass

import bpy
import numpy

from . import shape_key, stack
from .meshes import Refused, check_mesh, evaluated, present, rest_positions


@dataclass(frozen=True)
class Bound:
    """A mesh that is bound to a model."""

    uid: int            # session_uid of its object
    digest: bytes       # of its points beside the shell
    binding: object     # the library's
    rest: numpy.ndarray  # (n x 3) float32, beside the shell


def objects(obj):
    """The objects that follow a shell, in the panel's order. Refused where one is gone."""
    found = []
    for i, item in enumerate(obj.shellwarp.renders):
        if item.target is None:
            raise Refused(f"render mesh {i + 1} is gone: choose another, or remove it")
        found.append(item.target)
    return found


def owner(item):
    """The first shell that an object follows, None of one that follows none."""
    for other in bpy.data.objects:
        if other.type == "MESH" and other.shellwarp.enabled and any(entry.target == item for entry in other.shellwarp.renders):
            return other
    return None


def check(obj, item):
    """Raises Refused where an object cannot follow a shell."""
    if item == obj:
        raise Refused("it is the shell itself")
    if item.type != "MESH":
        raise Refused("it is no mesh")
    if item.shellwarp.enabled:
        raise Refused("it is a shell itself")
    check_mesh(item)
    if not len(item.data.vertices):
        raise Refused("it has no vertices")
    first = owner(item)
    if first != obj:
        raise Refused(f"it follows “{first.name}” already")


def check_all(obj):
    """Raises Refused where a mesh cannot follow the shell."""
    for item in objects(obj):
        named(item, lambda item=item: check(obj, item))


def named(item, work):
    """Does the work; what it refuses begins with the object's name."""
    try:
        return work()
    except Exception as error:
        raise Refused(f"render mesh “{item.name}”: {error}") from error


def prepare(obj, depsgraph, package, run, pose):
    """Binds what is not bound yet, and keeps what is. `pose`: origin and rotation of the shell."""
    known = {item.digest: item for item in run.bound}
    made = []
    for item in objects(obj):
        if present(item, depsgraph):  # one that is disabled here is neither seen nor led
            made.append(named(item, lambda item=item: bind(obj, item, depsgraph, package, run.model, pose, known)))
    if len({item.uid for item in made}) != len(made):
        raise Refused("a render mesh is listed twice")
    return tuple(made)


def bind(obj, item, depsgraph, package, model, pose, known):
    check(obj, item)
    to_shell = numpy.linalg.inv(rigid(pose)) @ numpy.array(evaluated(item, depsgraph), dtype=numpy.float64)
    if abs(numpy.linalg.det(to_shell[:3, :3])) == 0:
        raise Refused("its scale is zero along an axis")
    points = moved(rest_positions(item.data), to_shell)
    digest = hashlib.blake2b(points.tobytes() + repr((item.session_uid, obj.session_uid)).encode()).digest()
    return known.get(digest) or Bound(item.session_uid, digest, package.Binding(model, points), points)


def show(obj, depsgraph, run, pose):
    """Moves the meshes that follow a shell to where its run is."""
    for item, points in positions(obj, depsgraph, run, pose):
        display(item, points)


def display(item, points):
    """Shows positions (n x 3), object coordinates: by a shape key, or by a modifier."""
    if stack.shows(item):
        stack.attach(item)
        stack.write(item, points)
    else:
        shape_key.write(item, points)


def positions(obj, depsgraph, run, pose):
    """Each object that follows, and its positions (n x 3) float32 in its own coordinates."""
    bound = {item.uid: number for number, item in enumerate(run.bound)}
    for item in objects(obj):
        if not present(item, depsgraph):
            continue
        if item.session_uid not in bound:
            raise Refused(f"render mesh “{item.name}” is not bound yet: go to the start frame")
        points = run.drawn[bound[item.session_uid]]
        if len(points) != len(item.data.vertices):
            raise Refused(f"render mesh “{item.name}” has changed: go to the start frame")
        yield item, named(item, lambda item=item, points=points: placed(item, depsgraph, points, pose))


def placed(item, depsgraph, points, pose):
    """Points beside the shell, in the object's own coordinates."""
    check_mesh(item)
    matrix = numpy.array(evaluated(item, depsgraph), dtype=numpy.float64)
    if numpy.linalg.det(matrix[:3, :3]) == 0:
        raise Refused("its scale is zero along an axis")
    return moved(points, numpy.linalg.inv(matrix) @ rigid(pose))


def rigid(pose):
    """Origin and rotation as a matrix (4 x 4)."""
    matrix = numpy.eye(4)
    matrix[:3, 3], matrix[:3, :3] = pose[0], numpy.reshape(pose[1], (3, 3))
    return matrix


def moved(points, matrix):
    """Points through a matrix, rounded once to float32."""
    return (points @ matrix[:3, :3].T + matrix[:3, 3]).astype(numpy.float32)


def seen(obj, depsgraph):
    """Whether a mesh that follows a shell is to be seen."""
    return any(item.target and present(item.target, depsgraph) for item in obj.shellwarp.renders)


def release(item):
    """Gives an object its rest shape back."""
    if item is not None and item.type == "MESH":
        shape_key.remove(item)
        stack.detach(item)
