"""Vertices that lie together made one, so that pieces which touch are one shell: as host_examples/cli/weld.cpp has it."""

import itertools

import numpy

from .errors import SceneError


def welded(positions, triangles, distance):
    """Vertices within `distance` of each other made one, the first of them; what is then no triangle, or there twice, is left out.

    Positions, triangles, the number here of each vertex of the file; of each vertex here three of the file and their weights, the first
    counts; and of each triangle here its number in the file."""
    here, firsts = _together(positions, distance)
    corners, known, kept = here[triangles], set(), []
    for number, triangle in enumerate(corners.tolist()):
        key = frozenset(triangle)
        if len(key) == 3 and key not in known:
            known.add(key)
            kept.append(number)
    if not kept:
        raise SceneError("weld: no triangle is left at this distance")
    sources = numpy.repeat(firsts[:, None], 3, axis=1)
    weights = numpy.tile([1.0, 0.0, 0.0], (len(firsts), 1))
    return positions[firsts], corners[kept].astype(numpy.uint32), here, sources, weights, numpy.array(kept)


def _together(positions, distance):
    """The new number of each vertex, and the vertex that each new number is the first of."""
    low, size = positions.min(axis=0), float(numpy.ptp(positions, axis=0).max())
    if not distance <= size:
        raise SceneError("weld: the distance must be from 0 to the mesh's size")
    width = max(distance, size * 1e-9)   # what is within the distance is in the same cell or the next
    cells, steps, firsts, here = {}, list(itertools.product((-1, 0, 1), repeat=3)), [], []
    for vertex, cell in enumerate(numpy.floor((positions - low) / width).astype(int).tolist()):
        near = (w for step in steps for w in cells.get(tuple(map(sum, zip(cell, step))), ()))
        found = next((w for w in near if numpy.linalg.norm(positions[vertex] - positions[firsts[w]]) <= distance), None)
        if found is None:
            found = len(firsts)
            firsts.append(vertex)
            cells.setdefault(tuple(cell), []).append(found)
        here.append(found)
    return numpy.array(here), numpy.array(firsts)
