#!/usr/bin/env python3
"""Compiles the library for every platform whose Rust target is installed, and writes docs/reference/platforms.md.

What compiles is found here (cargo check); what runs is found by the commands that the page names.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "platforms.md"
HEAD = """# Platforms

For which platforms the library compiles, and how it is tried there. `make check-platforms` writes this page; a target that is not installed is
named (`rustup target add TARGET`).

| platform | target | compiles | how it is tried |
|---|---|---|---|
"""
TAIL = """
The version of glibc is read from the library itself: `python3 host_examples/python/backend/library_file.py FILE`.

| to build for | needs | then |
|---|---|---|
| Linux, glibc 2.17 and later | the network once, for 450 MB | `make wheel`: the library is inside, and in `target/x86_64-unknown-linux-gnu/release` |
| Windows | `apt install gcc-mingw-w64-x86-64-posix` | `cargo build --release --lib --target x86_64-pc-windows-gnu`: `shellwarp.dll`, and `libshellwarp.dll.a` to link to |
| WebAssembly | | `make wasm`: [WebAssembly](../guide/webassembly.md) |

The DLL needs `bcryptprimitives.dll`, which Windows has and Debian 12's Wine has not.
"""
PLATFORMS = [
    ("Linux, x86-64", "x86_64-unknown-linux-gnu", "`make test`; `make wheel` for glibc 2.17 and later"),
    ("Linux, ARM 64", "aarch64-unknown-linux-gnu", "not tried"),
    ("Windows, x86-64", "x86_64-pc-windows-gnu", "the DLL links and exports every function, by hand; not run"),
    ("WebAssembly", "wasm32-unknown-unknown", "`make test-wasm`, in node"),
    ("macOS, x86-64", "x86_64-apple-darwin", "not tried"),
    ("macOS, ARM 64", "aarch64-apple-darwin", "not tried"),
]


def main():
    installed = subprocess.run(["rustup", "target", "list", "--installed"], capture_output=True, text=True, check=True).stdout.split()
    rows, failed = [], False
    for name, target, tried in PLATFORMS:
        compiles = "not found out: the target is not installed"
        if target in installed:
            done = subprocess.run(["cargo", "check", "--locked", "--release", "--lib", "--target", target], cwd=ROOT, check=False)
            compiles, failed = ("yes", failed) if done.returncode == 0 else ("NO", True)
        rows.append(f"| {name} | `{target}` | {compiles} | {tried} |")
        print(rows[-1], flush=True)
    PAGE.write_text(HEAD + "\n".join(rows) + "\n" + TAIL, encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
