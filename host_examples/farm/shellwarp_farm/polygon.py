"""Polygons as triangles, cut as host_examples/common/polygon.hpp has it: that file says how and why."""

import numpy

SAME = 1e-9  # qualities that differ by less are the same


def cut(faces, points):
    """Triangles (m x 3, uint32) of faces in their order, each a list of three vertices or more."""
    quads = [face for face in faces if len(face) == 4]
    halves = iter(_cut_quads(numpy.array(quads), points)) if quads else iter(())
    triangles = []
    for face in faces:
        triangles.extend([face] if len(face) == 3 else next(halves) if len(face) == 4 else _cut_one(face, points))
    return numpy.array(triangles, dtype=numpy.uint32).reshape(-1, 3)


def _cut_quads(quads, points):
    """Of each quad its two triangles (m x 2 x 3), by the better diagonal."""
    corners = points[quads]
    normal = _unit(numpy.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    places = [[3, 0, 1], [1, 2, 3], [0, 1, 2], [2, 3, 0]]
    quality = [_quality(corners[:, place], normal) for place in places]
    even, odd = numpy.minimum(*quality[:2]), numpy.minimum(*quality[2:])
    lowest = numpy.array([min(range(4), key=lambda k: tuple(quad[k])) for quad in corners])
    tip = numpy.where(numpy.abs(even - odd) <= SAME, (lowest + 1) % 4, numpy.where(even > odd, 0, 1))
    tip = numpy.where(numpy.fmax(even, odd) > 0, tip, 1)  # without an inside: a fan
    cuts = numpy.array([[[3, 0, 1], [1, 2, 3]], [[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [0, 1, 3]], [[2, 3, 0], [0, 1, 2]]])
    return numpy.take_along_axis(quads[:, None, :], cuts[tip].reshape(len(quads), 1, 6), axis=2).reshape(-1, 2, 3)


def _cut_one(face, points):
    """Triangles of a polygon of five corners or more, ear by ear, the best one first."""
    left, places, triangles = list(face), points[face], []
    arms = places - places[0]
    normal = _unit(numpy.cross(arms, numpy.roll(arms, -1, axis=0)).sum(axis=0))
    while len(left) > 3 and numpy.isfinite(normal).all():
        tip = _tip_of_quad(points[left], normal) if len(left) == 4 else _best_ear(points[left], normal)
        if tip is None:
            break
        triangles.append([left[tip - 1], left[tip], left[(tip + 1) % len(left)]])
        del left[tip]
    return triangles + [[left[0], left[k - 1], left[k]] for k in range(2, len(left))]


def _tip_of_quad(x, normal):
    quality = [float(_quality(x[place], normal)) for place in ([3, 0, 1], [1, 2, 3], [0, 1, 2], [2, 3, 0])]
    even, odd = min(quality[:2]), min(quality[2:])
    if not max(even, odd) > 0:
        return None
    if abs(even - odd) <= SAME:
        return (min(range(4), key=lambda k: tuple(x[k])) + 1) % 4
    return 0 if even > odd else 1


def _best_ear(x, normal):
    best, most = None, 0.0
    for tip in range(len(x)):
        ear = [(tip - 1) % len(x), tip, (tip + 1) % len(x)]
        own = float(_quality(x[ear], normal))
        as_good = best is not None and own > most - SAME and tuple(x[tip]) < tuple(x[best])
        if own > 0 and (own > most + SAME or as_good) and not _holds_another(x, ear, normal):
            best, most = tip, max(own, most)
    return best


def _holds_another(x, ear, normal):
    others = [place for place in x if not (place == x[ear]).all(axis=1).any()]
    return any(all(numpy.dot(numpy.cross(x[b] - x[a], place - x[a]), normal) >= 0 for a, b in zip(ear, ear[1:] + ear[:1])) for place in others)


def _quality(x, normal):
    """Twice the area of triangles (... x 3 x 3) over the square of the longest side, at most 0 where they are turned over."""
    sides = numpy.roll(x, -1, axis=-2) - x
    longest = (sides ** 2).sum(axis=-1).max(axis=-1)
    area = (numpy.cross(sides[..., 0, :], sides[..., 1, :]) * normal).sum(axis=-1)
    return area / numpy.where(longest > 0, longest, 1)


def _unit(vectors):
    with numpy.errstate(invalid="ignore", divide="ignore"):
        return vectors / numpy.linalg.norm(vectors, axis=-1, keepdims=True)
