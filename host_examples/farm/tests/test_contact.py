"""Claims about colliders and sheets in jobs: the library's own motion, and named refusals."""

import gc
import tempfile
import unittest
import warnings
from pathlib import Path
from unittest import mock

import numpy
import shellwarp
import small

from shellwarp_farm import colliders
from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import bake, hash_of
from shellwarp_farm.materials import material_of
from shellwarp_farm.model import model_key, model_tables, prepare, shell_of
from shellwarp_farm.scenes import expand, read_list
from shellwarp_farm.simulated import mesh_at

LIST = """
formats = ["pc2"]
[[asset]]
name = "card"
mesh = "card.obj"
material = { k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }
support = [{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }]
simulation = { modes = 6, method = "warp" }
damping = { ratio = 0.1 }
collider = [COLLIDER]
[[shot]]
name = "one"
frames = [0, 9]
simulation = { gravity = [0, 0, -9.8] }
[[shot]]
name = "two"
after = "one"
frames = [10, 20]
simulation = { gravity = [0, 0, -9.8] }
[[shot]]
name = "both"
frames = [0, 20]
simulation = { gravity = [0, 0, -9.8] }
"""
BALL = ('{ kind = "sphere", radius = 0.02, friction = 0.3, position = [0.09, 0.01, -0.03], '
        'key = [{ time = 0.3, offset = [0, 0, 0.02] }] }')
TOP = 0.001
CUBE = "\n".join(["v %g %g %g" % (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-0.05, -TOP)] +
                 [f"f {a} {b} {c}" for a, b, c in ((1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2),
                                                   (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5), (2, 6, 8), (2, 8, 4))]) + "\n"


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / "cube.obj").write_text(CUBE)

    def jobs(self, collider, text=LIST):
        return {job["shot"]: job for job in small.jobs(self.folder, text.replace("COLLIDER", collider))}

    def bake(self, job, before=None):
        cache = self.folder / "cache"
        record = bake(job, prepare(model_tables(job), cache), before, self.folder / "out", cache)
        self.assertNotIn("failed", record)
        data = (self.folder / "out" / f"{job['name']}.pc2").read_bytes()
        n, frames = numpy.frombuffer(data, "<i4", 1, 16)[0], numpy.frombuffer(data, "<i4", 1, 28)[0]
        return record, numpy.frombuffer(data, "<f4", offset=32).reshape(frames, n, 3)

    def failed(self, job):
        cache = self.folder / "cache"
        return bake(job, prepare(model_tables(job), cache), None, self.folder / "out", cache)["failed"]


class Contact(Case):
    def test_a_bake_is_the_librarys_motion(self):
        job = self.jobs(BALL)["both"]
        record, frames = self.bake(job)
        positions, triangles = mesh_at(job["mesh"])
        material = shellwarp.Material(5e3, 5e3, 2.7e-3, 0.3)
        model = shellwarp.Model(shellwarp.Shell(positions, triangles, material, fixed=range(6)))
        model.precompute(modes=6, reduced_fields=0)
        state = model.state()
        state.set_gravity((0, 0, -9.8))
        state.set_damping(0.1)
        state.set_colliders([shellwarp.Collider.sphere(0.02, friction=0.3)])
        for frame in range(21):
            s = min(1.0, frame / 30 / 0.3)
            place = (0.09, 0.01, -0.03 + 0.02 * s * s * (3 - 2 * s))  # two keys, at rest at both
            state.move_collider(0, place, teleport=frame == 0)
            if frame:
                state.step(1 / 30)
            # 1e-7: the formula here and the farm's round their last bits apart
            self.assertLess(numpy.abs(frames[frame] - state.positions()).max(), 1e-7, frame)
        self.assertGreater(record["range"]["contact_count"], 0)
        self.assertLess(record["range"]["deepest_penetration"], 1e-5)

    def test_a_shot_goes_on_touching_where_the_one_before_ended(self):
        jobs = self.jobs(BALL)
        record, first = self.bake(jobs["one"])
        second = self.bake(jobs["two"], record)[1]
        self.assertTrue(numpy.array_equal(numpy.concatenate([first, second]), self.bake(jobs["both"])[1]))

    def test_every_kind_holds_the_card_up(self):
        free = self.bake(self.jobs("")["both"])[1]
        self.assertLess(free[:, :, 2].min(), -2 * TOP)
        for text in (f'kind = "plane", position = [0, 0, -{TOP}]', f'kind = "plane", normal = [0, 0, 2], position = [1, 0, -{TOP}]',
                     f'kind = "box", half_extents = [1, 1, 0.1], position = [0, 0, -{0.1 + TOP}]', 'kind = "hull", mesh = "cube.obj"',
                     f'kind = "capsule", half_length = 1, radius = 1, position = [0.1, 0, -{1 + TOP}], rotate_degrees = [90, 0, 0]'):
            with self.subTest(text):
                record, frames = self.bake(self.jobs(f"{{ {text} }}")["both"])
                self.assertGreater(frames[:, :, 2].min(), -1.5 * TOP)  # the capsule is round: its sides are lower
                self.assertGreater(record["range"]["contact_count"], 0)

    def test_a_job_is_another_with_another_collider_or_another_mesh_in_its_file(self):
        job = self.jobs('{ kind = "hull", mesh = "cube.obj" }')["both"]
        first = hash_of(job, "key", None)
        (self.folder / "cube.obj").write_text(CUBE.replace(f"-{TOP:g}", "-0.002"))
        self.assertNotEqual(hash_of(job, "key", None), first)
        self.assertNotEqual(hash_of({**job, "collider": []}, "key", None), first)

    def test_a_job_that_fails_while_writing_leaves_no_file_open(self):
        job = self.jobs(BALL, LIST.replace('["pc2"]', '["pc2", "usd"]'))["one"]
        step, steps = shellwarp.State.step, iter(range(5))

        def fails(state, seconds):
            if next(steps, None) is None:
                raise shellwarp.NumericalError("of a test")
            step(state, seconds)

        with warnings.catch_warnings(record=True) as told, mock.patch.object(shellwarp.State, "step", fails):
            warnings.simplefilter("always")
            self.assertIn("of a test", self.failed(job))
            gc.collect()
        self.assertEqual([str(item.message) for item in told if issubclass(item.category, ResourceWarning)], [])
        self.assertEqual([path.suffix for path in (self.folder / "out").rglob("*") if path.is_file()], [".log"])

    def test_an_open_mesh_is_solid_behind_its_triangles_where_it_is_one_sided(self):
        (self.folder / "ground.obj").write_text(f"v -1 -1 -{TOP}\nv 1 -1 -{TOP}\nv 1 1 -{TOP}\nv -1 1 -{TOP}\nf 1 2 3 4\n")
        for text in ("", ", cells = 32, depth = 0.2"):
            with self.subTest(text):
                record, frames = self.bake(self.jobs(f'{{ kind = "mesh", mesh = "ground.obj", one_sided = true{text} }}')["both"])
                self.assertGreater(frames[:, :, 2].min(), -1.1 * TOP)
                self.assertGreater(record["range"]["contact_count"], 0)
        with self.assertRaisesRegex(SceneError, "collider 1: depth goes with one_sided = true"):
            self.jobs('{ kind = "mesh", mesh = "ground.obj", depth = 0.1 }')
        with self.assertRaisesRegex(SceneError, "collider 1: a sphere has no one_sided"):
            self.jobs('{ kind = "sphere", radius = 1, one_sided = true }')

    def test_what_is_no_solid_is_named(self):
        self.assertIn("collider 2, a mesh: the mesh is open", self.failed(self.jobs(f'{BALL}, {{ kind = "mesh", mesh = "card.obj" }}')["one"]))
        self.assertRegex(self.failed(self.jobs('{ kind = "sphere", radius = -1 }')["one"]), "collider 1, a sphere: .*-1")
        self.assertIn("none.obj", self.failed(self.jobs('{ kind = "hull", mesh = "none.obj" }')["one"]))

    def test_keys_are_met_and_never_overshot(self):
        keys = [{"time": t, "offset": [0, 0, z], "rotate_degrees": [0, 0, 10 * z]} for t, z in ((1, 1), (2, 1), (3, 4), (4, 2))]
        item = {"kind": "plane", "key": keys}
        for key in keys:
            self.assertAlmostEqual(colliders.pose(item, key["time"])[0][2], key["offset"][2])
        heights = numpy.array([colliders.pose(item, t)[0][2] for t in numpy.linspace(0, 5, 501)])
        self.assertTrue(((heights[100:201] - 1) ** 2 < 1e-20).all())
        self.assertTrue((numpy.diff(heights[:301]) >= -1e-12).all() and heights.max() <= 4 and (heights[400:] == 2).all())

    def test_a_normal_turns_z_to_it(self):
        for normal in ((0, 0, 1), (0, 0, -2), (1, 2, 3), (0, 5, 0)):
            rotation = colliders.pose({"kind": "plane", "normal": normal}, 0)[1]
            self.assertLess(numpy.abs(rotation[:, 2] - numpy.array(normal) / numpy.linalg.norm(normal)).max(), 1e-12)


class Sheets(Case):
    def test_a_preset_is_the_librarys_and_numbers_go_over_its_own(self):
        card = shellwarp.Sheet.known("card")
        self.assertEqual(material_of({"preset": "card"}), card)
        self.assertEqual(material_of({"preset": "card", "thickness": 1e-3}),
                         shellwarp.Sheet(card.young, card.poisson, 1e-3, card.volume_density))
        self.assertEqual(material_of({"young": 1e9, "poisson": 0.3, "thickness": 1e-3, "volume_density": 900}),
                         shellwarp.Sheet(1e9, 0.3, 1e-3, 900))

    def test_what_is_no_material_is_named(self):
        for table, message in (({"k_bend": 1, "young": 1e9}, "k_bend does not go with young"),
                               ({"young": 1e9, "poisson": 0.3, "thickness": 1e-3}, "a sheet needs volume_density"),
                               ({"preset": "card", "young_across": 1e9}, "young_across and direction go together"),
                               ({"k_bend": 1, "direction": [1, 0, 0]}, "k_bend does not go with direction"),
                               ({"preset": "cardd"}, "no known material is called 'cardd'")):
            with self.subTest(message), self.assertRaisesRegex((SceneError, shellwarp.ShellwarpError), message):
                material_of(table)

    def test_a_clamped_sheet_is_held_where_the_list_says_and_no_further(self):
        text = LIST.replace("{ k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }", '{ preset = "card" }')
        job = self.jobs("", text.replace('kind = "fixed"', 'kind = "clamped"'))["one"]
        shell = shell_of(model_tables(job))
        self.assertEqual((list(shell.fixed), list(shell.clamped)), ([], [0, 1, 2, 3, 4, 5]))

    def test_a_sheet_sags_more_where_its_grain_runs_across_and_is_another_model(self):
        old = "{ k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }"
        grain = LIST.replace(old, '{ preset = "card", young_across = 3e8, direction = [1, 0, 0] }')
        along, across = [model_tables(self.jobs("", grain.replace("[1, 0, 0]", axis))["one"]) for axis in ("[1, 0, 0]", "[0, 1, 0]")]
        self.assertNotEqual(model_key(along), model_key(across))
        self.assertEqual((shell_of(across).directions, shell_of(across).material.young_across), ([0, 1, 0], 3e8))

    def test_a_job_bakes_a_sheet_and_a_parameter_may_choose_it(self):
        old = "{ k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }"
        text = LIST.replace(old, '{ preset = "card" }').replace("[[shot]]", '[parameters]\n"material.preset" = ["card", "steel"]\n[[shot]]', 1)
        small.write_list(self.folder, text.replace("COLLIDER", ""))
        ends = [self.bake(job)[1][-1] for job in expand(read_list(self.folder / "list.toml")) if job["shot"] == "both"]
        self.assertEqual(len(ends), 2)
        self.assertLess(ends[0][:, 2].min(), 2 * ends[1][:, 2].min())  # card sags more than steel


if __name__ == "__main__":
    unittest.main()
