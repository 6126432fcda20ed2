"""Inputs of a shell between those of one frame and the next."""

from dataclasses import replace

import numpy
from mathutils import Matrix, Vector


def blend(before, after, t):
    """Inputs on the way: loads as at the end, pose and handles between; a handle that is new stands where it ends."""
    if t == 1.0:
        return after
    earlier = {handle.number: handle for handle in before.handles}
    handles = tuple(blend_handle(earlier.get(handle.number, handle), handle, t) for handle in after.handles)
    solids = tuple(replace(b, origin=lerp(a.origin, b.origin, t), rotation=turn(a.rotation, b.rotation, t),
                           points=between(a.points, b.points, t, numpy.float32)) for a, b in zip(before.solids, after.solids))
    return replace(after, origin=lerp(before.origin, after.origin, t), handles=handles, solids=solids,
                   supports=between(before.supports, after.supports, t), rest=between(before.rest, after.rest, t), rotation=turn(before.rotation, after.rotation, t))


def between(before, after, t, kind=numpy.float64):
    """Numbers as bytes on the way; as at the end where there were others."""
    if not after or len(before) != len(after):
        return after
    return ((1 - t) * numpy.frombuffer(before, kind) + t * numpy.frombuffer(after, kind)).astype(kind).tobytes()


def blend_handle(before, after, t):
    if before.kind != after.kind:
        return after
    return replace(after, position=lerp(before.position, after.position, t),
                   rotation=turn(before.rotation, after.rotation, t) if after.rotation else ())


def lerp(a, b, t):
    return tuple(Vector(a).lerp(Vector(b), t)) if b else ()


def turn(a, b, t):
    first, last = (Matrix((m[0:3], m[3:6], m[6:9])).to_quaternion() for m in (a, b))
    between = first.slerp(last, t).normalized()  # straight, and so too short by 1e-4, where the two are near each other
    return tuple(x for row in between.to_matrix() for x in row)
