"""The body that wears the shells of the scene `character`: plain solids that move with the bones of its skeleton.

    figure.py BONES.csv FRAME STEM      writes STEM_COLOUR.obj for each colour, and prints a line "COLOUR PATH" for each

The solids are given in the rest pose of tests/scenes/character.toml, in cm. They are drawn, not simulated.
"""

import csv
import sys
from pathlib import Path

import numpy as np

SKIN, SHOES, EYES, DENIM = "#e0ac7e", "#3a3a40", "#26221f", "#2d62ad"
ROUND = 24                   # points around a solid


def capsule(bone, start, end, radius, color=SKIN):
    """A ball swept from `start` to `end`."""
    return bone, np.array(start, float), np.array(end, float), np.full(3, float(radius)), color


def ellipsoid(bone, center, radii, color=SKIN):
    return bone, np.array(center, float), np.array(center, float), np.array(radii, float), color


def limbs(side, s):
    return [
        capsule(f"arm_{side}", (18.5 * s, 141, -5.5), (30.5 * s, 116, -4.7), 3.1),
        capsule(f"forearm_{side}", (30.5 * s, 116, -4.7), (39 * s, 95, -3.8), 2.8),
        ellipsoid(f"forearm_{side}", (40.5 * s, 90, -3.2), (3.6, 5.4, 4.4)),
        ellipsoid(f"thigh_{side}", (8.4 * s, 87.5, -6.6), (7.3, 4.5, 9.2), DENIM),   # the trousers are open at the top, which is not to be seen
        capsule(f"thigh_{side}", (8.4 * s, 86, -6.6), (10.2 * s, 48, -4.4), 3.4),
        # Of the trousers' colour, and boots: what a swinging hem lays bare is no skin.
        capsule(f"shin_{side}", (10.2 * s, 48, -4.4), (12.6 * s, 14, -7.5), 2.6, DENIM),
        capsule(f"shin_{side}", (12.6 * s, 13, -7.5), (13 * s, 6, -7.5), 2.4, SHOES),
        ellipsoid(f"foot_{side}", (13.2 * s, 4.2, -2.0), (5.2, 4.2, 12.5), SHOES),
        ellipsoid("head", (3.7 * s, 161.5, 3.5), (1.15, 1.6, 0.9), EYES),
        ellipsoid("head", (9.6 * s, 160, -6), (1.5, 3, 2.2)),
    ]


SOLIDS = [
    ellipsoid("head", (0, 161.5, -6), (9.4, 12, 9.8)),
    ellipsoid("head", (0, 158.5, 4.2), (1.5, 1.7, 1.7)),
    capsule("chest", (0, 140, -6.5), (0, 156, -6), 4.6),
    capsule("chest", (0, 108, -6.5), (0, 136, -6.5), 4.5),
    capsule("chest", (-18.5, 141, -5.5), (18.5, 141, -5.5), 2.6),
    ellipsoid("pelvis", (0, 92, -6.5), (14.5, 6.5, 8.5), DENIM),
    *limbs("left", 1),
    *limbs("right", -1),
]


def ball():
    """Points and triangles of the unit sphere, its poles on the y axis; rings around the poles."""
    rings = ROUND // 2
    polar = np.pi * np.arange(rings + 1) / rings
    around = 2 * np.pi * np.arange(ROUND) / ROUND
    points = np.stack([np.outer(np.sin(polar), np.cos(around)), np.outer(np.cos(polar), np.ones(ROUND)),
                       -np.outer(np.sin(polar), np.sin(around))], axis=-1)
    i, j = np.meshgrid(np.arange(rings), np.arange(ROUND), indexing="ij")
    a, b = i * ROUND + j, i * ROUND + (j + 1) % ROUND
    away, toward = np.stack([a, a + ROUND, b + ROUND], axis=-1), np.stack([a, b + ROUND, b], axis=-1)
    triangles = np.concatenate([away[:-1].reshape(-1, 3), toward[1:].reshape(-1, 3)])   # none without area at the poles
    return points.reshape(-1, 3), triangles


def solid_mesh(start, end, radii):
    """A ball pulled apart along the way from `start` to `end`."""
    points, triangles = ball()
    way = end - start
    length = np.linalg.norm(way)
    y = way / length if length else np.array([0.0, 1.0, 0.0])
    x = np.cross(y, (0, 0, 1.0))
    x /= np.linalg.norm(x)
    axes = np.stack([x, y, np.cross(x, y)])
    middle = np.where(points[:, 1:2] > 0, end, start)
    return middle + (points * radii) @ axes, triangles


def read_bones(path, frame):
    """Rest joints and, for one frame, joints and rotations of the bones that the program wrote."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    place = {row["bone"]: np.array([float(row[c]) for c in "xyz"]) for row in rows if int(row["frame"]) == 0}
    bones = {}
    for row in rows:
        if int(row["frame"]) == frame:
            axes = np.array([[float(row[i + j]) for j in "xyz"] for i in "xyz"])   # row i: what axis i has become
            bones[row["bone"]] = place[row["bone"]], np.array([float(row[c]) for c in "xyz"]), axes
    return bones


def write_body(bones, stem):
    """Writes an OBJ file for each colour and returns (path, colour) of each."""
    written = []
    for color in dict.fromkeys(solid[-1] for solid in SOLIDS):
        points, triangles, count = [], [], 0
        for bone, start, end, radii, own in SOLIDS:
            if own == color:
                rest, joint, axes = bones[bone]
                x, t = solid_mesh(start, end, radii)
                points.append(joint + (x - rest) @ axes)
                triangles.append(t + count)
                count += len(x)
        path = stem.with_name(f"{stem.name}_{color[1:]}.obj")
        lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in np.concatenate(points)]
        lines += [f"f {a} {b} {c}" for a, b, c in np.concatenate(triangles) + 1]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        written.append((path, color))
    return written


def main(bones, frame, stem):
    for path, color in write_body(read_bones(bones, int(frame)), Path(stem)):
        print(color, path)


if __name__ == "__main__":
    main(*sys.argv[1:])
