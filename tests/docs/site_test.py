"""`make docs` builds a site without a broken link, with every page in its menu, that works from a folder without a network.

usage: site_test.py FOLDER
"""

import json
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path
from urllib.parse import unquote

import links

FOLDER = Path(sys.argv.pop(1)).resolve()
# Addresses that a reader may click; all else that a page loads must lie beside it.
LOADED = re.compile(r"""<(?:script|img|link|iframe|source)\b[^>]*?\b(?:src|href)=["']?([^"' >]+)""")
LINKED = re.compile(r"""<a\b[^>]*?\bhref=["']?([^"' >]+)""")


def pages():
    return {path.relative_to(FOLDER): path.read_text(encoding="utf-8") for path in sorted(FOLDER.rglob("*.html"))}


def target(page, address):
    return (FOLDER / page).parent / unquote(address.split("#")[0].split("?")[0])


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", FOLDER], cwd=links.ROOT, capture_output=True, text=True,
                              check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
        if done.returncode:
            raise AssertionError(done.stdout + done.stderr)

    def test_every_page_of_docs_is_in_the_site(self):
        for page in (links.ROOT / "docs").rglob("*.md"):
            name = page.relative_to(links.ROOT / "docs").with_suffix(".html")
            name = name.with_name("index.html") if name.name == "README.html" else name
            self.assertIn(name, pages())

    def test_all_that_a_page_loads_lies_beside_it(self):
        for page, text in pages().items():
            for address in LOADED.findall(text):
                if address.startswith("data:") or page.name == "404.html" or 'rel="canonical"' in address:
                    continue
                self.assertNotRegex(address, r"^(\w+:)?//", page)
                self.assertTrue(target(page, address).exists(), (page, address))

    def test_every_link_to_a_page_or_heading_leads_there(self):
        texts, seen = pages(), 0
        for page, text in texts.items():
            for address in LINKED.findall(text):
                if re.match(r"\w+:", address) or page.name == "404.html":
                    continue
                place = target(page, address) if not address.startswith("#") else FOLDER / page
                self.assertTrue(place.exists(), (page, address))
                anchor = unquote(address.partition("#")[2])
                if anchor and place.suffix == ".html":
                    self.assertRegex(texts[place.resolve().relative_to(FOLDER)], rf"""\bid=["']?{re.escape(anchor)}["' >]""", (page, address))
                    seen += 1
        self.assertGreater(seen, 100)

    def test_the_search_finds_words_of_each_section_without_a_server(self):
        index = (FOLDER / "search" / "search_index.js").read_text(encoding="utf-8")   # a script: pages opened as files may load it
        found = json.loads(index.partition("=")[2].rstrip().rstrip(";"))["docs"]
        for word, page in (("sw_state_certify", "reference/api.html"), ("k_bend", "reference/scene.html"), ("precompute", "guide/python.html"),
                           ("dihedral", "theory/energies.html"), ("certificate", "evidence/robustness.html")):
            self.assertTrue(any(doc["location"].startswith(page) and word in doc["text"] + doc["title"] for doc in found), (word, page))

    def test_a_browser_opens_it_as_a_file_and_its_search_finds(self):
        names = [os.environ.get("CHROMIUM"), *map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))]
        browser = next((name for name in names if name), None)
        if browser is None:
            self.skipTest("no Chromium (set CHROMIUM, or apt install chromium)")
        # Thirty seconds of the page's own time, which passes while nothing is left to do.
        done = subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={FOLDER.parent / 'browser'}",
                               "--virtual-time-budget=30000", "--dump-dom", (FOLDER / "index.html").as_uri() + "?q=sw_state_certify"],
                              capture_output=True, text=True, check=False)
        found = re.findall(r'<a href="([^"]*)" class="md-search-result__link"', done.stdout)
        self.assertTrue(any("reference/api.html" in link for link in found), done.stdout[-3000:] + done.stderr[-2000:])


if __name__ == "__main__":
    unittest.main()
