"""Tests of the still renderer: python -m unittest discover host_examples/render"""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

import curves
import demo
import figure
import meshes
import paint
import render

TENT = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv .5 .6 .5\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n"


class WithFiles(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def file(self, text, name="mesh.obj"):
        path = self.folder / name
        path.write_text(text)
        return str(path)

    def run_main(self, *argv):
        """Exit code, standard output and standard error of one command line."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = render.main([str(word) for word in argv])
        return code, out.getvalue(), err.getvalue()


class ReadingObj(WithFiles):
    def triangles(self, text):
        return meshes.read_obj(self.file(text))[1].tolist()

    def test_every_corner_form_names_the_same_triangle(self):
        points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
        for face in ("f 1 2 3", "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/1/1 3/1/1", "f -3 -2 -1", "f\t1  2 3 "):
            self.assertEqual(self.triangles(points + face + "\n"), [[0, 1, 2]], face)

    def test_a_negative_index_counts_from_the_vertices_read_so_far(self):
        text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -3 -1\n"
        self.assertEqual(self.triangles(text), [[0, 1, 2], [0, 1, 3]])

    def test_a_polygon_becomes_a_fan(self):
        text = "".join(f"v {k} {k * k} 0\n" for k in range(5)) + "f 1 2 3 4 5\n"
        self.assertEqual(self.triangles(text), [[0, 1, 2], [0, 2, 3], [0, 3, 4]])

    def test_comments_groups_vertex_colours_and_windows_line_ends_are_accepted(self):
        text = "# a\r\no part\r\nv 0 0 0 1 1 1\r\nv 1 0 0 .5 .5 .5\r\nv 0 1 0 0 0 0\r\ns off\r\ng\r\nf 1 2 3\r\n"
        vertices, triangles = meshes.read_obj(self.file(text))
        self.assertEqual(vertices.tolist(), [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        self.assertEqual(triangles.tolist(), [[0, 1, 2]])

    def test_a_broken_file_is_named_with_its_line(self):
        points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        for text, message in (
                ("", "no vertices"), (points, "no faces"), ("v 0 0\n" + points + "f 1 2 3\n", ":1: vertex 1 needs three"),
                (points + "v 0 x 0\nf 1 2 3\n", ":4: vertex 4 needs three"), (points + "v 0 nan 0\nf 1 2 3\n", "finite"),
                (points + "f 1 2\n", ":4: a face needs three corners"), (points + "f 1 2 4\n", "outside 1..3"),
                (points + "f 0 1 2\n", "outside 1..3"), (points + "f -4 1 2\n", "outside 1..3"),
                (points + "f 1 b 2\n", ":4: cannot read the face")):
            with self.assertRaises(meshes.RenderError, msg=text) as caught:
                meshes.read_obj(self.file(text))
            self.assertIn(message, str(caught.exception))
            self.assertIn("mesh.obj", str(caught.exception))


class CommandLine(WithFiles):
    def assert_refused(self, message, *argv):
        code, _, err = self.run_main("--out", self.folder / "x.png", *argv)
        self.assertEqual(code, 2)
        self.assertIn(message, err)
        self.assertFalse((self.folder / "x.png").exists())

    def test_what_cannot_be_drawn_is_refused_with_a_message(self):
        mesh = self.file(TENT)
        self.assert_refused("cannot read", self.folder / "missing.obj")
        self.assert_refused("at least one file")
        self.assert_refused("2 colours for 1 meshes", "--colors", "red", "blue", mesh)
        self.assert_refused("unknown colour 'plaid'", "--colors", "plaid", mesh)
        self.assert_refused("x y z radius", "--spheres", "1", "2", "3", mesh)
        self.assert_refused("has 3 vertices", "--displacement",
                            self.file("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "rest.obj"), mesh)
        self.assert_refused("5 finite numbers", "--values", self.file("1 2 3", "values.txt"), mesh)

    def test_a_contact_sheet_needs_a_label_for_each_picture(self):
        Image.new("RGB", (8, 6)).save(self.folder / "a.png")
        self.assert_refused("1 labels for 2 pictures", "--contact-sheet", "--labels", "a",
                            self.folder / "a.png", self.folder / "a.png")


class Shading(unittest.TestCase):
    def test_a_shallow_fold_is_smooth_and_a_sharp_one_is_an_edge(self):
        triangles = np.array([[0, 1, 2], [1, 0, 3]])
        for height, smooth in ((0.2, True), (2.0, False)):
            vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, -height, -1], [0.5, -height, 1.0]])
            normals = meshes.corner_normals(vertices, triangles)
            self.assertEqual(np.allclose(normals[0, 0], normals[1, 1]), smooth)
            np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)

    def test_the_camera_keeps_every_point_inside_the_picture(self):
        points = np.random.default_rng(3).normal(size=(200, 3)) * [5, 1, 2] + [7, -3, 1]
        camera = render.Camera(points, 35, 18, 4 / 3)
        seen = points - camera.eye
        depth = -seen @ camera.back * np.tan(np.radians(render.FIELD_OF_VIEW / 2))
        extent = [np.abs(seen @ camera.right / depth / (4 / 3)).max(), np.abs(seen @ camera.above / depth).max()]
        self.assertAlmostEqual(max(extent) * render.MARGIN, 1.0, places=9)

    def test_the_noise_filter_keeps_an_edge_of_albedo_and_smooths_either_side(self):
        rng = np.random.default_rng(1)
        features = np.zeros((32, 32, 6))
        features[:, 16:, :3] = 0.6
        clean = np.repeat(np.where(np.arange(32) < 16, 0.2, 0.8)[None, :, None], 32, axis=0) * np.ones((32, 32, 3))
        result = render.denoise(clean + 0.05 * rng.normal(size=clean.shape), features)
        self.assertLess(np.abs(result - clean).std(), 0.01)


class Pictures(WithFiles):
    def draw(self, *argv):
        out = self.folder / "still.png"
        code, printed, err = self.run_main("--out", out, "--size", 64, 48, "--samples", 2, *argv)
        self.assertEqual((code, err), (0, ""))
        self.assertIn("wrote", printed)
        return np.asarray(Image.open(out)).astype(int), printed

    def test_a_still_shows_the_mesh_on_a_light_ground(self):
        picture, _ = self.draw("--colors", "red", self.file(TENT))
        self.assertEqual(picture.shape, (48, 64, 3))
        red = (picture[..., 0] > picture[..., 1] + 60).mean()
        self.assertGreater(red, 0.05)
        self.assertGreater(picture[2, 32].min(), 180)

    def test_displacement_is_measured_and_coloured(self):
        moved = self.file(TENT.replace("v .5 .6 .5", "v .5 .9 .5"), "moved.obj")
        picture, printed = self.draw("--displacement", self.file(TENT), moved)
        self.assertIn("largest displacement 0.3 at vertex 4, counted from 0", printed)
        self.assertGreater((picture[..., 1] > picture[..., 2] + 40).sum(), 5, "the moved tip is green or yellow")

    def test_a_mesh_far_from_the_origin_and_very_small_looks_the_same(self):
        picture, _ = self.draw("--colors", "red", self.file(TENT))
        far = TENT.splitlines()
        for k, line in enumerate(far[:5]):
            far[k] = "v " + " ".join(f"{1000 + 1e-4 * float(x):.9f}" for x in line.split()[1:])
        same, _ = self.draw("--colors", "red", self.file("\n".join(far), "far.obj"))
        self.assertLess(np.abs(picture - same).mean(), 1.0)

    def test_overlays_titles_and_several_meshes_with_z_up_share_a_picture(self):
        mesh = self.file(TENT)
        picture, _ = self.draw("--up", "z", "--title", "tent", "--axes", 0, 0, 0, "--spheres", "0", "0", "1", ".2",
                               "--frame-on", mesh, "--colors", "red", "blue", mesh, mesh)
        self.assertGreater(picture.std(), 5)

    def test_meshes_apart_do_not_hide_each_other(self):
        mesh, hidden = self.file(TENT), self.file(TENT, "same.obj")
        apart, _ = self.draw("--colors", "red", "blue", "--apart", 1.5, 0, 0, mesh, hidden)
        for near, far in ((0, 2), (2, 0)):
            self.assertGreater((apart[..., near] > apart[..., far] + 60).mean(), 0.02)

    def test_axes_may_be_turned(self):
        mesh = self.file(TENT)
        turned = ["--axes", 0, 0, 1, "0", "1", "0", "-1.000000", "0", "0", "0", "0", "1"]
        picture, _ = self.draw("--samples", 1, *turned, mesh)
        plain, _ = self.draw("--samples", 1, "--axes", 0, 0, 1, mesh)
        self.assertGreater(np.abs(picture - plain).max(), 50)

    def test_several_axes_are_several_points_with_directions(self):
        mesh = self.file(TENT)
        row = [0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1]
        one, _ = self.draw("--samples", 1, "--frame-on", mesh, "--axes", *row, "--axes-length", 0.1, mesh)
        two, _ = self.draw("--samples", 1, "--frame-on", mesh, "--axes", *row, 1, *row[1:], "--axes-length", 0.1, mesh)
        self.assertGreater(np.abs(two - one).max(), 50)

    def test_axes_of_another_length_are_refused(self):
        code, _, printed = self.run_main("--out", self.folder / "x.png", "--axes", 0, 0, 1, 1, self.file(TENT))
        self.assertEqual(code, 2)
        self.assertIn("--axes takes", printed)

    def test_a_contact_sheet_holds_every_picture(self):
        for name, shade in (("a.png", "red"), ("b.png", "blue")):
            Image.new("RGB", (64, 48), shade).save(self.folder / name)
        out = self.folder / "sheet.png"
        code, _, _ = self.run_main("--out", out, "--contact-sheet", self.folder / "a.png", self.folder / "b.png")
        self.assertEqual(code, 0)
        seen = {tuple(pixel) for pixel in np.asarray(Image.open(out)).reshape(-1, 3)}
        self.assertLessEqual({(255, 0, 0), (0, 0, 255), (255, 255, 255)}, seen)


class Figure(WithFiles):
    def test_solids_are_closed_and_face_outwards(self):
        for start, end, radii in (((0, 0, 0), (0, 0, 0), (1, 2, 3)), ((1, 0, 0), (4, 4, 0), (2, 2, 2))):
            points, triangles = figure.solid_mesh(np.array(start, float), np.array(end, float), np.array(radii, float))
            place = np.unique(np.round(points, 9), axis=0, return_inverse=True)[1].ravel()   # a pole is many points
            edges = {(int(place[t[k]]), int(place[t[(k + 1) % 3]])) for t in triangles for k in range(3)}
            self.assertEqual(edges, {edge[::-1] for edge in edges})
            a, b, c = (points[triangles[:, k]] for k in range(3))
            volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
            length = np.linalg.norm(np.subtract(end, start))
            expected = 4 / 3 * np.pi * np.prod(radii) + np.pi * radii[0] * radii[2] * length
            self.assertAlmostEqual(volume / expected, 1, delta=0.04)   # a polyhedron of 24 x 12 faces lies inside

    def test_the_body_goes_where_its_bones_go(self):
        head = "frame,time,bone,parent,x,y,z,xx,xy,xz,yx,yy,yz,zx,zy,zz\n"
        names = sorted({solid[0] for solid in figure.SOLIDS})
        rows = [f"0,0,{name},,1,2,3,1,0,0,0,1,0,0,0,1\n6,0.1,{name},,1,2,13,0,1,0,-1,0,0,0,0,1\n" for name in names]
        table = self.file(head + "".join(rows), "bones.csv")
        rest, moved = (figure.write_body(figure.read_bones(table, frame), self.folder / f"body_{frame}") for frame in (0, 6))
        for (a, color), (b, _) in zip(rest, moved):
            x, y = meshes.read_obj(a)[0] - [1, 2, 3], meshes.read_obj(b)[0] - [1, 2, 13]
            # A quarter turn about z through the joint, which rises by 10; the files hold five decimals.
            self.assertLess(np.abs(y - np.stack([-x[:, 1], x[:, 0], x[:, 2]], axis=1)).max(), 2e-5, color)


class Curves(WithFiles):
    HEAD = "bending,gravity,method,error,area_change,residual,turn_in_range,max_displacement,obj\n"
    ROWS = ("1,1,shell-implicit,0,1e-6,1e-9,1,.2,a.obj\n1,1,lma,.02,.01,1e-9,1,.2,b.obj\n1,1,warp,,,,,,\n"
            "1,2,shell-implicit,0,2e-6,1e-9,1,.4,c.obj\n1,2,lma,.05,.03,1e-9,0,.4,d.obj\n10,1,lma,9,9,1e-9,1,.1,e.obj\n")

    def test_the_rows_drawn_are_the_equilibria_of_the_first_stiffness(self):
        table = curves.read_table(self.file(self.HEAD + self.ROWS, "t.csv"))
        self.assertEqual(table["lma"], [(1, .02, .01), (2, .05, .03)])
        self.assertEqual(table["shell-implicit"], [(1, 0, 1e-6), (2, 0, 2e-6)])
        self.assertNotIn("warp", table, "there is no equilibrium of it")

    def test_every_method_has_a_curve_a_name_and_units(self):
        figure = curves.draw(curves.read_table(self.file(self.HEAD + self.ROWS, "t.csv")), "beam")
        errors, areas = figure.axes
        self.assertEqual([line.get_label() for line in areas.lines], ["shell-implicit", "lma"], "by their names, the full shell first")
        self.assertEqual(len(errors.lines), 1, "the full shell has no error")
        np.testing.assert_allclose(errors.lines[0].get_ydata(), [2, 5], err_msg="per cent")
        for axes in (errors, areas):
            self.assertIn("s\u00b2", axes.get_xlabel())
            self.assertIn("%", axes.get_ylabel())
            self.assertIsNotNone(axes.get_legend())

    def test_a_table_of_something_else_is_refused_and_a_good_one_drawn(self):
        for text in ("", "a,b\n1,2\n", self.HEAD + "1,1,lma,much,.1,0,1,1,x.obj\n"):
            with contextlib.redirect_stderr(io.StringIO()) as err:
                self.assertEqual(curves.main([self.file(text, "bad.csv"), "--out", str(self.folder / "x.png")]), 2)
            self.assertIn("bad.csv", err.getvalue())
        out = self.folder / "curves.svg"
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(curves.main([self.file(self.HEAD + self.ROWS, "t.csv"), "--out", str(out)]), 0)
        self.assertIn("<svg", out.read_text())


class Demo(WithFiles):
    def test_methods_have_the_same_colour_in_stills_and_curves_whatever_they_are_called(self):
        folder = self.folder
        self.file(Curves.HEAD + "1,1,first,0,0,0,1,.2,a.obj\n1,1,second,.1,0,0,1,.2,b.obj\n1,2,second,.1,0,0,1,.2,\n", "beam_comparison.csv")
        rows, colors = demo.shapes_of(folder, "beam")
        self.assertEqual([row["obj"] for row in rows], ["a.obj", "b.obj"])
        figure = curves.draw(curves.read_table(folder / "beam_comparison.csv"), "beam")
        self.assertEqual({line.get_label(): line.get_color() for line in figure.axes[1].lines},
                         {name: paint.COLORS[color] for name, color in colors.items()})

    def test_the_frames_to_draw_are_those_the_table_names_a_mesh_for(self):
        rows = "frame,time,max_displacement,obj,displacement\n0,0,0,,\n7,.25,1.5,tent_7.obj,tent_7.txt\n"
        self.file(rows, "tent_frames.csv")
        rest, frames = demo.written_frames(self.folder)
        self.assertEqual(rest, self.folder / "tent_rest.obj")
        self.assertEqual([(row["frame"], row["obj"]) for row in frames], [("7", "tent_7.obj")])

    def test_handles_become_spheres_and_one_set_of_axes(self):
        table = self.file("vertex,kind,x,y,z,xx,xy,xz,yx,yy,yz,zx,zy,zz\n"
                          "4,position,1,2,-1e-7,,,,,,,,,\n4,orientation,1,2,3,0,1,0,-1,0,0,0,0,1\n", "tent_handles.csv")
        marks = demo.handle_marks(table)
        self.assertEqual(marks[:5], ["--spheres", "1.000000", "2.000000", "-0.000000", f"{demo.BALL:.6f}"])
        self.assertEqual([float(x) for x in marks[6:]], [1, 2, 3, 0, 1, 0, -1, 0, 0, 0, 0, 1])

    def test_joints_become_a_sphere_for_each_position_and_axes_for_each_orientation(self):
        head = "vertex,kind,x,y,z,xx,xy,xz,yx,yy,yz,zx,zy,zz\n"
        tables = [self.file(head + "4,both,1,2,3,0,1,0,-1,0,0,0,0,1\n5,position,4,5,6,,,,,,,,,\n", "a_handles.csv"),
                  self.file(head + "6,orientation,7,8,9,1,0,0,0,1,0,0,0,1\n", "b_handles.csv")]
        marks = list(map(str, demo.joint_marks(tables)))
        axes = marks.index("--axes")
        balls = [float(x) for x in marks[1:axes]]
        self.assertEqual(balls, [1, 2, 3, demo.JOINT_BALL, 4, 5, 6, demo.JOINT_BALL])
        rows = [float(x) for x in marks[axes + 1:marks.index("--axes-length")]]
        self.assertEqual(rows, [1, 2, 3, 0, 1, 0, -1, 0, 0, 0, 0, 1, 7, 8, 9, 1, 0, 0, 0, 1, 0, 0, 0, 1])

    def test_a_program_that_is_missing_or_fails_is_a_failed_scene(self):
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertIn("cannot run", demo.run_scene(str(self.folder / "missing"), "v_beam", self.folder)[0])
            self.assertFalse(demo.run_scene("false", "v_beam", self.folder)[1])


if __name__ == "__main__":
    unittest.main()
