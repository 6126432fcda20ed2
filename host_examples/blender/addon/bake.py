"""Runs a shell from its first to its last frame into a point cache, which a Mesh Cache modifier then plays.

A baked shell needs neither this add-on nor its library any more, moves between frames for motion blur, and is what
exporters take for animated: they skip what only a handler moves.
"""

import os

import bpy

from . import live, shape_key
from .inputs import Refused, check_object, read_inputs
from .point_cache import PointCache

MODIFIER = "shellwarp cache"
CERTIFIED = 50_000  # vertices at most that a bake certifies its last frame of


def cache_path(obj):
    """Where the cache of an object goes, as it is written into the file: relative when it can be."""
    if obj.shellwarp.cache:
        return obj.shellwarp.cache
    if not bpy.data.filepath:
        raise Refused("save the file first, or name a cache")
    return f"//cache/{bpy.path.clean_name(obj.name)}.pc2"


def bake(obj, context):
    """A generator: one frame a turn, yields the fraction done. Closing it before its end drops what was written."""
    check_object(obj)
    settings, scene = obj.shellwarp, context.scene
    if settings.frame_end < settings.frame_start:
        raise Refused("the end is before the start")
    path = cache_path(obj)
    back, cache, count = scene.frame_current, None, settings.frame_end - settings.frame_start + 1
    with live.suspended(obj):
        try:
            for i in range(count):
                scene.frame_set(settings.frame_start + i)
                depsgraph = context.evaluated_depsgraph_get()
                if cache is None:
                    run = live.prepare(obj, depsgraph)
                    run.forget()
                    cache = PointCache(bpy.path.abspath(path), run.model.n_vertices, settings.frame_start, [bpy.data.filepath])
                inputs = read_inputs(obj, scene, depsgraph, run.scale)
                cache.append(run.go(settings.frame_start + i, settings.frame_start, inputs))
                yield (i + 1) / count
            cache.close()
            cache = None
            certify(run)
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


def free(obj):
    """Removes the modifier and goes live again; the file stays."""
    modifier = obj.modifiers.get(MODIFIER)
    if modifier is not None:
        obj.modifiers.remove(modifier)
    obj.shellwarp.live = True
