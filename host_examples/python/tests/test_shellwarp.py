"""Claims about the Python package, on the README's strip of card."""

import ctypes
import gc
import os
import pickle
import subprocess
import sys
import threading
import time
import unittest
import weakref
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy
import strip

import shellwarp as sw


def model(**changes):
    made = sw.Model(strip.shell(**changes))
    made.precompute(reduced_fields=0)
    return made


def swinging(made):
    state = made.state()
    state.set_gravity(strip.GRAVITY)
    return state


def run(made, frames, state=None):
    state = state or swinging(made)
    for _ in range(frames):
        state.step(1 / 30)
    return state


def run_elsewhere(shell, saved, frames):
    """A farm's worker: all it is given was pickled."""
    made = sw.Model(shell)
    made.precompute(reduced_fields=0)
    state = swinging(made)
    state.load(saved)
    return run(made, frames, state).positions()


class Arrays(unittest.TestCase):
    def test_strided_and_packed_positions_make_the_same_model(self):
        maya = numpy.ones((124, 4))
        maya[:, :3] = strip.positions(numpy.float64)
        packed = run(model(positions=strip.positions(numpy.float64)), 20).positions()
        for name, given in [("view of four columns", maya[:, :3]), ("Fortran order", numpy.asfortranarray(maya[:, :3])),
                            ("backwards", numpy.ascontiguousarray(maya[::-1, :3])[::-1]), ("list", maya[:, :3].tolist()),
                            ("read-only", numpy.frombuffer(maya[:, :3].tobytes()).reshape(-1, 3))]:
            with self.subTest(name):
                self.assertTrue(numpy.array_equal(run(model(positions=given), 20).positions(), packed))

    def test_strided_input_is_not_copied(self):
        from shellwarp._arrays import vectors_in
        maya = numpy.ones((124, 4))
        array, _, stride = vectors_in(maya[:, :3], "positions")
        self.assertTrue(numpy.shares_memory(array, maya))
        self.assertEqual(stride, 32)

    def test_a_broadcast_array_is_copied_since_its_stride_of_zero_would_mean_packed(self):
        state = swinging(model())
        state.set_forces(numpy.broadcast_to([0.0, 1e-3, 0.0], (124, 3)))
        other = swinging(model())
        other.set_forces(numpy.tile([0.0, 1e-3, 0.0], (124, 1)))
        self.assertTrue(numpy.array_equal(run(None, 5, state).positions(), run(None, 5, other).positions()))

    def test_results_are_written_where_they_are_wanted(self):
        state = run(model(), 10)
        houdini, maya = numpy.empty((124, 3), numpy.float32), numpy.full((124, 4), 7.0)
        self.assertIs(state.positions(houdini), houdini)
        state.positions(maya[:, :3])
        # float32 holds the same number rounded once
        self.assertTrue(numpy.array_equal(maya[:, :3].astype(numpy.float32), houdini))
        self.assertTrue((maya[:, 3] == 7.0).all())

    def test_arrays_that_cannot_take_results_are_refused(self):
        state = run(model(), 1)
        frozen = numpy.empty((124, 3))
        frozen.flags.writeable = False
        for bad in (numpy.empty((123, 3)), numpy.empty((124, 3), int), numpy.empty((3, 124)).T, frozen,
                    numpy.empty((124, 3))[::-1], numpy.empty((124, 3), ">f4"), [[0.0] * 3] * 124):
            with self.assertRaises(sw.InvalidArgumentError):
                state.positions(bad)

    def test_indices_that_c_would_wrap_are_refused(self):
        for bad in ([-1], [2**32], [0.5], [[1, 2]]):
            with self.assertRaises(sw.InvalidArgumentError):
                sw.Model(strip.shell(fixed=bad))
        state = model().state()
        for number in (-1, 2**32, "1"):
            with self.assertRaises(sw.InvalidArgumentError):
                state.set_constraint(number, "position", 5, position=[0, 0, 0])
        with self.assertRaises(sw.InvalidArgumentError):
            model().precompute(modes=2**32 + 1)

    def test_shapes_are_checked(self):
        with self.assertRaisesRegex(sw.InvalidArgumentError, r"positions: shape \(124, 2\)"):
            sw.Model(strip.shell(positions=strip.positions()[:, :2]))
        state = model().state()
        with self.assertRaisesRegex(sw.InvalidArgumentError, "gravity: 2 numbers, expected 3"):
            state.set_gravity([0, 1])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "1 forces on 2 vertices"):
            state.set_forces([[0, 0, 1]], [3, 4])


class Sheets(unittest.TestCase):
    CARD = dict(young=3e9, poisson=0.0, thickness=4e-4, volume_density=750)

    def test_a_clamped_sheet_swings_as_a_beam_does(self):
        made = model(material=sw.Sheet(**self.CARD), fixed=(), clamped=range(4))
        beam = 1.8751**2 / (2 * numpy.pi * 0.3**2) * numpy.sqrt(3e9 * 4e-4**2 / (12 * 750))
        # 30 squares along the beam, whose diagonals all lean one way: docs/evidence/koiter.md has -0.4 % at 16
        self.assertLess(abs(made.frequencies()[0] / beam - 1), 4e-3)

    def test_steps_of_second_order_are_nearer_to_short_ones(self):
        made = model()

        def fall(integrator, steps):
            state = made.state("shell-implicit", integrator)
            state.set_gravity(strip.GRAVITY)
            for _ in range(6 * steps):
                state.step(1 / 30 / steps)
            return state.positions()

        short = fall("second-order", 8)
        off = {integrator: numpy.abs(fall(integrator, 1) - short).max() for integrator in ("implicit-euler", "second-order")}
        self.assertLess(off["second-order"], 0.3 * off["implicit-euler"])

    def test_maps_of_equal_values_are_the_constant_and_others_are_not(self):
        def slowest(maps):
            return model(material=sw.Sheet(**self.CARD), fixed=(), clamped=range(4), maps=maps).frequencies()[0]
        x = strip.positions()[:, 0]
        self.assertEqual(slowest({"thickness": numpy.full(124, 4e-4), "young": numpy.full(180, 3e9)}), slowest({}))
        self.assertGreater(slowest({"thickness": numpy.where(x < 0.15, 4e-4, 2e-4)}), 1.1 * slowest({}))

    def test_bad_maps_are_named(self):
        for maps, text in [({"thick": [1]}, "'thick'"), ({"thickness": [1, 2]}, r"\(2,\), expected one of \(124,\), \(180,\)"),
                           ({"thickness": numpy.zeros(124)}, "value 0 of the map of thickness"), ({"k_bend": numpy.ones(124)}, "k_bend")]:
            with self.assertRaisesRegex(sw.InvalidArgumentError, text):
                sw.Model(strip.shell(material=sw.Sheet(**self.CARD), maps=maps))

    def test_lengths_without_stress_are_those_at_rest(self):
        """Free and 1 % longer everywhere, by a map or by edges, a sheet is 1 % larger: to 1e-6, of positions near 0.3 in f32 or f64."""
        x, t = strip.positions().astype(float), strip.triangles()
        edges = {tuple(sorted((int(row[k]), int(row[(k + 1) % 3])))) for row in t for k in range(3)}
        longer = {(a, b): 1.01 * numpy.linalg.norm(x[a] - x[b]) for a, b in edges}
        for own in ({"maps": {"growth": numpy.full(len(x), 1.01)}}, {"rest_lengths": longer}):
            made = model(material=sw.Sheet(**self.CARD), fixed=(), **own)
            rest = made.state("warp").positions()
            self.assertLess(abs(numpy.ptp(rest[:, 0]) / numpy.ptp(x[:, 0]) - 1.01), 1e-6)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "rest length 0, of the edge 0-1, is -1.0"):
            sw.Model(strip.shell(rest_lengths={(0, 1): -1.0}))

    def test_known_materials_are_sheets(self):
        self.assertIn("card", sw.presets())
        self.assertEqual(sw.Sheet.known("aluminium"), sw.Sheet(6.9e10, 0.33, 1e-3, 2710.0))
        self.assertAlmostEqual(sw.Sheet.known("aluminium", 0.01).thickness, 0.1)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "'bread'; there are denim"):
            sw.Sheet.known("bread")

    def test_bad_constants_are_named(self):
        for name, bad in [("young", 0), ("poisson", 0.6), ("thickness", -1), ("volume_density", numpy.nan)]:
            with self.assertRaisesRegex(sw.InvalidArgumentError, name):
                sw.Model(strip.shell(material=sw.Sheet(**{**self.CARD, name: bad})))


class Errors(unittest.TestCase):
    def test_they_carry_the_librarys_message_and_survive_pickling(self):
        with self.assertRaises(sw.InvalidMeshError) as caught:
            sw.Model(sw.Shell([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
        self.assertRegex(str(caught.exception), "triangle 0")
        self.assertEqual(caught.exception.status, sw.abi.SW_ERROR_INVALID_MESH)
        copy = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((type(copy), str(copy), copy.status),
                         (sw.InvalidMeshError, str(caught.exception), caught.exception.status))

    def test_every_status_has_a_class(self):
        from shellwarp.errors import CLASSES
        codes = {value for name, value in vars(sw.abi).items() if name.startswith("SW_ERROR_")}
        self.assertEqual(codes - set(CLASSES), {sw.abi.SW_ERROR_INVALID_DESC, sw.abi.SW_ERROR_BUFFER_SIZE},
                         "those two cannot come about through this package")

    def test_check_mesh_lists_what_is_wrong(self):
        found = sw.check_mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 7]])
        self.assertEqual({d.kind for d in found if d.is_error},
                         {sw.abi.SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE, sw.abi.SW_DIAGNOSTIC_ZERO_AREA})
        self.assertEqual(sw.check_mesh(strip.positions(), strip.triangles()), [])

    def test_a_missing_library_is_named(self):
        code = "import shellwarp as sw\ntry: sw.version()\nexcept sw.LibraryNotFoundError as e: print(e)"
        shown = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True,
                               env={**os.environ, "SHELLWARP_LIBRARY": "/none/libshellwarp.so.0"}).stdout
        self.assertIn("/none/libshellwarp.so.0", shown)


class Callbacks(unittest.TestCase):
    def test_progress_names_its_phases(self):
        heard = []
        sw.Model(strip.shell()).precompute(reduced_fields=0, progress=lambda phase, fraction: heard.append((phase, fraction)))
        self.assertIn("modes", {phase for phase, _ in heard})
        self.assertTrue(all(0 <= fraction <= 1 for _, fraction in heard))

    def test_returning_false_cancels_and_leaves_the_model_as_it_was(self):
        made = sw.Model(strip.shell())
        with self.assertRaises(sw.CancelledError):
            made.precompute(reduced_fields=0, progress=lambda phase, fraction: False)
        self.assertEqual(made.info()["precomputed"], 0)
        made.precompute(reduced_fields=0)
        self.assertEqual(made.info()["modes"], 16)

    def test_what_a_callback_raises_comes_out_of_precompute(self):
        for kind in (ZeroDivisionError, KeyboardInterrupt, SystemExit):
            def progress(phase, fraction, kind=kind):
                raise kind("from the callback")
            made = sw.Model(strip.shell())
            with self.assertRaises(kind):
                made.precompute(reduced_fields=0, progress=progress)
            self.assertEqual(made.info()["precomputed"], 0)

    def test_a_model_cannot_be_used_or_closed_from_its_own_progress(self):
        made, seen = sw.Model(strip.shell()), []

        def progress(phase, fraction):
            for misuse in (made.info, made.close, made.precompute):
                try:
                    misuse()
                except sw.BusyError as error:
                    seen.append(error)
        made.precompute(reduced_fields=0, progress=progress)
        self.assertGreaterEqual(len(seen), 3)
        self.assertEqual(made.info()["modes"], 16)


class Lifetime(unittest.TestCase):
    def test_states_live_on_without_their_model(self):
        expected = run(model(), 10).positions()
        made = model()
        state = swinging(made)
        made.close()
        self.assertTrue(numpy.array_equal(run(None, 10, state).positions(), expected))
        with self.assertRaisesRegex(sw.InvalidArgumentError, "Model is closed"):
            made.info()

    def test_closing_twice_does_nothing_and_with_closes(self):
        with model() as made, made.state() as state:
            state.close()
            state.close()
        self.assertTrue(made.closed and state.closed)

    def test_dropping_the_last_reference_frees(self):
        made = model()
        cell, gone = made._cell, weakref.ref(made)
        del made
        gc.collect()
        self.assertIsNone(gone())
        self.assertEqual(cell, [])

    @unittest.skipUnless(Path("/proc/self/statm").exists(), "needs /proc")
    def test_many_models_and_states_do_not_grow_the_process(self):
        def cycle():
            with model() as made:
                made.info()
                for _ in range(4):
                    state = run(made, 2)
                    state.set_constraint(1, "position", 120, position=[0.3, 0, -0.01])
                    copy = state.clone()
                    copy.load(state.save())
                    copy.positions()
                with self.assertRaises(sw.CancelledError):
                    sw.Model(strip.shell()).precompute(reduced_fields=0, progress=lambda *_: False)

        def resident():
            gc.collect()
            return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        with model() as made:
            size = made.info()["bytes_model"]
        for _ in range(30):  # the allocator's pools fill
            cycle()
        before = resident()
        for _ in range(200):
            cycle()
        # One leaked model a cycle would be 200 of them; the allocator's own noise is a few pages.
        self.assertLess(resident() - before, 200 * size / 4)


class Running(unittest.TestCase):
    def test_a_saved_state_goes_on_with_the_same_bits(self):
        made = model()
        state = run(made, 7)
        saved = state.save()
        self.assertIsInstance(saved, bytes)
        expected = run(made, 5, state).positions()
        other = swinging(made)
        other.load(saved)
        self.assertTrue(numpy.array_equal(run(made, 5, other).positions(), expected))
        with self.assertRaises(sw.InvalidDataError):
            other.load(saved[:-1])

    def test_a_deterministic_state_moves_alike_and_refuses_the_full_shell(self):
        made = model()
        fast, same = made.state(), made.state(deterministic=True)
        for state in fast, same:
            state.set_gravity(strip.GRAVITY)
            run(made, 7, state)
        numpy.testing.assert_allclose(same.positions(), fast.positions(), atol=1e-5)  # a basis of 32 bits
        with self.assertRaisesRegex(sw.UnsupportedError, "deterministic"):
            made.state("shell-implicit", deterministic=True)

    def test_pickled_inputs_give_the_same_bits_in_another_process(self):
        made, shell = model(), strip.shell()
        state = run(made, 7)
        saved = state.save()
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            elsewhere = pool.submit(run_elsewhere, shell, saved, 5).result(timeout=3600)  # ends a hung test only
        self.assertTrue(numpy.array_equal(run(made, 5, state).positions(), elsewhere))
        with self.assertRaisesRegex(TypeError, "State.save"):
            pickle.dumps(state)

    def test_a_saved_model_runs_with_the_same_bits_and_damage_is_noticed(self):
        for precision in ("f32", "f64", "i16"):
            with self.subTest(precision):
                made = sw.Model(strip.shell())
                made.precompute(modes=12, precision=precision, reduced_fields=0)
                data = made.save()
                loaded = sw.Model.load(data)
                self.assertEqual(loaded.info()["modes"], 12)
                self.assertTrue(numpy.array_equal(run(loaded, 30).positions(), run(made, 30).positions()))
                self.assertEqual(loaded.save(), data)
                with self.assertRaises(sw.InvalidDataError):
                    sw.Model.load(data[:-1] + bytes([data[-1] ^ 1]))
        with self.assertRaises(sw.NotPrecomputedError):
            sw.Model(strip.shell()).save()

    def test_other_threads_run_during_a_long_call(self):
        i, j = numpy.meshgrid(numpy.arange(90), numpy.arange(90), indexing="ij")
        a = (90 * numpy.arange(89)[:, None] + numpy.arange(89)).ravel()
        triangles = numpy.concatenate([numpy.stack([a, a + 90, a + 91], axis=-1), numpy.stack([a, a + 91, a + 1], axis=-1)])
        made = sw.Model(sw.Shell(numpy.stack([i, j, 0.0 * i], axis=-1).reshape(-1, 3), triangles, fixed=numpy.arange(180)))
        ends = []

        def precompute():
            ends.append(time.perf_counter())
            made.precompute(modes=32, reduced_fields=0)
            ends.append(time.perf_counter())

        thread = threading.Thread(target=precompute)
        thread.start()
        ticks = []
        while thread.is_alive():
            ticks.append(time.perf_counter())
            time.sleep(0.001)
        start, length = ends[0], ends[1] - ends[0]
        # A held lock would let this thread run just before the call and just after it, never in its middle half.
        self.assertTrue([tick for tick in ticks if 0.25 < (tick - start) / length < 0.75])

    def test_states_on_threads_move_as_alone(self):
        made = model()
        expected = run(made, 50).positions()
        with ThreadPoolExecutor(4) as pool:
            for state in pool.map(lambda _: run(made, 50), range(8)):
                self.assertTrue(numpy.array_equal(state.positions(), expected))

    def test_a_nonlinear_shell_is_damped_by_its_mass(self):
        for method in ("shell-implicit", "shell-explicit"):
            made = model()
            by_ratio, by_mass, undamped = states = [made.state(method) for _ in range(3)]
            by_ratio.set_damping(ratio=100)  # that of its slowest swing; so much that the first microseconds show it
            by_mass.set_damping(mass=4 * numpy.pi * 100 * made.frequencies()[0])
            for state in states:
                state.set_gravity(strip.GRAVITY)
                for _ in range(5):
                    state.step(1e-6)
            one, other, none = (state.positions(dtype=numpy.float64) - strip.positions(numpy.float64) for state in states)
            # The frequency is rounded where it is told and where pi is taken.
            self.assertLess(abs(one - other).max(), 1e-6 * abs(one).max())
            self.assertGreater(abs(one - none).max(), 1e-6 * abs(one).max())
            with self.assertRaisesRegex(sw.UnsupportedError, "ratios that differ"):
                by_ratio.set_damping(ratio=[0.1] * 15 + [0.2])
            with self.assertRaises(ValueError):
                by_ratio.set_damping(ratio=float("nan"))

    def test_a_pose_read_is_set_again(self):
        made = model()
        source = run(made, 20)
        pose = source.positions(dtype=numpy.float64)
        for method in ("warp", "shell-implicit"):
            state = made.state(method)
            # A basis of 32 bits: 1e-6 of a displacement of some centimetres.
            self.assertLess(state.set_pose(pose), 1e-7)
            self.assertLess(numpy.abs(state.positions(dtype=numpy.float64) - pose).max(), 1e-7)
            self.assertEqual(state.report()["kinetic_energy"], 0)
            self.assertLess(state.set_pose(pose.astype(numpy.float32)[:, :], velocities=0 * pose, space="frame"), 1e-7)
            moving = 0.1 * (pose - strip.positions())
            state.set_pose(pose, moving)
            self.assertGreater(state.report()["kinetic_energy"], 0)
        # What modes cannot show is missed: a vertex pulled from its neighbours.
        state, spike = made.state(), strip.positions(numpy.float64)
        spike[100, 2] += 0.01
        self.assertGreater(state.set_pose(spike), 1e-4)

    def test_what_is_no_pose_is_refused(self):
        state, pose = model().state(), strip.positions(numpy.float64)
        state.set_pose(pose)
        before, bad = state.positions(), pose.copy()
        bad[7, 1] = numpy.nan
        for wrong in (lambda: state.set_pose(bad), lambda: state.set_pose(pose, bad), lambda: state.set_pose(pose[:-1]),
                      lambda: state.set_pose(pose, pose[:-1]), lambda: state.set_pose(1e300 * pose), lambda: state.set_pose(pose[:, :2])):
            self.assertRaises(ValueError, wrong)
        self.assertTrue(numpy.array_equal(state.positions(), before))

    def test_a_handle_is_met_and_let_go(self):
        state = swinging(model())
        state.set_damping(ratio=0.2)
        tip = strip.positions()[120] + [-0.02, 0, 0.05]
        state.set_constraint(3, "position", 120, position=tip)
        run(None, 30, state)
        report, = state.constraint_report()
        self.assertEqual((report["id"], report["met"]), (3, 1))
        # met means to a millionth of the model's size, 0.3
        self.assertLess(numpy.abs(state.positions(dtype=numpy.float64)[120] - tip).max(), 1e-6)
        state.clear_constraint(3)
        self.assertEqual(state.constraint_report(), [])

    def test_the_frame_carries_the_shell(self):
        made = model()
        state = made.state()
        turn = numpy.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
        state.set_frame([1, 2, 3], turn)
        expected = strip.positions(numpy.float64) @ turn.T + [1, 2, 3]
        # float32 of numbers up to 3.3
        self.assertLess(numpy.abs(state.positions(dtype=numpy.float64) - expected).max(), 1e-6)
        frame = state.positions(space="frame")
        self.assertLess(numpy.abs(frame - strip.positions()).max(), 1e-7)

    def test_every_input_and_reader_goes_through(self):
        made = model()
        self.assertEqual(made.mode_shape(3).shape, (124, 3))
        self.assertEqual(made.mode_shape(3, "rotation", dtype=numpy.float32).dtype, numpy.float32)
        self.assertTrue((numpy.diff(made.frequencies()) >= 0).all())
        state = made.state("lma", "exact")
        state.set_wind([3, 0, 1], density=1.2, normal_drag=1.5, tangential_drag=0.05,
                       local_velocities=numpy.zeros((124, 3), numpy.float32))
        state.set_forces([[0, 0, 1e-3]], [123], one_step=True)
        state.set_damping(ratio=[0.1] * 16, mass=0.5, stiffness=1e-4)
        state.set_frame(motion=[[0, 0, 0]] * 4)
        run(None, 5, state)
        self.assertEqual(state.normals().shape, (124, 3))
        self.assertEqual(state.rotations(space="frame").shape, (124, 4))
        self.assertGreater(state.report()["max_displacement"], 0)
        q, rates = state.amplitudes()
        state.reset()
        self.assertEqual(state.report()["max_displacement"], 0)
        state.set_amplitudes(q, rates)
        self.assertTrue(numpy.array_equal(state.amplitudes()[0], q))
        state = swinging(made)
        self.assertLess(state.equilibrium()["residual"], 1e-6)

    def test_every_method_steps(self):
        from shellwarp.state import methods
        made = model()
        made.precompute(modes=4, reduced_fields=0)
        self.assertEqual(made.info()["auto_method"], methods()["warp"])
        self.assertEqual(len(made.state().amplitudes()[0]), 4)
        made.precompute(modes=4, reduced_fields=4)
        self.assertTrue(all(made.offers(name) for name in methods()))
        forms = [methods()[form] for form in ("polynomial-shell", "reduced-shell", "adaptive-shell")]
        self.assertIn(made.info()["auto_method"], forms)   # by the training's gate
        for method in methods():
            # 1e-6 s is within the explicit shell's stable step here
            made.state(method).step(1e-6)
        swings = made.state("polynomial-shell")
        swings.set_gravity((0.0, 0.0, -1.0))
        swings.step(0.01)
        self.assertGreater(swings.report()["step_error"], 0)
        chosen = sw.Model(strip.shell())
        chosen.precompute(4, auto_error=1e-3, demand_gravity=(0, 0, -1), handles=[5], handle_distance=0.01)
        self.assertEqual(sum(point["chosen"] for point in chosen.front()), 1)
        chosen.state("auto").step(1e-2)

    def test_the_default_is_a_reduced_shell_where_the_shell_can_have_one(self):
        made = model()
        made.precompute(modes=4)
        self.assertTrue(made.offers("reduced-shell"))
        swinging(made).step(1 / 30)
        made.precompute(modes=4, reduced_fields=4, reduced_poses=1, auto=True)
        self.assertIn("too few", made.lacks("polynomial-shell"))
        self.assertEqual(made.info()["auto_method"], sw.methods()["shell-implicit"])
        made.precompute(modes=4, reduced_fields=4, reduced_poses=1, auto=True, auto_full=False)
        self.assertEqual(made.info()["auto_method"], sw.methods()["warp"])
        made.precompute(modes=4, support_fields=8)
        self.assertIn("supports that move", made.lacks("polynomial-shell"))

    def test_what_a_method_needs_makes_a_model_that_offers_it_or_says_why_not(self):
        moved = 0
        for method in sw.method.table():
            self.assertEqual((method.number, method), (sw.methods()[method.name], sw.method.find(method.number)))
            made = model()
            made.precompute(modes=4, **sw.method.precompute_options(method.name, reduced_fields=4, gravity=2.0))
            if made.lacks(method.name):
                continue
            moved += 1
            state = made.state(method.name)
            state.set_damping(ratio=0.1)
            state.set_gravity((0, 0, -2))
            state.step(1e-6)
            self.assertLess(state.positions()[:, 2].min(), 0, method.name)
        self.assertGreaterEqual(moved, 8)

    def test_a_method_that_a_model_lacks_is_told_in_the_librarys_words(self):
        made = model()
        made.precompute(modes=4, reduced_fields=0)
        self.assertIn("precompute with reduced_fields", made.lacks("reduced-shell"))
        self.assertFalse(made.offers("reduced-shell"))
        with self.assertRaisesRegex(sw.UnsupportedError, "precompute with reduced_fields"):
            made.state("reduced-shell")
        for wrong in ("virtual-work", "", 99):
            with self.assertRaisesRegex(sw.InvalidArgumentError, "expected one of 'warp', 'warp-virtual-work', "):
                sw.method.find(wrong)

    def test_how_a_method_moves_follows_from_its_needs(self):
        made = model()
        made.precompute(modes=4, reduced_fields=4)
        for method in sw.method.table():
            if made.lacks(method.name):
                continue
            state = made.state(method.name)
            ratios = [0.1, 0.1, 0.1, 0.2]  # the full shell has no modes to damp one by one
            for claim, call in [(method.moves_by_modes, state.amplitudes), (not method.is_full_shell, lambda: state.set_damping(ratio=ratios))]:
                if claim:
                    call()
                else:
                    self.assertRaises(sw.UnsupportedError, call)
            state.set_damping(ratio=0.1)

    def test_reduced_shells_are_trained_unless_told_otherwise(self):
        def at_rest(**options):
            made = model()
            made.precompute(modes=4, reduced_fields=4, **options)
            state = made.state("reduced-shell")
            state.set_gravity((0, 0, -2))
            state.equilibrium()
            return state.positions()

        trained, untrained = at_rest(), at_rest(reduced_trained=False)
        self.assertTrue(numpy.array_equal(trained, at_rest(reduced_poses=62)))
        self.assertFalse(numpy.array_equal(trained, untrained))
        with self.assertRaisesRegex(sw.InvalidArgumentError, "reduced_poses is 3"):
            at_rest(reduced_poses=3, reduced_trained=False)

    def test_a_state_tells_its_error_and_falls_back(self):
        made = model()
        made.precompute(modes=4, reduced_fields=0)
        state = made.state("lma")
        state.set_gravity((0, 0, -2))
        state.equilibrium()
        linear, found = state.certify(), state.fall_back()
        self.assertEqual([linear["method"], found["method"]], [sw.abi.SW_METHOD_LMA, sw.abi.SW_METHOD_WARP])
        self.assertLess(found["error"], linear["error"])

    def test_a_certificate_is_heard_of_and_can_be_stopped(self):
        made = model()
        made.precompute(modes=4)
        state = made.state("warp")
        state.set_gravity((0, 0, -2))
        state.equilibrium()
        heard = []
        found, again = state.certify(heard.append), state.certify()
        self.assertTrue(found.pop("seconds") > 0 and again.pop("seconds") > 0)
        self.assertEqual(found, again)
        self.assertGreater(found["factorizations"], 0)
        self.assertGreater(len(heard), 1)
        self.assertLessEqual(heard[-1], 1e-6)
        with self.assertRaises(sw.CancelledError):
            state.certify(lambda residual: False)
        with self.assertRaises(ZeroDivisionError):
            state.certify(lambda residual: 1 / 0)

    def test_searches_are_heard_of_and_can_be_stopped(self):
        made = model()
        made.precompute(modes=4, reduced_fields=0)
        state = made.state("lma")
        state.set_gravity((0, 0, -2))
        before, heard = state.save(), []
        with self.assertRaises(sw.CancelledError):
            state.equilibrium(lambda residual: False)
        with self.assertRaises(ZeroDivisionError):
            state.equilibrium(lambda residual: 1 / 0)
        self.assertEqual(state.save(), before)
        report = state.equilibrium(heard.append)
        self.assertEqual(len(heard), report["iterations"])
        self.assertGreater(report["seconds"], 0)
        state.correct(1)
        kept = state.positions_corrected(1)
        with self.assertRaises(sw.CancelledError):
            state.correct(2, watch=lambda residual: False)
        numpy.testing.assert_array_equal(state.positions_corrected(1), kept)
        heard.clear()
        state.correct(2, heard.append)
        self.assertEqual(len(heard), 2)
        with self.assertRaises(sw.CancelledError):
            state.fall_back(lambda residual: False)
        self.assertEqual(state.certify()["method"], sw.abi.SW_METHOD_LMA)
        self.assertEqual(state.fall_back(heard.append)["method"], sw.abi.SW_METHOD_WARP)
        self.assertGreater(len(heard), 2)

    def test_newton_steps_of_the_full_shell_bring_positions_nearer_to_it(self):
        made = model()
        made.precompute(modes=4)
        state, full = made.state("warp"), made.state("shell-implicit")
        for each in (state, full):
            each.set_gravity((0, 0, -2))
            each.equilibrium()
        exact = full.positions(dtype=numpy.float64)
        off = [abs(state.positions_corrected(steps, dtype=numpy.float64) - exact).max() for steps in (0, 1, 3)]
        self.assertEqual(off[0], abs(state.positions(dtype=numpy.float64) - exact).max())
        self.assertLess(off[2], 0.1 * off[0])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "steps is 101"):
            state.positions_corrected(101)
        state.correct(1)
        kept = state.positions_corrected(1, dtype=numpy.float64)
        state.correct(2)  # goes on
        further = abs(state.positions_corrected(1, dtype=numpy.float64) - exact).max()
        self.assertEqual(abs(kept - exact).max(), off[1])
        self.assertLess(further, off[2] * 1.001)
        state.correct(0)
        numpy.testing.assert_array_equal(state.positions_corrected(1, dtype=numpy.float64), kept)

    def test_an_equilibrium_that_fields_do_not_hold_is_corrected_until_it_is_the_full_shells(self):
        made = sw.Model(strip.arch())
        made.precompute(modes=2, reduced_fields=4, auto_full=False)
        info = made.info()
        self.assertEqual(info["auto_corrects"], 1)
        self.assertGreater(info["training_error_median"], 0.05)
        self.assertGreater(info["training_error_most"], info["training_error_median"])
        state, full = made.state(), made.state("shell-implicit")
        for each in (state, full):
            each.set_gravity(strip.GRAVITY)
            each.equilibrium()
        exact, plain = full.positions(dtype=numpy.float64), state.positions(dtype=numpy.float64)
        numpy.testing.assert_array_equal(state.positions_corrected(dtype=numpy.float64), plain)  # nothing is kept yet
        certificate = state.certify()
        self.assertEqual(certificate["corrected_error"], certificate["error"])
        state.correct()
        shown = state.positions_corrected(dtype=numpy.float64)
        # the last step moves by less than 1e-4 of the size, and Newton's leave less than they move by
        self.assertLess(abs(shown - exact).max(), 1e-4)  # 0.5 m long
        self.assertGreater(abs(plain - exact).max(), 1e-3)
        self.assertLess(state.certify()["corrected_error"], 0.01 * certificate["error"])
        with sw.Binding(made, plain * 0 + strip.arch().positions) as binding:
            bound = {steps: state.bound_points(binding, dtype=numpy.float64, correction_steps=steps)["positions"] for steps in ("auto", 2, 0)}
            numpy.testing.assert_array_equal(bound["auto"], bound[2])  # both have what is kept
            self.assertGreater(abs(bound["auto"] - bound[0]).max(), 0.5 * abs(shown - plain).max())
            state.bound_points(binding, correction_steps="auto", outside=True)  # is not refused
        state.correct(0)
        numpy.testing.assert_array_equal(state.positions_corrected(dtype=numpy.float64), plain)

    def test_auto_is_the_full_shell_where_fields_do_not_hold_it(self):
        made = sw.Model(strip.arch())
        made.precompute(modes=2, reduced_fields=1)
        self.assertEqual(made.info()["auto_method"], sw.methods()["shell-implicit"])
        moved = []
        for method, integrator in (("auto", "implicit-euler"), ("shell-implicit", "second-order"), ("shell-implicit", "implicit-euler"), ("polynomial-shell", "exact")):
            state = made.state(method, integrator)
            state.set_damping(ratio=0.1)
            state.set_gravity(strip.GRAVITY)
            for _ in range(5):
                state.step(1 / 30)
            moved.append(state.positions(dtype=numpy.float64))
        numpy.testing.assert_array_equal(moved[0], moved[1])
        self.assertTrue(all(abs(moved[0] - other).max() > 0 for other in moved[2:]))
        self.assertNotEqual(made.state(deterministic=True).save()[:16], made.state().save()[:16])  # it moves by fields, and its bytes say so
        with self.assertRaisesRegex(sw.UnsupportedError, "deterministic"):
            made.state("shell-implicit", deterministic=True)

    def test_no_step_is_taken_unasked_in_motion_nor_of_the_warp(self):
        made = sw.Model(strip.arch())
        made.precompute(modes=2, reduced_fields=4, auto_full=False)
        for method in ("auto", "warp"):
            state = made.state(method)
            state.set_gravity(strip.GRAVITY)
            state.step(1 / 30)
            saved, plain = state.save(), state.positions(dtype=numpy.float64)
            state.correct()
            numpy.testing.assert_array_equal(state.positions_corrected(dtype=numpy.float64), plain)
            self.assertEqual(state.save(), saved, "nothing is kept")
            state.correct(1)
            self.assertGreater(abs(state.positions_corrected(dtype=numpy.float64) - plain).max(), 0)
            state.correct("auto")
            self.assertEqual(state.save(), saved, "what was kept is forgotten")

    def test_no_step_is_taken_unasked_where_the_fields_hold_the_shell(self):
        made = sw.Model(strip.shell())
        made.precompute()
        info = made.info()
        self.assertEqual(info["auto_corrects"], 0)
        self.assertTrue(0 < info["training_error_median"] <= 0.05, info)
        state = made.state()
        state.set_gravity(strip.GRAVITY)
        state.equilibrium()
        saved, plain = state.save(), state.positions(dtype=numpy.float64)
        for steps in ((), ("auto",)):
            state.correct(*steps)
            numpy.testing.assert_array_equal(state.positions_corrected(*steps, dtype=numpy.float64), plain)
        self.assertEqual(state.save(), saved, "nothing is kept")

    def test_other_words_and_numbers_of_steps_are_refused_by_name(self):
        state, binding = swinging(made := model()), sw.Binding(made, strip.positions())
        for call, name in ((state.correct, "steps"), (state.positions_corrected, "steps"),
                           (lambda steps: state.bound_points(binding, correction_steps=steps), "correction_steps")):
            for wrong, message in (("all", "'all', expected one of 'auto'"), (-1, "-1, expected 0 to"), (0.5, "0.5, expected an integer")):
                with self.subTest(name, wrong=wrong), self.assertRaisesRegex(sw.InvalidArgumentError, f"^{name}: {message}"):
                    call(wrong)

    def test_a_tolerance_leaves_out_modes_and_static_corrections_stand_for_those_of_handles(self):
        counts = []
        for speed in (0, 0.1):
            made = model()
            made.precompute(0, tolerance=1e-3, handles=[119], handle_distance=0.05, handle_speed=speed, reduced_fields=0)
            counts.append(made.info()["modes"])
        self.assertLess(counts[1], counts[0])

    def test_every_constant_of_a_choice_has_a_word(self):
        from shellwarp import model as models, state as states
        for prefix, table in [("SW_METHOD_", states.methods()), ("SW_INTEGRATOR_", states.INTEGRATORS), ("SW_AXIS_", states.AXES),
                              ("SW_SPACE_", states.SPACES), ("SW_CONSTRAINT_", states.KINDS), ("SW_SHAPE_", models.SHAPES),
                              ("SW_PRECISION_", models.PRECISIONS)]:
            # A plane's own direction is given as three numbers.
            values = {value for name, value in vars(sw.abi).items() if name.startswith(prefix) and name != "SW_AXIS_DIRECTION"}
            self.assertEqual(values, set(table.values()), prefix)

    def test_log_messages_arrive_and_a_receiver_that_raises_harms_nothing(self):
        turned = strip.triangles()
        turned[5] = turned[5][::-1]
        heard = []
        sw.set_log(lambda level, message: heard.append((level, message)))
        sw.Model(strip.shell(triangles=turned))
        self.assertIn("warning", {level for level, _ in heard})
        unraisable, hook = [], sys.unraisablehook
        sys.unraisablehook = lambda info: unraisable.append(info.exc_type)
        try:
            sw.set_log(lambda level, message: 1 / 0)
            sw.Model(strip.shell(triangles=turned))
        finally:
            sys.unraisablehook = hook
            sw.set_log(None)
        self.assertIn(ZeroDivisionError, unraisable)

    def test_without_a_receiver_warnings_are_pythons_own_and_name_the_callers_line(self):
        script = """if True:
            import warnings, numpy, shellwarp as sw
            grid = numpy.array([[0.01 * i, 0.01 * j, 0] for i in range(11) for j in range(4)])
            squares = [4 * i + j for i in range(10) for j in range(3)]
            triangles = [t for a in squares for t in ((a, a + 4, a + 5), (a, a + 5, a + 1))]
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                for sheet in (sw.Sheet(3e9, 0.3, 4e-4, 750), sw.Sheet(3, 0.3, 4e-4, 750), sw.Sheet(3e9, 4e-4, 0.3, 750), sw.Sheet.known("card", 0.01)):
                    shell = sw.Shell(grid / sheet.metres_per_unit, triangles, sheet, fixed=range(8))
                    sw.Model(shell).precompute(4, reduced_fields=0)
                    print([(w.category.__name__, w.filename, str(w.message)) for w in caught])
                    caught.clear()
            sw.set_log(None)
            sw.Model(sw.Shell(grid, triangles, sw.Sheet(3e9, 4e-4, 0.3, 750)))
        """
        run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=dict(os.environ), timeout=120)
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        card, gpa, swapped, centimetres = run.stdout.splitlines()
        self.assertEqual((card, centimetres), ("[]", "[]"))
        self.assertIn("('ShellwarpWarning', '<string>', 'its own weight turns the shell", gpa)
        self.assertIn("young is in Pa", gpa)
        self.assertIn("of the mesh\'s size", swapped.replace("\\", ""))


class Creases(unittest.TestCase):
    def test_a_folded_strip_rests_folded_and_a_rest_shape_curls_it(self):
        flat = strip.positions(numpy.float64)
        n = len(flat)
        columns = numpy.unique(numpy.round(flat[:, 0], 6))
        middle = numpy.flatnonzero(numpy.abs(flat[:, 0] - columns[len(columns) // 2]) < 1e-6)
        middle = middle[numpy.argsort(flat[middle, 1])]
        folds = [(a, b, 1.0, 1.0) for a, b in zip(middle[:-1], middle[1:])]
        with sw.Model(strip.shell(positions=flat, creases=folds)) as made:
            made.precompute(modes=6, reduced_fields=0)
            self.assertGreater(numpy.abs(made.state().positions()[:, 2]).max(), 0.2 * numpy.ptp(flat[:, 0]))
        soft = [(a, b, 0.02, None, 0.02) for a, b, *_ in folds]
        with sw.Model(strip.shell(positions=flat, creases=soft)) as made:
            made.precompute(modes=6, reduced_fields=0)
            with self.assertRaisesRegex(sw.UnsupportedError, "creases cannot yield"):
                made.state("warp")
            state = made.state("shell-implicit")
            end = int(numpy.argmax(flat[:, 0]))
            state.set_constraint(1, "position", end, position=flat[end] - numpy.ptp(flat[:, 0]) * numpy.array([0.1, 0, 0.2]))
            state.equilibrium()
            state.clear_constraint()
            state.equilibrium()
            self.assertLess(state.positions()[end, 2], -0.05 * numpy.ptp(flat[:, 0]))
            state.reset()
            state.equilibrium()
            self.assertLess(abs(state.positions()[end, 2]), 1e-6 * numpy.ptp(flat[:, 0]))
        radius = 2 * numpy.ptp(flat[:, 0])
        angle = (flat[:, 0] - flat[:, 0].min()) / radius
        curled = numpy.stack([flat[:, 0].min() + radius * numpy.sin(angle), flat[:, 1], radius * (1 - numpy.cos(angle))], axis=1)
        with sw.Model(strip.shell(positions=flat, rest_positions=curled)) as made:
            made.precompute(modes=6, reduced_fields=0)
            self.assertGreater(made.state().positions()[:, 2].max(), 0.5 * curled[:, 2].max())
        for bad, words in (([(0, n + 5)], "the mesh has"), ([(0,)], "each is"), ([(int(middle[0]), int(middle[1]), -1.0)], "factor of crease 0"),
                           ([(int(middle[0]), int(middle[1]), 1.0, None, -1.0)], "yield angle of crease 0")):
            with self.assertRaisesRegex(sw.InvalidArgumentError, words):
                sw.Model(strip.shell(positions=flat, creases=bad))
        with self.assertRaisesRegex(sw.InvalidArgumentError, "rest_positions: 3 rows"):
            sw.Model(strip.shell(positions=flat, rest_positions=flat[:3]))


class Stiffness(unittest.TestCase):
    def test_a_factor_of_four_hangs_a_quarter_as_far(self):
        made = model()
        hangs = []
        for factor in (1.0, 4.0):
            state = made.state("lma")
            state.set_stiffness(factor)
            state.set_gravity([0, 0, -0.1])
            state.equilibrium()
            hangs.append(-state.positions()[:, 2].min())
        self.assertAlmostEqual(hangs[0] / hangs[1], 4, delta=1e-4)   # linear, in 32 bits
        with self.assertRaisesRegex(sw.InvalidArgumentError, "factor is -1"):
            state.set_stiffness(-1)

    def test_a_frequency_and_a_sag_give_the_stiffness(self):
        made = model()
        state = made.state()
        factor = state.set_frequency(3 * made.frequencies()[0])
        self.assertAlmostEqual(factor, 9, delta=1e-12)
        state.set_gravity([0, 0, -9.8])
        for wanted in (0.02, 0.05):
            factor = state.set_sag(wanted)
            state.set_stiffness(factor)
            state.equilibrium()
            self.assertAlmostEqual(state.report()["max_displacement"] / wanted, 1, delta=0.011)   # the tolerance
        state.set_gravity([0, 0, 0])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "nothing moves"):
            state.set_sag(0.01)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "length is -1"):
            state.set_sag(-1)


class Damping(unittest.TestCase):
    def test_factors_of_vertices_multiply_and_are_refused_by_their_number(self):
        made = model()
        ends = []
        for damping in ({"mass": 2.0}, {"mass": 0.8, "factors": numpy.full(len(strip.positions(numpy.float64)), 2.5, dtype=numpy.float32)}):
            state = made.state("warp")
            state.set_damping(**damping)
            state.set_gravity([0, 0, -1])
            for _ in range(10):
                state.step(0.01)
            ends.append(state.positions())
        self.assertLess(abs(ends[0] - ends[1]).max(), 1e-6)   # positions have 32 bits
        with self.assertRaisesRegex(sw.InvalidArgumentError, "^the number of factors is 3"):
            state.set_damping(mass=1.0, factors=[1, 1, 1])


class Zeros(unittest.TestCase):
    def test_what_would_become_a_default_is_refused(self):
        for material, message in [(sw.Material(0, 0, 0), "area, length and bend are all 0"), (sw.Material(density=0), "density is 0")]:
            with self.assertRaisesRegex(sw.InvalidArgumentError, message):
                sw.Model(strip.shell(material=material))
        sw.Model(strip.shell(material=sw.Material(area=0, bend=0))).close()

    def test_messages_have_pythons_names(self):
        with self.assertRaisesRegex(sw.InvalidArgumentError, "^young_across is given, but the number of directions is 0"):
            sw.Model(strip.shell(material=sw.Sheet(7e10, 0.3, 1e-3, 2700.0, young_across=7e9)))


class Units(unittest.TestCase):
    def test_a_unit_that_is_told_gives_gravity_and_what_weight_does(self):
        sheet = sw.Sheet(7e10, 0.3, 1e-3, 2700.0)
        for metres, gravity in ((0.0, 0.0), (0.01, 980.665)):
            with sw.Model(strip.shell(material=sheet, metres_per_unit=metres)) as made:
                made.precompute(modes=2, reduced_fields=0)
                told = made.info()
            self.assertEqual((told["metres_per_unit"], told["weight_moves"] > 0, told["weight_turns"] > 0), (metres, metres > 0, metres > 0))
            self.assertAlmostEqual(told["earth_gravity"], gravity, delta=1e-9)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "metres_per_unit is -1"):
            sw.Model(strip.shell(material=sheet, metres_per_unit=-1.0))


class Grain(unittest.TestCase):
    def test_a_strip_swings_by_the_modulus_along_it_and_uvs_tell_directions(self):
        flat, triangles = strip.positions(numpy.float64), strip.shell().triangles
        uvs = numpy.stack([flat[:, 1], -flat[:, 0]], axis=1)   # u grows along y
        directions = sw.directions_of_uvs(flat, triangles, uvs)
        self.assertTrue(numpy.allclose(directions, [0, 1, 0], atol=1e-12))
        corners = uvs[numpy.asarray(triangles)]
        self.assertTrue(numpy.array_equal(sw.directions_of_uvs(flat, triangles, corners), directions))

        def slowest(young, across, given):
            sheet = sw.Sheet(young, 0.0, 1e-3, 2700.0, young_across=across)
            with sw.Model(strip.shell(material=sheet, directions=given)) as made:
                made.precompute(modes=2)
                return made.frequencies()[0]

        stiff, soft = slowest(7e10, 0.0, None), slowest(7e9, 0.0, None)
        # A slender strip without Poisson's ratio: its clamp hardly tells one shear modulus from another.
        self.assertAlmostEqual(slowest(7e10, 7e9, [1, 0, 0]) / stiff, 1, delta=5e-3)
        self.assertAlmostEqual(slowest(7e10, 7e9, directions.astype(numpy.float32)) / soft, 1, delta=5e-3)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "the number of directions is 0"):
            slowest(7e10, 7e9, None)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "2 directions"):
            slowest(7e10, 7e9, [[1, 0, 0], [0, 1, 0]])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "triangle 0 are on a line"):
            sw.directions_of_uvs(flat, triangles, numpy.zeros_like(uvs))


class Colliders(unittest.TestCase):
    def test_a_strip_comes_to_lie_on_a_floor_and_a_saved_collider_is_the_same(self):
        made = model()
        state = swinging(made)
        floor = sw.Collider.load(sw.Collider.plane(friction=0.4).save())
        state.set_colliders([floor])
        floor.close()   # the state goes on with it
        state.move_collider(0, [0, 0, -0.05])
        run(made, 60, state)
        self.assertGreater(state.positions()[:, 2].min(), -0.0501)
        self.assertGreater(len(state.contacts()), 0)
        self.assertLess(state.report()["deepest_penetration"], 1e-4)
        self.assertGreater(sum(contact["force"][2] for contact in state.contacts()), 0)
        state.set_colliders()
        run(made, 60, state)
        self.assertLess(state.positions()[:, 2].min(), -0.06)

    def test_two_shells_stop_where_the_other_rests(self):
        """Strips 10 cm apart, of which the upper falls and the lower is pushed up, each onto the hull of the other's rest shape, 1 cm thick on either side."""
        made = model()
        rest = numpy.array(strip.shell().positions)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "lie in a plane"):
            sw.Collider.hull(rest)
        hull = sw.Collider.hull(numpy.concatenate([rest - [0, 0, 0.01], rest + [0, 0, 0.01]]), friction=0.3)
        for down in (1, -1):
            free, state = made.state("warp"), made.state("warp")
            state.set_colliders([hull])
            state.move_collider(0, [0, 0, -0.1 * down])
            for shell in (free, state):
                shell.set_gravity([0, 0, -9.8 * down])
                shell.set_damping(0.1)
                for _ in range(60):
                    shell.step(1 / 30)
            self.assertLess((down * free.positions()[:, 2]).min(), -0.12)
            self.assertAlmostEqual((down * state.positions()[:, 2]).min(), -0.09, delta=1e-5)  # what is left of a gap
            self.assertGreater(state.report()["contact_count"], 0)

    def test_a_mesh_that_deforms_lifts_the_strip_and_the_push_out_is_for_the_eye(self):
        corners = numpy.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 0)], float)
        quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        triangles = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
        state = swinging(model())
        state.set_colliders([sw.Collider.deforming(corners, triangles)])
        state.move_collider(0, [0, 0, -0.05])
        for frame in range(60):
            state.deform_collider(0, corners + [0, 0, 0.02 * frame / 60])
            state.step(1 / 30)
        self.assertGreater(state.positions()[:, 2].min(), -0.0305)
        outside, left = state.positions_outside(dtype=numpy.float64)
        self.assertGreaterEqual(outside[:, 2].min(), -0.0303333 - 1e-6)
        self.assertLess(left, 1e-9)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "vertices"):
            state.deform_collider(0, corners[1:])
        fit = sw.Collider.fit_capsule([[0, 0, z] for z in range(5)] + [[0.5, 0, 2], [-0.5, 0, 2]])
        self.assertLess(fit["radius"], 0.6)
        with self.assertRaises(sw.InvalidArgumentError):
            sw.Collider.fit_capsule(numpy.empty((0, 3)))

    def test_an_open_ground_of_two_triangles_holds_the_strip_up(self):
        corners, triangles = numpy.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), [[0, 1, 2], [0, 2, 3]]
        with self.assertRaisesRegex(sw.ShellwarpError, "the mesh is open.*one-sided"):
            sw.Collider.mesh(corners, triangles)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "depth"):
            sw.Collider.mesh(corners, triangles, depth=0.1)
        for collider in (sw.Collider.mesh(corners, triangles, one_sided=True), sw.Collider.deforming(corners, triangles, one_sided=True, depth=0.2)):
            made = model()
            state = swinging(made)
            state.set_colliders([sw.Collider.load(collider.save())])
            state.move_collider(0, [0, 0, -0.05])
            run(made, 60, state)
            self.assertGreater(state.positions()[:, 2].min(), -0.0501)
            self.assertGreater(state.report()["contact_count"], 0)

    def test_contact_patches_are_modes_of_their_own(self):
        made = sw.Model(strip.shell())
        made.precompute(modes=4, contact_patches=[60, 90], reduced_fields=0)
        self.assertEqual(made.info()["modes"], 6)
        with sw.Collider.sphere(0.1) as ball:
            far, near = (made.patches_near([ball, ball], 0.5, 5, [((0, 0, z), ()), ((0, 0, -z), ())]) for z in (100, 0.2))
            self.assertEqual(far, [])
            self.assertEqual(len(set(near)), 5)
            self.assertEqual(made.patches_near([ball], 0.5, 5), made.patches_near([ball], 0.5, 5, [((0, 0, 0), ())]))
            with self.assertRaises(ValueError):
                made.patches_near([ball, ball], 0.5, 5, [((0, 0, 0), ())])
        with self.assertRaisesRegex(sw.InvalidArgumentError, r"contact_patches\[1\] is vertex 99999"):
            made.precompute(modes=4, contact_patches=[60, 99999])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "contact_patches"):
            made.precompute(modes=4, contact_patches=[60], auto_error=0.01)

    def test_meshes_hulls_and_what_is_wrong(self):
        corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        with sw.Collider.hull(corners) as hull:
            self.assertFalse(hull.closed)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "radius"):
            sw.Collider.sphere(0)
        with self.assertRaises(sw.ShellwarpError):
            sw.Collider.mesh(corners, [[0, 1, 2]])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "collider 0 of 0"):
            swinging(model()).move_collider(0)


class AxisSupports(unittest.TestCase):
    def test_what_is_held_along_axes_stays(self):
        rest, triangles = strip.positions(numpy.float64), strip.triangles()
        tip = len(rest) - 1
        made = sw.Model(sw.Shell(rest, triangles, fixed=[0, 1, 2, 3], axes={tip: "xy", tip - 3: [[1, 0, 1]]}))
        made.precompute(modes=8, precision="f64")
        state = made.state()
        state.set_gravity([3, 2, -9.8])
        for _ in range(10):
            state.step(1 / 24)
        moved = state.positions(dtype=numpy.float64) - rest
        self.assertEqual(moved[tip, :2].tolist(), [0, 0])
        self.assertNotEqual(moved[tip, 2], 0)
        self.assertLess(abs(moved[tip - 3, 0] + moved[tip - 3, 2]), 1e-12)
        for wrong in ("xw", "", [0, 0, 0], [1, 0]):
            with self.assertRaisesRegex(sw.InvalidArgumentError, "axes"):
                sw.Model(sw.Shell(rest, triangles, axes={tip: wrong}))

    def test_half_a_strip_on_a_plane_of_symmetry_has_frequencies_of_the_whole(self):
        rest, triangles = strip.positions(numpy.float64), numpy.asarray(strip.triangles())
        rest = rest - rest[-1] * [1, 0, 0]   # it ends at x = 0
        middle = [v for v, x in enumerate(rest) if x[0] > -1e-9]
        image = numpy.arange(len(rest))
        image[[v for v in range(len(rest)) if v not in middle]] = len(rest) + numpy.arange(len(rest) - len(middle))
        both = numpy.concatenate([rest, numpy.delete(rest, middle, axis=0) * [-1, 1, 1]])
        fixed = [0, 1, 2, 3]

        def frequencies(shell, modes):
            made = sw.Model(shell)
            made.precompute(modes=modes, precision="f64")
            return made.frequencies()
        all_of_it = frequencies(sw.Shell(both, numpy.concatenate([triangles, image[triangles[:, ::-1]]]), fixed=fixed + image[fixed].tolist()), 8)
        for given in ("x", [-1, 0, 0]):
            half = frequencies(sw.Shell(rest, triangles, fixed=fixed, symmetric=dict.fromkeys(middle, given)), 3)
            # Both searches end at 1e-10.
            self.assertTrue(all(numpy.abs(all_of_it / one - 1).min() < 1e-8 for one in half), (half, all_of_it))
        with self.assertRaisesRegex(sw.InvalidArgumentError, "symmetric: 'w'"):
            sw.Model(sw.Shell(rest, triangles, symmetric={0: "w"}))
        with self.assertRaisesRegex(sw.InvalidArgumentError, "vertex 0 is to be on a plane of symmetry"):
            sw.Model(sw.Shell(rest, triangles, symmetric={0: "x"}))


class Ties(unittest.TestCase):
    def test_two_strips_move_as_one(self):
        rest, triangles = strip.positions(numpy.float64), strip.triangles()
        n, length = len(rest), rest[-1, 0]
        both = numpy.concatenate([rest, rest + [length, 0, 0]])
        faces = numpy.concatenate([triangles, numpy.asarray(triangles) + n])
        seam = [(n + k, n - 4 + k) for k in range(4)]
        for ties in ({"ties": seam}, {"ties": [(a, b, 1e3) for a, b in seam]}, {"tie_distance": 1e-6},
                     {"triangle_ties": [(a, len(triangles) - 1) for a, _ in seam]}):
            made = sw.Model(sw.Shell(both, faces, fixed=[0, 1, 2, 3, 2 * n - 1], **ties))
            self.assertEqual(made.info()["n_components"], 1)
        loose = sw.Model(sw.Shell(both, faces, fixed=[0, 1, 2, 3]))
        self.assertEqual(loose.info()["n_components"], 2)
        for wrong in ({"ties": [(0, 0)]}, {"ties": [(0, 2 * n)]}, {"tie_distance": -1.0}):
            with self.assertRaisesRegex(sw.InvalidArgumentError, "tie"):
                sw.Model(sw.Shell(both, faces, **wrong))


class Floating(unittest.TestCase):
    """A strip that nothing holds, by reduced shells, whose frame floats."""

    @classmethod
    def setUpClass(cls):
        cls.model = sw.Model(strip.shell(fixed=()))
        cls.model.precompute(modes=12, reduced_fields=8, reduced_poses=4, handles=[0, 3])

    def test_it_falls_as_one(self):
        for method in ("reduced-shell", "polynomial-shell"):
            state = self.model.state(method)
            state.set_gravity(strip.GRAVITY)
            for _ in range(30):
                state.step(1 / 30)
            fallen = state.positions(dtype=numpy.float64) - strip.positions(numpy.float64)
            # a parabola whatever the step; float32 fields turn and bend it by their rounding
            self.assertLess(numpy.abs(fallen - [0, 0, -4.9]).max(), 1e-5, method)

    def test_handles_carry_it_and_let_it_go(self):
        state = self.model.state("polynomial-shell")
        state.set_gravity(strip.GRAVITY)
        rest = strip.positions(numpy.float64)
        for k in range(30):
            for v in (0, 3):
                state.set_constraint(v, "position", v, rest[v] + [0, 0, 0.01 * k])
            state.step(1 / 60)
        self.assertLess(numpy.abs(state.positions(dtype=numpy.float64)[[0, 3]] - rest[[0, 3]] - [0, 0, 0.29]).max(), 1e-6)
        state.clear_constraint()
        before = state.positions(dtype=numpy.float64).mean(axis=0)
        for _ in range(30):
            state.step(1 / 60)
        self.assertLess(state.positions(dtype=numpy.float64).mean(axis=0)[2], before[2])

    def test_a_handle_that_is_no_vertex_is_refused_by_name(self):
        with self.assertRaisesRegex(Exception, r"handles\[1\] is vertex 900"):
            sw.Model(strip.shell(fixed=())).precompute(modes=12, reduced_fields=8, reduced_poses=4, handles=[0, 900])


class MovingRest(unittest.TestCase):
    def test_the_shell_goes_with_its_rest_shape(self):
        rest = strip.positions(numpy.float64)
        state = swinging(model())
        for k in range(5):
            state.move_rest(rest + [0, 0.02 * k, 0])
            state.step(1 / 24)
        moved = state.positions(dtype=numpy.float64)
        self.assertLess(abs(moved[0] - rest[0] - [0, 0.08, 0]).max(), 1e-6)
        state.move_rest(2 * rest, teleport=True)
        state.step(1 / 24)
        self.assertAlmostEqual(state.report()["rest_stretch"], 1.0, places=4)  # of a mesh in 32 bits
        with self.assertRaisesRegex(sw.InvalidArgumentError, "vertex 0"):
            state.move_rest(numpy.full_like(rest, numpy.nan))
        state.set_method("shell-implicit")   # whose own rest is twice as large then
        state.reset()
        state.set_gravity((0, 0, -0.01))
        state.equilibrium()
        hangs = (2 * rest - state.positions(dtype=numpy.float64))[:, 2].max()
        self.assertTrue(1e-5 < hangs < 0.1, hangs)
        state.move_rest(None)
        self.assertEqual(state.report()["rest_stretch"], 0)


    def test_a_ball_holds_it_up_and_what_is_bound_goes_out_with_it(self):
        rest = strip.positions(numpy.float64)
        made = model()
        state, binding = swinging(made), sw.Binding(made, rest + [0, 0, -0.004])
        end = rest[rest[:, 0].argmax()]
        center, radius = end + [-0.02, 0, -0.052], 0.05
        state.set_colliders([sw.Collider.sphere(radius)])
        state.move_collider(0, center)
        for k in range(20):
            state.move_rest(rest - [0, 0, 0.001 * k])
            state.step(1 / 24)
        depth = lambda x: (radius - numpy.linalg.norm(x - center, axis=1)).max()
        self.assertLess(depth(state.positions(dtype=numpy.float64)), 1e-3)
        self.assertGreater(depth(state.bound_points(binding, dtype=numpy.float64)["positions"]), 1e-3)
        out = state.bound_points(binding, dtype=numpy.float64, outside=True)["positions"]
        self.assertLess(depth(out), 1e-6)
        state.load(state.save())
        self.assertEqual(abs(state.bound_points(binding, dtype=numpy.float64, outside=True)["positions"] - out).max(), 0)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "not both"):
            state.bound_points(binding, outside=True, correction_steps=1)
        with self.assertRaisesRegex(sw.ShellwarpError, "moves"):
            state.bound_points(binding, correction_steps=1)


class MovingSupports(unittest.TestCase):
    def test_supports_go_where_they_are_sent(self):
        rest, triangles = strip.positions(numpy.float64), strip.triangles()
        held = numpy.flatnonzero((rest[:, 0] < rest[3, 0] + 1e-9) | (rest[:, 0] > rest[-4, 0] - 1e-9))
        far = rest[:, 0] > 0.5 * rest[-1, 0]
        made = sw.Model(sw.Shell(rest, triangles, fixed=held.tolist()))
        made.precompute(modes=8, support_fields=24)
        self.assertGreater(made.info()["support_fields"], 6)
        state = made.state("warp")
        for i in range(10):
            place, angle = numpy.full_like(rest, numpy.nan), 0.05 * i
            place[held] = rest[held] + [0.01 * i, 0, 0]
            turned = far[held]
            y, z = rest[held][turned, 1], rest[held][turned, 2]
            place[held[turned], 1:] = numpy.stack([y * numpy.cos(angle) - z * numpy.sin(angle),
                                                   y * numpy.sin(angle) + z * numpy.cos(angle)], axis=1)
            state.move_supports(place, teleport=i == 5)
            state.step(1 / 24)
            self.assertLess(numpy.abs(state.positions(dtype=numpy.float64)[held] - place[held]).max(), 1e-12)
        self.assertLess(state.report()["support_miss"], 1e-3)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "support"):
            state.move_supports(numpy.full_like(rest, numpy.inf))
        made.precompute(modes=8, reduced_fields=0)
        with self.assertRaisesRegex(sw.ShellwarpError, "precompute with support_fields"):
            made.state("warp").move_supports(place)


class Bindings(unittest.TestCase):
    def test_points_follow_with_normals_and_velocities(self):
        made = model()
        state = run(made, 20)
        corners = strip.positions(numpy.float64)
        points = numpy.concatenate([corners, corners + [0, 0, 0.002]])
        normals = numpy.tile([0.0, 0.0, 1.0], (len(points), 1))
        binding = sw.Binding(made, points, normals)
        self.assertEqual(binding.info()["has_normals"], 1)
        got = state.bound_points(binding, ["positions", "normals", "velocities"], dtype=numpy.float64)
        # The vertices' own points are the vertices, in 32 bits of the displacement.
        self.assertLess(numpy.abs(got["positions"][:len(corners)] - state.positions(dtype=numpy.float64)).max(), 1e-6)
        off = got["positions"][len(corners):] - got["positions"][:len(corners)]
        self.assertLess(numpy.abs(numpy.linalg.norm(off, axis=1) / 0.002 - 1).max(), 1e-2)
        self.assertLess(numpy.abs(off / 0.002 - got["normals"][:len(corners)]).max(), 0.1)
        self.assertGreater(numpy.abs(got["velocities"]).max(), 1e-3)
        loaded = sw.Binding.load(made, binding.save())
        filled = {"positions": numpy.zeros((len(points), 3))}
        state.bound_points(loaded, out=filled)
        self.assertTrue(numpy.array_equal(filled["positions"], got["positions"]))

    def test_what_is_wrong_is_named(self):
        made = model()
        points = strip.positions()
        with self.assertRaisesRegex(sw.InvalidArgumentError, "normals: 1 rows"):
            sw.Binding(made, points, normals=[[0, 0, 1]])
        with self.assertRaisesRegex(sw.InvalidArgumentError, r"points\[3\]"):
            sw.Binding(made, numpy.where(numpy.arange(len(points))[:, None] == 3, numpy.nan, points))
        binding = sw.Binding(made, points)
        with self.assertRaisesRegex(sw.UnsupportedError, "without normals"):
            swinging(made).bound_points(binding, ["normals"])
        with self.assertRaisesRegex(sw.InvalidArgumentError, "'colours' is none of"):
            swinging(made).bound_points(binding, ["colours"])


class Proxies(unittest.TestCase):
    def asset(self, n=31):
        """Two sheets that face away from each other, as quads cut in two."""
        x, y = numpy.meshgrid(numpy.linspace(0, 1, n), numpy.linspace(0, 1, n), indexing="ij")
        sheet = numpy.stack([x.ravel(), y.ravel(), 0.1 * numpy.sin(3 * x.ravel())], axis=1)
        a = numpy.array([i * n + j for i in range(n - 1) for j in range(n - 1)])
        triangles = numpy.concatenate([numpy.stack([a, a + n, a + n + 1], 1), numpy.stack([a, a + n + 1, a + 1], 1)])
        return numpy.concatenate([sheet + [0, 0, 0.005], sheet - [0, 0, 0.005]]), numpy.concatenate([triangles, triangles[:, ::-1] + len(sheet)])

    def test_a_slab_is_carried_by_the_sheet_in_its_middle(self):
        positions, triangles = self.asset()
        proxy = sw.Proxy(positions, triangles, 150)
        info = proxy.info()
        self.assertLess(abs(info["n_vertices"] - 150), 18)
        self.assertEqual((info["n_pieces"], info["n_cut"], info["n_sides_joined"]), (1, 0, len(triangles) // 2))
        self.assertGreater(info["worst_quality"], 0.4)
        x, t = proxy.positions(), proxy.triangles()
        self.assertFalse([d for d in sw.check_mesh(x, t) if d.is_error])
        # Painted values come along: of a linear one, what it is there, but that the middle lies half a thickness along the slope of 0.3 from the side.
        self.assertLess(numpy.abs(proxy.carried(positions[:, :2]) - x[:, :2]).max(), 0.3 * 0.005)
        self.assertLess(numpy.linalg.norm(x[proxy.nearest()] - positions, axis=1).max(), 1.2 * info["edge_length"])
        shell = sw.Shell(x, t, sw.Material(bend=0.1), fixed=numpy.flatnonzero(x[:, 0] < 0.05))
        made = sw.Model(shell)
        made.precompute(modes=6)
        state = made.state("warp")
        state.set_gravity([0, 0, -1])
        state.step(1 / 30)
        drawn = state.bound_points(sw.Binding(made, positions), ["positions"])["positions"]
        self.assertEqual(drawn.shape, positions.shape)

    def test_a_model_is_as_stiff_as_the_proxys_asset(self):
        positions, triangles = self.asset()
        held = numpy.flatnonzero(positions[:, 0] < 0.101)
        proxy = sw.Proxy(positions, triangles, 60, held=held)
        shell = sw.Shell(proxy.positions(), proxy.triangles(), sw.Sheet(1e9, 0.3, 0.01, 1000), fixed=numpy.unique(proxy.nearest()[held]))
        plain, fitted = sw.Model(shell), sw.Model(shell)
        found = fitted.calibrate(proxy)
        self.assertLess(found["difference_after"], 0.5 * found["difference_before"])
        self.assertEqual(found["n_compared"], len(positions) // 2)
        for model in (plain, fitted):
            model.precompute(modes=1, reduced_fields=0)
        # The sheet in the middle of the slab, itself.
        n = len(positions) // 2
        middle = 0.5 * (positions[:n] + positions[n:])
        own = sw.Model(sw.Shell(middle, triangles[:len(triangles) // 2], shell.material, fixed=held[held < n]))
        own.precompute(modes=1, reduced_fields=0)
        off = [abs(model.frequencies()[0] / own.frequencies()[0] - 1) for model in (plain, fitted)]
        self.assertLess(off[1], 0.5 * off[0])
        for again in (fitted, plain):
            with self.assertRaisesRegex(sw.InvalidArgumentError, "before: calibrate one that is new"):
                again.calibrate(proxy)
        unheld = sw.Proxy(positions, triangles, 60)
        other = sw.Model(sw.Shell(unheld.positions(), unheld.triangles(), fixed=numpy.unique(unheld.nearest()[held])))
        with self.assertRaisesRegex(sw.UnsupportedError, "held"):
            other.calibrate(unheld)
        other.calibrate(unheld, held)

    def test_what_is_no_manifold_is_named_or_cut(self):
        sheets = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 1]]
        triangles = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
        with self.assertRaisesRegex(sw.InvalidMeshError, "3 triangles meet at the edge from vertex 0"):
            sw.Proxy(sheets, triangles, 60)
        self.assertEqual(sw.Proxy(sheets, triangles, 60, cut=True).info()["n_pieces"], 2)
        with self.assertRaisesRegex(sw.InvalidArgumentError, "n_vertices is 1"):
            sw.Proxy(sheets, triangles, 1)


if __name__ == "__main__":
    unittest.main()
