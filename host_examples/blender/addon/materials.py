"""Makes the library's material of an object's settings: the paper's constants, or a sheet in SI units with maps.

A sheet's numbers are in metres, kilograms and seconds whatever a Blender unit is: the scene's unit scale converts them.
"""

from dataclasses import replace

from .meshes import Refused, weights

MAPS = {"thickness_group": "thickness", "young_group": "young", "density_group": "volume_density"}  # groups of a sheet


def metres(scene):
    """Metres in a Blender unit."""
    units = scene.unit_settings
    return units.scale_length if units.system != "NONE" else 1.0


def read_material(settings, scene, package):
    """The Material or Sheet in Blender units, kilograms and seconds."""
    if settings.material == "CONSTANTS":
        return package.Material(settings.k_area, settings.k_length, settings.k_bend, settings.density)
    unit = metres(scene)
    if settings.material == "PRESET":
        known = package.Sheet.known(settings.preset, unit)
        return replace(known, thickness=settings.thickness / unit) if settings.thickness > 0 else known
    if not settings.thickness > 0:
        raise Refused("the thickness of a sheet is 0: set it, in metres")
    return package.Sheet(settings.young * unit, settings.poisson, settings.thickness / unit, settings.volume_density * unit ** 3)


def group_names(settings):
    """The vertex groups that multiply the present material, by what they multiply."""
    if settings.material == "CONSTANTS":
        names = {"area_density": settings.density_group}
    else:
        names = {constant: getattr(settings, group) for group, constant in MAPS.items()}
    return {constant: name for constant, name in names.items() if name}


def read_maps(obj, material):
    """The library's maps: the uniform constant times the weight. Vertices that are not in a group keep the constant."""
    maps = {}
    for constant, name in group_names(obj.shellwarp).items():
        uniform = material.density if constant == "area_density" else getattr(material, constant)
        maps[constant] = uniform * weights(obj, name)
    return maps
