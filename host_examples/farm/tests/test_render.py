"""Claims about meshes that follow an asset's shell: the library's own points, any faces, and named refusals."""

import tempfile
import unittest
from pathlib import Path

import numpy
import shellwarp
import small

from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import bake, hash_of
from shellwarp_farm.job_log import log_path
from shellwarp_farm.mesh_file import read_polygons
from shellwarp_farm.model import model_tables, prepare
from shellwarp_farm.scenes import read_list
from shellwarp_farm.simulated import mesh_at, simulated_at
from shellwarp_farm.supports import held_vertices

LIST = """
[[asset]]
name = "card"
mesh = "card.obj"
render = RENDER
material = { k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }
support = [{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }]
simulation = { modes = 6, method = "warp" }
damping = { ratio = 0.1 }
[[shot]]
name = "one"
frames = [0, 9]
simulation = { gravity = [0, 0, -9.8] }
frame = { translate = [{ axis = [0, 1, 0], amplitude = 0.02, frequency = 2 }] }
"""
# A pentagon, a quad and a triangle, 2 mm above the card; and a quad on it.
FINE = ("v 0.02 0 0.002\nv 0.06 0 0.002\nv 0.07 0.01 0.002\nv 0.06 0.02 0.002\nv 0.02 0.02 0.002\nv 0.1 0 0.002\nv 0.1 0.02 0.002\nv 0.12 0.01 0.002\n"
        "f 1 2 3 4 5\nf 2 6 7 4\nf 6 8 7\n")
FLAT = "v 0 0 0\nv 0.12 0 0\nv 0.12 0.02 0\nv 0 0.02 0\nf 1 2 3 4\n"


class Render(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / "fine.obj").write_text(FINE)
        (self.folder / "flat.obj").write_text(FLAT)

    def job(self, render='["fine.obj", "flat.obj"]'):
        return small.jobs(self.folder, LIST.replace("RENDER", render))[0]

    def bake(self, job):
        cache = self.folder / "cache"
        return bake(job, prepare(model_tables(job), cache), None, self.folder / "out", cache)

    def points(self, name):
        data = (self.folder / "out" / name).read_bytes()
        n, frames = numpy.frombuffer(data, "<i4", 1, 16)[0], numpy.frombuffer(data, "<i4", 1, 28)[0]
        return numpy.frombuffer(data, "<f4", offset=32).reshape(frames, n, 3)

    def test_they_follow_as_the_librarys_binding_says_to_the_bit(self):
        job = self.job()
        record = self.bake(job)
        self.assertNotIn("failed", record)
        self.assertEqual(sorted(Path(name).name for name in record["outputs"]),
                         sorted(["card_one.state", *(f"card_one{stem}{end}" for stem in ("", "_fine", "_flat") for end in (".pc2", ".usdc"))]))
        positions, triangles = mesh_at(job["mesh"])
        model = shellwarp.Model(shellwarp.Shell(positions, triangles, shellwarp.Material(5e3, 5e3, 2.7e-3, 0.3), fixed=range(6)))
        model.precompute(modes=6, reduced_fields=0)
        state = model.state("warp")
        state.load((self.folder / "out" / f"{job['name']}.state").read_bytes())  # the last frame's
        for stem in ("fine", "flat"):
            points = read_polygons(self.folder / f"{stem}.obj")[0]
            expected = state.bound_points(shellwarp.Binding(model, points))["positions"]
            found = self.points(f"{job['name']}_{stem}.pc2")
            self.assertTrue(numpy.array_equal(found[-1], expected))
            self.assertTrue(numpy.array_equal(found[0], points.astype(numpy.float32)))
            self.assertGreater(numpy.abs(found[-1] - found[0]).max(), 0.002)

    def test_a_proxy_leads_the_asset_in_its_own_faces(self):
        from pxr import Usd, UsdGeom
        rows, columns = 9, 41   # a card of quads with two sides, 2 mm apart
        lines = [f"v {0.003 * i:.17g} {0.0025 * j:.17g} {z}" for z in (0.001, -0.001) for i in range(columns) for j in range(rows)]
        for i in range(columns - 1):
            for j in range(rows - 1):
                a = i * rows + j + 1
                corners = (a, a + rows, a + rows + 1, a + 1)
                lines += ["f " + " ".join(map(str, corners)), "f " + " ".join(str(v + rows * columns) for v in reversed(corners))]
        (self.folder / "slab.obj").write_text("\n".join(lines) + "\n")
        text = LIST.replace('mesh = "card.obj"', 'mesh = "slab.obj"\nproxy = 80').replace("RENDER", "[]").replace("[0, 1, 2, 3, 4, 5]", str(list(range(2 * rows))))
        job = small.jobs(self.folder, text)[0]
        record = self.bake(job)
        self.assertNotIn("failed", record)
        self.assertLess(abs(record["vertices"] - 80), 12)
        points = self.points(f"{job['name']}.pc2")
        n = rows * columns
        self.assertEqual(points.shape[1], 2 * n)
        self.assertGreater(numpy.abs(points[-1] - points[0]).max(), 0.002)
        apart = numpy.linalg.norm(points[:, :n] - points[:, n:], axis=2)
        self.assertLess(numpy.abs(apart - 0.002).max(), 4e-5)   # the sides stay as far apart
        stage = Usd.Stage.Open(str(self.folder / "out" / f"{job['name']}.usdc"))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        self.assertEqual(set(mesh.GetFaceVertexCountsAttr().Get()), {4})
        plain = small.jobs(self.folder, text.replace("proxy = 80", "proxy = 80\nproxy_calibrated = false"))[0]
        self.bake(plain)
        self.assertGreater(numpy.abs(self.points(f"{plain['name']}.pc2")[-1] - points[-1]).max(), 1e-6)   # of another stiffness
        self.assertNotIn("not as stiff", log_path(self.folder / "out", plain["name"]).read_text(encoding="utf-8"))   # as it was asked for
        for wrong, said in (("proxy = 80", "proxy = 2"), ("proxy = 80", "proxy_cut = true")):
            with self.assertRaisesRegex(SceneError, "asset card: proxy"):
                read_list(small.write_list(self.folder, text.replace(wrong, said)))

    def test_a_proxy_that_cannot_be_calibrated_says_why(self):
        text = LIST.replace("RENDER", "[]").replace('mesh = "card.obj"', 'mesh = "card.obj"\nproxy = 30').replace("support = [{", "# [{")
        job = small.jobs(self.folder, text)[0]
        said = [message for message in prepare(model_tables(job), self.folder / "cache")["messages"] if "not as stiff" in message]
        self.assertEqual(said, ["the proxy is not as stiff as the mesh that it stands for: nothing holds it"])

    def test_a_clamped_proxy_is_held_as_far_as_its_mesh_and_no_edge_of_its_own_further(self):
        rows, columns = 9, 61   # a card of quads, clamped at its end: 2 mm hold its slope there
        lines = [f"v {0.002 * i:.17g} {0.0025 * j:.17g} 0" for i in range(columns) for j in range(rows)]
        lines += [f"f {a} {a + rows} {a + rows + 1} {a + 1}" for i in range(columns - 1) for a in range(i * rows + 1, i * rows + rows)]
        (self.folder / "quads.obj").write_text("\n".join(lines) + "\n")
        text = LIST.replace("RENDER", "[]").replace('mesh = "card.obj"', 'mesh = "quads.obj"\nproxy = 60')
        text = text.replace('kind = "fixed", vertices = [0, 1, 2, 3, 4, 5]', f'kind = "clamped", vertices = {list(range(10 * rows))}')
        tables = model_tables(small.jobs(self.folder, text)[0])
        simulated = simulated_at(tables)
        held = simulated.positions[held_vertices(tables["support"], simulated, tables["mesh"])][:, 0]
        edge = 0.0068   # of 60 vertices on 120 x 20 mm
        self.assertGreater(held.max(), 0.018 - edge / 2)
        self.assertLess(held.max(), 0.020 + edge / 2)   # the nearest vertex is no further; a row of the proxy would be

    def test_usd_keeps_the_faces(self):
        from pxr import Usd, UsdGeom
        job = self.job('"fine.obj"')
        self.bake(job)
        stage = Usd.Stage.Open(str(self.folder / "out" / f"{job['name']}_fine.usdc"))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        self.assertEqual(list(mesh.GetFaceVertexCountsAttr().Get()), [5, 4, 3])
        self.assertEqual(list(mesh.GetFaceVertexIndicesAttr().Get()), [0, 1, 2, 3, 4, 1, 5, 6, 3, 5, 7, 6])
        points = numpy.array(mesh.GetPointsAttr().Get(9))
        self.assertTrue(numpy.array_equal(points, self.points(f"{job['name']}_fine.pc2")[9]))

    def test_the_shells_own_bits_do_not_depend_on_what_follows(self):
        job = self.job()
        with_them = self.bake(job)["outputs"]
        job["render"] = []
        without = self.bake(job)["outputs"]
        self.assertEqual({name: with_them[name] for name in without}, without)

    def test_an_edited_render_mesh_is_baked_anew(self):
        job = self.job()
        before = hash_of(job, "key", None)
        (self.folder / "flat.obj").write_text(FLAT.replace("0.12 0 0", "0.11 0 0.001"))
        self.assertNotEqual(hash_of(job, "key", None), before)

    def test_what_cannot_follow_fails_by_its_path(self):
        for name, text, said in (("gone.obj", None, "there is no such mesh"), ("none.obj", "", "no vertices"),
                                 ("nan.obj", "v nan 0 0\nv 1 0 0\n", "nan|finite|NaN")):
            if text is not None:
                (self.folder / name).write_text(text)
            self.assertRegex(self.bake(self.job(f'"{name}"'))["failed"], rf"{name}.*({said})")

    def test_a_wrong_list_is_refused_with_its_place(self):
        for wrong in ('["fine.obj", "more/fine.obj"]', "[3]"):
            with self.assertRaisesRegex(SceneError, "asset card: render is the path"):
                read_list(small.write_list(self.folder, LIST.replace("RENDER", wrong)))


if __name__ == "__main__":
    unittest.main()
