"""Claims about supports by axis and ties, in Blender itself; run by ctest as `blender`."""

import unittest

import bpy
import numpy
import scene as scenes
from scene import add_strip, play, shown
from test_addon import part, setUpModule, tearDownModule  # noqa: F401 - unittest calls them
from test_contact import Case

END = list(range(120, 124))  # the strip's far row


def group(obj, name, vertices):
    obj.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    return name


class Axes(Case):
    def test_a_group_by_axis_holds_along_that_alone_in_the_objects_axes(self):
        """The strip's end is on a rail along its own x and y, of an object that is tilted."""
        for angle in (0.0, 0.5):
            self.setUp()
            obj = add_strip()
            obj.rotation_euler.x = angle
            obj.shellwarp.modes = 24
            play(20)
            self.assertGreater(numpy.abs(shown(obj)[END, 2]).max(), 1e-2)
            obj.shellwarp.fixed_z_group = group(obj, "rail", END)
            self.scene.frame_set(19)
            self.assertIn("the group “rail” (held along z) is another", self.message(obj))
            play(20)
            self.assertEqual(self.message(obj), "")
            self.assertLess(numpy.abs(shown(obj)[END, 2]).max(), 1e-6)
            self.assertGreater(numpy.abs(shown(obj)[60, 2]), 1e-5)

    def test_axes_add_up_and_their_model_is_the_librarys(self):
        obj = add_strip()
        obj.shellwarp.fixed_y_group, obj.shellwarp.fixed_z_group = group(obj, "y", END[:2]), group(obj, "z", END)
        shell = part("inputs").read_shell(obj, bpy.context.evaluated_depsgraph_get())[0]
        self.assertEqual(shell.axes, {120: "yz", 121: "yz", 122: "z", 123: "z"})

    def test_what_supports_leave_free_is_known(self):
        rest = numpy.array([(x, y, 0.0) for x in range(4) for y in range(4)])
        free = part("inputs").moves_freely
        for fixed, axes, expected in (([], {}, True), ([0], {}, True), ([0, 1, 2, 3], {}, True), ([0, 1, 4], {}, False),
                                      ([], dict.fromkeys(range(16), "z"), True), ([], {0: "xyz", 3: "xz", 12: "z"}, False),
                                      ([0], {3: "xz", 12: "z"}, False), ([0], {3: "z", 12: "z"}, True)):
            self.assertEqual(free(rest, fixed, [], axes), expected, (fixed, axes))
        self.assertFalse(free(rest, [], [0, 1], {}))
        # A row on a plane of symmetry slides along that and turns about its normal, until two of its ends are held.
        plane = dict.fromkeys(range(4), "x")
        for axes, expected in (({}, True), ({0: "yz"}, True), ({0: "yz", 12: "z"}, True), ({0: "yz", 3: "z"}, False)):
            self.assertEqual(free(rest, [], [], axes, plane), expected, axes)

    def test_groups_on_planes_of_symmetry_hold_the_slope(self):
        obj = add_strip()
        obj.shellwarp.fixed_x_group = group(obj, "middle", END)
        obj.shellwarp.modes = 24

        def rise():
            play(12)
            self.assertEqual(self.message(obj), "")
            return abs(shown(obj)[120, 2] - shown(obj)[116, 2])
        turned = rise()
        obj.shellwarp.symmetric_axes[0] = True
        shell = part("inputs").read_shell(obj, bpy.context.evaluated_depsgraph_get())[0]
        self.assertEqual((shell.axes, shell.symmetric), ({}, dict.fromkeys(END, "x")))
        self.assertLess(rise(), 0.1 * turned)


class Ties(Case):
    def two_strips(self, loose):
        """A second strip begins above the end of the first, 1 mm off; loose edges join rows 28 and 29 to its first two."""
        obj = add_strip()
        points = [tuple(v.co) for v in obj.data.vertices]
        faces = [list(face.vertices) for face in obj.data.polygons]
        more = [(x + 0.28, y, 0.001) for x, y, _ in points]
        edges = [(112 + k, scenes.N + k) for k in range(8)] if loose else []
        obj.data.clear_geometry()
        obj.data.from_pydata(points + more, edges, faces + [[v + scenes.N for v in face] for face in faces])
        group(obj, "held", list(range(8)))
        obj.shellwarp.modes, obj.shellwarp.k_bend = 16, 0.1
        return obj

    def gap(self, obj):
        points = shown(obj)
        return numpy.abs(numpy.linalg.norm(points[scenes.N:scenes.N + 8] - points[112:120], axis=1) - 0.001).max()

    def test_loose_edges_hold_pieces_together(self):
        obj = self.two_strips(loose=True)
        obj.shellwarp.tie_edges = True
        play(20)
        self.assertEqual(self.message(obj), "")
        self.assertLess(self.gap(obj), 3e-4)  # of 1 mm: the warp turns both ends by turns of their own
        stiff = shown(obj)
        obj.shellwarp.tie_edges = False
        play(20)
        self.assertGreater(self.gap(obj), 0.1)  # it falls for 19 frames
        obj.shellwarp.tie_edges, obj.shellwarp.tie_stiffness = True, 2.0
        play(20)
        self.assertGreater(self.gap(obj), 1e-3)
        self.assertGreater(numpy.abs(shown(obj) - stiff).max(), 1e-3)

    def test_pieces_that_are_near_are_tied(self):
        obj = self.two_strips(loose=False)
        obj.scale = (2, 2, 2)
        obj.shellwarp.tie_within = 0.003  # in the world, where they are 2 mm apart
        play(20)
        self.assertEqual(self.message(obj), "")
        self.assertLess(self.gap(obj), 3e-4)
        obj.shellwarp.tie_within = 0.001
        play(20)
        self.assertGreater(self.gap(obj), 0.05)

    def test_without_loose_edges_it_is_said(self):
        obj = self.two_strips(loose=False)
        obj.shellwarp.tie_edges = True
        play(2)
        self.assertIn("loose edges are to be ties, and the mesh has none", self.message(obj))


if __name__ == "__main__":
    unittest.main()
