"""What is below a shell in its object's stack, and the modifier that shows the shell there.

Below are shape keys and the modifiers before the shell's own. A modifier of geometry nodes keeps where they lead the vertices
as an attribute, which whoever steps the shell reads, and puts the vertices where a helper mesh has them. The shell's own mesh
is only read.

A linked mesh cannot be written to: there the modifier shows shells that nothing below leads, and meshes that follow.
"""

from itertools import takewhile

import bpy
import numpy

from .meshes import Refused, writable
from .shape_key import SHAPE_KEY

LIVE, CACHE = "shellwarp live", "shellwarp cache"  # names of modifiers: of a shell that moves live, and of a baked one
GROUP, BELOW, NUMBER = "shellwarp live", "shellwarp below", "shellwarp number"  # of the node group, and attributes that it leaves

# Modifiers that lead vertices from elsewhere, and those that keep all vertices.
CARRIERS = {"ARMATURE", "HOOK", "LATTICE", "MESH_DEFORM", "SURFACE_DEFORM", "CURVE", "MESH_SEQUENCE_CACHE"}
DEFORMERS = CARRIERS | {"CAST", "CORRECTIVE_SMOOTH", "DISPLACE", "LAPLACIANDEFORM", "LAPLACIANSMOOTH", "MESH_CACHE", "SHRINKWRAP", "SIMPLE_DEFORM",
                        "SMOOTH", "WARP", "WAVE"}


def slot(obj):
    """How many modifiers are below the shell: those before its own; without one, up to the last that carries, of the first that
    keep all vertices."""
    if not obj.shellwarp.follow:
        return 0
    for i, item in enumerate(obj.modifiers):
        if item.name in (LIVE, CACHE):
            return i
    first = list(takewhile(lambda item: item.type in DEFORMERS, obj.modifiers))
    return max((i + 1 for i, item in enumerate(first) if item.type in CARRIERS), default=0)


def keys(obj):
    """The shape keys that a user made to lead; that of the rest shape leads nothing."""
    found, others = obj.data.shape_keys, {SHAPE_KEY, obj.shellwarp.rest_shape}
    return [key for key in found.key_blocks if key != found.reference_key and key.name not in others] if found else []


def leads(obj):
    """Whether something below leads pins."""
    settings = obj.shellwarp
    return settings.enabled and settings.follow and bool(settings.fixed_group or settings.clamped_group) and (slot(obj) > 0 or bool(keys(obj)))


def shows(obj):
    """Whether the shell is shown by its modifier: something is below it, or its mesh is linked and not to be written to."""
    return leads(obj) or not writable(obj)


def named(obj):
    """What leads the pins, in words; "" for nothing."""
    if not leads(obj):
        return ""
    return ", ".join([item.name for item in list(obj.modifiers)[:slot(obj)]] + (["shape keys"] if keys(obj) else []))


def out_of_reach(obj):
    """The first modifier that carries and comes after one that changes the vertices, None for none."""
    if not obj.shellwarp.follow:
        return None
    rest = list(obj.modifiers)[slot(obj):]
    changed = next((i for i, item in enumerate(rest) if item.type not in DEFORMERS and item.name not in (LIVE, CACHE)), len(rest))
    return next((item for item in rest[changed:] if item.type in CARRIERS), None)


def place(obj):
    """Where in the stack the shell's modifier goes."""
    return slot(obj) if leads(obj) else 0


def attach(obj):
    """Makes sure that the shell's modifier is there, with a helper mesh of its own. True where something has changed."""
    modifier, n = obj.modifiers.get(LIVE), len(obj.data.vertices)
    helper = shape_of(modifier)
    if helper is not None and helper.users == 1 and len(helper.data.vertices) == n:
        return False
    points, number, nodes = bpy.data.meshes.new(f"shellwarp {obj.name}"), place(obj), group()
    points.vertices.add(n)
    detach(obj)
    modifier = obj.modifiers.new(LIVE, "NODES")
    modifier.node_group, modifier.show_expanded = nodes, False
    modifier[socket(nodes)] = bpy.data.objects.new(points.name, points)
    modifier.node_group = nodes  # Blender looks for what a modifier depends on when this is set
    obj.modifiers.move(len(obj.modifiers) - 1, number)
    return True


def detach(obj):
    """Takes the modifier and its helper away."""
    modifier = obj.modifiers.get(LIVE)
    if modifier is not None:
        helper = shape_of(modifier)
        obj.modifiers.remove(modifier)
        remove(helper)


def remove(helper):
    """Removes a helper that nothing uses any more."""
    if helper is not None and helper.users == 0:
        bpy.data.meshes.remove(helper.data)


def shape_of(modifier):
    """The helper of a modifier, None without one."""
    if modifier is None or modifier.node_group is None:
        return None
    return modifier.get(socket(modifier.node_group))


def socket(nodes):
    return next(item.identifier for item in nodes.interface.items_tree if item.name == "Shape")


def read(obj, depsgraph):
    """Where what is below leads the vertices at the depsgraph's frame (n x 3), float32, in the object's coordinates."""
    mesh, n = obj.evaluated_get(depsgraph).data, len(obj.data.vertices)
    where, number = mesh.attributes.get(BELOW), mesh.attributes.get(NUMBER)
    if where is None or number is None:
        raise Refused(f"the modifier “{LIVE}” does not act: switch it on, or go to the start frame")
    points, numbers = numpy.empty((len(mesh.vertices), 3), numpy.float32), numpy.empty(len(mesh.vertices), numpy.int32)
    where.data.foreach_get("vector", points.ravel())
    number.data.foreach_get("value", numbers)
    if len(numbers) < n or not numpy.array_equal(numbers[:n], numpy.arange(n)):
        raise Refused("a modifier changes the order of the vertices, so that pins cannot follow: switch it off, or Pins follow")
    return points[:n]


def write(obj, positions):
    """Shows positions (n x 3), object coordinates."""
    mesh = shape_of(obj.modifiers.get(LIVE)).data
    mesh.vertices.foreach_set("co", numpy.ascontiguousarray(positions, numpy.float32).ravel())
    mesh.update_tag()


def group():
    """The node group of all shells' modifiers."""
    found = bpy.data.node_groups.get(GROUP)
    if found is not None and found.library is None:
        return found
    nodes = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
    nodes.is_modifier = True
    nodes.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    nodes.interface.new_socket("Shape", in_out="INPUT", socket_type="NodeSocketObject")
    nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    def node(kind, **settings):
        made = nodes.nodes.new(kind)
        for name, value in settings.items():
            setattr(made, name, value)
        return made

    def end(sockets, name):  # nodes of older versions keep one of a name for each type of data, and enable one
        return next(item for item in sockets if item.name == name and item.enabled)

    def store(name, kind, geometry, value):
        made = node("GeometryNodeStoreNamedAttribute", data_type=kind, domain="POINT")
        made.inputs["Name"].default_value = name
        nodes.links.new(geometry, made.inputs["Geometry"])
        nodes.links.new(value, end(made.inputs, "Value"))
        return made.outputs["Geometry"]

    given, out = node("NodeGroupInput"), node("NodeGroupOutput")
    position, index = node("GeometryNodeInputPosition").outputs[0], node("GeometryNodeInputIndex").outputs[0]
    kept = store(BELOW, "FLOAT_VECTOR", given.outputs["Geometry"], position)
    kept = store(NUMBER, "INT", kept, index)
    shape, sample = node("GeometryNodeObjectInfo"), node("GeometryNodeSampleIndex", data_type="FLOAT_VECTOR", domain="POINT")
    nodes.links.new(given.outputs["Shape"], shape.inputs["Object"])
    nodes.links.new(shape.outputs["Geometry"], sample.inputs["Geometry"])
    nodes.links.new(position, end(sample.inputs, "Value"))
    nodes.links.new(index, sample.inputs["Index"])
    counts = [node("GeometryNodeAttributeDomainSize", component="MESH") for _ in range(2)]
    nodes.links.new(kept, counts[0].inputs["Geometry"])
    nodes.links.new(shape.outputs["Geometry"], counts[1].inputs["Geometry"])
    same = node("FunctionNodeCompare", data_type="INT", operation="EQUAL")
    for count, name in zip(counts, "AB"):
        nodes.links.new(count.outputs["Point Count"], end(same.inputs, name))
    moved = node("GeometryNodeSetPosition")
    nodes.links.new(kept, moved.inputs["Geometry"])
    nodes.links.new(same.outputs["Result"], moved.inputs["Selection"])
    nodes.links.new(end(sample.outputs, "Value"), moved.inputs["Position"])
    nodes.links.new(moved.outputs["Geometry"], out.inputs["Geometry"])
    return nodes
