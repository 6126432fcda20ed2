"""Bakes a scene list, or goes on with one: python -m shellwarp_farm bake list.toml --out DIR."""

import argparse
from pathlib import Path

from . import engine as engines
from . import files, job as jobs, manifest, model
from .content import content_hash
from .errors import DamagedError
from .job_log import log_path, reasons
from .scenes import expand, read_list


def main(arguments):
    parser = argparse.ArgumentParser(prog="shellwarp_farm bake", description=__doc__)
    parser.add_argument("list", type=Path, help="scene list, TOML")
    parser.add_argument("--out", type=Path, required=True, help="folder for point caches, records and manifest")
    parser.add_argument("--cache", type=Path, help="folder of precomputed models, may be shared (default: OUT/cache)")
    engines.add_arguments(parser)
    options = parser.parse_args(arguments)
    todo = expand(read_list(options.list))
    with engines.Engine(options.scheduler, options.workers, options.retries) as engine:
        report = bake(engine, todo, options.out, options.cache, options.quiet)
    print_report(report)
    return 1 if report["failed"] else 0


def bake(engine, todo, out, cache=None, quiet=True, on_result=None):
    """Bakes jobs and writes the manifest: a report of what was done, verified, failed, made and repaired, and of seconds."""
    from tqdm import tqdm
    out = Path(out).resolve()
    cache = str(Path(cache or out / "cache").resolve())
    seconds, run = engines.stopwatch(), engines.run_name()
    results = []
    with tqdm(total=len(todo), unit="job", disable=quiet, mininterval=0.5, dynamic_ncols=True) as bar:
        for future in engine.stream(_submissions(engine, todo, str(out), cache, run)):
            result = _with_reasons(engines.result_of(future), out, run)
            results.append(result)
            bar.set_postfix(failed=sum("failed" in r for r in results)) if "failed" in result else None
            bar.update()
            if on_result:
                on_result(result)
    done = [result for result in results if "failed" not in result]
    manifest.write(out, [{k: v for k, v in result.items() if k not in ("done", "redone", "tried_again")} for result in done])
    if len(done) == len(results):
        for path in files.partials(out):   # nobody writes any more: these are left of killed workers
            path.unlink(missing_ok=True)
    return _report(results, done, seconds(), engine)


def _with_reasons(result, out, run):
    """A job that Dask gave up on has told its log why."""
    name = result["job"].removeprefix("bake-").removesuffix(f"-{run}")
    if result["job"] == name:
        return result
    return {"job": name, "failed": f"{result['failed']}; see {log_path(out, name)}", "tried_again": reasons(out, name, run)[:-1]}


def _submissions(engine, todo, out, cache, run):
    """Submits job after job, each after its model and the job that it continues."""
    awaited = {job["after"] for job in todo if job["after"]}
    models, before = {}, {}
    for job in todo:
        tables = model.model_tables(job)
        function = model.identify if jobs.record_path(out, job["name"]).exists() else model.prepare
        name = f"{function.__name__}-{content_hash(tables)}-{run}"
        if name not in models:
            models[name] = engine.submit(function, *((tables, cache) if function is model.prepare else (tables,)), key=name)
        arguments = (job, models[name], before.get(job["after"]), out, cache, run)
        future = engine.submit(jobs.bake, *arguments, key=f"bake-{job['name']}-{run}")
        if job["name"] in awaited:
            before[job["name"]] = future
        yield future


def _report(results, done, seconds, engine):
    made = {}
    damage, repaired = set(), []
    for result in done:
        for facts in (result["model"], result["cache"]) if result["done"] == "baked" else ():
            damage |= {facts["damage"]} if "damage" in facts else set()
            if facts["cache"] in ("made", "rebuilt"):
                made[result["model"]["key"]] = facts
        if result.get("redone", "not done before") != "not done before":
            repaired.append(f"{result['job']}: {result['redone']}")
    baked = [result for result in done if result["done"] == "baked"]
    return {
        "busy": sum(sum(result["seconds"].values()) for result in baked) / (seconds * engine.workers()),
        "core_seconds": sum(result["core_seconds"] for result in baked),
        "jobs": len(results), "baked": len(baked), "verified": sum(r["done"] == "verified" for r in done),
        "failed": [r["failed"] for r in results if "failed" in r], "models": len({r["model"]["key"] for r in done}),
        "tried_again": [f"{r['job']}: {reason}" for r in results for reason in r.get("tried_again", ())],
        "made": len(made), "damage": sorted(damage), "redone": repaired,
        "certified": {r["job"]: r.get("certified", {"why": "baked by an earlier version"}) for r in done},
        "turned_too_far": {r["job"]: r["range"] for r in done if r["range"]["frames_out"]},
        "bytes": sum(facts["bytes"] for r in done for facts in r["outputs"].values()),
        "seconds": seconds, "workers": engine.workers(), "digest": manifest.digest(done)}


def print_report(report, most=5):
    """The report for a person; long lists are cut."""
    print(f"{report['jobs']} jobs: {report['baked']} baked, {report['verified']} done before and verified, "
          f"{len(report['failed'])} failed; {report['seconds']:.1f} s on {report['workers']} workers")
    print(f"{report['models']} models, {report['made']} precomputed now; {report['bytes'] / 1e6:.0f} MB of outputs")
    lists = [("FAILED", report["failed"]), ("tried again", report["tried_again"]), ("cache", report["damage"]), ("done again", report["redone"]),
             ("turned too far", [f"{name}: {facts['frames_out']} frames from {facts['first_out']}, rotation up to "
                               f"{facts['max_rotation']:.2f} rad" for name, facts in report["turned_too_far"].items()])]
    if report["certified"]:
        print(f"worst frames: {certified(report['certified'])}")
    for title, lines in lists:
        for line in lines[:most]:
            print(f"{title}: {line}")
        if len(lines) > most:
            print(f"{title}: and {len(lines) - most} more")
    print(f"checksum of all outputs {report['digest']}")


def certified(found):
    """What the certificates of the worst frames say, in a line."""
    known = {name: facts for name, facts in found.items() if "why" not in facts}
    if not known:
        return f"not certified: {next(iter(found.values()))['why']}"
    error = {name: facts.get("worst", facts)["error"] for name, facts in known.items()}   # an earlier version judged the last frame alone
    worst = max(error, key=error.get)
    others = f"; {len(found) - len(known)} not certified" if len(known) < len(found) else ""
    written = jobs.as_written(known[worst].get("worst", known[worst]))
    return f"at most {100 * error[worst]:.2g} % off the full shell{written}, {worst}{others}"


def verify_main(arguments):
    """Compares a finished bake with its manifest, and with another bake's."""
    parser = argparse.ArgumentParser(prog="shellwarp_farm verify", description=verify_main.__doc__)
    parser.add_argument("out", type=Path, help="folder of a bake")
    parser.add_argument("other", type=Path, nargs="?", help="folder of a bake of the same list")
    options = parser.parse_args(arguments)
    problems = verify(options.out, options.other)
    print("\n".join(problems) or f"{options.out}: every output is as its manifest says" +
          (f", and as {options.other} has it" if options.other else ""))
    return 1 if problems else 0


def verify(out, other=None):
    """What is wrong with a bake, a line each: missing, damaged, not in the manifest, or not as in the other."""
    records = manifest.read(out)
    problems = []
    for record in records:
        try:
            jobs.read_record(out, record["job"], record["hash"])
        except DamagedError as error:
            problems.append(f"{record['job']}: {error}")
    listed = manifest.outputs(records)
    suffixes = (*jobs.SUFFIXES.values(), ".state")
    present = {str(path.relative_to(out)) for path in Path(out).rglob("*") if path.is_file() and path.suffix in suffixes}
    problems += [f"{path}: not in the manifest" for path in sorted(present - set(listed))]
    if other is not None:
        theirs = manifest.outputs(manifest.read(other))
        differing = [path for path in sorted({*listed, *theirs}) if listed.get(path) != theirs.get(path)]
        problems += [f"{path}: not as in {other}" for path in differing]
    return problems
