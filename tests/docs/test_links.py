"""The link checker finds what is broken, and the repository has nothing that is."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import links


def broken(files):
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        subprocess.run(["git", "init", "--quiet"], cwd=root, check=True)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        return list(links.broken(root))


class Links(unittest.TestCase):
    def test_every_link_of_the_repository_leads_somewhere(self):
        self.assertEqual(list(links.broken(links.ROOT)), [])

    def test_a_missing_file_is_found(self):
        self.assertEqual(broken({"a.md": "[x](b.md) ![y](c.png)"}), ["a.md: no file b.md", "a.md: no file c.png"])

    def test_a_missing_heading_is_found(self):
        pages = {"a.md": "[x](b.md#one-and-two) [y](b.md#three) [z](#here)\n# Here", "b.md": "# One, and `two`?\n"}
        self.assertEqual(broken(pages), ["a.md: no heading b.md#three"])

    def test_a_page_named_by_a_source_must_exist(self):
        self.assertEqual(broken({"a.rs": "//! See docs/gone.md."}), ["a.rs: no page docs/gone.md"])

    def test_program_text_has_no_links(self):
        self.assertEqual(broken({"a.md": "`f[i](x)`\n\n```\nf[i](x)\n```\n"}), [])


if __name__ == "__main__":
    unittest.main()
