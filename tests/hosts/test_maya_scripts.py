"""The scripts of the Maya module, run against a stand-in for maya.cmds that records what is called."""

import os
import sys
import types
import unittest

SCRIPTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "host_examples", "maya", "module", "scripts")
sys.dont_write_bytecode = True


class Cmds(types.ModuleType):
    """The commands that the scripts use; another name is an error, as in Maya."""

    KNOWN = {"menu", "menuItem", "deleteUI", "headsUpDisplay", "shelfButton", "tabLayout", "about", "shellWarp", "ls", "listHistory", "warning", "fileDialog2"}

    def __init__(self):
        super().__init__("maya.cmds")
        self.calls = []
        self.batch = False
        self.there = set()
        self.shells, self.chosen = [], None

    def __getattr__(self, name):
        if name not in self.KNOWN:
            raise AttributeError(name)
        return lambda *names, **flags: self.call(name, names, flags)

    def call(self, command, names, flags):
        self.calls.append((command, names, flags))
        if command == "about":
            return self.batch
        if flags.get("exists"):
            return names[0] in self.there
        if command in ("menu", "headsUpDisplay") and names:
            (self.there.discard if flags.get("remove") else self.there.add)(names[0])
        if command == "deleteUI":
            self.there.discard(names[0])
        return {"tabLayout": "Custom", "shellWarp": ["shellWarp1: certified"] if "certify" in flags else "shellWarp1: told", "ls": self.shells, "headsUpDisplay": 3, "listHistory": ["a"], "fileDialog2": self.chosen}.get(command)

    def of(self, command):
        return [(names, flags) for known, names, flags in self.calls if known == command]


class Scripts(unittest.TestCase):
    def setUp(self):
        self.cmds = Cmds()
        self.mel = types.ModuleType("maya.mel")
        self.evaluated = []
        self.mel.eval = lambda text: self.evaluated.append(text) or "result of " + text
        maya = types.ModuleType("maya")
        maya.cmds, maya.mel = self.cmds, self.mel
        sys.modules.update({"maya": maya, "maya.cmds": self.cmds, "maya.mel": self.mel})
        sys.path.insert(0, SCRIPTS)
        sys.modules.pop("shellwarp_maya", None)
        import shellwarp_maya
        self.scripts = shellwarp_maya

    def tearDown(self):
        sys.path.remove(SCRIPTS)

    def test_the_menu_has_the_commands_and_its_python_runs(self):
        self.scripts.create_menu()
        items = self.cmds.of("menuItem")
        commands = [flags["command"] for _, flags in items if flags.get("sourceType") == "mel"]
        self.assertEqual(commands, ["shellWarp", "shellWarp -handle", "shellWarp -collider", "shellWarp -tie", "shellWarp -crease", "shellWarp -contactPatches",
                                    *["shellWarp -supportAxes " + axis for axis in "xyz"]])
        for _, flags in items:
            self.assertEqual(flags["parent"], "shellWarpMenu")
            if flags.get("sourceType") == "python":
                exec(flags["command"], {})

    def test_frames_are_written_to_the_file_that_is_chosen(self):
        self.scripts.write_frames()
        self.assertEqual(self.cmds.of("shellWarp"), [])
        self.cmds.chosen = ["/shots/one.swframes"]
        self.scripts.write_frames()
        self.assertEqual(self.cmds.of("shellWarp"), [((), {"writeCache": "/shots/one.swframes"}), ((), {"certify": True})])

    def test_loading_twice_leaves_one_menu_and_unloading_none(self):
        self.scripts.create_menu()
        self.scripts.create_menu()
        self.assertEqual(len(self.cmds.of("deleteUI")), 1)
        self.assertEqual(self.cmds.there, {"shellWarpMenu", "shellWarpStatus"})
        self.scripts.delete_menu()
        self.assertEqual(self.cmds.there, set())

    def test_there_is_no_menu_without_a_window(self):
        self.cmds.batch = True
        self.scripts.create_menu()
        self.scripts.delete_menu()
        self.assertEqual({command for command, _, _ in self.cmds.calls}, {"about"})

    def test_the_viewport_shows_what_shells_have_to_tell(self):
        self.scripts.create_menu()
        _, flags = [call for call in self.cmds.of("headsUpDisplay") if "command" in call[1]][0]
        self.assertTrue(flags["attachToRefresh"])
        self.assertEqual(flags["command"](), "shellWarp1: told")

    def test_the_open_shelf_gets_a_button_for_each_action(self):
        self.scripts.add_to_shelf()
        buttons = self.cmds.of("shelfButton")
        self.assertEqual([flags["command"] for _, flags in buttons], [command for _, command, _ in self.scripts.ACTIONS])
        icons = os.path.join(SCRIPTS, "..", "icons")
        for _, flags in buttons:
            self.assertEqual(flags["parent"], "Custom")
            self.assertTrue(os.path.exists(os.path.join(icons, flags["image"])))

    def test_painting_takes_the_selected_shell_and_says_where_there_is_none(self):
        self.scripts.paint()
        self.assertEqual(len(self.cmds.of("warning")), 1)
        self.cmds.shells = ["shellWarp3"]
        self.scripts.paint()
        self.assertIn("shellWarp.shellWarp3.supportWeights", self.evaluated[-1])
        self.scripts.paint("shellWarp4", "thicknessMap")
        self.assertIn("shellWarp.shellWarp4.thicknessMap", self.evaluated[-1])


if __name__ == "__main__":
    unittest.main()
