"""THIRD_PARTY.md names what Cargo.lock has, each with a text, and its maker refuses what it does not know."""

import re
import sys
import unittest

import links

sys.path.insert(0, str(links.ROOT / "cmake"))
import third_party   # noqa: E402

PAGE = third_party.PAGE.read_text(encoding="utf-8")


class ThirdParty(unittest.TestCase):
    def test_every_version_stands_in_cargo_lock(self):
        locked = set(re.findall(r'name = "(.*)"\nversion = "(.*)"', (links.ROOT / "Cargo.lock").read_text(encoding="utf-8")))
        named = set(re.findall(r"^\| ([\w-]+) \| ([\d.]+) \| .* \| library \|$", PAGE, re.M))
        self.assertGreater(len(named), 40)
        self.assertEqual(named - locked, set())
        for name in ("faer", "nalgebra", "pulp", "rayon", "xxhash-rust"):   # what Cargo.toml asks for
            self.assertIn(name, {name for name, _ in named})

    def test_every_row_has_a_text(self):
        titles = ", ".join(re.findall(r"^### (.*)$", PAGE, re.M)).split(", ")
        rows = [f"{name} {version}".strip() for name, version in re.findall(r"^\| ([^|-][^|]*?) \| ([\d.]*) \| .* \| (?:library|command line) \|$", PAGE, re.M)]
        self.assertEqual(set(rows), set(titles))

    def test_one_licence_of_several_is_taken(self):
        self.assertEqual(third_party.terms("Apache-2.0 OR MIT"), ["MIT"])
        self.assertEqual(third_party.terms("MIT/Apache-2.0"), ["MIT"])
        self.assertEqual(third_party.terms("(MIT OR Apache-2.0) AND Unicode-3.0"), ["MIT", "Unicode-3.0"])
        with self.assertRaisesRegex(SystemExit, "unknown licence GPL-3.0"):
            third_party.terms("GPL-3.0")

    def test_a_crate_more_makes_the_page_stale(self):
        packages = third_party.crates()
        if packages is None:
            self.skipTest("not all crates are downloaded (cargo fetch --locked)")
        self.assertEqual(third_party.page(packages), PAGE)
        self.assertNotEqual(third_party.page(packages[1:]), PAGE)


if __name__ == "__main__":
    unittest.main()
