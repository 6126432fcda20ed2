"""Claims about Blender's force fields and units, in Blender itself; run by ctest as `blender`."""

import types
import unittest

import bpy
import numpy
import scene as scenes
import shellwarp as sw
from scene import add_strip, key, play, shown
from test_addon import Case, part
from test_addon import setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Layout


def add_field(kind, strength, place=(0, 0, 0), **settings):
    """An empty with a field, its power 0."""
    item = bpy.data.objects.new(kind.lower(), None)
    bpy.context.scene.collection.objects.link(item)
    item.location = place
    before = bpy.context.view_layer.objects.active
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.forcefield_toggle()
    bpy.context.view_layer.objects.active = before
    item.field.type, item.field.strength, item.field.falloff_power = kind, strength, 0.0
    for name, value in settings.items():
        setattr(item.field, name, value)
    return item


def pushed(obj, frames, push, areas):
    """The strip run by the package alone: `push(points)` is the force per area; positions by frame."""
    s = obj.shellwarp
    rest, triangles = part("inputs").rest_positions(obj.data).astype(float), part("inputs").triangles(obj.data)
    model = sw.Model(sw.Shell(rest, triangles, sw.Material(s.k_area, s.k_length, s.k_bend, s.density), fixed=range(8)))
    model.precompute(modes=s.modes, reduced_fields=0)
    state = model.state("warp")
    state.set_gravity(bpy.context.scene.gravity)
    state.set_damping(s.damping_ratio)
    out = {1: state.positions()}
    for frame in range(2, frames + 1):
        state.set_forces(push(state.positions(dtype=numpy.float64)) * areas)
        state.step(1 / 30)
        out[frame] = state.positions()
    return out


def grid_areas():
    """Of the strip's vertices, by its grid of squares of a centimetre: a third of each triangle."""
    areas = numpy.zeros(scenes.N)
    for i in range(30):
        for a in range(4 * i, 4 * i + 3):
            for triangle in ((a, a + 4, a + 5), (a, a + 5, a + 1)):
                areas[list(triangle)] += 0.01 ** 2 / 6
    return areas


class Fields(Case):
    def test_a_wind_field_is_the_air_that_the_setting_is(self):
        obj, other = add_strip(), add_strip("By setting")
        other.shellwarp.fields = 0.0
        other.shellwarp.wind, other.shellwarp.air_density = (0, 0, 3.0), 1.2
        add_field("WIND", 3.0)
        play(15)
        self.assertEqual((self.message(obj), self.message(other)), ("", ""))
        # the same sum in another order
        self.assertLess(numpy.abs(shown(obj) - shown(other)).max(), 1e-6)
        still = add_strip("Still")
        still.shellwarp.fields = 0.0
        play(15)
        self.assertGreater(numpy.abs(shown(obj) - shown(still)).max(), 1e-3)

    def test_a_force_pushes_by_area_and_falls_off_from_its_place(self):
        obj = add_strip()
        obj.data.calc_loop_triangles()
        areas = numpy.zeros(scenes.N)
        for t in obj.data.loop_triangles:
            areas[list(t.vertices)] += t.area / 3
        self.assertAlmostEqual(areas.sum(), grid_areas().sum(), delta=1e-9)
        place = numpy.array((0.2, 0.1, -0.3))
        add_field("FORCE", 5.0, place, falloff_power=2.0)

        def push(points):
            way = points - place.astype(numpy.float32)
            distance = numpy.linalg.norm(way, axis=1)[:, None]
            return 5.0 * way / distance / (1 + distance) ** 2
        expected = pushed(obj, 12, push, areas[:, None])
        play(12)
        self.assertEqual(self.message(obj), "")
        # float32 areas of Blender's against those of the points
        self.assertLess(numpy.abs(shown(obj) - expected[12]).max(), 1e-5)
        for frame in (4, 12):
            self.scene.frame_set(frame)
            self.assertLess(numpy.abs(shown(obj) - expected[frame]).max(), 1e-5)

    def test_falloffs_sides_and_shapes_are_blenders(self):
        """Closed forms at single points."""
        at, read = part("fields").at, part("fields").read
        obj = add_strip()
        item = add_field("FORCE", 2.0)
        field = item.field

        def found(*point):
            bpy.context.view_layer.update()
            depsgraph = bpy.context.evaluated_depsgraph_get()
            return at(read(obj, self.scene, depsgraph, 1.0), numpy.array([point], float))[1][0]
        self.assertLess(numpy.abs(found(0, 3, 4) - (0, 1.2, 1.6)).max(), 1e-6)
        field.falloff_power, field.use_min_distance, field.distance_min = 1.0, True, 4.0
        self.assertLess(numpy.abs(found(0, 3, 4) - numpy.array((0, 1.2, 1.6)) / 2).max(), 1e-6)
        field.use_max_distance, field.distance_max = True, 4.5
        self.assertEqual(numpy.abs(found(0, 3, 4)).max(), 0)
        field.use_max_distance, field.falloff_power = False, 0.0
        field.z_direction = "NEGATIVE"
        self.assertEqual(numpy.abs(found(0, 3, 4)).max(), 0)
        self.assertLess(numpy.abs(found(0, 3, -4) - (0, 1.2, -1.6)).max(), 1e-6)
        field.z_direction, field.shape = "BOTH", "PLANE"
        self.assertLess(numpy.abs(found(0, 3, 4) - (0, 0, 2)).max(), 1e-6)
        field.shape = "LINE"
        self.assertLess(numpy.abs(found(0, 3, 4) - (0, 2, 0)).max(), 1e-6)
        field.shape, field.use_gravity_falloff = "POINT", True
        self.assertLess(numpy.abs(found(0, 3, 4) - numpy.array((0, 1.2, 1.6)) / 25).max(), 1e-6)
        field.type = "VORTEX"
        self.assertLess(numpy.abs(found(3, 0, 4) - (0, 6, 0)).max(), 1e-6)
        field.falloff_type, field.use_radial_max, field.radial_max = "TUBE", True, 2.0
        self.assertEqual(numpy.abs(found(3, 0, 4)).max(), 0)
        self.assertGreater(numpy.abs(found(1, 0, 4)).max(), 0)
        field.falloff_type, field.radial_max = "CONE", 30.0
        self.assertEqual(numpy.abs(found(3, 0, 4)).max(), 0)   # at 37 degrees
        self.assertGreater(numpy.abs(found(2, 0, 4)).max(), 0)  # at 27

    def test_a_keyed_field_acts_as_it_is_keyed_and_a_disabled_one_not(self):
        obj = add_strip()
        self.scene.gravity = (0, 0, 0)
        item = add_field("FORCE", 0.0, (0, 0, -10))
        item.field.strength = 0.0
        item.field.keyframe_insert("strength", frame=5)
        item.field.strength = 2.0
        item.field.keyframe_insert("strength", frame=6)
        play(5)
        self.assertLess(numpy.abs(shown(obj)[:, 2]).max(), 1e-9)
        play(10, first=6)
        self.assertGreater(shown(obj)[-1, 2], 1e-3)
        item.hide_viewport = True
        play(10)
        self.assertLess(numpy.abs(shown(obj)[:, 2]).max(), 1e-9)

    def particles(self, field, points):
        """What Blender's own particles feel: the velocity that a step gives them, over that of a plain force of 1."""
        mesh = bpy.data.meshes.new("cloud")
        mesh.from_pydata(points, [], [])
        cloud = bpy.data.objects.new("cloud", mesh)
        bpy.context.scene.collection.objects.link(cloud)
        cloud.modifiers.new("dust", "PARTICLE_SYSTEM")
        dust = cloud.particle_systems[0].settings
        for name, value in (("count", len(points)), ("frame_start", 1), ("frame_end", 1), ("emit_from", "VERT"), ("use_emit_random", False),
                            ("normal_factor", 0), ("mass", 1), ("integrator", "EULER"), ("subframes", 0), ("use_modifier_stack", False)):
            setattr(dust, name, value)
        dust.effector_weights.gravity = 0
        for frame in (1, 2):
            bpy.context.scene.frame_set(frame)
        found = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get()).particle_systems[0].particles
        return numpy.array([tuple(particle.velocity) for particle in found])

    def test_harmonic_and_turbulent_fields_push_as_they_push_blenders_own_particles(self):
        points = [(0.5, 0.2, 0.1), (1.3, -0.4, 0.9), (-0.7, 1.1, 0.35), (2.2, 0.1, -1.4)]
        where = numpy.array(points)
        one = add_field("FORCE", 1.0, (0.1, -0.2, 0.3))
        away = where - numpy.array((0.1, -0.2, 0.3))
        unit = (self.particles(one, points)[:, 0] / (away / numpy.linalg.norm(away, axis=1, keepdims=True))[:, 0]).mean()
        for kind, settings in (("HARMONIC", {}), ("HARMONIC", {"rest_length": 0.8}), ("HARMONIC", {"shape": "PLANE", "falloff_power": 1.0}),
                               ("TURBULENCE", {"size": 0.5}), ("TURBULENCE", {"size": 0.7, "use_global_coords": True}), ("TURBULENCE", {"size": 0.0})):
            scenes.empty_file()
            item = add_field(kind, 2.0, (0.1, -0.2, 0.3), noise=0.0, **settings)
            item.rotation_euler = (0.3, 0.2, 0.0)
            bpy.context.view_layer.update()
            ours = part("fields").at([part("fields").read_one(item, 1.0, 1.0)], where)[1]
            theirs = self.particles(item, points) / unit
            self.assertGreater(numpy.abs(theirs).max(), 0.05, (kind, settings))
            self.assertLess(numpy.abs(ours - theirs).max(), 1e-4, (kind, settings))   # single precision, and a step's way

    def test_fields_that_do_not_act_are_named_in_the_panel(self):
        obj = add_strip()
        add_field("DRAG", 1.0)
        add_field("WIND", 1.0)
        layout = Layout()
        part("panel").SHELLWARP_PT_shell.draw(types.SimpleNamespace(layout=layout), types.SimpleNamespace(
            object=obj, scene=self.scene, view_layer=bpy.context.view_layer))
        self.assertIn("Fields that do not act on shells: drag", layout.labels)


class Units(Case):
    def test_a_sheet_falls_in_wind_and_fields_alike_in_metres_and_in_centimetres(self):
        found = []
        for length in (1.0, 0.01):
            self.scene = scenes.empty_file()
            self.scene.unit_settings.scale_length = length
            self.scene.gravity = (0, 0, -9.8 / length)
            obj = add_strip()
            obj.scale = (1 / length,) * 3
            s = obj.shellwarp
            s.material, s.young, s.poisson, s.thickness, s.volume_density = "SHEET", 3e9, 0.29, 4e-4, 750
            s.wind, s.air_density = (0, 2.0 / length, 0), 1.2
            add_field("WIND", 2.0)
            add_field("FORCE", 1.0, (0.15 / length, 0, -1 / length))
            play(12)
            self.assertEqual(self.message(obj), "")
            found.append(shown(obj))
        self.assertGreater(numpy.abs(found[0] - part("inputs").rest_positions(obj.data)).max(), 0.01)
        # frequencies come from float32 coordinates
        self.assertLess(numpy.abs(found[0] - found[1]).max(), 1e-4)


if __name__ == "__main__":
    unittest.main()
