"""Claims about rest shapes that shape keys and modifiers lead, in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
import shellwarp as sw
from scene import add_strip, key, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, ball, collide, run_of

LENGTH = 0.3


def curl(points, angle):
    """The strip as an arc that turns by so much."""
    x, radius = points[:, :1], LENGTH / angle
    return numpy.hstack([radius * numpy.sin(x / radius), points[:, 1:2], radius * (1 - numpy.cos(x / radius))])


def add_curled():
    """A strip that a shape key curls by half a radian until frame 8; at frame 20 it is flat again."""
    obj = add_strip()
    obj.shape_key_add(name="Basis")
    block = obj.shape_key_add(name="curled")
    rest = part("inputs").rest_positions(obj.data).astype(float)
    block.data.foreach_set("co", curl(rest, 0.5).astype(numpy.float32).ravel())
    for frame, value in ((1, 0.0), (8, 1.0), (14, 1.0), (20, 0.0)):
        block.value = value
        block.keyframe_insert("value", frame=frame)
    obj.shellwarp.follow_rest = True
    return obj, block


class Rest(Case):
    def test_a_shape_key_leads_the_rest_shape_as_the_library_does(self):
        obj, block = add_curled()
        obj.rotation_euler.z = 0.3
        key(obj, "location", {1: (0, 0, 0), 10: (0.1, 0, 0), 20: (0.1, 0.05, 0)})
        s = obj.shellwarp
        rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
        model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
        model.precompute(modes=s.modes, reduced_fields=0)
        state = model.state("warp")
        state.set_gravity(self.scene.gravity)
        state.set_damping(s.damping_ratio)
        off, curled = 0.0, part("meshes").key_positions(obj.data, "curled").astype(float)
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            self.assertEqual(self.message(obj), "")
            matrix = numpy.array(obj.matrix_world)
            led = (rest + block.value * (curled - rest)) @ matrix[:3, :3].T + matrix[:3, 3]
            state.move_rest(led)
            if frame == 1:
                state.reset()
            else:
                state.step(1 / 30)
            off = max(off, numpy.abs(shown(obj, world=True) - state.positions()).max())
        self.assertLess(off, 2e-5)  # of 0.3: Blender blends shape keys and keeps matrices in float32, and inertia is of their second differences
        self.assertGreater(numpy.abs(shown(obj, world=True) - led).max(), 1e-2)  # and it swings

    def test_the_whole_shape_goes_and_not_the_pins_alone(self):
        obj, _ = add_curled()
        obj.shellwarp.gravity, obj.shellwarp.damping_ratio = 0.0, 1.0
        play(14)
        rest = part("inputs").rest_positions(obj.data).astype(float)
        self.assertLess(numpy.abs(shown(obj) - curl(rest, 0.5)).max(), 1e-2)  # of 7 cm at the end: it swings there
        obj.shellwarp.follow_rest = False
        self.scene.frame_set(15)
        self.assertIn("Rest shape follows was switched", self.message(obj))
        play(14)
        self.assertEqual(self.message(obj), "")
        self.assertLess(shown(obj)[-1, 2], 0.02)  # its pins, the first two rows, hardly move, and the end is not at 7 cm

    def test_scrubbing_motion_blur_and_bake_are_exact(self):
        obj, _ = add_curled()
        part("simulation").KEPT, kept = 4, part("simulation").KEPT
        self.addCleanup(setattr, part("simulation"), "KEPT", kept)
        found = {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            found[frame] = shown(obj)
        known = run_of(obj).known
        self.assertEqual([frame for frame in known if known[frame].whole is not None], [1, 5, 9, 13, 17])
        for frame in (6, 15, 3, 20, 1):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)
        self.scene.frame_set(8, subframe=0.25)
        self.assertEqual(self.message(obj), "")
        self.assertLess(numpy.abs(shown(obj) - found[8]).max(), numpy.abs(found[9] - found[8]).max())
        self.scene.frame_set(6)
        obj.shellwarp.gravity = -1.0  # frame 7 anew, and again as it was
        self.scene.frame_set(7)
        self.assertFalse(numpy.array_equal(shown(obj), found[7]))
        obj.shellwarp.gravity = 1.0
        for frame in range(7, 13):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertIn("not certified: ", obj.shellwarp.verdict)
        for frame in (2, 9, 20):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)

    def test_a_render_mesh_goes_along(self):
        obj, _ = add_curled()
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=2, size=1, location=(0.15, 0.015, 0))
        drawn = bpy.context.object
        drawn.scale = (0.28, 0.028, 1)
        obj.shellwarp.renders.add().target = drawn
        bpy.context.view_layer.objects.active, obj.shellwarp.gravity = obj, 0.0
        play(10)
        self.assertEqual(self.message(obj), "")
        mine, theirs = shown(obj, world=True), shown(drawn, world=True)
        end = theirs[theirs[:, 0].argmax()]
        self.assertLess(numpy.linalg.norm(mine - end, axis=1).min(), 0.015)
        self.assertGreater(end[2] - theirs[theirs[:, 0].argmin(), 2], 0.02)

    def test_colliders_handles_and_the_full_shell_go_with_it(self):
        obj, _ = add_curled()
        collide(ball())
        bpy.context.view_layer.objects.active = obj
        play(2)
        self.assertEqual(self.message(obj), "")
        bpy.ops.shellwarp.add_handle(vertex=120)
        play(2)
        self.assertEqual(self.message(obj), "")
        obj.shellwarp.method = "shell-implicit"
        play(2)
        self.assertEqual(self.message(obj), "")


if __name__ == "__main__":
    unittest.main()
