"""Meshes from OBJ and USD files.

A mesh is named by its file. Behind it may stand a prim as USD writes it, asset.usd</World/leaf>: one of several meshes; of an OBJ file,
the prim of a USD asset that has the same vertices."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy

from .errors import SceneError
from .polygon import cut


class Asset(NamedTuple):
    """The prim of a USD asset, with what its stage says; None where nobody knows."""

    prim: str
    up_axis: "str | None" = None
    metres_per_unit: "float | None" = None
    subdivided: bool = False
    has_normals: bool = False
    sheet: "dict[str, float] | None" = None   # what its material says of a sheet, in kilograms, seconds and the stage's length


class Drawn(NamedTuple):
    """What is drawn of a mesh: its faces, each a list of vertices, and texture coordinates (n x 2) with one number a corner."""

    faces: list
    uvs: "numpy.ndarray | None" = None
    corner_uvs: "numpy.ndarray | None" = None
    asset: "Asset | None" = None
    groups: "dict[str, list] | None" = None   # of an OBJ file: vertices of its groups and objects


# Of a material of USD, the first that is told counts: the schema of surface deformables, the one before it, and the density of UsdPhysics.
OLD_SURFACE = "physxDeformableSurfaceMaterial:"
SHEET_OF_USD = [("young", "omniphysics:youngsModulus"), ("young", OLD_SURFACE + "youngsModulus"), ("poisson", "omniphysics:poissonsRatio"),
                ("poisson", OLD_SURFACE + "poissonsRatio"), ("thickness", "omniphysics:surfaceThickness"), ("thickness", OLD_SURFACE + "thickness"),
                ("volume_density", "omniphysics:density"), ("volume_density", OLD_SURFACE + "density"), ("volume_density", "physics:density")]
NAMED = re.compile(r"(?P<file>.*?)(?:<(?P<prim>/.*)>)?")
PRIM = re.compile(r"(/[A-Za-z_]\w*)+", re.ASCII)


def file_of(path):
    """The file that a mesh is named by."""
    return Path(NAMED.fullmatch(str(path))["file"])


def prim_of(path):
    """The prim behind it, None if there is none."""
    return NAMED.fullmatch(str(path))["prim"]


def beside(path, folder):
    """The same mesh, its file as seen from a folder."""
    prim = prim_of(path)
    return str((folder / file_of(path)).resolve()) + (f"<{prim}>" if prim else "")


def stem(path):
    """What files of a mesh are called by: its prim's name or its file's."""
    return Path(prim_of(path) or file_of(path)).stem


def read_mesh(path):
    """Positions (n x 3, float64) and triangles (m x 3, uint32). Polygons are cut as polygon.py has it."""
    points, faces = read_polygons(path)
    triangles = cut([face for face in faces if len(face) > 2], points)
    if len(triangles) == 0:
        raise SceneError(f"{path}: no faces found")
    return points, triangles


def read_polygons(path):
    """Positions (n x 3, float64) and faces, each a list of vertices; a cloud of points has none."""
    return _read(path)[:2]


def read_drawn(path):
    """What is drawn of it: Drawn."""
    return _read(path)[2]


def _read(path):
    file, prim = file_of(path), prim_of(path)
    if not file.is_file():
        raise SceneError(f"{file}: there is no such mesh")
    if prim and not PRIM.fullmatch(prim):
        raise SceneError(f"{path}: {prim} is no path of a prim, such as /World/leaf")
    try:
        points, faces, drawn = _read_usd(file, prim) if file.suffix.lower() in (".usd", ".usda", ".usdc") else _read_obj(file, prim)
    except (ValueError, IndexError) as error:
        raise SceneError(f"{path}: {error}") from None
    if len(points) == 0:
        raise SceneError(f"{path}: no vertices found")
    wrong = next((vertex for face in faces for vertex in face if not 0 <= vertex < len(points)), None)
    if wrong is not None:
        raise SceneError(f"{path}: a face names vertex {wrong}, from 0; there are {len(points)}")
    return numpy.array(points, dtype=numpy.float64).reshape(-1, 3), faces, drawn


def _read_obj(path, prim):
    points, faces, uvs, corner_uvs, groups, here = [], [], [], [], {}, {}
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:4]])
            elif words[:1] == ["vt"]:
                uvs.append(words[1:3])
            elif words[:1] in (["g"], ["o"]):
                here[words[0]] = words[1:]
            elif words[:1] == ["f"]:
                corners = [int(word.split("/", 1)[0]) for word in words[1:]]
                faces.append([index - 1 if index > 0 else len(points) + index for index in corners])
                for name in {*here.get("g", ()), *here.get("o", ())}:
                    groups.setdefault(name, set()).update(faces[-1])
                corner_uvs.extend((word.split("/") + [""])[1] for word in words[1:])
    named = {name: sorted(vertices) for name, vertices in groups.items()}
    return points, faces, Drawn(faces, *_uvs_of(uvs, corner_uvs), Asset(prim) if prim else None, named)


def _uvs_of(uvs, corners):
    """Arrays of an OBJ file's texture coordinates, and which each corner has; twice None unless every corner has one."""
    try:
        values, numbers = numpy.array(uvs, dtype=float).reshape(-1, 2), numpy.array([int(word) for word in corners], dtype=int)
    except ValueError:
        return None, None
    numbers = numpy.where(numbers < 0, numbers + len(values), numbers - 1)
    whole = len(numbers) > 0 and ((numbers >= 0) & (numbers < len(values))).all() and numpy.isfinite(values).all()
    return (values, numbers) if whole else (None, None)


def _read_usd(path, wanted):
    from pxr import Usd, UsdGeom
    stage = Usd.Stage.Open(str(path))
    prim = _only_mesh(stage, path, wanted)
    mesh = UsdGeom.Mesh(prim)
    time = Usd.TimeCode.EarliestTime()
    counts, corners = mesh.GetFaceVertexCountsAttr().Get(time), numpy.array(mesh.GetFaceVertexIndicesAttr().Get(time))
    place = numpy.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(prim))
    points = numpy.array(mesh.GetPointsAttr().Get(time), dtype=numpy.float64)
    ends = numpy.cumsum(counts)
    faces = [corners[end - count:end].tolist() for end, count in zip(ends, counts)]
    world = points @ place[:3, :3] + place[3, :3]
    asset = Asset(str(prim.GetPath()), str(UsdGeom.GetStageUpAxis(stage)), UsdGeom.GetStageMetersPerUnit(stage),
                  mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none, bool(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")), _sheet_of(stage, prim, lambda: _area(world, faces)))
    return world, faces, Drawn(faces, asset=asset)


def _area(points, faces):
    """Of all faces, each as the flat polygon that its vector area is of."""
    def twice(face):
        x = points[face]
        return numpy.linalg.norm(numpy.cross(x, numpy.roll(x, -1, axis=0)).sum(axis=0))
    return 0.5 * sum(twice(face) for face in faces)


def _sheet_of(stage, prim, area):
    """The numbers of a sheet that the material bound for physics has, those that are authored; None where no material is bound. A density or a mass of the mesh itself
    goes over the material's, as UsdPhysics has it: the mass as `area_density`."""
    from pxr import UsdPhysics, UsdShade
    bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
    if not bound:
        return None
    kilograms, found = UsdPhysics.GetStageKilogramsPerUnit(stage), {}
    for key, name in SHEET_OF_USD:
        attribute = bound.GetPrim().GetAttribute(name)
        if key not in found and attribute and attribute.HasAuthoredValue() and not (key == "volume_density" and attribute.Get() == 0):  # 0: not told
            found[key] = float(attribute.Get()) * (1 if key in ("poisson", "thickness") else kilograms)
    told = {name: float(value) * kilograms for name in ("physics:density", "physics:mass") if (value := prim.GetAttribute(name).Get())}   # 0: not told
    if "physics:mass" in told:
        found["area_density"] = told["physics:mass"] / area()
    elif "physics:density" in told:
        found["volume_density"] = told["physics:density"]
    return found


def _only_mesh(stage, path, wanted):
    """The prim of the stage's mesh, or of the one that is wanted."""
    from pxr import UsdGeom
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    names = ", ".join(str(prim.GetPath()) for prim in meshes)
    if wanted:
        meshes = [prim for prim in meshes if str(prim.GetPath()) == wanted]
        if not meshes:
            raise ValueError(f"there is no mesh {wanted}; there are {names or 'none'}")
    if len(meshes) != 1:
        raise ValueError(f"{len(meshes)} meshes, expected one; name one as {path.name}<{meshes[0].GetPath()}>: {names}" if meshes else "no mesh")
    return meshes[0]


def read_motion(path):
    """Of a USD mesh whose points or transforms are animated: seconds of its samples (k), and points (k x n x 3) in the world."""
    from pxr import Usd, UsdGeom
    stage = Usd.Stage.Open(str(file_of(path)))
    mesh = UsdGeom.Mesh(_only_mesh(stage, file_of(path), prim_of(path)))
    codes = set(mesh.GetPointsAttr().GetTimeSamples())
    prim = mesh.GetPrim()
    while prim:
        codes.update(UsdGeom.Xformable(prim).GetTimeSamples() if prim.IsA(UsdGeom.Xformable) else ())
        prim = prim.GetParent()
    codes = sorted(codes)
    if len(codes) < 2:
        raise SceneError(f"{path}: nothing of the mesh is animated")
    found = []
    for code in codes:
        place = numpy.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(mesh.GetPrim()))
        found.append(numpy.array(mesh.GetPointsAttr().Get(code), dtype=numpy.float64) @ place[:3, :3] + place[3, :3])
    return numpy.array(codes) / stage.GetTimeCodesPerSecond(), numpy.array(found)
