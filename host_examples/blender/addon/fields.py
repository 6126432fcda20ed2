"""Blender's force fields as shells feel them: wind is air that moves, all others push at every part of the surface.

What acts is read once a frame as plain data; where the vertices are then, strengths follow from Blender's own falloffs.
"""

from dataclasses import dataclass

import numpy
from mathutils import noise

from . import materials
from .meshes import present

KINDS = ("WIND", "FORCE", "VORTEX", "HARMONIC", "TURBULENCE")
OCTAVES = 3  # of a turbulence, as Blender has it
AIR = 1.2  # kg/m³, where a wind field blows and no density is set


@dataclass(frozen=True)
class Field:
    """A force field at one time."""

    kind: str
    shape: str           # POINT, LINE or PLANE: where the distance is counted from
    origin: tuple        # (3), in the world
    axis: tuple          # (3), unit length
    strength: float      # of wind a speed, else a force per area
    falloff: str         # SPHERE, TUBE or CONE
    side: str            # BOTH, POSITIVE or NEGATIVE: of the plane through the origin across the axis
    gravitation: bool    # by the square of the distance as well
    along: tuple         # power, least and largest distance, which are None where there is none
    across: tuple        # the same of a tube's radius, of a cone's angle in degrees
    rest: float = 0.0    # of a harmonic field: the distance where it does not push
    size: float = 0.0    # of a turbulence: the length of its eddies, 0 as 1
    in_world: bool = False   # a turbulence that does not go along with its object


def acts(item):
    """Whether shells feel an object's field."""
    field = item.field
    return field is not None and field.type in KINDS and field.shape in ("POINT", "LINE", "PLANE") and field.apply_to_location


def objects(obj, depsgraph):
    """The objects of the view layer that have a field, by name."""
    found = (item for item in depsgraph.view_layer.objects if item != obj and item.field is not None and item.field.type != "NONE")
    return sorted((item for item in found if present(item, depsgraph)), key=lambda item: item.name_full)


def unfelt(obj, view_layer):
    """Names of objects whose fields do not act on shells."""
    there = [item for item in view_layer.objects if item != obj and item.field is not None and item.field.type != "NONE"]
    return [item.name for item in there if not acts(item) and item.visible_get(view_layer=view_layer)]


def read(obj, scene, depsgraph, share):
    """The fields that act on a shell at the depsgraph's frame, their strengths times `share`."""
    if not share:
        return ()
    return tuple(read_one(item.evaluated_get(depsgraph), materials.metres(scene), share) for item in objects(obj, depsgraph) if acts(item))


def read_one(item, metres, share):
    field, matrix = item.field, item.matrix_world
    strength = share * field.strength * (1 / metres if field.type == "WIND" else metres)  # m/s and Pa in Blender units
    return Field(
        field.type, field.shape, tuple(matrix.translation), tuple(matrix.to_3x3().col[2].normalized()), strength,
        field.falloff_type, field.z_direction, field.type == "FORCE" and field.use_gravity_falloff,
        (field.falloff_power, field.distance_min if field.use_min_distance else None, field.distance_max if field.use_max_distance else None),
        (field.radial_falloff, field.radial_min if field.use_radial_min else None, field.radial_max if field.use_radial_max else None),
        field.rest_length, field.size, field.use_global_coords)


def at(fields, points):
    """Velocity of the air and force per area (n x 3 each) at points in the world."""
    air, push = numpy.zeros_like(points), numpy.zeros_like(points)
    for field in fields:
        axis, way = numpy.array(field.axis), points - numpy.array(field.origin)
        height = way @ axis
        radius = numpy.linalg.norm(way - height[:, None] * axis, axis=1)
        start = {"LINE": way - height[:, None] * axis, "PLANE": height[:, None] * axis}.get(field.shape, way)
        distance = numpy.linalg.norm(start, axis=1)
        size = field.strength * share(field, distance, height, radius)
        if field.kind == "WIND":
            air += size[:, None] * axis
            continue
        away = numpy.divide(start, distance[:, None], out=numpy.zeros_like(start), where=distance[:, None] > 0)
        if field.kind == "VORTEX":
            push += size[:, None] * numpy.cross(axis, way)
        elif field.kind == "HARMONIC":   # a spring to where the distance is counted from
            push -= (size * (distance - field.rest))[:, None] * away
        elif field.kind == "TURBULENCE":
            push += size[:, None] * eddies((points if field.in_world else way + axis) / (field.size or 1.0))
        else:
            if field.gravitation:
                size = numpy.divide(size, distance ** 2, out=numpy.zeros_like(size), where=distance > 0)
            push += size[:, None] * away
    return air, push


def eddies(places):
    """Blender's turbulence at places in units of its size (n x 3): three octaves of its noise for each component, the corners in turn."""
    def summed(place):
        return sum(0.5 ** k * noise.noise(place * 2.0 ** k, noise_basis="PERLIN_NEW") for k in range(OCTAVES))

    whole = sum(0.5 ** k for k in range(OCTAVES))
    return numpy.array([[summed(numpy.roll(place, -k)) for k in range(3)] for place in places]).reshape(-1, 3) / whole


def share(field, distance, height, radius):
    """How much of a field's strength is left at each point."""
    if field.falloff == "SPHERE":
        left = fall(distance, *field.along)
    elif field.falloff == "TUBE":
        left = fall(numpy.abs(height), *field.along) * fall(radius, *field.across)
    else:
        left = fall(numpy.abs(height), *field.along) * fall(numpy.degrees(numpy.arctan2(radius, numpy.abs(height))), *field.across)
    if field.side != "BOTH":
        left = numpy.where((height < 0) if field.side == "POSITIVE" else (height > 0), 0.0, left)
    return left


def fall(distance, power, least, largest):
    """Blender's falloff: whole up to the least distance, nothing beyond the largest."""
    left = (1.0 + numpy.maximum(distance - (least or 0.0), 0.0)) ** -power
    return left if largest is None else numpy.where(distance > largest, 0.0, left)
