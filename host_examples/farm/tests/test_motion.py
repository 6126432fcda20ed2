"""Claims about meshes that are animated: supports and rest shapes that follow a point cache or USD."""

import struct
import unittest

import numpy
import shellwarp
from test_contact import LIST, Case

from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import hash_of
from shellwarp_farm.model import model_tables
from shellwarp_farm.simulated import mesh_at

STILL = LIST.replace("gravity = [0, 0, -9.8]", "gravity = [0, 0, -1]")
MOVED = STILL.replace("frames = [0, 20]", 'frames = [0, 20]\nmotion = "card.pc2"')


class Motion(Case):
    def write_motion(self, rise=0.03):
        """The card's far end rises, bent to a parabola, until frame 12: samples at frames 0, 6 and 12."""
        rest = mesh_at(str(self.folder / "card.obj"))[0]
        points = [rest + [0, 0, 1] * (share * rise * (rest[:, :1] / 0.12) ** 2) for share in (0, 0.5, 1)]
        data = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, len(rest), 0.0, 6.0, 3) + numpy.array(points, "<f4").tobytes()
        (self.folder / "card.pc2").write_bytes(data)
        return numpy.array(points, "<f4").astype(float)

    def at(self, points, frame):
        k, t = min(frame // 6, 1), min(frame / 6 - min(frame // 6, 1), 1.0)
        return (1 - t) * points[k] + t * points[k + 1]

    def alone(self, job, points, follow_rest, method):
        """The library's own motion."""
        positions, triangles = mesh_at(job["mesh"])
        held = [0, 1, 2, 3, 4, 5, 36, 37, 38]
        with shellwarp.Model(shellwarp.Shell(positions, triangles, shellwarp.Material(5e3, 5e3, 2.7e-3, 0.3), fixed=held)) as model:
            model.precompute(modes=6, reduced_fields=0, support_fields=0 if follow_rest else 24)
            state = model.state(method)
            state.set_gravity((0, 0, -1))
            state.set_damping(ratio=0.1)
            move = state.move_rest if follow_rest else state.move_supports
            for frame in range(21):
                move(self.at(points, frame), teleport=frame == 0)
                if frame:
                    state.step(1 / 30)
                elif follow_rest:
                    state.reset()
                yield frame, state.positions()

    def job(self, text):
        return self.jobs("", text.replace("[0, 1, 2, 3, 4, 5]", "[0, 1, 2, 3, 4, 5, 36, 37, 38]"))["both"]

    def test_supports_and_rest_shapes_follow_as_the_librarys(self):
        for follow_rest, method in ((False, "warp"), (True, "warp"), (True, "shell-implicit")):
            with self.subTest(follow_rest=follow_rest, method=method):
                job = self.job(MOVED.replace('motion = "card.pc2"', f'motion = "card.pc2"\nfollow_rest = {str(follow_rest).lower()}')
                               .replace('method = "warp"', f'method = "{method}"'))
                points = self.write_motion()
                self.assertEqual(model_tables(job)["options"]["support_fields"], 0 if follow_rest else 24)
                record, frames = self.bake(job)
                for frame, expected in self.alone(job, points, follow_rest, method):
                    # 1e-7: times and positions round their last bits apart
                    self.assertLess(numpy.abs(frames[frame] - expected).max(), 1e-7, frame)
                self.assertLess(numpy.abs(frames[12, 36:] - points[2, 36:]).max(), 1e-6)
                self.assertEqual("why" in record["certified"], follow_rest)
                middle = numpy.abs(frames[20, 21] - points[2, 21]).max()
                if method == "warp":   # it sags between, positions are good to 1e-8; a membrane that is held at both ends hardly does
                    self.assertGreater(middle, 1e-5)

    def test_a_shot_goes_on_where_supports_and_rest_shape_were(self):
        for led in ('motion = "card.pc2"', 'motion = "card.pc2"\nfollow_rest = true'):
            with self.subTest(led):
                text = STILL.replace('name = "one"', f'name = "one"\n{led}').replace('after = "one"', f'after = "one"\n{led}')
                jobs = self.jobs("", text.replace('name = "both"', f'name = "both"\n{led}').replace("[0, 1, 2, 3, 4, 5]", "[0, 1, 2, 3, 4, 5, 36, 37, 38]"))
                self.write_motion()
                record, first = self.bake(jobs["one"])
                second = self.bake(jobs["two"], record)[1]
                self.assertLess(numpy.abs(numpy.concatenate([first, second]) - self.bake(jobs["both"])[1]).max(), 1e-6)

    def test_a_proxy_follows_the_meshs_animation(self):
        job = self.job(MOVED.replace('motion = "card.pc2"', 'motion = "card.pc2"\nfollow_rest = true').replace('mesh = "card.obj"', 'mesh = "card.obj"\nproxy = 30').replace("-1]", "0]"))
        points = self.write_motion()
        frames = self.bake(job)[1]
        self.assertLess(numpy.abs(frames[20, 36:, 2] - points[2, 36:, 2]).max(), 2e-3)  # of 3 cm: 30 vertices stand for 39

    def test_another_motion_is_another_job_and_what_cannot_be_is_named(self):
        job = self.job(MOVED)
        self.write_motion()
        first = hash_of(job, "key", None)
        self.write_motion(rise=0.02)
        self.assertNotEqual(hash_of(job, "key", None), first)
        for old, new, message in (('motion = "card.pc2"', "follow_rest = true", "follow_rest is true or false, and goes with motion"),
                                  ('motion = "card.pc2"', 'motion = "card.pc2"\nframe = { translate = [] , rise = 1 }', "motion does not go with frame"),
                                  ('{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }', '{ side = "low-x", key = [{ time = 1 }] }', "none may have a key")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.jobs("", MOVED.replace(old, new))
        handle = MOVED.replace('motion = "card.pc2"', 'motion = "card.pc2"\nfollow_rest = true\nhandle = [{ vertex = 20 }]')
        self.assertEqual(self.bake(self.job(handle))[0]["range"]["frames_handles_unmet"], 0)   # led by the shape that is shown


if __name__ == "__main__":
    unittest.main()
