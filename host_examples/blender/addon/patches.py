"""Finds where a shell is likely to be touched: a vertex group of contact patches near the colliders, where these are now."""

import bpy
import numpy

from . import colliders, library
from .inputs import Refused, evaluated, read_shell, split_matrix
from .operators import ShellOperator

GROUP = "contact patches"  # of a shell that has none yet


def find(obj, depsgraph, distance, most):
    """Vertices that rest no farther than `distance`, in the world, from a collider, spread evenly; at most `most`."""
    package = library.package()
    prepared = colliders.prepare(obj, depsgraph, package)
    if not prepared:
        raise Refused("it has no colliders")
    shell = read_shell(obj, depsgraph)[0]
    origin, rotation, _ = split_matrix(evaluated(obj, depsgraph))
    turn = numpy.reshape(rotation, (3, 3)).T  # to the shell's axes, whose lengths are the world's
    poses = [(tuple(turn @ (numpy.array(solid.origin) - origin)), tuple((turn @ numpy.reshape(solid.rotation, (3, 3))).ravel()))
             for solid in colliders.read_solids(obj, depsgraph, prepared)]
    with package.Model(shell) as model:
        found = model.patches_near([item.shape for item in prepared], distance, most, poses)
    if not found:
        raise Refused(f"no vertex that moves is within {distance:.3g} of a collider in this frame")
    return found


class SHELLWARP_OT_find_patches(ShellOperator, bpy.types.Operator):
    """Take vertices that rest near the colliders, where these are now, into the group of contact patches"""

    bl_idname = "shellwarp.find_patches"
    bl_label = "Find patches near colliders"

    distance: bpy.props.FloatProperty(name="Distance", default=0.1, min=0, subtype="DISTANCE", description="How far from a collider such vertices are at most")
    most: bpy.props.IntProperty(name="Most", default=16, min=1, max=128, description="At most so many, spread evenly: each adds a mode")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def run(self, context, obj):
        found = find(obj, context.evaluated_depsgraph_get(), self.distance, self.most)
        name = obj.shellwarp.contact_patches or GROUP
        group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
        group.remove(list(range(len(obj.data.vertices))))
        group.add(found, 1.0, "REPLACE")
        obj.shellwarp.contact_patches = group.name
        self.report({"INFO"}, f"{len(found)} vertices in “{group.name}”")


def register():
    bpy.utils.register_class(SHELLWARP_OT_find_patches)


def unregister():
    bpy.utils.unregister_class(SHELLWARP_OT_find_patches)
