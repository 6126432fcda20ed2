"""Claims about motion that goes from the command line through Blender to Alembic; run by ctest as `blender`."""

import os
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import bpy
import numpy
import scene as scenes

SCRIPT = Path(__file__).resolve().parents[1] / "usd_to_alembic.py"
PROGRAM = Path(os.environ.get("SHELLWARP_CLI", scenes.ROOT / "build" / "bin" / "shellwarp"))


def frames_of(path):
    """Of a PC2 file: (frames x points x 3)."""
    data = path.read_bytes()
    points, samples = struct.unpack("<i", data[16:20])[0], struct.unpack("<i", data[28:32])[0]
    return numpy.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


class Alembic(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def convert(self, source):
        return subprocess.run([sys.executable, str(SCRIPT), str(source), str(self.folder / "out.abc")], capture_output=True, text=True)

    def test_every_frame_comes_through(self):
        self.assertTrue(PROGRAM.is_file(), f"{PROGRAM}: make cli")
        points = [(0.01 * i, 0.01 * j, 0.0) for i in range(9) for j in range(3)]
        quads = [(3 * i + j + 1, 3 * i + j + 4, 3 * i + j + 5, 3 * i + j + 2) for i in range(8) for j in range(2)]
        (self.folder / "strip.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) + "".join(f"f {a} {b} {c} {d}\n" for a, b, c, d in quads))
        subprocess.run([PROGRAM, "simulate", "strip.obj", "--pin", "low-x", "--up", "z", "--frequency", "4", "--frames", "10", "--no-certify", "--quiet",
                        "--formats", "pc2,usd", "--out", "."], cwd=self.folder, check=True)
        done = self.convert(self.folder / "strip.usda")
        self.assertIn("out.abc: frames 0 to 10", done.stdout, done.stderr)
        expected = frames_of(self.folder / "strip.pc2")
        scenes.empty_file()
        bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 30, 1.0   # the simulation's
        bpy.ops.wm.alembic_import(filepath=str(self.folder / "out.abc"), as_background_job=False)
        mesh = next(item for item in bpy.context.scene.objects if item.type == "MESH")
        self.assertEqual([len(face.vertices) for face in mesh.data.polygons], [4] * 16)
        for frame in (0, 3, 10):
            bpy.context.scene.frame_set(frame)
            found = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
            place = numpy.array(mesh.matrix_world)
            seen = numpy.array([vertex.co[:] for vertex in found]) @ place[:3, :3].T + place[:3, 3]
            self.assertLess(numpy.abs(seen - expected[frame]).max(), 1e-6)   # Alembic has y upward: turned twice, in single precision
        self.assertGreater(numpy.abs(expected[10] - expected[0]).max(), 0.001)

    def test_what_has_no_mesh_is_told(self):
        (self.folder / "over.usda").write_text('#usda 1.0\n(\n    defaultPrim = "a"\n    timeCodesPerSecond = 24\n)\n\nover "a"\n{\n}\n')
        self.assertIn("over.usda has no mesh", self.convert(self.folder / "over.usda").stderr)
        (self.folder / "rate.usda").write_text("#usda 1.0\n")
        self.assertIn("give --fps", self.convert(self.folder / "rate.usda").stderr)
        self.assertIn("there is no such file", self.convert(self.folder / "none.usda").stderr)


if __name__ == "__main__":
    unittest.main()
