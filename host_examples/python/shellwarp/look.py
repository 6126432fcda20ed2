"""Stiffness by look: of a shell whose slowest swing is to have a frequency."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy
from numpy.typing import ArrayLike

from .errors import InvalidArgumentError
from .mesh import Material, Shell
from .model import Model


def sheet_of(positions: ArrayLike, triangles: ArrayLike, density: float = 1.0, thickness: float = 0.0) -> Material:
    """A uniform sheet of E h = 1, as stiff against bending beside stretching as its thickness says; 0: a two-hundredth of the mesh's size.

    With the mean edge l: k_length = √3 l E h / 4, k_area = E h / 2, k_bend = E h³ / 72 (1 - 1/9)."""
    points = numpy.asarray(positions, numpy.float64)
    corners = points[numpy.asarray(triangles)]
    edge = float(numpy.linalg.norm(corners - numpy.roll(corners, 1, axis=1), axis=2).mean())
    h = thickness or float(numpy.linalg.norm(numpy.ptp(points, axis=0))) / 200
    return Material(0.5, math.sqrt(3) / 4 * edge, h * h / 72 * (1 - 1 / 9), density)


def at_frequency(shell: Shell, hertz: float, modes: int = 16, progress: "Callable[[str, float], bool | None] | None" = None) -> Shell:
    """The shell of a Material with stiffnesses by which its slowest swing has a frequency: they go with its square."""
    material = shell.material
    if not isinstance(material, Material) or not (math.isfinite(hertz) and hertz > 0):
        raise InvalidArgumentError(f"hertz: {hertz} of a {type(material).__name__}, expected a number above 0 of a Material")
    with Model(shell) as model:
        model.precompute(modes=modes, progress=progress, reduced_fields=0)
        slowest = next((float(found) for found in model.frequencies() if found > 0), None)
    if slowest is None:
        raise InvalidArgumentError("none of the modes swings, so there is no frequency to set: more modes, or hold more vertices")
    factor = (hertz / slowest) ** 2
    return replace(shell, material=replace(material, area=factor * material.area, length=factor * material.length, bend=factor * material.bend))
