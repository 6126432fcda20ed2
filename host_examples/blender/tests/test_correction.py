"""Claims about correction steps in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
from scene import add_arch, add_strip, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, ball, collide, run_of


class Correction(Case):
    def test_what_is_shown_goes_to_the_full_shell_and_the_motion_does_not(self):
        """The warp of a strip under its weight is off; the first step leaves less than half, and five next to nothing."""
        obj = add_strip()
        play(20)
        plain = shown(obj)
        found = {}
        for steps in (1, 5, 20, 0):
            obj.shellwarp.correction_steps = steps
            self.scene.frame_set(20)
            self.assertEqual(part("live").trouble(obj), [])
            found[steps] = shown(obj)
        off = {steps: numpy.abs(points - found[20]).max() for steps, points in found.items()}
        self.assertTrue(numpy.array_equal(found[0], plain), "the frame itself has not moved")
        self.assertGreater(off[0], 1e-4)  # 0.3 m long
        self.assertLess(off[1], 0.5 * off[0])
        self.assertLess(off[5], 0.01 * off[0])

    def test_none_is_taken_unasked_where_the_fields_hold_the_shell(self):
        obj = add_strip()
        obj.shellwarp.method = "auto"
        self.assertEqual(obj.shellwarp.correction_steps, -1)
        play(10)
        auto = shown(obj)
        self.assertEqual(run_of(obj).model.info()["auto_correction_steps"], 0)
        self.assertEqual(run_of(obj).corrects(False), "")
        self.assertNotIn("as shown", run_of(obj).certify())
        obj.shellwarp.correction_steps = 0
        play(10)
        self.assertTrue(numpy.array_equal(shown(obj), auto))

    def test_they_are_taken_unasked_where_the_fields_miss_their_training(self):
        obj = add_arch()
        play(10)
        self.assertEqual(part("live").trouble(obj), [])
        auto, run = shown(obj), run_of(obj)
        self.assertRegex(run.corrects(False), r"^Auto: 2 Newton steps of the full shell a frame: its fields miss half of their training by \d+ % or more$")
        self.assertRegex(run.certify(), r"^frame 10: about \d+(\.\d+)? % off the full nonlinear shell.*; as shown, after Newton steps, about ")
        found = {}
        for steps in (2, 0):
            obj.shellwarp.correction_steps = steps
            run.forget()
            play(10)
            found[steps] = shown(obj)
        self.assertTrue(numpy.array_equal(auto, found[2]), "two is what its fields need")
        self.assertGreater(numpy.abs(found[0] - auto).max(), 1e-3)  # 0.5 m long
        self.assertNotIn("as shown", run.certify())

    def test_frames_between_and_frames_that_were_reached_without_have_them_too(self):
        obj = add_arch()
        obj.shellwarp.correction_steps = 0
        play(10)
        plain = shown(obj)
        obj.shellwarp.correction_steps = -1
        self.scene.frame_set(10)
        led = shown(obj)
        self.assertGreater(numpy.abs(led - plain).max(), 1e-3)  # 0.5 m long
        self.scene.frame_set(9)
        self.scene.frame_set(10)
        self.assertTrue(numpy.array_equal(shown(obj), led), "once")
        self.scene.frame_set(10, subframe=1e-3)
        # a thousandth of a frame moves no vertex by a tenth of what the steps do
        self.assertLess(numpy.abs(shown(obj) - led).max(), 0.1 * numpy.abs(led - plain).max())
        obj.shellwarp.correction_steps = 0
        self.scene.frame_set(10)
        self.assertTrue(numpy.array_equal(shown(obj), plain))

    def test_push_out_goes_before_those_that_nobody_asked_for(self):
        obj = add_arch()
        collide(ball(0.1, (0.5, 0.1, 0)), "SPHERE")
        obj.shellwarp.push_out = True
        found = {}
        for steps in (-1, 0):
            obj.shellwarp.correction_steps = steps
            play(10)
            self.assertEqual(part("live").trouble(obj), [])
            found[steps] = shown(obj)
        self.assertTrue(numpy.array_equal(found[-1], found[0]))
        self.assertEqual(run_of(obj).corrects(True), "")
        self.assertTrue(run_of(obj).corrects(False))

    def test_a_file_keeps_the_setting_and_one_of_before_has_them_as_needed(self):
        set_to = {"Asked": 3, "Off": 0, "Untold": None}
        for name, steps in set_to.items():
            obj = add_strip(name)
            if steps is not None:
                obj.shellwarp.correction_steps = steps
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "kept.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "kept.blend"))
        self.assertEqual({name: bpy.data.objects[name].shellwarp.correction_steps for name in set_to}, {"Asked": 3, "Off": 0, "Untold": -1})
        self.assertIn("correction_steps", part("presets").KEPT)

    def test_a_bake_has_them_as_live(self):
        obj = add_strip()
        obj.shellwarp.correction_steps = 1
        play(20)
        live = shown(obj)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.scene.frame_set(20)
        self.assertTrue(numpy.array_equal(shown(obj), live))


if __name__ == "__main__":
    unittest.main()
