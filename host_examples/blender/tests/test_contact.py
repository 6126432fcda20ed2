"""Claims about colliders, materials and what lasts in the add-on, in Blender itself; run by ctest as `blender`."""

import tempfile
import types
import unittest
from pathlib import Path

import bmesh
import bpy
import numpy
import scene as scenes
import shellwarp as sw
import test_addon
from mathutils import Matrix
from scene import add_strip, key, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them

BELOW = 0.03  # how far below the strip the colliders of these tests begin


def collide(obj, shape="AUTO", friction=0.0):
    """Gives an object the role."""
    role = obj.shellwarp_collider
    role.enabled, role.shape, role.friction = True, shape, friction
    return obj


def ball(radius=0.05, location=(0.2, 0.015, -0.08), scale=(1, 1, 1)):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=radius, location=location)
    obj = bpy.context.object
    obj.scale = scale
    return obj


def run_of(obj):
    return part("live").simulation(obj)


class Case(unittest.TestCase):
    def setUp(self):
        self.scene = scenes.empty_file()
        self.folder = Path(tempfile.mkdtemp(dir=test_addon.FOLDER.name))

    def message(self, obj):
        return part("live").message(obj)

    def depth(self, obj):
        return run_of(obj).report()["deepest_penetration"]


class Shapes(Case):
    def test_a_ball_is_the_librarys_sphere_to_the_bit(self):
        obj = add_strip()
        collide(ball(), "SPHERE", 0.25)
        play(1)
        made = run_of(obj).solids[0]
        s = obj.shellwarp
        rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
        model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
        model.precompute(modes=s.modes, reduced_fields=0)
        state = model.state("warp")
        state.set_gravity(self.scene.gravity)
        state.set_damping(s.damping_ratio)
        sphere = bpy.data.objects["Sphere"]
        corners = numpy.array([v.co for v in sphere.data.vertices], float)
        # The mesh's own radius, in float32: a search among contacts that ends one iteration earlier is off by 1e-5 m.
        state.set_colliders([sw.Collider.sphere(float((corners.max(axis=0) - corners.min(axis=0)).max() / 2), friction=0.25)])
        state.move_collider(0, numpy.array(sphere.matrix_world.translation, float) + made.middle, teleport=True)
        for frame in range(2, 21):
            self.scene.frame_set(frame)
            state.step(1 / 30)
            self.assertLess(numpy.abs(shown(obj) - state.positions(space="frame")).max(), 1e-6, frame)
        self.assertGreater(state.report()["contact_count"], 0)
        # The mesh's vertices are float32, so that its half side is.
        self.assertLess(numpy.abs(made.middle).max(), 1e-7)

    def test_every_shape_holds_the_strip_up(self):
        """Without the collider the strip's end falls 7 cm and more; with it, no vertex goes below the top."""
        free = add_strip()
        play(20)
        self.assertLess(shown(free)[:, 2].min(), -0.07)
        bpy.data.objects.remove(free)
        for shape, scale in (("PLANE", (1, 1, 1)), ("BOX", (8, 4, 1)), ("HULL", (8, 4, 1)), ("MESH", (8, 4, 1)), ("MESH", (-8, 4, 1)),
                             ("SPHERE", (1, 1, 1)), ("CAPSULE", (1, 1, 3))):
            with self.subTest(shape=shape, scale=scale):
                self.scene = scenes.empty_file()
                obj = add_strip()
                bpy.ops.mesh.primitive_cube_add(size=0.05, location=(0.15, 0.015, -BELOW - 0.025))
                item = collide(bpy.context.object, shape)
                item.scale = scale
                if shape == "PLANE":
                    item.location.z = -BELOW - 0.0
                    item.data.transform(Matrix.Diagonal((1, 1, 0, 1)))
                if shape == "CAPSULE":
                    item.rotation_euler.x = 1.5707963
                play(20)
                self.assertEqual(self.message(obj), "")
                self.assertGreater(run_of(obj).report()["contact_count"], 0)
                self.assertLess(self.depth(obj), 1e-4)
                self.assertIn("touches at", run_of(obj).touching())
                if shape not in ("SPHERE", "CAPSULE"):  # round ones let the strip hang beside them
                    near = shown(obj)[:, 0] < 0.3
                    self.assertGreater(shown(obj)[near, 2].min(), -BELOW - 2e-3)

    def test_an_empty_is_a_plane_and_a_flat_mesh_as_well(self):
        obj = add_strip()
        bpy.ops.object.empty_add(location=(0, 0, -BELOW))
        collide(bpy.context.object)
        play(20)
        self.assertEqual(self.message(obj), "")
        self.assertGreater(shown(obj)[:, 2].min(), -BELOW - 1e-4)

    def test_a_moving_collider_pushes_and_scrubbing_back_is_exact(self):
        obj = add_strip()
        obj.shellwarp.gravity = 0.0
        item = collide(ball(), "SPHERE")
        key(item, "location", {frame: (0.2, 0.015, z) for frame, z in ((1, -0.08), (10, -0.02), (20, -0.02))})
        found = {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            found[frame] = shown(obj)
        self.assertGreater(found[12][:, 2].max(), 0.02)
        for frame in (6, 15, 3, 4):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(obj), found[frame]), frame)

    def test_the_collision_modifier_gives_role_friction_and_distance(self):
        obj = add_strip()
        item = ball()
        item.modifiers.new("Collision", "COLLISION")
        item.collision.cloth_friction, item.collision.thickness_outer = 40, 0.004
        self.assertEqual(part("colliders").surface(item), (40 * 0.01, item.collision.thickness_outer))
        play(20)
        self.assertGreater(run_of(obj).report()["contact_count"], 0)
        distance = numpy.linalg.norm(shown(obj, world=True) - numpy.array(item.location), axis=1).min()
        self.assertGreater(distance, 0.05 + 0.003)  # the ball of facets is within 1 mm of the round one
        item.collision.use = False
        self.scene.frame_set(1)
        self.assertEqual(run_of(obj).solids, ())

    def test_a_collection_chooses_and_the_shell_is_not_its_own_collider(self):
        obj = add_strip()
        collide(ball())
        collide(obj)
        chosen = bpy.data.collections.new("chosen")
        obj.shellwarp.collision_collection = chosen
        play(1)
        self.assertEqual(run_of(obj).solids, ())
        obj.shellwarp.collision_collection = None
        play(1)
        self.assertEqual([item.name for item in run_of(obj).solids], ["Sphere"])

    def test_a_bake_has_the_same_contact_as_live(self):
        obj = add_strip()
        collide(ball(), "SPHERE", 0.3)
        play(20)
        live = shown(obj)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        bpy.context.view_layer.objects.active = obj
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        for text in ("frame 20: about", "off the full nonlinear shell", "touches at"):
            self.assertIn(text, obj.shellwarp.verdict)
        self.assertNotIn("too far", obj.shellwarp.verdict)
        self.scene.frame_set(20)
        self.assertTrue(numpy.array_equal(shown(obj), live))
        bpy.ops.object.select_all(action="DESELECT")
        obj.select_set(True)
        self.assertEqual(bpy.ops.shellwarp.export(filepath=str(self.folder / "strip.usdc")), {"FINISHED"})
        self.scene = scenes.empty_file()
        bpy.ops.wm.usd_import(filepath=str(self.folder / "strip.usdc"))
        self.scene.frame_set(20)
        back = next(item for item in bpy.data.objects if item.type == "MESH")
        self.assertLess(numpy.abs(shown(back) - live).max(), 1e-6)  # float32 through one matrix


class Warned(Case):
    def test_a_shell_out_of_range_is_told_live_and_after_a_bake(self):
        """A strip of a hundredth of the stiffness hangs straight down: it turns by a right angle and more."""
        obj = add_strip()
        obj.shellwarp.k_bend *= 0.01
        play(20)
        self.assertRegex(run_of(obj).turned(), r"turns by \d+ degrees")
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertRegex(obj.shellwarp.verdict, r"turned too far for the method in \d+ of 20 frames")


def ground(height=-BELOW, bump=0.01):
    """An open sheet under the strip that waves along it; it faces up."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=24, y_subdivisions=4, size=1, location=(0.2, 0.015, height))
    item = bpy.context.object
    for vertex in item.data.vertices:
        vertex.co.z = bump * (numpy.cos(20 * vertex.co.x) - 1)
    return item


class Open(Case):
    def lowest(self, obj, item):
        """Of the strip over the sheet's mean surface."""
        x = shown(obj)
        return (x[:, 2] - item.location.z - 0.01 * (numpy.cos(20 * (x[:, 0] - 0.2)) - 1)).min()

    def test_an_open_mesh_is_solid_behind_its_faces_by_itself(self):
        for shape in ("AUTO", "MESH", "DEFORMING"):
            with self.subTest(shape=shape):
                self.scene = scenes.empty_file()
                obj, item = add_strip(), ground()
                collide(item, shape)
                play(30)
                self.assertEqual(self.message(obj), "")
                self.assertGreater(run_of(obj).report()["contact_count"], 0)
                self.assertLess(self.depth(obj), 1e-4)
                # A facet of 1/24 is 1/24² 4/8 = 9e-4 off the wave, a grid of cells of 1/64 as much.
                self.assertGreater(self.lowest(obj, item), -2e-3)

    def test_the_depth_is_the_roles_or_the_collision_modifiers_inner_thickness(self):
        """A strip that begins behind the back is pushed up against it, or not where that is farther off."""
        for by_modifier in (False, True):
            with self.subTest(by_modifier=by_modifier):
                self.scene = scenes.empty_file()
                obj, item = add_strip(), ground(0.1, 0.0)
                item.data.vertices[0].co.z += 0.001  # else flat: a plane
                obj.shellwarp.gravity = -1.0
                if by_modifier:
                    item.modifiers.new("Collision", "COLLISION")
                    item.collision.thickness_inner, item.collision.thickness_outer = 0.08, 0.001
                else:
                    collide(item, "MESH").shellwarp_collider.depth = 0.08
                self.assertEqual(part("colliders").depth(item, numpy.array([[0, 0, 0], [1, 0, 0]])), numpy.float32(0.08))
                play(30)
                self.assertEqual(self.message(obj), "")
                # The back is at 0.02, and a grid of cells of 1/64 rounds what is within a cell of its rim.
                self.assertLess(shown(obj)[:, 2].max(), 0.022)
                self.assertGreater(run_of(obj).report()["contact_count"], 0)

    def test_a_small_bowl_with_blenders_own_settings_catches_the_strips_end(self):
        """Its inner thickness of 20 cm is more than the bowl."""
        obj, item = add_strip(), ball(0.04, (0.29, 0.015, -0.06))
        half = bmesh.new()
        half.from_mesh(item.data)
        bmesh.ops.delete(half, geom=[vertex for vertex in half.verts if vertex.co.z > 0.001], context="VERTS")
        bmesh.ops.reverse_faces(half, faces=half.faces)   # its inside is its front
        half.to_mesh(item.data)
        item.modifiers.new("Collision", "COLLISION")
        play(30)
        self.assertEqual(self.message(obj), "")
        self.assertTrue(part("colliders").is_sheet(item, bpy.context.evaluated_depsgraph_get()))
        self.assertGreater(run_of(obj).report()["contact_count"], 0)
        self.assertLess(self.depth(obj), 1e-4)

    def test_an_open_mesh_that_deforms_lifts_the_strip(self):
        obj, item = add_strip(), ground()
        item.shape_key_add(name="Basis")
        up = item.shape_key_add(name="up")
        for point in up.data:
            point.co.z += 0.02
        key(item.data.shape_keys.key_blocks["up"], "value", {1: 0.0, 20: 1.0, 30: 1.0})
        collide(item)
        play(30)
        self.assertEqual(self.message(obj), "")
        self.assertLess(self.depth(obj), 1e-4)
        self.assertGreater(self.lowest(obj, item), 0.02 - 2e-3)

    def test_the_panel_tells_of_open_meshes_alone(self):
        item, whole = ground(), ball()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.assertTrue(part("colliders").is_sheet(item, depsgraph))
        self.assertFalse(part("colliders").is_sheet(whole, depsgraph))
        solidify = item.modifiers.new("Solidify", "SOLIDIFY")
        solidify.thickness = 0.05
        self.assertFalse(part("colliders").is_sheet(item, bpy.context.evaluated_depsgraph_get()))
        item.modifiers.remove(solidify)
        item.shellwarp_collider.shape = "BOX"
        self.assertFalse(part("colliders").is_sheet(item, bpy.context.evaluated_depsgraph_get()))


class Wrong(Case):
    def test_a_mesh_that_is_inside_out_is_refused_by_name_at_every_frame_until_mended(self):
        obj = add_strip()
        bpy.ops.mesh.primitive_cube_add(size=0.1, location=(0.2, 0, -0.1))
        item = collide(bpy.context.object, "MESH")
        item.data.flip_normals()
        before = shown(obj)
        for frame in (1, 2, 5):
            self.scene.frame_set(frame)
            self.assertIn("collider “Cube”: the mesh is inside out", self.message(obj))
            self.assertTrue(numpy.array_equal(shown(obj), before))
        item.shellwarp_collider.shape = "BOX"
        self.scene.frame_set(6)
        self.assertEqual(self.message(obj), "go to the start frame: the model is made there")
        play(3)
        self.assertEqual(self.message(obj), "")

    def test_a_scale_that_moves_or_is_zero_and_a_collider_that_goes_are_named(self):
        obj = add_strip()
        item = collide(ball(), "SPHERE")
        play(2)
        item.scale.x = 2
        self.scene.frame_set(3)
        self.assertIn("collider “Sphere”: its scale changes", self.message(obj))
        item.shellwarp_collider.enabled = False
        self.scene.frame_set(3)
        self.assertIn("the colliders are others", self.message(obj))
        item.shellwarp_collider.enabled, item.scale.x = True, 0
        self.scene.frame_set(1)
        self.assertIn("collider “Sphere”: its scale is zero", self.message(obj))

    def test_a_disabled_collider_is_named_and_an_excluded_one_is_none(self):
        obj = add_strip()
        item = collide(ball(), "SPHERE")
        item.hide_set(True)
        play(2)
        self.assertEqual((self.message(obj), len(run_of(obj).solids)), ("", 1))
        item.hide_viewport = True
        self.scene.frame_set(3)
        self.assertIn("collider “Sphere”: it is disabled", self.message(obj))
        item.hide_viewport = False
        chosen = bpy.data.collections.new("apart")
        self.scene.collection.children.link(chosen)
        chosen.objects.link(item)
        self.scene.collection.objects.unlink(item)
        bpy.context.view_layer.layer_collection.children["apart"].exclude = True
        play(2)
        self.assertEqual((self.message(obj), run_of(obj).solids), ("", ()))

    def test_a_mesh_edited_after_its_bake_is_told(self):
        obj = add_strip()
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertEqual(part("bake").stale(obj), "")
        obj.data.vertices.add(1)
        self.assertEqual(part("bake").stale(obj), f"the cache is of {scenes.N} points, the mesh has {scenes.N + 1}: bake anew")
        (self.folder / "strip.pc2").write_bytes(b"short")
        self.assertIn("is of 0 points", part("bake").stale(obj))

    def test_faces_and_vertices_changed_after_a_bake_are_told_and_not_exported(self):
        obj = add_strip()
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        points = part("inputs").rest_positions(obj.data)
        faces = [list(face.vertices) for face in obj.data.polygons]
        a, b, c, d = faces[10]
        for changed, text in (([*faces[:10], [a, b, c], [a, c, d], *faces[11:]], "other faces"), (faces, "")):
            obj.data.clear_geometry()
            obj.data.from_pydata(points.tolist(), [], changed)
            self.assertIn(text, part("bake").stale(obj))
        self.assertEqual(part("bake").stale(obj), "")
        obj.data.vertices[60].co.z += 0.01
        self.assertIn("vertices were moved", part("bake").stale(obj))
        with self.assertRaisesRegex(RuntimeError, "vertices were moved"):
            bpy.ops.shellwarp.export(filepath=str(self.folder / "strip.abc"))

    def test_a_renamed_pin_group_stops_the_shell_with_its_name_until_mended(self):
        obj = add_strip()
        play(5)
        before = shown(obj)
        obj.vertex_groups["held"].name = "other"
        for frame in (6, 7, 1, 2, 3):
            self.scene.frame_set(frame)
            self.assertIn("“held”", self.message(obj), frame)
            self.assertTrue(numpy.array_equal(shown(obj), before), frame)
        obj.vertex_groups["other"].name = "held"
        self.scene.frame_set(1)
        self.assertEqual(self.message(obj), "")

    def test_another_pin_group_waits_for_the_start_frame_rather_than_holding_the_old_pins(self):
        obj = add_strip()
        obj.vertex_groups.new(name="other").add(list(range(116, 124)), 1.0, "REPLACE")
        play(5)
        before = shown(obj)
        obj.shellwarp.fixed_group = "other"
        self.scene.frame_set(6)
        self.assertIn("the group “other” (fixed) is another", self.message(obj))
        self.assertTrue(numpy.array_equal(shown(obj), before))
        play(6)
        self.assertEqual(self.message(obj), "")
        self.assertLess(shown(obj)[0, 2], -1e-3)  # what was held falls


class Materials(Case):
    def shell(self, obj):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return part("inputs").read_shell(obj, depsgraph)[0]

    def test_a_known_material_is_the_librarys_in_the_scenes_unit(self):
        obj = add_strip()
        obj.shellwarp.material, obj.shellwarp.preset = "PRESET", "steel"
        for length in (1.0, 0.01):
            self.scene.unit_settings.scale_length = length
            found, known = self.shell(obj).material, sw.Sheet.known("steel", self.scene.unit_settings.scale_length)
            self.assertEqual((found.young, found.poisson, found.thickness, found.volume_density),
                             (known.young, known.poisson, known.thickness, known.volume_density))
        obj.shellwarp.preset = "stele"
        with self.assertRaisesRegex(Exception, "no known material is called 'stele'"):
            self.shell(obj)

    def test_a_sheet_swings_alike_in_metres_and_in_centimetres(self):
        """The same card in both units; 1e-3: frequencies come from float32 coordinates."""
        hertz = []
        for length in (1.0, 0.01):
            self.scene = scenes.empty_file()
            self.scene.unit_settings.scale_length = length
            obj = add_strip()
            obj.scale = (1 / length,) * 3
            s = obj.shellwarp
            s.material, s.young, s.poisson, s.thickness, s.volume_density = "SHEET", 3e9, 0.29, 4e-4, 750
            play(1)
            self.assertEqual(self.message(obj), "")
            hertz.append(run_of(obj).model.frequencies()[0])
        self.assertAlmostEqual(hertz[1] / hertz[0], 1, delta=1e-3)
        self.assertGreater(hertz[0], 0.5)

    def test_a_group_multiplies_the_thickness(self):
        """Half the thickness on all vertices halves a sheet's first frequency: f ~ h."""
        obj = add_strip()
        s = obj.shellwarp
        s.material, s.preset = "PRESET", "card"
        play(1)
        whole = run_of(obj).model.frequencies()[0]
        obj.vertex_groups.new(name="thin").add(range(scenes.N), 0.5, "REPLACE")
        s.thickness_group = "thin"
        play(1)
        self.assertEqual(self.message(obj), "")
        self.assertAlmostEqual(run_of(obj).model.frequencies()[0] / whole, 0.5, delta=1e-3)
        obj.vertex_groups["thin"].name = "gone"
        self.scene.frame_set(2)
        self.assertIn("“thin”", self.message(obj))
        obj.vertex_groups["gone"].add([3], 0.0, "REPLACE")
        s.thickness_group = "gone"
        self.scene.frame_set(1)
        self.assertIn("the weight of vertex 3 in “gone” is 0", self.message(obj))

    def test_a_shape_key_is_the_shape_without_stress(self):
        """The strip curls to the arc of its key: its end comes to the key's height, but for the flat clamp. Rows 0 and 1 are held."""
        obj = add_strip()
        obj.shape_key_add(name="Basis")
        rolled = obj.shape_key_add(name="rolled")
        rolled.value = 0.0
        points = part("meshes").rest_positions(obj.data)
        angle = (points[:, 0] - 0.01).clip(min=0) * 4   # 0.25 m of radius
        curled = numpy.where(points[:, :1] > 0.01, numpy.stack([0.01 + numpy.sin(angle) / 4, points[:, 1], (1 - numpy.cos(angle)) / 4], axis=1), points)
        rolled.data.foreach_set("co", curled.astype(numpy.float32).ravel())
        s = obj.shellwarp
        s.rest_shape, s.fixed_group, s.clamped_group, s.gravity = "rolled", "", "held", 0.0
        play(2)
        self.assertEqual(self.message(obj), "")
        self.assertAlmostEqual(shown(obj)[-1, 2] / curled[-1, 2], 1, delta=0.05)
        s.rest_shape = "none"
        self.scene.frame_set(1)
        self.assertIn("no shape key “none”", self.message(obj))

    def test_edge_attributes_are_creases(self):
        """A fold that turns freely has no stiffness; one that rests at an angle lifts the end by its sine."""
        obj = add_strip()
        mesh = obj.data
        middle = {v.index for v in mesh.vertices if abs(v.co.x - 0.15) < 1e-6}
        folds = [e.index for e in mesh.edges if set(e.vertices) <= middle]
        factors, angles = (mesh.attributes.new(name, "FLOAT", "EDGE") for name in ("soft", "bent"))
        factors.data.foreach_set("value", [1.0] * len(mesh.edges))
        for edge in folds:
            factors.data[edge].value, angles.data[edge].value = 4.0, 0.5
        s = obj.shellwarp
        s.crease_factors, s.crease_angles, s.gravity = "soft", "bent", 0.0
        folded = self.shell(obj).creases
        self.assertEqual([(set(edge[:2]) <= middle, edge[2:]) for edge in folded], [(True, (4.0, 0.5))] * 3)
        play(2)
        self.assertEqual(self.message(obj), "")
        self.assertGreater(abs(shown(obj)[-1, 2]), 0.04)   # 0.15 sin 0.5 is 0.07; what is next to the fold bends back
        yields = mesh.attributes.new("limit", "FLOAT", "EDGE")
        yields.data[folds[0]].value = 0.25
        s.crease_yields = "limit"
        self.assertEqual(sorted(edge[2:] for edge in self.shell(obj).creases), [(4.0, 0.5)] * 2 + [(4.0, 0.5, 0.25)])
        self.scene.frame_set(1)
        self.assertIn("creases cannot yield", self.message(obj))   # by the warp
        s.crease_yields = ""
        mesh.attributes.new("plain", "BOOLEAN", "EDGE").data[folds[0]].value = True
        s.crease_flat = "plain"
        self.assertEqual(sorted(edge[2:] for edge in self.shell(obj).creases), [(4.0, 0.0), (4.0, 0.5), (4.0, 0.5)])
        s.crease_flat = "bent"
        self.scene.frame_set(1)
        self.assertIn("no attribute “bent” of yes or no", self.message(obj))
        s.crease_flat = ""
        s.crease_angles = "gone"
        self.scene.frame_set(1)
        self.assertIn("no attribute “gone”", self.message(obj))


class Layout:
    """Stands in for a panel's layout, which there is none of without a window: keeps what is shown, refuses what is not there."""

    ICONS = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())

    def __init__(self):
        self.labels, self.shown = [], []

    def row(self, **_):
        return self

    column = row

    def label(self, text="", icon="NONE"):
        assert icon in self.ICONS, icon
        self.labels.append(text)

    def prop(self, data, name, text="", icon="NONE"):
        assert name in data.bl_rna.properties and icon in self.ICONS, name
        self.shown.append(name)

    def prop_search(self, data, name, source, names):
        assert names in source.bl_rna.properties, names
        self.prop(data, name)

    def operator(self, name, text="", icon="NONE"):
        folder, _, last = name.partition(".")
        assert last in dir(getattr(bpy.ops, folder)) and icon in self.ICONS, name

    def template_list(self, kind, *_, **__):
        assert hasattr(bpy.types, kind), kind


class Panels(Case):
    def drawn(self, name, obj):
        layout = Layout()
        context = types.SimpleNamespace(object=obj, scene=self.scene, view_layer=bpy.context.view_layer)
        getattr(part("panel"), name).draw(types.SimpleNamespace(layout=layout), context)
        return layout

    def test_the_panel_shows_the_settings_of_the_material_alone(self):
        obj = add_strip()
        for material, there, absent in (("CONSTANTS", "k_bend", "young"), ("PRESET", "preset", "young"), ("SHEET", "young", "k_bend")):
            obj.shellwarp.material = material
            shown_now = self.drawn("SHELLWARP_PT_shell", obj).shown
            self.assertTrue({there, "density_group", "collision_collection"} <= set(shown_now))
            self.assertNotIn(absent, shown_now)

    def test_the_panel_tells_of_contact_range_errors_and_the_last_bake(self):
        obj = add_strip()
        obj.shellwarp.k_bend *= 0.01
        play(20)
        self.assertRegex("; ".join(self.drawn("SHELLWARP_PT_shell", obj).labels), "turns by .* too far for the method")
        collide(ball(), "SPHERE")
        play(20)
        self.assertRegex("; ".join(self.drawn("SHELLWARP_PT_shell", obj).labels), "touches at [1-9]")
        obj.vertex_groups["held"].name = "other"
        self.scene.frame_set(19)
        self.assertIn("there is no vertex group “held”", self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.vertex_groups["other"].name = "held"
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        bpy.context.view_layer.objects.active = obj
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertIn(obj.shellwarp.verdict, self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.data.vertices.add(1)
        self.assertIn(part("bake").stale(obj), self.drawn("SHELLWARP_PT_shell", obj).labels)

    def test_the_panel_tells_of_a_renamed_group_at_once_and_until_it_is_mended(self):
        obj = add_strip()
        play(5)
        obj.vertex_groups["held"].name = "other"
        for _ in range(2):  # no frame has changed since
            self.assertIn("there is no vertex group “held”", self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.vertex_groups["other"].name = "held"
        self.assertNotIn("there is no vertex group “held”", self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.shellwarp.handles.add()
        self.assertIn("the empty of handle 1 is gone: choose another, or remove the handle", self.drawn("SHELLWARP_PT_shell", obj).labels)

    def test_what_a_button_could_not_do_stays_in_the_panel_until_it_can(self):
        obj = add_strip()
        with self.assertRaisesRegex(RuntimeError, "save the file first"):
            bpy.ops.shellwarp.bake()
        text = "Bake: save the file first, or name a cache"
        play(3)
        self.assertIn(text, self.drawn("SHELLWARP_PT_shell", obj).labels)
        obj.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        self.assertNotIn(text, self.drawn("SHELLWARP_PT_shell", obj).labels)

    def test_the_panel_says_what_gravity_is_where_a_unit_is_no_metre(self):
        obj = add_strip()
        obj.shellwarp.material = "PRESET"
        self.assertNotIn("gravity", "; ".join(self.drawn("SHELLWARP_PT_shell", obj).labels))
        self.scene.unit_settings.scale_length = 0.01
        self.assertIn("Here gravity is 0.098 m/s²", self.drawn("SHELLWARP_PT_shell", obj).labels)

    def test_the_colliders_panel_shows_whose_friction_counts(self):
        item = ball()
        self.assertIn("friction", self.drawn("SHELLWARP_PT_collider", item).shown)
        item.modifiers.new("Collision", "COLLISION")
        there = self.drawn("SHELLWARP_PT_collider", item).shown
        self.assertTrue({"cloth_friction", "thickness_outer"} <= set(there) and "friction" not in there)


class Presets(Case):
    def test_a_preset_gives_another_shell_the_same_nature_and_leaves_what_is_its_own(self):
        obj = add_strip()
        s = obj.shellwarp
        s.material, s.young, s.thickness, s.method, s.damping_ratio, s.air_density = "SHEET", 2e9, 3e-4, "rotation-strain", 0.3, 1.2
        self.assertEqual(bpy.ops.shellwarp.preset_add(name="Stiff card"), {"FINISHED"})
        files = [Path(folder) / "Stiff_card.py" for folder in bpy.utils.preset_paths("shellwarp")]
        path = next(path for path in files if path.is_file())
        self.addCleanup(path.unlink, missing_ok=True)
        other = add_strip("Other")
        other.shellwarp.cache = "mine.pc2"
        self.assertEqual(bpy.ops.script.execute_preset(filepath=str(path), menu_idname="SHELLWARP_PT_presets"), {"FINISHED"})
        for name in part("presets").KEPT:
            self.assertEqual(getattr(other.shellwarp, name), getattr(s, name), name)
        self.assertEqual((other.shellwarp.cache, other.shellwarp.fixed_group, other.shellwarp.method), ("mine.pc2", "held", "rotation-strain"))

    def test_every_setting_of_a_preset_is_there(self):
        known = set(add_strip().shellwarp.bl_rna.properties.keys())
        self.assertEqual(set(part("presets").KEPT) - known, set())
        self.assertTrue(hasattr(part("panel").SHELLWARP_PT_shell, "draw_header_preset"))


class Caches(Case):
    def test_names_that_files_cannot_have_do_not_clash(self):
        first, second = add_strip("A/1"), add_strip("A:1")
        path = part("bake").cache_path
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "file.blend"))
        first, second = bpy.data.objects["A/1"], bpy.data.objects["A:1"]
        self.assertNotEqual(path(first), path(second))
        self.assertEqual(path(add_strip("plain")), "//cache/plain.pc2")

    def test_a_cache_that_is_anothers_too_is_refused(self):
        obj, other = add_strip("one"), add_strip("two")
        obj.shellwarp.cache = other.shellwarp.cache = str(self.folder / "same.pc2")
        with self.assertRaisesRegex(Exception, "the cache of “.*” too"):
            list(part("bake").bake([obj], bpy.context))
        self.assertFalse((self.folder / "same.pc2").exists())


if __name__ == "__main__":
    unittest.main()
