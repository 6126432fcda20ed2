"""Claims about content hashes: they change with every input that matters, and with nothing else."""

import copy
import shutil
import tempfile
import unittest
from pathlib import Path

import numpy
import small

from shellwarp_farm import job as jobs
from shellwarp_farm.content import content_hash
from shellwarp_farm.model import model_key, model_tables


class Values(unittest.TestCase):
    def test_no_two_different_values_look_alike(self):
        values = [None, "", "a", "ab", ["a", "b"], ["ab"], [["a"], "b"], 0, 1, 1.5, True, False, [], {}, {"a": 1}, {"b": 1},
                  {"a": {"b": 1}}, [1, 2], [[1], 2], numpy.array([1.0, 2.0]), numpy.array([[1.0, 2.0]]), numpy.array([1, 2]),
                  numpy.array([1.0, numpy.nextafter(2.0, 3.0)])]
        self.assertEqual(len({content_hash(value) for value in values}), len(values))

    def test_equal_values_have_equal_hashes_however_they_are_stored(self):
        for a, b in [(1, 1.0), (-0.0, 0), ({"a": 1, "b": 2}, {"b": 2, "a": 1}), ((1, 2), [1, 2]),
                     (numpy.arange(6.0).reshape(2, 3), numpy.asfortranarray(numpy.arange(6, dtype=numpy.float32).reshape(2, 3))),
                     (numpy.array([3], numpy.uint32), numpy.array([3], numpy.int64))]:
            self.assertEqual(content_hash(a), content_hash(b))

    def test_what_it_does_not_know_is_refused(self):
        self.assertRaises(TypeError, content_hash, object())


class Models(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.job = small.jobs(self.folder)[0]
        self.tables = model_tables(self.job)
        self.key = model_key(self.tables)

    def changed(self, **changes):
        return model_key({**self.tables, **changes})

    def test_mesh_material_supports_and_options_change_it(self):
        small.write_obj(self.folder / "longer.obj", 0.011)
        for changes in [{"mesh": str(self.folder / "longer.obj")}, {"material": {**self.tables["material"], "density": 0.31}},
                        {"support": [{"kind": "fixed", "vertices": [0, 1, 2]}]},
                        {"options": {"modes": 7, "precision": "f32"}}, {"options": {"modes": 6, "precision": "f64"}}]:
            with self.subTest(changes=changes):
                self.assertNotEqual(self.changed(**changes), self.key)
        for name in ("k_area", "k_length", "k_bend"):
            self.assertNotEqual(self.changed(material={**self.tables["material"], name: 123.0}), self.key)

    def test_a_file_written_anew_with_other_content_changes_it(self):
        small.write_obj(self.folder / "card.obj", 0.0100000001)
        self.assertNotEqual(model_key(self.tables), self.key)

    def test_where_the_mesh_lies_and_how_supports_are_named_does_not(self):
        text = (self.folder / "card.obj").read_text()
        (self.folder / "copy.obj").write_text("# the same\n" + text.replace(" 0\n", " -0.0\n"))
        self.assertEqual(self.changed(mesh=str(self.folder / "copy.obj")), self.key)
        for support in [[{"kind": "fixed", "vertices": [5, 4, 3, 2, 1, 0, 0]}], [{"kind": "fixed", "box": [-1, -1, -1, 0.015, 1, 1]}],
                        [{"kind": "clamped", "vertices": [0, 1, 2]}],
                        [{"kind": "fixed", "vertices": [0, 1, 2]}, {"kind": "fixed", "vertices": [3, 4, 5]}]]:
            self.assertEqual(self.changed(support=support), self.key)


class Jobs(unittest.TestCase):
    def test_everything_that_its_outputs_depend_on_changes_its_hash(self):
        with tempfile.TemporaryDirectory() as folder:
            self.try_all(small.jobs(folder)[0])

    def try_all(self, job):
        base = jobs.hash_of(job, "model", None)
        changes = {"frames": [0, 6], "seed": 3, "formats": ["pc2"], "up_axis": "y", "metres_per_unit": 0.01, "force": [{"vertex": 3, "vector": [0, 0, 1]}],
                   "damping": {"ratio": 0.06}, "wind": {**job["wind"], "gust": 0.6}, "frame": {"translate": []}, "name": "other"}
        changes["simulation"] = {**job["simulation"], "gravity": [0, 0, -2]}
        hashes = {jobs.hash_of({**job, key: value}, "model", None) for key, value in changes.items()}
        hashes |= {jobs.hash_of(job, "another model", None), jobs.hash_of(job, "model", numpy.zeros(3, numpy.uint8)), base}
        self.assertEqual(len(hashes), len(changes) + 3)

    def test_nothing_else_does(self):
        with tempfile.TemporaryDirectory() as folder:
            job = small.jobs(folder)[0]
            moved = copy.deepcopy(job)
            moved["mesh"], moved["after"] = str(Path(folder) / "moved.obj"), None   # what it comes after is handed over beside the job
            shutil.copy(job["mesh"], moved["mesh"])
            self.assertEqual(jobs.hash_of(job, "model", None), jobs.hash_of(moved, "model", None))


if __name__ == "__main__":
    unittest.main()
