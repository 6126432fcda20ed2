#!/usr/bin/env python3
"""Shells under loads that are small beside those of their training: a section of docs/evidence/front.md. `make bench-small-loads` runs it.

    small_loads.py [--docs FILE]

Ten shells, each of the paper's energy and of a sheet as thin as printer paper. 8 modes and 40 fields. Each is at rest under gravity along
four directions, so strong that the linear modes move by 0.2 and by 3 % of its size. The error is |u - u_full| / |u_full| over all vertices,
against the full shell on the same mesh. Loads that no full shell was found under, or that move it by more than 0.8 of its size, are left out.
"""

import argparse
import sys
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_examples/python"), str(ROOT / "tests/bench")]
import shellwarp as sw  # noqa: E402
from sections import put_section  # noqa: E402

METHODS = {"warp": "the paper's warp", "polynomial-shell": "polynomial", "reduced-shell": "samples"}
MATERIALS = {"paper's": sw.Material(bend=1e-4, length=30, area=1e3, density=0.2), "sheet": sw.Sheet(4e9, 0.29, 1e-4, 800)}
DIRECTIONS = ((0, 0, -1), (0, 0, 1), (0.3, 1, 0.2), (1, 0.1, -0.3))
SIZES = (0.002, 0.03)
WHOLE = 2 * numpy.pi


def grid(across, along, place, closed=False):
    """Points (across x along cells, the first direction closed or not) and triangles, of diagonals to either side."""
    width = across + (not closed)
    points = [place(i / across, j / along) for j in range(along + 1) for i in range(width)]
    triangles = []
    for j in range(along):
        for i in range(across):
            a, b = j * width + i, j * width + (i + 1) % width
            c, d = a + width, b + width
            triangles += [[a, b, d], [a, d, c]] if (i + j) % 2 == 0 else [[a, b, c], [b, d, c]]
    return numpy.array(points, float), numpy.array(triangles)


def around(u, radius, z):
    return radius * numpy.cos(WHOLE * u), radius * numpy.sin(WHOLE * u), z


def sphere(u, angle):
    return around(u, 0.15 * numpy.sin(angle), 0.15 * numpy.cos(angle))


def twisted(u, v, turns):
    angle, y = WHOLE * turns * u, 0.06 * (v - 0.5)
    return 0.4 * u, y * numpy.cos(angle), y * numpy.sin(angle)


def tube(u, v, length):
    x, z, y = around(u, 0.08, length * v)
    return x, y, z


# Name: the grid, and what is held of its points.
SHELLS = {
    "half pipe, held along its edges": (grid(18, 14, lambda u, v: tube(u / 2, v, 0.25)), lambda p: p[:, 2] < 1e-6),
    "tube, held along a line": (grid(22, 14, lambda u, v: tube(u, v, 0.3), True), lambda p: p[:, 2] < -0.0785),
    "band, held at a spot": (grid(40, 4, lambda u, v: tube(u, v, 0.04), True), lambda p: p[:, 2] < -0.079),
    "umbrella, held at its top": (grid(24, 10, lambda u, v: sphere(u, 0.2 + 1.1 * v), True), lambda p: p[:, 2] > 0.146),
    "dome, its rim held": (grid(24, 8, lambda u, v: sphere(u, 0.1 + 0.8 * v), True), lambda p: p[:, 2] < 0.15 * numpy.cos(0.9) + 1e-3),
    "lampshade, its wide end held": (grid(24, 14, lambda u, v: around(u, 0.08 - 0.03 * v, 0.3 * v), True), lambda p: p[:, 2] < 1e-6),
    "flag, held at two corners": (grid(20, 14, lambda u, v: (0.3 * u, 0, 0.2 * v)), lambda p: (p[:, 0] < 1e-6) & (abs(p[:, 2] - 0.1) > 0.08)),
    "folded card, held at an end": (grid(16, 12, lambda u, v: (0.2 * u, 0.15 * v, 0.14 * abs(v - 0.5))), lambda p: p[:, 0] < 0.013),
    "strip like an S, held at an end": (grid(40, 4, lambda u, v: (0.3 * u, 0.05 * v, 0.05 * numpy.sin(WHOLE * u))), lambda p: p[:, 0] < 0.008),
    "ribbon, twisted twice": (grid(48, 4, lambda u, v: twisted(u, v, 2)), lambda p: p[:, 0] < 0.009),
}


def hung(model, method, gravity, points):
    """Displacements at rest; None where no rest was found."""
    state = model.state(method)
    state.set_gravity(gravity)
    try:
        state.equilibrium()
    except sw.ShellwarpError:
        return None
    return state.positions(dtype=numpy.float64) - points


def errors(points, triangles, held, material):
    """Of each size of load, a list of the methods' errors."""
    found, size = {size: [] for size in SIZES}, numpy.ptp(points, axis=0).max()
    with sw.Model(sw.Shell(points, triangles, material, clamped=numpy.flatnonzero(held(points)))) as model:
        model.precompute(modes=8, reduced_fields=40)
        for direction in DIRECTIONS:
            unit = numpy.array(direction) / numpy.linalg.norm(direction)
            moved = abs(hung(model, "lma", tuple(unit), points)).max()
            for share in SIZES:
                gravity = tuple(unit * share * size / moved)
                full = hung(model, "shell-implicit", gravity, points)
                if full is None or abs(full).max() > 0.8 * size:
                    continue
                shapes = [hung(model, method, gravity, points) for method in METHODS]
                found[share].append([numpy.inf if u is None else numpy.linalg.norm(u - full) / numpy.linalg.norm(full) for u in shapes])
    return found


def percent(x):
    return "–" if not numpy.isfinite(x) else f"{100 * x:.2g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", type=Path, help="a page to write the table into")
    docs = parser.parse_args().docs
    head = [f"{name} at {100 * size:g} %" for size in SIZES for name in METHODS.values()]
    rows = ["| shell | energy | loads | " + " | ".join(head) + " |", "|---" * (3 + len(head)) + "|"]
    every = {size: [] for size in SIZES}
    for shell, ((points, triangles), held) in SHELLS.items():
        for energy, material in MATERIALS.items():
            found = errors(points, triangles, held, material)
            cells = []
            for size in SIZES:
                every[size] += found[size]
                table = numpy.array(found[size])
                cells += [f"{percent(numpy.median(c))}, {percent(c.max())}" for c in table.T] if len(table) else ["none"] * len(METHODS)
            rows.append(f"| {shell} | {energy} | {sum(map(len, found.values()))} | " + " | ".join(cells) + " |")
            print(rows[-1], flush=True)
    cells = [f"{percent(numpy.median(c))}, {percent(numpy.quantile(c, 0.9))}" for size in SIZES for c in numpy.array(every[size]).T]
    rows.append(f"| all: median, nine tenths below | | {sum(map(len, every.values()))} | " + " | ".join(cells) + " |")
    print(rows[-1])
    if docs:
        put_section(docs, "small loads", "\n".join(rows))


if __name__ == "__main__":
    main()
