"""A job's shell, its content key, and its modes from the cache."""

import dataclasses
import functools
import os
import threading
from collections import OrderedDict
from pathlib import Path

import numpy
import shellwarp
from shellwarp.method import find, precompute_options

from . import files
from .cache import Cache
from .content import content_hash
from .errors import FarmError, SceneError
from .job_log import library_messages
from .mesh_file import file_of, held_vertices, read_drawn, read_mesh, read_polygons, supported_vertices
from .scenes import CONSTANTS, GRAIN, MODEL_KEYS, SHEET

MATERIAL = {"k_area": "area", "k_length": "length", "k_bend": "bend", "density": "density"}
KEPT = 4   # models that a worker keeps loaded
KEPT_MESHES = 12   # each as triangles, as faces and as what is drawn

_kept = OrderedDict()
_lock = threading.Lock()


def model_tables(job):
    """The part of a job that its model is made of."""
    return {"mesh": job["mesh"], "proxy": job["proxy"], "material": job["material"], "support": job["support"],
            "options": options_of(job["simulation"], [job["simulation"]["method"]])}


def options_of(simulation, methods):
    """What the precompute is told, for all of some methods. SceneError where the library does not have one."""
    told = {key: simulation[key] for key in ("modes", "precision", "contact_patches")}
    gravity = float(numpy.linalg.norm(simulation["gravity"]))
    chosen = [method for method in methods if method in shellwarp.methods() and find(method).needs_choice]
    if len(methods) > 1 and chosen and (simulation["auto_error"] or simulation["auto_operations"]):
        raise SceneError("a model that was made for a choice has one method alone: give it a list of its own")
    asked = {key: simulation[key] for key in MODEL_KEYS if key not in told}
    try:
        for method in methods:
            told = _merged(told, precompute_options(method, **asked, gravity=gravity))
    except shellwarp.InvalidArgumentError as error:
        raise SceneError(str(error)) from None
    return told


def _options_here(tables):
    """The options, vertices numbered as in what is simulated."""
    here = simulated_at(tables)[2]
    return {**tables["options"], "contact_patches": [here(vertex) for vertex in tables["options"].get("contact_patches", ())]}


def _merged(told, options):
    """Options for one more method: the reduced shell that either needs, which may be left out where both may do without."""
    both = (told, options)
    merged = {**told, **options, "reduced_fields": max(of.get("reduced_fields", 0) for of in both)}
    if any(of.get("auto") for of in both):
        merged["auto"] = not any(of.get("reduced_fields") and not of.get("auto") for of in both)
    return merged


def shell_of(tables):
    """The Shell of a model's tables."""
    positions, triangles, here = simulated_at(tables)
    supports = [{**item, "vertices": [here(v) for v in item["vertices"]]} if "vertices" in item else item for item in tables["support"]]
    material = material_of(tables["material"])
    if isinstance(material, shellwarp.Sheet):  # whose edges hold their slope without their neighbours
        held = {kind: supported_vertices(supports, positions, kind) for kind in ("fixed", "clamped")}
        asset = drawn_at(tables["mesh"])[3]
        return shellwarp.Shell(positions, triangles, material, **held, directions=tables["material"].get("direction"),
                               metres_per_unit=asset.metres_per_unit or 0.0 if asset else 0.0)
    held = held_vertices(supports, positions, triangles)
    return shellwarp.Shell(positions, triangles, material, fixed=held)


def material_of(table):
    """The Material or Sheet of a table: one of them, and of a sheet all four numbers, of its preset or its own."""
    constants, sheet = sorted(set(table) & CONSTANTS), sorted(set(table) & (SHEET | GRAIN))
    if constants and sheet:
        raise SceneError(f"material: {constants[0]} does not go with {sheet[0]}: either the constants or a sheet")
    if not sheet:
        return shellwarp.Material(**{MATERIAL[key]: float(value) for key, value in table.items()})
    own = {key: float(value) for key, value in table.items() if key not in ("preset", "direction")}
    if ("young_across" in table) != ("direction" in table):
        raise SceneError("material: young_across and direction go together")
    if "preset" in table:
        return dataclasses.replace(shellwarp.Sheet.known(table["preset"]), **own)
    if missing := sorted(SHEET - set(table) - {"preset"}):
        raise SceneError(f"material: a sheet needs {missing[0]}, or a preset")
    return shellwarp.Sheet(**own)


def model_key(tables):
    """Hash of mesh, material, held vertices, options and library: where any of them differs, so may the modes."""
    shell = shell_of(tables)
    material = shell.material
    return content_hash({
        "positions": shell.positions, "triangles": shell.triangles, "held": shell.fixed, "clamped": list(shell.clamped),
        "material": [type(material).__name__, *dataclasses.astuple(material)], "directions": shell.directions,
        "options": _options_here(tables), "library": library_digest()})


def prepare(tables, cache):
    """Sees to it that the model is in the cache: {"key", "cache", "seconds"}, or {"failed"} if it cannot be made."""
    try:
        key, messages = model_key(tables), []
        with library_messages(messages.append):
            _, report = Cache(cache).get_or_make(key, lambda: _precompute(tables))
        return {"key": key, **report, **({"messages": messages} if messages else {})}
    except (FarmError, shellwarp.ShellwarpError) as error:
        return {"failed": str(error)}


def identify(tables):
    """As prepare, but touches no cache: for a job that may be done already."""
    try:
        return {"key": model_key(tables), "cache": "not needed", "seconds": 0.0}
    except (FarmError, shellwarp.ShellwarpError) as error:
        return {"failed": str(error)}


def load_model(tables, key, cache):
    """The model, kept by this process for its next jobs, and the cache's report, None if it was still here."""
    with _lock:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key], None
    data, report = Cache(cache).get_or_make(key, lambda: _precompute(tables))
    model = shellwarp.Model.load(data)
    with _lock:
        _kept[key] = model
        while len(_kept) > KEPT:
            _kept.popitem(last=False)
    return model, report


@functools.lru_cache
def library_digest():
    """Of the library's file: another build may round differently. Its version, where the system's loader found it."""
    path = Path(shellwarp.library_path())
    return files.checksum(path) if path.is_file() else shellwarp.version()


def slowest_of(model):
    """Hz of the slowest mode that swings, 0 where none does."""
    return float(next((hertz for hertz in model.frequencies() if hertz > 0), 0.0))


def _precompute(tables):
    with shellwarp.Model(shell_of(tables)) as model:
        model.precompute(**_options_here(tables))
        return model.save()


def mesh_at(path):
    """As read_mesh, kept until the file changes."""
    return _kept_of(read_mesh, path)


def simulated_at(tables):
    """Positions and triangles of what is simulated, the mesh or a proxy of it, and the number there of a vertex of the mesh."""
    if not tables["proxy"]:
        return *mesh_at(tables["mesh"]), lambda vertex: vertex
    asset = mesh_at(tables["mesh"])
    positions, triangles, nearest = _kept_of(_proxy_reader(tuple(sorted(tables["proxy"].items()))), tables["mesh"])

    def here(vertex):
        if not 0 <= vertex < len(nearest):
            raise SceneError(f"vertex {vertex} is named; the mesh has {len(asset[0])}, from 0")
        return int(nearest[vertex])
    return positions, triangles, here


@functools.lru_cache
def _proxy_reader(options):
    return functools.partial(_proxy_of, **dict(options))


def _proxy_of(path, vertices, thickness=0.0, cut=False):
    try:
        with shellwarp.Proxy(*mesh_at(path), vertices, thickness=thickness, cut=cut) as made:
            return made.positions(), made.triangles(), made.nearest()
    except shellwarp.ShellwarpError as error:
        raise SceneError(f"{path}: {error}") from None


def polygons_at(path):
    """As read_polygons, kept until the file changes."""
    return _kept_of(read_polygons, path)


def drawn_at(path):
    """As read_drawn, kept until the file changes."""
    return _kept_of(read_drawn, path)


def _kept_of(reader, path):
    try:
        facts = os.stat(file_of(path))
        return _read(reader, path, facts.st_mtime_ns, facts.st_size)
    except FileNotFoundError:
        return reader(path)   # says what is missing


@functools.lru_cache(maxsize=KEPT_MESHES)
def _read(reader, path, _time, _size):
    return reader(path)
