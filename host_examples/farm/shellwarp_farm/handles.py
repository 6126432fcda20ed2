"""Vertices of a job that are led along keys, and let go: `handle` tables as of scene files."""

import math

import numpy

from . import selection, way
from .errors import SceneError
from .materials import known
from .motion import rotation_matrix
from .simulated import simulated_at

NAMES = ("vertex", "nearest", "side", "group")   # of the vertex, one of them
KEYS = {*NAMES, "kind", "axes", "compliance", "release", "key"}
KINDS = {"position": ("position",), "orientation": ("orientation",), "both": ("position", "orientation")}
SAME_TIME = 1e-9   # s: sums of steps are compared with times that someone wrote


def check(where, item):
    """SceneError unless the table is a handle's."""
    known(where, item, KEYS)
    if len(set(item) & set(NAMES)) != 1:
        raise SceneError(f"{where}: name the vertex by one of {', '.join(NAMES)}")
    selection.check(where, {"side": item.get("side", "low-x")})
    way.check_vector(where, item, "nearest")
    kind = item.get("kind", "position")
    if kind not in KINDS:
        raise SceneError(f"{where}: the kind is {kind!r}, expected one of {', '.join(KINDS)}")
    check_axes(where, item)
    if not 0 <= item.get("compliance", 0) < math.inf:
        raise SceneError(f"{where}: compliance is {item['compliance']!r}, expected a number from 0 on")
    way.check(where, item.get("key", []))
    for part, key in (("position", "offset"), ("orientation", "rotate_degrees")):
        if part not in KINDS[kind] and any(key in entry for entry in item.get("key", [])):
            raise SceneError(f"{where}: {key} goes with a handle that holds {'a position' if part == 'position' else 'an orientation'}")


def check_axes(where, item):
    """SceneError unless `axes`, where it is there, is some of the letters xyz."""
    axes = item.get("axes", "xyz")
    if not isinstance(axes, str) or not axes or set(axes) - set("xyz"):
        raise SceneError(f"{where}: axes is {axes!r}, expected some of the letters xyz")


class Handles:
    """The handles of a job on what is simulated."""

    def __init__(self, job):
        simulated = simulated_at(job)
        self._placed = [(item, vertex, simulated.positions[vertex]) for item in job["handle"]
                        for vertex in [selection.one_vertex(item, simulated, job["mesh"])]]
        self._held = set()

    def move(self, state, seconds):
        """Puts every handle where it is to be at the end of the next step, and lets go of those whose time is over."""
        for number, (item, vertex, rest) in enumerate(self._placed):
            ids = [(2 * number + ("position", "orientation").index(part), part) for part in KINDS[item.get("kind", "position")]]
            held = seconds <= item.get("release", math.inf) + SAME_TIME
            offset, turn = way.at(item.get("key", []), seconds)
            targets = {"position": {"position": rest + offset}, "orientation": {"rotation": rotation_matrix(numpy.radians(turn))}}
            for id_, part in ids:
                if held:
                    state.set_constraint(id_, part, vertex, **targets[part], axes=item.get("axes", "xyz"), compliance=item.get("compliance", 0.0))
                elif number in self._held:
                    state.clear_constraint(id_)
            (self._held.add if held else self._held.discard)(number)


def demand(items):
    """What a choice by an error is told of handles: the axes that they hold along, and how far they go."""
    if not items:
        return {}
    return {"handle_axes": "".join(sorted({axis for item in items for axis in item.get("axes", "xyz")})),
            "handle_distance": max((math.hypot(*key.get("offset", (0, 0, 0))) for item in items for key in item.get("key", [])), default=0.0)}
