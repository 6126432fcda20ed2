#!/usr/bin/env python3
"""What must be so before a release is tagged, beside the tests: the tree, the version, the changelog; `make release-check` calls it."""

import datetime
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(encoding="utf-8"), re.M)[1]


def git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def facts():
    """What is wrong, a line each."""
    if changed := git("status", "--short"):
        yield f"files that no commit has:\n{changed}"
    heading = re.search(r"^## (.*)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)[1]
    found = re.fullmatch(rf"{re.escape(VERSION)} \((\d{{4}}-\d\d-\d\d)\)", heading)
    if not found:
        yield f"CHANGELOG.md begins with {heading!r}, not with '{VERSION} (date as 2026-01-31)'"
    elif abs((datetime.date.fromisoformat(found[1]) - datetime.date.today()).days) > 3:
        yield f"CHANGELOG.md dates {VERSION} to {found[1]}, and today is {datetime.date.today()}"
    if f"v{VERSION}" in git("tag", "--list").split():
        yield f"there is a tag v{VERSION} already: set another version in Cargo.toml"
    header = (ROOT / "include" / "shellwarp.h").read_bytes()
    if not git("tag", "--list") and (ROOT / "tests" / "growth" / "first" / "shellwarp.h").read_bytes() != header:
        yield "tests/growth/first is not the header of this first release: make header FIRST=1"


def main():
    wrong = list(facts())
    for line in wrong:
        print(f"release-facts: {line}")
    print(f"release-facts: {VERSION}: {'FAILED' if wrong else 'OK'}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
