"""Makes the library's material of an object's settings: the paper's constants, or a sheet in SI units with maps.

A sheet's numbers are in metres, kilograms and seconds whatever a Blender unit is: the scene's unit scale converts them.
"""

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
    """The Material or Sheet in Blender units, kilograms and seconds. By look it is of the right thickness, and not yet as stiff as it is to be."""
    if settings.material in ("FREQUENCY", "SAG"):
        return package.look.sheet_of(rest, triangles, settings.density, settings.thickness / metres(scene))
    if settings.material == "CONSTANTS":
        if not (settings.k_area or settings.k_length or settings.k_bend):
            raise Refused("bending, stretch and area are all 0, so that nothing resists anything: set one")
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


def group_names(settings):
    """The vertex groups that multiply the present material, by what they multiply."""
    if settings.material == "CONSTANTS":
        names = {"area_density": settings.density_group, "k_bend": settings.bend_group,
                 "k_length": settings.stretch_group, "k_area": settings.stretch_group}
    elif not is_real(settings):  # the look sets the stiffnesses
        names = {"area_density": settings.density_group}
    else:
        names = {constant: getattr(settings, group) for group, constant in MAPS.items()}
    if settings.growth:
        names["growth"] = settings.growth_group
    return {constant: name for constant, name in names.items() if name}


def read_maps(obj, material):
    """The library's maps: the uniform constant times the weight. Vertices that are not in a group keep the constant."""
    maps = {}
    settings = obj.shellwarp
    if settings.growth:
        grown = weights(obj, settings.growth_group, or_zero=True, outside=0.0) if settings.growth_group else numpy.ones(len(obj.data.vertices))
        maps["growth"] = 1 + settings.growth * grown
    for constant, name in group_names(settings).items():
        if constant == "growth":
            continue
        maps[constant] = getattr(material, CONSTANTS.get(constant, constant)) * weights(obj, name)
    return maps
