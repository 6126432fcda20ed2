"""Tests of the quick pictures: python -m unittest test_raster (numpy and Pillow)"""

import unittest

import numpy as np

from raster import FINER, View, covered, draw

SQUARE = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]), np.array([[0, 1, 2], [0, 2, 3]])
RED, BLUE = (220, 40, 40), (40, 40, 220)


class Raster(unittest.TestCase):
    def setUp(self):
        self.view = View([-1, -1, -1], [1, 1, 1], (96, 80), azimuth=20, elevation=60)

    def test_covered_pixels_are_the_area_of_the_triangles(self):
        points, triangles = SQUARE
        screen = self.view.project(points)
        pixels = np.concatenate([p for p, _, _ in covered(self.view, screen, triangles)])
        x, y = screen[:, 0], screen[:, 1]
        area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
        rim = 4 * FINER * 96                      # a pixel along each edge may fall in or out
        self.assertLess(abs(len(set(pixels)) - area), 0.5 * rim)
        self.assertGreater(area, 2 * rim)

    def test_the_box_is_in_the_picture(self):
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        screen = self.view.project(corners)
        self.assertTrue((screen[:, :2] > 0).all() and (screen[:, 0] < self.view.width).all() and (screen[:, 1] < self.view.height).all())

    def test_the_nearer_shape_hides_the_other_whatever_the_order(self):
        points, triangles = SQUARE
        near, far = (points + [0, 0.5, 0], triangles, RED), (points - [0, 0.5, 0], triangles, BLUE)
        pictures = [np.asarray(draw(self.view, shapes, -1.0)) for shapes in ([near, far], [far, near])]
        self.assertTrue((pictures[0] == pictures[1]).all())
        x, y, _ = self.view.project(np.array([[0, 0.5, 0]]))[0] / FINER
        r, _, b = pictures[0][int(y), int(x)]
        self.assertGreater(int(r), int(b) + 50)

    def test_both_sides_are_lit_and_a_shadow_falls(self):
        points, triangles = SQUARE
        turned = np.asarray(draw(self.view, [(points, triangles[:, ::-1], RED)], -1.0))
        picture = np.asarray(draw(self.view, [(points, triangles, RED)], -1.0))
        self.assertTrue((picture == turned).all())
        empty = np.asarray(draw(self.view, [(points * 1e-3, triangles, RED)], -1.0)).astype(int)
        grey = abs(picture[..., 0].astype(int) - picture[..., 2]) < 20     # the ground alone
        self.assertGreater((empty - picture)[grey].max(), 20)


if __name__ == "__main__":
    unittest.main()
