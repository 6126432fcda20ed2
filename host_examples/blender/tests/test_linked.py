"""Claims about shells of linked files, in Blender itself; run by ctest as `blender`."""

import hashlib
import unittest

import bpy
import numpy
import scene as scenes
from scene import add_strip, play, shown
from test_addon import Case, alone, part
from test_addon import setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_follow import add_bones, held_at_both_ends, seen


class Linked(Case):
    def link(self, make, override=True):
        """A file with what `make` makes, linked into a new one; the shell of this one."""
        made = make()
        asset = bpy.data.collections.new("asset")
        self.scene.collection.children.link(asset)
        for item in list(self.scene.collection.objects):
            asset.objects.link(item)
            self.scene.collection.objects.unlink(item)
        library = self.folder / "asset.blend"
        name = made.name
        bpy.ops.wm.save_as_mainfile(filepath=str(library))
        self.scene = scenes.empty_file()
        with bpy.data.libraries.load(str(library), link=True) as (_, data):
            data.collections = ["asset"]
        if override:
            data.collections[0].override_hierarchy_create(self.scene, bpy.context.view_layer)
        else:
            self.scene.collection.children.link(data.collections[0])
        obj = next(item for item in self.scene.objects if item.name == name)
        bpy.context.view_layer.objects.active = obj
        self.library, self.digest = library, hashlib.blake2b(library.read_bytes()).digest()
        self.points = part("inputs").rest_positions(obj.data)
        return obj

    def untouched(self, obj):
        self.assertEqual(hashlib.blake2b(self.library.read_bytes()).digest(), self.digest)
        self.same(part("inputs").rest_positions(obj.data), self.points)
        self.assertIsNotNone(obj.data.library)
        self.assertIsNone(obj.data.shape_keys)

    def test_an_override_moves_by_its_own_settings_and_the_library_is_not_written_to(self):
        obj = self.link(add_strip)
        obj.shellwarp.damping_ratio = 0.4
        play(12)
        self.assertEqual(self.message(obj), "")
        self.same(shown(obj), alone(obj, 12)[12])
        self.untouched(obj)
        self.scene.frame_set(4)
        self.same(shown(obj), alone(obj, 4)[4])

    def test_it_bakes_and_a_saved_shot_plays_the_cache(self):
        obj = self.link(add_strip)
        obj.shellwarp.damping_ratio, obj.shellwarp.cache = 0.4, str(self.folder / "shot.pc2")
        expected = alone(obj, 20)
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.untouched(obj)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "shot.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "shot.blend"))
        scene = bpy.context.scene
        obj = next(item for item in scene.objects if item.type == "MESH")
        self.assertIsNotNone(obj.override_library)
        self.assertFalse(obj.shellwarp.live)
        self.assertAlmostEqual(obj.shellwarp.damping_ratio, 0.4, places=6)
        for frame in (1, 20, 8):
            scene.frame_set(frame)
            self.same(shown(obj), expected[frame])
        self.untouched(obj)

    def test_an_override_on_an_armature_follows_it_and_bakes(self):
        def rigged():
            obj = held_at_both_ends()
            add_bones(obj)
            return obj
        before = rigged()
        expected = seen(before, 12)
        self.scene = scenes.empty_file()
        obj = self.link(rigged)
        found = seen(obj, 12)
        self.assertEqual(self.message(obj), "")
        self.same(found[12], expected[12])
        self.assertEqual([item.name for item in obj.modifiers], ["Armature", "shellwarp live"])
        obj.shellwarp.cache = str(self.folder / "shot.pc2")
        bpy.ops.shellwarp.bake()
        self.scene.frame_set(12)
        self.same(shown(obj, world=True), expected[12])
        self.untouched(obj)

    def test_two_overrides_of_one_mesh_move_apart(self):
        first = self.link(add_strip)
        second = first.copy()
        self.scene.collection.objects.link(second)
        self.assertEqual(first.data, second.data)
        second.shellwarp.damping_ratio = 0.9
        play(10)
        self.assertEqual((self.message(first), self.message(second)), ("", ""))
        self.same(shown(first), alone(first, 10)[10])
        self.same(shown(second), alone(second, 10)[10])

    def test_a_linked_object_without_an_override_is_told(self):
        obj = self.link(add_strip, override=False)
        play(2)
        self.assertIn("make a library override", self.message(obj))

    def test_a_linked_mesh_that_follows_is_led_and_baked_too(self):
        def pair():
            proxy, drawn = add_strip(), bpy.data.objects.new("drawn", scenes.strip_mesh())
            self.scene.collection.objects.link(drawn)
            proxy.shellwarp.renders.add().target = drawn
            return proxy
        obj = self.link(pair)
        drawn = next(item for item in self.scene.objects if item.name == "drawn")
        play(10)
        self.assertEqual(self.message(obj), "")
        # the same vertices, bound to themselves: a foot point is good to float32
        self.assertLess(numpy.abs(shown(drawn) - shown(obj)).max(), 1e-6)
        live = shown(drawn)
        obj.shellwarp.cache = str(self.folder / "shot.pc2")
        bpy.ops.shellwarp.bake()
        self.assertEqual([item.name for item in drawn.modifiers], ["shellwarp cache"])
        self.scene.frame_set(10)
        self.same(shown(drawn), live)
        self.untouched(obj)


if __name__ == "__main__":
    unittest.main()
