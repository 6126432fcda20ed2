"""Claims about colliders that deform, contact patches and push-out in jobs: the library's own motion, and named refusals."""

import struct
import unittest

import numpy
import shellwarp
import small
from test_contact import BALL, CUBE, LIST, TOP, Case

from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import hash_of
from shellwarp_farm.model import model_key, model_tables
from shellwarp_farm.simulated import mesh_at

SLAB = '{ kind = "deforming", mesh = "cube.obj", motion = "cube.pc2", friction = 0.3 }'
RISE = 0.03


class Touch(Case):
    def write_motion(self, rise=RISE, name="cube.pc2", count=8):
        """The slab's end at high x rises until frame 10: two samples, of frames 0 and 10."""
        rest = numpy.array([line.split()[1:] for line in CUBE.splitlines() if line[0] == "v"], float)
        bent = rest + [0, 0, 1] * (rest[:, :1] > 0) * rise
        data = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, count, 0.0, 10.0, 2) + numpy.array([rest, bent], "<f4").tobytes()
        (self.folder / name).write_bytes(data)
        return rest, bent

    def test_a_bake_on_a_slab_that_bends_is_the_librarys_motion(self):
        rest, bent = self.write_motion()
        rest, bent = rest.astype(numpy.float32), bent.astype(numpy.float32)
        job = self.jobs(SLAB)["both"]
        record, frames = self.bake(job)
        positions, triangles = mesh_at(job["mesh"])
        with shellwarp.Model(shellwarp.Shell(positions, triangles, shellwarp.Material(5e3, 5e3, 2.7e-3, 0.3), fixed=range(6))) as model:
            model.precompute(modes=6, reduced_fields=0)
            state = model.state("warp")
            state.set_gravity((0, 0, -9.8))
            state.set_damping(0.1)
            state.set_colliders([shellwarp.Collider.deforming(*mesh_at(str(self.folder / "cube.obj")), friction=0.3)])
            for frame in range(21):
                t = min(1.0, frame / 10)
                state.deform_collider(0, (1 - t) * rest.astype(float) + t * bent, teleport=frame == 0)
                if frame:
                    state.step(1 / 30)
                # 1e-7: the formula here and the farm's round their last bits apart
                self.assertLess(numpy.abs(frames[frame] - state.positions()).max(), 1e-7, frame)
        self.assertGreater(record["range"]["contact_count"], 0)
        # The slab's top is straight from -1 to 1: at the card's end it has risen by 0.56 of what its end has.
        self.assertGreater(frames[20][:, 2].max(), 0.5 * RISE - TOP)

    def test_a_shot_goes_on_where_the_one_before_ended(self):
        self.write_motion()
        jobs = self.jobs(SLAB)
        record, first = self.bake(jobs["one"])
        second = self.bake(jobs["two"], record)[1]
        self.assertTrue(numpy.array_equal(numpy.concatenate([first, second]), self.bake(jobs["both"])[1]))

    def test_a_usd_mesh_brings_its_own_motion(self):
        """Its time codes are 24 a second: 8 of them are frame 10 of 30 a second."""
        from pxr import Usd, UsdGeom, Vt
        rest, bent = self.write_motion()
        stage = Usd.Stage.CreateNew(str(self.folder / "slab.usda"))
        stage.SetTimeCodesPerSecond(24)
        mesh = UsdGeom.Mesh.Define(stage, "/slab")
        faces = [line.split()[1:] for line in CUBE.splitlines() if line[0] == "f"]
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(faces)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray([int(v) - 1 for face in faces for v in face]))
        mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(rest.astype(numpy.float32)), 0)
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(bent.astype(numpy.float32)), 8)
        stage.GetRootLayer().Save()
        by_usd = self.bake(self.jobs('{ kind = "deforming", mesh = "slab.usda", friction = 0.3 }')["both"])[1]
        by_pc2 = self.bake(self.jobs(SLAB)["both"])[1]
        self.assertLess(numpy.abs(by_usd - by_pc2).max(), 1e-7)

    def test_what_cannot_deform_is_named_and_another_motion_is_another_job(self):
        self.assertIn("there is no such file", self.failed(self.jobs(SLAB)["one"]))
        self.write_motion()
        job = self.jobs(SLAB)["both"]
        first = hash_of(job, "key", None)
        self.write_motion(rise=2 * RISE)
        self.assertNotEqual(hash_of(job, "key", None), first)
        self.write_motion(count=4)
        self.assertIn("has 4 points, the mesh", self.failed(job))
        (self.folder / "cube.pc2").write_bytes(b"POINT")
        self.assertIn("is no PC2 point cache", self.failed(job))
        self.assertIn("is neither a PC2 file nor a USD file with points that are animated", self.failed(self.jobs('{ kind = "deforming", mesh = "cube.obj" }')["one"]))
        with self.assertRaisesRegex(SceneError, "a plane has no motion"):
            self.jobs('{ kind = "plane", motion = "cube.pc2" }')

    def test_contact_patches_make_another_model_and_let_few_modes_follow(self):
        pins = "".join(f'{{ kind = "sphere", radius = 0.01, position = [{x}, 0.01, {0.016 * side}], '
                       f'key = [{{ time = 0.3, offset = [0, 0, {-0.008 * side}] }}] }},' for x, side in ((0.04, -1), (0.07, 1), (0.1, -1)))
        text = LIST.replace("modes = 6", "modes = 2").replace("gravity = [0, 0, -9.8]", "gravity = [0, 0, 0]")
        without = self.bake(self.jobs(pins, text)["both"])[0]
        patched = text.replace("modes = 2", "modes = 2, contact_patches = [13, 22, 31]")
        job = self.jobs(pins, patched)["both"]
        record = self.bake(job)[0]
        self.assertGreater(without["range"]["deepest_penetration"], 1e-3)
        self.assertLess(record["range"]["deepest_penetration"], 0.1 * without["range"]["deepest_penetration"])
        self.assertNotEqual(record["model"]["key"], without["model"]["key"])
        with self.assertRaisesRegex(SceneError, "contact_patches.* belong to the asset"):
            self.jobs(pins, text.replace("simulation = { gravity", "simulation = { contact_patches = [1], gravity"))
        pushed = self.jobs(pins, text.replace("modes = 2", "modes = 2, push_out = true"))["both"]
        record, frames = self.bake(pushed)
        self.assertEqual(record["range"]["deepest_penetration"], without["range"]["deepest_penetration"], "the motion does not know")
        self.assertEqual(record["range"]["deepest_left"], 0)
        for x, side in ((0.04, -1), (0.07, 1), (0.1, -1)):
            distance = numpy.linalg.norm(frames[20][6:] - [x, 0.01, 0.008 * side], axis=1).min()
            self.assertGreater(distance, 0.01 - 1e-6)  # float32

    def test_patches_are_found_near_the_assets_colliders(self):
        """The pins begin 6 mm off the card, whose points lie 1 cm apart: those straight before them are so near, and no others."""
        pins = "".join(f'{{ kind = "sphere", radius = 0.01, position = [{x}, 0.01, {0.016 * side}], '
                       f'key = [{{ time = 0.3, offset = [0, 0, {-0.008 * side}] }}] }},' for x, side in ((0.04, -1), (0.07, 1), (0.1, -1)))
        text = LIST.replace("modes = 6", "modes = 2, MORE").replace("gravity = [0, 0, -9.8]", "gravity = [0, 0, 0]")
        named, near, one = (self.jobs(pins, text.replace("MORE", more))["both"] for more in
                            ("contact_patches = [13, 22, 31]", "contact_patches_near = 0.0065", "contact_patches_near = 0.0065, contact_patches_most = 1"))
        self.assertEqual(model_key(model_tables(near)), model_key(model_tables(named)))
        self.assertNotEqual(model_key(model_tables(one)), model_key(model_tables(named)))
        self.assertEqual(self.bake(near)[0]["model"]["key"], model_key(model_tables(named)))
        for more, message in (("contact_patches_near = 0", "expected a length above 0"), ("contact_patches_most = 3", "goes with contact_patches_near"),
                              ("contact_patches_near = 1, contact_patches_most = 129", "from 1 to 128")):
            with self.subTest(more), self.assertRaisesRegex(SceneError, message):
                self.jobs(pins, text.replace("MORE", more))
        with self.assertRaisesRegex(SceneError, "no vertex that moves is so near"):
            model_key(model_tables(self.jobs(pins, text.replace("MORE", "contact_patches_near = 0.001"))["both"]))

    def test_patches_of_a_proxy_are_numbered_as_in_the_mesh(self):
        text = LIST.replace('mesh = "card.obj"', 'mesh = "card.obj"\nproxy = 20').replace("modes = 6", "modes = 6, contact_patches = [38]")
        job = self.jobs("", text)["one"]
        self.assertTrue(model_key(model_tables(job)))
        job["simulation"]["contact_patches"] = [39]
        with self.assertRaisesRegex(SceneError, "vertex 39 is named; the mesh has 39, from 0"):
            model_key(model_tables(job))

    def test_what_is_pushed_out_and_corrected_is_refused(self):
        for text, message in (("push_out = 1,", "push_out is 1, expected true or false"), ("push_out = true, correction_steps = 2,", "choose one")):
            with self.subTest(text), self.assertRaisesRegex(SceneError, message):
                self.jobs(BALL, LIST.replace("modes = 6,", f"{text} modes = 6,"))


if __name__ == "__main__":
    unittest.main()
