"""What is simulated of a job's mesh, and what a worker keeps of files so that each is read once."""

import functools
import os
from collections.abc import Callable
from typing import NamedTuple

import numpy
import shellwarp

from .errors import SceneError
from .mesh_file import file_of, read_drawn, read_mesh, read_polygons
from .numbers_file import read_numbers
from .weld import welded

KEPT_FILES = 24   # a mesh is several: its triangles, its faces, what is drawn of it


class Simulated(NamedTuple):
    """The mesh that is simulated: a job's own, the same welded, or a proxy of it."""

    positions: numpy.ndarray
    triangles: numpy.ndarray
    n_file: int           # vertices of the job's own mesh
    here: Callable        # the number here of a vertex of that
    carried: Callable     # values here of values at its vertices
    n_file_triangles: int
    file_triangles: "numpy.ndarray | slice"   # that each here stands for
    is_other: bool        # than the job's own
    calibrates: "shellwarp.Proxy | None" = None   # its models
    uncalibrated: str = ""   # why none does, where that was not asked for


def simulated_at(tables):
    """Of the tables' `mesh` and `proxy`."""
    asset = mesh_at(tables["mesh"])
    n_file = len(asset[0])
    if not tables["proxy"]:
        return whole_of(asset)
    options = {**tables["proxy"], "held": _held_of(tables, asset)}
    wanted = options.pop("calibrated", True)
    why = "nothing holds it" if wanted and not options["held"] else ""
    positions, triangles, nearest, sources, weights, file_triangles, made = _kept_of(_proxy_reader(tuple(sorted(options.items()))), tables["mesh"])
    carried = functools.partial(_carried, sources, weights)
    return Simulated(positions, triangles, n_file, functools.partial(_checked, nearest), carried, len(asset[1]), file_triangles, True, made if wanted and not why else None, why)


def whole_of(asset):
    """A job's own mesh, simulated as it is."""
    n = len(asset[0])
    return Simulated(*asset, n, functools.partial(_checked, range(n)), lambda values: values, len(asset[1]), slice(None), False)


def _held_of(tables, asset):
    """The vertices of the job's own mesh that its supports hold, whose outline a proxy keeps."""
    from . import materials, selection, supports   # which use what is here

    whole = whole_of(asset)
    chosen = supports.with_neighbours if materials.holds_slopes_by_neighbours(tables["material"]) else selection.chosen
    held = set()
    for support in tables["support"]:
        try:
            held.update(chosen(support, whole, tables["mesh"]).tolist())
        except SceneError:   # whoever makes the shell says so
            continue
    return tuple(sorted(held))


def _checked(numbers, vertex):
    if not 0 <= vertex < len(numbers):
        raise SceneError(f"vertex {vertex} is named; the mesh has {len(numbers)}, from 0")
    return int(numbers[vertex])


def _carried(sources, weights, values):
    return numpy.einsum("vk...,vk->v...", numpy.asarray(values, float)[sources], weights)


@functools.lru_cache
def _proxy_reader(options):
    return functools.partial(_proxy_of, **dict(options))


def _proxy_of(path, vertices=None, thickness=None, cut=False, weld=0.0, held=()):
    positions, triangles = mesh_at(path)
    try:
        if vertices is None:
            return *welded(positions, triangles, weld), None
        made = shellwarp.Proxy(positions, triangles, vertices, weld=weld, thickness=thickness or 0.0, cut=cut, keep_sides=thickness == 0, held=held)
        own, corners = made.positions(), made.triangles()
        return own, corners, made.nearest(), *made.sources(), nearest_of(middles(positions, triangles), middles(own, corners)), made
    except (shellwarp.ShellwarpError, SceneError) as error:
        raise SceneError(f"{path}: {error}") from None


def middles(positions, triangles):
    """The mean of each triangle's corners (m x 3)."""
    return positions[triangles].mean(axis=1)


def nearest_of(points, wanted, at_once=64):
    """For each of `wanted` (k x 3) the number of the nearest of `points` (n x 3)."""
    origin = points.mean(axis=0)   # so that the squares below keep their digits
    points, wanted = points - origin, wanted - origin
    squares = (points ** 2).sum(axis=1)
    return numpy.concatenate([(squares - 2 * wanted[k:k + at_once] @ points.T).argmin(axis=1) for k in range(0, len(wanted), at_once)])


def by_vertices(path, simulated, what):
    """Numbers of a file, one for each vertex of the mesh in its file, at the vertices that are simulated."""
    values = numbers_at(path)
    if len(values) != simulated.n_file:
        raise SceneError(f"{path}: {len(values)} {what}; the mesh has {simulated.n_file} vertices")
    return simulated.carried(values)


def mesh_at(path):
    """As read_mesh, kept until the file changes."""
    return _kept_of(read_mesh, path)


def polygons_at(path):
    """As read_polygons, kept until the file changes."""
    return _kept_of(read_polygons, path)


def drawn_at(path):
    """As read_drawn, kept until the file changes."""
    return _kept_of(read_drawn, path)


def numbers_at(path, columns=None):
    """As read_numbers, kept until the file changes."""
    return _kept_of(read_numbers, path, columns)


def _kept_of(reader, path, *more):
    try:
        facts = os.stat(file_of(path))
        return _read(reader, path, facts.st_mtime_ns, facts.st_size, *more)
    except FileNotFoundError:
        return reader(path, *more)   # says what is missing


@functools.lru_cache(maxsize=KEPT_FILES)
def _read(reader, path, _time, _size, *more):
    return reader(path, *more)
