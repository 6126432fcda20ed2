"""Claims about sweeps and costs: the errors are those of an independent implementation, and one table holds all."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy
import small
from pyarrow import csv, parquet

from shellwarp_farm import costs
from shellwarp_farm.engine import Engine
from shellwarp_farm.errors import SceneError
from shellwarp_farm.scenes import read_list
from shellwarp_farm.sweep import cases, sweep

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
STRIP = f"""
[[asset]]
name = "strip"
mesh = "{DATA / 'meshes' / 'flat_beam.obj'}"
material = {{ k_area = 1e4, k_length = 1e4, k_bend = 1, density = 1 }}
support = [{{ kind = "fixed", box = [-0.01, -1, -1, 0.11, 1, 1] }}]
simulation = {{ gravity = [0, 0, -0.1] }}
[sweep]
methods = ["lma", "warp"]
modes = [8]
loads = [1, 4]
"""


def read(folder, text):
    path = Path(folder) / "list.toml"
    path.write_text(text)
    return read_list(path)


class Sweep(unittest.TestCase):
    def test_errors_are_those_of_an_independent_implementation_in_one_table_and_a_second_run_measures_nothing(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        todo = cases(read(folder, STRIP))
        with Engine(workers=2) as engine:
            first, second = sweep(engine, todo, folder / "out"), sweep(engine, todo, folder / "out")
        self.assertEqual([r["done"] for r in first + second], ["measured", "measured", "found", "found"])
        table = parquet.read_table(folder / "out" / "sweep.parquet").to_pylist()
        self.assertEqual(len(csv.read_csv(folder / "out" / "sweep.csv")), len(table))
        self.assertGreater((folder / "out" / "sweep.png").stat().st_size, 10000)
        reference = {abs(numpy.array(e["gravity"])).max(): e for e in json.loads((DATA / "reference/flat_beam.json").read_text())["equilibria"]}
        for row in table:
            expected = reference[round(0.1 * row["load"], 3)][{"lma": "rel_l2_error_lma", "warp": "rel_l2_error_mwts"}[row["method"]]]
            self.assertAlmostEqual(row["error_by_vertex"], expected, delta=1e-5)   # a basis in 32 bits, 1e-6, and its equilibrium
            self.assertAlmostEqual(row["error"] / expected, 1, delta=0.05)   # the rim counts half by mass

    def test_a_sweep_without_what_it_scales_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            for old, new, message in [("gravity = [0, 0, -0.1]", "modes = 4", "has no simulation.gravity"),
                                      ("k_bend = 1,", "", "which asset strip does not give"), ("loads", "lodas", "unknown key 'lodas'")]:
                with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                    cases(read(folder, STRIP.replace(old, new).replace("modes = [8]", "modes = [8]\nbending = [2]")))


class Costs(unittest.TestCase):
    def test_the_sheet_is_near_equilateral_and_sizes_are_as_on_paper(self):
        positions, triangles, _ = costs.sheet(500)
        edges = positions[triangles] - positions[numpy.roll(triangles, 1, axis=1)]
        self.assertLess(numpy.abs(numpy.linalg.norm(edges, axis=2) - 1).max(), 1e-12)
        row = costs.measure(2000, 8)
        n = row["vertices"]
        self.assertAlmostEqual(row["model_bytes"] / (n * (24 * 8 + 49)), 1, delta=0.02)   # headers and checksum
        self.assertEqual(row["pc2_frame_bytes"], 12 * n + 32 / costs.FRAMES)
        self.assertGreater(row["usd_frame_bytes"], 12 * n)

    def test_an_exponent_is_found(self):
        c, p = costs.exponent([{"n": n, "t": 3 * n ** 1.5} for n in (10, 100, 1000)], "n", "t")
        self.assertAlmostEqual(c, 3)
        self.assertAlmostEqual(p, 1.5)


if __name__ == "__main__":
    unittest.main()
