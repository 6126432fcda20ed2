"""Runs shells from their first to their last frames into point caches, which Mesh Cache modifiers then play.

A baked shell needs neither this add-on nor its library any more, moves between frames for motion blur, and is what
exporters take for animated: they skip what only a handler moves. Meshes that follow it have caches of their own.
"""

import hashlib
import os
from contextlib import ExitStack, closing

import bpy

from . import live, render_mesh, shape_key, stack
from .inputs import Refused, check_mesh, read_inputs, read_output
from .jobs import Estimate
from .meshes import faces_of, rest_positions
from .point_cache import PointCache, points_of
from .stack import CACHE

WAIT = 0.05  # seconds between looks at a precompute
CERTIFIED = 50_000  # vertices at most that a bake certifies its last frame of


def cache_path(obj, of=None):
    """Where the cache of a shell goes, or of a mesh that follows it, as it is written into the file: relative when it can be."""
    name = file_name((of or obj).name)
    chosen = obj.shellwarp.cache
    if chosen and of is None:
        return chosen
    if chosen:  # beside the shell's
        stem, ending = os.path.splitext(chosen)
        return f"{stem}-{name}{ending or '.pc2'}"
    if not bpy.data.filepath:
        raise Refused("save the file first, or name a cache")
    return f"//cache/{name}.pc2"


def file_name(name):
    """A name that files can have, and no other object's."""
    clean = bpy.path.clean_name(name)
    if clean != name:  # others may become the same
        clean += "-" + hashlib.blake2b(name.encode(), digest_size=4).hexdigest()
    return clean


def paths_of(obj):
    """The caches of a shell: its own, and those of the meshes that follow it, by object."""
    return {obj: cache_path(obj), **{item: cache_path(obj, item) for item in render_mesh.objects(obj)}}


def the_file(path):
    """What tells files apart, also where the system tells no case apart."""
    return os.path.realpath(bpy.path.abspath(path)).casefold()


def check_alone(obj):
    """Raises Refused where another object's cache is the same file."""
    mine = {the_file(path): path for path in paths_of(obj).values()}
    for other in bpy.data.objects:
        if other != obj and other.type == "MESH" and other.shellwarp.enabled and (other.shellwarp.cache or bpy.data.filepath):
            followers = [entry.target for entry in other.shellwarp.renders if entry.target]
            for path in (cache_path(other), *(cache_path(other, item) for item in followers)):
                if the_file(path) in mine:
                    raise Refused(f"{mine[the_file(path)]} is the cache of “{other.name}” too: name another")


class Track:
    """One shell's bake under way: its run and its caches."""

    def __init__(self, obj):
        check_mesh(obj)
        settings = obj.shellwarp
        if settings.frame_end < settings.frame_start:
            raise Refused("the end is before the start")
        check_alone(obj)
        self.obj, self.paths = obj, paths_of(obj)
        self.start, self.end = settings.frame_start, settings.frame_end
        self.caches, self.run, self.too_far = {}, None, 0
        self.widest, self.most = None, 0.0  # a copy of the state where it is furthest from rest, and how far
        settings.verdict = ""

    def precompute(self, context):
        """Makes the model on a thread; yields texts meanwhile, and stops it when closed."""
        under_way = live.start(self.obj, context.evaluated_depsgraph_get())
        try:
            while under_way is not None and under_way.running():
                under_way.wait(WAIT)
                yield f"{self.obj.name}: {under_way.text()}"
        finally:
            if under_way is not None and under_way.running():
                live.stop(self.obj)
        if under_way is not None:
            live.take(self.obj)

    def begin(self, depsgraph):
        """Makes the model and opens the caches."""
        self.run = live.prepare(self.obj, depsgraph)
        self.run.forget()
        if len(self.run.bound) != len(self.paths) - 1:
            there = {item.uid for item in self.run.bound}
            lost = next(item.name for item in self.paths if item != self.obj and item.session_uid not in there)
            raise Refused(f"render mesh “{lost}” is disabled here, so that nobody knows where it is: hide it by the eye")
        for item, path in self.paths.items():
            self.caches[item] = PointCache(bpy.path.abspath(path), len(item.data.vertices), self.start, [bpy.data.filepath])

    def frame(self, frame, scene, depsgraph):
        """Appends one frame, if it is one of the shell's."""
        if not self.start <= frame <= self.end:
            return
        if self.run is None:
            self.begin(depsgraph)
        inputs = read_inputs(self.obj, scene, depsgraph, self.run)
        self.caches[self.obj].append(self.run.go(frame, self.start, inputs, read_output(self.obj.shellwarp)))
        for item, points in render_mesh.positions(self.obj, depsgraph, self.run, (inputs.origin, inputs.rotation)):
            self.caches[item].append(points)
        report = self.run.report()
        self.too_far += not report["turn_in_range"]
        if report["max_displacement"] > self.most and frame < self.end and self.run.model.n_vertices <= CERTIFIED and not self.run.is_full:
            self.drop_widest()
            self.widest, self.most = self.run.copied(), report["max_displacement"]

    def certify(self):
        """Estimates the errors of the widest frame and the last on a thread; yields texts meanwhile. The bake is whole without it."""
        if self.run.model.n_vertices > CERTIFIED:
            return
        estimate, found = None, []
        try:
            for begin in (self.estimate_widest, self.run.estimate):
                estimate = begin()
                while estimate is not None and estimate.running():
                    estimate.wait(WAIT)
                    yield f"{self.obj.name}: {estimate.text()}"
                found += [estimate] if estimate is not None else []
            self.run.certify(*found)
        except GeneratorExit:
            if estimate is not None:
                estimate.cancel()
            raise
        except Exception as error:
            self.run.certified = f"not certified: {error}"

    def estimate_widest(self):
        """Of the frame of the largest displacement; none where that is the last."""
        kept, self.widest = self.widest, None
        return Estimate(*kept) if kept is not None else None

    def drop_widest(self):
        """Lets go of the copy."""
        if self.widest is not None:
            self.widest[0].close()
            self.widest = None

    def close(self):
        """Puts the files in their places, lets modifiers play them, and says how good the last frame is."""
        for item in list(self.caches):
            self.caches[item].close()
            del self.caches[item]
        self.obj.shellwarp.verdict = verdict(self.run, self.too_far, self.end - self.start + 1)
        self.obj.shellwarp.baked_mesh = mesh_digests(self.obj.data)
        self.obj.shellwarp.live = False
        for item, path in self.paths.items():
            use(item, path, self.start)

    def discard(self):
        """Removes what was written and not finished."""
        self.drop_widest()
        for cache in self.caches.values():
            cache.discard()
        self.caches = {}


def bake(objects, context):
    """A generator that bakes shells side by side, so that each frame is evaluated once: yields the fraction done, and a text.
    Closing it before its end drops what was written, and stops a precompute. One that fails drops its own; in the end its reason
    is raised."""
    scene, failed = context.scene, []
    tracks = [named(obj, objects, lambda obj=obj: Track(obj)) for obj in objects]
    with ExitStack() as cleaning:
        cleaning.callback(go_back, scene, scene.frame_current, objects)
        for track in tracks:
            cleaning.callback(track.discard)
            cleaning.enter_context(live.suspended(track.obj))

        def survivors(work):
            """Those of the tracks that the work does not fail with."""
            kept = []
            for track in tracks:
                try:
                    named(track.obj, objects, lambda track=track: work(track))
                    kept.append(track)
                except Exception as error:
                    track.discard()
                    failed.append(error)
            return kept

        for track in list(tracks):
            scene.frame_set(track.start)
            try:
                with closing(track.precompute(context)) as texts:
                    for text in texts:
                        yield 0.0, text
            except Exception as error:
                failed.append(Refused(f"“{track.obj.name}”: {error}") if len(objects) > 1 else error)
                tracks.remove(track)
        first, last = min((t.start for t in tracks), default=0), max((t.end for t in tracks), default=-1)
        for frame in range(first, last + 1):
            scene.frame_set(frame)
            tracks = survivors(lambda track: track.frame(frame, scene, context.evaluated_depsgraph_get()))
            if not tracks:
                break
            yield (frame - first + 1) / (last - first + 1), f"frame {frame} of {last}"
        for track in tracks:
            for text in track.certify():
                yield 1.0, text
        survivors(lambda track: track.close())
        if failed:
            raise failed[0] if len(objects) == 1 else Refused("; ".join(map(str, failed)))


def go_back(scene, frame, objects):
    """Goes to a frame; a shell whose precompute was stopped does not begin another there."""
    with ExitStack() as waiting:
        for obj in objects:
            if live.simulation(obj) is None:
                waiting.enter_context(live.suspended(obj))
        scene.frame_set(frame)


def named(obj, objects, work):
    """Does the work for an object; where there are several, what it refuses begins with the name."""
    try:
        return work()
    except Exception as error:
        if len(objects) == 1:
            raise
        raise Refused(f"“{obj.name}”: {error}") from error


def verdict(run, too_far, count):
    """What to say of a whole bake."""
    parts = [run.certified or f"not certified: more than {CERTIFIED} vertices", run.touching()]
    parts.append(f"turned too far for the method in {too_far} of {count} frames" if too_far else "")
    return "; ".join(filter(None, parts))


def use(obj, path, start):
    """Lets the modifier play the cache where the shell is in the stack, and what showed it live go."""
    place = stack.place(obj)
    shape_key.remove(obj)
    stack.detach(obj)
    modifier = obj.modifiers.get(CACHE) or obj.modifiers.new(CACHE, "MESH_CACHE")
    obj.modifiers.move(obj.modifiers.find(CACHE), place)
    modifier.cache_format, modifier.filepath = "PC2", path
    modifier.play_mode, modifier.time_mode, modifier.interpolation = "SCENE", "FRAME", "LINEAR"
    modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"
    modifier.frame_start, modifier.frame_scale = start, 1.0
    obj.update_tag()


def baked(obj):
    """The modifier, None when the shell is not baked or its file is gone."""
    modifier = obj.modifiers.get(CACHE)
    return modifier if modifier and os.path.isfile(bpy.path.abspath(modifier.filepath)) else None


def stale(obj):
    """What to say of caches that are not of the present meshes, "" for nothing."""
    if baked(obj) is None:
        return ""
    for item in (obj, *(entry.target for entry in obj.shellwarp.renders if entry.target)):
        if baked(item) is None:
            continue
        points, present = points_of(bpy.path.abspath(baked(item).filepath)), len(item.data.vertices)
        if points != present:
            return ("" if item == obj else f"render mesh “{item.name}”: ") + f"the cache is of {points} points, the mesh has {present}: bake anew"
    before, now = obj.shellwarp.baked_mesh.split(), mesh_digests(obj.data).split()
    if before and before[0] != now[0]:
        return "the mesh has other faces than when it was baked: bake anew"
    return "vertices were moved since the bake: bake anew" if before and before[1] != now[1] else ""


def mesh_digests(mesh):
    """What tells meshes apart, in two words: by their faces, and by where their vertices are."""
    parts = faces_of(mesh), rest_positions(mesh).tobytes()
    return " ".join(hashlib.blake2b(part, digest_size=8).hexdigest() for part in parts)


def free(obj):
    """Removes the modifiers and goes live again; the files stay."""
    for item in (obj, *(entry.target for entry in obj.shellwarp.renders if entry.target)):
        remove(item)
    obj.shellwarp.live = True


def remove(item):
    """Removes the modifier that plays a cache."""
    modifier = item.modifiers.get(CACHE)
    if modifier is not None:
        item.modifiers.remove(modifier)
