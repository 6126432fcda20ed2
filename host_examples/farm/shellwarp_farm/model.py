"""A job's shell, its content key, and its modes from the cache."""

import dataclasses
import functools
import threading
from collections import OrderedDict
from pathlib import Path

import numpy
import shellwarp
from shellwarp.method import find, precompute_options

from . import colliders, files, selection, ties
from .cache import Cache
from .content import content_hash
from .errors import FarmError, SceneError
from .handles import NAMES, demand
from .job_log import library_messages, tell
from .materials import look_of, material_of, parts_of, with_usd
from .simulated import drawn_at, simulated_at
from .supports import FIELDS, any_moves, at_rest, axes_of, held_vertices, supported_vertices

KEPT = 4   # models that a worker keeps loaded
MOST_PATCHES = 16   # that are looked for near colliders, where the list names no number

_kept = OrderedDict()
_lock = threading.Lock()


def model_tables(job):
    """The part of a job that its model is made of."""
    return tables_of(job, job["simulation"], [job["simulation"]["method"]])


def tables_of(owner, simulation, methods):
    """The same of an asset's tables, for all of some methods."""
    options = options_of(simulation, methods)
    fields = simulation["support_fields"]
    options["support_fields"] = (FIELDS if any_moves(owner["support"]) else 0) if fields is None else fields
    if simulation["contact_patches_near"] is not None:
        options["near"] = [simulation["contact_patches_near"], simulation["contact_patches_most"] or MOST_PATCHES, owner.get("patch_colliders", [])]
    known = [find(method) for method in methods]
    handles = owner["handle"] if any(method.needs_fields or method.needs_choice for method in known) else []
    if options.get("auto_error") or options.get("auto_operations"):
        options.update(demand(handles))
    if look_of(owner["material"]) == "sag" and not any(simulation["gravity"]):
        raise SceneError("material: sag goes with gravity, and simulation.gravity is 0")
    return {"mesh": owner["mesh"], "gravity": simulation["gravity"], "metres_per_unit": owner["metres_per_unit"], "proxy": owner["proxy"], "material": owner["material"], "support": at_rest(owner["support"]), "tie": owner["tie"],
            "handle": [{key: item[key] for key in NAMES if key in item} for item in handles], "options": options}


def options_of(simulation, methods):
    """What the precompute is told, for all of some methods. SceneError where the library does not have one."""
    told = {key: simulation[key] for key in ("modes", "precision", "contact_patches")}
    gravity = float(numpy.linalg.norm(simulation["gravity"]))
    chosen = [method for method in methods if method in shellwarp.methods() and find(method).needs_choice]
    if len(methods) > 1 and chosen and (simulation["auto_error"] or simulation["auto_operations"]):
        raise SceneError("a model that was made for a choice has one method alone: give it a list of its own")
    asked = {key: simulation[key] for key in ("reduced_fields", "auto_error", "auto_operations")}
    try:
        for method in methods:
            told = _merged(told, precompute_options(method, **asked, gravity=gravity))
    except shellwarp.InvalidArgumentError as error:
        raise SceneError(str(error)) from None
    return told


def _options_here(tables, shell):
    """The options, vertices numbered as in what is simulated, with patches near colliders looked for."""
    simulated = simulated_at(tables)
    options = {key: value for key, value in tables["options"].items() if key != "near"}
    patches = [simulated.here(vertex) for vertex in options.get("contact_patches", ())]
    if "near" in tables["options"]:
        patches += sorted(set(colliders.patches_near(shell, *tables["options"]["near"])) - set(patches))
    return {**options, "contact_patches": patches,
            "handles": sorted({selection.one_vertex(item, simulated, tables["mesh"]) for item in tables["handle"]})}


def _merged(told, options):
    """Options for one more method: the reduced shell that either needs, which may be left out where both may do without."""
    both = (told, options)
    merged = {**told, **options, "reduced_fields": max(of.get("reduced_fields", 0) for of in both)}
    if any(of.get("auto") for of in both):
        merged["auto"] = not any(of.get("reduced_fields") and not of.get("auto") for of in both)
    return merged


def shell_of(tables):
    """The Shell of a model's tables."""
    simulated, mesh, supports = simulated_at(tables), tables["mesh"], tables["support"]
    table = with_usd(tables["material"], drawn_at(tables["mesh"]).asset)
    material = material_of(table, simulated, metres_of(tables))
    if isinstance(material, shellwarp.Sheet):  # whose edges hold their slope without their neighbours
        held = {kind: supported_vertices(supports, simulated, mesh, kind) for kind in ("fixed", "clamped")}
        held["metres_per_unit"] = metres_of(tables)
    else:
        held = {"fixed": held_vertices(supports, simulated, mesh)}
    return shellwarp.Shell(simulated.positions, simulated.triangles, material, **held, **axes_of(supports, simulated, mesh),
                           **parts_of(table, material, simulated, mesh), **ties.parts_of(tables["tie"], simulated))


def metres_of(tables):
    """How long the unit of a mesh is: its USD file says so, or the list."""
    asset = drawn_at(tables["mesh"]).asset
    return (asset.metres_per_unit if asset else None) or tables["metres_per_unit"]


def model_key(tables):
    """Hash of mesh, material, held vertices, options and library: where any of them differs, so may the modes."""
    shell = shell_of(tables)
    material = shell.material
    return content_hash({
        "positions": shell.positions, "triangles": shell.triangles, "held": shell.fixed, "clamped": list(shell.clamped),
        "material": [type(material).__name__, *dataclasses.astuple(material), tables["material"].get("frequency"), *_sag(tables)], "directions": shell.directions,
        "maps": dict(shell.maps), "creases": list(shell.creases), "rest": shell.rest_positions, "lengths": sorted(shell.rest_lengths.items()),
        "axes": sorted(shell.axes.items()), "symmetric": sorted(shell.symmetric.items()), "ties": [list(shell.ties), list(shell.triangle_ties), shell.tie_distance],
        "options": _options_here(tables, shell), "calibrated": simulated_at(tables).calibrates is not None, "library": library_digest()})


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


def _sag(tables):
    """How far the shell is to hang, and under what gravity; nothing where its stiffness is another's."""
    return [tables["material"]["sag"], list(tables["gravity"])] if look_of(tables["material"]) == "sag" else []


def _calibration(simulated):
    """What calibrates models of a proxy; of one that cannot be it says why, once."""
    told = []

    def calibrate(model):
        why = simulated.uncalibrated
        if simulated.calibrates is not None:
            try:
                return model.calibrate(simulated.calibrates)
            except (shellwarp.UnsupportedError, shellwarp.InvalidMeshError, shellwarp.NumericalError) as error:
                why = str(error)
        if why and not told:
            told.append(why)
            tell(f"the proxy is not as stiff as the mesh that it stands for: {why}")
        return None
    return calibrate


def _precompute(tables):
    shell = shell_of(tables)
    options = _options_here(tables, shell)
    look = look_of(tables["material"])
    calibrate = _calibration(simulated_at(tables))
    if look == "frequency":
        shell = shellwarp.look.at_frequency(shell, tables["material"]["frequency"], tables["options"]["modes"], calibrate=calibrate)
    elif look == "sag":
        length, gravity = _sag(tables)
        shell = shellwarp.look.at_sag(shell, length, gravity, modes=tables["options"]["modes"], calibrate=calibrate)
    with shellwarp.Model(shell) as model:
        calibrate(model)
        model.precompute(**options)
        return model.save()
