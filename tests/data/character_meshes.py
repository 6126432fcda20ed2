#!/usr/bin/env python3
"""Makes the hat and the two trouser legs of the scene `character`: near-equilateral open shells, in cm, y up.

    character_meshes.py            writes meshes/character_hat.obj, character_leg_left.obj, character_leg_right.obj
    character_meshes.py --check    says whether those files are what this script makes

Each is a stack of rings. A ring has as many vertices as its length holds edges, neighbouring rings are an edge's height
apart, and the band between two rings is closed by always taking the shorter diagonal. Any Python 3 will do.
"""

import argparse
import math
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "meshes"
ROW = math.sqrt(3) / 2          # height of an equilateral triangle of edge 1
SAME = 2e-5                     # cm: files hold five decimals, and sine and cosine differ in the last bit between machines

# The hat: from its tip to the edge of the brim, (distance from the axis, height). The head's bone is at (0, 150, -6).
HAT = [(0.0, 206.0), (1.6, 202.0), (4.2, 191.0), (6.9, 180.0), (8.9, 172.0), (9.6, 168.6), (10.9, 167.2), (14.0, 166.6),
       (17.5, 166.2), (21.0, 165.4), (23.0, 164.4)]
HAT_EDGE = 1.7
HAT_BAND = 168.6                # height about which it is tilted, and above which it leans back
HAT_AXIS = -6.0                 # z
HAT_TILT = math.radians(14)     # the brim is up in front

# The left leg, to the viewer's right: (height, half width along x, half depth along z, middle x, middle z).
LEG = [(89.0, 7.6, 9.6, 8.4, -6.6), (80.0, 7.7, 9.4, 8.6, -6.2), (66.0, 7.3, 8.2, 9.2, -5.2), (48.0, 6.6, 7.0, 10.2, -4.4),
       (34.0, 7.4, 7.9, 11.4, -5.4), (20.0, 9.4, 10.6, 12.8, -7.0), (9.0, 11.8, 13.4, 13.6, -8.0)]
LEG_EDGE = 2.3


def smooth(points, t):
    """Catmull-Rom through the points at t = 0, 1, 2, …; the ends are mirrored."""
    k = min(int(t), len(points) - 2)
    s = t - k
    p = [points[i] if 0 <= i < len(points) else None for i in range(k - 1, k + 3)]
    p[0] = p[0] or tuple(2 * a - b for a, b in zip(p[1], p[2]))
    p[3] = p[3] or tuple(2 * b - a for a, b in zip(p[1], p[2]))
    return tuple(b + s / 2 * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a)))
                 for a, b, c, d in zip(*p))


def evenly(points, spacing):
    """Points of the curve at equal distances as near to `spacing` as fit, both ends included."""
    fine = [smooth(points, (len(points) - 1) * i / 4000) for i in range(4001)]
    length = [0.0]
    for a, b in zip(fine, fine[1:]):
        length.append(length[-1] + math.dist(a, b))
    count, k, chosen = round(length[-1] / spacing), 0, []
    for i in range(count + 1):
        while k < 4000 and length[k] < i / count * length[-1]:
            k += 1
        chosen.append(fine[k])
    return chosen


def ellipse(width, depth, edge, turn):
    """Points (x, z) of an ellipse at equal distances of about `edge`; `turn` of a step ahead."""
    fine = [(width * math.cos(2 * math.pi * i / 2000), depth * math.sin(2 * math.pi * i / 2000)) for i in range(2001)]
    length = [0.0]
    for a, b in zip(fine, fine[1:]):
        length.append(length[-1] + math.dist(a, b))
    count, k, chosen = max(6, round(length[-1] / edge)), 0, []
    for i in range(count):
        goal = (i + turn) / count * length[-1]
        while length[k + 1] < goal:
            k += 1
        s = (goal - length[k]) / (length[k + 1] - length[k])
        chosen.append(tuple(a + s * (b - a) for a, b in zip(fine[k], fine[k + 1])))
    return chosen


def stitch(points, first, n_first, second, n_second):
    """Triangles of the band between two rings, given by the index of their first points and their sizes."""
    i = j = 0
    band = []
    while i < n_first or j < n_second:
        a, b = first + i % n_first, second + j % n_second
        a_next, b_next = first + (i + 1) % n_first, second + (j + 1) % n_second
        shorter = math.dist(points[a_next], points[b]) <= math.dist(points[a], points[b_next])
        along_first = j == n_second or (i < n_first and shorter)
        band.append((a, a_next, b) if along_first else (a, b_next, b))
        i, j = (i + 1, j) if along_first else (i, j + 1)
    return band


def stack(rings, tip=None):
    """The shell of rings of points, from the top down, closed by a tip or not."""
    points = [tip] if tip else []
    starts = []
    for ring in rings:
        starts.append(len(points))
        points += ring
    triangles = [(0, 1 + (i + 1) % len(rings[0]), 1 + i) for i in range(len(rings[0]))] if tip else []
    for k in range(len(rings) - 1):
        triangles += stitch(points, starts[k], len(rings[k]), starts[k + 1], len(rings[k + 1]))
    return points, triangles


def lean(x, y, z):
    """The cone leans back and a little aside, more towards its tip, and all of the hat is tilted."""
    t = max(0.0, y - HAT_BAND) / (HAT[0][1] - HAT_BAND)
    up, front = y - 5.0 * t ** 3 - HAT_BAND, z - 7.0 * t * t - HAT_AXIS
    return (x + 3.5 * t * t, HAT_BAND + up * math.cos(HAT_TILT) + front * math.sin(HAT_TILT),
            HAT_AXIS + front * math.cos(HAT_TILT) - up * math.sin(HAT_TILT))


def hat():
    profile = evenly(HAT, HAT_EDGE * ROW)
    rings = [[lean(x, y, z + HAT_AXIS) for x, z in ellipse(r, 1.06 * r, HAT_EDGE, k % 2 / 2)]
             for k, (r, y) in enumerate(profile) if k > 0]
    return stack(rings, lean(0.0, profile[0][1], HAT_AXIS))


def leg(side):
    rings = [[(side * across + x, y, along + z) for x, z in ellipse(width, depth, LEG_EDGE, k % 2 / 2)]
             for k, (y, width, depth, across, along) in enumerate(evenly(LEG, LEG_EDGE * ROW))]
    return stack(rings)


def write(path, points, triangles, name):
    lines = [f"# {name}: {len(points)} vertices, {len(triangles)} triangles, cm; made by tests/data/character_meshes.py"]
    lines += ["v " + " ".join(f"{c:.5f}" for c in p) for p in points]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def same(path, points, triangles):
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    vertices = [tuple(map(float, r[1:])) for r in rows if r[0] == "v"]
    faces = [tuple(int(i) - 1 for i in r[1:]) for r in rows if r[0] == "f"]
    return (faces == triangles and len(vertices) == len(points)
            and all(math.dist(a, b) <= SAME for a, b in zip(vertices, points)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    check = parser.parse_args().check
    wrong = 0
    for name, mesh in (("hat", hat()), ("leg_left", leg(1)), ("leg_right", leg(-1))):
        path = FOLDER / f"character_{name}.obj"
        if not check:
            write(path, *mesh, name)
        elif not same(path, *mesh):
            wrong += 1
            print(f"{path} is not what this script makes", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
