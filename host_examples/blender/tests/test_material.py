"""Claims about damping and stiffness at run time and about sheets with a grain, in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
import scene as scenes
import shellwarp as sw
from scene import add_strip, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, run_of


class Damping(Case):
    def test_a_groups_weights_multiply_the_damping_without_another_model(self):
        """Half a weight everywhere is half the ratio; 1e-6 of 0.3 m: mean and half round apart."""
        obj = add_strip()
        ends, runs = {}, set()
        for ratio, weight in ((0.1, None), (0.05, None), (0.1, 0.5), (0.0, None), (0.1, 0.0)):
            obj.shellwarp.damping_ratio = ratio
            obj.shellwarp.damping_group = ""
            if weight is not None:
                group = obj.vertex_groups.get("damped") or obj.vertex_groups.new(name="damped")
                group.add(range(scenes.N), weight, "REPLACE")
                obj.shellwarp.damping_group = "damped"
            play(20)
            self.assertEqual(self.message(obj), "")
            ends[ratio, weight] = shown(obj)
            runs.add(run_of(obj))
        self.assertEqual(len(runs), 1)
        self.assertLess(numpy.abs(ends[0.1, 0.5] - ends[0.05, None]).max(), 1e-6)
        self.assertLess(numpy.abs(ends[0.1, 0.0] - ends[0.0, None]).max(), 1e-6)
        self.assertGreater(numpy.abs(ends[0.1, None] - ends[0.05, None]).max(), 1e-3)

    def test_damping_at_the_end_counts_more_than_at_the_support(self):
        """The slowest mode moves the end: damped there alone it calms nearly as if damped everywhere."""
        obj = add_strip()
        group = obj.vertex_groups.new(name="damped")
        rest = {}
        for damped in (range(0, 62), range(62, scenes.N)):
            group.add(range(scenes.N), 0.0, "REPLACE")
            group.add(list(damped), 1.0, "REPLACE")
            obj.shellwarp.damping_group, obj.shellwarp.damping_ratio = "damped", 0.2
            play(40)
            rest[damped.start] = run_of(obj).report()["kinetic_energy"]
        self.assertGreater(rest[0], 3 * rest[62])

    def test_another_group_waits_for_the_start_frame(self):
        obj = add_strip()
        play(2)
        obj.vertex_groups.new(name="damped").add([60], 0.0, "REPLACE")
        obj.shellwarp.damping_group = "damped"
        self.scene.frame_set(3)
        self.assertIn("the group “damped” (damping) is another", self.message(obj))


class Growth(Case):
    def test_a_group_says_where_lengths_without_stress_are_longer(self):
        """Edges far from the support are as much longer as their ends grew: to a hundredth, as the strip bends away from where it is held."""
        obj = add_strip()
        obj.vertex_groups.new(name="grown").add(range(62, scenes.N), 1.0, "REPLACE")
        obj.shellwarp.gravity = 0.0
        edges = {"outside": (33, 37), "inside": (97, 101)}
        lengths = {}
        for name, growth in (("", 0.0), ("", 0.1), ("grown", 0.1)):
            obj.shellwarp.growth, obj.shellwarp.growth_group = growth, name
            play(1)
            self.assertEqual(self.message(obj), "")
            lengths[name, growth] = {place: numpy.linalg.norm(numpy.subtract(*shown(obj)[list(ends)])) for place, ends in edges.items()}
        for name, place, expected in (("", "outside", 1.1), ("", "inside", 1.1), ("grown", "outside", 1.0), ("grown", "inside", 1.1)):
            self.assertAlmostEqual(lengths[name, 0.1][place] / lengths["", 0.0][place], expected, delta=0.01)


class Force(Case):
    def test_a_force_on_a_group_is_the_librarys_in_newtons(self):
        """Weights are shares, nothing acts outside; of a sheet it is in newtons whatever the unit: the same card in metres and in centimetres."""
        moved = {}
        for length in (1.0, 0.01):
            self.setUp()
            self.scene.unit_settings.scale_length = length
            obj = add_strip()
            obj.scale = (1 / length,) * 3
            s = obj.shellwarp
            s.material, s.preset, s.gravity = "PRESET", "card", 0.0
            group = obj.vertex_groups.new(name="pulled")
            group.add([120, 123], 1.0, "REPLACE")
            group.add([121, 122], 0.5, "REPLACE")
            s.force_group = "pulled"
            for frame, value in ((1, 0.0), (5, 2e-3)):
                s.force = (0, 0, value)
                obj.keyframe_insert("shellwarp.force", frame=frame)
            play(10)
            self.assertEqual(self.message(obj), "")
            moved[length] = shown(obj)
        self.assertGreater(moved[1.0][120, 2], 1e-3)
        self.assertLess(numpy.abs(moved[0.01] - moved[1.0]).max(), 1e-3 * moved[1.0][120, 2])  # float32 of lengths a hundred times as large
        part("live").prepare(obj, bpy.context.evaluated_depsgraph_get())
        self.assertEqual(run_of(obj)._shares[[0, 120, 121]].tolist(), [0.0, 1.0, 0.5])
        s.force_group = ""
        play(10)
        self.assertLess(numpy.abs(shown(obj)[:, 2]).max(), 1e-6)

    def test_it_is_the_packages_own(self):
        obj = add_strip()
        s = obj.shellwarp
        group = obj.vertex_groups.new(name="pulled")
        end = [120, 121, 122, 123]
        group.add(end, 0.25, "REPLACE")
        s.force_group, s.force = "pulled", (0.0, 0.004, 0.02)
        rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
        model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
        model.precompute(modes=s.modes, reduced_fields=0)
        state = model.state("warp")
        state.set_gravity(self.scene.gravity)
        state.set_damping(s.damping_ratio)
        state.set_forces(numpy.tile((0.0, 0.001, 0.005), (4, 1)), end)
        play(20)
        for _ in range(19):
            state.step(1 / 30)
        self.assertLess(numpy.abs(shown(obj) - state.positions(space="frame")).max(), 1e-6)


class Stiffness(Case):
    def test_a_keyed_factor_is_the_librarys_and_scrubbing_back_is_exact(self):
        obj = add_strip()
        for frame, value in ((1, 1.0), (10, 4.0), (20, 0.5)):
            obj.shellwarp.stiffness_factor = value
            obj.keyframe_insert("shellwarp.stiffness_factor", frame=frame)
        s = obj.shellwarp
        rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
        model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
        model.precompute(modes=s.modes, reduced_fields=0)
        state = model.state("warp")
        state.set_gravity(self.scene.gravity)
        state.set_damping(s.damping_ratio)
        found = {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            found[frame] = shown(obj)
            factor = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).shellwarp.stiffness_factor
            if frame > 1:
                state.set_stiffness(factor)
                state.step(1 / 30)
            self.assertLess(numpy.abs(found[frame] - state.positions(space="frame")).max(), 1e-6, frame)
        self.assertLess(factor, 0.51)
        self.assertEqual(self.message(obj), "")
        for frame in (5, 15, 3, 4):
            self.scene.frame_set(frame)
            self.assertEqual(self.message(obj), "")
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)


class Constants(Case):
    def test_groups_multiply_the_papers_constants(self):
        """A quarter of all stiffness is half of all frequencies; 1e-5: float32 weights."""
        obj = add_strip()
        play(1)
        whole = run_of(obj).model.frequencies()
        obj.vertex_groups.new(name="soft").add(range(scenes.N), 0.25, "REPLACE")
        obj.shellwarp.bend_group = "soft"
        play(1)
        self.assertEqual(self.message(obj), "")
        self.assertAlmostEqual(run_of(obj).model.frequencies()[0] / whole[0], 0.5, delta=0.01)  # the slowest hardly stretches
        obj.shellwarp.stretch_group = "soft"
        play(1)
        self.assertLess(numpy.abs(run_of(obj).model.frequencies() / whole - 0.5).max(), 1e-5)

    def test_three_zeros_are_refused(self):
        obj = add_strip()
        obj.shellwarp.k_bend = obj.shellwarp.k_length = obj.shellwarp.k_area = 0
        self.scene.frame_set(1)
        self.assertIn("bending, stretch and area are all 0", self.message(obj))

    def test_shapes_may_be_of_64_bits(self):
        obj = add_strip()
        play(1)
        single = run_of(obj).model.info()["bytes_model"]
        obj.shellwarp.precision = "f64"
        play(3)
        self.assertEqual(self.message(obj), "")
        self.assertGreater(run_of(obj).model.info()["bytes_model"], 1.5 * single)


class Grain(Case):
    def frequencies(self, obj):
        play(1)
        self.assertEqual(self.message(obj), "")
        return run_of(obj).model.frequencies()

    def test_a_sheet_bends_more_where_its_grain_runs_across(self):
        """The strip is a beam along x: a tenth of the modulus across leaves it, and along takes the root of ten from its first frequency."""
        obj = add_strip()
        s = obj.shellwarp
        s.material, s.preset = "PRESET", "card"
        plain = self.frequencies(obj)[0]
        s.young_across = 0.1 * sw.Sheet.known("card").young
        along = self.frequencies(obj)[0]
        self.assertAlmostEqual(along / plain, 1, delta=0.05)  # the strip is 10 times as long as wide: little of it bends as a plate
        s.direction = (0, 2, 0)
        across = self.frequencies(obj)[0]
        self.assertAlmostEqual(across / along, 0.1 ** 0.5, delta=0.05)

    def test_a_uv_map_gives_the_direction_of_each_face(self):
        obj = add_strip()
        s = obj.shellwarp
        s.material, s.preset, s.young_across = "PRESET", "card", 3e8
        by_vector = {axis: self.frequencies(self.with_direction(obj, axis)) for axis in ((1, 0, 0), (0, 1, 0))}
        layer = obj.data.uv_layers.new(name="grain")
        for axis, columns in (((1, 0, 0), (0, 1)), ((0, 1, 0), (1, 0))):
            for loop in obj.data.loops:
                co = obj.data.vertices[loop.vertex_index].co
                layer.uv[loop.index].vector = (co[columns[0]], co[columns[1]])
            s.directions = "grain"
            self.assertLess(numpy.abs(self.frequencies(obj) / by_vector[axis] - 1).max(), 1e-4)  # float32 coordinates and uvs
        s.directions = "nowhere"
        play(1)
        self.assertIn("there is no UV map “nowhere”", self.message(obj))

    def with_direction(self, obj, axis):
        obj.shellwarp.direction = axis
        return obj


if __name__ == "__main__":
    unittest.main()
