#!/usr/bin/env python3
"""Error against the time of a frame, method by method, on one mesh: docs/evidence/leaf_front.csv and docs/pictures/leaf_front.svg.

    leaf_front.py [--draw] [METHOD …]     --draw: the picture alone, of the numbers that are there. Methods: only these anew

The shell is the leaf of `shellwarp new-scene`, 363 vertices, clamped at its stem, its slowest swing 5 Hz. It is hung at rest under 9.8 m/s^2
along each of the six half-axes. The error is the root mean square over these of |u - u_full| / |u_full|, u over all vertices, against
the full shell on the same mesh. The time is that of a step and all positions on one core: the best of some runs of 900 frames by the program's own
clock. The corrected and the full shell are timed by calls from Python, the best of many batches: of their milliseconds a call takes next to nothing.
"""

import csv
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE, PICTURE = ROOT / "docs/evidence/leaf_front.csv", ROOT / "docs/pictures/leaf_front.svg"
CLI = ROOT / "build/bin/shellwarp"
# By method: what is varied, and its values. Methods on fields have 8 modes among them. "corrected" is the polynomial shell of 12 fields, and so
# many Newton steps of the full shell from where it is to what is shown.
KNOBS = {"lma": ("modes", (2, 4, 8, 16, 32, 64)), "warp": ("modes", (2, 4, 8, 16, 32, 64)), "warp-virtual-work": ("modes", (2, 4, 8, 16, 32, 64)),
         "rotation-strain": ("modes", (2, 4, 8, 16, 32, 64)), "polynomial-shell": ("fields", (4, 8, 12, 20, 40)),
         "reduced-shell": ("fields", (4, 8, 12, 20, 40)), "corrected": ("steps", (1, 2, 3)), "shell-implicit": ("", (0,))}
CORRECTED = 12   # fields
NAMES = {"lma": "linear modes", "warp": "warp", "warp-virtual-work": "warp by virtual work", "corrected": "corrected", "rotation-strain": "rotation–strain", "polynomial-shell": "polynomial shell",
         "reduced-shell": "reduced shell", "shell-implicit": "full shell"}
COLOURS = {"warp-virtual-work": "#6a9bd8", "corrected": "#8a8f1f", "lma": "#d1495b", "warp": "#3b78d8", "rotation-strain": "#e07b39", "polynomial-shell": "#1f9aa8", "reduced-shell": "#8d5bc2",
           "shell-implicit": "#2f9e63"}
LOADS = [[0, 0, -9.8], [0, 0, 9.8], [0, -9.8, 0], [0, 9.8, 0], [9.8, 0, 0], [-9.8, 0, 0]]


def leaf():
    """Points, triangles, held vertices and material as the program makes them."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([CLI, "new-scene", "leaf.toml"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        said = subprocess.run([CLI, "run", "leaf.toml", "--frames", "1", "--method", "warp", "--no-certify"], cwd=folder, check=True,
                              capture_output=True, text=True).stdout
        lines = [line.split() for line in (Path(folder) / "leaf.obj").read_text(encoding="utf-8").splitlines()]
    constants = {words[0]: float(words[1]) for words in map(str.split, said.splitlines()) if words and words[0].startswith("k_")}
    points = [[float(x) for x in words[1:]] for words in lines if words[0] == "v"]
    return points, [[int(v) - 1 for v in words[1:]] for words in lines if words[0] == "f"], constants


def seconds_of(call, least=0.15):
    """Of one call: the best of batches, so that what else the machine does counts little."""
    start = time.perf_counter()
    call()
    once = max(time.perf_counter() - start, 1e-7)
    batch, best, until = max(1, int(0.002 / once)), float("inf"), time.perf_counter() + least
    while time.perf_counter() < until or best == float("inf"):
        start = time.perf_counter()
        for _ in range(batch):
            call()
        best = min(best, (time.perf_counter() - start) / batch)
    return best


def microseconds(method, modes, fields=0, runs=5):
    """Of methods that cost no more than a call from Python: by the program's own clock, the best of some runs of 900 frames."""
    asked = f"modes = {modes}\n" + (f"reduced_fields = {fields}\n" if fields else "")
    best = float("inf")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([CLI, "new-scene", "leaf.toml"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        scene = Path(folder) / "leaf.toml"
        scene.write_text(re.sub(r"^modes = .*\n", asked, scene.read_text(encoding="utf-8"), count=1, flags=re.M), encoding="utf-8")
        for _ in range(runs):
            said = subprocess.run([CLI, "run", "leaf.toml", "--frames", "900", "--method", method, "--no-certify"], cwd=folder,
                                  check=True, capture_output=True, text=True).stdout
            times = [float(words[-2]) for words in map(str.split, said.splitlines()) if words and words[-1] == "us"]
            best = min(best, sum(times))
    return best


def measure():
    sys.path.insert(0, str(ROOT / "host_examples/python"))
    import numpy
    import shellwarp as sw

    points, triangles, k = leaf()
    points = numpy.array(points)
    held = numpy.flatnonzero(points[:, 0] <= points[:, 0].min() + 0.01 * numpy.ptp(points[:, 0]))
    material = sw.Material(bend=k["k_bend"], length=k["k_length"], area=k["k_area"], density=0.2)
    shell = sw.Shell(points, numpy.array(triangles), material, clamped=held)

    def shown(state, steps, **into):
        return state.positions_corrected(steps, **into) if steps else state.positions(**into)

    def hung(model, method, steps):
        shapes = []
        for gravity in LOADS:
            state = model.state(method)
            state.set_gravity(gravity)
            state.equilibrium()
            shapes.append(shown(state, steps, dtype=numpy.float64) - points)
        return shapes

    def frame_seconds(model, method, steps):
        state, out = model.state(method), numpy.empty((len(points), 3), numpy.float32)
        state.set_gravity(LOADS[0])

        def frame():
            state.step(1 / 30)
            shown(state, steps, out=out)
        return seconds_of(frame)

    asked = [word for word in sys.argv[1:] if word in KNOBS] or list(KNOBS)
    truth, rows = None, []
    if TABLE.exists():
        with open(TABLE, encoding="utf-8", newline="") as file:
            rows = [row for row in csv.reader(file) if row[0] in KNOBS and row[0] not in asked and row[0] != "shell-implicit"]
    for method in ["shell-implicit", *(name for name in asked if name != "shell-implicit")]:
        knob, values = KNOBS[method]
        for value in values:
            of, steps = ("polynomial-shell", value) if method == "corrected" else (method, 0)
            with sw.Model(shell) as model:
                fields = {"fields": value, "steps": CORRECTED}.get(knob, 0)
                model.precompute(**({"modes": value} if knob == "modes" else {"modes": 8, "reduced_fields": fields} if fields else {}))
                shapes = hung(model, of, steps)
                truth = truth or shapes
                error = numpy.sqrt(numpy.mean([numpy.sum((a - b) ** 2) / numpy.sum(b ** 2) for a, b in zip(shapes, truth)]))
                by_clock = {"modes": (value, 0), "fields": (8, value)}.get(knob)
                taken = microseconds(method, *by_clock) if by_clock else 1e6 * frame_seconds(model, of, steps)
                rows.append([method, knob, value or "", f"{error:.3e}", f"{taken:.2f}"])
                print(*rows[-1], flush=True)
    with open(TABLE, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", "knob", "value", "error", "frame_us"])
        writer.writerows(sorted(rows, key=lambda row: (list(KNOBS).index(row[0]), int(row[2] or 0))))


def draw():
    """The curves on logarithmic axes, each labelled at its end, as a page of SVG that needs nothing else."""
    from math import log10

    with open(TABLE, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    times, errors = ([float(row[name]) for row in rows] for name in ("frame_us", "error"))
    wide, tall, left, right, top, bottom = 760, 400, 76, 150, 34, 52
    floor = 0.5 * min(error for error in errors if error > 0)   # where the full shell stands, whose error is none
    low_x, high_x = 0.6 * min(times), 1.6 * max(times)
    x = lambda t: left + (wide - left - right) * log10(t / low_x) / log10(high_x / low_x)
    y = lambda e: top + (tall - top - bottom) * log10(1.5 / max(e, floor)) / log10(1.5 / floor)
    text = lambda a, b, words, more="": f'<text x="{a:.1f}" y="{b:.1f}" {more}>{words}</text>'
    parts = []
    for power in range(-6, 8):
        t, e = 10.0 ** power, 10.0 ** power
        if low_x * 0.999 <= t <= high_x:
            words = f"{t:g} µs" if t < 1000 else f"{t / 1000:g} ms" if t < 1e6 else f"{t / 1e6:g} s"
            parts += [f'<path d="M{x(t):.1f} {top}V{tall - bottom}" stroke="#e3e6ec"/>', text(x(t), tall - bottom + 18, words, 'text-anchor="middle"')]
        if floor <= e <= 1.5:
            parts += [f'<path d="M{left} {y(e):.1f}H{wide - right}" stroke="#e3e6ec"/>', text(left - 8, y(e) + 4, f"{100 * e:g} %", 'text-anchor="end"')]
    curves = {method: [(x(float(row["frame_us"])), y(float(row["error"]))) for row in rows if row["method"] == method] for method in KNOBS}
    for method, curve in curves.items():
        way = " ".join(f"{a:.1f},{b:.1f}" for a, b in curve)
        parts.append(f'<polyline points="{way}" fill="none" stroke="{COLOURS[method]}" stroke-width="2"/>')
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5" fill="{COLOURS[method]}"/>' for a, b in curve]
    # Each label behind its curve's last point, or as near as it lies on no other and on no curve.
    between = lambda one, other: [(one[0] + k / 20 * (other[0] - one[0]), one[1] + k / 20 * (other[1] - one[1])) for k in range(21)]
    ways = [place for curve in curves.values() for ends in zip(curve, curve[1:] or curve) for place in between(*ends)]
    taken = [(a - 4, a + 4, b) for a, b in ways]
    for method, curve in sorted(curves.items(), key=lambda item: item[1][-1:]):
        if not curve:   # not measured yet
            continue
        words = NAMES[method] + (": no error" if method == "shell-implicit" else "")
        a, b, width = curve[-1][0] + 10, curve[-1][1] + 4, 7.6 * len(words)
        free = lambda b: not any(a < right and left < a + width and abs(b - 4 - middle) < 12 for left, right, middle in taken)
        b = min((b + off for off in range(-tall, tall) if free(b + off)), key=lambda place: abs(place - b))
        taken.append((a, a + width, b - 4))
        parts.append(text(a, b, words, f'fill="{COLOURS[method]}" font-weight="600"'))
    axes = [text(left, 20, "Error against the full shell", 'font-weight="600" fill="#23272f"'),
            text((left + wide - right) / 2, tall - 12, "time of a frame: a step and all 363 positions, one core", 'text-anchor="middle"')]
    PICTURE.parent.mkdir(exist_ok=True)
    PICTURE.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {tall}" width="{wide}" height="{tall}" '
                       'font-family="system-ui, DejaVu Sans, sans-serif" font-size="12.5" fill="#5c6370">'
                       f'<rect width="{wide}" height="{tall}" fill="#fff"/>' + "\n".join(parts + axes) + "</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    if "--draw" not in sys.argv[1:]:
        measure()
    draw()
