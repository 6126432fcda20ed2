"""Claims about meshes that follow a proxy in the add-on, in Blender itself; run by ctest as `blender`."""

import tempfile
import types
import unittest
from pathlib import Path

import bpy
import numpy
import scene as scenes
import shellwarp as sw
import test_addon
from mathutils import Matrix
from scene import add_strip, key, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Layout

ROUNDED = 2e-6  # of float32 coordinates up to 3, through two matrices of float32


def add_slab(name="Slab", thickness=0.002, rows=61):
    """The strip as a closed slab of quads with thickness, finer than it, one end an n-gon."""
    points = [(0.3 * i / (rows - 1), 0.03 * j / 4, z) for z in (thickness / 2, -thickness / 2) for i in range(rows) for j in range(5)]
    n = 5 * rows
    faces = [(a, a + 5, a + 6, a + 1) for i in range(rows - 1) for a in range(5 * i, 5 * i + 4)]
    faces += [tuple(n + v for v in reversed(face)) for face in faces]
    faces.append((*range(5), *(n + v for v in reversed(range(5)))))  # ten corners
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def follow(proxy, *drawn):
    """As a user does: select the meshes, then the proxy, press the button."""
    bpy.ops.object.select_all(action="DESELECT")
    for item in (*drawn, proxy):
        item.select_set(True)
    bpy.context.view_layer.objects.active = proxy
    assert bpy.ops.shellwarp.add_render() == {"FINISHED"}


class Case(unittest.TestCase):
    def setUp(self):
        self.scene = scenes.empty_file()
        self.folder = Path(tempfile.mkdtemp(dir=test_addon.FOLDER.name))

    def message(self, obj):
        return part("live").message(obj)

    def pair(self):
        proxy, slab = add_strip(), add_slab()
        follow(proxy, slab)
        return proxy, slab


def judged(proxy, points, frames):
    """The package's own binding of points, run without Blender; by frame number."""
    s = proxy.shellwarp
    rest, triangles = part("inputs").rest_positions(proxy.data).astype(float), part("inputs").triangles(proxy.data)
    model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
    model.precompute(modes=s.modes, reduced_fields=0)
    binding, state = sw.Binding(model, points), model.state("warp")
    state.set_gravity(bpy.context.scene.gravity)
    state.set_damping(s.damping_ratio)
    out = {}
    for frame in range(1, frames + 1):
        if frame > 1:
            state.step(1 / 30)
        out[frame] = state.bound_points(binding, space="frame")["positions"]
    return out


class Made(Case):
    def make(self, asset, **options):
        bpy.ops.object.select_all(action="DESELECT")
        bpy.context.view_layer.objects.active = asset
        return bpy.ops.shellwarp.make_proxy(**options)

    def test_a_slab_follows_the_proxy_made_of_it(self):
        slab = add_slab()
        slab.vertex_groups.new(name="held").add([v.index for v in slab.data.vertices if v.co.x < 0.02], 1.0, "REPLACE")
        slab.matrix_world = Matrix.Translation((0.1, 0, 0.2))
        rest = shown(slab)
        self.assertEqual(self.make(slab, vertices=150), {"FINISHED"})
        proxy = bpy.context.object
        self.assertLess(abs(len(proxy.data.vertices) - 150), 20)
        self.assertLess(max(abs(v.co.z) for v in proxy.data.vertices), 1e-6)  # in the middle of the two sides
        self.assertEqual([item.target for item in proxy.shellwarp.renders], [slab])
        held = part("inputs").group_vertices(proxy, "held")
        self.assertTrue(held and all(proxy.data.vertices[v].co.x < 0.025 for v in held))
        s = proxy.shellwarp
        s.fixed_group, s.density, s.k_bend, s.k_length, s.k_area, s.frame_end = "held", 0.3, 2.7e-3, 5e3, 5e3, 10
        for frame in range(1, 11):
            play(frame)
        self.assertEqual(self.message(proxy), "")
        self.assertGreater(numpy.abs(shown(slab) - rest).max(), 1e-3)
        found = part("live").simulation(proxy).calibration   # by the group of the same name on the slab
        self.assertLess(found["difference_after"], found["difference_before"])
        self.assertEqual(part("live").simulation(proxy).uncalibrated, "")
        slab.vertex_groups["held"].name = "renamed"
        s.density = 0.31
        play(1)
        run = part("live").simulation(proxy)
        self.assertIsNone(run.calibration)
        self.assertIn(f"nothing holds “{slab.name}”", run.uncalibrated)
        s.proxy_calibrated = False
        play(1)
        run = part("live").simulation(proxy)
        self.assertEqual((run.calibration, run.uncalibrated), (None, ""))

    def test_what_cannot_be_is_refused_and_nothing_is_left_behind(self):
        proxy, slab = self.pair()
        before = len(bpy.data.objects)
        with self.assertRaisesRegex(RuntimeError, "it follows"):
            self.make(slab)
        mesh = bpy.data.meshes.new("tee")
        mesh.from_pydata([(0, 0, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1)], [], [(0, 1, 2), (1, 0, 3), (0, 1, 4)])
        tee = bpy.data.objects.new("tee", mesh)
        bpy.context.scene.collection.objects.link(tee)
        with self.assertRaisesRegex(RuntimeError, "3 triangles meet at the edge"):
            self.make(tee, vertices=50)
        self.assertEqual(len(bpy.data.objects), before + 1)
        self.assertEqual(self.make(tee, vertices=50, cut=True), {"FINISHED"})


class Live(Case):
    def test_it_follows_as_the_librarys_binding_says_and_scrubbing_back_is_exact(self):
        proxy, slab = self.pair()
        rest = shown(slab)
        expected, found = judged(proxy, rest, 20), {}
        for frame in range(1, 21):
            self.scene.frame_set(frame)
            found[frame] = shown(slab)
            self.assertEqual(self.message(proxy), "")
            self.assertLess(numpy.abs(found[frame] - expected[frame]).max(), ROUNDED, frame)
        self.assertTrue(numpy.array_equal(found[1], rest))
        self.assertGreater(numpy.abs(found[20] - rest).max(), 0.05)
        for frame in (7, 3, 15):
            self.scene.frame_set(frame)
            self.assertTrue(numpy.array_equal(shown(slab), found[frame]), frame)

    def test_its_thickness_stays(self):
        """Points off the surface stay rigid with it: the slab's two sides keep their distance, to 1 - cos of the turn in a triangle."""
        proxy, slab = self.pair()
        play(20)
        points = shown(slab)
        distance = numpy.linalg.norm(points[:305] - points[305:], axis=1)
        self.assertLess(numpy.abs(distance / 0.002 - 1).max(), 0.01)

    def test_it_is_led_in_the_world_wherever_it_hangs(self):
        """One stands still while its proxy moves, one is a child of it: both are drawn at the same place."""
        proxy = add_strip()
        proxy.rotation_euler, proxy.scale = (0.3, -0.2, 0.5), (2, 2, 2)
        still, child = add_slab("Still"), add_slab("Child")
        proxy.location = (1, 2, 3)
        bpy.context.view_layer.update()
        still.matrix_world = proxy.matrix_world
        child.parent = proxy
        key(proxy, "location", {1: (1, 2, 3), 20: (1.5, 2, 3)})
        follow(proxy, still, child)
        play(20)
        self.assertEqual(self.message(proxy), "")
        found = [shown(item, world=True) for item in (still, child)]
        self.assertLess(numpy.abs(found[0] - found[1]).max(), ROUNDED)
        self.assertGreater(numpy.linalg.norm(found[0].mean(axis=0) - (1, 2, 3)), 0.4)

    def test_an_uneven_and_mirrored_scale_is_as_good_as_any(self):
        proxy, slab, mirrored = add_strip(), add_slab(), add_slab("Mirrored")
        mirrored.data.transform(Matrix.Diagonal((-1, 0.5, 4, 1)))
        mirrored.scale = (-1, 2, 0.25)
        follow(proxy, slab, mirrored)
        play(20)
        self.assertEqual(self.message(proxy), "")
        self.assertLess(numpy.abs(shown(slab, world=True) - shown(mirrored, world=True)).max(), ROUNDED)

    def test_modifiers_and_shape_keys_of_its_own_come_after(self):
        proxy, slab = self.pair()
        slab.shape_key_add(name="Basis")
        raised = slab.shape_key_add(name="raised")
        for point in raised.data:
            point.co.z += 0.01
        raised.value = 1.0
        plain = add_slab("Plain")
        follow(proxy, plain)
        slab.modifiers.new("fine", "SUBSURF").levels = 1
        play(10)
        self.assertEqual(self.message(proxy), "")
        self.assertGreater(len(shown(slab)), 3 * len(slab.data.vertices))
        slab.modifiers.clear()
        # the key's 0.01 in z on top, float32
        self.assertLess(numpy.abs(shown(slab) - shown(plain) - (0, 0, 0.01)).max(), 1e-6)

    def test_before_the_start_it_is_at_rest_and_a_part_of_a_frame_lies_between(self):
        proxy, slab = self.pair()
        rest = shown(slab)
        proxy.shellwarp.frame_start = 5
        play(12)
        self.scene.frame_set(2)
        self.assertTrue(numpy.array_equal(shown(slab), rest))
        ends = []
        for frame, part_of in ((11, 0.0), (11, 0.5), (12, 0.0)):
            self.scene.frame_set(frame, subframe=part_of)
            ends.append(shown(slab)[-1, 2])
        self.assertTrue(min(ends[0], ends[2]) < ends[1] < max(ends[0], ends[2]))

    def test_a_saved_file_and_undo_keep_what_follows(self):
        proxy, slab = self.pair()
        bpy.ops.ed.undo_push(message="bound")
        play(8)
        before = shown(slab)
        bpy.context.object.shellwarp.renders.clear()
        bpy.ops.ed.undo_push(message="cleared")
        bpy.ops.ed.undo()
        proxy, slab = bpy.data.objects["Strip"], bpy.data.objects["Slab"]
        self.assertEqual(proxy.shellwarp.renders[0].target, slab)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "pair.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "pair.blend"))
        proxy, slab = bpy.data.objects["Strip"], bpy.data.objects["Slab"]
        play(8)
        self.assertEqual(self.message(proxy), "")
        self.assertTrue(numpy.array_equal(shown(slab), before))


class Bake(Case):
    def baked(self):
        proxy, slab = self.pair()
        play(20)
        live = shown(slab)
        proxy.shellwarp.cache = str(self.folder / "strip.pc2")
        self.assertEqual(bpy.ops.shellwarp.bake(), {"FINISHED"})
        return proxy, slab, live

    def test_its_cache_plays_what_was_live_and_freeing_goes_live_again(self):
        proxy, slab, live = self.baked()
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["strip-Slab.pc2", "strip.pc2"])
        self.assertIsNone(slab.data.shape_keys)
        self.scene.frame_set(20)
        # Blender adds a shape key to the basis as a difference: two roundings of numbers up to 0.3
        self.assertLess(numpy.abs(shown(slab) - live).max(), 1e-7)
        bpy.ops.shellwarp.free_bake()
        self.assertEqual(len(slab.modifiers), 0)
        play(20)
        self.assertTrue(numpy.array_equal(shown(slab), live))

    def test_what_goes_out_is_the_render_mesh_with_its_quads(self):
        proxy, slab, _ = self.baked()
        expected = {}
        for frame in (1, 20):
            self.scene.frame_set(frame)
            expected[frame] = shown(slab, world=True)
        bpy.ops.object.select_all(action="DESELECT")
        proxy.select_set(True)
        for name, load in (("s.abc", bpy.ops.wm.alembic_import), ("s.usdc", bpy.ops.wm.usd_import)):
            self.assertEqual(bpy.ops.shellwarp.export(filepath=str(self.folder / name)), {"FINISHED"})
            self.assertEqual([item.name for item in bpy.context.selected_objects], ["Strip"])
        sizes = [len(face.vertices) for face in slab.data.polygons]
        for name in ("s.abc", "s.usdc"):
            self.scene = scenes.empty_file()
            path = str(self.folder / name)
            bpy.ops.wm.alembic_import(filepath=path, as_background_job=False) if name == "s.abc" else bpy.ops.wm.usd_import(filepath=path)
            back = [item for item in bpy.data.objects if item.type == "MESH"]
            self.assertEqual(len(back), 1, [item.name for item in back])
            self.assertEqual([len(face.vertices) for face in back[0].data.polygons], sizes)
            for frame, points in expected.items():
                self.scene.frame_set(frame)
                self.assertLess(numpy.abs(shown(back[0], world=True) - points).max(), ROUNDED)

    def test_a_stopped_bake_leaves_no_file(self):
        proxy, slab = self.pair()
        proxy.shellwarp.cache = str(self.folder / "strip.pc2")
        under_way = part("bake").bake([proxy], bpy.context)
        for _ in range(5):
            next(under_way)
        under_way.close()
        self.assertEqual(list(self.folder.iterdir()), [])
        self.assertEqual(len(slab.modifiers), 0)

    def test_a_disabled_render_mesh_is_named_by_the_bake(self):
        proxy, slab = self.pair()
        proxy.shellwarp.cache = str(self.folder / "strip.pc2")
        slab.hide_viewport = True
        play(3)
        self.assertEqual(self.message(proxy), "")  # nobody sees it
        with self.assertRaisesRegex(RuntimeError, "“Slab” is disabled here"):
            bpy.ops.shellwarp.bake()
        self.assertEqual(list(self.folder.iterdir()), [])


class Trouble(Case):
    def test_what_cannot_follow_is_named_at_every_frame_until_mended(self):
        proxy, slab = self.pair()
        play(3)
        model = part("live").simulation(proxy).model
        other = bpy.data.objects.new("other", slab.data)
        for frame in (4, 5, 1, 2):
            self.scene.frame_set(frame)
            self.assertIn("render mesh “Slab”: the mesh is shared", self.message(proxy), frame)
        bpy.data.objects.remove(other)
        self.scene.frame_set(2)
        self.assertIn("go to the start frame", self.message(proxy))
        play(3)
        self.assertEqual(self.message(proxy), "")
        self.assertIs(part("live").simulation(proxy).model, model)  # which took long, on other meshes

    def test_one_that_is_gone_a_shell_or_anothers_is_refused(self):
        proxy, slab = self.pair()
        second = add_strip("Second")
        follow(second, slab)
        self.scene.frame_set(1)
        self.assertIn("render mesh “Slab”: it follows “Second” already", self.message(proxy))
        self.assertEqual(self.message(second), "")
        second.shellwarp.renders.clear()
        slab.shellwarp.enabled = True
        self.scene.frame_set(1)
        self.assertIn("it is a shell itself", self.message(proxy))
        bpy.data.objects.remove(slab)
        for frame in (1, 2):
            self.scene.frame_set(frame)
            self.assertIn("render mesh 1 is gone", self.message(proxy))
        bpy.context.view_layer.objects.active = proxy
        bpy.ops.shellwarp.remove_render()
        play(2)
        self.assertEqual(self.message(proxy), "")

    def test_one_edited_mid_run_is_told_and_bound_anew_at_the_start(self):
        proxy, slab = self.pair()
        play(3)
        slab.shape_key_clear()
        slab.data.vertices.add(1)
        self.scene.frame_set(4)
        self.assertIn("render mesh “Slab” has changed", self.message(proxy))
        play(4)
        self.assertEqual(self.message(proxy), "")

    def test_one_that_is_let_go_is_at_rest_again(self):
        proxy, slab = self.pair()
        rest = shown(slab)
        play(10)
        bpy.context.view_layer.objects.active = proxy
        self.assertEqual(bpy.ops.shellwarp.remove_render(), {"FINISHED"})
        self.assertIsNone(slab.data.shape_keys)
        self.assertTrue(numpy.array_equal(shown(slab), rest))


class Disabled(Case):
    def test_a_proxy_that_renders_leave_out_is_named_rather_than_followed_where_it_was(self):
        proxy, slab = self.pair()
        key(proxy, "location", {1: (0, 0, 0), 20: (1, 0, 0)})
        proxy.hide_render = True
        play(4)
        self.assertEqual(self.message(proxy), "")
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self.scene.collection.objects.link(camera)
        self.scene.camera, render = camera, self.scene.render
        render.engine, render.resolution_x, render.resolution_y, self.scene.cycles.samples = "CYCLES", 8, 8, 1
        render.filepath = str(self.folder / "small")
        said = []
        self.addCleanup(setattr, part("live"), "tell", part("live").tell)
        part("live").tell = lambda obj, text: said.append(text)
        bpy.ops.render.render(write_still=True)
        self.assertIn("it is disabled here", said[0])  # of the render; then the viewport is evaluated again

    def test_a_disabled_empty_is_named_rather_than_taken_where_it_was(self):
        """A handle's pointer keeps the empty in Blender's graph, with the place of an earlier frame."""
        obj = add_strip()
        bpy.ops.shellwarp.add_handle(vertex=120)
        empty = obj.shellwarp.handles[0].target
        play(2)
        empty.hide_viewport = True
        self.scene.frame_set(3)
        self.assertIn(f"handle 1, “{empty.name}”: it is disabled", self.message(obj))
        bpy.data.objects.remove(empty)
        self.scene.frame_set(3)
        self.assertIn("the empty of handle 1 is gone", self.message(obj))


class Shown(Case):
    def test_the_panel_lists_them_and_warns_where_a_render_would_not_move_them(self):
        proxy, _ = self.pair()
        panel = part("panel").SHELLWARP_PT_shell
        for hidden in (False, True):
            proxy.hide_render, layout = hidden, Layout()
            panel.draw(types.SimpleNamespace(layout=layout), types.SimpleNamespace(object=proxy, scene=self.scene, view_layer=bpy.context.view_layer))
            self.assertIn("visible_camera", layout.shown)
            self.assertEqual(any("disabled in renders" in text for text in layout.labels), hidden)

    def test_a_render_shows_what_follows_and_not_the_proxy(self):
        proxy, slab = self.pair()
        proxy.visible_camera = proxy.visible_shadow = False
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location, camera.rotation_euler = (0.15, -0.7, -0.05), (1.57, 0, 0)
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        self.scene.world = bpy.data.worlds.new("world")
        self.scene.world.color = (1, 1, 1)
        render = self.scene.render
        render.engine, render.resolution_x, render.resolution_y, render.film_transparent = "CYCLES", 64, 64, True
        self.scene.cycles.samples, self.scene.cycles.device = 4, "CPU"
        play(8)
        seen = []
        for name, hidden in (("with", False), ("without", True)):
            slab.hide_render = hidden
            render.filepath = str(self.folder / name)
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(str(self.folder / (name + ".png")))
            seen.append(numpy.array(image.pixels[:]).reshape(64, 64, 4)[:, :, 3])
        self.assertEqual(seen[1].max(), 0)
        rows = numpy.flatnonzero(seen[0].max(axis=1) > 0.5)
        self.assertGreater(numpy.ptp(rows), 3)  # it hangs: a flat slab would be one row


if __name__ == "__main__":
    unittest.main()
