"""Stiffness by look: of a shell whose slowest swing is to have a frequency, or that is to sag so far."""

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


def at_frequency(shell: Shell, hertz: float, modes: int = 16, progress: "Callable[[str, float], bool | None] | None" = None,
                 calibrate: "Callable[[Model], object] | None" = None) -> Shell:
    """The shell of a Material with stiffnesses by which its slowest swing has a frequency: they go with its square. `calibrate` is called with each model before its precompute."""
    _check(shell, "hertz", hertz)
    with Model(shell) as model:
        if calibrate is not None:
            calibrate(model)
        model.precompute(modes=modes, progress=progress, reduced_fields=0)
        slowest = next((float(found) for found in model.frequencies() if found > 0), None)
    if slowest is None:
        raise InvalidArgumentError("none of the modes swings, so there is no frequency to set: more modes, or hold more vertices")
    return _stiffer(shell, (hertz / slowest) ** 2)


def at_sag(shell: Shell, length: float, gravity: ArrayLike, tolerance: float = 1e-3, modes: int = 16,
           progress: "Callable[[str, float], bool | None] | None" = None, calibrate: "Callable[[Model], object] | None" = None) -> Shell:
    """The shell of a Material with stiffnesses by which the full shell hangs so far under gravity: the vertex that moves furthest, a length. `calibrate` as of at_frequency."""
    _check(shell, "length", length)
    if not numpy.any(gravity):
        raise InvalidArgumentError("gravity is 0: nothing sags")
    with Model(shell) as model:
        if calibrate is not None:
            calibrate(model)
        model.precompute(modes=modes, progress=progress, reduced_fields=0)
        slowest = next((float(found) for found in model.frequencies() if found > 0), 0.0)
        pull = numpy.asarray(gravity, numpy.float64)
        # A clamped strip sags by 12.36/8 of g/omega^2: under gravity over such a stiffness the search begins near its end, and within its range.
        first = 1.545 * float(numpy.linalg.norm(pull)) / ((math.tau * slowest) ** 2 * length) if slowest else 1.0
        with model.state("shell-implicit") as state:
            state.set_gravity(pull / first)
            return _stiffer(shell, first * state.set_sag(length, tolerance))


def _check(shell: Shell, name: str, value: float) -> None:
    if not isinstance(shell.material, Material) or not (math.isfinite(value) and value > 0):
        raise InvalidArgumentError(f"{name}: {value} of a {type(shell.material).__name__}, expected a number above 0 of a Material")


def _stiffer(shell: Shell, factor: float) -> Shell:
    material = shell.material
    assert isinstance(material, Material)
    return replace(shell, material=replace(material, area=factor * material.area, length=factor * material.length, bend=factor * material.bend))
