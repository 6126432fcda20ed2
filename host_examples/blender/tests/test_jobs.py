"""Claims about what takes long: progress, stopping, several shells at once, memory. In Blender itself; run by ctest as `blender`."""

import threading
import time
import types
import unittest

import bpy
import numpy
import scene as scenes
from scene import add_strip, play, shown
from test_addon import Case, Window, alone, part
from test_addon import setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Layout


class Slow(Case):
    """Precomputes take until `gate` is opened; they report 40 % of the last phase meanwhile."""

    def setUp(self):
        super().setUp()
        self.gate, real = threading.Event(), part("live").Simulation
        self.addCleanup(setattr, part("live"), "Simulation", real)
        self.addCleanup(self.gate.set)

        def slow(package, shell, scale, recipe, key, progress, calibrate):
            while not self.gate.wait(0.002):
                if not progress("rotation", 0.4):
                    raise RuntimeError("stopped")
            return real(package, shell, scale, recipe, key, progress, calibrate)
        part("live").Simulation = slow

    def looked_at(self):
        """As with a window: frames do not wait for models."""
        live = part("live")
        for name, value in (("waits", lambda _depsgraph: False), ("PATIENCE", 0.02)):
            self.addCleanup(setattr, live, name, getattr(live, name))
            setattr(live, name, value)

    def labels(self, obj):
        layout = Layout()
        part("panel").SHELLWARP_PT_shell.draw(types.SimpleNamespace(layout=layout), types.SimpleNamespace(object=obj, scene=self.scene, view_layer=bpy.context.view_layer))
        return layout.labels

    def watch(self, obj):
        """The timer, by hand: a window that a test has not would drive it."""
        for _ in range(10_000):
            if part("live").watch() is None:
                return
            time.sleep(0.002)
        raise AssertionError("it never ends")

    def test_the_start_frame_does_not_wait_and_shows_the_shell_when_its_model_is_there(self):
        self.looked_at()
        obj = add_strip()
        self.scene.frame_set(1)
        self.assertIsNone(part("live").simulation(obj))
        self.assertIn("rotation, 40 %", self.labels(obj))
        self.scene.frame_set(2)
        self.assertIn("rotation, 40 %", self.labels(obj))
        self.scene.frame_set(1)
        self.gate.set()
        self.watch(obj)
        self.assertIsNotNone(part("live").simulation(obj))
        play(5, first=2)
        self.assertEqual(self.message(obj), "")
        self.same(shown(obj), alone(obj, 5)[5])

    def test_the_precompute_of_the_start_frame_can_be_stopped(self):
        self.looked_at()
        obj = add_strip()
        self.scene.frame_set(1)
        job = part("live").job(obj)
        self.assertEqual(bpy.ops.shellwarp.cancel(), {"FINISHED"})
        self.watch(obj)
        job.wait()
        self.assertIsNone(part("live").simulation(obj))
        self.assertIn("the precompute was cancelled: press Precompute, or go to the start frame", self.labels(obj))
        with self.assertRaisesRegex(RuntimeError, "no precompute is under way"):
            bpy.ops.shellwarp.cancel()
        self.gate.set()
        play(5)  # another try
        self.watch(obj)
        self.assertIsNotNone(part("live").simulation(obj))

    def test_a_model_done_elsewhere_than_at_the_start_frame_waits_for_that(self):
        self.looked_at()
        obj = add_strip()
        play(3)
        self.gate.set()
        self.watch(obj)
        self.assertIn("the model is made: go to the start frame", self.message(obj))
        play(4)
        self.same(shown(obj), alone(obj, 4)[4])

    def test_another_material_stops_the_precompute_of_the_one_before(self):
        self.looked_at()
        obj = add_strip()
        self.scene.frame_set(1)
        first = part("live").job(obj)
        obj.shellwarp.k_bend *= 2
        self.scene.frame_set(1)
        self.assertTrue(first.cancelled)
        self.assertIsNot(part("live").job(obj), first)

    def test_another_file_stops_it(self):
        self.looked_at()
        self.scene.frame_set(1)
        obj = add_strip()
        self.scene.frame_set(1)
        job = part("live").job(obj)
        scenes.empty_file()
        job.wait(10)
        self.assertFalse(job.running())
        self.assertEqual(part("live")._jobs, {})

    def test_esc_stops_a_bake_in_its_precompute(self):
        obj = add_strip()
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        window = Window(part("operators").SHELLWARP_OT_bake)
        window.press()
        self.assertEqual(window.until_done(escape_after=3), {"CANCELLED"})
        self.assertEqual((list(self.folder.iterdir()), part("live").simulation(obj), part("live").job(obj)), ([], None, None))
        self.assertIn("Strip: rotation, 40 %   Esc: stop", window.texts)
        self.assertIsNone(window.texts[-1])

    def test_a_failure_on_the_thread_is_the_buttons(self):
        obj = add_strip()

        def broken(*_):
            raise ValueError("no modes today")
        part("live").Simulation = broken
        window = Window(part("operators").SHELLWARP_OT_precompute)
        window.press()
        self.assertEqual(window.until_done(), {"CANCELLED"})
        self.assertIn("Precompute: no modes today", self.labels(obj))


class Several(Case):
    def strips(self):
        first, second, third = add_strip("First"), add_strip("Second"), add_strip("Third")
        second.shellwarp.damping_ratio, second.shellwarp.frame_start, second.shellwarp.frame_end = 0.5, 6, 25
        for obj in (first, second, third):
            obj.shellwarp.cache = str(self.folder / f"{obj.name}.pc2")
        third.select_set(False)
        bpy.context.view_layer.objects.active = first
        return first, second, third

    def test_all_selected_shells_are_baked_in_one_pass(self):
        first, second, third = self.strips()
        frames = []
        bpy.app.handlers.frame_change_pre.append(lambda scene: frames.append(scene.frame_current))
        self.addCleanup(bpy.app.handlers.frame_change_pre.pop)
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["First.pc2", "Second.pc2"])
        self.assertLessEqual(len(frames), 25 + 3)  # the two starts and the way back beside them
        expected = {first: alone(first, 20), second: alone(second, 20)}
        for frame in (1, 6, 20, 25):
            self.scene.frame_set(frame)
            if frame <= 20:
                self.same(shown(first), expected[first][frame])
            if frame >= 6:
                self.same(shown(second), expected[second][frame - 5])
        self.assertEqual(bpy.ops.shellwarp.free_bake(), {"FINISHED"})
        self.assertEqual((len(first.modifiers), len(second.modifiers)), (0, 0))

    def test_one_that_fails_leaves_the_others_baked_and_is_named(self):
        first, second, _ = self.strips()
        scenes.key(second, "scale", {6: (1, 1, 1), 12: (2, 2, 2)})
        with self.assertRaisesRegex(RuntimeError, "“Second”: the object's scale changes"):
            bpy.ops.shellwarp.bake()
        self.assertEqual([path.name for path in self.folder.iterdir()], ["First.pc2"])
        self.scene.frame_set(20)
        self.same(shown(first), alone(first, 20)[20])
        self.assertIsNone(part("bake").baked(second))


class Told(Case):
    def test_a_training_and_a_certificate_are_called_so(self):
        """By the names that the library has for its phases."""
        obj = add_strip()
        obj.shellwarp.method, obj.shellwarp.reduced_fields = "reduced-shell", 12
        texts, live, real = [], part("live"), part("jobs").Job._progress

        def told(job, phase, fraction):
            go_on = real(job, phase, fraction)
            texts.append(job.text())
            return go_on
        part("jobs").Job._progress = told
        self.addCleanup(setattr, part("jobs").Job, "_progress", real)
        live.start(obj, bpy.context.evaluated_depsgraph_get()).wait()
        for phase in ("factorization, ", "modes, ", "certificate, ", "training, "):
            self.assertTrue(any(text.startswith(phase) for text in texts), (phase, set(texts)))
        live.take(obj)
        play(3)
        self.assertEqual(self.message(obj), "")

    def test_the_panel_states_the_memory(self):
        obj = add_strip()
        self.scene.frame_set(1)
        run = part("live").simulation(obj)
        now, most = run.memory()
        info = run.model.info()
        self.assertEqual(now - len(run.known[1].saved), info["bytes_model"] + info["bytes_state"])
        self.assertEqual(most, info["bytes_precompute_peak"])
        self.assertIn(f"{now / 1e6:.3g} MB, {most / 1e6:.3g} MB while precomputing", part("operators").summary(run))
        play(20)
        # twenty frames, each in under a kilobyte
        self.assertTrue(19 * 150 < run.memory()[0] - now < 19 * 1000)


class SlowEstimate(Case):
    """Certificates take until `gate` is opened."""

    def setUp(self):
        super().setUp()
        self.gate, real = threading.Event(), part("jobs").Estimate._work
        self.addCleanup(setattr, part("jobs").Estimate, "_work", real)
        self.addCleanup(self.gate.set)

        def slow(estimate):
            self.estimates.append(estimate)
            self.gate.wait()
            real(estimate)
        self.estimates = []
        part("jobs").Estimate._work = slow

    def test_an_estimate_can_be_stopped_and_asked_for_again(self):
        obj = add_strip()
        play(4)
        window = Window(part("operators").SHELLWARP_OT_certify)
        self.assertEqual(window.press(), {"RUNNING_MODAL"})
        self.assertIn("Strip: estimating the error of frame 4   Esc: stop", window.texts)
        self.assertEqual(window.until_done(escape_after=3), {"CANCELLED"})
        self.assertEqual((part("live").simulation(obj).certified, window.timers, window.texts[-1]), ("", 0, None))
        stopped = window.bl.estimate
        window.press()
        self.gate.set()
        with self.assertRaisesRegex(Exception, "cancelled"):  # the library was told, and went no further
            stopped.result()
        self.assertEqual(window.until_done(), {"FINISHED"})
        self.assertRegex(part("live").simulation(obj).certified, r"^frame 4: about [0-9.e-]+ % off the full nonlinear shell")
        play(6, first=5)   # and the shell goes on as one that was never asked
        self.same(shown(obj), alone(obj, 6)[6])

    def test_a_bake_tells_of_its_estimate_and_can_be_stopped_in_it(self):
        obj = add_strip()
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        window = Window(part("operators").SHELLWARP_OT_bake)
        window.press()
        for _ in range(10_000):
            self.assertEqual(window.operator.modal(window.bl, window, types.SimpleNamespace(type="TIMER")), {"RUNNING_MODAL"})
            if self.estimates:
                break
            time.sleep(0.002)
        self.assertRegex(window.texts[-1], r"^Strip: estimating the error of frame \d+   Esc: stop$")  # of the widest, before the last
        self.assertEqual(window.until_done(escape_after=0), {"CANCELLED"})
        self.assertEqual((part("bake").baked(obj), list(self.folder.iterdir())), (None, []))
        self.assertTrue(self.estimates[-1].cancelled)

    def test_it_says_how_much_of_the_force_is_left(self):
        obj = add_strip()
        play(4)
        self.gate.set()
        estimate = part("live").simulation(obj).estimate()
        estimate.wait()
        self.assertRegex(estimate.text(), r"^estimating the error of frame 4, [0-9.]+e-[0-9]+ of the force left$")


if __name__ == "__main__":
    unittest.main()
