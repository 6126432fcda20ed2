"""See README.md here."""

import sys

import numpy
import shellwarp as sw

i, j = numpy.meshgrid(numpy.arange(31), numpy.arange(4), indexing="ij")
points = (numpy.stack([i, j, 0 * i], axis=-1).reshape(-1, 3) / 64).astype(numpy.float32)
first = (4 * numpy.arange(30)[:, None] + numpy.arange(3)).ravel()
triangles = numpy.stack([first, first + 4, first + 5, first, first + 5, first + 1], axis=-1).reshape(-1, 3)

with sw.Model(sw.Shell(points, triangles, sw.Material(4096, 4096, 1 / 256, 0.25), fixed=range(8))) as model:
    model.precompute(modes=12, reduced_fields=0)
    with model.state("warp") as state:
        state.set_gravity([0, 1, -8])
        state.set_damping(ratio=0.125)
        for frame in range(1, 61):
            state.set_constraint(7, "position", 123, position=[0, 0, frame / 1024], axes="z")
            state.step(1 / 32)
        state.positions().tofile(sys.argv[1])
