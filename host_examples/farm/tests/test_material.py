"""Claims about what varies over a job's shell, creases, rest shapes, and what changes at run time."""

import functools
import tempfile
import unittest
from pathlib import Path

import numpy
import shellwarp
import small
from test_contact import LIST, Case

from shellwarp_farm import selection
from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import hash_of
from shellwarp_farm.materials import material_of, with_usd
from shellwarp_farm.mesh_file import read_drawn
from shellwarp_farm.model import load_model, model_key, model_tables, shell_of
from shellwarp_farm.simulated import mesh_at, simulated_at

OLD = "{ k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }"
N, TRIANGLES = 39, 48


class Varying(Case):
    def shell(self, material):
        job = self.jobs("", LIST.replace(OLD, material))["both"]
        return shell_of(model_tables(job)), model_key(model_tables(job))

    def write(self, name, numbers):
        (self.folder / name).write_text("# of a test\n" + "\n".join(f"{x:g}" for x in numbers) + "\n")

    def test_maps_are_by_vertices_or_by_triangles_and_regions_go_over_them(self):
        self.write("thick.txt", 4e-4 + 1e-6 * numpy.arange(N))
        self.write("dense.txt", 700 + numpy.arange(TRIANGLES))
        shell, key = self.shell('{ preset = "card", map = { thickness = "thick.txt", volume_density = "dense.txt" }, '
                                'region = [{ side = "high-x", thickness = 1e-3, young = 1e9 }] }')
        self.assertEqual(set(shell.maps), {"thickness", "volume_density", "young"})
        expected = 4e-4 + 1e-6 * numpy.arange(N)
        expected[36:] = 1e-3
        self.assertLess(numpy.abs(shell.maps["thickness"] - expected).max(), 1e-15)
        self.assertEqual(shell.maps["volume_density"].tolist(), (700 + numpy.arange(TRIANGLES)).tolist())
        self.assertEqual(shell.maps["young"].tolist(), [shellwarp.Sheet.known("card").young] * 36 + [1e9] * 3)
        self.write("thick.txt", 5e-4 + 1e-6 * numpy.arange(N))
        self.assertNotEqual(self.shell('{ preset = "card", map = { thickness = "thick.txt" } }')[1], self.shell('{ preset = "card" }')[1])

    def test_growth_goes_with_every_material(self):
        self.write("grown.txt", [1.0] * 36 + [1.1] * (N - 36))
        keys = {self.shell(OLD)[1]}
        for material in ('{ preset = "card", map = { growth = "grown.txt" } }', '{ k_bend = 2.0, region = [{ side = "high-x", growth = 1.1 }] }'):
            shell, key = self.shell(material)
            self.assertEqual(shell.maps["growth"].tolist(), [1.0] * 36 + [1.1] * (N - 36))
            keys.add(key)
        self.assertEqual(len(keys), 3)

    def test_a_thicker_region_stiffens_the_bake(self):
        ends = [self.bake(self.jobs("", LIST.replace(OLD, material))["both"])[1][-1, -1, 2]
                for material in ('{ preset = "card" }', '{ preset = "card", region = [{ box = [-1, -1, -1, 0.06, 1, 1], thickness = 2e-3 }] }')]
        self.assertLess(ends[0], 2 * ends[1])
        self.assertLess(ends[1], 0)

    def test_a_usd_mesh_brings_its_sheet(self):
        from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt
        job = self.jobs("", LIST)["both"]
        positions, triangles = mesh_at(job["mesh"])
        path = str(self.folder / "bound.usda")
        stage = Usd.Stage.CreateNew(path)
        UsdGeom.SetStageMetersPerUnit(stage, 0.01)
        UsdPhysics.SetStageKilogramsPerUnit(stage, 0.001)
        mesh = UsdGeom.Mesh.Define(stage, "/strip")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(100 * positions.astype(numpy.float32)))
        mesh.CreateFaceVertexCountsAttr([3] * len(triangles))
        mesh.CreateFaceVertexIndicesAttr(triangles.ravel().tolist())
        in_usd = LIST.replace(f'"{Path(job["mesh"]).name}"', f'"{path}"')
        self.assertNotEqual(in_usd, LIST)

        def sheet(more=""):
            return shell_of(model_tables(self.jobs("", in_usd.replace(OLD, "{ from_usd = true" + more + " }"))["both"])).material

        stage.Save()
        with self.assertRaisesRegex(SceneError, "no material bound"):
            sheet()
        path2 = self.folder / "bound2.usda"
        in_usd = in_usd.replace(path, str(path2))   # files are read once
        material = UsdShade.Material.Define(stage, "/card")
        for name, value in (("omniphysics:youngsModulus", 3e10), ("omniphysics:poissonsRatio", 0.25), ("omniphysics:density", 0.7), ("omniphysics:surfaceThickness", 0.04)):
            material.GetPrim().CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)   # g/(cm s2), g/cm3, cm
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")
        stage.GetRootLayer().Export(str(path2))
        made = sheet()
        for key, value in (("young", 3e7), ("poisson", 0.25), ("volume_density", 7e-4), ("thickness", 0.04)):
            self.assertAlmostEqual(getattr(made, key) / value, 1, delta=1e-6)   # floats
        self.assertAlmostEqual(sheet(", thickness = 0.1").thickness, 0.1)
        for more, words in ((', preset = "card"', "preset does not go with from_usd"), (", k_area = 1.0", "k_area does not go with")):
            with self.assertRaisesRegex(SceneError, words):
                sheet(more)
        with self.assertRaisesRegex(SceneError, "no material bound"):
            self.shell("{ from_usd = true }")
        with self.assertRaisesRegex(SceneError, "expected true or false"):
            self.shell("{ from_usd = 3 }")
        path3 = self.folder / "bound3.usda"
        material.GetPrim().RemoveProperty("omniphysics:density")
        UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateDensityAttr(0.9)
        material.GetPrim().RemoveProperty("omniphysics:surfaceThickness")
        stage.GetRootLayer().Export(str(path3))
        in_usd = in_usd.replace(str(path2), str(path3))
        self.assertAlmostEqual(sheet(", thickness = 0.1").volume_density / 9e-4, 1, delta=1e-6)
        with self.assertRaisesRegex(SceneError, "does not say thickness"):
            sheet()

    def test_a_usd_mesh_of_the_older_schema_and_one_of_a_told_mass(self):
        """usd_sheet.usda is a sheet of 2 by 1 in centimetres and grams, as another program writes it."""
        text = (Path(__file__).parent / "usd_sheet.usda").read_text()

        def sheet(name, *changes, more=""):
            for old, new in changes:
                self.assertIn(old, text)
            path = self.folder / name
            path.write_text(functools.reduce(lambda text, change: text.replace(*change), changes, text))
            asset = read_drawn(path).asset
            return material_of(with_usd({"from_usd": True, **({"thickness": 0.1} if more else {})}, asset))

        old = sheet("old.usda")
        for key, value in (("young", 2e6), ("poisson", 0.3), ("thickness", 0.05), ("volume_density", 8e-4)):
            self.assertAlmostEqual(getattr(old, key) / value, 1, delta=1e-6)   # floats
        new = sheet("new.usda", ("float physxDeformableSurfaceMaterial:youngsModulus", "float omniphysics:youngsModulus = 4e9\n        float physxDeformableSurfaceMaterial:youngsModulus"))
        self.assertAlmostEqual(new.young / 4e6, 1, delta=1e-6)    # the present schema goes before
        dense = sheet("dense.usda", ("float physics:density = 0\n", "float physics:density = 0.5\n"))
        self.assertAlmostEqual(dense.volume_density / 5e-4, 1, delta=1e-6)   # of the mesh, over the material's
        heavy = sheet("heavy.usda", ("float physics:density = 0\n", "float physics:density = 0.5\n"), ("float physics:mass = 0\n", "float physics:mass = 3\n"))
        self.assertAlmostEqual(heavy.volume_density * heavy.thickness * 2 / 3e-3, 1, delta=1e-6)   # kg of the whole, over a density
        thicker = sheet("thicker.usda", ("float physics:mass = 0\n", "float physics:mass = 3\n"), more="thickness")
        self.assertAlmostEqual(thicker.volume_density * 0.1 * 2 / 3e-3, 1, delta=1e-6)

    def test_creases_turn_freely_or_rest_folded(self):
        crease = OLD.replace(" }", ", crease = [{ box = [0.059, -1, -1, 0.061, 1, 1], factor = 0.1, angle_degrees = 60 }, "
                                   "{ edges = [[18, 19]], factor = 0.5 }] }")
        shell, key = self.shell(crease)
        self.assertEqual([edge[:3] for edge in shell.creases], [(18, 19, 0.5), (19, 20, 0.1)])
        self.assertAlmostEqual(shell.creases[1][3], numpy.pi / 3)
        self.assertNotEqual(key, self.shell(OLD)[1])
        folds = OLD.replace(" }", ", crease = [{ box = [0.059, -1, -1, 0.061, 1, 1], yield_degrees = 20 }] }")
        self.assertEqual([edge[2:4] for edge in self.shell(folds)[0].creases], [(1.0, None)] * 2)
        self.assertAlmostEqual(self.shell(folds)[0].creases[0][4], numpy.pi / 9)
        frames = self.bake(self.jobs("", LIST.replace(OLD, crease.replace(", { edges = [[18, 19]], factor = 0.5 }", "")).replace("-9.8", "0"))["both"])[1]
        arm = frames[0][36:].mean(axis=0) - frames[0][18:21].mean(axis=0)  # it begins where it rests: folded by 60 degrees, 2 of them for rounding by modes
        self.assertAlmostEqual(numpy.degrees(numpy.arctan2(abs(arm[2]), arm[0])), 60, delta=2)

    def test_a_rest_shape_curls_it(self):
        small.write_obj(self.folder / "curl.obj")
        lines = (self.folder / "curl.obj").read_text().splitlines()
        curled = []
        for line in lines:
            words = line.split()
            if words[0] == "v":
                x, angle = float(words[1]), 0.3 * float(words[1]) / 0.12
                words[1], words[3] = (f"{0.12 / 0.3 * numpy.sin(angle):.17g}", f"{0.12 / 0.3 * (1 - numpy.cos(angle)):.17g}") if x else (words[1], "0")
            curled.append(" ".join(words))
        (self.folder / "curl.obj").write_text("\n".join(curled) + "\n")
        text = LIST.replace(OLD, OLD.replace(" }", ', rest_shape = "curl.obj" }')).replace("-9.8", "0")
        frames = self.bake(self.jobs("", text)["both"])[1]
        # Held flat by two rows: 11 edges of 1 cm follow, each turned by 0.025 further. 2 % are the paper's energy, which bends by triangles.
        rise = 0.01 * numpy.sin(0.025 * numpy.arange(1, 12)).sum()
        self.assertAlmostEqual(frames[0][36:, 2].mean(), rise, delta=0.02 * rise)
        (self.folder / "curl.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with self.assertRaisesRegex(SceneError, "rest_shape has 3 vertices; the mesh has 39"):
            self.shell(OLD.replace(" }", ', rest_shape = "curl.obj" }'))

    def test_directions_are_by_triangles(self):
        (self.folder / "grain.txt").write_text("0 1 0\n" * TRIANGLES)
        by_file = self.shell('{ preset = "card", young_across = 3e8, directions = "grain.txt" }')[0]
        self.assertEqual(numpy.asarray(by_file.directions).shape, (TRIANGLES, 3))
        (self.folder / "grain.txt").write_text("0 1 0\n" * 2)
        with self.assertRaisesRegex(SceneError, "2 directions; the mesh has 48 triangles"):
            self.shell('{ preset = "card", young_across = 3e8, directions = "grain.txt" }')

    def test_a_frequency_gives_the_stiffness(self):
        """Frequencies go with the root of all stiffness; 1e-6: two eigenvalue searches."""
        hertz, keys = {}, set()
        for frequency in (2, 5):
            job = self.jobs("", LIST.replace(OLD, f"{{ frequency = {frequency}, density = 0.3, thickness = 5e-4 }}"))["one"]
            record = self.bake(job)[0]
            keys.add(record["model"]["key"])
            hertz[frequency] = next(found for found in load_model(model_tables(job), record["model"]["key"], self.folder / "cache")[0].frequencies() if found > 0)
        for frequency, found in hertz.items():
            self.assertAlmostEqual(found / frequency, 1, delta=1e-6)
        self.assertEqual(len(keys), 2)
        for material, message in (("{ frequency = 2, k_bend = 1 }", "k_bend does not go with frequency"), ("{ frequency = 0 }", "expected Hz above 0"),
                                  ('{ frequency = 2, region = [{ side = "low-x", k_bend = 2 }] }', "k_bend does not go with frequency")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.shell(material)

    def test_a_sag_gives_the_stiffness(self):
        """Of the full shell, to a thousandth; by another gravity another model."""
        keys = set()
        for gravity in (9.8, 1.6):
            settings = LIST.replace(OLD, "{ sag = 0.02, density = 0.3, thickness = 5e-4 }").replace("gravity = [0, 0, -9.8]", f"gravity = [0, 0, -{gravity}]")
            job = self.jobs("", settings)["one"]
            record = self.bake(job)[0]
            keys.add(record["model"]["key"])
            with load_model(model_tables(job), record["model"]["key"], self.folder / "cache")[0].state("shell-implicit") as state:
                state.set_gravity(job["simulation"]["gravity"])
                state.equilibrium()
                self.assertAlmostEqual(state.report()["max_displacement"] / 0.02, 1, delta=1.1e-3)   # and the solver's own
        self.assertEqual(len(keys), 2)
        for material, message in (("{ sag = 0.02, k_bend = 1 }", "k_bend does not go with sag"), ("{ sag = 0 }", "expected a length above 0"),
                                  ("{ sag = 0.02, frequency = 2 }", "does not go with")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.shell(material)
        with self.assertRaisesRegex(SceneError, "sag goes with gravity"):
            model_tables(self.jobs("", LIST.replace(OLD, "{ sag = 0.02 }").replace("gravity = [0, 0, -9.8]", "gravity = [0, 0, 0]"))["one"])

    def test_zeros_that_would_become_defaults_are_refused_and_what_a_map_has_need_not_be_there(self):
        for material, message in (("{ k_area = 0.0, k_length = 0.0, k_bend = 0.0 }", "k_area, k_length and k_bend are all 0"),
                                  ("{ density = 0.0 }", "density is 0.0, expected a number above 0")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.shell(material)
        self.assertEqual(self.shell("{ k_area = 0.0, k_bend = 0.0 }")[0].material.bend, 0)
        self.write("sheet.txt", [1e-3] * N)
        sheet = "{ young = 3e9, poisson = 0.3, volume_density = 700.0"
        mapped = self.shell(sheet + ', map = { thickness = "sheet.txt" } }')[0]
        self.assertEqual((mapped.material.thickness, mapped.maps["thickness"][0]), (0, 1e-3))
        with self.assertRaisesRegex(SceneError, "a sheet needs thickness"):
            self.shell(sheet + " }")

    def test_what_cannot_vary_is_named(self):
        self.write("short.txt", [1.0, 2.0])
        self.write("none.txt", [0.0] * N)
        (self.folder / "words.txt").write_text("1 two 3\n")
        for material, message in (
                ('{ preset = "card", map = { thickness = "short.txt" } }', "2 values of thickness; the mesh has 39 vertices"),
                ('{ preset = "card", map = { thickness = "none.txt" } }', "thickness is 0 at 0, expected numbers above 0"),
                ('{ preset = "card", map = { thickness = "words.txt" } }', "words.txt, line 1: could not convert"),
                ('{ preset = "card", map = { thickness = "missing.txt" } }', "missing.txt: No such file"),
                ('{ preset = "card", map = { k_bend = "short.txt" } }', "k_bend varies over a shell of the constants alone"),
                ('{ preset = "card", map = { colour = "short.txt" } }', "asset card, material, map: unknown key 'colour'"),
                ('{ preset = "card", region = [{ thickness = 1 }] }', "region 1: name the vertices by box, group, list, side, vertices"),
                ('{ preset = "card", region = [{ side = "top", thickness = 1 }] }', "side is 'top', expected one of low-x"),
                ('{ preset = "card", region = [{ side = "low-x" }] }', "region 1: give a constant of its own"),
                ('{ preset = "card", region = [{ side = "low-x", young = -1 }] }', "young is -1, expected a number above 0"),
                ('{ preset = "card", region = [{ box = [2, 2, 2, 3, 3, 3], young = 1 }] }', "a region of the material names no vertex"),
                (OLD.replace(" }", ", crease = [{ edges = [[0, 1]], factor = 2 }] }"), "edge 0-1 has only one triangle"),
                (OLD.replace(" }", ", crease = [{ edges = [[0, 38]], factor = 2 }] }"), "edge 0-38 is none of the mesh"),
                (OLD.replace(" }", ", crease = [{ edges = [[0, 1]] }] }"), "give a factor other than 1, angle_degrees or yield_degrees"),
                (OLD.replace(" }", ", crease = [{ edges = [[18, 19]], yield_degrees = 0 }] }"), "yield_degrees is 0, expected a number above 0"),
                (OLD.replace(" }", ", crease = [{ factor = 2 }] }"), "name the edges by box, edges or list")):
            with self.subTest(message), self.assertRaisesRegex(SceneError, message):
                self.shell(material)


class AtRunTime(Case):
    def test_damping_by_vertices_is_the_librarys(self):
        (self.folder / "factors.txt").write_text("\n".join(["0.5"] * N))
        text = LIST.replace("damping = { ratio = 0.1 }", 'damping = { ratio = 0.1, factors = "factors.txt" }')
        halved, plain = self.jobs("", text)["both"], self.jobs("", LIST.replace("ratio = 0.1", "ratio = 0.05"))["both"]
        first = hash_of(halved, "key", None)
        # 1e-6 of 0.12 m: the mean over a mode and the half round apart
        self.assertLess(numpy.abs(self.bake(halved)[1] - self.bake(plain)[1]).max(), 1e-6)
        (self.folder / "factors.txt").write_text("\n".join(["2"] * N))
        self.assertNotEqual(hash_of(halved, "key", None), first)
        (self.folder / "factors.txt").write_text("1 2")
        self.assertIn("2 factors; the mesh has 39 vertices", self.failed(halved))

    def test_a_proxy_has_the_factors_of_the_mesh(self):
        (self.folder / "factors.txt").write_text("\n".join(f"{i // 3}" for i in range(N)))
        text = LIST.replace("ratio = 0.1", 'ratio = 0.1, factors = "factors.txt"').replace('mesh = "card.obj"', 'mesh = "card.obj"\nproxy = 20')
        job = self.jobs("", text)["one"]
        simulated = simulated_at(job)
        carried = simulated.carried(numpy.arange(N) // 3)
        self.assertLess(numpy.abs(carried - 100 * simulated.positions[:, 0]).max(), 1e-9)  # the factor is x in cm
        self.bake(job)

    def test_a_proxy_has_the_directions_and_triangles_of_the_mesh(self):
        middles = 0.01 * (numpy.arange(TRIANGLES) // 4 + 0.5)   # of two quads a row
        (self.folder / "grain.txt").write_text("".join("0 1 0\n" if x > 0.06 else "1 0 0\n" for x in middles))
        numpy.savetxt(self.folder / "heavy.txt", numpy.where(middles > 0.06, 900, 700))
        material = '{ preset = "card", young_across = 3e8, directions = "grain.txt", map = { volume_density = "heavy.txt" } }'
        job = self.jobs("", LIST.replace(OLD, material).replace('mesh = "card.obj"', 'mesh = "card.obj"\nproxy = 20'))["both"]
        shell, simulated = shell_of(model_tables(job)), simulated_at(job)
        x = simulated.positions[simulated.triangles].mean(axis=1)[:, 0]
        far, near = x > 0.07, x < 0.05   # a row of the file's triangles beside the border
        self.assertTrue(far.sum() > 4 and near.sum() > 4)
        self.assertTrue((shell.directions[far] == [0, 1, 0]).all() and (shell.directions[near] == [1, 0, 0]).all())
        self.assertTrue((shell.maps["volume_density"][far] == 900).all() and (shell.maps["volume_density"][near] == 700).all())
        (self.folder / "grain.txt").write_text("0 1 0\n" * len(x))   # as many as the proxy has, and not the file
        with self.assertRaisesRegex(SceneError, f"{len(x)} directions; the mesh has {TRIANGLES} triangles"):
            shell_of(model_tables(job))

    def test_presets_are_the_same_sheets_in_centimetres(self):
        """In wind whose air nobody names, and under gravity: a hundred times the lengths of a bake in metres."""
        self.assertIn("card", shellwarp.presets())
        for preset in shellwarp.presets():
            text = LIST.replace(OLD, f'{{ preset = "{preset}" }}').replace("frames = [0, 9]", "frames = [0, 9]\nwind = { velocity = [0, 0, 3] }")
            metres = self.jobs("", text)["one"]
            lines = (self.folder / "card.obj").read_text().splitlines()
            large = [" ".join(["v", *(f"{100 * float(x):.17g}" for x in line.split()[1:])]) if line[0] == "v" else line for line in lines]
            (self.folder / "large.obj").write_text("\n".join(large) + "\n")
            told = text.replace("card.obj", "large.obj").replace("[0, 0, -9.8]", "[0, 0, -980]").replace("[0, 0, 3]", "[0, 0, 300]")
            centimetres = self.jobs("", "metres_per_unit = 0.01\n" + told)["one"]
            shell = shell_of(model_tables(centimetres))
            self.assertEqual((shell.material, shell.metres_per_unit), (shellwarp.Sheet.known(preset, 0.01), 0.01))
            small_one, large_one = self.bake(metres)[1], self.bake(centimetres)[1]
            moved = numpy.abs(small_one[-1] - small_one[0]).max()
            self.assertLess(numpy.abs(large_one / 100 - small_one).max(), 1e-4 * moved + 2e-8)   # a basis of floats, and floats of 0.1

    def test_welded_pieces_bake_as_the_whole(self):
        """The card in two pieces that touch in the middle row, from behind as well; its numbers are those of the file."""
        small.write_obj(self.folder / "card.obj")
        lines = (self.folder / "card.obj").read_text().splitlines()
        points, faces = [line for line in lines if line[0] == "v"], [line.split()[1:] for line in lines if line[0] == "f"]
        seam, twin = {19 + j: N + 1 + j for j in range(3)}, []   # row 6 once more
        for k, face in enumerate(faces):
            twin.append([str(seam.get(int(v), int(v))) for v in face] if k >= TRIANGLES // 2 else face)
        twin.append(twin[0][::-1])
        (self.folder / "pieces.obj").write_text("\n".join(points + points[18:21] + ["f " + " ".join(face) for face in twin]) + "\n")
        numpy.savetxt(self.folder / "factors.txt", numpy.arange(N + 3) // 3 + 1.0)
        numpy.savetxt(self.folder / "whole.txt", numpy.arange(N) // 3 + 1.0)
        damped = LIST.replace("ratio = 0.1", 'ratio = 0.1, factors = "whole.txt"')
        whole = self.jobs("", damped)["one"]
        text = damped.replace('mesh = "card.obj"', 'mesh = "pieces.obj"\nweld = 1e-6').replace("whole.txt", "factors.txt")
        job = self.jobs("", text)["one"]
        simulated = simulated_at(job)
        self.assertEqual((len(simulated.positions), len(simulated.triangles), simulated.n_file), (N, TRIANGLES, N + 3))
        self.assertEqual([simulated.here(v) for v in (18, N, N + 2)], [18, 18, 20])
        self.assertEqual(model_key(model_tables(job)), model_key(model_tables(whole)))
        found = self.bake(job)[1]
        self.assertEqual(found.shape[1], N + 3)
        self.assertTrue(numpy.array_equal(found[:, 18:21], found[:, N:]))
        self.assertLess(numpy.abs(found[:, :N] - self.bake(whole)[1]).max(), 1e-6)   # floats of the binding, of 0.1
        self.assertGreater(numpy.abs(found[-1] - found[0]).max(), 1e-3)
        with self.assertRaisesRegex(SceneError, "pieces.obj: weld: the distance must be from 0 to the mesh's size"):
            shell_of(model_tables(self.jobs("", text.replace("1e-6", "1.0"))["one"]))
        with self.assertRaisesRegex(SceneError, "asset card: weld is -1, expected a distance of 0 or above"):
            self.jobs("", text.replace("1e-6", "-1"))

    def test_a_proxy_keeps_both_sides_where_told(self):
        (self.folder / "slab.obj").write_text("".join(f"v {0.01 * i} {0.01 * j} {z}\n" for z in (0.001, -0.001) for i in range(9) for j in range(9)) + "".join(
            f"f {a} {a + 9} {a + 10}\nf {a} {a + 10} {a + 1}\nf {a + 81} {a + 91} {a + 90}\nf {a + 81} {a + 82} {a + 91}\n" for a in (9 * i + j + 1 for i in range(8) for j in range(8))))
        sides = {}
        for lines in ("", "proxy_thickness = 0\n"):
            job = self.jobs("", LIST.replace('mesh = "card.obj"', 'mesh = "slab.obj"\nproxy = 80\n' + lines))["one"]
            sides[lines] = numpy.unique(numpy.sign(numpy.round(simulated_at(job).positions[:, 2], 9))).tolist()
        self.assertEqual(sides, {"": [0.0], "proxy_thickness = 0\n": [-1.0, 1.0]})

    def test_a_stiffness_factor_takes_no_other_model_and_sags_less(self):
        ends = {}
        for factor in (1, 4):
            job = self.jobs("", LIST.replace("gravity = [0, 0, -9.8]", f"stiffness_factor = {factor}, gravity = [0, 0, -9.8]"))["both"]
            record, frames = self.bake(job)
            ends[factor] = frames[:, -1, 2].min(), record["model"]["key"]
        self.assertEqual(ends[1][1], ends[4][1])
        self.assertLess(ends[1][0], 2 * ends[4][0])


    def test_a_deterministic_job_has_a_deterministic_state(self):
        """Told by the full shell, which has none; the warp bakes, within rounding as without."""
        text = LIST.replace("modes = 6", "modes = 6, deterministic = true")
        self.assertLess(numpy.abs(self.bake(self.jobs("", text)["both"])[1] - self.bake(self.jobs("", LIST)["both"])[1]).max(), 1e-6)
        self.assertIn("deterministic", self.failed(self.jobs("", text.replace('"warp"', '"shell-implicit"'))["both"]))


class Selections(unittest.TestCase):
    def test_side_list_and_group_name_vertices(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            small.write_obj(folder / "card.obj")
            text = (folder / "card.obj").read_text().replace("f 1 4 5", "o whole\ng root left\nf 1 4 5").replace("f 2 5 6", "g rest\nf 2 5 6")
            (folder / "card.obj").write_text(text)
            (folder / "some.txt").write_text("3 4 # five\n5")
            mesh = str(folder / "card.obj")
            simulated = simulated_at({"mesh": mesh, "proxy": {}})
            self.assertEqual(read_drawn(mesh).groups["root"], [0, 1, 3, 4])
            for item, expected in (({"side": "low-x"}, [0, 1, 2]), ({"side": "high-y"}, list(range(2, N, 3))),
                                   ({"list": str(folder / "some.txt")}, [3, 4, 5]), ({"group": "left"}, [0, 1, 3, 4]), ({"group": "whole"}, list(range(N))),
                                   ({"vertices": [7], "side": "low-x"}, [0, 1, 2, 7])):
                self.assertEqual(selection.chosen(item, simulated, mesh).tolist(), expected, item)
            with self.assertRaisesRegex(SceneError, "has no group 'top'; it has left, rest, root, whole"):
                selection.chosen({"group": "top"}, simulated, mesh)
            self.assertEqual(selection.one_vertex({"side": "high-x"}, simulated, mesh), 37)
            self.assertEqual(selection.one_vertex({"nearest": [1, 1, 0]}, simulated, mesh), 38)


if __name__ == "__main__":
    unittest.main()
