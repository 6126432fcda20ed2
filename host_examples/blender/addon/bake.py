"""Runs a shell from its first to its last frame into a point cache, which a Mesh Cache modifier then plays.

A baked shell needs neither this add-on nor its library any more, moves between frames for motion blur, and is what
exporters take for animated: they skip what only a handler moves.
"""

import hashlib
import os

import bpy

from . import live, shape_key
from .inputs import Refused, check_object, read_inputs
from .point_cache import PointCache, points_of

MODIFIER = "shellwarp cache"
CERTIFIED = 50_000  # vertices at most that a bake certifies its last frame of


def cache_path(obj):
    """Where the cache of an object goes, as it is written into the file: relative when it can be."""
    if obj.shellwarp.cache:
        return obj.shellwarp.cache
    if not bpy.data.filepath:
        raise Refused("save the file first, or name a cache")
    name = bpy.path.clean_name(obj.name)
    if name != obj.name:  # others may become the same
        name += "-" + hashlib.blake2b(obj.name.encode(), digest_size=4).hexdigest()
    return f"//cache/{name}.pc2"


def check_alone(obj, path):
    """Raises Refused where another shell's cache is the same file, also where the system tells no case apart."""
    mine = os.path.realpath(bpy.path.abspath(path)).casefold()
    for other in bpy.data.objects:
        if other != obj and other.type == "MESH" and other.shellwarp.enabled and (other.shellwarp.cache or bpy.data.filepath):
            if os.path.realpath(bpy.path.abspath(cache_path(other))).casefold() == mine:
                raise Refused(f"{path} is the cache of “{other.name}” too: name another")


def bake(obj, context):
    """A generator: one frame a turn, yields the fraction done. Closing it before its end drops what was written."""
    check_object(obj)
    settings, scene = obj.shellwarp, context.scene
    if settings.frame_end < settings.frame_start:
        raise Refused("the end is before the start")
    path = cache_path(obj)
    check_alone(obj, path)
    back, cache, count = scene.frame_current, None, settings.frame_end - settings.frame_start + 1
    settings.verdict, too_far = "", 0
    with live.suspended(obj):
        try:
            for i in range(count):
                scene.frame_set(settings.frame_start + i)
                depsgraph = context.evaluated_depsgraph_get()
                if cache is None:
                    run = live.prepare(obj, depsgraph)
                    run.forget()
                    cache = PointCache(bpy.path.abspath(path), run.model.n_vertices, settings.frame_start, [bpy.data.filepath])
                inputs = read_inputs(obj, scene, depsgraph, run)
                cache.append(run.go(settings.frame_start + i, settings.frame_start, inputs))
                too_far += not run.report()["turn_in_range"]
                yield (i + 1) / count
            cache.close()
            cache = None
            certify(run)
            settings.verdict = verdict(run, too_far, count)
            use(obj, path)
        finally:
            if cache is not None:
                cache.discard()
            scene.frame_set(back)


def certify(run):
    """Estimates the last frame's error where that takes seconds; the bake is whole without it."""
    if run.model.n_vertices <= CERTIFIED:
        try:
            run.certify()
        except Exception as error:
            run.certified = f"not certified: {error}"


def verdict(run, too_far, count):
    """What to say of a whole bake."""
    parts = [run.certified or f"not certified: more than {CERTIFIED} vertices", run.touching()]
    parts.append(f"turned too far for the method in {too_far} of {count} frames" if too_far else "")
    return "; ".join(filter(None, parts))


def use(obj, path):
    """Lets the modifier play the cache, first of all modifiers, and the live key go."""
    settings = obj.shellwarp
    settings.live = False
    shape_key.remove(obj)
    modifier = obj.modifiers.get(MODIFIER) or obj.modifiers.new(MODIFIER, "MESH_CACHE")
    obj.modifiers.move(obj.modifiers.find(MODIFIER), 0)
    modifier.cache_format, modifier.filepath = "PC2", path
    modifier.play_mode, modifier.time_mode, modifier.interpolation = "SCENE", "FRAME", "LINEAR"
    modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"
    modifier.frame_start, modifier.frame_scale = settings.frame_start, 1.0
    obj.update_tag()


def baked(obj):
    """The modifier, None when the shell is not baked or its file is gone."""
    modifier = obj.modifiers.get(MODIFIER)
    return modifier if modifier and os.path.isfile(bpy.path.abspath(modifier.filepath)) else None


def stale(obj):
    """What to say of a cache that is not of the present mesh, "" for nothing."""
    modifier = baked(obj)
    if modifier is None:
        return ""
    points, present = points_of(bpy.path.abspath(modifier.filepath)), len(obj.data.vertices)
    return f"the cache is of {points} points, the mesh has {present}: bake anew" if points != present else ""


def free(obj):
    """Removes the modifier and goes live again; the file stays."""
    modifier = obj.modifiers.get(MODIFIER)
    if modifier is not None:
        obj.modifiers.remove(modifier)
    obj.shellwarp.live = True
