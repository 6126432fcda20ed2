"""Shells that move on frame changes, in playback and in renders alike.

The handler runs after the scene is evaluated for the frame, so animation, parents and constraints of object and handles
are in; Blender evaluates again what it changes. Runs live here and not in the file: undo and redo do not touch them, and
after loading a file they begin at the start frame.
"""

import sys
from contextlib import contextmanager

import bpy
from bpy.app.handlers import persistent

from . import colliders, library, proxy, render_mesh, shape_key, stack
from .render_mesh import display
from .inputs import Refused, check_named, groups_of, read_inputs, read_output, read_shares, read_shell, split_matrix
from .jobs import Job
from .meshes import evaluated, present
from .simulation import Simulation

_runs = {}      # session_uid of the object -> Simulation
_messages = {}  # session_uid -> what went wrong last, "" for nothing
_refused = {}   # session_uid -> what a button could not do and why, by the button
_causes = {}    # session_uid -> why there is no model or no binding, until there is one
_jobs = {}      # session_uid -> the model that is being made
_suspended = set()
PATIENCE, TICK = 1.0, 0.2  # seconds that a frame waits for a model before it goes on without, and between looks at one under way


class Working(Refused):
    """The model is being made."""


def simulation(obj):
    """The object's run, None before its model is made."""
    return _runs.get(obj.session_uid)


def message(obj):
    """What went wrong at the last frame, "" for nothing."""
    return _messages.get(obj.session_uid, "")


def trouble(obj):
    """What the panel says is wrong: what a button could not do, what the settings name in vain now, what went wrong at the last frame."""
    found = [f"{button}: {text}" for button, text in _refused.get(obj.session_uid, {}).items()]
    try:
        check_named(obj)
    except Refused as error:
        return [*found, str(error)]
    return [*found, message(obj)] if message(obj) else found


def refuse(obj, button, text):
    """Keeps why a button did not do its work, until it does; "" forgets."""
    kept = _refused.setdefault(obj.session_uid, {})
    kept.pop(button, None)
    if text:
        kept[button] = text


def store(obj, run):
    """Makes `run` the object's, closing another."""
    forget(obj)
    _runs[obj.session_uid] = run
    if run.uncalibrated:
        print(f"shellwarp: {obj.name}: {run.uncalibrated}", file=sys.stderr)  # where a render farm looks


def forget(obj):
    """Frees the object's run."""
    stop(obj)
    run = _runs.pop(obj.session_uid, None)
    _messages.pop(obj.session_uid, None)
    _causes.pop(obj.session_uid, None)
    if run is not None:
        run.close()


@contextmanager
def suspended(obj):
    """Frame changes leave the object alone meanwhile."""
    _suspended.add(obj.session_uid)
    try:
        yield
    finally:
        _suspended.discard(obj.session_uid)


def job(obj):
    """The model that is being made for an object, None for none."""
    return _jobs.get(obj.session_uid)


def start(obj, depsgraph):
    """Begins to make the object's model on a thread; the job, None where there is a model of what the object is now."""
    shell, scale, recipe, key = read_shell(obj, depsgraph)
    run, under_way, package = simulation(obj), job(obj), library.package()
    if run is not None and run.key == key:
        return None
    if under_way is None or under_way.key != key or under_way.cancelled:
        forget(obj)
        calibrate = proxy.remade(obj, scale)

        def make(progress):
            return Simulation(package, shell, scale, recipe, key, progress, calibrate)
        _jobs[obj.session_uid] = Job(make, key)
    return job(obj)


def stop(obj):
    """Stops the job of an object."""
    under_way = _jobs.pop(obj.session_uid, None)
    if under_way is not None:
        under_way.cancel()


def waits(depsgraph):
    """Whether frames must wait for models: renders, and where nobody looks on."""
    return bpy.app.background or depsgraph.mode == "RENDER" or bpy.app.is_job_running("RENDER")


def watch():
    """Looks at the jobs, again and again by a timer while there are any: takes what is done, and shows it at the start frame."""
    for obj in [obj for obj in bpy.data.objects if obj.session_uid in _jobs and obj.session_uid not in _suspended]:
        if not job(obj).running():
            finish(obj)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
    return TICK if _jobs else None


def finish(obj):
    """Takes a job's model, and shows the shell."""
    if job(obj).cancelled:
        forget(obj)
        _causes[obj.session_uid] = "the precompute was cancelled: press Precompute, or go to the start frame"
        tell(obj, _causes[obj.session_uid])
        return
    scene = next((scene for scene in bpy.data.scenes if obj.name in scene.objects), bpy.context.scene)
    if scene.frame_current_final == obj.shellwarp.frame_start:
        scene.frame_set(scene.frame_current)  # where prepare takes it
    else:
        try:
            take(obj)
            tell(obj, "the model is made: go to the start frame")
        except Exception as error:
            _causes[obj.session_uid] = str(error) or type(error).__name__
            tell(obj, _causes[obj.session_uid])


def take(obj):
    """Makes a job's model the object's run; waits for it."""
    under_way = _jobs.pop(obj.session_uid)
    store(obj, under_way.result())
    return simulation(obj)


def prepare(obj, depsgraph, patience=None):
    """The object's run with a model of its present mesh, material and supports, made anew if these have changed.

    Where that fails, the run before ends as well: a shell does not go on with what it had. Where it takes longer than `patience`
    seconds, Working is raised, and it goes on."""
    try:
        under_way = start(obj, depsgraph)
        shown_by(obj, depsgraph)
        if under_way is not None:
            under_way.wait(patience)
            if under_way.running():
                raise Working(under_way.text())
        run = simulation(obj) if under_way is None else take(obj)
        run.groups = groups_of(obj.shellwarp)
        run.vary(*read_shares(obj))
        run.collide(colliders.prepare(obj, depsgraph, library.package(), run.solids))
    except Working:
        raise
    except Exception as error:
        forget(obj)
        _causes[obj.session_uid] = str(error) or type(error).__name__
        raise
    _causes.pop(obj.session_uid, None)
    bind(obj, depsgraph, run)
    return run


def find(uid):
    """The object of a session_uid, None where it is gone."""
    return next((obj for obj in bpy.data.objects if obj.session_uid == uid), None)


def shown_by(obj, depsgraph):
    """Readies what the shell is shown by: its modifier where something is below it, else a shape key."""
    if not stack.shows(obj):
        stack.detach(obj)
        return
    shape_key.remove(obj)
    if stack.attach(obj):
        depsgraph.update()  # so that the modifier has been where it leaves what is read


def bind(obj, depsgraph, run):
    """Binds the meshes that follow. Where that fails the model stays, as it may have taken long, and the shell waits."""
    try:
        run.follow(render_mesh.prepare(obj, depsgraph, library.package(), run, split_matrix(evaluated(obj, depsgraph))[:2]))
    except Exception as error:
        run.follow(())
        _causes[obj.session_uid] = str(error) or type(error).__name__
        raise


def show(obj, scene, depsgraph):
    """Moves one object to the depsgraph's frame."""
    begin, frame = obj.shellwarp.frame_start, scene.frame_current_final
    if frame == begin:
        run = prepare(obj, depsgraph, None if waits(depsgraph) else PATIENCE)
    elif job(obj) is not None:
        raise Working(job(obj).text())
    else:
        run = simulation(obj)
        if run is None or obj.session_uid in _causes:
            raise Refused(cause(obj, depsgraph) or "go to the start frame: the model is made there")
        if run.model.n_vertices != len(obj.data.vertices):
            raise Refused("the mesh has changed: go to the start frame")
    inputs = read_inputs(obj, scene, depsgraph, run)
    positions = run.go(frame, begin, inputs, read_output(obj.shellwarp))
    display(obj, stack.read(obj, depsgraph) if run.recipe.follows and frame < begin else positions)
    render_mesh.show(obj, depsgraph, run, (inputs.origin, inputs.rotation))


def cause(obj, depsgraph):
    """Why the object has no model or binding, "" when that is mended or none was asked for."""
    text = _causes.get(obj.session_uid, "")
    if text:
        try:
            read_shell(obj, depsgraph)
            colliders.prepare(obj, depsgraph, library.package())
            render_mesh.check_all(obj)
        except Exception:
            return text
    return ""


def tell(obj, text):
    """Keeps a message for the panel; a new one also goes to the console, where a render farm looks."""
    if text and text != message(obj):
        print(f"shellwarp: {obj.name}: {text}", file=sys.stderr)
    _messages[obj.session_uid] = text


@persistent
def on_frame_change(scene, depsgraph):
    """Moves every live shell of the scene. A shell in trouble keeps its last shape and says why; nothing is raised."""
    for obj in scene.objects:
        if not (obj.type == "MESH" and obj.shellwarp.enabled and obj.shellwarp.live):
            continue
        if obj.session_uid in _suspended or not (present(obj, depsgraph) or render_mesh.seen(obj, depsgraph)):
            continue
        try:
            show(obj, scene, depsgraph)
            tell(obj, "")
        except Working:  # the panel asks the job itself
            _messages[obj.session_uid] = ""
            if not bpy.app.timers.is_registered(watch):
                bpy.app.timers.register(watch, first_interval=TICK)
        except Exception as error:  # whatever it is, the frame change of all others goes on
            tell(obj, str(error) or type(error).__name__)


@persistent
def on_load(*_):
    """Another file: its objects' numbers are new."""
    for under_way in _jobs.values():
        under_way.cancel()
    _jobs.clear()
    for run in _runs.values():
        run.close()
    _runs.clear()
    _messages.clear()
    _refused.clear()
    _causes.clear()


def register():
    bpy.app.handlers.frame_change_post.append(on_frame_change)
    bpy.app.handlers.load_pre.append(on_load)


def unregister():
    bpy.app.handlers.frame_change_post.remove(on_frame_change)
    bpy.app.handlers.load_pre.remove(on_load)
    on_load()
