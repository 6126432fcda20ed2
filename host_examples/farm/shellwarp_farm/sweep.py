"""Error against run time over many meshes, materials and loads: python -m shellwarp_farm sweep list.toml --out DIR.

A case is an asset with one bending stiffness under one load, factors on the asset's k_bend and gravity. Its equilibrium on the
full nonlinear shell is the reference; every method with every number of modes is set beside it. The error is weighted by mass,
‖u − u_ref‖ / ‖u_ref‖; error_by_vertex counts all vertices alike. The run time is that of one step of 1/frame_rate with its positions,
the least of several, on one core; what else the machine does can only make it longer. Rows go to sweep.parquet and sweep.csv."""

import argparse
import itertools
import json
import time
from pathlib import Path

import numpy
import shellwarp
from shellwarp.method import find, table

from . import engine as engines
from . import files
from .content import content_hash
from .errors import FarmError, SceneError
from .model import library_digest, load_model, model_key, shell_of, tables_of
from .scenes import asset_tables, label, parameter_grid, read_list
from .simulated import simulated_at
from .supports import any_moves

KEYS = {"methods", "modes", "loads", "bending"}
REPEATS = 7        # of the timed steps; the least counts
TIMED_SECONDS = 0.02   # a repeat lasts at least about this long, far above the clock's resolution


def cases(scene_list):
    """Every asset, choice of the parameters, bending stiffness and load as a table."""
    sweep = scene_list.get("sweep", {})
    if unknown := set(sweep) - KEYS:
        raise SceneError(f"sweep: unknown key {unknown.pop()!r}; known: {', '.join(sorted(KEYS))}")
    choices = itertools.product(scene_list["asset"], parameter_grid(scene_list), sweep.get("bending", [1]), sweep.get("loads", [1]))
    return [_case(sweep, *choice, scene_list.get("metres_per_unit", 1.0)) for choice in choices]


def _case(sweep, asset, values, bending, load, metres_per_unit):
    tables = asset_tables(asset, values, metres_per_unit)
    gravity = [load * component for component in tables["simulation"]["gravity"]]
    for key, what in (("collider", "colliders"), ("handle", "handles")):
        if asset.get(key):
            raise SceneError(f"sweep: asset {asset['name']} has {what}; a sweep compares free equilibria")
    if any_moves(asset.get("support", [])):
        raise SceneError(f"sweep: asset {asset['name']} has supports that move; a sweep compares equilibria")
    if not any(gravity):
        raise SceneError(f"sweep: asset {asset['name']} has no simulation.gravity")
    if bending != 1:
        if not tables["material"].get("k_bend"):
            raise SceneError(f"sweep: bending is a factor on material.k_bend, which asset {asset['name']} does not give")
        if "k_bend" in tables["material"].get("map", {}) or any("k_bend" in region for region in tables["material"].get("region", ())):
            raise SceneError(f"sweep: asset {asset['name']} has k_bend by a map or a region; bending is a factor on one number")
        tables["material"]["k_bend"] *= bending
    return {**tables, "asset": asset["name"], "variant": label(values), "parameters": values, "load": load, "bending": bending,
            "gravity": gravity, "methods": sweep.get("methods", [method.name for method in table() if method.moves_by_modes]),
            "mode_counts": sweep.get("modes", [tables["simulation"]["modes"]])}


def run_case(case, out, cache):
    """The rows of a case, from its record if that is of the same inputs: {"rows"}, or {"failed"}."""
    name = f"{case['asset']} {case['variant']} bending={case['bending']:g} load={case['load']:g}"
    try:
        tables = [tables_of(case, {**case["simulation"], "gravity": case["gravity"], "modes": m}, case["methods"])
                  for m in sorted(case["mode_counts"])]
        keys = [model_key(table) for table in tables]
        digest = content_hash([keys, case["simulation"], case["gravity"], case["damping"], case["methods"],
                               case["asset"], case["parameters"], library_digest()])
        path = Path(out) / "records" / f"{digest}.json"
        if path.exists():
            return {"case": name, "rows": json.loads(path.read_bytes()), "done": "found"}
        models = [load_model(table, key, cache)[0] for table, key in zip(tables, keys)]
        rows = _measure(case, tables[0], models)
        files.write_whole(path, json.dumps(rows).encode())
        return {"case": name, "rows": rows, "done": "measured"}
    except (FarmError, shellwarp.ShellwarpError) as error:
        return {"case": name, "failed": f"{name}: {error}"}


def _measure(case, table, models):
    rest, triangles = simulated_at(table)[:2]
    weights = vertex_areas(rest, triangles)
    reference, seconds = _equilibrium(case, models[0], find(shellwarp.abi.SW_METHOD_SHELL_IMPLICIT).name)
    shift = reference["positions"] - rest
    held = len(shell_of(table).fixed)
    rows = []
    for model in models:
        facts = model.info()
        for method in case["methods"]:
            row = {"asset": case["asset"], "variant": case["variant"], "bending": float(case["bending"]),
                   "load": float(case["load"]), "method": method,
                   "modes": facts["modes"], "vertices": facts["n_vertices"], "held": held,
                   "reference_seconds": seconds, "reference_displacement": float(numpy.sqrt((shift ** 2).sum(axis=1)).max())}
            row.update({f"parameter_{key}": _plain(value) for key, value in case["parameters"].items()})
            rows.append({**row, **_judge(case, model, method, reference["positions"], rest, weights)})
    return rows


def _judge(case, model, method, reference, rest, weights):
    try:
        found, _ = _equilibrium(case, model, method)
    except shellwarp.NumericalError as error:
        return {"error": None, "error_by_vertex": None, "turn_in_range": None, "max_rotation": None, "step_seconds": None, "note": str(error)}
    squares = ((found["positions"] - reference) ** 2).sum(axis=1)
    shift = ((reference - rest) ** 2).sum(axis=1)
    return {"error": float(numpy.sqrt(weights @ squares / (weights @ shift))),
            "error_by_vertex": float(numpy.sqrt(squares.sum() / shift.sum())), "turn_in_range": bool(found["report"]["turn_in_range"]),
            "max_rotation": found["report"]["max_rotation"], "step_seconds": _step_seconds(case, model, method), "note": ""}


def _equilibrium(case, model, method):
    with model.state(method) as state:
        _load(state, case)
        start = time.perf_counter()
        state.equilibrium()
        seconds = time.perf_counter() - start
        return {"positions": state.positions(dtype=numpy.float64), "report": state.report()}, seconds


def _load(state, case):
    state.set_gravity(case["gravity"])
    state.set_stiffness(case["simulation"]["stiffness_factor"])


def _step_seconds(case, model, method):
    """Of a step and its positions, the mean over a run, the least of some runs."""
    with model.state(method) as state:
        _load(state, case)
        constants = {key: value for key, value in case["damping"].items() if key != "factors"}   # which take no time in a step
        state.set_damping(**constants)
        points, h = numpy.empty((state.n_vertices, 3), numpy.float32), 1 / case["simulation"]["frame_rate"]

        def seconds(steps):
            start = time.perf_counter()
            for _ in range(steps):
                state.step(h)
                state.positions(out=points)
            return (time.perf_counter() - start) / steps

        steps = max(1, int(TIMED_SECONDS / max(seconds(3), 1e-6)))
        return min(seconds(steps) for _ in range(REPEATS))


def vertex_areas(positions, triangles):
    """A third of the rest areas around each vertex (n): its mass, but for a factor."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    areas = numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2
    return numpy.bincount(triangles.ravel(), numpy.repeat(areas / 3, 3), len(positions))


def _plain(value):
    return value if isinstance(value, (int, float, str)) else json.dumps(value)


def main(arguments):
    parser = argparse.ArgumentParser(prog="shellwarp_farm sweep", description=__doc__.splitlines()[0])
    parser.add_argument("list", type=Path, help="scene list with a [sweep] table, TOML")
    parser.add_argument("--out", type=Path, required=True, help="folder for the table, the plots and records")
    parser.add_argument("--cache", type=Path, help="folder of precomputed models, may be shared (default: OUT/cache)")
    engines.add_arguments(parser)
    options = parser.parse_args(arguments)
    todo = cases(read_list(options.list))
    with engines.Engine(options.scheduler, options.workers, options.retries) as engine:
        results = sweep(engine, todo, options.out, options.cache, options.quiet)
    failed = [result["failed"] for result in results if "failed" in result]
    found = sum(result.get("done") == "found" for result in results)
    print(f"{len(todo)} cases: {len(todo) - len(failed) - found} measured, {found} done before, {len(failed)} failed")
    print("\n".join(f"FAILED: {line}" for line in failed) or f"{options.out}/sweep.parquet, sweep.csv, sweep.png")
    return 1 if failed else 0


def sweep(engine, todo, out, cache=None, quiet=True):
    """Measures the cases and writes table and plot; results as of run_case, in the order of the cases."""
    from tqdm import tqdm

    from .sweep_plot import draw
    out = Path(out).resolve()
    cache = str(Path(cache or out / "cache").resolve())
    run = engines.run_name()
    keys = {f"sweep-{content_hash(case)}-{run}": k for k, case in enumerate(todo)}
    futures = (engine.submit(run_case, todo[k], str(out), cache, key=key) for key, k in keys.items())
    results = [None] * len(todo)
    with tqdm(total=len(keys), unit="case", disable=quiet, dynamic_ncols=True) as bar:
        for future in engine.stream(futures):
            results[keys[future.key]] = engines.result_of(future)
            bar.update()
    rows = [row for result in results for row in result.get("rows", ())]
    if rows:
        write_table(rows, out)
        draw(rows, out / "sweep.png")
    return results


def write_table(rows, out):
    """sweep.parquet and sweep.csv."""
    import pyarrow
    from pyarrow import csv, parquet
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = pyarrow.Table.from_pylist([{key: row.get(key) for key in columns} for row in rows])
    with files.whole_file(Path(out) / "sweep.parquet") as partial:
        parquet.write_table(table, partial)
    with files.whole_file(Path(out) / "sweep.csv") as partial:
        csv.write_csv(table, partial)
