#!/usr/bin/env python3
"""Writes THIRD_PARTY.md: what the binaries contain of others, and the licence of each; `make notices` calls it.

    third_party.py [--check]

Crates come from Cargo.lock by `cargo metadata`, without the network: those that are linked into the library, on any platform. The headers
come from host_examples/third_party. With --check nothing is written: the exit code is 1 where the file is not current. Where not all crates
are downloaded, a line that begins with "skipped: " says so.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "THIRD_PARTY.md"
# Of several licences that a crate may be taken under, the first of these is.
PREFERRED = ("MIT", "Zlib", "BSL-1.0", "BSD-3-Clause", "Apache-2.0", "ISC", "Unicode-3.0")
NAMED = {"MIT": r"MIT", "Apache-2.0": r"APACHE", "Zlib": r"ZLIB", "BSL-1.0": r"BOOST|BSL", "BSD-3-Clause": r"BSD", "ISC": r"ISC", "Unicode-3.0": r"UNICODE"}

HEAD = """# Third-party software

What the binaries of shellwarp contain beside shellwarp itself, and under which licences. `make notices` writes this page.

**ONLY are under Apache-2.0 alone.** So whoever passes a binary on does it under the terms of Apache-2.0, also where shellwarp's own
sources are taken under MIT. The page that `make report` writes has three.js in it, under MIT; no binary has.

"""
STANDARD = """Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the
"Software"), to deal in the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish,
distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so, subject to the
following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY
CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE
SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE."""


def cargo(*words):
    done = subprocess.run(["cargo", *words, "--locked", "--offline"], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else None


def crates():
    """The packages that are linked into the library on some platform; None where not all are downloaded."""
    # cargo metadata alone would list optional dependencies that no feature turns on, too.
    tree = cargo("tree", "--package", "shellwarp", "--edges", "normal,no-proc-macro", "--target", "all", "--prefix", "none", "--format", "{p}")
    data = cargo("metadata", "--format-version", "1")
    if tree is None or data is None:
        return None
    linked = {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}
    found = [package for package in json.loads(data)["packages"] if package["source"] and (package["name"], f"v{package['version']}") in linked]
    return sorted(found, key=lambda package: (package["name"], package["version"]))


def terms(expression):
    """The licences that a crate is taken under: one of each "or"."""
    chosen = []
    for part in re.split(r"\bAND\b", expression.replace("(", " ").replace(")", " ")):
        offered = [name.strip() for name in re.split(r"\bOR\b|/", part)]
        chosen.append(next((name for name in PREFERRED if name in offered), None) or sys.exit(f"third_party: unknown licence {expression}"))
    return chosen


def texts(folder, names, authors):
    """The texts of licences that stand in a crate's folder, or MIT's own words where it has none."""
    files = sorted(path for path in folder.iterdir() if re.match(r"(LICEN[CS]E|COPYING|NOTICE)", path.name, re.I) and path.is_file())
    found = []
    for name in names:
        fitting = [path for path in files if re.search(NAMED[name], path.name, re.I)] or [path for path in files if re.fullmatch(r"(LICEN[CS]E|COPYING)(\.\w+)?", path.name, re.I)]
        if fitting:
            found.append(fitting[0].read_text(encoding="utf-8"))
        elif name == "MIT":
            found.append(f"Copyright (c) {', '.join(re.sub(r' *<[^>]*>', '', author) for author in authors) or 'its authors'}\n\n{STANDARD}")
        else:
            sys.exit(f"third_party: {folder.name} has no text of {name}")
    return found + [path.read_text(encoding="utf-8") for path in files if path.name.upper().startswith("NOTICE")]


def entries(packages):
    """Name, version, licences as offered and as taken, and texts, of all that the binaries contain."""
    yield "Rust's standard library", "", "MIT OR Apache-2.0", ["MIT"], [f"Copyright (c) The Rust Project Contributors\n\n{STANDARD}"], "library"
    for package in packages:
        taken = terms(package["license"])
        yield package["name"], package["version"], package["license"], taken, texts(Path(package["manifest_path"]).parent, taken, package["authors"]), "library"
    readme = (ROOT / "host_examples" / "third_party" / "README.md").read_text(encoding="utf-8")
    for folder, version, licence in re.findall(r"^\| `(\w+)/` \| ([\d.]+) \| ([\w.-]+) \|", readme, re.M):
        text = (ROOT / "host_examples" / "third_party" / folder / "LICENSE").read_text(encoding="utf-8")
        yield folder, version, licence, [licence], [text], "command line"


def page(packages):
    rows, groups = [], {}
    for name, version, offered, taken, found, where in entries(packages):
        rows.append(f"| {name} | {version} | {offered} | {' and '.join(taken)} | {where} |")
        for text in found:
            lines = "\n".join(line.rstrip() for line in text.replace("\r\n", "\n").strip("\n").split("\n"))
            groups.setdefault(re.sub(r"\s+", " ", lines).strip(), (lines, []))[1].append(f"{name} {version}".strip())
    only = [package["name"] for package in packages if terms(package["license"]) == ["Apache-2.0"]]
    head = HEAD.replace("ONLY", f"{', '.join(only[:-1])} and {only[-1]}") + "| name | version | offered under | taken under | in |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n\n## Texts\n"
    return head + "".join(f"\n### {', '.join(names)}\n\n~~~text\n{text}\n~~~\n" for text, names in groups.values())


def main():
    packages = crates()
    if packages is None:
        print("skipped: licences of what the binaries contain: not all crates are downloaded (cargo fetch --locked)")
        return 0
    text = page(packages)
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
        print(f"{PAGE.name}: {len(packages)} crates")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        print("THIRD_PARTY.md is not current: make notices", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
