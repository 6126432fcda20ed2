"""The precompute of the dinosaur beside SciPy's eigsh on the same matrices: tests/bench/precompute_vs_scipy.py, as JSON.

usage: eigsh_scipy.py [RUNS]
"""

import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
import numpy as np
import precompute_vs_scipy as bench
import scipy


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    with tempfile.TemporaryDirectory() as directory:
        report = bench.ours(4, runs, directory)
        seconds, values = bench.scipys(4, runs, directory)
    print(
        json.dumps(
            {
                "scipy": scipy.__version__,
                "unknowns": report["unknowns"],
                "modes": 4,
                "runs": runs,
                "ours_seconds": min(report["seconds"]),
                "scipy_seconds": min(seconds),
                "eigenvalues_apart": float(np.max(np.abs(values / report["eigenvalues"] - 1))),
            }
        )
    )


if __name__ == "__main__":
    main()
