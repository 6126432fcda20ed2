"""Every class of mesh goes through the program: it is simulated, as it is or by a proxy, or refused with the place and what to do.

    python mesh_classes_test.py PROGRAM FOLDER
"""

import math
import random
import struct
import subprocess
import sys
import unittest
from pathlib import Path

PROGRAM, OUT = sys.argv.pop(1), Path(sys.argv.pop(1))
COLUMNS, ROWS = 24, 12
REFUSED = 1


def grid(place=lambda x, y: (x, y, 0.0), columns=COLUMNS, rows=ROWS):
    """A sheet of unit length as quads."""
    points = [place(i / columns, 0.5 * j / rows) for i in range(columns + 1) for j in range(rows + 1)]
    at = lambda i, j: i * (rows + 1) + j
    return points, [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(columns) for j in range(rows)]


def arched(x, y):
    return (x, y, 0.2 * x * (1 - x) + 0.3 * (y - 0.25) ** 2)


def joined(*parts):
    points, faces = [], []
    for more, their in parts:
        faces += [[v + len(points) for v in face] for face in their]
        points += more
    return points, faces


def moved(part, by):
    return [tuple(c + d for c, d in zip(x, by)) for x in part[0]], part[1]


def triangles(part):
    return part[0], [[face[0], face[k], face[k + 1]] for face in part[1] for k in range(1, len(face) - 1)]


def torn(part):
    return [part[0][v] for face in part[1] for v in face], [list(range(4 * k, 4 * k + 4)) for k in range(len(part[1]))]


def turned(part, every):
    return part[0], [face[::-1] if k % every == 0 else face for k, face in enumerate(part[1])]


def thick(by):
    """Two sides with a rim of quads."""
    lower, upper = grid(arched), moved(grid(arched), (0, 0, by))
    points, faces = joined(turned(lower, 1), upper)
    n, last = len(lower[0]), ROWS
    at = lambda i, j: i * (ROWS + 1) + j
    rim = [(at(i, 0), at(i + 1, 0)) for i in range(COLUMNS)] + [(at(i + 1, last), at(i, last)) for i in range(COLUMNS)]
    rim += [(at(0, j + 1), at(0, j)) for j in range(ROWS)] + [(at(COLUMNS, j), at(COLUMNS, j + 1)) for j in range(ROWS)]
    return points, faces + [[a, b, b + n, a + n] for a, b in rim]


def concave():
    """Rows of interlocking chevrons: every face is a concave polygon of six corners."""
    points, faces = [], []
    for j in range(ROWS + 1):
        for i in range(2 * COLUMNS + 1):
            points.append((i / (2 * COLUMNS), 0.5 * j / ROWS + (0.03 if i % 2 else 0.0), 0.0))
    at = lambda i, j: j * (2 * COLUMNS + 1) + i
    for j in range(ROWS):
        for i in range(0, 2 * COLUMNS, 2):
            faces.append([at(i, j), at(i + 1, j), at(i + 2, j), at(i + 2, j + 1), at(i + 1, j + 1), at(i, j + 1)])
    return points, faces


def ring(turns, around=60, across=6):
    """A band that closes after so many half turns: one closes with one side."""
    points = []
    for i in range(around):
        a = 2 * math.pi * i / around
        for j in range(across + 1):
            s, t = 0.3 * (j / across - 0.5), turns * a / 2
            r = 1 + s * math.cos(t)
            points.append((r * math.cos(a), r * math.sin(a), s * math.sin(t)))
    faces = []
    for i in range(around):
        for j in range(across):
            here, there = [i * (across + 1) + j, i * (across + 1) + j + 1], [(i + 1) % around * (across + 1) + j, (i + 1) % around * (across + 1) + j + 1]
            if i == around - 1 and turns % 2:
                there = [across - j, across - j - 1]
            faces.append([here[0], there[0], there[1], here[1]])
    return points, faces


def fin():
    """Two sheets across each other with a row of edges in common, of four faces each."""
    points, faces = grid()
    middle = {k * (ROWS + 1) + ROWS // 2: k for k in range(COLUMNS + 1)}
    upright, their = moved(grid(lambda x, y: (x, 0.25, y)), (0, 0, 0))
    number = {k * (ROWS + 1): v for v, k in middle.items()}
    new = {}
    for v, x in enumerate(upright):
        new[v] = number[v] if v in number else len(points)
        if v not in number:
            points.append(x)
    return points, faces + [[new[v] for v in face] for face in their]


def hourglass():
    left, right = triangles(grid()), triangles(moved(grid(), (1, 0.5, 0)))
    points, faces = joined(left, right)
    corner, other = len(left[0]) - 1, len(left[0])
    assert points[corner] == points[other]
    return points, [[corner if v == other else v for v in face] for face in faces]


def collapsed():
    """Triangles without area between the columns of a sheet, as poles and seams of modellers leave them."""
    points, faces = triangles(grid(arched))
    return points + [points[40]], faces + [[40, len(points), 53], [40, 53, 53]]


def pieces(count):
    random.seed(4)
    parts = []
    for k in range(count):
        patch = grid(lambda x, y: (0.6 * x, 0.6 * y, 0.0), 2, 2)
        parts.append(moved(patch, (k % 50, k // 50, random.random())))
    return joined(*parts)


def write(name, part):
    path = OUT / f"{name}.obj"
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in part[0]]
    path.write_text("\n".join(lines + ["f " + " ".join(str(v + 1) for v in face) for face in part[1]]) + "\n")
    return path


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)


def last_frame(path):
    data = path.read_bytes()
    points, samples = struct.unpack("<i", data[16:20])[0], struct.unpack("<i", data[28:32])[0]
    numbers = struct.unpack(f"<{3 * points * samples}f", data[32:])
    frame = lambda s: [numbers[3 * (s * points + i):3 * (s * points + i) + 3] for i in range(points)]
    return frame(0), frame(samples - 1)


# What is simulated as it is, in place of which a proxy is simulated, and what neither takes: words of the refusal.
WHOLE = {
    "triangles": triangles(grid(arched)),
    "quads": grid(arched),
    "concave": concave(),
    "turned_at_random": turned(triangles(grid(arched)), 3),
    "two_sides_apart": joined(grid(arched), turned(moved(grid(arched), (0, 0, 0.004)), 1)),
    "thick": thick(0.004),
    "ring": ring(0),
    "loose_quads": torn(grid(arched)),
    "two_thousand_pieces": pieces(2000),
}
BY_PROXY = {
    "quads": WHOLE["quads"],
    "concave": WHOLE["concave"],
    "turned_at_random": WHOLE["turned_at_random"],
    "two_sides": joined(grid(arched), turned(grid(arched), 1)),
    "two_sides_apart": WHOLE["two_sides_apart"],
    "thick": WHOLE["thick"],
    "loose_quads": WHOLE["loose_quads"],
    "collapsed": collapsed(),
    "repeated": joined(grid(arched), grid(arched)),
    "ring": WHOLE["ring"],
}
CUT = {
    "one_side": (ring(1), "one side"),
    "fin": (fin(), "triangles meet at the edge"),
    "hourglass": (hourglass(), "touch in a point"),
}


class Classes(unittest.TestCase):
    def simulated(self, path, *options):
        """It moves, and all of it is at numbers; of the file's own vertices where they follow."""
        out = OUT / "out"
        ran = run("simulate", path, "--pin", "low-x", "--frequency", "3", "--up", "z", "--duration", "0.5", "--no-certify", "--method", "warp", "--modes", "8", "--out", out, *options)
        self.assertEqual(ran.returncode, 0, f"{path.name} {options}: {ran.stdout} {ran.stderr}")
        follows = out / f"{path.stem}_render.pc2"
        rest, frame = last_frame(follows if options else out / f"{path.stem}.pc2")
        n = sum(line.startswith("v ") for line in path.read_text().splitlines())
        self.assertEqual(len(rest), n, path.name)
        apart = [math.dist(a, b) for a, b in zip(rest, frame)]
        self.assertTrue(all(math.isfinite(d) for d in apart), path.name)
        self.assertGreater(max(apart), 1e-3, path.name)
        self.assertLess(max(apart), 2.0, path.name)  # sizes: a swing at 3 Hz sags by 0.04

    def test_meshes_that_shells_are_made_of_are_simulated(self):
        for name, part in WHOLE.items():
            with self.subTest(name):
                path = write(name, part)
                checked = run("check", path)
                self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
                if name == "loose_quads":
                    self.simulated(path, "--weld", "1e-6")
                elif name != "two_thousand_pieces":  # most of these hang by nothing
                    self.simulated(path)

    def test_thousands_of_pieces_are_simulated(self):
        path = write("pieces", WHOLE["two_thousand_pieces"])
        pins = ",".join(str(9 * k + v) for k in range(2000) for v in (0, 1, 2))
        ran = run("simulate", path, "--pin", pins, "--frequency", "3", "--up", "z", "--duration", "0.2", "--no-certify", "--method", "warp", "--modes", "8", "--out", OUT / "out")
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        rest, frame = last_frame(OUT / "out" / "pieces.pc2")
        self.assertEqual(len(rest), 18000)
        self.assertTrue(all(math.isfinite(c) for x in frame for c in x))

    def test_a_proxy_stands_for_every_class(self):
        for name, part in BY_PROXY.items():
            with self.subTest(name):
                self.simulated(write(name, part), "--proxy", "150")

    def test_what_is_no_manifold_is_refused_with_the_place_and_cut_on_request(self):
        for name, (part, words) in CUT.items():
            with self.subTest(name):
                path = write(name, part)
                for command in (("check", path), ("simulate", path, "--pin", "low-x", "--frequency", "3", "--up", "z")):
                    ran = run(*command)
                    told = ran.stdout + ran.stderr
                    self.assertEqual(ran.returncode, REFUSED, told)
                    self.assertRegex(told, "(vertex|vertices|edge) .*[0-9]")
                    self.assertIn("--proxy-cut", told)
                ran = run("proxy", path, "150")
                self.assertEqual(ran.returncode, REFUSED, ran.stdout)
                self.assertIn(words, ran.stderr)
                self.assertRegex(ran.stderr, r"vertex [0-9]+ at \(")
                self.assertIn("let the proxy be cut: --proxy-cut (proxy_cut)", ran.stderr)
                self.simulated(path, "--proxy", "150", "--proxy-cut")

    def test_what_is_no_mesh_is_refused_with_the_place(self):
        lines = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\n"
        for name, faces, words in (("index", "f 1 2 9\n", "face names vertex 9"), ("short", "f 1 2\n", "at least three corners"), ("lines", "f 1 2 4\n", "area"), ("none", "", "")):
            with self.subTest(name):
                path = OUT / f"{name}.obj"
                path.write_text(lines + faces)
                for command in (("check", path), ("proxy", path, "100")):
                    ran = run(*command)
                    told = ran.stdout + ran.stderr
                    self.assertEqual(ran.returncode, REFUSED, told)
                    self.assertIn(words, told)
                    self.assertIn(name, told)


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    unittest.main()
