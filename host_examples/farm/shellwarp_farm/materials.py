"""The material of a job's shell: constants or a sheet, what varies over it, creases, grain and rest shape, as of scene files."""

import dataclasses

import numpy
import shellwarp

from . import selection
from .errors import SceneError
from .simulated import by_vertices, mesh_at, numbers_at

CONSTANTS = {"k_area": "area", "k_length": "length", "k_bend": "bend", "density": "density"}
SHEET = {"young", "poisson", "thickness", "volume_density"}
GRAIN = {"young_across", "shear", "direction", "directions"}   # of a sheet that is stiffer along a direction
VARIES = {**{name: name for name in ("k_area", "k_length", "k_bend")}, "density": "area_density",
          **{name: name for name in ("young", "thickness", "volume_density", "growth")}}   # the library's name of each map
KEYS = {*CONSTANTS, *SHEET, *GRAIN, "frequency", "sag", "preset", "from_usd", "map", "region", "crease", "rest_shape"}
LOOKS = {"frequency": "Hz", "sag": "a length"}   # by which the stiffness is found
CREASE = {"box", "edges", "list", "factor", "angle_degrees", "yield_degrees"}


def check(where, table):
    """SceneError unless maps, regions and creases have keys that are known, and what they need."""
    for key, of in LOOKS.items():
        if key in table:
            if not table[key] > 0:
                raise SceneError(f"{where}: {key} is {table[key]!r}, expected {of} above 0")
            if wrong := sorted((set(table) & (set(CONSTANTS) | SHEET | GRAIN | {"preset", "from_usd"} | set(LOOKS) - {key})) - {"density", "thickness"}):
                raise SceneError(f"{where}: {wrong[0]} does not go with {key}, which sets the stiffness")
    if not isinstance(table.get("from_usd", True), bool):
        raise SceneError(f"{where}: from_usd is {table['from_usd']!r}, expected true or false")
    known(f"{where}, map", table.get("map", {}), VARIES)
    for number, region in enumerate(table.get("region", []), 1):
        place = f"{where}, region {number}"
        known(place, region, selection.WHERE | set(VARIES))
        selection.check(place, region)
        if not set(region) & set(VARIES):
            raise SceneError(f"{place}: give a constant of its own: {', '.join(VARIES)}")
        if wrong := [key for key in VARIES if key in region and not region[key] > 0]:
            raise SceneError(f"{place}: {wrong[0]} is {region[wrong[0]]!r}, expected a number above 0")
    for number, crease in enumerate(table.get("crease", []), 1):
        _check_crease(f"{where}, crease {number}", crease)


def is_sheet(table):
    """Whether a material is one of kilograms and metres, and not of constants or by look."""
    return not look_of(table) and bool(set(table) & (SHEET | GRAIN | {"preset"}) or table.get("from_usd"))


def holds_slopes_by_neighbours(table):
    """Whether clamped vertices are held with their neighbours: by the paper's constants."""
    return any(key in table for key in (*LOOKS, "k_area", "k_length", "k_bend"))


def look_of(table):
    """The key of what sets the stiffness, None where numbers do."""
    return next((key for key in LOOKS if key in table), None)


def with_usd(table, asset):
    """The table, and where it asks for that the numbers of the material that a USD asset has bound to the mesh, under its own."""
    if not table.get("from_usd"):
        return {key: value for key, value in table.items() if key != "from_usd"}
    if "preset" in table:
        raise SceneError("material: preset does not go with from_usd: both give a sheet")
    if asset is None or asset.sheet is None:
        raise SceneError("material: from_usd is true, and the mesh has no material bound to it in a USD file")
    sheet = {**asset.sheet, **{key: value for key, value in table.items() if key != "from_usd"}}
    area_density = sheet.pop("area_density", None)
    if area_density and "thickness" in sheet and "volume_density" not in table:
        sheet["volume_density"] = area_density / sheet["thickness"]
    if missing := sorted(SHEET - set(sheet)):
        raise SceneError(f"material: the material that {asset.prim} has bound does not say {missing[0]}: give it here")
    return sheet


def known(where, table, keys):
    """SceneError unless the keys are known."""
    if unknown := sorted(set(table) - set(keys)):
        raise SceneError(f"{where}: unknown key {unknown[0]!r}; known: {', '.join(sorted(keys))}")


def _check_crease(where, crease):
    known(where, crease, CREASE)
    if not set(crease) & {"box", "edges", "list"}:
        raise SceneError(f"{where}: name the edges by box, edges or list")
    selection.check(where, {"box": crease.get("box", [0] * 6)})
    edges = crease.get("edges", [])
    if not isinstance(edges, list) or not all(isinstance(edge, list) and len(edge) == 2 and all(isinstance(v, int) for v in edge) for edge in edges):
        raise SceneError(f"{where}: edges is {edges!r}, expected pairs of vertices")
    if crease.get("factor", 1) < 0 or not -180 <= crease.get("angle_degrees", 0) <= 180:
        raise SceneError(f"{where}: a factor is not negative, an angle from -180 to 180")
    if not crease.get("yield_degrees", 1) > 0:
        raise SceneError(f"{where}: yield_degrees is {crease['yield_degrees']!r}, expected a number above 0")
    if crease.get("factor", 1) == 1 and not set(crease) & {"angle_degrees", "yield_degrees"}:
        raise SceneError(f"{where}: give a factor other than 1, angle_degrees or yield_degrees")


def material_of(table, simulated=None, metres_per_unit=1.0):
    """The Material or Sheet of a table: one of them, and of a sheet all four numbers, of its preset or its own. By look it is not yet as stiff as it is to be.
    A preset is in the unit of length that is so many metres long."""
    if look_of(table):
        return shellwarp.look.sheet_of(simulated.positions, simulated.triangles, float(table.get("density", 1.0)), float(table.get("thickness", 0.0)))
    constants, sheet = sorted(set(table) & set(CONSTANTS)), sorted(set(table) & (SHEET | GRAIN | {"preset"}))
    if constants and sheet:
        raise SceneError(f"material: {constants[0]} does not go with {sheet[0]}: either the constants or a sheet")
    if not sheet:
        if all(table.get(key) == 0 for key in ("k_area", "k_length", "k_bend")):
            raise SceneError("material: k_area, k_length and k_bend are all 0, so that nothing resists anything: give one, or leave all out for the defaults")
        if not table.get("density", 1) > 0:
            raise SceneError(f"material: density is {table['density']!r}, expected a number above 0")
        return shellwarp.Material(**{CONSTANTS[key]: float(table[key]) for key in constants})
    own = {key: float(value) for key, value in table.items() if key in SHEET | {"young_across", "shear"}}
    if "direction" in table and "directions" in table:
        raise SceneError("material: give direction or directions, not both")
    if ("young_across" in table) != ("direction" in table or "directions" in table):
        raise SceneError(f"material: young_across and {'directions' if 'directions' in table else 'direction'} go together")
    if "preset" in table:
        return dataclasses.replace(shellwarp.Sheet.known(table["preset"], metres_per_unit), **own)
    mapped = set(table.get("map", {})) - ({"young"} if "young_across" in table else set())   # need not be there besides
    if missing := sorted(SHEET - set(table) - mapped):
        raise SceneError(f"material: a sheet needs {missing[0]}, or a preset")
    return shellwarp.Sheet(**{**dict.fromkeys(SHEET, 0.0), **own})


def parts_of(table, material, simulated, mesh):
    """What a Shell takes of the table beside its material: maps, creases, rest shape and directions."""
    parts = {"maps": _maps(table, material, simulated, mesh), "creases": _creases(table, simulated, mesh)}
    if "rest_shape" in table:
        parts["rest_positions"] = _rest_shape(table["rest_shape"], simulated, mesh)
    if "directions" in table:
        found = numbers_at(table["directions"], 3)
        if len(found) != simulated.n_file_triangles:
            raise SceneError(f"{table['directions']}: {len(found)} directions; the mesh has {simulated.n_file_triangles} triangles")
        parts["directions"] = found[simulated.file_triangles]
    elif "direction" in table:
        parts["directions"] = table["direction"]
    return parts


def _maps(table, material, simulated, mesh):
    """Values of the library's maps: files, and over those by vertices the regions."""
    found = {}
    for key, path in table.get("map", {}).items():
        _check_varies(key, material, table)
        values = numbers_at(path)
        by_triangles = len(values) == simulated.n_file_triangles and len(values) != simulated.n_file
        found[key] = values[simulated.file_triangles] if by_triangles else by_vertices(path, simulated, f"values of {key}")
    for region in table.get("region", []):
        vertices = selection.chosen(region, simulated, mesh, "a region of the material")
        for key in set(region) & set(VARIES):
            _check_varies(key, material, table)
            values = found.setdefault(key, numpy.full(len(simulated.positions), _uniform(key, material)))
            if len(values) != len(simulated.positions):
                raise SceneError(f"material: {key} is given by triangles, so that no region can have its own")
            found[key] = numpy.where(numpy.isin(numpy.arange(len(values)), vertices), float(region[key]), values)
    for key, values in found.items():
        if not (values > 0).all():
            raise SceneError(f"material: {key} is {values[values <= 0][0]:g} at {numpy.flatnonzero(values <= 0)[0]}, expected numbers above 0")
    return {VARIES[key]: values for key, values in found.items()}


def _check_varies(key, material, table):
    if key == "growth":
        return
    if look_of(table) and key != "density":
        raise SceneError(f"material: {key} does not go with {look_of(table)}, which sets it")
    if isinstance(material, shellwarp.Sheet) != (key in SHEET):
        raise SceneError(f"material: {key} varies over {'a sheet' if key in SHEET else 'a shell of the constants'} alone")


def _uniform(key, material):
    return 1.0 if key == "growth" else getattr(material, CONSTANTS.get(key, key))


def _creases(table, simulated, mesh):
    """(a, b, factor), (a, b, factor, angle) or (a, b, factor, angle, yield) of each edge; later tables go over earlier ones."""
    if not table.get("crease"):
        return []
    ends = numpy.sort(simulated.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, counts = numpy.unique(ends, axis=0, return_counts=True)
    inner, last = {tuple(edge): count > 1 for edge, count in zip(edges.tolist(), counts)}, {}
    for crease in table["crease"]:
        for edge in _crease_edges(crease, inner, simulated, mesh):
            last[edge] = crease
    return [(*edge, *_of_crease(crease)) for edge, crease in sorted(last.items(), key=lambda item: item[0])]


def _of_crease(crease):
    angle = float(numpy.radians(crease["angle_degrees"])) if "angle_degrees" in crease else None
    if "yield_degrees" in crease:
        return float(crease.get("factor", 1)), angle, float(numpy.radians(crease["yield_degrees"]))
    return float(crease.get("factor", 1)), *([] if angle is None else [angle])


def _crease_edges(crease, inner, simulated, mesh):
    listed = numbers_at(crease["list"], 2).astype(int).tolist() if "list" in crease else []
    found = []
    for named in [*crease.get("edges", []), *listed]:
        edge = tuple(sorted(simulated.here(vertex) for vertex in named))
        if not inner.get(edge):
            raise SceneError(f"material crease: edge {named[0]}-{named[1]} " +
                             ("has only one triangle: nothing folds there" if edge in inner else "is none of the mesh: no triangle has both vertices"))
        found.append(edge)
    if "box" in crease:
        inside = set(selection.chosen({"box": crease["box"]}, simulated, mesh, "a crease of the material").tolist())
        within = [edge for edge, folds in inner.items() if folds and inside.issuperset(edge)]
        if not within:
            raise SceneError(f"material crease: the box holds {len(inside)} vertices, but no edge between two triangles")
        found.extend(within)
    return found


def _rest_shape(path, simulated, mesh):
    """Where each vertex is without stress; of a proxy as far from it as the file's is from the mesh."""
    points, asset = mesh_at(path)[0], mesh_at(mesh)[0]
    if len(points) != len(asset):
        raise SceneError(f"{path}: rest_shape has {len(points)} vertices; the mesh has {len(asset)}")
    return simulated.positions + simulated.carried(points - asset) if simulated.is_other else points
