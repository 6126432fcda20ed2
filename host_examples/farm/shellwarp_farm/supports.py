"""What holds a job's shell."""

import numpy

from . import selection


def held_vertices(supports, simulated, mesh):
    """The vertices that supports hold, clamped ones with their neighbours, sorted and each once: (k), uint32."""
    held = numpy.zeros(len(simulated.positions), dtype=bool)
    for support in supports:
        held[with_neighbours(support, simulated, mesh)] = True
    return numpy.flatnonzero(held).astype(numpy.uint32)


def with_neighbours(support, simulated, mesh):
    """The vertices of a support, clamped ones with those that share a triangle with one."""
    held = selection.chosen(support, simulated, mesh)
    if support.get("kind", "fixed") == "fixed":
        return held
    touched = numpy.isin(simulated.triangles, held).any(axis=1)
    return numpy.union1d(held, simulated.triangles[touched])


def supported_vertices(supports, simulated, mesh, kind):
    """The vertices that supports of a kind name, sorted and each once: (k), uint32."""
    chosen = [selection.chosen(support, simulated, mesh) for support in supports if support.get("kind", "fixed") == kind]
    return numpy.unique(numpy.concatenate([numpy.zeros(0, int), *chosen])).astype(numpy.uint32)
