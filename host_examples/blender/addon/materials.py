"""Makes the library's material of an object's settings: the paper's constants, or a sheet in SI units with maps.

A sheet's numbers are in metres, kilograms and seconds whatever a Blender unit is: the scene's unit scale converts them.
"""

import math
from dataclasses import replace

import numpy

from .meshes import Refused, uv_directions, weights

CONSTANTS = {"area_density": "density", "k_bend": "bend", "k_length": "length", "k_area": "area"}  # of maps: what a Material calls them
MAPS = {"thickness_group": "thickness", "young_group": "young", "density_group": "volume_density"}  # groups of a sheet


def is_real(settings):
    """Whether the material is a sheet in SI units."""
    return settings.material in ("PRESET", "SHEET")


def metres(scene):
    """Metres in a Blender unit."""
    units = scene.unit_settings
    return units.scale_length if units.system != "NONE" else 1.0


def read_material(settings, scene, package, rest, triangles):
    """The Material or Sheet in Blender units, kilograms and seconds. By frequency it is of the right thickness, and not yet as stiff as it is to be."""
    if settings.material == "FREQUENCY":
        return of_thickness(settings.thickness / metres(scene), settings.density, package, rest, triangles)
    if settings.material == "CONSTANTS":
        return package.Material(settings.k_area, settings.k_length, settings.k_bend, settings.density)
    unit = metres(scene)
    grain = {"young_across": settings.young_across * unit, "shear": settings.shear * unit}
    if settings.shear and not settings.young_across:
        raise Refused("a shear modulus goes with Young's modulus across")
    if settings.material == "PRESET":
        known = replace(package.Sheet.known(settings.preset, unit), **grain)
        return replace(known, thickness=settings.thickness / unit) if settings.thickness > 0 else known
    if not settings.thickness > 0:
        raise Refused("the thickness of a sheet is 0: set it, in metres")
    return package.Sheet(settings.young * unit, settings.poisson, settings.thickness / unit, settings.volume_density * unit ** 3, **grain)


def read_directions(obj, rest, package):
    """Along which a sheet has Young's modulus: a direction a triangle by a UV map, one for all, or None without a modulus across."""
    settings = obj.shellwarp
    if not is_real(settings) or not settings.young_across:
        return None
    if settings.directions:
        return uv_directions(obj.data, settings.directions, rest, package)
    if not any(settings.direction):
        raise Refused("the direction of Young's modulus is zero")
    return numpy.array([settings.direction], numpy.float64)


def of_thickness(thickness, density, package, rest, triangles):
    """A sheet of E h = 1 on a mesh whose mean edge is l: k_length = √3 l E h / 4, k_area = E h / 2, k_bend = E h³ / 72 (1 - 1/9)."""
    corners = rest[triangles]
    edge = float(numpy.linalg.norm(corners - numpy.roll(corners, 1, axis=1), axis=2).mean())
    h = thickness or float(numpy.linalg.norm(numpy.ptp(rest, axis=0))) / 200
    return package.Material(0.5, math.sqrt(3) / 4 * edge, h * h / 72 * (1 - 1 / 9), density)


def swing_at(shell, frequency, modes, package, progress=None):
    """The shell with stiffnesses by which its slowest swing has a frequency: they go with its square."""
    with package.Model(shell) as model:
        model.precompute(modes=modes, progress=progress)
        slowest = next((hertz for hertz in model.frequencies() if hertz > 0), None)
    if slowest is None:
        raise Refused("none of the modes swings, so there is no frequency to set: more modes, or hold more vertices")
    factor, material = (frequency / slowest) ** 2, shell.material
    return replace(shell, material=replace(material, area=factor * material.area, length=factor * material.length, bend=factor * material.bend))


def group_names(settings):
    """The vertex groups that multiply the present material, by what they multiply."""
    if settings.material == "CONSTANTS":
        names = {"area_density": settings.density_group, "k_bend": settings.bend_group,
                 "k_length": settings.stretch_group, "k_area": settings.stretch_group}
    elif not is_real(settings):  # a frequency sets the stiffnesses
        names = {"area_density": settings.density_group}
    else:
        names = {constant: getattr(settings, group) for group, constant in MAPS.items()}
    return {constant: name for constant, name in names.items() if name}


def read_maps(obj, material):
    """The library's maps: the uniform constant times the weight. Vertices that are not in a group keep the constant."""
    maps = {}
    for constant, name in group_names(obj.shellwarp).items():
        maps[constant] = getattr(material, CONSTANTS.get(constant, constant)) * weights(obj, name)
    return maps
