"""Vertices that a table names: by side, box, vertices, list or group, as of scene files."""

import numpy

from .errors import SceneError
from .simulated import drawn_at, numbers_at

WHERE = {"side", "box", "vertices", "list", "group"}
SIDES = [f"{end}-{axis}" for end in ("low", "high") for axis in "xyz"]
SKIN = 0.01   # of the extent: a row of vertices that is not quite straight counts as one side


def check(where, item):
    """SceneError unless the table names vertices; whether there are such, the mesh tells later."""
    if not set(item) & WHERE:
        raise SceneError(f"{where}: name the vertices by {', '.join(sorted(WHERE))}")
    if item.get("side", SIDES[0]) not in SIDES:
        raise SceneError(f"{where}: side is {item['side']!r}, expected one of {', '.join(SIDES)}")
    box = item.get("box", [0] * 6)
    if not isinstance(box, list) or len(box) != 6 or not all(isinstance(x, (int, float)) for x in box):
        raise SceneError(f"{where}: box is {box!r}, expected six numbers")
    vertices = item.get("vertices", [])
    if not isinstance(vertices, list) or not all(isinstance(v, int) and not isinstance(v, bool) for v in vertices):
        raise SceneError(f"{where}: vertices is {vertices!r}, expected a list of numbers of vertices")


def chosen(item, simulated, mesh, what="a support"):
    """The vertices that a table names among those that are simulated, sorted and each once: (k). `mesh` is the job's."""
    found = numpy.zeros(len(simulated.positions), dtype=bool)
    if "side" in item:
        found[side_vertices(item["side"], simulated.positions)] = True
    if "box" in item:
        low, high = numpy.array(item["box"][:3]), numpy.array(item["box"][3:])
        found |= ((simulated.positions >= low) & (simulated.positions <= high)).all(axis=1)
    for vertex in [*item.get("vertices", ()), *_listed(item), *_grouped(item, mesh)]:
        found[simulated.here(vertex)] = True
    if not found.any():
        raise SceneError(f"{what} holds no vertex" if what == "a support" else f"{what} names no vertex")
    return numpy.flatnonzero(found)


def side_vertices(side, positions):
    """The vertices within a hundredth of the extent from an end."""
    values = positions[:, "xyz".index(side[-1])]
    low, high = values.min(), values.max()
    return numpy.flatnonzero(abs(values - (high if side.startswith("high") else low)) <= SKIN * (high - low))


def one_vertex(item, simulated, mesh):
    """The vertex that a table names: itself, the nearest to a point, or the one at the middle of what it names."""
    if "vertex" in item:
        return simulated.here(item["vertex"])
    positions = simulated.positions
    point = numpy.array(item["nearest"], float) if "nearest" in item else positions[chosen(item, simulated, mesh, "a handle")].mean(axis=0)
    return int(numpy.argmin(((positions - point) ** 2).sum(axis=1)))


def _listed(item):
    if "list" not in item:
        return ()
    numbers = numbers_at(item["list"])
    if (numbers != numpy.floor(numbers)).any():
        raise SceneError(f"{item['list']}: {numbers[numbers != numpy.floor(numbers)][0]:g} is no number of a vertex")
    return numbers.astype(int).tolist()


def _grouped(item, mesh):
    if "group" not in item:
        return ()
    groups = drawn_at(mesh).groups or {}
    if item["group"] not in groups:
        raise SceneError(f"the mesh has no group {item['group']!r}; it has {', '.join(sorted(groups)) or 'none'}")
    return groups[item["group"]]
