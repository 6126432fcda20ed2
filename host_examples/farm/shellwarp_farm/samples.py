"""Points that are animated: of a PC2 file, whose samples are at frames, or of a mesh in a USD file."""

import functools
import os

import numpy

from . import point_cache
from .errors import SceneError
from .mesh_file import file_of, read_mesh, read_motion

KEPT = 16   # files that a worker keeps


def points_at(path, mesh, seconds, frame_rate):
    """Points (n x 3) at a time: straight between samples, and as there before and after them. `mesh` tells how many there are."""
    times, points = samples(path, mesh)
    time = seconds * frame_rate if _in_frames(path) else seconds
    if len(times) == 1:
        return points[0].astype(float)
    k = int(numpy.clip(numpy.searchsorted(times, time) - 1, 0, len(times) - 2))
    t = min(max((time - times[k]) / (times[k + 1] - times[k]), 0.0), 1.0)
    return (1 - t) * points[k].astype(float) + t * points[k + 1]


def samples(path, mesh):
    """Times (k), frames or seconds, and points (k x n x 3) in the world, as many as the mesh has vertices."""
    try:
        facts = os.stat(file_of(path))
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such file") from None
    times, points = _read(path, facts.st_mtime_ns, facts.st_size)
    if points.shape[1] != (count := len(read_mesh(mesh)[0])):
        raise SceneError(f"{path}: has {points.shape[1]} points, the mesh {mesh} has {count} vertices")
    return times, points


def _in_frames(path):
    return file_of(path).suffix.lower() == ".pc2"


@functools.lru_cache(maxsize=KEPT)
def _read(path, _time, _size):
    if _in_frames(path):
        return point_cache.read(path)
    if file_of(path).suffix.lower() not in (".usd", ".usda", ".usdc"):
        raise SceneError(f"{path}: is neither a PC2 file nor a USD file with points that are animated")
    return read_motion(path)
