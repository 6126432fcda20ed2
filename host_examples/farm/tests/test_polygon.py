"""Claims about polygons that are cut into triangles."""

import tempfile
import unittest
from pathlib import Path

import numpy

from shellwarp_farm.mesh_file import read_mesh
from shellwarp_farm.polygon import cut


def as_set(triangles):
    """Without the order of triangles and of their first corners."""
    return {tuple(numpy.roll(t, -int(numpy.argmin(t)))) for t in numpy.asarray(triangles).tolist()}


class Cuts(unittest.TestCase):
    # A square's corners, and a dent: the same shapes as tests/hosts/concave_sheet.hpp.
    square = numpy.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.35, 0.35, 0], [0.45, 0.3, 0]])
    pentagon = [0, 5, 1, 2, 3]

    def test_a_concave_quad_is_cut_inside_whichever_corner_comes_first(self):
        dent = [0, 1, 4, 3]
        for k in range(4):
            self.assertEqual(as_set(cut([dent[k:] + dent[:k]], self.square)), {(0, 1, 4), (0, 4, 3)})

    def test_a_concave_polygon_is_cut_inside_whichever_corner_comes_first(self):
        for k in range(5):
            self.assertEqual(as_set(cut([self.pentagon[k:] + self.pentagon[:k]], self.square)), {(0, 5, 3), (1, 2, 5), (2, 3, 5)})

    def test_a_square_is_cut_from_its_lowest_corner(self):
        for k in range(4):
            face = [0, 1, 2, 3][k:] + [0, 1, 2, 3][:k]
            self.assertEqual(as_set(cut([face], self.square)), {(0, 1, 2), (0, 2, 3)})

    def test_what_has_no_inside_becomes_a_fan(self):
        line = numpy.array([[k, 0.0, 0.0] for k in range(5)])
        self.assertEqual(cut([[0, 1, 2, 3, 4], [0, 1, 2, 3]], line).tolist(),
                         [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2], [0, 2, 3]])

    def test_a_quad_is_cut_alike_alone_and_as_the_end_of_a_polygon(self):
        """Points on the unit circle: ears leave quads, whose diagonal is as a quad's own. Every cut has the polygon's area."""
        for n in (5, 6, 7, 9):
            angle = 2 * numpy.pi * numpy.arange(n) ** 1.1 / n ** 1.1
            points = numpy.stack([numpy.cos(angle), numpy.sin(angle), 0 * angle], axis=1)
            triangles = points[cut([list(range(n))], points)]
            area = numpy.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2] / 2
            shoelace = (points[:, 0] * numpy.roll(points[:, 1], -1) - points[:, 1] * numpy.roll(points[:, 0], -1)).sum() / 2
            self.assertEqual(len(triangles), n - 2)
            self.assertTrue((area > 0).all())
            self.assertAlmostEqual(area.sum(), shoelace, 12)

    def test_a_mesh_of_a_list_is_cut_so(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "dent.obj"
            path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in self.square) + "f 2 5 4 1\nf 2 3 4 5\n")
            self.assertEqual(as_set(read_mesh(path)[1]), {(0, 1, 4), (0, 4, 3), (1, 2, 4), (2, 3, 4)})


if __name__ == "__main__":
    unittest.main()
