"""One job: simulate a frame range, write its point caches and its last state, then its record. The same bits on any worker."""

import itertools
import json
import os
import socket
import time
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import numpy
import shellwarp

from . import colliders, files, motion, samples, selection
from .content import content_hash
from .errors import DamagedError, FarmError, SceneError
from .handles import Handles
from .job_log import JobLog, library_messages
from .mesh_file import stem as stem_of
from .materials import is_sheet
from .model import library_digest, load_model, metres_of, model_tables
from .point_cache import PointCacheFile
from .polygon import cut
from .scenes import MODEL_KEYS
from .simulated import by_vertices, drawn_at, mesh_at, polygons_at, simulated_at
from .supports import Supports, led_supports
from .usd_cache import UsdFile

SUFFIXES = {"pc2": ".pc2", "usd": ".usdc"}
RECORDS = "records"
AIR = 1.2   # kg/m3
CERTIFIED = 50_000   # vertices at most that a job is certified of


def bake(job, model, before, out, cache, run="alone"):
    """Does the job unless it is done: its record, with "done" = "baked" or "verified". `model` is what prepare or identify
    returned, `before` the record of the job that this one comes after. What trying again cannot mend comes back as "failed";
    what it may mend is raised. Tries of one `run` are told in the job's log."""
    log = JobLog(out, job["name"], run)
    try:
        with library_messages(log.say):
            result = _try(job, model, before, out, cache, log)
    except Exception as error:
        log.fail(error)
        raise
    log.end("failed for good: " + result["failed"] if "failed" in result else
            f"{result['done']} in {sum(result['seconds'].values()):.3g} s, {len(result['outputs'])} files")
    return {**result, "tried_again": log.reasons}


def _try(job, model, before, out, cache, log):
    try:
        for needed in filter(None, (model, before)):
            if "failed" in needed:
                raise SceneError(needed["failed"])
        start = _start(job, before, out)
        job_hash = hash_of(job, model["key"], start)
        try:
            record = {**read_record(out, job["name"], job_hash), "done": "verified"}
        except DamagedError as error:
            log.say(f"baking: {error}")
            record = {**_bake(job, model, job_hash, start, out, cache, log), "done": "baked", "redone": error.args[0]}
        return record
    except (FarmError, shellwarp.ShellwarpError) as error:
        return {"job": job["name"], "failed": f"{job['name']}: {error}"}


def hash_of(job, key, start):
    """Hash of all that the outputs of a job depend on."""
    names = ("handle", "follow_rest", "wind", "frame", "force", "seed", "frames", "up_axis", "metres_per_unit", "formats", "name")
    simulation = {k: v for k, v in job["simulation"].items() if k not in MODEL_KEYS}
    return content_hash({
        "model": key, "simulation": simulation, "start": start, "library": library_digest(), "support": led_supports(job),
        "motion": [*samples.samples(job["motion"], job["mesh"])] if job["motion"] else None,
        "damping": {**job["damping"], "factors": _factors(job)}, "collider": colliders.content(job["collider"]),
        "drawn": [_content(job["mesh"])[1:], *map(_content, job["render"])], **{name: job[name] for name in names}})


def _content(path):
    points, faces = polygons_at(path)
    drawn = drawn_at(path)
    return [stem_of(path), points, numpy.array([len(face) for face in faces]), numpy.array([v for face in faces for v in face]),
            drawn.uvs, drawn.corner_uvs, drawn.asset]


def record_path(out, name):
    """Where the record of a job lies."""
    return Path(out) / RECORDS / f"{name}.json"


def read_record(out, name, job_hash=None):
    """A finished job's record; DamagedError, which says why, if it is missing, of other inputs, or an output is not as written."""
    try:
        record = json.loads(record_path(out, name).read_bytes())
    except FileNotFoundError:
        raise DamagedError("not done before") from None
    except ValueError:
        raise DamagedError("its record is damaged") from None
    if job_hash is not None and record["hash"] != job_hash:
        raise DamagedError("its inputs have changed")
    for output, facts in record["outputs"].items():
        path = Path(out) / output
        if not path.is_file():
            raise DamagedError(f"{output} is missing")
        if files.checksum(path) != facts["sha256"]:
            raise DamagedError(f"{output} is damaged")
    return record


def _start(job, before, out):
    """The state to begin with, bytes, None for rest."""
    path = job["start"] or (Path(out) / f"{job['after']}.state" if before else None)
    if path is None:
        return None
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from None
    return numpy.frombuffer(data, dtype=numpy.uint8)


def _bake(job, model_facts, job_hash, start, out, cache, log):
    times, cpu = {"begin": time.perf_counter()}, time.process_time()
    model, cache_report = load_model(model_tables(job), model_facts["key"], cache)
    _tell_model(log, job, model_facts, cache_report, model)
    times["model"] = time.perf_counter()
    record_path(out, job["name"]).unlink(missing_ok=True)   # it speaks of what is about to be replaced
    base = Path(out) / job["name"]
    paths = {(kind, number): Path(f"{base}{stem}{SUFFIXES[kind]}") for kind in job["formats"] for number, stem in enumerate(stems(job))}
    paths["state"] = Path(f"{base}.state")
    with ExitStack() as stack, state_of(job, model) as state:
        bindings = [bind_itself(model, job, stack), *(stack.enter_context(bind(model, path)) for path in job["render"])]
        partials = {kind: stack.enter_context(files.whole_file(path)) for kind, path in paths.items()}
        why, widest = _not_certified(job, model), stack.enter_context(closing(Widest()))
        judged = simulate(job, state, start, partials, bindings, widest if not why else None, log)
        if not job["simulation"]["correction_steps"]:
            state.correct(0)  # what an earlier shot left
        partials["state"].write_bytes(state.save())
        times["simulate"] = time.perf_counter()
        certified = {"why": why} if why else _certified(state, job["frames"][1], widest)
        log.say(certificate_words(certified))
    times["certify"] = time.perf_counter()
    outputs = {str(path.relative_to(out)): {"sha256": files.checksum(path), "bytes": path.stat().st_size}
               for path in paths.values()}
    times["checksum"] = time.perf_counter()
    marks = list(times)
    report = cache_report or {"cache": "kept", "seconds": 0.0}
    record = {"job": job["name"], "hash": job_hash, "outputs": outputs, "range": judged, "certified": certified, "cache": report,
              "model": model_facts, "vertices": model.n_vertices, "frames": job["frames"], "parameters": job["parameters"],
              "seed": job["seed"], "seconds": {b: times[b] - times[a] for a, b in zip(marks, marks[1:])},
              "core_seconds": time.process_time() - cpu, "worker": f"{socket.gethostname()}:{os.getpid()}", "library": shellwarp.version()}
    files.write_whole(record_path(out, job["name"]), json.dumps(record, indent=1).encode())
    return record


def state_of(job, model):
    """A state of the job's method at rest."""
    return model.state(*(job["simulation"][key] for key in ("method", "integrator", "deterministic")))


class Widest:
    """A copy of the state at the frame where it is furthest from rest."""

    def __init__(self):
        self.state, self.frame, self.most = None, None, 0.0

    def close(self):
        """Lets go of the copy."""
        if self.state is not None:
            self.state.close()

    def look(self, state, frame, moved):
        """Keeps a copy where this frame is further from rest than those before."""
        if moved > self.most:
            self.close()
            self.state, self.frame, self.most = state.clone(), frame, moved


def _not_certified(job, model):
    """Why a job is not certified; None where it is."""
    if not job["certify"]:
        return "nobody asks for it"
    return f"more than {CERTIFIED} vertices" if model.n_vertices > CERTIFIED else None


def _certified(state, last, widest):
    """How far the last frame is off the full shell, a share of its displacement, or why that is not known: for the record. `worst`:
    the frame that is furthest off, of the last and the widest, and its error as a share of the largest displacement. `corrected_error`, of
    what is written, where Newton steps were taken for that."""
    try:
        found = state.certify()
    except shellwarp.ShellwarpError as error:
        return {"why": str(error)}
    frames = [(last, found)]
    if widest.state is not None and widest.frame != last:
        with suppress(shellwarp.ShellwarpError):   # there is none of this shape
            frames.append((widest.frame, widest.state.certify()))
    moved = {last: state.report()["max_displacement"], widest.frame: widest.most}
    frame, off = max(frames, key=lambda one: one[1]["error"] * moved[one[0]])
    factor = moved[frame] / widest.most if widest.most else 1.0
    worst = {"frame": frame, **{name: factor * off[name] for name in _errors(off)}}
    return {**{name: found[name] for name in (*_errors(found), "max_error", "remaining")}, "worst": worst}


def _errors(found):
    """The errors that a certificate has: where Newton steps were taken, also that of what is written."""
    return ("error", "corrected_error") if found["corrected_error"] != found["error"] else ("error",)


def certificate_words(certified):
    """The same in a line."""
    if "why" in certified:
        return f"not certified: {certified['why']}"
    rough = ", roughly" if certified["remaining"] > 0.01 else ""
    worst = certified["worst"]
    return (f"frame {worst['frame']}: {100 * worst['error']:.2g} % of the largest displacement off the full shell, at most{as_written(worst)}; "
            f"last frame: {100 * certified['error']:.2g} %{as_written(certified)}{rough}")


def as_written(facts):
    """What Newton steps leave of an error, "" where none were taken."""
    return f", {100 * facts['corrected_error']:.2g} % as written" if "corrected_error" in facts else ""


def _tell_model(log, job, facts, cache_report, model):
    for message in facts.get("messages", ()):
        log.say(f"precompute: {message}")
    log.say(f"model {facts['key'][:12]}, {model.n_vertices} vertices, {job['simulation']['method']}: "
            f"{(cache_report or {'cache': 'kept'})['cache']}, prepared: {facts['cache']} in {facts['seconds']:.3g} s")


def stems(job):
    """What the files of the shell and of each mesh that follows it are called by, after the job's name."""
    return ["", *(f"_{stem_of(path)}" for path in job["render"])]


def bind(model, path):
    """The points of a mesh that follows, bound to a model. SceneError where they cannot be."""
    try:
        return shellwarp.Binding(model, polygons_at(path)[0])
    except shellwarp.ShellwarpError as error:
        raise SceneError(f"{path}: {error}") from None


def bind_itself(model, job, stack):
    """The shell's own vertices, whose velocities USD has; None where nobody asks, or its mesh is too sharp for it. Of a proxy, the mesh's."""
    if job["proxy"]:
        return stack.enter_context(bind(model, job["mesh"]))
    if "usd" not in job["formats"]:
        return None
    try:
        return stack.enter_context(shellwarp.Binding(model, mesh_at(job["mesh"])[0]))
    except shellwarp.NumericalError:
        return None


def simulate(job, state, start, partials, bindings, widest, log):
    """Runs the frames into the files: what the record says of the range of the method. `bindings`: of the shell's own vertices, for their velocities, and of each mesh that follows; `widest` looks at each frame."""
    first, last = job["frames"]
    _set_up(job, state)
    handles, supports, end = Handles(job), Supports(job), _seconds(job, last)
    colliders.put(state, job["collider"])
    rate = job["simulation"]["frame_rate"]
    if start is not None:
        colliders.deform(state, job["collider"], _seconds(job, first - 1), rate, teleport=True)   # not in the state
        state.load(start.tobytes())
    else:
        colliders.move(state, job["collider"], _seconds(job, first), rate, teleport=True)
        supports.begin(state, _seconds(job, first), end)
    with ExitStack() as files_to_close:
        writers = _writers(job, partials, files_to_close)  # by which mesh: the shell, then what follows it
        return _write_frames(job, state, start is None, writers, bindings, (handles, supports), widest, log)


def _write_frames(job, state, from_rest, writers, bindings, led, widest, log):
    """Runs the frames and writes each: what the record says of the range of the method."""
    first, last = job["frames"]
    judged = {"frames_out": 0, "first_out": None, "max_rotation": 0.0, "worst_fraction": 0.0,
              "deepest_penetration": 0.0, "deepest_left": 0.0, "contact_count": 0, "frames_handles_unmet": 0}
    buffer = numpy.empty((state.n_vertices, 3), numpy.float32)
    moved = {"correction_steps": job["simulation"]["correction_steps"], "outside": job["simulation"]["push_out"]}
    for frame in range(first, last + 1):
        if not from_rest or frame > first:
            _step_to(job, state, frame, *led)
        if moved["correction_steps"]:
            state.correct(moved["correction_steps"])
        for number, files_of_it in enumerate(writers):
            points = state.bound_points(bindings[number], ("positions", "velocities"), **moved) if bindings[number] else {}
            if number == 0 and not job["proxy"]:   # to the last bit
                points["positions"], left = _shown(state, job["simulation"], buffer)
                judged["deepest_left"] = max(judged["deepest_left"], left)
            for writer in files_of_it:
                writer.append(**points)
        report = state.report()
        if judged["first_out"] is None and not report["turn_in_range"]:
            log.say(f"frame {frame}: turned too far for the method, {report['max_rotation']:.2f} rad")
        if widest is not None:
            widest.look(state, frame, report["max_displacement"])
        _judge(judged, frame, report)
        judged["frames_handles_unmet"] += not all(found["met"] for found in state.constraint_report())
    for writer in itertools.chain(*writers):
        writer.close()
    return judged


def _factors(job):
    """Of damping at the vertices that are simulated, None for none."""
    path = job["damping"].get("factors")
    return by_vertices(path, simulated_at(job), "factors") if path else None


def _set_up(job, state):
    state.set_gravity(job["simulation"]["gravity"])
    state.set_stiffness(job["simulation"]["stiffness_factor"])
    constants = {key: value for key, value in job["damping"].items() if key != "factors"}
    state.set_damping(**constants, factors=_factors(job))
    if job["force"]:
        simulated = simulated_at(job)
        vertices = [selection.one_vertex(force, simulated, job["mesh"]) for force in job["force"]]
        state.set_forces(numpy.array([force["vector"] for force in job["force"]], dtype=float), vertices)


def _shown(state, simulation, buffer):
    """The frame's positions with what is to be done to them, and how deep a push-out leaves a vertex."""
    if simulation["push_out"]:
        return state.positions_outside()
    steps = simulation["correction_steps"]
    return state.positions_corrected(steps, out=buffer) if steps else state.positions(out=buffer), 0.0


def _step_to(job, state, frame, handles, supports):
    """From the frame before: the inputs of each step are those of its end."""
    steps, last = job["simulation"]["steps_per_frame"], _seconds(job, job["frames"][1])
    metres = metres_of(job) if is_sheet(job["material"]) else 1.0
    for k in range(1, steps + 1):
        seconds = _seconds(job, frame - 1 + k / steps)
        supports.move(state, seconds, last)
        handles.move(state, seconds)
        if job["wind"]:
            _blow(job["wind"], metres, job["seed"], seconds, state)
        colliders.move(state, job["collider"], seconds, job["simulation"]["frame_rate"])
        state.step(1 / (job["simulation"]["frame_rate"] * steps))


def _blow(wind, metres, seed, seconds, state):
    factor = motion.gust(wind, seed, seconds) if "gust" in wind else 1.0
    velocity = [factor * component for component in wind.get("velocity", (0, 0, 0))]
    state.set_wind(velocity, wind.get("density", AIR * metres ** 3), wind.get("normal_drag", 1.0), wind.get("tangential_drag", 0.0))


def _writers(job, partials, stack):
    """The files of each mesh, which `stack` closes in the end."""
    first, last = job["frames"]
    frames, rate, name = range(first, last + 1), job["simulation"]["frame_rate"], Path(job["name"]).name
    writers = []
    for number, (path, stem) in enumerate(zip((job["mesh"], *job["render"]), stems(job))):
        points, faces = polygons_at(path)
        of_it = []
        if "pc2" in job["formats"]:
            of_it.append(stack.enter_context(PointCacheFile(partials["pc2", number], len(points), first, len(frames))))
        if "usd" in job["formats"]:
            triangles = cut([face for face in faces if len(face) > 2], points)
            of_it.append(stack.enter_context(UsdFile(partials["usd", number], name + stem, drawn_at(path), triangles, frames, rate,
                                                     job["up_axis"], job["metres_per_unit"])))
        writers.append(of_it)
    return writers


def _judge(judged, frame, report):
    if not report["turn_in_range"]:
        judged["frames_out"] += 1
        judged["first_out"] = frame if judged["first_out"] is None else judged["first_out"]
    for name in ("max_rotation", "deepest_penetration", "contact_count"):  # the most of all frames
        judged[name] = max(judged[name], report[name])
    judged["worst_fraction"] = max(judged["worst_fraction"], report["fraction_turned_too_far"])


def _seconds(job, frame):
    return frame / job["simulation"]["frame_rate"]
