"""Claims about what holds and leads a job's shell: axes, supports that move, ties and handles."""

import unittest

import numpy
import shellwarp
import small
from test_contact import LIST, Case

from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import hash_of
from shellwarp_farm.model import model_key, model_tables, shell_of
from shellwarp_farm.scenes import expand, read_list
from shellwarp_farm.simulated import mesh_at
from shellwarp_farm.way import at

FIXED = '{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }'
STILL = LIST.replace("gravity = [0, 0, -9.8]", "gravity = [0, 0, 0]")


def with_keys(text, keys):
    """A list whose asset has more tables."""
    return text.replace("damping = {", f"{keys}\ndamping = {{", 1)


class Supports(Case):
    def test_a_support_by_axis_holds_along_that_alone(self):
        """The card's far end rests on a rail: it stays at its height and moves along."""
        text = LIST.replace(FIXED, f'{FIXED}, {{ side = "high-x", axes = "z" }}')
        job = self.jobs("", text)["both"]
        self.assertEqual(shell_of(model_tables(job)).axes, {36: "z", 37: "z", 38: "z"})
        half = LIST.replace(FIXED, f'{FIXED}, {{ side = "high-x", axes = "x", symmetric = true }}')
        shell = shell_of(model_tables(self.jobs("", half)["both"]))
        self.assertEqual((shell.axes, shell.symmetric), ({}, {36: "x", 37: "x", 38: "x"}))
        free, held = self.bake(self.jobs("", LIST)["both"])[1], self.bake(job)[1]
        self.assertLess(free[-1, 36:, 2].max(), -1e-3)
        self.assertLess(numpy.abs(held[:, 36:, 2]).max(), 1e-6)
        self.assertLess(held[-1, 21, 2], -1e-5)  # it sags between
        self.assertNotEqual(model_key(model_tables(job)), model_key(model_tables(self.jobs("", text.replace('"z"', '"yz"'))["both"])))

    def test_a_support_goes_through_its_keys_exactly_and_a_shot_goes_on(self):
        keys = 'key = [{ time = 0.5, offset = [0, 0, 0.02], rotate_degrees = [20, 0, 0] }]'
        text = STILL.replace(FIXED, f'{FIXED}, {{ side = "high-x", {keys} }}')
        jobs = self.jobs("", text)
        self.assertEqual(model_tables(jobs["both"])["options"]["support_fields"], 24)
        record, frames = self.bake(jobs["both"])
        rest = mesh_at(jobs["both"]["mesh"])[0]
        about = rest[36:].mean(axis=0)
        for frame in (0, 5, 15, 20):
            offset, turn = at([{"time": 0.5, "offset": [0, 0, 0.02], "rotate_degrees": [20, 0, 0]}], frame / 30)
            angle = numpy.radians(turn[0])
            rotation = numpy.array([[1, 0, 0], [0, numpy.cos(angle), -numpy.sin(angle)], [0, numpy.sin(angle), numpy.cos(angle)]])
            self.assertLess(numpy.abs(frames[frame, 36:] - (about + offset + (rest[36:] - about) @ rotation.T)).max(), 1e-7, frame)
            self.assertLess(numpy.abs(frames[frame, :6] - rest[:6]).max(), 1e-7, frame)
        before, first = self.bake(jobs["one"])
        second = self.bake(jobs["two"], before)[1]
        self.assertLess(numpy.abs(numpy.concatenate([first, second]) - frames).max(), 1e-6)
        other = self.jobs("", text.replace("0.02", "0.03"))["both"]
        self.assertEqual(model_key(model_tables(other)), record["model"]["key"])
        self.assertNotEqual(hash_of(other, "key", None), hash_of(jobs["both"], "key", None))

    def test_they_go_with_the_frame(self):
        text = STILL.replace(FIXED, FIXED.replace(" }", ", about = [0, 0, 0], key = [{ time = 1, offset = [0, 0, 0] }] }"))
        shaken = 'frame = { rise = 0.2, translate = [{ axis = [0, 1, 0], amplitude = 0.01, frequency = 2 }] }'
        ends = [self.bake(self.jobs("", source.replace("simulation = { gravity", f"{shaken}\nsimulation = {{ gravity"))["both"])[1]
                for source in (STILL, text)]
        self.assertGreater(numpy.abs(ends[0][10, :6] - ends[0][0, :6]).max(), 1e-3)
        self.assertLess(numpy.abs(ends[0] - ends[1]).max(), 1e-6)


class Ties(Case):
    """Two cards, one above the other's end: the second hangs by ties alone."""

    def setUp(self):
        super().setUp()
        self.text = LIST.replace("modes = 6", "modes = 12")

    def two_cards(self):
        rows = (self.folder / "card.obj").read_text().splitlines()
        points = [row.split()[1:] for row in rows if row[0] == "v"]
        faces = [row.split()[1:] for row in rows if row[0] == "f"]
        rows += [f"v {float(x) + 0.095} {y} 0.001" for x, y, _ in points] + ["f " + " ".join(str(int(v) + len(points)) for v in face) for face in faces]
        (self.folder / "card.obj").write_text("\n".join(rows) + "\n")

    def last(self, ties):
        small.write_list(self.folder, with_keys(self.text, ties).replace("COLLIDER", ""))
        self.two_cards()
        return next(job for job in expand(read_list(self.folder / "list.toml")) if job["shot"] == "both")

    def test_a_card_hangs_by_its_ties_to_vertices_to_triangles_or_by_what_is_near(self):
        keys, gaps = set(), []
        for ties in ('tie = [{ vertices = [[39, 30], [40, 31], [41, 32], [42, 33], [43, 34], [44, 35]] }]',
                     'tie = [{ triangles = [[39, 36], [40, 38], [41, 39], [42, 40]] }]', "tie = [{ within = 0.002 }]"):
            with self.subTest(ties):
                job = self.last(ties)
                record, frames = self.bake(job)
                keys.add(record["model"]["key"])
                gap = numpy.linalg.norm(frames[:, 39:42] - frames[:, 30:33], axis=2)
                gaps.append(numpy.abs(gap - gap[0]).max())
                self.assertLess(frames[-1, :, 2].min(), -1e-3)
        self.assertEqual(len(keys), 3)
        self.assertLess(max(gaps), 5e-4)  # of 5 mm from vertex to vertex; free, it falls by 2 m
        job = self.last("")
        self.assertEqual(shell_of(model_tables(job)).tie_distance, 0)

    def test_soft_ties_give_more(self):
        shells = [shell_of(model_tables(self.last(f"tie = [{{ vertices = [[39, 36]]{stiffness} }}]"))) for stiffness in ("", ", stiffness = 5")]
        self.assertEqual([shell.ties for shell in shells], [[(39, 36)], [(39, 36, 5.0)]])


class Handles(Case):
    def test_a_bake_is_the_librarys_motion(self):
        text = with_keys(STILL, 'handle = [{ side = "high-x", kind = "both", compliance = 0.001, release = 0.4, axes = "yz", '
                                'key = [{ time = 0.3, offset = [0, 0, 0.01], rotate_degrees = [10, 0, 0] }] }]')
        job = self.jobs("", text)["both"]
        record, frames = self.bake(job)
        positions, triangles = mesh_at(job["mesh"])
        with shellwarp.Model(shellwarp.Shell(positions, triangles, shellwarp.Material(5e3, 5e3, 2.7e-3, 0.3), fixed=range(6))) as model:
            model.precompute(modes=6, reduced_fields=0)
            state = model.state("warp")
            state.set_damping(0.1)
            for frame in range(1, 21):
                s = min(1.0, frame / 30 / 0.3)
                way = s * s * (3 - 2 * s)  # two keys, at rest at both
                if frame <= 12:
                    angle = numpy.radians(10 * way)
                    turn = [[1, 0, 0], [0, numpy.cos(angle), -numpy.sin(angle)], [0, numpy.sin(angle), numpy.cos(angle)]]
                    state.set_constraint(0, "position", 37, position=positions[37] + [0, 0, 0.01 * way], axes="yz", compliance=0.001)
                    state.set_constraint(1, "orientation", 37, rotation=turn, axes="yz", compliance=0.001)
                else:
                    state.clear_constraint()
                state.step(1 / 30)
                # 1e-7: the formula here and the farm's round their last bits apart
                self.assertLess(numpy.abs(frames[frame] - state.positions()).max(), 1e-7, frame)
        self.assertEqual(record["range"]["frames_handles_unmet"], 0)

    def test_a_shot_goes_on_and_its_own_handles_join(self):
        text = with_keys(STILL, 'handle = [{ vertex = 38, key = [{ time = 0.6, offset = [0, 0, 0.02] }] }]')
        jobs = self.jobs("", text)
        record, first = self.bake(jobs["one"])
        second = self.bake(jobs["two"], record)[1]
        whole = self.bake(jobs["both"])[1]
        self.assertTrue(numpy.array_equal(numpy.concatenate([first, second]), whole))
        self.assertAlmostEqual(whole[18, 38, 2], 0.02, delta=1e-5)
        self.assertNotEqual(hash_of({**jobs["both"], "handle": []}, "key", None), hash_of(jobs["both"], "key", None))

    def test_what_floats_is_trained_for_its_handles(self):
        text = with_keys(STILL.replace(FIXED, "").replace('method = "warp"', 'method = "auto"').replace("modes = 6", "modes = 12"),
                         'handle = [{ vertex = 37, kind = "both", key = [{ time = 0.5, offset = [0, 0.05, 0.05] }] }]')
        job = self.jobs("", text)["both"]
        tables = model_tables(job)
        self.assertEqual(tables["handle"], [{"vertex": 37}])
        self.assertNotEqual(model_key(tables), model_key({**tables, "handle": []}))
        frames = self.bake(job)[1]
        self.assertLess(numpy.linalg.norm(frames[-1, 37] - frames[0, 37] - [0, 0.05, 0.05]), 1e-4)
        self.assertGreater(frames[-1, 0, 2], 0.02)  # the other end comes along

    def test_a_choice_by_an_error_knows_how_far_they_go(self):
        text = with_keys(LIST.replace('method = "warp"', 'method = "auto", auto_error = 0.01'),
                         'handle = [{ vertex = 38, axes = "z", key = [{ time = 1, offset = [0, 0.03, 0.04] }] }]')
        options = model_tables(self.jobs("", text)["both"])["options"]
        self.assertEqual((options["handle_axes"], options["handle_distance"]), ("z", 0.05))

    def test_what_cannot_be_held_is_named(self):
        for keys, message in (('handle = [{ vertex = 1, side = "low-x" }]', "handle 1: name the vertex by one of vertex, nearest, side, group"),
                              ("handle = [{ vertex = 1, axes = \"w\" }]", "axes is 'w', expected some of the letters xyz"),
                              ('handle = [{ vertex = 1, kind = "place" }]', "the kind is 'place'"),
                              ("handle = [{ vertex = 1, compliance = -1 }]", "compliance is -1"),
                              ("handle = [{ vertex = 1, key = [{ time = 1 }, { time = 0 }] }]", "times must ascend"),
                              ("handle = [{ vertex = 1, key = [{ time = 1, rotate_degrees = [1, 0, 0] }] }]", "rotate_degrees goes with a handle that holds an orientation"),
                              ("tie = [{ stiffness = 1 }]", "a tie needs vertices, triangles or within"),
                              ("tie = [{ within = 0.1, stiffness = 1 }]", "stiffness goes with vertices or triangles"),
                              ("tie = [{ vertices = [[1]] }]", "expected pairs of numbers")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.jobs("", with_keys(LIST, keys))
        for support, message in (('{ kind = "clamped", side = "low-x", axes = "z" }', "axes go with a fixed support without a key"),
                                 ('{ side = "low-x", symmetric = true }', "symmetric goes with axes"),
                                 ('{ side = "low-x", axes = "x", symmetric = 2 }', "symmetric is true or false"),
                                 ('{ side = "low-x", about = [0, 0, 0] }', "about goes with key"), ("{ axes = \"z\" }", "name the vertices by")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.jobs("", LIST.replace(FIXED, support))
        self.assertIn("vertex 39 is named; the mesh has 39, from 0", self.failed(self.jobs("", with_keys(LIST, "handle = [{ vertex = 39 }]"))["one"]))


if __name__ == "__main__":
    unittest.main()
