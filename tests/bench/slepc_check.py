"""The dinosaur's eigenvalues by SLEPc on PETSc's matrices, from the exported Matrix Market files, against the library's own.

usage: slepc_check.py [--modes 16] [--matrices DIR] [--processes N]

Builds and runs the example `precompute`, which writes K.mtx and M.mtx and reports the library's eigenvalues, then solves
K φ = λ M φ by SLEPc's Krylov-Schur with shift and invert, factorized by MUMPS. Exits with an error when they disagree. Where there
is no slepc4py it says so in a line that begins with "skipped: " and succeeds. Debian: apt install python3-slepc4py, which the
system's python3 then finds; --processes runs it under mpirun. `make bench-slepc` runs it.
"""

import argparse
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Solving with a factor of K moves eigenvalues by a unit of rounding of ||M^(-1/2) K M^(-1/2)|| at most or so, which weighs most
# against the lowest of them.


def find_slepc():
    """Debian keeps both packages out of the usual path, for several builds to lie side by side."""
    for pattern in ("/usr/lib/petscdir/petsc*/*-real/lib/python3/dist-packages", "/usr/lib/slepcdir/slepc*/*-real/lib/python3/dist-packages"):
        sys.path += sorted(glob.glob(pattern))
    try:
        from petsc4py import PETSc
        from slepc4py import SLEPc
    except (ImportError, ValueError) as error:   # ValueError: built for another numpy
        return None, None, str(error)
    return PETSc, SLEPc, ""


def export(modes, directory):
    """The library's precompute; returns its report and leaves K.mtx and M.mtx in `directory`."""
    command = ["cargo", "run", "--locked", "--release", "--quiet", "--example", "precompute", "--", str(modes), "1", directory]
    return json.loads(subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout)


def read_entries(path):
    """A Matrix Market file "coordinate real symmetric": n, and rows, columns and values of both triangles, in order."""
    import numpy
    with open(path, encoding="ascii") as file:
        if file.readline().split() != ["%%MatrixMarket", "matrix", "coordinate", "real", "symmetric"]:
            raise SystemExit(f"{path}: not a symmetric Matrix Market file")
        n, _, count = map(int, file.readline().split())
        numbers = numpy.fromstring(file.read(), sep=" ").reshape(count, 3)
    i, j = numbers[:, 0].astype(int) - 1, numbers[:, 1].astype(int) - 1
    off = i != j
    rows, columns = numpy.concatenate([i, j[off]]), numpy.concatenate([j, i[off]])
    values = numpy.concatenate([numbers[:, 2], numbers[off, 2]])
    order = numpy.lexsort((columns, rows))
    return n, rows[order], columns[order], values[order]


def scaled_norm(directory):
    """The 1-norm of M^(-1/2) K M^(-1/2), from the exported files."""
    import numpy
    n, rows, columns, values = read_entries(os.path.join(directory, "K.mtx"))
    root = numpy.sqrt(read_entries(os.path.join(directory, "M.mtx"))[3])
    return numpy.bincount(rows, numpy.abs(values) / (root[rows] * root[columns]), n).max()


def read_symmetric(PETSc, path):
    """The same as a PETSc matrix; each process keeps its own rows."""
    import numpy
    n, rows, columns, values = read_entries(path)
    matrix = PETSc.Mat().create()
    matrix.setSizes(n)
    matrix.setType("aij")
    matrix.setUp()
    low, high = matrix.getOwnershipRange()
    mine = slice(*numpy.searchsorted(rows, [low, high]))
    starts = numpy.searchsorted(rows[mine], numpy.arange(low, high + 1))
    types = (PETSc.IntType, PETSc.IntType, PETSc.ScalarType)
    csr = tuple(a.astype(t) for a, t in zip((starts, columns[mine], values[mine]), types))
    return PETSc.Mat().createAIJ(((high - low, n), (high - low, n)), csr=csr)


def solve(PETSc, SLEPc, directory, modes):
    """The lowest eigenvalues and the seconds of the solve, files not counted."""
    stiffness, mass = (read_symmetric(PETSc, os.path.join(directory, name)) for name in ("K.mtx", "M.mtx"))
    start = time.perf_counter()
    solver = SLEPc.EPS().create()
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(modes)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(0.0)
    solver.setTolerances(1e-12, 500)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    direct = transform.getKSP()
    direct.setType("preonly")
    direct.getPC().setType("cholesky")
    direct.getPC().setFactorSolverType("mumps")
    solver.solve()
    seconds = time.perf_counter() - start
    if solver.getConverged() < modes:
        raise SystemExit(f"SLEPc found {solver.getConverged()} of {modes} eigenvalues")
    return sorted(solver.getEigenvalue(k).real for k in range(modes)), seconds


def compare(report, norm, values, seconds, processes, version):
    """Prints both and tells whether they agree."""
    limit = sys.float_info.epsilon * norm / values[0]
    error = max(abs(theirs / ours - 1) for ours, theirs in zip(report["eigenvalues"], values))
    print(f"{report['unknowns']} unknowns, {len(values)} modes")
    print(f"  shellwarp, file to model {min(report['seconds']):8.3f} s")
    print(f"  SLEPc {version}, MUMPS   {seconds:8.3f} s on {processes} process{'es' if processes > 1 else ''}")
    print(f"  lowest {values[0]:.10g}, highest {values[-1]:.10g}; eigenvalues agree to {error:.1e}; "
          f"rounding allows {limit:.1e}")
    good = error < limit
    print("slepc-check: " + ("OK" if good else "FAILED"))
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, default=16)
    parser.add_argument("--matrices", help="folder for K.mtx, M.mtx and report.json; kept, and used again if there (default: none)")
    parser.add_argument("--processes", type=int, default=1, help="MPI processes; one alone goes first")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    directory = options.matrices or tempfile.mkdtemp()
    try:
        return run(options, directory)
    finally:
        if not options.matrices:
            shutil.rmtree(directory, ignore_errors=True)


def run(options, directory):
    facts = Path(directory) / "report.json"
    if options.processes > 1 and not options.child:   # before MPI starts in this process: one inside another does not
        alone = [sys.executable, __file__, "--modes", str(options.modes), "--matrices", directory]
        done = subprocess.run(alone, check=False)
        if done.returncode or not facts.is_file():
            return done.returncode
        mpirun = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", str(options.processes)]
        return subprocess.run([*mpirun, *alone, "--child"], check=False).returncode
    PETSc, SLEPc, missing = find_slepc()
    if missing:
        print(f"skipped: no SLEPc ({missing}); Debian: apt install python3-slepc4py")
        return 0
    if not facts.is_file():
        Path(directory).mkdir(parents=True, exist_ok=True)
        facts.write_text(json.dumps(export(options.modes, directory)))
    values, seconds = solve(PETSc, SLEPc, directory, options.modes)
    if PETSc.COMM_WORLD.getRank():
        return 0
    version = ".".join(map(str, SLEPc.Sys.getVersion()))
    size = PETSc.COMM_WORLD.getSize()
    return 0 if compare(json.loads(facts.read_text()), scaled_norm(directory), values, seconds, size, version) else 1


if __name__ == "__main__":
    sys.exit(main())
