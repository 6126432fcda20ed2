"""The README's strip of card: 31 x 4 vertices along x, the first two rows held."""

import numpy

from shellwarp import Material, Shell

HELD = range(8)
GRAVITY = (0.0, 0.0, -9.8)


def positions(dtype=numpy.float32):
    i, j = numpy.meshgrid(numpy.arange(31), numpy.arange(4), indexing="ij")
    return numpy.stack([0.01 * i, 0.01 * j, 0.0 * i], axis=-1).reshape(-1, 3).astype(dtype)


def triangles():
    first = (4 * numpy.arange(30)[:, None] + numpy.arange(3)).ravel()
    pairs = [[first, first + 4, first + 5], [first, first + 5, first + 1]]
    return numpy.stack([numpy.stack(t, axis=-1) for t in pairs], axis=1).reshape(-1, 3)


def arch():
    """54 vertices: half a tube of paper along x, three points of an end clamped. Four fields do not hold it, and their training takes half a second."""
    x, turn = numpy.meshgrid(numpy.linspace(0, 0.5, 6), numpy.linspace(0, 3, 9), indexing="ij")
    points = numpy.stack([x, 0.2 * numpy.sin(turn), 0.2 * numpy.cos(turn)], axis=-1).reshape(-1, 3)
    first = (9 * numpy.arange(5)[:, None] + numpy.arange(8)).ravel()
    faces = numpy.concatenate([numpy.stack([first, first + 9, first + 10], axis=-1), numpy.stack([first, first + 10, first + 1], axis=-1)])
    return Shell(points, faces, Material(area=1e4, length=1e4, bend=0.05, density=1), clamped=range(3))


def shell(**changes):
    parts = {"positions": positions(), "triangles": triangles(), "fixed": HELD,
             "material": Material(area=5e3, length=5e3, bend=2.7e-3, density=0.3)}
    return Shell(**{**parts, **changes})
