"""docs/guide/python.md is true: its program runs, and the names it lists are there."""

import re
import unittest
from pathlib import Path

import shellwarp as sw

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "guide" / "python.md").read_text(encoding="utf-8")


class Docs(unittest.TestCase):
    def test_the_first_scene_runs_and_leads_its_corner(self):
        program = re.search(r"```python\n(.*?)```", PAGE, flags=re.S)[1]
        names = {}
        exec(compile(program, "docs/guide/python.md", "exec"), names)
        # hard handles are met to a millionth of the size, 2.2, and float32
        self.assertLess(abs(names["seen"][230] - [1.9, 1, 0.356]).max(), 5e-6)
        self.assertLess(len(names["saved"]), 2048)
        self.assertEqual(names["state"].report()["turn_in_range"], 1)

    def test_the_names_listed_exist_and_none_is_left_out(self):
        row = next(line for line in PAGE.split("\n") if line.startswith("| names |"))
        for owner, kind in (("Model", sw.Model), ("State", sw.State)):
            listed = set(re.findall(r"`(\w+)`", re.search(rf"`{owner}`:(.*?)(?:;|\. )", row)[1]))
            public = {name for name in vars(kind) if not name.startswith("_")}
            self.assertEqual(listed, public)


if __name__ == "__main__":
    unittest.main()
