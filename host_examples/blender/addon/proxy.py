"""A coarse mesh made of a fine one, and simulated in its place."""

import bpy
import numpy

from . import library, render_mesh
from .meshes import Refused, check_mesh, rest_positions, triangles, weights

HELD = 0.5  # of a weight that comes over


def make(context, asset, vertices, thickness, cut):
    """The object of the proxy, a shell that the asset follows; and what was done, in words."""
    render_mesh_free(asset)
    check_mesh(asset)
    positions, faces = rest_positions(asset.data), triangles(asset.data)
    if not len(faces):
        raise Refused("it has no faces")
    names = pin_groups(asset)
    held = held_of(asset, names)
    with library.package().Proxy(positions, faces, vertices, thickness=thickness, cut=cut, held=held) as made:
        info, points, corners = made.info(), made.positions(), made.triangles()
        groups = {group.name: made.carried(weights(asset, group.name, or_zero=True, outside=0.0)) for group in asset.vertex_groups}
    mesh = bpy.data.meshes.new(f"{asset.data.name} proxy")
    mesh.from_pydata(points.tolist(), [], corners.tolist())
    obj = bpy.data.objects.new(f"{asset.name} proxy", mesh)
    for collection in asset.users_collection:
        collection.objects.link(obj)
    obj.matrix_world = asset.matrix_world
    for name, carried in groups.items():
        add_group(obj, name, carried)
    obj.display_type = "WIRE"
    obj.visible_camera = obj.visible_shadow = False
    obj.shellwarp.enabled = True
    obj.shellwarp.renders.add().target = asset
    settings = obj.shellwarp
    settings.proxy_vertices, settings.proxy_thickness, settings.proxy_cut, settings.proxy_held = vertices, thickness, cut, "\n".join(names)
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    context.view_layer.objects.active = obj
    return obj, words(info)


def held_of(asset, names):
    """Vertices of the asset in groups of these names."""
    groups = [numpy.flatnonzero(weights(asset, name, or_zero=True, outside=0.0) > HELD) for name in names if name in asset.vertex_groups]
    return numpy.unique(numpy.concatenate([numpy.zeros(0, int), *groups]))


def remade(obj, scale):
    """A function that calibrates a model of the object, a proxy, by the mesh that it was made of; None where it was made by hand, or is to be left as it is.

    What it reads of the scene is read now. The function says what came of it, or in words why nothing did."""
    settings = obj.shellwarp
    asset = settings.renders[0].target if len(settings.renders) else None
    if not settings.proxy_vertices or not settings.proxy_calibrated or asset is None or asset.type != "MESH":
        return None
    package, faces = library.package(), triangles(asset.data)
    positions = rest_positions(asset.data).astype(numpy.float64) * scale
    options = {"thickness": settings.proxy_thickness * scale, "cut": settings.proxy_cut, "held": held_of(asset, settings.proxy_held.split("\n"))}
    held, n_vertices, name = held_of(asset, pin_groups(obj)), settings.proxy_vertices, asset.name

    def calibrate(model, shell):
        if not len(held):
            return f"nothing holds “{name}”: its vertex groups of the pins' names are empty"
        with package.Proxy(positions, faces, n_vertices, **options) as made:
            if made.n_vertices != len(shell.positions) or not numpy.array_equal(made.triangles(), shell.triangles):
                return f"it is not the proxy that was made of “{name}” any more"
            try:
                return model.calibrate(made, held)
            except (package.UnsupportedError, package.NumericalError, package.InvalidMeshError) as error:
                return str(error)

    return calibrate


def pin_groups(asset):
    """Groups of the asset that its shell settings, if they are filled in, name as held."""
    settings = asset.shellwarp
    named = {settings.fixed_group, settings.clamped_group, settings.fixed_x_group, settings.fixed_y_group, settings.fixed_z_group}
    return [group.name for group in asset.vertex_groups if group.name in named]


def render_mesh_free(asset):
    """Raises Refused where the object has another part in a simulation."""
    if asset.shellwarp.enabled:
        raise Refused("it is a shell itself: switch that off first")
    owner = render_mesh.owner(asset)
    if owner is not None:
        raise Refused(f"it follows “{owner.name}” already")


def add_group(obj, name, weights):
    """A vertex group with the weights above 0."""
    group = obj.vertex_groups.new(name=name)
    for vertex in numpy.flatnonzero(weights > 1e-6):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def words(info):
    """What was done to the asset."""
    told = [f"{info['n_vertices']} vertices stand for {info['n_asset_vertices']}"]
    if info["n_sides_joined"]:
        told.append(f"two sides {info['thickness']:.3g} apart are one sheet")
    if info["n_left_out"]:
        told.append(f"{info['n_left_out']} small pieces are left out and follow")
    if info["n_cut"]:
        told.append(f"{info['n_cut']} places are cut and may part")
    return "; ".join(told)


class SHELLWARP_OT_make_proxy(bpy.types.Operator):
    """Make a coarse mesh of this one and simulate it; this mesh follows. It may have two sides, thickness, loose faces, n-gons"""

    bl_idname = "shellwarp.make_proxy"
    bl_label = "Simulate a proxy"
    bl_options = {"REGISTER", "UNDO"}

    vertices: bpy.props.IntProperty(name="Vertices", default=1000, min=4, max=4000000, soft_max=20000, description="About so many are simulated")
    thickness: bpy.props.FloatProperty(name="Thickness", default=0.0, min=0.0, subtype="DISTANCE",
                                       description="Two sides no further apart become the sheet in their middle; 0: those of thin sheets are found")
    cut: bpy.props.BoolProperty(name="Cut", default=False, description="Cut the mesh where more than two faces meet at an edge, and strips with one side")

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and not context.object.shellwarp.enabled

    def execute(self, context):
        try:
            _, told = make(context, context.object, self.vertices, self.thickness, self.cut)
        except Exception as error:
            self.report({"ERROR"}, str(error) or type(error).__name__)
            return {"CANCELLED"}
        self.report({"INFO"}, told)
        return {"FINISHED"}


def register():
    bpy.utils.register_class(SHELLWARP_OT_make_proxy)


def unregister():
    bpy.utils.unregister_class(SHELLWARP_OT_make_proxy)
