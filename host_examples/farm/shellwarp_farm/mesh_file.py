"""Meshes from OBJ and USD files, and the vertices that supports choose."""

from pathlib import Path

import numpy

from .errors import SceneError
from .polygon import cut


def read_mesh(path):
    """Positions (n x 3, float64) and triangles (m x 3, uint32). Polygons are cut as polygon.py has it."""
    points, faces = read_polygons(path)
    triangles = cut([face for face in faces if len(face) > 2], points)
    if len(triangles) == 0:
        raise SceneError(f"{path}: no faces found")
    return points, triangles


def read_polygons(path):
    """Positions (n x 3, float64) and faces, each a list of vertices; a cloud of points has none."""
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"{path}: there is no such mesh")
    try:
        points, faces = _read_usd(path) if path.suffix.lower() in (".usd", ".usda", ".usdc") else _read_obj(path)
    except (ValueError, IndexError) as error:
        raise SceneError(f"{path}: {error}") from None
    if len(points) == 0:
        raise SceneError(f"{path}: no vertices found")
    wrong = next((vertex for face in faces for vertex in face if not 0 <= vertex < len(points)), None)
    if wrong is not None:
        raise SceneError(f"{path}: a face names vertex {wrong}, from 0; there are {len(points)}")
    return numpy.array(points, dtype=numpy.float64).reshape(-1, 3), faces


def _read_obj(path):
    points, faces = [], []
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:4]])
            elif words[:1] == ["f"]:
                corners = [int(word.split("/", 1)[0]) for word in words[1:]]
                faces.append([index - 1 if index > 0 else len(points) + index for index in corners])
    return points, faces


def _read_usd(path):
    from pxr import Usd, UsdGeom
    stage = Usd.Stage.Open(str(path))
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    if len(meshes) != 1:
        raise ValueError(f"{len(meshes)} meshes, expected one")
    mesh = UsdGeom.Mesh(meshes[0])
    time = Usd.TimeCode.EarliestTime()
    counts, corners = mesh.GetFaceVertexCountsAttr().Get(time), numpy.array(mesh.GetFaceVertexIndicesAttr().Get(time))
    place = numpy.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(meshes[0]))
    points = numpy.array(mesh.GetPointsAttr().Get(time), dtype=numpy.float64)
    ends = numpy.cumsum(counts)
    return points @ place[:3, :3] + place[3, :3], [corners[end - count:end].tolist() for end, count in zip(ends, counts)]


def held_vertices(supports, positions, triangles):
    """The vertices that supports hold, clamped ones with their neighbours, sorted and each once: (k), uint32."""
    held = numpy.zeros(len(positions), dtype=bool)
    for support in supports:
        chosen = _chosen(support, positions)
        if support["kind"] == "clamped":
            touched = chosen[triangles].any(axis=1)
            chosen[triangles[touched].ravel()] = True
        held |= chosen
    return numpy.flatnonzero(held).astype(numpy.uint32)


def supported_vertices(supports, positions, kind):
    """The vertices that supports of a kind name, sorted and each once: (k), uint32."""
    chosen = [_chosen(support, positions) for support in supports if support["kind"] == kind]
    return numpy.flatnonzero(numpy.any(chosen, axis=0) if chosen else ()).astype(numpy.uint32)


def _chosen(support, positions):
    chosen = numpy.zeros(len(positions), dtype=bool)
    if "box" in support:
        low, high = numpy.array(support["box"][:3]), numpy.array(support["box"][3:])
        chosen |= ((positions >= low) & (positions <= high)).all(axis=1)
    for vertex in support.get("vertices", ()):
        if not 0 <= vertex < len(positions):
            raise SceneError(f"a support names vertex {vertex}; the mesh has {len(positions)}, from 0")
        chosen[vertex] = True
    if not chosen.any():
        raise SceneError("a support holds no vertex")
    return chosen
