#!/usr/bin/env python3
"""What a look costs in error, and how long bowls train: two sections of docs/evidence/training.md. `make bench-looks` runs it.

    looks.py [--docs FILE]

Four shells of 1,000 vertices with 8 modes and 40 fields, trained whole and within `reduced_seconds` = 1. Each rests under gravity along twelve
random directions. It grows until the full shell has moved by 0.1 to 0.3 of the shell's size; loads that snap it past that are left out. The
error is |u - u_full| / |u_full| over all vertices. Bowls are trained whole.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_examples/python"), str(ROOT / "tests/bench")]
import shellwarp as sw  # noqa: E402
from sections import put_section  # noqa: E402
from small_loads import MATERIALS, grid, sphere  # noqa: E402

METHODS = {"polynomial-shell": "polynomial", "reduced-shell": "samples"}
LEAF = sw.Material(area=1e4, length=1e4, bend=0.1, density=1.0)
FELT = sw.Sheet(5e6, 0.3, 1.2e-3, 300)


def leaf(u, v):
    x, y = 1.5 * u, 0.6 * (0.35 + 0.65 * numpy.sin(numpy.pi * u)) * (v - 0.5)
    return x, y, 0.25 * x * (1.5 - x) + 0.8 * y * y


def curved(along, across):
    def place(u, v):
        return u, 0.6 * (v - 0.5), along * u * (1 - u) + across * (0.6 * (v - 0.5)) ** 2

    return place


# Name: the grid and the material. Held by the two rows at x = 0, so that it cannot turn about them.
SHELLS = {
    "leaf": (49, 19, leaf, LEAF),
    "card of felt": (39, 24, curved(0, 0), FELT),
    "dome of felt": (39, 24, curved(0.1, -0.15), FELT),
    "saddle of felt": (39, 24, curved(0.1, 0.15), FELT),
}


def trained(shell, **bounds):
    model, begun = sw.Model(shell), time.monotonic()
    model.precompute(modes=8, reduced_fields=40, **bounds)
    return model, time.monotonic() - begun


def resting(state, gravity):
    state.set_gravity(tuple(gravity))
    state.equilibrium()
    return state.positions(dtype=numpy.float64)


def loads(model, points, directions):
    """Gravity, and the positions of the full shell under it."""
    size = numpy.linalg.norm(numpy.ptp(points, axis=0))
    for direction in directions:
        state, strength, moved = model.state("shell-implicit"), 1e-3, 0.0
        while moved < 0.1:
            strength *= 1.05 if moved > 0.02 else 1.3
            try:
                full = resting(state, strength * direction)
            except sw.ShellwarpError:
                break
            moved = numpy.linalg.norm(full - points, axis=1).max() / size
        if 0.1 <= moved <= 0.3:
            yield strength * direction, full


def row(name, across, along, place, material):
    points, triangles = grid(across, along, place)
    shell = sw.Shell(points, triangles, material, fixed=numpy.flatnonzero(points[:, 0] < 0.031))
    models = [trained(shell), trained(shell, reduced_seconds=1.0)]
    generator = numpy.random.default_rng(7)
    directions = [d / numpy.linalg.norm(d) for d in generator.normal(size=(12, 3))]
    errors = {(method, k): [] for method in METHODS for k in range(2)}
    for gravity, full in loads(models[0][0], points, directions):
        for (method, k), list_of in errors.items():
            try:
                found = resting(models[k][0].state(method), gravity)
            except sw.ShellwarpError:
                found = numpy.full_like(full, numpy.inf)
            list_of.append(100 * numpy.linalg.norm(found - full) / numpy.linalg.norm(full - points))
    assert all(errors.values()), f"no load of the {name} is in reach"
    cells = [f"{numpy.median(e):.2g}, {max(e):.2g} %" for e in errors.values()]
    count = len(next(iter(errors.values())))
    seconds = ", ".join(f"{seconds:.1f}" for _, seconds in models)
    return f"| {name} | {len(points)} | {seconds} s | {count} of 12 | " + " | ".join(cells) + " |\n"


def bowls():
    """The table of bowls, held at the bottom or along the rim."""
    lines = "| held | material | vertices | precompute |\n|---|---|---|---|\n"
    points, triangles = grid(36, 12, lambda u, v: sphere(u, numpy.pi * (0.88 - 0.38 * v)), closed=True)
    rings = {"at its bottom": points[:, 2].min(), "along its rim": points[:, 2].max()}
    for held, height in rings.items():
        for name, material in (MATERIALS | {"felt": FELT}).items():
            fixed = numpy.flatnonzero(abs(points[:, 2] - height) < 1e-6)
            _, seconds = trained(sw.Shell(points, triangles, material, fixed=fixed))
            lines += f"| {held} | {name} | {len(points)} | {seconds:.1f} s |\n"
    return lines


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--docs")
    docs = parser.parse_args().docs
    heads = [f"{form}: {which}" for form in METHODS.values() for which in ("whole", "look")]
    table = "| shell | vertices | precompute: whole, look | loads | " + " | ".join(heads) + " |\n|" + "---|" * 8 + "\n"
    print(table, end="")
    for name, shell in SHELLS.items():
        line = row(name, *shell)
        print(line, end="", flush=True)
        table += line
    of_bowls = bowls()
    print(f"\n{of_bowls}", end="")
    if docs:
        put_section(docs, "looks", table)
        put_section(docs, "bowls", of_bowls)


if __name__ == "__main__":
    main()
