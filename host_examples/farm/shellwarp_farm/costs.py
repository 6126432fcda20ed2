"""Measures what precompute, step and frame cost by vertices and modes, and says what more would: python -m shellwarp_farm costs.

Each measurement is a sheet of near-equilateral triangles, held at one side, in a process of its own, so that its peak memory is
its own. The model on paper, n vertices and m modes:

    factorization    about n log n numbers by nested dissection of a surface, n^(3/2) operations
    modes            some m solves with the factor, m n log n, and orthogonalization, m² n
    saved and run-time model   24 n m bytes of basis and 49 n of shell; on disk and in each process that runs it
    step             reads the basis once: 24 n m bytes, the bandwidth of memory
    frame            12 n bytes in each of PC2 and USD

Exponents are fitted to the measurements, and the projections carry them beyond: an order of magnitude, not a promise."""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy
import shellwarp

from .mesh_file import Drawn
from .point_cache import PointCacheFile
from .usd_cache import UsdFile

FRAMES = 24
REPEATS = 5   # of what is short; the least counts


def sheet(vertices):
    """About so many vertices in rows, twice as long as wide, of edge 1: positions, triangles, held."""
    columns = max(3, int(round((vertices / 2) ** 0.5)))
    rows = 2 * columns
    i, j = numpy.meshgrid(numpy.arange(rows), numpy.arange(columns), indexing="ij")
    positions = numpy.stack([i * 3 ** 0.5 / 2, j + 0.5 * (i % 2), 0.0 * i], axis=-1).reshape(-1, 3)
    a = (columns * numpy.arange(rows - 1)[:, None] + numpy.arange(columns - 1)).ravel()
    b, c, d = a + 1, a + columns, a + columns + 1
    even = ((a // columns) % 2 == 0)[:, None]
    first = numpy.where(even, numpy.stack([a, c, b], axis=-1), numpy.stack([a, c, d], axis=-1))
    second = numpy.where(even, numpy.stack([b, c, d], axis=-1), numpy.stack([a, d, b], axis=-1))
    return positions, numpy.concatenate([first, second]), numpy.arange(2 * columns)


def measure(vertices, modes):
    """One row, in this process, whose peak memory should be nobody else's."""
    positions, triangles, held = sheet(vertices)
    model = shellwarp.Model(shellwarp.Shell(positions, triangles, fixed=held))
    cpu, seconds = time.process_time(), _seconds(lambda: model.precompute(modes=modes, reduced_fields=0))
    cpu = time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    info, data = model.info(), model.save()
    row = {"vertices": info["n_vertices"], "modes": info["modes"], "precompute_s": seconds, "precompute_core_s": cpu, "peak_bytes": peak,
           "estimated_peak_bytes": info["bytes_precompute_peak"], "model_bytes": len(data), "state_bytes": info["bytes_state"],
           "save_s": _least(model.save), "load_s": _least(lambda: shellwarp.Model.load(data))}
    return {**row, **_frames(model, triangles)}


def _frames(model, triangles):
    with model.state("warp") as state, tempfile.TemporaryDirectory() as folder:
        state.set_gravity((0, 0, -1e-6))
        points = state.positions()
        makers = {"pc2": lambda path: PointCacheFile(path, len(points), 0, FRAMES),
                  "usd": lambda path: UsdFile(path, "a", Drawn(triangles), triangles, range(FRAMES), 24, "z", 1.0)}
        row = {"step_s": _least(lambda: state.step(1 / 24)), "positions_s": _least(lambda: state.positions(out=points))}
        for kind, make in makers.items():
            paths = [Path(folder) / f"{k}.{kind}{'c' * (kind == 'usd')}" for k in range(REPEATS)]
            seconds = min(_seconds(lambda path=path: _write(make(path), points)) for path in paths)
            row.update({f"{kind}_frame_s": seconds / FRAMES, f"{kind}_frame_bytes": paths[0].stat().st_size / FRAMES})
        return row


def _write(file, points):
    for frame in range(FRAMES):
        points[0, 0] = frame   # USD would store equal frames once
        file.append(points, points)   # as many velocities
    file.close()


def _seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _least(work):
    return min(_seconds(work) for _ in range(REPEATS))


def exponent(rows, x, y):
    """c and p of the least-squares fit y = c x^p."""
    p, logc = numpy.polyfit(numpy.log([row[x] for row in rows]), numpy.log([row[y] for row in rows]), 1)
    return float(numpy.exp(logc)), float(p)


def report(rows, modes):
    """The measured table, the fits over size at `modes`, and the projections: Markdown lines."""
    lines = ["| vertices | modes | precompute, s (core-s) | peak, MB | saved, MB | load, ms | step, µs | positions, µs "
             "| PC2, USD frame, ms |", "|" + "---|" * 9, *map(_table_line, rows)]
    large = [r for r in rows if r["modes"] == modes and r["vertices"] >= 3000]   # below, fixed costs hide the growth
    (c_time, p_time), (c_peak, p_peak) = exponent(large, "vertices", "precompute_core_s"), exponent(large, "vertices", "peak_bytes")
    step = min(r["step_s"] + r["positions_s"] for r in large[-1:]) / (large[-1]["vertices"] * modes)
    lines += ["", f"Fits at {modes} modes from {large[0]['vertices']:,} vertices on: precompute {c_time:.2e} n^{p_time:.2f} core-seconds, "
              f"peak memory {c_peak:.2e} n^{p_peak:.2f} bytes; step with positions {1e9 * step:.2f} ns a vertex and mode.", ""]
    return lines + _projections(modes, (c_time, p_time), (c_peak, p_peak), large)


def _table_line(r):
    return (f"| {r['vertices']:,} | {r['modes']} | {r['precompute_s']:.3g} ({r['precompute_core_s']:.3g}) "
            f"| {r['peak_bytes'] / 1e6:.0f} | {r['model_bytes'] / 1e6:.1f} | {1e3 * r['load_s']:.3g} "
            f"| {1e6 * r['step_s']:.4g} | {1e6 * r['positions_s']:.4g} | {1e3 * r['pc2_frame_s']:.2g}, {1e3 * r['usd_frame_s']:.2g} |")


def _projections(modes, time_fit, peak_fit, large):
    typical = min(large, key=lambda r: abs(r["vertices"] - 1e4))
    frame = typical["step_s"] + typical["positions_s"] + typical["pc2_frame_s"] + typical["usd_frame_s"]
    frame_bytes = typical["pc2_frame_bytes"] + typical["usd_frame_bytes"]
    lines = [f"- 10^6 assets of {typical['vertices']:,} vertices, {modes} modes: precompute "
             f"{1e6 * typical['precompute_core_s'] / 3600:,.0f} core-hours once, cache {1e6 * typical['model_bytes'] / 1e12:.1f} TB; each "
             f"240-frame shot of all {1e6 * 240 * frame / 3600:,.0f} core-hours and {1e6 * 240 * frame_bytes / 1e12:.0f} TB of both caches."]
    step = (large[-1]["step_s"] + large[-1]["positions_s"]) / large[-1]["vertices"]
    for n in (1e6, 1e7):
        seconds, peak = time_fit[0] * n ** time_fit[1], peak_fit[0] * n ** peak_fit[1]
        lines.append(f"- One asset of {n:.0e} vertices, {modes} modes: precompute {seconds / 3600:.2g} core-hours and {peak / 1e9:,.0f} GB, "
                     f"model {n * (24 * modes + 49) / 1e9:.1f} GB, a step {step * n:.2f} s.")
    return lines


def main(arguments):
    parser = argparse.ArgumentParser(prog="shellwarp_farm costs", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for costs.json and costs.md")
    parser.add_argument("--vertices", type=int, nargs="+", default=[1000, 3000, 10000, 30000, 100000])
    parser.add_argument("--modes", type=int, nargs="+", default=[16, 4, 64],
                        help="the first with every size, the others with 10000 vertices")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measure(options.vertices[0], options.modes[0])))
        return 0
    pairs = [(n, options.modes[0]) for n in options.vertices] + [(10000, m) for m in options.modes[1:]]
    rows = [_elsewhere(n, m) for n, m in pairs]
    lines = report(rows, options.modes[0])
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "costs.json").write_text(json.dumps(rows, indent=1))
    (options.out / "costs.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))
    return 0


def _elsewhere(vertices, modes):
    command = [sys.executable, "-m", "shellwarp_farm", "costs", "--one", "--out", ".", "--vertices", str(vertices), "--modes", str(modes)]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
