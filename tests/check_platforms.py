#!/usr/bin/env python3
"""Compiles the library for every platform whose Rust target is installed, and writes docs/reference/platforms.md.

What compiles, without a warning of clippy, is found here. What ran is what `make test-dist` and `make test-platforms` wrote to
build/dist/ran.json on this machine, and `make test-wasm` to build/dist/wasm.tap. A row for which nothing ran here stays as the page has it.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "platforms.md"
RAN = ROOT / "build" / "dist" / "ran.json"
TAP = RAN.with_name("wasm.tap")
HEAD = """# Platforms

For which platforms the library compiles, what ran there, and how.

`make check-platforms` writes this page from what it compiles, without a warning of clippy, and from what `make test-dist`, `make test-platforms` and
`make test-wasm` ran. A target that is not installed is named (`rustup target add TARGET`).

| platform | target | compiles | archive | tests | by | motion of a strip |
|---|---|---|---|---|---|---|
"""
TAIL = """
The tests are those in C and C++ and of the command line, and for WebAssembly those in JavaScript and of the npm package. Linux on x86-64 has more: `make test`.

The motion is that of `tests/callers`: a strip that is precomputed and stepped for 60 frames, its first eight digits of SHA-256. Equal digits are
equal bits. The strip's state is a plain one, and WebAssembly has no fused multiplication and addition. Deterministic states
(`SW_STATE_DETERMINISTIC`) of one saved model have the same bits on all platforms that ran, WebAssembly too: `tests/c/same_bits_test.c` and
`tests/wasm/same_bits.test.mjs` compare them with `tests/data/saved/same_bits.txt`.

macOS is built without Apple's kit, by zig, and never run. What its loader asks of a file is tested: the name inside, the libraries needed, the oldest
system, and on ARM the signature of every page. On a Mac, `make test` runs all tests.

The version of glibc is read from the library itself: `python3 host_examples/python/backend/library_file.py FILE`.

| to build for | needs | then |
|---|---|---|
| Linux, glibc 2.17 and later | the network once, for 450 MB | `make wheel`: the library is inside, and in `target/x86_64-unknown-linux-gnu/release` |
| Windows | `apt install gcc-mingw-w64-x86-64-posix` | `cargo build --release --lib --target x86_64-pc-windows-gnu`: `shellwarp.dll`, and `libshellwarp.dll.a` to link to |
| macOS | `sh cmake/bootstrap.sh portable`, `rustup target add aarch64-apple-darwin` | `python3 cmake/dist.py macos-aarch64`; on a Mac, `make cli` |
| WebAssembly | | `make wasm`: [WebAssembly](../guide/webassembly.md) |

The DLL needs `bcryptprimitives.dll`, which Windows has and Debian 12's Wine has not. It is built by mingw. Its C interface is that of Microsoft's compiler, too: the
archive has `lib/shellwarp.lib` for that linker, and a test links to it by a linker of that kind. Rust's own target for Microsoft's tools needs their C library, which
cannot be had here.
"""
PLATFORMS = [
    ("Linux, x86-64", "x86_64-unknown-linux-gnu", "linux-x86_64"),
    ("Linux, ARM 64", "aarch64-unknown-linux-gnu", "linux-aarch64"),
    ("Windows, x86-64", "x86_64-pc-windows-gnu", "windows-x86_64"),
    ("WebAssembly", "wasm32-unknown-unknown", "wasm32"),
    ("macOS, x86-64", "x86_64-apple-darwin", "macos-x86_64"),
    ("macOS, ARM 64", "aarch64-apple-darwin", "macos-aarch64"),
]


def in_node():
    """What `make test-wasm` said, in the words of ran.json."""
    if not TAP.exists():
        return {}
    said = TAP.read_text(encoding="utf-8")
    names = re.findall(r"^not ok \d+ - (.*)$", said, re.M)
    return {"system": "npm package", "passed": int(re.search(r"^# pass (\d+)$", said, re.M)[1]), "failed": names, "by": "node",
            "strip": re.search(r"^ *# strip (\w+)$", said, re.M)[1]}


def cells(name, before):
    """Archive, tests, by what, motion: of what ran on this machine, or as they were before."""
    if name == "wasm32":
        ran = in_node()
    else:
        ran = (json.loads(RAN.read_text(encoding="utf-8")) if RAN.exists() else {}).get(name)
    if not ran:
        return before
    failed = ran.get("failed", [])
    tests = f"{ran['passed']} passed" + (f", {len(failed)} failed: {', '.join(failed)}" if failed else "") if "passed" in ran else "not run"
    return [ran.get("system", "not run"), tests, ran.get("by", ""), ran.get("strip", "")[:8]]


def main():
    installed = subprocess.run(["rustup", "target", "list", "--installed"], capture_output=True, text=True, check=True).stdout.split()
    page = {row[1].strip("` "): [cell.strip() for cell in row[3:-1]]
            for row in (line.split("|")[1:] for line in PAGE.read_text(encoding="utf-8").splitlines()) if len(row) == 8}
    rows, failed = [], False
    for name, target, archive in PLATFORMS:
        compiles = "not found out: the target is not installed"
        if target in installed:
            done = subprocess.run(["cargo", "clippy", "--locked", "--lib", "--target", target, "--", "-D", "warnings"], cwd=ROOT, check=False)
            compiles, failed = ("yes", failed) if done.returncode == 0 else ("NO", True)
        rest = cells(archive, page.get(target, ["not run", "", "", ""]))
        rows.append(f"| {name} | `{target}` | {compiles} | {' | '.join(rest)} |")
        print(rows[-1], flush=True)
    PAGE.write_text(HEAD + "\n".join(rows) + "\n" + TAIL, encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
