"""Claims about correction steps in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
from scene import add_strip, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, run_of


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

    def test_a_certificate_says_what_they_leave(self):
        """Two steps a frame leave next to nothing of what the warp of a strip is off, a tenth."""
        obj = add_strip()
        self.assertEqual(obj.shellwarp.correction_steps, 0, "none unasked")
        play(10)
        self.assertNotIn("as shown", run_of(obj).certify())
        obj.shellwarp.correction_steps = 2
        run_of(obj).forget()
        play(10)
        self.assertRegex(run_of(obj).certify(), r"^frame 10: about \d+ % off the full nonlinear shell.*; as shown, after Newton steps, less than 0.01 %")
        obj.shellwarp.correction_steps = 0
        self.scene.frame_set(10)
        self.assertNotIn("as shown", run_of(obj).certify())

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
