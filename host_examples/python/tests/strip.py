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


def shell(**changes):
    parts = {"positions": positions(), "triangles": triangles(), "fixed": HELD,
             "material": Material(area=5e3, length=5e3, bend=2.7e-3, density=0.3)}
    return Shell(**{**parts, **changes})
