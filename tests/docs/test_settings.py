"""docs/reference/settings.md lists the settings of Blender, Maya and Houdini, all and no others, and keys that scene files and lists of the farm have."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HOSTS = ROOT / "host_examples"
PAGE = (ROOT / "docs" / "reference" / "settings.md").read_text(encoding="utf-8")
COLUMNS = ("scene", "blender", "maya", "houdini")
# What every deformer of Maya has of its own; and what Blender keeps for its lists, and of how a proxy was made.
NOT_OURS, INTERNAL = {"envelope", "weights"}, {"active_handle", "active_render", "baked_mesh", "proxy_vertices", "proxy_thickness", "proxy_cut", "proxy_held"}


def listed():
    """By column, the names of the page; and its rows."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]
    rows = [row for row in rows if row[0] != "what"]
    return {column: {name for row in rows for name in re.findall(r"`(\w+)`", row[k + 1])} for k, column in enumerate(COLUMNS)}, rows


class Settings(unittest.TestCase):
    def setUp(self):
        self.names, self.rows = listed()

    def test_blenders_properties_are_listed(self):
        source = (HOSTS / "blender/addon/properties.py").read_text(encoding="utf-8")
        found = set(re.findall(r"^    (\w+): (?:bpy\.props\.)?\w+Property\(", source, re.M)) - INTERNAL
        self.assertGreater(len(found), 25)
        self.assertEqual(self.names["blender"], found)

    def test_mayas_attributes_are_listed(self):
        source = (HOSTS / "maya/shell_warp_attributes.cpp").read_text(encoding="utf-8")
        source = re.sub(r"(create_choice\([^{]*)\{[^}]*\}", r"\1", source)   # what a menu offers is no attribute
        painted = re.findall(r'"(\w+)", "\w{3}"\}', source)   # of a list and what is in it, the second
        found = {*re.findall(r'create\w*\([^"]*"(\w+)", "\w{3}"', source), *painted} - {f"{name}{axis}" for name in ("gravity", "wind") for axis in "XYZ"}
        self.assertGreater(len(found), 25)
        self.assertEqual(self.names["maya"] - NOT_OURS, found)

    def test_houdinis_parameters_are_listed(self):
        source = (HOSTS / "houdini/SOP_ShellWarp.cpp").read_text(encoding="utf-8")
        found = set(re.findall(r'\bname "(\w+)" label', source))
        self.assertGreater(len(found), 20)
        self.assertEqual(self.names["houdini"], found)

    def test_houdinis_help_card_says_what_each_parameter_does(self):
        source = (HOSTS / "houdini/SOP_ShellWarp.cpp").read_text(encoding="utf-8")
        card = (HOSTS / "houdini/package/help/nodes/sop/shellwarp.txt").read_text(encoding="utf-8").split("@parameters", 1)[1]
        self.assertEqual(re.findall(r'\bname "(\w+)"\s+label "([^"]+)"', source),
                         [(name, label) for label, name in re.findall(r"^(\S.*):\n    #id: (\w+)\n    \S.*\.$", card, re.M)])

    def test_scene_files_and_lists_of_the_farm_have_the_keys(self):
        """Rows of keys that only one of them has say so."""
        scene = (ROOT / "docs/reference/scene.md").read_text(encoding="utf-8")
        lists = "".join(path.read_text(encoding="utf-8") for path in (HOSTS / "farm/shellwarp_farm").glob("*.py"))
        for row in self.rows:
            for name in re.findall(r"`(\w+)`", row[1]):
                if "the farm alone" not in row[0]:
                    self.assertTrue(f"| `{name}` |" in scene or f"[{name}]" in scene, f"{name} is no key of scenes")
                if "scenes only" not in row[0] and "in the farm" not in row[0]:
                    self.assertIn(f'"{name}"', lists, f"{name} is no key of the farm's lists")

    def test_a_setting_has_one_name_in_the_spelling_of_each_host(self):
        """But where hosts have different things in its place: none of these names is another's."""
        plain = [{re.sub("_", "", name).lower() for cell in row[2:] for name in re.findall(r"`(\w+)`", cell)} for row in self.rows]
        same = [names for names in plain if len(names) == 1]
        self.assertGreater(len(same), 15)
        for row, names in zip(self.rows, plain):
            maya, houdini = ({name.lower() for name in re.findall(r"`(\w+)`", cell) if not name.endswith("List")} for cell in row[3:])
            if maya and houdini and "support" not in row[3] and "envelope" not in row[3] and "frameFrom" not in row[3]:
                self.assertEqual(maya, houdini, row[0])


if __name__ == "__main__":
    unittest.main()
