"""Precompute of the dinosaur against SciPy's eigsh(K, k, M=M, sigma=0) on the same matrices, in the same run.

usage: precompute_vs_scipy.py [--modes 4] [--runs 3] [--limit 3]

Ours is everything from the mesh file to a model that can be stepped: reading, topology, assembly, ordering, factorization,
modes, certificate (a second factorization), modal rotations. SciPy's is the call to eigsh alone. Exits with an error when
the eigenvalues disagree or ours takes more than 1/LIMIT of SciPy's time. `make bench-precompute` runs it.
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

ROOT = Path(__file__).resolve().parents[2]


def ours(modes, runs, directory):
    """Runs the library's precompute; returns its report and leaves K.mtx and M.mtx in `directory`."""
    command = ["cargo", "run", "--release", "--quiet", "--example", "precompute", "--"]
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--limit", type=float, default=3.0, help="ours must be this many times faster")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        report = ours(options.modes, options.runs, directory)
        seconds, values = scipys(options.modes, options.runs, directory)
    error = np.max(np.abs(values / report["eigenvalues"] - 1))
    best, theirs = min(report["seconds"]), min(seconds)
    phases = dict(zip(["assembly", "ordering", "factorization", "modes", "certificate", "rotation"], report["phases"]))
    print(f"{report['unknowns']} unknowns, {options.modes} modes, best of {options.runs} runs on this machine")
    print(f"  shellwarp, file to model   {best:8.3f} s   " + ", ".join(f"{k} {v:.3f}" for k, v in phases.items()))
    print(f"  SciPy {scipy.__version__} eigsh alone   {theirs:8.3f} s")
    print(f"  ratio {best / theirs:.3f}; eigenvalues agree to {error:.1e}")
    # eigsh stops at rounding of the factorization, 1e-16 ||K|| relative to the first eigenvalue.
    good = error < 1e-6 and best * options.limit <= theirs
    print("bench-precompute: " + ("OK" if good else "FAILED"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
