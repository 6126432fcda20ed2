"""Scene lists: TOML files of assets, shots, seeds and parameters, and the jobs that they stand for.

The tables are those of the command-line host's scenes (docs/reference/scene.md), some in the asset and some in the shot;
docs/guide/farm.md lists them. A key that is not known is an error. A job is a plain table, so that it can be sent to any worker."""

import itertools
import math
import re
import tomllib
from pathlib import Path

from shellwarp.method import DEFAULT

from . import colliders, handles, materials, supports, ties
from .errors import SceneError
from .materials import known as _known
from .mesh_file import beside, stem

# Of [simulation]: what the precompute depends on, beside the method.
MODEL_KEYS = ("modes", "precision", "reduced_fields", "auto_error", "auto_operations", "contact_patches", "contact_patches_near", "contact_patches_most", "support_fields")
SIMULATION = {*MODEL_KEYS, "method", "integrator", "frame_rate", "steps_per_frame", "gravity", "stiffness_factor", "correction_steps", "push_out", "deterministic"}
TABLES = {
    "material": materials.KEYS,
    "simulation": SIMULATION,
    "damping": {"ratio", "mass", "stiffness", "factors"},
    "wind": {"velocity", "density", "normal_drag", "tangential_drag", "gust", "gust_frequency"},
    "frame": {"pivot", "rise", "end", "fall", "translate", "rotate_degrees"},
}
LISTS = {"support": supports.KEYS, "tie": ties.KEYS, "handle": handles.KEYS, "force": {"vertex", "nearest", "vector"}, "collider": colliders.KEYS}
CHECKS = {"support": supports.check, "tie": ties.check, "handle": handles.check, "collider": colliders.check}
OSCILLATION = {"axis", "amplitude", "frequency", "phase_degrees"}
PROXY = {"proxy": "vertices", "proxy_thickness": "thickness", "proxy_cut": "cut", "proxy_calibrated": "calibrated"}
IN_PLACE = {**PROXY, "weld": "weld"}   # what makes the mesh another one that is simulated in its place
ASSET = {"name", "mesh", *IN_PLACE, "render", "material", "support", "simulation", "damping", "force", "handle", "tie", "collider"}
SHOT = {"name", "frames", "after", "start", "motion", "follow_rest", "simulation", "damping", "wind", "frame", "force", "handle", "collider"}
TOP = {"title", "up_axis", "metres_per_unit", "formats", "certify", "seeds", "asset", "shot", "parameters", "sweep"}
FORMATS = ("pc2", "usd")
FILES = ("material.rest_shape", "material.directions", "damping.factors")   # that a table or a parameter names
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
DEFAULTS = {"modes": 16, "precision": "f32", "method": DEFAULT, "integrator": "implicit-euler", "frame_rate": 30.0,
            "steps_per_frame": 1, "gravity": [0, 0, 0], "reduced_fields": 0, "auto_error": 0.0, "auto_operations": 0.0,
            "stiffness_factor": 1.0, "correction_steps": 0, "push_out": False, "deterministic": False, "contact_patches": [], "contact_patches_near": None, "contact_patches_most": None, "support_fields": None}


def read_list(path):
    """A scene list as it stands in the file, checked; mesh paths made absolute."""
    path = Path(path)
    try:
        scene_list = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: {error}") from None
    try:
        _check(scene_list)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    for owner, key in _files(scene_list):
        if key in owner:
            owner[key] = beside(owner[key], path.parent)
    for name in set(FILES) & set(scene_list.get("parameters", {})):
        scene_list["parameters"][name] = [beside(value, path.parent) for value in scene_list["parameters"][name]]
    for asset in scene_list["asset"]:
        asset["render"] = [beside(name, path.parent) for name in renders(asset)]
    return scene_list


def _files(scene_list):
    """Tables of a list, each with a key of which a file is named."""
    for entry in scene_list["asset"] + scene_list.get("shot", []):
        yield from ((entry, "mesh"), (entry, "start"), (entry, "motion"))
        yield from ((entry.get(table, {}), key) for table, key in (name.split(".") for name in FILES))
        yield from ((item, key) for item in entry.get("collider", []) for key in ("mesh", "motion"))
        material = entry.get("material", {})
        yield from ((material.get("map", {}), key) for key in materials.VARIES)
        yield from ((item, "list") for item in (*entry.get("support", []), *material.get("region", []), *material.get("crease", [])))


def expand(scene_list):
    """All jobs, those that another comes after before it: shots in the order of the list are the slowest to change."""
    jobs = [_job(scene_list, asset, shot, values, seed)
            for shot in scene_list.get("shot", []) for asset in scene_list["asset"]
            for values in parameter_grid(scene_list) for seed in _seeds(scene_list, shot)]
    names = [job["name"] for job in jobs]
    for first, second in zip(sorted(names), sorted(names)[1:]):
        if first == second:
            raise SceneError(f"two jobs have the name {first}: give distinct values or names")
    if not jobs:
        raise SceneError("there is no [[shot]]")
    return jobs


def parameter_grid(scene_list):
    """Every combination of the parameters, as tables of "table.key" and value."""
    parameters = scene_list.get("parameters", {})
    return [dict(zip(parameters, values)) for values in itertools.product(*parameters.values())]


def asset_tables(asset, values, metres_per_unit=1.0):
    """The tables of an asset alone, parameters put in and defaults filled in."""
    return _with_parameters({"mesh": asset["mesh"], "metres_per_unit": metres_per_unit, "proxy": proxy(asset), **{key: asset.get(key, {}) for key in ("material", "damping")},
                             **{key: asset.get(key, []) for key in ("support", "tie", "handle", "force")},
                             "simulation": {**DEFAULTS, **asset.get("simulation", {})}, "wind": {}, "frame": {}}, values)


def label(values):
    """Parameters as a part of a file name, such as k_bend=10."""
    texts = [f"{key.split('.')[1]}={_text(value)}" for key, value in values.items()]
    return "_".join(texts)


def renders(asset):
    """The meshes that follow an asset's: one name or a list of them."""
    given = asset.get("render", [])
    return given if isinstance(given, list) else [given]


def proxy(asset):
    """What a mesh to simulate in the asset's place is to be: {} for none."""
    return {name: asset[key] for key, name in IN_PLACE.items() if key in asset}


def _job(scene_list, asset, shot, values, seed):
    merged = {table: {**asset.get(table, {}), **shot.get(table, {})} for table in TABLES}
    merged["simulation"] = {**DEFAULTS, **merged["simulation"]}
    lists = {key: asset.get(key, []) + shot.get(key, []) for key in LISTS}
    job = _with_parameters({"mesh": asset["mesh"], "proxy": proxy(asset), "render": asset["render"], **merged, **lists}, values)
    _check_output(asset["name"], job)
    _check_patches(asset["name"], job, asset.get("collider"))
    if "motion" in shot and supports.any_moves(job["support"]):
        raise SceneError(f"shot {shot['name']}: motion says where all supports of {asset['name']} are: none may have a key")
    if job["simulation"]["support_fields"] is None and any("motion" in other and not other.get("follow_rest") for other in scene_list["shot"]):
        job["simulation"]["support_fields"] = supports.FIELDS   # one model for all shots
    variant = "_".join(filter(None, [label(values), "" if seed is None else f"s{seed}"]))

    def name_in(shot_name):
        return "/".join([asset["name"], shot_name, "_".join(filter(None, [asset["name"], shot_name, variant]))])

    job.update(name=name_in(shot["name"]), asset=asset["name"], shot=shot["name"], seed=seed, parameters=values,
               frames=shot["frames"], up_axis=scene_list.get("up_axis", "z"), metres_per_unit=scene_list.get("metres_per_unit", 1.0),
               formats=scene_list.get("formats", list(FORMATS)), certify=scene_list.get("certify", True), start=shot.get("start"),
               after=name_in(shot["after"]) if "after" in shot else None, motion=shot.get("motion"), follow_rest=shot.get("follow_rest", False))
    return job


def _with_parameters(tables, values):
    tables = {key: dict(value) if isinstance(value, dict) else value for key, value in tables.items()}
    for key, value in values.items():
        table, name = key.split(".")
        tables[table][name] = value
    return tables


def _seeds(scene_list, shot):
    """A shot after another goes on with its seed; one without gusts has none."""
    seeds = scene_list.get("seeds", [])
    shots = {other["name"]: other for other in scene_list["shot"]}
    while shot is not None:
        if "gust" in shot.get("wind", {}):
            return seeds or [0]
        shot = shots.get(shot.get("after"))
    return [None]


def _text(value):
    if isinstance(value, list):
        return "_".join(map(_text, value))
    return value if isinstance(value, str) else f"{value:g}"


# ------------------------------------------------------------------------------------------------------------- checks

def _check(scene_list):
    _known("the list", scene_list, TOP)
    if not scene_list.get("asset"):
        raise SceneError("there is no [[asset]]")
    for kind, keys, needed in (("asset", ASSET, ("name", "mesh")), ("shot", SHOT, ("name", "frames"))):
        seen = set()
        for entry in scene_list.get(kind, []):
            _check_entry(kind, entry, keys, needed, seen)
    _check_shots(scene_list.get("shot", []))
    _check_parameters(scene_list.get("parameters", {}))
    if unknown := set(scene_list.get("formats", [])) - set(FORMATS):
        raise SceneError(f"formats: {unknown.pop()!r}, expected some of {', '.join(FORMATS)}")
    if scene_list.get("up_axis", "z") not in ("y", "z"):
        raise SceneError("up_axis is 'y' or 'z'")
    if not isinstance(scene_list.get("certify", True), bool):
        raise SceneError(f"certify is {scene_list['certify']!r}, expected true or false")
    metres = scene_list.get("metres_per_unit", 1.0)
    if not isinstance(metres, (int, float)) or not 0 < metres < math.inf:
        raise SceneError(f"metres_per_unit is {metres!r}, expected a number above 0")
    seeds = scene_list.get("seeds", [])
    if len(set(seeds)) != len(seeds):
        raise SceneError("seeds: one comes twice")
    if seeds and not any("gust" in shot.get("wind", {}) for shot in scene_list.get("shot", [])):
        raise SceneError("seeds change nothing: no shot has a wind with a gust")


def _check_entry(kind, entry, keys, needed, seen):
    name = entry.get("name", "without a name")
    _known(f"{kind} {name}", entry, keys)
    for key in needed:
        if key not in entry:
            raise SceneError(f"{kind} {name}: {key} is missing")
    if not NAME.fullmatch(name):
        raise SceneError(f"{kind} {name!r}: a name is a part of a file name: letters, digits and _.-")
    if name in seen:
        raise SceneError(f"two {kind}s have the name {name}")
    seen.add(name)
    if "proxy" not in entry and (alone := sorted(set(PROXY) & set(entry))):
        raise SceneError(f"{kind} {name}: {alone[0]} goes with proxy")
    if "proxy" in entry and (not isinstance(entry["proxy"], int) or entry["proxy"] < 4):
        raise SceneError(f"{kind} {name}: proxy is a number of vertices, 4 or more")
    if isinstance(entry.get("weld", 0), bool) or not isinstance(entry.get("weld", 0), (int, float)) or not 0 <= entry.get("weld", 0) < math.inf:
        raise SceneError(f"{kind} {name}: weld is {entry['weld']!r}, expected a distance of 0 or above")
    stems = [stem(path) for path in renders(entry)]
    if not all(isinstance(path, str) for path in renders(entry)) or len(set(stems)) < len(stems):
        raise SceneError(f"{kind} {name}: render is the path of a mesh, or a list of paths whose file names differ")
    for table, allowed in TABLES.items():
        _known(f"{kind} {name}, {table}", entry.get(table, {}), allowed)
    for table, allowed in LISTS.items():
        for number, item in enumerate(entry.get(table, []), 1):
            _known(f"{kind} {name}, {table}", item, allowed)
            if table in CHECKS:
                CHECKS[table](f"{kind} {name}, {table} {number}", item)
    materials.check(f"{kind} {name}, material", entry.get("material", {}))
    for item in entry.get("frame", {}).get("translate", []) + entry.get("frame", {}).get("rotate_degrees", []):
        _known(f"{kind} {name}, frame", item, OSCILLATION)


def _check_output(name, job):
    """Of what is done to frames before they are written."""
    steps, push_out = job["simulation"]["correction_steps"], job["simulation"]["push_out"]
    if not isinstance(steps, int) or isinstance(steps, bool) or not 0 <= steps <= 100:
        raise SceneError(f"asset {name}: correction_steps is {steps!r}, expected a whole number from 0 to 100")
    for key in ("push_out", "deterministic"):
        if not isinstance(job["simulation"][key], bool):
            raise SceneError(f"asset {name}: {key} is {job['simulation'][key]!r}, expected true or false")
    if steps and push_out:
        raise SceneError(f"asset {name}: correction_steps and push_out both move what is written: choose one")


def _check_patches(name, job, own):
    """Of patches that are looked for near the asset's own colliders; those of shots are others from shot to shot, and the model is not."""
    near, most = (job["simulation"][key] for key in ("contact_patches_near", "contact_patches_most"))
    if near is None:
        if most is not None:
            raise SceneError(f"asset {name}: contact_patches_most goes with contact_patches_near")
        return
    if isinstance(near, bool) or not isinstance(near, (int, float)) or not 0 < near < math.inf:
        raise SceneError(f"asset {name}: contact_patches_near is {near!r}, expected a length above 0")
    if most is not None and (not isinstance(most, int) or isinstance(most, bool) or not 1 <= most <= 128):
        raise SceneError(f"asset {name}: contact_patches_most is {most!r}, expected a whole number from 1 to 128")
    if not own:
        raise SceneError(f"asset {name}: contact_patches_near needs a collider of the asset")
    job["patch_colliders"] = own


def _check_shots(shots):
    ends = {}
    for shot in shots:
        name, frames = shot["name"], shot["frames"]
        if len(frames) != 2 or not all(isinstance(f, int) for f in frames) or frames[0] > frames[1]:
            raise SceneError(f"shot {name}: frames is [first, last]")
        if "after" in shot and "start" in shot:
            raise SceneError(f"shot {name}: either after or start")
        if "after" in shot and shot["after"] not in ends:
            raise SceneError(f"shot {name}: after names {shot['after']!r}, no shot before it in the list")
        if "after" in shot and ends[shot["after"]] + 1 != frames[0]:
            raise SceneError(f"shot {name}: begins at frame {frames[0]}, but {shot['after']} ends at {ends[shot['after']]}")
        if set(shot.get("simulation", {})) & set(MODEL_KEYS):
            raise SceneError(f"shot {name}: {', '.join(MODEL_KEYS)} belong to the asset")
        _check_motion(f"shot {name}", shot)
        ends[name] = frames[1]


def _check_motion(where, shot):
    """Of a mesh that is animated."""
    if not isinstance(shot.get("follow_rest", False), bool) or ("follow_rest" in shot and "motion" not in shot):
        raise SceneError(f"{where}: follow_rest is true or false, and goes with motion")
    if "motion" in shot and shot.get("frame"):
        raise SceneError(f"{where}: motion does not go with frame: it says where the supports are")


def _check_parameters(parameters):
    for key, values in parameters.items():
        table, _, name = key.partition(".")
        if name not in TABLES.get(table, ()):
            raise SceneError(f"parameters: {key!r} is no \"table.key\" of a job")
        if not isinstance(values, list) or not values:
            raise SceneError(f"parameters: {key} needs a list of values")
