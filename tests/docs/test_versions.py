"""The version and the Rust that is needed are the same wherever they are written."""

import re
import unittest

import links

ROOT = links.ROOT


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def value(text, key):
    return re.search(rf'^{key} = "([^"]+)"', text, re.M)[1]


class Versions(unittest.TestCase):
    def test_the_changelog_has_cargos_version(self):
        version = value(read("Cargo.toml").split("[package]")[1], "version")
        self.assertEqual(re.search(r"^## ([\d.]+)", read("CHANGELOG.md"), re.M)[1], version)

    def test_packages_and_pages_write_none_of_their_own(self):
        self.assertIn('dynamic = ["version"]', read("host_examples/python/pyproject.toml"))
        for name in ("host_examples/blender/addon/blender_manifest.toml", "host_examples/npm/package.json"):
            self.assertNotRegex(read(name), r'(?m)^\s*"?version"?\s*[:=]', name)
        for page in (ROOT / "docs").rglob("*.md"):
            self.assertNotRegex(page.read_text(encoding="utf-8"), r"shellwarp-(blender-|npm-)?\d+\.\d+\.\d+", page)

    def test_one_rust_version_is_asked_for(self):
        needed = value(read("Cargo.toml"), "rust-version")
        for name in ("Cargo.toml", "tests/growth/Cargo.toml", "tests/report/Cargo.toml"):
            self.assertIn("rust-version.workspace = true", read(name), name)
        self.assertEqual(value(read("tests/fuzz/Cargo.toml"), "rust-version"), needed)
        for name in ("README.md", "CONTRIBUTING.md", "cmake/bootstrap.sh"):
            self.assertEqual(set(re.findall(r"Rust (\d+\.\d+)", read(name))), {needed}, name)


if __name__ == "__main__":
    unittest.main()
