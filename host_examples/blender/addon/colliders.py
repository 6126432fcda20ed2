"""Reads the objects that a shell touches: once their shape, every frame their place.

A collider is an object with the role of shellwarp, or with Blender's Collision modifier, from which friction and distance
are read then. An open mesh is solid behind its faces, by a depth. Its scale is in its shape, so scale must be constant; its place and turn may move. Of a deforming mesh the
vertices are read every frame.
"""

import hashlib
from dataclasses import dataclass

import numpy

from . import stack
from .meshes import DISABLED, SCALE_TOLERANCE, Refused, evaluated, faces_of, present, rest_positions, triangles

FLAT = 1e-5    # of the longest side: what is thinner is taken for a plane
DEEP = 0.125   # of the longest side: the most that the Collision modifier makes an open mesh solid behind its faces
MOVERS = stack.CARRIERS | {"MESH_CACHE", "WAVE"}  # modifiers that may deform a mesh from frame to frame
COULOMB = 0.01  # Blender's cloth multiplies its friction of 0 to 80 by this


@dataclass(frozen=True)
class Solid:
    """A collider at one time. Its shape is known by a digest, so that equal inputs mean equal contact."""

    name: str
    digest: bytes
    origin: tuple      # (3), of the shape's axes in the world
    rotation: tuple    # (9) row-major
    points: bytes = b""  # of a deforming mesh its vertices (n x 3) in these axes, float32


@dataclass(frozen=True)
class Prepared:
    """A collider whose shape is made: what all frames of a run share."""

    name: str
    digest: bytes
    shape: object          # the library's Collider
    stretch: numpy.ndarray  # (3 x 3), the scale that is in the shape
    middle: numpy.ndarray   # (3), of the shape, in the object's turned axes
    faces: bytes = b""      # of a deforming mesh, which keeps them


def objects(obj, depsgraph):
    """The colliders of a shell by name: of its collection, else of the scene, without itself and what the view layer excludes."""
    chosen, there = obj.shellwarp.collision_collection, set(depsgraph.view_layer.objects)
    found = chosen.all_objects if chosen else there
    return sorted((item for item in found if item != obj and item in there and is_collider(item)), key=lambda item: item.name_full)


def is_collider(item):
    return item.shellwarp_collider.enabled or modifier(item) is not None


def modifier(item):
    """Settings of Blender's Collision modifier, None without one that acts."""
    acts = any(m.type == "COLLISION" and m.show_viewport for m in item.modifiers)
    return item.collision if acts and item.collision is not None and item.collision.use else None


def surface(item):
    """Friction and thickness: of the Collision modifier where there is one, else of the role."""
    theirs = modifier(item)
    if theirs is not None:
        return COULOMB * theirs.cloth_friction, theirs.thickness_outer
    return item.shellwarp_collider.friction, item.shellwarp_collider.thickness


def depth(item, points):
    """How far an open mesh is solid behind its faces, 0 for the library's default: the role's, or the Collision modifier's inner thickness.

    The latter is 20 cm unless set, however small the object: an eighth of its longest side at most."""
    theirs = modifier(item)
    return item.shellwarp_collider.depth if theirs is None else min(theirs.thickness_inner, DEEP * float(numpy.ptp(points, axis=0).max()))


def is_open(mesh):
    """Whether a mesh has edges with one face, so that it has no inside."""
    return len(mesh.loops) != 2 * len(mesh.edges)


def is_sheet(item, depsgraph):
    """Whether a collider is an open mesh that is solid behind its faces."""
    if item.type != "MESH" or not is_open(seen(item, depsgraph)):
        return False
    return kind_of(item, points_of(item, seen(item, depsgraph))) in ("MESH", "DEFORMING")


def prepare(obj, depsgraph, package, before=()):
    """All colliders of a shell, those of `before` taken over where nothing changed. Refused names the object."""
    known = {item.digest: item for item in before}
    return tuple(named(item, depsgraph, lambda item=item: prepared(item, depsgraph, package, known)) for item in objects(obj, depsgraph))


def named(item, depsgraph, work):
    """Does the work; what it refuses begins with the object's name."""
    try:
        if not present(item, depsgraph):
            raise Refused(DISABLED)
        return work()
    except Exception as error:
        raise Refused(f"collider “{item.name}”: {error}") from error


def prepared(item, depsgraph, package, known):
    rotation, stretch = split(evaluated(item, depsgraph))
    points, faces = mesh_of(item, depsgraph)
    points = points @ stretch.T
    settings, kind = item.shellwarp_collider, kind_of(item, points)
    friction, thickness = surface(item)
    sheet = {"one_sided": True, "depth": depth(item, points)} if kind in ("MESH", "DEFORMING") and is_open(seen(item, depsgraph)) else {}
    deforms = faces_of(seen(item, depsgraph)) if kind == "DEFORMING" else b""
    key = hashlib.blake2b(deforms or points.astype(numpy.float32).tobytes() + faces.tobytes())
    key.update(repr((item.name_full, kind, friction, thickness, settings.cells, len(points), sheet)).encode())
    if kind not in ("HULL", "MESH", "DEFORMING"):
        check_diagonal(stretch)
    digest = key.digest()
    if digest in known:
        return known[digest]
    shape, middle = make(package.Collider, kind, points, faces, settings.cells, friction, thickness, numpy.linalg.det(stretch) < 0, sheet)
    return Prepared(item.name_full, digest, shape, stretch, middle, deforms)


def kind_of(item, points):
    """The chosen shape; “by its mesh” is a plane where the mesh is flat across z, else the mesh, deforming where something deforms it."""
    kind = item.shellwarp_collider.shape
    if kind != "AUTO":
        if not len(points) and kind != "PLANE":
            raise Refused("it has no mesh: only a plane needs none")
        return kind
    if not len(points):
        return "PLANE"
    sides = numpy.ptp(points, axis=0)
    if sides[2] <= FLAT * sides.max():
        return "PLANE"
    return "DEFORMING" if deforms(item) else "MESH"


def deforms(item):
    """Whether an armature, hook or the like, or keys of shape keys deform an object that is no shell."""
    if item.type != "MESH" or item.shellwarp.enabled:
        return False
    keys = item.data.shape_keys
    return any(m.type in MOVERS and m.show_viewport for m in item.modifiers) or bool(keys and keys.animation_data and
                                                                                     (keys.animation_data.action or keys.animation_data.drivers))


def make(kinds, kind, points, faces, cells, friction, thickness, mirrored, sheet):
    """The library's collider, and where its middle is; `sheet` has the one-sidedness and depth of an open mesh."""
    common, nowhere = {"friction": friction, "thickness": thickness}, numpy.zeros(3)
    if kind == "HULL":
        return kinds.hull(points, **common), nowhere
    faces = faces[:, ::-1] if mirrored else faces
    if kind == "MESH":
        return kinds.mesh(points, faces, cells=cells, **common, **sheet), nowhere
    if kind == "DEFORMING":
        return kinds.deforming(points, faces, **common, **sheet), nowhere
    if kind == "PLANE":
        return kinds.plane(**common), (points.mean(axis=0) if len(points) else nowhere)
    low, high = points.min(axis=0), points.max(axis=0)
    half, middle = (high - low) / 2, (low + high) / 2
    if kind == "BOX":
        return kinds.box(half, **common), middle
    if kind == "SPHERE":
        return kinds.sphere(float(half.max()), **common), middle
    radius = float(half[:2].max())
    if half[2] <= radius:
        raise Refused("a capsule lies along the object's z axis, and this one is not longer along it than across: take a sphere")
    return kinds.capsule(float(half[2]) - radius, radius, **common), middle


def mesh_of(item, depsgraph):
    """Points and triangles of what is seen of an object, in its own axes; none of an empty. A shell gives its rest shape."""
    if item.type != "MESH":
        return numpy.empty((0, 3)), numpy.empty((0, 3), numpy.int32)
    mesh = seen(item, depsgraph)
    return points_of(item, mesh), triangles(mesh)


def seen(item, depsgraph):
    """The mesh that shells touch: with its modifiers; a shell's own as it rests."""
    if item.type != "MESH":
        raise Refused("it is no mesh")
    return item.data if item.shellwarp.enabled else item.evaluated_get(depsgraph).data


def points_of(item, mesh):
    """Its vertices (n x 3) float64, in the object's own axes."""
    if item.shellwarp.enabled:
        return rest_positions(mesh).astype(numpy.float64)
    points = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    return points.astype(numpy.float64)


def split(matrix):
    """Rotation (3 x 3) and the stretch before it of a world matrix; the stretch is negative where the matrix mirrors."""
    linear = numpy.array(matrix, dtype=numpy.float64)[:3, :3]
    left, sizes, right = numpy.linalg.svd(linear)
    if not sizes[2] > 1e-9 * sizes[0]:
        raise Refused("its scale is zero along an axis")
    rotation = left @ right
    rotation *= numpy.sign(numpy.linalg.det(rotation))
    return rotation, rotation.T @ linear


def check_diagonal(stretch):
    size = numpy.abs(stretch).max()
    if numpy.abs(stretch - numpy.diag(numpy.diag(stretch))).max() > SCALE_TOLERANCE * size or numpy.diag(stretch).min() <= 0:
        raise Refused("it is sheared or mirrored: apply its scale (Ctrl+A, Scale), or take a hull or a mesh")


def read_solids(obj, depsgraph, ready):
    """Where the colliders are at the depsgraph's frame. Refused where others collide, or otherwise, than were prepared."""
    found = objects(obj, depsgraph)
    if [item.name_full for item in found] != [item.name for item in ready]:
        raise Refused("the colliders are others than at the start frame: go there")
    return tuple(named(item, depsgraph, lambda item=item, made=made: place(item, depsgraph, made)) for item, made in zip(found, ready))


def place(item, depsgraph, made):
    matrix = evaluated(item, depsgraph)
    rotation, stretch = split(matrix)
    points = b""
    if made.faces:
        mesh = seen(item, depsgraph)
        if faces_of(mesh) != made.faces:
            raise Refused("its faces change: of a deforming mesh only the vertices may move")
        points = (points_of(item, mesh) @ stretch.T).astype(numpy.float32).tobytes()
    elif numpy.abs(stretch - made.stretch).max() > SCALE_TOLERANCE * numpy.abs(made.stretch).max():
        raise Refused("its scale changes: only its place and turn may move")
    origin = numpy.array(matrix.translation, dtype=numpy.float64) + rotation @ made.middle
    return Solid(made.name, made.digest, tuple(origin.tolist()), tuple(rotation.ravel().tolist()), points)
