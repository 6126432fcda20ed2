"""Claims about USD layers: what a stage says of units, faces and motion; that they lie over the asset; usd-core's own checker."""

import tempfile
import unittest
from pathlib import Path

import numpy
import small
from pxr import Gf, Sdf, Usd, UsdGeom, UsdValidation, Vt

from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import bake
from shellwarp_farm.mesh_file import read_drawn, read_mesh, stem
from shellwarp_farm.model import model_tables, prepare, shell_of
from shellwarp_farm.scenes import read_list

LIST = """
up_axis = "z"
metres_per_unit = 0.01
[[asset]]
name = "card"
mesh = "MESH"
material = { k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }
support = [{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }]
simulation = { modes = 6, method = "warp" }
damping = { ratio = 0.1 }
[[shot]]
name = "one"
frames = [1, 24]
simulation = { gravity = [0, 0, -9.8], frame_rate = 240 }
"""
ROWS, COLUMNS = 13, 3


def strip():
    """Points and quads of a strip, and texture coordinates with a seam: the last column of quads has its own."""
    points = [(0.01 * i, 0.01 * j, 0) for i in range(ROWS) for j in range(COLUMNS)]
    quads = [[COLUMNS * i + j, COLUMNS * (i + 1) + j, COLUMNS * (i + 1) + j + 1, COLUMNS * i + j + 1]
             for i in range(ROWS - 1) for j in range(COLUMNS - 1)]
    return points, quads


def write_obj(path):
    points, quads = strip()
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"vt {x / 0.12} {y / 0.02}" for x, y, _ in points] + ["vt 0.5 0.5"]
    lines += ["f " + " ".join(f"{v + 1}/{v + 1 if v % COLUMNS < 2 else -1}" for v in quad) for quad in quads]
    path.write_text("\n".join(lines) + "\n")


def write_asset(path, subdivided=False):
    """In centimetres with y upward: two meshes below transforms that are not the identity, one of them the strip."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/World")).SetTranslate(Gf.Vec3d(1, 2, 3))
    points, quads = strip()
    for name in ("leaf", "other"):
        mesh = UsdGeom.Mesh.Define(stage, f"/World/{name}")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(numpy.array(points, numpy.float32)))
        mesh.CreateExtentAttr(Vt.Vec3fArray([(0, 0, 0), (0.12, 0.02, 0)]))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([4] * len(quads)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray([v for quad in quads for v in quad]))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.catmullClark if subdivided else UsdGeom.Tokens.none)
        if not subdivided:
            normals = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("normals", Sdf.ValueTypeNames.Normal3fArray, UsdGeom.Tokens.vertex)
            normals.Set(Vt.Vec3fArray([(0, 0, 1)] * len(points)))
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/World/leaf")).SetRotate(Gf.Vec3f(0, 0, 90))
    stage.GetRootLayer().Save()


def complaints(path):
    """What usd-core's validators, all of them, say of a stage: the checker behind usdchecker."""
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    return [f"{error.GetName()}: {error.GetMessage()}" for error in context.Validate(Usd.Stage.Open(str(path)))]


class UsdLayers(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        write_obj(self.folder / "card.obj")

    def bake(self, mesh="card.obj"):
        """The layer's path and the points of the PC2 file beside it."""
        path = self.folder / "list.toml"
        path.write_text(LIST.replace("MESH", mesh))
        job, cache, out = small.expand(read_list(path))[0], self.folder / "cache", self.folder / "out"
        record = bake(job, prepare(model_tables(job), cache), None, out, cache)
        self.assertNotIn("failed", record)
        data = (out / f"{job['name']}.pc2").read_bytes()
        return out / f"{job['name']}.usdc", numpy.frombuffer(data, "<f4", offset=32).reshape(24, ROWS * COLUMNS, 3)

    def test_the_checker_finds_what_is_missing(self):
        (self.folder / "bare.usda").write_text('#usda 1.0\n\ndef Mesh "leaf"\n{\n}\n')
        said = "\n".join(complaints(self.folder / "bare.usda"))
        for word in ("upAxis", "metersPerUnit", "defaultPrim"):
            self.assertIn(word, said)

    def test_a_layer_by_itself_passes_usd_cores_checker(self):
        path, _ = self.bake()
        self.assertEqual(complaints(path), [])
        stage = Usd.Stage.Open(str(path))
        self.assertEqual((UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)), ("Z", 0.01))
        self.assertEqual((stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()), (1, 24, 240))

    def test_faces_and_texture_coordinates_are_the_files(self):
        stage = Usd.Stage.Open(str(self.bake()[0]))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        points, quads = strip()
        self.assertEqual(list(mesh.GetFaceVertexCountsAttr().Get()), [4] * len(quads))
        self.assertEqual(list(mesh.GetFaceVertexIndicesAttr().Get()), [v for quad in quads for v in quad])
        self.assertTrue(mesh.GetDoubleSidedAttr().Get())
        self.assertEqual(mesh.GetSubdivisionSchemeAttr().Get(), "none")
        uvs = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        self.assertEqual(uvs.GetInterpolation(), "faceVarying")
        expected = [(points[v][0] / 0.12, points[v][1] / 0.02) if v % COLUMNS < 2 else (0.5, 0.5) for quad in quads for v in quad]
        numpy.testing.assert_allclose(numpy.array(uvs.ComputeFlattened()), expected, atol=1e-6)   # single precision

    def test_motion_is_that_of_the_cache_with_its_normals_velocities_and_extents(self):
        path, points = self.bake()
        stage = Usd.Stage.Open(str(path))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        triangles = read_mesh(self.folder / "card.obj")[1]
        self.assertEqual(mesh.GetNormalsInterpolation(), "vertex")
        fastest = 0.0
        for k in range(1, 23):
            code = k + 1
            found = numpy.array(mesh.GetPointsAttr().Get(code))
            self.assertTrue(numpy.array_equal(found, points[k]))
            self.assertTrue(numpy.array_equal(numpy.array(mesh.GetExtentAttr().Get(code)), [found.min(axis=0), found.max(axis=0)]))
            velocities, way = numpy.array(mesh.GetVelocitiesAttr().Get(code)), 240 * (points[k] - points[k - 1].astype(float))
            fastest = max(fastest, abs(way).max())
            # Implicit Euler's velocity is the way since the last step, but for what turns on that way: here less than a hundredth.
            # Positions in single precision give 1e-8 * 240 m/s.
            self.assertLess(abs(velocities - way).max(), 0.01 * fastest + 1e-5)
            normals = numpy.array(mesh.GetNormalsAttr().Get(code))
            numpy.testing.assert_allclose(numpy.linalg.norm(normals, axis=1), 1, atol=1e-6)
            corners = found.astype(float)[triangles]
            own = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            self.assertTrue(((normals[triangles].sum(axis=1) * own).sum(axis=1) > 0).all())
        self.assertGreater(fastest, 0.01)

    def test_it_lies_over_the_assets_prim_whatever_its_transforms(self):
        write_asset(self.folder / "asset.usda")
        path, points = self.bake("asset.usda</World/leaf>")
        self.assertEqual(complaints(path), [])
        layer = Usd.Stage.Open(str(path))
        self.assertEqual((UsdGeom.GetStageUpAxis(layer), UsdGeom.GetStageMetersPerUnit(layer)), ("Y", 0.01))
        self.assertFalse(any(prim.IsDefined() for prim in layer.TraverseAll()), "a layer of overrides defines nothing")
        stage = Usd.Stage.CreateInMemory()
        stage.GetRootLayer().subLayerPaths = [str(path), str(self.folder / "asset.usda")]
        stage.SetTimeCodesPerSecond(240)
        leaf, other = (UsdGeom.Mesh(stage.GetPrimAtPath(f"/World/{name}")) for name in ("leaf", "other"))
        for code in (1, 12, 24):
            place = UsdGeom.XformCache(code).GetLocalToWorldTransform(leaf.GetPrim())
            in_world = [place.Transform(Gf.Vec3d(*map(float, point))) for point in leaf.GetPointsAttr().Get(code)]
            self.assertTrue(numpy.array_equal(numpy.array(in_world, numpy.float32), points[code - 1]))
            self.assertFalse(UsdGeom.PrimvarsAPI(leaf).GetPrimvar("normals").HasValue(), "the asset's would go before the layer's")
            self.assertEqual(len(leaf.GetNormalsAttr().Get(code)), ROWS * COLUMNS)
        self.assertGreater(abs(points[-1] - points[0]).max(), 0.001)
        # Where it begins is where the asset has it: turned by its own transform and moved by its parent's.
        numpy.testing.assert_allclose(points[0][:, :2], [(1 - y, 2 + x) for x, y, _ in strip()[0]], atol=1e-6)
        self.assertEqual(list(leaf.GetFaceVertexCountsAttr().Get()), [4] * len(strip()[1]))
        self.assertEqual(len(other.GetPointsAttr().Get(24)), ROWS * COLUMNS)

    def test_normals_of_a_subdivided_asset_are_left_to_the_subdivision(self):
        write_asset(self.folder / "asset.usda", subdivided=True)
        path, _ = self.bake("asset.usda</World/leaf>")
        stage = Usd.Stage.Open(str(path))
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/leaf"))
        self.assertFalse(mesh.GetNormalsAttr().HasAuthoredValue())
        self.assertEqual(complaints(path), [])

    def test_an_obj_file_may_name_the_prim_that_it_came_from(self):
        path, points = self.bake("card.obj</World/geo/leaf>")
        layer = Usd.Stage.Open(str(path))
        prim = layer.GetPrimAtPath("/World/geo/leaf")
        self.assertTrue(prim.IsValid() and not prim.IsDefined())
        self.assertTrue(numpy.array_equal(numpy.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(24)), points[-1]))
        self.assertEqual(UsdGeom.GetStageMetersPerUnit(layer), 0.01)   # the list's

    def test_a_sheets_model_knows_the_assets_unit(self):
        write_asset(self.folder / "asset.usda")
        mesh = f"{self.folder / 'asset.usda'}</World/leaf>"
        tables = {"mesh": mesh, "proxy": {}, "material": {"preset": "card"}, "support": [], "tie": [], "handle": [], "options": {}}
        self.assertEqual(shell_of(tables).metres_per_unit, 0.01)

    def test_wrong_prims_and_units_are_named(self):
        write_asset(self.folder / "asset.usda")
        for mesh, said in (("asset.usda", "2 meshes, expected one.*/World/leaf, /World/other"), ("asset.usda</World/stem>", "no mesh /World/stem"),
                           ("card.obj</World/2nd>", "/World/2nd is no path of a prim")):
            with self.assertRaisesRegex(SceneError, said):
                read_mesh(str(self.folder / mesh))
        for wrong in ('"1"', "0", "-1", "inf"):
            (self.folder / "list.toml").write_text(LIST.replace("metres_per_unit = 0.01", f"metres_per_unit = {wrong}"))
            with self.assertRaisesRegex(SceneError, "metres_per_unit"):
                read_list(self.folder / "list.toml")

    def test_broken_texture_coordinates_are_left_out(self):
        self.assertIsNotNone(read_drawn(self.folder / "card.obj").uvs)
        text = (self.folder / "card.obj").read_text()
        for broken in (text.replace("/-1", ""), text.replace("/-1", "/99"), text.replace("vt 0.5 0.5", "vt 0.5"), text.replace("vt 0.5", "vt nan")):
            (self.folder / "broken.obj").write_text(broken)
            drawn = read_drawn(self.folder / "broken.obj")
            self.assertEqual((drawn.uvs, drawn.corner_uvs, len(drawn.faces)), (None, None, 24))
        self.assertEqual([stem("a/b.usd</World/leaf>"), stem("a/b.obj")], ["leaf", "b"])


if __name__ == "__main__":
    unittest.main()
