"""Ways along keys, of handles, supports and colliders: as host_examples/cli/handle_motion.hpp has them."""

import numpy

from .errors import SceneError

MOTION = {"time", "offset", "rotate_degrees"}


def check(where, keys, allowed=MOTION):
    """SceneError unless the keys have ascending times, and vectors of three numbers."""
    times = [key.get("time") for key in keys]
    if None in times or any(a >= b for a, b in zip(times, times[1:])):
        raise SceneError(f"{where}: each key needs a time, and times must ascend: they are {times}")
    for key in keys:
        if unknown := sorted(set(key) - set(allowed)):
            raise SceneError(f"{where}: unknown key {unknown[0]!r} of a key; known: {', '.join(sorted(allowed))}")
        check_vector(where, key, "offset")
        check_vector(where, key, "rotate_degrees")


def check_vector(where, table, key, count=3):
    """SceneError unless the key, where it is there, has so many numbers."""
    value = table.get(key, [0] * count)
    if not isinstance(value, list) or len(value) != count or not all(isinstance(x, (int, float)) for x in value):
        raise SceneError(f"{where}: {key} is {value!r}, expected {'three' if count == 3 else count} numbers")


def at(keys, seconds):
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
