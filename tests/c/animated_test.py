"""What files animate in a scene: supports, a rest shape and a collider that deforms; and what few shapes cannot follow, pushed out or given a shape.

    animated_test.py PROGRAM FOLDER
"""

import shutil
import struct
import subprocess
import sys
import unittest
from array import array
from pathlib import Path

PROGRAM, OUT = sys.argv[1], Path(sys.argv[2])
COLUMNS, ROWS, EDGE = 11, 3, 0.125   # of few binary digits: text and floats hold them exactly
N, RATE = COLUMNS * ROWS, 30
STRIP = [(EDGE * i, EDGE * j, 0.0) for i in range(COLUMNS) for j in range(ROWS)]
FACES = [(a, a + ROWS, a + ROWS + 1, a + 1) for a in (ROWS * i + j for i in range(COLUMNS - 1) for j in range(ROWS - 1))]
CUBE_FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def cube(top):
    return [(x, y, z) for z in (-3, top) for x, y in ((-3, -3), (3, -3), (3, 3), (-3, 3))]


def write_obj(name, points, faces):
    lines = [f"v {x} {y} {z}" for x, y, z in points] + ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    (OUT / name).write_text("\n".join(lines) + "\n")


def write_cache(name, samples, first=0):
    numbers = array("f", (c for points in samples for point in points for c in point))
    (OUT / name).write_bytes(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(samples[0]), first, 1, len(samples)) + numbers.tobytes())


def cache(path):
    data = path.read_bytes()
    n, samples = struct.unpack_from("<i", data, 16)[0], struct.unpack_from("<i", data, 28)[0]
    numbers = struct.unpack_from(f"<{3 * n * samples}f", data, 32)
    return [[numbers[3 * (s * n + i):3 * (s * n + i) + 3] for i in range(n)] for s in range(samples)]


def run(name, text):
    (OUT / f"{name}.toml").write_text("mesh = 'strip.obj'\n" + text)
    return subprocess.run([PROGRAM, "run", str(OUT / f"{name}.toml"), "--no-certify", "--out", str(OUT / "out")], capture_output=True, text=True)


def baked(name, text):
    ran = run(name, text)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return cache(OUT / "out" / f"{name}.pc2"), ran.stdout


def furthest(a, b):
    return max(abs(p - q) for x, y in zip(a, b) for p, q in zip(x, y))


def curl(frame):
    """Bent upward along its length, by 0.4 rad in the end."""
    turn = 0.4 * min(frame / 20, 1) / (EDGE * (COLUMNS - 1))
    return [(x, y, round(turn * x * x / 2 * 4096) / 4096) for x, y, _ in STRIP]


HELD = "[[support]]\nvertices = [0, 1, 2, 3, 4, 5]\n[material]\nfrequency = 20\n[damping]\nratio = 0.9\n"


class Animated(unittest.TestCase):
    def test_a_rest_shape_is_led_by_a_cache_or_by_files(self):
        samples = [curl(k) for k in range(21)]
        write_cache("curl.pc2", samples)
        for k, points in enumerate(samples):
            write_obj(f"curl.{k:04}.obj", points, FACES)
        text = "obj_times = [2]\n[simulation]\nduration = 2\nmethod = 'warp'\n" + HELD
        by_cache = baked("by_cache", "motion = 'curl.pc2'\nfollow_rest = true\nformats = ['pc2', 'usd']\n" + text)[0]
        by_files = baked("by_files", "motion = 'curl.####.obj'\nfollow_rest = true\n" + text)[0]
        self.assertEqual(by_cache, by_files)
        self.assertLess(furthest(by_cache[0], samples[0]), 1e-6)
        self.assertLess(furthest(by_cache[-1], samples[-1]), 1e-4)   # it has come to rest there, without loads
        self.assertGreater(by_cache[-1][N - 1][2], 0.2)
        by_full = baked("by_full", "motion = 'curl.pc2'\nfollow_rest = true\n" + text.replace("ratio = 0.9", "mass = 40").replace("'warp'", "'shell-implicit'"))[0]
        self.assertLess(furthest(by_full[-1], samples[-1]), 1e-4)
        self.assertGreater(furthest(by_full[20], by_cache[20]), 0)
        # Files that are written afterwards go back to the frames, whose rest shape is not in their states.
        obj = [tuple(map(float, line.split()[1:])) for line in (OUT / "out" / "by_cache_frame_0060.obj").read_text().splitlines() if line.startswith("v ")]
        self.assertLess(furthest(obj, by_cache[60]), 1e-6)
        away = list(map(float, (OUT / "out" / "by_cache_frame_0060_displacement.txt").read_text().split()))
        self.assertLess(max(away), 1e-4)
        usd = (OUT / "out" / "by_cache.usda").read_text()
        self.assertIn("points.timeSamples", usd)
        self.assertNotIn("velocities", usd)
        middle = usd.split("point3f[] points.timeSamples", 1)[1].split("10: ", 1)[1].split("\n", 1)[0]
        found = [tuple(map(float, part.split(","))) for part in middle.strip(" [],").strip("()").split("), (")]
        self.assertLess(furthest(found, by_cache[10]), 1e-5)

    def test_a_rest_shape_that_sinks_is_held_up_by_a_collider(self):
        """A ball under the free end; it goes down beside it without one."""
        write_cache("sinks.pc2", [[(x, y, z - 0.125 * min(k / 20, 1)) for x, y, z in STRIP] for k in range(21)])
        text = "motion = 'sinks.pc2'\nfollow_rest = true\nobj_times = [2]\n[simulation]\nduration = 2\nmethod = 'warp'\nmodes = 8\n" + HELD.replace("frequency = 20", "frequency = 3")
        ball = "[[collider]]\nkind = 'sphere'\nradius = 0.1\nposition = [1.125, 0.125, -0.1]\n"

        def deepest(frames):
            return max(0.1 - sum((a - b) ** 2 for a, b in zip(point, (1.125, 0.125, -0.1))) ** 0.5 for point in frames[-1])

        alone = baked("sinks", text)[0]
        held, told = baked("sinks_held", text + ball)
        self.assertGreater(deepest(alone), 0.07)
        self.assertLess(deepest(held), 2e-3)   # of the size of 1.3, as rounds of eight modes leave it
        self.assertRegex(told, "touched: ")
        obj = [tuple(map(float, line.split()[1:])) for line in (OUT / "out" / "sinks_held_frame_0060.obj").read_text().splitlines() if line.startswith("v ")]
        self.assertLess(furthest(obj, held[60]), 1e-6)   # of a state that was gone back to

    def test_supports_alone_are_led(self):
        """By the samples at their frames, through a proxy and a weld too; the rest swings behind."""
        samples = [[(x, y, z + 0.25 * min(k / 15, 1)) for x, y, z in STRIP] for k in range(31)]
        write_cache("lift.pc2", samples)
        text = "[simulation]\nduration = 1\nmethod = 'warp'\ngravity = [0, 0, -9.8]\n" + HELD
        text = text.replace("frequency = 20", "frequency = 5")
        found = baked("led", "motion = 'lift.pc2'\n" + text)[0]
        for k in (0, 7, 15, 30):
            self.assertLess(furthest(found[k][:6], samples[k][:6]), 2e-6)   # floats of the cache
        self.assertLess(found[6][N - 1][2], found[6][0][2] - 1e-3)
        baked("led_weld", "weld = 1e-6\nmotion = 'lift.pc2'\n" + text)
        welded = cache(OUT / "out" / "led_weld_render.pc2")
        self.assertLess(furthest(welded[15], found[15]), 1e-5)   # the binding's floats

    def test_a_collider_that_deforms_lifts_what_lies_on_it(self):
        write_obj("cube.obj", cube(-0.25), CUBE_FACES)
        write_cache("rises.pc2", [cube(-0.25 + 0.125 * min(k / 20, 1)) for k in range(21)])
        text = "[simulation]\nduration = 2\ngravity = [0, 0, -9.8]\nmethod = 'warp'\n[damping]\nratio = 0.1\n[[collider]]\nkind = 'deforming'\nmesh = 'cube.obj'\nfriction = 0.4\n"
        last = baked("rises", text + "motion = 'rises.pc2'\n")[0][-1]
        for point in last:
            self.assertAlmostEqual(point[2], -0.125, delta=1e-4)   # a contact's gap: under 1e-4 of the size of 1.3
        # Its upper side alone, which looks up.
        write_obj("ground.obj", cube(-0.25), [face for face in CUBE_FACES if all(cube(-0.25)[v][2] == max(p[2] for p in cube(-0.25)) for v in face)])
        open_text = text.replace("cube.obj", "ground.obj") + "motion = 'rises.pc2'\n"
        for point in baked("open_rises", open_text + "one_sided = true\ndepth = 0.05\n")[0][-1]:
            self.assertAlmostEqual(point[2], -0.125, delta=1e-4)
        self.assertIn("the mesh is open", run("wrong", open_text).stderr)
        self.assertIn("depth goes with one_sided = true", run("wrong", open_text + "depth = 0.05\n").stderr)
        ran = run("wrong", text)
        self.assertIn("a deforming needs motion", ran.stderr)
        ran = run("wrong", text.replace("deforming", "mesh") + "motion = 'rises.pc2'\n")
        self.assertIn("a mesh has no motion", ran.stderr)

    def test_what_few_shapes_cannot_follow_is_pushed_out_or_given_a_shape(self):
        """By a ball from below and one from above, which one arch cannot both follow."""
        balls = "".join(f"[[collider]]\nkind = 'sphere'\nradius = 0.06\nposition = [{x}, 0.125, {-0.1 * s}]\nkey = [{{ time = 0.5, offset = [0, 0, {0.06 * s}] }}]\n" for x, s in ((0.25, 1), (1, -1)))
        text = "[[support]]\nvertices = [0, 1, 2, 30, 31, 32]\n[material]\nfrequency = 20\n[simulation]\nduration = 0.5\nmodes = 1\nmethod = 'warp'\n"

        def deepest(name, lines):
            found, told = baked(name, text + lines + balls)
            ends = ((0.25, 0.125, -0.04), (1, 0.125, 0.04))
            return max(0.06 - sum((a - b) ** 2 for a, b in zip(point, middle)) ** 0.5 for point in found[-1] for middle in ends), told

        plain, _ = deepest("plain", "")
        pushed, told = deepest("pushed", "push_out = true\n")
        patched, _ = deepest("patched", "contact_patches = [7, 25]\n")
        self.assertGreater(plain, 2e-3)
        self.assertLess(pushed, 1e-6)
        self.assertRegex(told, "touched: .*; shown pushed out, .* left")
        baked("pushed_weld", "weld = 1e-6\n" + text + "push_out = true\n" + balls)
        drawn = cache(OUT / "out" / "pushed_weld_render.pc2")[-1]
        ends = ((0.25, 0.125, -0.04), (1, 0.125, 0.04))
        self.assertLess(max(0.06 - sum((a - b) ** 2 for a, b in zip(point, middle)) ** 0.5 for point in drawn for middle in ends), 2e-6)
        self.assertLess(patched, plain / 5)
        near, _ = deepest("near", "contact_patches_near = 0.05\ncontact_patches_most = 4\n")
        self.assertEqual(near, patched)   # the two vertices straight before the balls are so near, and no others

    def test_what_does_not_go_together_is_named(self):
        write_cache("short.pc2", [STRIP[:-1]])
        write_cache("still.pc2", [STRIP])
        for lines, told in (("follow_rest = true\n", "follow_rest goes with motion"),
                            ("motion = 'none.pc2'\n[[support]]\nside = 'low-x'\n", "none.pc2"),
                            ("motion = 'still.pc2'\n", "motion leads supports, and there are none"),
                            ("motion = 'strip.obj'\n", "# in its name for the digits of a frame"),
                            ("motion = 'none.###.obj'\n", "no file has such a name"),
                            ("motion = 'short.pc2'\n[[support]]\nside = 'low-x'\n", "short.pc2: has 32 points, and the mesh 33 vertices"),
                            ("motion = 'still.pc2'\n[[support]]\nside = 'low-x'\nkey = [{ time = 1 }]\n", "none may have a key"),
                            ("motion = 'still.pc2'\n[frame]\n[[support]]\nside = 'low-x'\n", "frame does not go with motion"),
                            ("motion = 'still.pc2'\nfollow_rest = true\n[simulation]\nstatic = true\n", "static finds an equilibrium"),
                            ("[simulation]\npush_out = true\ncorrection_steps = 1\n", "choose one"),
                            ("[simulation]\ncontact_patches = [33]\n[[support]]\nside = 'low-x'\n", "contact_patches names vertex 33; the mesh has 33"),
                            ("[simulation]\ncontact_patches_near = 0.1\n[[support]]\nside = 'low-x'\n", "no vertex that moves is so near to a collider"),
                            ("[simulation]\ncontact_patches_most = 4\n", "goes with contact_patches_near"),
                            ("motion = 'still.pc2'\n[simulation]\ngravity = [0, 0, -1]\n[comparison]\nmethods = ['warp']\ngravities = [1]\n[[support]]\nside = 'low-x'\n",
                             "motion has no part in a [comparison]")):
            with self.subTest(lines):
                ran = run("wrong", lines)
                self.assertEqual(ran.returncode, 1)
                self.assertIn(told, ran.stderr)


if __name__ == "__main__":
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    write_obj("strip.obj", STRIP, FACES)
    unittest.main(argv=sys.argv[:1])
