"""Claims about pins that follow shape keys and modifiers, in Blender itself; run by ctest as `blender`."""

import math
import os
import sys
import tempfile
import types
import unittest
from contextlib import contextmanager

import bpy
import numpy
import scene as scenes
import shellwarp as sw
from scene import N, add_strip, key, play, shown
from test_addon import Case, part
from test_addon import setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Layout


HELD = [*range(8), *range(N - 8, N)]  # both ends
FAR = list(range(N - 8, N))


@contextmanager
def overheard():
    """What Blender itself writes on standard error meanwhile: a list, of one text in the end."""
    heard = []
    with tempfile.TemporaryFile() as file:
        sys.stderr.flush()
        before = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield heard
        finally:
            os.dup2(before, 2)
            os.close(before)
            file.seek(0)
            heard.append(file.read().decode(errors="replace"))


def held_at_both_ends(name="Strip"):
    obj = add_strip(name)
    obj.vertex_groups["held"].add(FAR, 1.0, "REPLACE")
    return obj


def add_bones(*shells):
    """An armature of two bones, at the near end and the far one; the latter turns and moves. Skins shells to it."""
    data = bpy.data.armatures.new("bones")
    rig = bpy.data.objects.new("rig", data)
    bpy.context.scene.collection.objects.link(rig)
    before = bpy.context.view_layer.objects.active
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, x in (("near", 0.0), ("far", 0.3)):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = (x, 0.015, 0), (x, 0.015, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = before
    bone = rig.pose.bones["far"]
    bone.rotation_mode = "XYZ"
    key(bone, "rotation_euler", {1: (0, 0, 0), 12: (0.4, 0.0, 0.3), 20: (0, 0, 0)})
    key(bone, "location", {1: (0, 0, 0), 12: (-0.02, 0.02, 0)})
    for obj in shells:
        for i, v in enumerate(obj.data.vertices):
            for name, weight in (("near", 1 - v.co.x / 0.3), ("far", v.co.x / 0.3)):
                (obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)).add([i], min(1, max(0, weight)), "REPLACE")
        obj.modifiers.new("Armature", "ARMATURE").object = rig
    return rig


def twin(obj):
    """The same object, not a shell: what is below, without the add-on."""
    other = bpy.data.objects.new("twin", obj.data.copy())
    bpy.context.scene.collection.objects.link(other)
    for group in obj.vertex_groups:
        other.vertex_groups.new(name=group.name)
    for item in obj.modifiers:
        made = other.modifiers.new(item.name, item.type)
        for name in ("object", "vertex_group", "matrix_inverse"):
            if hasattr(item, name):
                setattr(made, name, getattr(item, name))
    other.matrix_world = obj.matrix_world
    return other


def led(obj, below, frames, method="warp", **options):
    """The strip run by the package alone, its supports where `below` has them in the world; world positions by frame."""
    s = obj.shellwarp
    rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
    held = part("inputs").group_vertices(obj, "held")
    model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=held))
    model.precompute(modes=s.modes, **options)
    state = model.state(method)
    state.set_gravity(bpy.context.scene.gravity)
    state.set_damping(ratio=s.damping_ratio)
    out = {}
    for frame in range(1, frames + 1):
        state.move_supports(below[frame], teleport=frame == 1)
        if frame > 1:
            state.step(1 / 30)
        out[frame] = state.positions()
    return out


def seen(obj, frames):
    """World positions of an object by frame."""
    found = {}
    for frame in range(1, frames + 1):
        bpy.context.scene.frame_set(frame)
        found[frame] = shown(obj, world=True)
    return found


class Below(Case):
    """What is below leads the pins."""

    def follows(self, obj, frames=20, method="warp", **options):
        below = seen(twin(obj), frames)
        found = seen(obj, frames)
        self.assertEqual(self.message(obj), "")
        expected = led(obj, below, frames, method, **(options or {"support_fields": 24}))
        for frame in range(1, frames + 1):
            # what is read of Blender is float32 of coordinates up to 0.5, through matrices of float32
            self.assertLess(numpy.abs(found[frame] - expected[frame]).max(), 2e-6, f"frame {frame}")
            self.assertLess(numpy.abs(found[frame] - below[frame])[HELD].max(), 2e-7, f"pins at frame {frame}")
        return found, below

    def test_pins_go_where_an_armature_has_them_and_the_rest_swings(self):
        obj = held_at_both_ends()
        add_bones(obj)
        found, below = self.follows(obj)
        self.assertGreater(numpy.abs(below[12] - below[1])[FAR].max(), 0.02)
        self.assertGreater(numpy.abs(found[12] - below[12]).max(), 0.003)
        self.assertIsNone(obj.data.shape_keys)

    def test_an_object_that_moves_and_is_scaled_itself_is_led_all_the_same(self):
        obj = held_at_both_ends()
        rig = add_bones(obj)
        rig.location = obj.location = (0.1, 0.2, 0.3)
        obj.rotation_euler = rig.rotation_euler = (0.2, 0.1, 0.4)
        key(obj, "location", {1: (0.1, 0.2, 0.3), 10: (0.12, 0.2, 0.3)})
        key(rig, "location", {1: (0.1, 0.2, 0.3), 10: (0.12, 0.2, 0.3)})
        other = twin(obj)
        for item in (obj, other):
            item.parent = rig
            item.location = item.rotation_euler = (0, 0, 0)
            item.animation_data_clear()
        below, found = seen(other, 12), seen(obj, 12)
        self.assertEqual(self.message(obj), "")
        expected = led(obj, below, 12, support_fields=24)
        # float32 of coordinates up to 0.5, through matrices of float32, twice
        self.assertLess(max(numpy.abs(found[f] - expected[f]).max() for f in found), 2e-6)

    def test_pins_follow_hooks(self):
        obj = held_at_both_ends()
        empty = bpy.data.objects.new("hook", None)
        self.scene.collection.objects.link(empty)
        hook = obj.modifiers.new("Hook", "HOOK")
        hook.object, hook.strength = empty, 1.0
        hook.vertex_indices_set(FAR)
        other = twin(obj)
        other.modifiers["Hook"].vertex_indices_set(FAR)
        key(empty, "location", {1: (0, 0, 0), 10: (-0.01, 0.03, 0.02)})
        below, found = seen(other, 15), seen(obj, 15)
        self.assertEqual(self.message(obj), "")
        self.assertGreater(numpy.abs(below[15] - below[1])[FAR].max(), 0.029)
        expected = led(obj, below, 15, support_fields=24)
        self.assertLess(max(numpy.abs(found[f] - expected[f]).max() for f in found), 2e-6)

    def test_pins_follow_shape_keys(self):
        obj = held_at_both_ends()
        obj.shape_key_add(name="Basis")
        turned = obj.shape_key_add(name="turned")
        for v in FAR:
            x, y, z = obj.data.vertices[v].co
            turned.data[v].co = (x - 0.01, 0.015 + (y - 0.015) * math.cos(0.5), z + (y - 0.015) * math.sin(0.5))
        key(turned, "value", {1: 0.0, 10: 1.0})
        other = twin(obj)
        below, found = seen(other, 15), seen(obj, 15)
        self.assertEqual(self.message(obj), "")
        expected = led(obj, below, 15, support_fields=24)
        self.assertLess(max(numpy.abs(found[f] - expected[f]).max() for f in found), 2e-6)
        self.assertLess(numpy.abs(found[15] - below[15])[FAR].max(), 2e-7)
        self.assertEqual(len(obj.data.shape_keys.key_blocks), 2)

    def test_the_full_shell_follows_exactly_and_begins_at_rest_where_the_pins_are(self):
        obj = held_at_both_ends()
        obj.shellwarp.method = "shell-implicit"
        add_bones(obj)
        self.scene.gravity = (0, 0, 0)
        self.follows(obj, 6, "shell-implicit", support_fields=0)
        obj.shellwarp.frame_start = 12
        self.scene.frame_set(12)
        self.assertEqual(self.message(obj), "")
        at_start = shown(obj)
        self.scene.frame_set(13)
        moved = numpy.abs(shown(obj) - at_start).max()
        led_by = numpy.abs(numpy.subtract(*(seen_at(twin(obj), f) for f in (13, 12)))).max()
        # it does not spring: it moves by what leads it
        self.assertLess(moved, 3 * led_by)

    def test_the_full_shell_looks_for_rest_only_where_the_pins_are_bent_and_says_where_there_is_none(self):
        obj = held_at_both_ends()
        obj.shellwarp.method = "shell-implicit"
        add_bones(obj)
        state = part("library").package().state.State

        def none(_self):
            raise ValueError("no equilibrium")
        self.addCleanup(setattr, state, "equilibrium", state.equilibrium)
        state.equilibrium = none
        play(2)
        self.assertEqual(self.message(obj), "")
        obj.shellwarp.frame_start = 12
        self.scene.frame_set(12)
        self.assertIn("begin in a pose nearer to the rest shape (no equilibrium)", self.message(obj))

    def test_methods_that_cannot_follow_say_so_and_follow_what_moves_as_one(self):
        obj = held_at_both_ends()
        obj.shellwarp.method = "rotation-strain"
        rig = add_bones(obj)
        play(5)
        self.assertRegex(self.message(obj), "^frame 2: support .* off the rigid motion of all supports")
        rig.animation_data_clear()
        for bone in rig.pose.bones:
            bone.rotation_euler = (0, 0, 0)
            key(bone, "location", {1: (0, 0, 0), 10: (0.1, 0, 0)})
        play(8)
        self.assertEqual(self.message(obj), "")
        self.assertGreater(shown(obj)[0, 0], 0.05)


def seen_at(obj, frame):
    bpy.context.scene.frame_set(frame)
    return shown(obj)


class Stack(Case):
    """The shell's place among modifiers."""

    def test_modifiers_after_come_after_and_those_that_add_vertices_change_nothing(self):
        obj = held_at_both_ends()
        add_bones(obj)
        plain = seen(obj, 10)
        obj.modifiers.new("Solidify", "SOLIDIFY")
        obj.modifiers.new("Subdivision", "SUBSURF").subdivision_type = "SIMPLE"
        found = seen(obj, 10)
        self.assertEqual(self.message(obj), "")
        self.assertEqual([item.name for item in obj.modifiers], ["Armature", "shellwarp live", "Solidify", "Subdivision"])
        self.assertGreater(len(found[10]), 2 * N)
        # Solidify goes there and back at float32 of coordinates up to 0.3
        self.assertLess(numpy.abs(found[10][:N] - plain[10]).max(), 1e-7)

    def test_a_modifier_after_that_renumbers_vertices_is_told_until_it_is_off(self):
        obj = held_at_both_ends()
        add_bones(obj)
        mask = obj.modifiers.new("Mask", "MASK")
        mask.vertex_group, mask.invert_vertex_group = "held", True
        play(2)
        self.assertIn("order of the vertices", self.message(obj))
        mask.show_viewport = False
        play(2)
        self.assertEqual(self.message(obj), "")

    def test_switched_off_the_object_leads_and_the_armature_comes_after(self):
        obj, free = held_at_both_ends(), held_at_both_ends("Free")
        add_bones(obj)
        obj.shellwarp.follow = False
        play(10)
        self.assertEqual(self.message(obj), "")
        self.assertIsNone(obj.modifiers.get("shellwarp live"))
        own, other = (item.data.shape_keys.key_blocks["shellwarp"].data for item in (obj, free))
        self.same(*(numpy.array([point.co for point in points]) for points in (own, other)))
        obj.shellwarp.follow = True
        self.scene.frame_set(11)
        self.assertIn("shape keys and modifiers lead the pins now: go to the start frame", self.message(obj))
        play(3)
        self.assertEqual(self.message(obj), "")
        self.assertIsNone(obj.data.shape_keys)
        obj.shellwarp.follow = False
        self.scene.frame_set(4)
        self.assertIn("do not lead the pins any more", self.message(obj))
        play(1)
        self.assertIsNone(obj.modifiers.get("shellwarp live"))
        self.assertEqual([item.name for item in bpy.data.objects if item.name.startswith("shellwarp")], [])

    def test_an_armature_that_comes_too_late_is_named(self):
        obj = held_at_both_ends()
        obj.modifiers.new("Subdivision", "SUBSURF")
        add_bones(obj)
        self.assertEqual(part("stack").out_of_reach(obj), obj.modifiers["Armature"])
        self.assertFalse(part("stack").leads(obj))
        obj.modifiers.move(1, 0)
        self.assertIsNone(part("stack").out_of_reach(obj))
        self.assertEqual(part("stack").named(obj), "Armature")

    def test_before_the_start_it_is_where_what_is_below_has_it(self):
        obj = held_at_both_ends()
        add_bones(obj)
        other = twin(obj)
        obj.shellwarp.frame_start = 5
        play(8, first=5)
        for frame in (2, 4):
            self.scene.frame_set(frame)
            self.same(shown(obj), shown(other))

    def test_going_back_restores_and_a_part_of_a_frame_lies_between(self):
        obj = held_at_both_ends()
        add_bones(obj)
        expected = seen(obj, 14)
        for frame in (5, 12, 1, 14):
            self.scene.frame_set(frame)
            self.same(shown(obj, world=True), expected[frame])
        self.scene.frame_set(8, subframe=0.5)
        self.assertEqual(self.message(obj), "")
        middle = shown(obj, world=True)
        # half of a motion of millimetres: nearer to the middle than either end
        apart = numpy.abs(expected[9] - expected[8]).max()
        self.assertLess(numpy.abs(middle - (expected[8] + expected[9]) / 2).max(), apart / 4)
        self.scene.frame_set(9)
        self.same(shown(obj, world=True), expected[9])

    def test_a_copied_object_has_a_shape_of_its_own(self):
        obj = held_at_both_ends()
        add_bones(obj)
        play(5)
        bpy.ops.object.select_all(action="DESELECT")
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.duplicate()
        other = bpy.context.object
        other.shellwarp.damping_ratio = 0.9
        expected = seen(obj, 8)
        self.assertEqual((self.message(obj), self.message(other)), ("", ""))
        self.same(shown(obj, world=True), expected[8])
        self.scene.frame_set(2)  # both begin to fall, the other against more damping
        self.assertGreater(numpy.abs(shown(obj, world=True) - shown(other, world=True)).max(), 1e-4)

    def undo_and_redo(self, i):
        bpy.data.objects["Strip"].shellwarp.damping_ratio = 0.1 + 0.01 * (i + 1)
        bpy.ops.ed.undo_push(message="damping")
        play(3)
        if i % 3 == 0:  # the stack goes and comes back as well
            bpy.data.objects["Strip"].shellwarp.follow = False
            bpy.ops.ed.undo_push(message="off")
            play(2)
            bpy.ops.ed.undo()
        bpy.ops.ed.undo()
        if i % 2:
            bpy.ops.ed.redo()
            bpy.ops.ed.undo()

    def test_undo_and_redo_many_times_leave_a_shell_that_moves(self):
        obj = held_at_both_ends()
        add_bones(obj)
        bpy.ops.ed.undo_push(message="strip")
        expected = seen(obj, 6)
        with overheard() as heard:
            for i in range(12):
                self.undo_and_redo(i)
            os.write(2, b"heard to the end")
        # An object whose users Blender counts wrong is told of there: "ID user decrement error".
        self.assertEqual(heard, ["heard to the end"])
        obj = bpy.data.objects["Strip"]
        self.assertAlmostEqual(obj.shellwarp.damping_ratio, 0.1, places=6)
        self.same(seen(obj, 6)[6], expected[6])
        self.assertEqual(self.message(obj), "")
        helpers = [item for item in bpy.data.objects if item.name.startswith("shellwarp")]
        self.assertEqual([item.users for item in helpers], [1])

    def test_a_saved_file_goes_on_after_loading(self):
        obj = held_at_both_ends()
        add_bones(obj)
        expected = seen(obj, 8)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "strip.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "strip.blend"))
        obj = bpy.data.objects["Strip"]
        self.same(shown(obj, world=True), expected[8])
        play(8)
        self.same(shown(obj, world=True), expected[8])

    def test_a_render_mesh_follows_a_shell_that_an_armature_leads(self):
        obj, drawn = held_at_both_ends(), bpy.data.objects.new("drawn", scenes.strip_mesh())
        self.scene.collection.objects.link(drawn)
        add_bones(obj)
        obj.shellwarp.renders.add().target = drawn
        play(10)
        self.assertEqual(self.message(obj), "")
        # the same vertices, bound to themselves: a foot point is good to float32
        self.assertLess(numpy.abs(shown(drawn, world=True) - shown(obj, world=True)).max(), 1e-6)


class Panel(Case):
    def drawn(self, name, obj):
        layout = Layout()
        getattr(part("panel"), name).draw(types.SimpleNamespace(layout=layout), types.SimpleNamespace(object=obj, scene=self.scene, view_layer=bpy.context.view_layer))
        return layout

    def test_the_panel_names_what_leads_the_pins(self):
        obj = held_at_both_ends()
        self.assertNotIn("support_fields", self.drawn("SHELLWARP_PT_shell", obj).shown)
        obj.modifiers.new("Subdivision", "SUBSURF")
        add_bones(obj)
        self.assertIn("They cannot follow “Armature”: it comes after a modifier that changes the vertices",
                      self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.modifiers.move(1, 0)
        layout = self.drawn("SHELLWARP_PT_shell", obj)
        self.assertIn("They follow Armature", layout.labels)
        self.assertIn("support_fields", layout.shown)
        obj.shellwarp.method = "reduced-shell"
        self.assertNotIn("support_fields", self.drawn("SHELLWARP_PT_shell", obj).shown)


class Baked(Case):
    def baked(self):
        obj = held_at_both_ends()
        add_bones(obj)
        obj.modifiers.new("Solidify", "SOLIDIFY")
        live = seen(obj, 20)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        bpy.ops.shellwarp.bake()
        return obj, live

    def test_the_cache_plays_what_was_live_after_what_is_below(self):
        obj, live = self.baked()
        self.assertEqual([item.name for item in obj.modifiers], ["Armature", "shellwarp cache", "Solidify"])
        self.assertEqual([item.name for item in bpy.data.objects if item.name.startswith("shellwarp")], [])
        for frame in (20, 1, 12):
            self.scene.frame_set(frame)
            self.same(shown(obj, world=True), live[frame])

    def picture(self, name):
        self.scene.render.filepath = str(self.folder / name)
        bpy.ops.render.render(write_still=True)
        return numpy.array(bpy.data.images.load(str(self.folder / (name + ".png"))).pixels[:])

    def test_a_render_sees_live_and_baked_alike(self):
        obj, live = self.baked()
        bpy.ops.shellwarp.free_bake()
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location, camera.rotation_euler = (0.15, -0.7, 0.0), (1.57, 0, 0)
        for item in (camera, bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))):
            self.scene.collection.objects.link(item)
        self.scene.camera, render = camera, self.scene.render
        render.engine, render.resolution_x, render.resolution_y = "CYCLES", 64, 64
        self.scene.cycles.samples, self.scene.cycles.seed, self.scene.cycles.device = 4, 1, "CPU"
        self.scene.frame_set(1)
        still = self.picture("still")
        play(12)
        moved = self.picture("live")
        self.assertGreater(numpy.abs(moved - still).max(), 0.02)
        bpy.ops.render.render(animation=False, write_still=False)
        self.assertEqual(self.message(obj), "")
        self.same(shown(obj, world=True), live[12])
        bpy.ops.shellwarp.bake()
        self.scene.frame_set(12)
        self.same(self.picture("baked"), moved)

    def test_baked_again_and_freed_it_is_the_same(self):
        obj, live = self.baked()
        first = (self.folder / "strip.pc2").read_bytes()
        bpy.ops.shellwarp.bake()
        self.assertEqual((self.folder / "strip.pc2").read_bytes(), first)
        bpy.ops.shellwarp.free_bake()
        play(20)
        self.assertEqual(self.message(obj), "")
        self.same(shown(obj, world=True), live[20])


if __name__ == "__main__":
    unittest.main()
