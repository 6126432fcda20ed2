#!/usr/bin/env python3
"""What a frame costs where "auto" is the full shell: a section of docs/guide/methods.md. `make bench-auto-steps` runs it.

    auto_steps.py [--docs FILE]

Shells that fields do not hold, of 500 to 2,500 vertices, in steps of 1/24 s: hats that buckle under their weight, and skirts of cotton in gusts. Milliseconds
of a step, the median and the longest, by what auto takes and by the fields, on as many threads as the library likes.
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

STEP, STEPS = 1 / 24, 48
COTTON = sw.Sheet(young=1e6, poisson=0.3, thickness=4e-4, volume_density=400)
HAT_FELT = sw.Material(area=2e5, length=2e5, bend=1400, density=0.05)  # as the hat of tests/scenes/character.toml is soft


def read_obj(path):
    points, triangles = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            triangles.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return numpy.array(points), numpy.array(triangles)


def hat():
    points, triangles = read_obj(ROOT / "tests/data/meshes/character_hat.obj")
    turn = numpy.radians(14)
    band = abs(numpy.cos(turn) * (points[:, 1] - 168.6) - numpy.sin(turn) * (points[:, 2] + 6)) < 1.4
    return points, triangles, numpy.flatnonzero(band)


def skirt(around, down):
    """A cone of cloth 0.6 m long, held at its waist."""
    points = []
    for row in range(down + 1):
        angles = 2 * numpy.pi * (numpy.arange(around) + 0.5 * (row % 2)) / around
        radius = 0.15 + 0.18 * row / down
        points += [(radius * numpy.cos(a), radius * numpy.sin(a), -0.6 * row / down) for a in angles]
    triangles = []
    for row in range(down):
        for k in range(around):
            a, b = row * around + k, row * around + (k + 1) % around
            c, d = a + around, b + around
            triangles += [(a, c, b), (b, c, d)] if row % 2 == 0 else [(a, c, d), (a, d, b)]
    return numpy.array(points), numpy.array(triangles), numpy.arange(around)


def timed(state, before):
    """Milliseconds of each step."""
    taken = []
    for k in range(STEPS):
        before(state, k)
        start = time.perf_counter()
        state.step(STEP)
        taken.append(1e3 * (time.perf_counter() - start))
    return ", ".join(f"{float(f'{x:.2g}'):g}" for x in (numpy.median(taken), max(taken)))


def row(name, shell, before):
    points, triangles, held = shell[0]
    model = sw.Model(sw.Shell(points, triangles, shell[1], fixed=held))
    start = time.perf_counter()
    model.precompute(modes=8)
    seconds, info = time.perf_counter() - start, model.info()
    auto = next(name for name, number in sw.methods().items() if number == info["auto_method"])
    fields = f"{100 * info['training_error_median']:.0f} %" if info["auto_corrects"] else "none found"
    by_fields = timed(model.state("polynomial-shell"), before) if model.offers("polynomial-shell") else "–"
    text = f"| {name} | {len(points)} | {fields} | {auto} | {timed(model.state(), before)} | {by_fields} | {seconds:.1f} |"
    print(text, flush=True)
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", type=Path, help="a page to write the table into")
    docs = parser.parse_args().docs
    rows = ["| shell | vertices | its fields miss | auto is | a step, ms: median, longest | by the polynomial shell | precompute, s |", "|---" * 7 + "|"]

    def weight(state, k):
        state.set_gravity((0.3 * 600, -600, 0) if k < STEPS // 2 else (0, 300, 0))  # cm/s^2, turned over half-way

    def gusts(state, k):
        wind = 4 * (1 + 0.8 * numpy.sin(k / 5))
        state.set_gravity((0, 0, -9.81))
        state.set_wind((wind, 0.3 * wind, 0), density=1.2, normal_drag=1.3)

    rows.append(row("hat of the character, gravity that turns over", (hat(), HAT_FELT), weight))
    for around, down in ((36, 14), (48, 20), (60, 28), (70, 34)):
        rows.append(row("skirt of cotton in gusts", (skirt(around, down), COTTON), gusts))
    if docs:
        put_section(docs, "auto steps", "\n".join(rows))


if __name__ == "__main__":
    main()
