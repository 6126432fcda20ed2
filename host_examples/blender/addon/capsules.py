"""Capsules on the bones of a body: shells touch them in its place, for a tenth of the time that a deforming mesh takes."""

import bpy
import numpy
from mathutils import Matrix

from . import library
from .meshes import Refused, group_vertices, rest_positions

LEAST = 4        # vertices of a bone, below which it gets none
ROUND, RINGS = 12, 4  # points around a capsule that is drawn, and rings of each of its ends
SPHERE = 1e-3    # of the radius: what is no longer is a ball


def make(context, body):
    """The colliders of a body that an armature moves, one a bone that has vertices; they go along with the bones."""
    rig = rig_of(body)
    fitted = {bone: fit(body, bone.name) for bone in rig.data.bones if bone.name in body.vertex_groups}
    fitted = {bone: found for bone, found in fitted.items() if found is not None}
    if not fitted:
        raise Refused(f"no bone of “{rig.name}” has {LEAST} vertices with more than half a weight")
    there = bpy.data.collections.new(f"{body.name} capsules")
    context.scene.collection.children.link(there)
    made = [place(body, rig, bone, found, there) for bone, found in fitted.items()]
    body.shellwarp_collider.enabled = False  # they stand for it
    return made


def rig_of(body):
    """The armature that moves a body."""
    rig = next((item.object for item in body.modifiers if item.type == "ARMATURE" and item.object is not None), None)
    if rig is None:
        raise Refused("it has no Armature modifier with an armature")
    return rig


def fit(body, name):
    """The library's capsule about a bone's vertices, in the body's axes; None of too few."""
    try:
        vertices = group_vertices(body, name)
    except Refused:
        return None
    if len(vertices) < LEAST:
        return None
    return library.package().Collider.fit_capsule(rest_positions(body.data)[vertices].astype(numpy.float64))


def place(body, rig, bone, fitted, there):
    """A capsule's object on its bone."""
    obj = bpy.data.objects.new(f"{body.name} {bone.name}", drawn(fitted["radius"], fitted["half_length"]))
    there.objects.link(obj)
    own = Matrix(numpy.reshape(fitted["rotation"], (3, 3)).tolist()).to_4x4()
    own.translation = fitted["origin"]
    obj.parent, obj.parent_type, obj.parent_bone = rig, "BONE", bone.name
    obj.matrix_parent_inverse = (bone.matrix_local @ Matrix.Translation((0, bone.length, 0))).inverted()
    obj.matrix_basis = rig.matrix_world.inverted() @ body.matrix_world @ own
    obj.display_type = "WIRE"
    for ray in ("camera", "shadow", "diffuse", "glossy", "transmission", "volume_scatter"):
        setattr(obj, f"visible_{ray}", False)
    role, body_role = obj.shellwarp_collider, body.shellwarp_collider
    role.enabled, role.friction, role.thickness = True, body_role.friction, body_role.thickness
    role.shape = "CAPSULE" if fitted["half_length"] > SPHERE * fitted["radius"] else "SPHERE"
    return obj


def drawn(radius, half_length):
    """A mesh of a capsule along z."""
    polar = numpy.linspace(0, numpy.pi / 2, RINGS + 1)
    rings = [(radius * numpy.sin(a), half_length + radius * numpy.cos(a)) for a in polar]
    rings += [(r, -z) for r, z in reversed(rings)]
    around = 2 * numpy.pi * numpy.arange(ROUND) / ROUND
    points = [(r * numpy.cos(a), r * numpy.sin(a), z) for r, z in rings for a in around]
    quads = [(k * ROUND + i, (k + 1) * ROUND + i, (k + 1) * ROUND + (i + 1) % ROUND, k * ROUND + (i + 1) % ROUND)
             for k in range(len(rings) - 1) for i in range(ROUND)]
    mesh = bpy.data.meshes.new("capsule")
    mesh.from_pydata(points, [], quads)
    return mesh


class SHELLWARP_OT_fit_capsules(bpy.types.Operator):
    """Make capsules about the vertices of each bone, which go along with it: shells touch them in place of this mesh"""

    bl_idname = "shellwarp.fit_capsules"
    bl_label = "Capsules on bones"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH"

    def execute(self, context):
        try:
            made = make(context, context.object)
        except Exception as error:
            self.report({"ERROR"}, str(error) or type(error).__name__)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(made)} capsules in “{made[0].users_collection[0].name}”")
        return {"FINISHED"}


def register():
    bpy.utils.register_class(SHELLWARP_OT_fit_capsules)


def unregister():
    bpy.utils.unregister_class(SHELLWARP_OT_fit_capsules)
