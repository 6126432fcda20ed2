"""What an object's mesh has: points, triangles, groups; and how the add-on refuses what cannot be."""

import numpy

SCALE_TOLERANCE = 1e-4  # of the scale: matrices are float32, and the library takes rotations good to 1e-4


class Refused(Exception):
    """The scene asks for what cannot be; the text tells the user what to do."""


def check_mesh(obj):
    """Raises Refused where the vertices of an object's mesh cannot be moved."""
    if obj.type != "MESH":
        raise Refused("only meshes can be shells")
    if obj.mode == "EDIT":
        raise Refused("leave edit mode first")
    if obj.library is not None:
        raise Refused("it is linked from another file: make a library override of it")
    if writable(obj) and obj.data.users > 1:
        raise Refused("the mesh is shared by several objects: make it single-user")


def writable(obj):
    """Whether an object's mesh is this file's own; one that is linked is only read."""
    return obj.data.library is None and obj.data.override_library is None


def rest_positions(mesh):
    """The basis shape, object coordinates (n x 3) float32."""
    out = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    points = mesh.shape_keys.reference_key.data if mesh.shape_keys else mesh.vertices
    points.foreach_get("co", out.ravel())
    return out


def key_positions(mesh, name):
    """A shape key's shape, object coordinates (n x 3) float32."""
    key = mesh.shape_keys.key_blocks.get(name) if mesh.shape_keys else None
    if key is None:
        raise Refused(f"there is no shape key “{name}”")
    out = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    key.data.foreach_get("co", out.ravel())
    return out


def edge_numbers(mesh, name, plain):
    """An edge attribute's numbers, all `plain` where none is named."""
    out = numpy.full(len(mesh.edges), plain, numpy.float32)
    if not name:
        return out
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain != "EDGE" or attribute.data_type != "FLOAT":
        raise Refused(f"there is no attribute “{name}” of a number an edge")
    attribute.data.foreach_get("value", out)
    return out


def edge_marks(mesh, name):
    """Which edges a boolean edge attribute marks, none where none is named."""
    out = numpy.zeros(len(mesh.edges), bool)
    if not name:
        return out
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain != "EDGE" or attribute.data_type != "BOOLEAN":
        raise Refused(f"there is no attribute “{name}” of yes or no an edge")
    attribute.data.foreach_get("value", out)
    return out


def creases(mesh, factors, angles, yields="", flat=""):
    """Edges of another stiffness than the shell's, of a rest angle that is not 0 or that rest flat, or that yield: (a, b, factor[, angle[, yield]])."""
    flat = edge_marks(mesh, flat)
    factors, angles, yields = edge_numbers(mesh, factors, 1.0), edge_numbers(mesh, angles, 0.0), edge_numbers(mesh, yields, 0.0)
    ends = numpy.empty((len(mesh.edges), 2), numpy.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    found = numpy.flatnonzero((factors != 1) | (angles != 0) | (yields != 0) | flat)

    def more(e):
        angle = 0.0 if flat[e] else float(angles[e]) if angles[e] != 0 else None
        if yields[e] != 0:
            return angle, float(yields[e])
        return () if angle is None else (angle,)

    return [(int(ends[e, 0]), int(ends[e, 1]), float(factors[e]), *more(e)) for e in found]


def triangles(mesh):
    """Blender's own triangulation (n x 3)."""
    mesh.calc_loop_triangles()
    out = numpy.empty((len(mesh.loop_triangles), 3), numpy.int32)
    mesh.loop_triangles.foreach_get("vertices", out.ravel())
    return out


def faces_of(mesh):
    """The faces as bytes: which vertices each has. Unlike triangles, they do not depend on where the vertices are."""
    corners, starts = numpy.empty(len(mesh.loops), numpy.int32), numpy.empty(len(mesh.polygons), numpy.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    return corners.tobytes() + starts.tobytes()


def loose_edges(mesh):
    """The ends of edges without faces (n x 2)."""
    ends, used = numpy.empty((len(mesh.edges), 2), numpy.int32), numpy.empty(len(mesh.loops), numpy.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    mesh.loops.foreach_get("edge_index", used)
    return ends[numpy.bincount(used, minlength=len(ends)) == 0]


def uv_directions(mesh, name, positions, package):
    """The direction in which u of a UV map grows on each triangle (n x 3)."""
    layer = mesh.uv_layers.get(name)
    if layer is None:
        raise Refused(f"there is no UV map “{name}”")
    uvs, corners = numpy.empty((len(mesh.loops), 2), numpy.float32), triangles(mesh)
    layer.uv.foreach_get("vector", uvs.ravel())
    loops = numpy.empty((len(mesh.loop_triangles), 3), numpy.int32)
    mesh.loop_triangles.foreach_get("loops", loops.ravel())
    return package.directions_of_uvs(positions, corners, uvs[loops].astype(numpy.float64))


def group_vertices(obj, name):
    """Vertices of a group with weights above a half; none when no group is named."""
    if not name:
        return []
    group = obj.vertex_groups.get(name)
    if group is None:
        raise Refused(f"there is no vertex group “{name}”")
    index = group.index
    found = [v.index for v in obj.data.vertices if any(g.group == index and g.weight > 0.5 for g in v.groups)]
    if not found:
        raise Refused(f"no vertex has more than half a weight in “{name}”")
    return found


DISABLED = "it is disabled here, so that nobody knows where it is: hide it by the eye, or from rays, or bake"


def present(obj, depsgraph):
    """Whether an object is where the depsgraph says. One that is disabled may be there too, at the place of an earlier frame."""
    if not obj.evaluated_get(depsgraph).is_evaluated:
        return False
    hidden = "hide_render" if depsgraph.mode == "RENDER" else "hide_viewport"
    return not getattr(obj, hidden) and any(item in obj.users_collection for item in enabled(depsgraph.view_layer.layer_collection, hidden))


def enabled(layer, hidden):
    """The collections of a view layer that are neither excluded nor disabled."""
    if getattr(layer.collection, hidden):
        return
    if not layer.exclude:
        yield layer.collection
    for child in layer.children:
        yield from enabled(child, hidden)


def evaluated(obj, depsgraph):
    """World matrix at the present frame, animation and constraints included."""
    if not present(obj, depsgraph):
        raise Refused(DISABLED)
    return obj.evaluated_get(depsgraph).matrix_world


def weights(obj, name, or_zero=False, outside=1.0):
    """A group's weight of each vertex, `outside` of those that are not in it; refused where one is 0, unless it may be."""
    group = obj.vertex_groups.get(name)
    if group is None:
        raise Refused(f"there is no vertex group “{name}”")
    out = numpy.full(len(obj.data.vertices), outside)
    for vertex in obj.data.vertices:
        for item in vertex.groups:
            if item.group == group.index:
                out[vertex.index] = item.weight
    empty = numpy.flatnonzero(out == 0)
    if len(empty) and not or_zero:
        raise Refused(f"the weight of vertex {empty[0]} in “{name}” is 0, and {len(empty)} are: a material there would be none")
    return out
