"""The page's table of what Blender's cloth has and has not, against Blender itself; run by ctest as `blender`."""

import re
import unittest

import bpy
from scene import ROOT

PAGE = (ROOT / "docs" / "guide" / "blender.md").read_text(encoding="utf-8")
# Of each row what its settings would be called, and whether cloth has one.
SETTINGS = {"pressure, springs inside, shrinking": (("use_pressure", "use_internal_springs", "vertex_group_shrink"), True),
            "rest shape": (("rest_shape_key", "use_dynamic_mesh"), True), "seams": (("use_sewing_springs",), True),
            "touches itself, other shells": (("use_self_collision",), True), "air": (("air_damping",), True),
            "damping": (("tension_damping", "compression_damping", "shear_damping", "bending_damping"), True),
            "folds that stay (plasticity)": (("plastic", "yield"), False), "tearing": (("tear", "break", "rip"), False),
            "a grain, stiffer along than across": (("direction", "anisotrop", "warp", "weft", "uv"), False),
            "creases": (("crease", "fold", "angle"), False), "a mesh that is refined while it runs": (("remesh", "refine", "adapt"), False),
            "runs on the graphics card": (("gpu", "device"), False)}


class Cloth(unittest.TestCase):
    def test_the_table_says_what_cloth_has(self):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE[PAGE.index("## Beside Blender's cloth"):].splitlines() if line.startswith("| ")]
        cells = {row[0]: row[1:] for row in rows if len(row) == 3}
        names = [item.identifier for kind in (bpy.types.ClothSettings, bpy.types.ClothCollisionSettings) for item in kind.bl_rna.properties]
        for row, (words, has) in SETTINGS.items():
            with self.subTest(row):
                self.assertEqual(not re.match(r"no\b", cells[row][1]), has)
                for word in words:
                    self.assertEqual(any(word in name for name in names), has, word)
        self.assertIn("plastic", bpy.types.SoftBodySettings.bl_rna.properties)
        self.assertGreaterEqual(sum(row[1].startswith("no") and row[2].startswith("no") for row in rows if len(row) == 3), 5)


if __name__ == "__main__":
    unittest.main()
