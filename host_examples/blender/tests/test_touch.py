"""Claims about colliders that deform, contact patches and push-out, in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
from mathutils import Matrix, Vector
from scene import add_strip, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case, ball, collide, run_of

TOP = -0.02  # of the slab below the strip, at rest


def bent_slab(shape):
    """A slab below the strip; an armature turns the half beyond x = 0.15 up by 0.4 rad until frame 10."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=2, size=1, location=(0, 0, 0))
    obj = bpy.context.object
    for v in obj.data.vertices:
        v.co = (0.15 + 0.36 * v.co.x, 0.015 + 0.1 * v.co.y, TOP)
    obj.modifiers.new("Thick", "SOLIDIFY").thickness = 0.02
    obj.modifiers["Thick"].offset = -1
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones[0]
    bone.head, bone.tail = (0.15, 0.015, TOP), (0.35, 0.015, TOP)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.vertex_groups.new(name=rig.data.bones[0].name).add([v.index for v in obj.data.vertices if v.co.x > 0.16], 1.0, "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = rig
    pose = rig.pose.bones[0]
    pose.rotation_mode = "AXIS_ANGLE"
    axis = rig.data.bones[0].matrix_local.to_3x3().inverted() @ Vector((0, -1, 0))
    for frame, angle in ((1, 0.0), (10, 0.4), (20, 0.4)):
        pose.rotation_axis_angle = (angle, *axis)
        pose.keyframe_insert("rotation_axis_angle", frame=frame)
    bpy.context.view_layer.objects.active = bpy.data.objects["Strip"]
    return collide(obj, shape)


class Deforming(Case):
    def strip(self, shape="DEFORMING"):
        obj = add_strip()
        obj.shellwarp.modes = 12
        return obj, bent_slab(shape)

    def test_an_armature_bends_a_collider_and_the_strip_goes_along(self):
        """Its end is 0.15 beyond the joint, so that the slab's top rises there by 6 cm. A grid of the start frame leaves it down."""
        ends = {}
        for shape in ("DEFORMING", "MESH"):
            with self.subTest(shape):
                self.setUp()
                obj, _ = self.strip(shape)
                play(20)
                self.assertEqual(self.message(obj), "")
                self.assertGreater(run_of(obj).report()["contact_count"], 0)
                ends[shape] = shown(obj)[-1, 2]
        self.assertGreater(ends["DEFORMING"], TOP + 0.04)
        self.assertLess(ends["MESH"], TOP + 0.01)

    def test_by_its_mesh_is_what_deforms_it(self):
        """As for Blender's own Collision modifier, nobody has to choose."""
        obj, item = self.strip("AUTO")
        self.assertTrue(part("colliders").deforms(item))
        play(20)
        self.assertEqual(self.message(obj), "")
        self.assertTrue(run_of(obj).solids[0].faces)
        self.assertGreater(shown(obj)[-1, 2], TOP + 0.04)
        item.modifiers["Armature"].show_viewport = False
        play(1)
        self.assertFalse(run_of(obj).solids[0].faces)
        still = ball()
        still.shape_key_add(name="Basis")
        self.assertFalse(part("colliders").deforms(still))
        still.shape_key_add(name="Other").keyframe_insert("value", frame=1)
        self.assertTrue(part("colliders").deforms(still))

    def test_scrubbing_back_is_exact_and_a_bake_has_the_same(self):
        obj, _ = self.strip()
        found = {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            found[frame] = shown(obj)
        for frame in (6, 15, 3):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)
        obj.shellwarp.gravity = -1.0  # changed at frame 4, and back: it goes on from frame 3, restored
        self.scene.frame_set(4)
        obj.shellwarp.gravity = 1.0
        for frame in range(4, 9):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)
        self.scene.frame_set(5, subframe=0.5)
        self.assertEqual(self.message(obj), "")
        between = shown(obj)
        self.assertLess(numpy.abs(between - (found[5] + found[6]) / 2).max(), numpy.abs(found[6] - found[5]).max())
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.scene.frame_set(20)
        self.assertTrue(numpy.array_equal(shown(obj), found[20]))

    def test_a_shape_key_and_a_moving_scale_deform_as_well(self):
        """A ball 5 cm below the strip swells from a radius of 3 to 6 cm, and lifts it to its top."""
        for how in ("shape key", "scale"):
            with self.subTest(how):
                self.setUp()
                obj = add_strip()
                obj.shellwarp.gravity = 0.0
                item = collide(ball(0.03), "DEFORMING")
                item.location.z = -0.05
                if how == "scale":
                    for frame, size in ((1, 1.0), (10, 2.0)):
                        item.scale = (size,) * 3
                        item.keyframe_insert("scale", frame=frame)
                else:
                    item.shape_key_add(name="Basis")
                    swollen = item.shape_key_add(name="swollen")
                    for point in swollen.data:
                        point.co = 2 * point.co
                    for frame, value in ((1, 0.0), (10, 1.0)):
                        swollen.value = value
                        swollen.keyframe_insert("value", frame=frame)
                play(10)
                self.assertEqual(self.message(obj), "")
                self.assertGreater(shown(obj)[:, 2].max(), 0.01 - 1e-3)  # facets lie within the round ball
                self.assertLess(self.depth(obj), 1e-4)

    def test_faces_that_change_are_named(self):
        obj, item = self.strip()
        play(3)
        item.modifiers.new("Finer", "SUBSURF").levels = 1
        self.scene.frame_set(4)
        self.assertIn("collider “Grid”: its faces change", self.message(obj))


class Capsules(Case):
    def limb(self):
        """A tube of 40 cm along x below the strip, its halves on two bones; the rig is moved, turned and twice as large."""
        bpy.ops.mesh.primitive_cylinder_add(vertices=16, radius=0.02, depth=0.4, location=(0, 0, 0))
        body = bpy.context.object
        points = [(0.025 * i - 0.2, v.co.x, v.co.y) for i in range(17) for v in list(body.data.vertices)[::2]]
        body.data.clear_geometry()
        body.data.from_pydata(points, [], [(16 * k + i, 16 * k + (i + 1) % 16, 16 * k + 16 + (i + 1) % 16, 16 * k + 16 + i) for k in range(16) for i in range(16)])
        bpy.ops.object.armature_add()
        rig = bpy.context.object
        bpy.ops.object.mode_set(mode="EDIT")
        first = rig.data.edit_bones[0]
        first.name, first.head, first.tail = "upper", (-0.2, 0, 0), (0, 0, 0)
        second = rig.data.edit_bones.new("lower")
        second.head, second.tail, second.parent = (0, 0, 0), (0.2, 0, 0), first
        bpy.ops.object.mode_set(mode="OBJECT")
        body.vertex_groups.new(name="upper").add(range(0, 16 * 8), 1.0, "REPLACE")
        body.vertex_groups.new(name="lower").add(range(16 * 8, 16 * 17), 1.0, "REPLACE")
        body.modifiers.new("Armature", "ARMATURE").object = rig
        body.parent = rig
        rig.location, rig.scale = (0.1, 0.015, -0.1), (0.5, 0.5, 0.5)
        rig.rotation_euler.z = 0.2
        bpy.context.view_layer.update()
        bpy.context.view_layer.objects.active = body
        return body, rig

    def test_each_bone_has_one_that_holds_its_vertices_wherever_it_goes(self):
        body, rig = self.limb()
        body.shellwarp_collider.enabled, body.shellwarp_collider.friction = True, 0.4
        self.assertEqual(bpy.ops.shellwarp.fit_capsules(), {"FINISHED"})
        self.assertFalse(body.shellwarp_collider.enabled)
        made = {item.parent_bone: item for item in bpy.data.collections["Cylinder capsules"].objects}
        self.assertEqual(set(made), {"upper", "lower"})
        self.assertEqual({(item.shellwarp_collider.shape, round(item.shellwarp_collider.friction, 6)) for item in made.values()}, {("CAPSULE", 0.4)})
        rig.pose.bones["lower"].rotation_mode = "XYZ"
        for bend in (0.0, 0.7):
            rig.pose.bones["lower"].rotation_euler = (bend, 0.3 * bend, 0)
            bpy.context.view_layer.update()
            points = shown(body, world=True)
            for name, chosen in (("upper", points[:128]), ("lower", points[128:])):
                item = made[name]
                to_item = numpy.array(item.matrix_world.inverted())
                local = chosen @ to_item[:3, :3].T + to_item[:3, 3]
                sides = numpy.ptp([v.co for v in item.data.vertices], axis=0) / 2
                radius, half = sides[0], sides[2] - sides[0]
                local[:, 2] -= numpy.clip(local[:, 2], -half, half)
                distance = numpy.linalg.norm(local, axis=1)
                self.assertLess(distance.max(), radius * (1 + 1e-4), (name, bend))
                self.assertGreater(distance.max(), radius * 0.99)
                self.assertLess(radius, 1.2 * 0.02)

    def test_a_shell_touches_them(self):
        obj = add_strip()
        _, rig = self.limb()
        self.assertEqual(bpy.ops.shellwarp.fit_capsules(), {"FINISHED"})
        obj.shellwarp.gravity = 0.0
        for frame, z in ((1, -0.1), (12, 0.0)):
            rig.location.z = z
            rig.keyframe_insert("location", frame=frame)
        bpy.context.view_layer.objects.active = obj
        play(12)
        self.assertEqual(self.message(obj), "")
        self.assertEqual(len(run_of(obj).solids), 2)
        self.assertGreater(run_of(obj).report()["contact_count"], 0)
        self.assertGreater(shown(obj)[:, 2].max(), 0.005)

    def test_without_an_armature_it_is_said(self):
        ball()
        with self.assertRaisesRegex(RuntimeError, "no Armature modifier"):
            bpy.ops.shellwarp.fit_capsules()


class Beyond(Case):
    """Three balls bend a strip of two modes into a wave, which these have not: two from below, the middle one from above."""

    def strip(self):
        obj = add_strip()
        obj.shellwarp.modes, obj.shellwarp.gravity = 2, 0.0
        for x, side in ((0.1, -1), (0.18, 1), (0.26, -1)):
            item = collide(ball(0.02, (x, 0.015, side * 0.03)), "SPHERE")
            for frame, z in ((1, side * 0.03), (10, side * 0.012)):
                item.location.z = z
                item.keyframe_insert("location", frame=frame)
        bpy.context.view_layer.objects.active = obj
        return obj

    def depths(self, obj):
        """How deep vertices that are shown lie in the balls, of those held not."""
        points = shown(obj, world=True)[8:]
        return max(0.02 - numpy.linalg.norm(points - numpy.array(item.location), axis=1).min()
                   for item in bpy.data.objects if item.name.startswith("Sphere"))

    def test_contact_patches_let_few_modes_follow(self):
        obj = self.strip()
        play(10)
        without = self.depth(obj)
        self.assertGreater(without, 1e-3)
        self.assertIn("contact patches", run_of(obj).touching())
        obj.vertex_groups.new(name="touched").add([4 * i + j for i in (10, 18, 26) for j in (1, 2)], 1.0, "REPLACE")
        obj.shellwarp.contact_patches = "touched"
        self.scene.frame_set(11)
        self.assertIn("the group “touched” (contact patches) is another", self.message(obj))
        play(10)
        self.assertEqual(self.message(obj), "")
        self.assertEqual(run_of(obj).model.info()["modes"], 8)
        self.assertLess(self.depth(obj), 0.1 * without)

    def test_patches_are_found_near_the_colliders(self):
        """The balls begin 1 cm off the strip, and two vertices of each are within 11.5 mm: they do as well as when they are named by hand."""
        obj = self.strip()
        play(10)
        without = self.depth(obj)
        self.scene.frame_set(1)
        with self.assertRaisesRegex(RuntimeError, "no vertex that moves is within 0.005 of a collider"):
            bpy.ops.shellwarp.find_patches(distance=0.005)
        self.assertEqual(bpy.ops.shellwarp.find_patches(distance=0.0115, most=6), {"FINISHED"})
        self.assertEqual(obj.shellwarp.contact_patches, "contact patches")
        vertices = part("meshes").group_vertices(obj, "contact patches")
        self.assertEqual(len(vertices), 6)
        points = shown(obj, world=True)[vertices]
        gaps = numpy.array([numpy.linalg.norm(points - numpy.array(item.location), axis=1) - 0.02 for item in bpy.data.objects if item.name.startswith("Sphere")])
        self.assertLess(gaps.min(axis=0).max(), 0.0115 + 1e-6)   # each is near a ball
        self.assertLess(gaps.min(axis=1).max(), 0.0115 + 1e-6)   # each ball has one
        play(10)
        self.assertEqual(self.message(obj), "")
        self.assertEqual(run_of(obj).model.info()["modes"], 8)
        self.assertLess(self.depth(obj), 0.1 * without)
        for item in list(bpy.data.objects):
            if item.name.startswith("Sphere"):
                bpy.data.objects.remove(item)
        with self.assertRaisesRegex(RuntimeError, "no colliders"):
            bpy.ops.shellwarp.find_patches()

    def test_patches_of_a_shell_that_was_moved_and_turned_are_the_same(self):
        obj = self.strip()
        self.scene.frame_set(1)
        bpy.ops.shellwarp.find_patches(distance=0.0115, most=6)
        before = part("meshes").group_vertices(obj, "contact patches")
        turn = Matrix.Translation((0.3, -0.2, 0.5)) @ Matrix.Rotation(0.7, 4, Vector((1, 2, 3)).normalized()) @ Matrix.Scale(2, 4)
        for item in (obj, *(item for item in bpy.data.objects if item.name.startswith("Sphere"))):
            item.animation_data_clear()
            item.matrix_world = turn @ item.matrix_world
        bpy.context.view_layer.update()
        self.assertEqual(bpy.ops.shellwarp.find_patches(distance=0.023, most=6), {"FINISHED"})
        self.assertEqual(part("meshes").group_vertices(obj, "contact patches"), before)

    def test_push_out_shows_it_outside_and_the_motion_does_not_know(self):
        obj = self.strip()
        play(10)
        inside, kept = self.depths(obj), run_of(obj).known[10].saved
        self.assertGreater(inside, 1e-3)
        obj.shellwarp.push_out = True
        play(10)
        self.assertEqual(self.message(obj), "")
        self.assertLess(self.depths(obj), 1e-5)
        self.assertEqual(run_of(obj).known[10].saved, kept)
        self.assertIn("shown pushed out", run_of(obj).touching())
        live = shown(obj)
        obj.shellwarp.frame_end, obj.shellwarp.cache = 10, str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.scene.frame_set(10)
        self.assertTrue(numpy.array_equal(shown(obj), live))

    def test_push_out_and_correction_are_not_taken_together(self):
        obj = self.strip()
        obj.shellwarp.push_out, obj.shellwarp.correction_steps = True, 1
        play(2)
        self.assertIn("choose one", self.message(obj))
        obj.shellwarp.correction_steps = 0
        bpy.ops.mesh.primitive_grid_add(size=0.02, location=(0.2, 0.015, 0))
        obj.shellwarp.renders.add().target = bpy.context.object
        play(2)
        self.assertEqual(self.message(obj), "")


if __name__ == "__main__":
    unittest.main()
