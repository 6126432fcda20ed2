"""What the pages name is there: functions and constants of the interface, files, make's targets."""

import re
import subprocess
import unittest

import links

ROOT = links.ROOT
NAME = r"\b(?:sw_|SW_|Sw[A-Z])\w+"
FILE = r"(?<![\w/.-])(?:src|tests|host_examples|include|cmake)/[\w./-]*\w"
TARGET = r"`make\s+([a-z][a-z-]*[a-z])(?![-\w])(?!-…)"
# History names what is gone, licences name files of others.
LEFT_OUT = ("CHANGELOG.md", "THIRD_PARTY.md")


def pages():
    names = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in names.splitlines() if name not in LEFT_OUT and (ROOT / name).exists()}


class Names(unittest.TestCase):
    def missing(self, pattern, is_there):
        return [f"{page}: {name}" for page, text in pages().items() for name in sorted(set(re.findall(pattern, text))) if not is_there(page, name)]

    def test_names_of_the_interface_are_in_the_header(self):
        known = set(re.findall(NAME, (ROOT / "include" / "shellwarp.h").read_text(encoding="utf-8")))
        known |= set(re.findall(r"fn (sw_\w+)", (ROOT / "src" / "ffi" / "memory.rs").read_text(encoding="utf-8")))   # of WebAssembly alone
        # SW_METHOD_... stands for all that begin so.
        self.assertEqual(self.missing(NAME, lambda _, name: name in known or name.endswith("_") and any(k.startswith(name) for k in known)), [])

    def test_files_are_there(self):
        self.assertEqual(self.missing(FILE, lambda page, name: (ROOT / name).exists() or ((ROOT / page).parent / name).exists()), [])

    def test_targets_of_make_are_there(self):
        targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
        self.assertEqual(self.missing(TARGET, lambda _, name: name in targets), [])

    def test_the_menu_of_the_site_has_every_page(self):
        listed = re.findall(r": ([\w/]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
        self.assertEqual(sorted(listed), sorted(name.removeprefix("docs/") for name in pages() if name.startswith("docs/")))

    def test_the_readme_is_short(self):
        self.assertLessEqual(len(pages()["README.md"].splitlines()), 120)


if __name__ == "__main__":
    unittest.main()
