"""Precompute of the dinosaur against SciPy's eigsh(K, k, M=M, sigma=0) on the same matrices, in the same run.

usage: precompute_vs_scipy.py [--modes 4 32] [--runs 3] [--limit 3] [--docs FILE]

Ours is everything from the mesh file to a model that can be stepped: reading, topology, assembly, ordering, factorization,
modes, certificate (a second factorization), modal rotations. SciPy's is the call to eigsh alone. Exits with an error when
the eigenvalues disagree or ours takes more than 1/LIMIT of SciPy's time; the goal is 1/8. With --docs the table goes into
this machine's section of FILE. `make bench-precompute` runs it.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy
from scipy.io import mmread
from scipy.sparse.linalg import eigsh

from sections import put_section

ROOT = Path(__file__).resolve().parents[2]


def ours(modes, runs, directory):
    """Runs the library's precompute; returns its report and leaves K.mtx and M.mtx in `directory`."""
    command = ["cargo", "run", "--locked", "--release", "--quiet", "--example", "precompute", "--"]
    done = subprocess.run(command + [str(modes), str(runs), directory], cwd=ROOT, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


def scipys(modes, runs, directory):
    """Seconds of each run, and the eigenvalues."""
    stiffness, mass = (mmread(os.path.join(directory, name)).tocsc() for name in ("K.mtx", "M.mtx"))
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        values, _ = eigsh(stiffness, k=modes, M=mass, sigma=0)
        seconds.append(time.perf_counter() - start)
    return seconds, np.sort(values)


PHASES = ["assembly", "ordering", "factorization", "modes", "certificate", "rotation"]


def compare(modes, runs):
    """Our report, the least seconds of ours and SciPy's, and the largest relative difference of eigenvalues."""
    with tempfile.TemporaryDirectory() as directory:
        report = ours(modes, runs, directory)
        seconds, values = scipys(modes, runs, directory)
    return report, min(report["seconds"]), min(seconds), np.max(np.abs(values / report["eigenvalues"] - 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, nargs="+", default=[4, 32])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--limit", type=float, default=3.0, help="ours must be this many times faster")
    parser.add_argument("--docs", help="a document with a line <!-- end of scipy -->")
    options = parser.parse_args()
    good, rows = True, ""
    for modes in options.modes:
        report, best, theirs, error = compare(modes, options.runs)
        phases = ", ".join(f"{name} {seconds:.3f}" for name, seconds in zip(PHASES, report["phases"]))
        print(f"{report['unknowns']} unknowns, {modes} modes, best of {options.runs} runs on this machine")
        print(f"  shellwarp, file to model   {best:8.3f} s   {phases}")
        print(f"  SciPy {scipy.__version__} eigsh alone   {theirs:8.3f} s")
        print(f"  ratio {best / theirs:.3f}; eigenvalues agree to {error:.1e}")
        rows += f"| {modes} | {best:.3f} | {theirs:.3f} | {best / theirs:.3f} | 0.125 |\n"
        # eigsh stops at rounding of the factorization, 1e-16 ||K|| relative to the first eigenvalue.
        good &= error < 1e-6 and best * options.limit <= theirs
    if options.docs:
        head = f"## Against SciPy {scipy.__version__}'s eigsh, on {report['machine']}\n\n"
        head += f"The load was {os.getloadavg()[0]:.1f} after. Least of {options.runs} runs of each, the dinosaur.\n\n"
        head += "| modes | file to model, s | eigsh alone, s | ratio | goal |\n| --- | --- | --- | --- | --- |\n"
        put_section(options.docs, f"scipy {report['machine']}", head + rows)
    print("bench-precompute: " + ("OK" if good else "FAILED"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
