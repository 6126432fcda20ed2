"""Claims about shells that nothing holds, or that handles alone hold, in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
from scene import ROOT, add_strip, key, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, run_of

FLOOR = -0.1  # below the strip, which falls for 4.3 frames of 1/30 s


def add_free_strip():
    """The strip without pins, by the default method."""
    obj = add_strip()
    obj.shellwarp.fixed_group = ""
    obj.shellwarp.property_unset("method")
    return obj


def add_floor():
    bpy.ops.object.empty_add(location=(0, 0, FLOOR))
    bpy.context.object.shellwarp_collider.enabled = True
    bpy.context.view_layer.objects.active = bpy.data.objects["Strip"]


def lead(obj, vertex, kind="POSITION"):
    """A handle at a vertex, and its empty."""
    bpy.ops.object.empty_add(location=obj.data.vertices[vertex].co)
    item = obj.shellwarp.handles.add()
    item.target, item.vertex, item.kind = bpy.context.object, vertex, kind
    bpy.context.view_layer.objects.active = obj
    return item.target


class Free(Case):
    def test_it_falls_as_a_stone_onto_a_floor_and_lies_there(self):
        """The centre falls by g t²/2, which damping of modes leaves alone: 1e-5 m of 5 cm are float32 and the areas of the strip's rim."""
        obj = add_free_strip()
        add_floor()
        play(1)
        self.assertRegex(run_of(obj).chosen(), "Polynomial shell|Reduced shell")  # the training tells which of these two
        for frame in (2, 3, 4):
            self.scene.frame_set(frame)
            self.assertAlmostEqual(float(shown(obj)[:, 2].mean()), -4.9 * ((frame - 1) / 30) ** 2, delta=1e-5)
        play(20, 5)
        self.assertEqual(part("live").trouble(obj), [])
        self.assertIn("touches at", run_of(obj).touching())
        self.assertGreater(shown(obj)[:, 2].min(), FLOOR - 1e-4)  # DEEP of the strip's 30 cm is 3e-4
        self.assertLess(shown(obj)[:, 2].max(), FLOOR + 1e-3)

    def test_its_bake_is_what_was_seen_live_and_plays_from_the_file(self):
        obj = add_free_strip()
        add_floor()
        live = {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            live[frame] = shown(obj)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertIn("nothing but contact holds", obj.shellwarp.verdict)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "strip.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "strip.blend"))
        obj = bpy.data.objects["Strip"]
        for frame in (1, 3, 10, 20):
            bpy.context.scene.frame_set(frame)
            self.assertLess(numpy.abs(shown(obj) - live[frame]).max(), 1e-6, frame)

    def test_one_empty_carries_it_by_place_and_turn(self):
        """A handle of position and orientation in the middle holds it; a certificate of 0.02 % was measured."""
        obj = add_free_strip()
        empty = lead(obj, 62, "BOTH")  # in the middle, as a head holds a hat's crown
        key(empty, "location", {1: tuple(empty.location), 10: (0.15, 0.02, 0.1), 20: (0.15, 0.02, 0.1)})
        play(20)
        self.assertEqual(part("live").trouble(obj), [])
        self.assertEqual(run_of(obj).unmet(), (0, 2))
        self.assertLess(numpy.linalg.norm(shown(obj)[62] - numpy.array((0.15, 0.02, 0.1))), 1e-5)
        estimate = run_of(obj).estimate().result()
        self.assertLess(estimate["error"], 0.05)

    def test_the_objects_own_motion_does_not_move_it(self):
        """Nothing ties it to the object. Blender's matrices and coordinates are of 32 bits."""
        obj = add_free_strip()
        obj.shellwarp.gravity = 0.0
        key(obj, "location", {1: (0, 0, 0), 10: (0.5, 0.2, 0)})
        play(1)
        start = shown(obj, world=True)
        play(10, 2)
        self.assertGreater(obj.location.x, 0.49)
        self.assertLess(numpy.abs(shown(obj, world=True) - start).max(), 1e-6)

    def test_handles_are_told_to_the_training_of_what_moves_freely_alone(self):
        obj = add_free_strip()
        lead(obj, 120)
        play(1)
        self.assertEqual(dict(run_of(obj).recipe.options)["handles"], (120,))
        first = run_of(obj)
        obj.shellwarp.handles[0].held = False  # let go: the same model
        play(1)
        self.assertIs(run_of(obj), first)
        lead(obj, 123)
        play(1)
        self.assertEqual(dict(run_of(obj).recipe.options)["handles"], (120, 123))
        for group, free in (("hinge", True), ("held", False)):
            obj.vertex_groups.get(group) or obj.vertex_groups.new(name=group).add([0, 1, 2, 3], 1.0, "REPLACE")
            obj.shellwarp.fixed_group = group
            play(1)
            self.assertEqual("handles" in dict(run_of(obj).recipe.options), free, group)

    def test_with_too_few_modes_the_panel_says_what_it_does_instead(self):
        obj = add_free_strip()
        obj.shellwarp.modes = 4
        play(1)
        self.assertIn("Automatic: Warp", run_of(obj).chosen())
        self.assertIn("modes", run_of(obj).chosen())
        obj.shellwarp.method = "reduced-shell"
        play(1)
        self.assertTrue(any("modes" in text for text in part("live").trouble(obj)), part("live").trouble(obj))

    def test_a_mesh_too_large_to_train_unasked_names_a_method_of_the_panel(self):
        """The library names a key of scene files, which the panel has not."""
        bpy.ops.wm.obj_import(filepath=str(ROOT / "tests/data/meshes/dinosaur.obj"))
        obj = bpy.context.selected_objects[0]
        bpy.context.view_layer.objects.active = obj
        obj.vertex_groups.new(name="feet").add([v.index for v in obj.data.vertices if (obj.matrix_world @ v.co).z < 2], 1.0, "REPLACE")
        obj.shellwarp.enabled, obj.shellwarp.fixed_group, obj.shellwarp.modes = True, "feet", 4
        play(1)
        self.assertIn("takes too long", run_of(obj).chosen())
        self.assertIn("choose Reduced shell to wait for it", run_of(obj).chosen())
        self.assertNotIn("reduced_poses", run_of(obj).chosen())


if __name__ == "__main__":
    unittest.main()
