#!/usr/bin/env python3
"""Packs the add-on, the Python package and built libraries into one zip that Blender installs; `make blender-addon` calls it.

    build_addon.py [--library build/lib/libshellwarp.so.0 …] [--out out/blender]

With libraries of several platforms it is one extension for all of them. They go in without debugging information. The same inputs give the same bytes.
"""

import argparse
import json
import platform
import re
import struct
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python" / "backend"))
from library_file import MACH_O, mach_o_machine, stripped  # noqa: E402 - of the wheel's builder

PACKAGE = HERE.parent / "python" / "shellwarp"
LICENCES = [HERE.parents[1] / name for name in ("LICENSE-MIT", "LICENSE-APACHE", "THIRD_PARTY.md")]
VERSION = re.search(r'^version = "(.*)"', (HERE.parents[1] / "Cargo.toml").read_text(encoding="utf-8"), re.M)[1]
DATE = (1980, 1, 1, 0, 0, 0)


def platform_tag(data):
    """Blender's name of the platform that a library is for."""
    if data[:4] == b"\x7fELF":
        return f"linux-{'arm64' if data[0x12] == 0xB7 else 'x64'}"
    if data[:2] == b"MZ":
        machine, = struct.unpack_from("<H", data, struct.unpack_from("<I", data, 0x3C)[0] + 4)
        return f"windows-{'arm64' if machine == 0xAA64 else 'x64'}"
    if data[:4] == MACH_O:
        return f"macos-{mach_o_machine(data).replace('x86_64', 'x64')}"
    return f"macos-{'arm64' if platform.machine().lower() in ('arm64', 'aarch64') else 'x64'}"


def load_name(tag):
    """What the package loads a library by."""
    return {"macos": "libshellwarp.dylib", "windows": "shellwarp.dll"}.get(tag.split("-", maxsplit=1)[0], "libshellwarp.so.0")


def built():
    """The library that CMake leaves on this machine."""
    return HERE.parents[1] / "build" / "lib" / load_name({"darwin": "macos", "win32": "windows"}.get(sys.platform, "linux"))


def contents(libraries):
    """Names in the zip and their bytes; `libraries` by platform, each in a folder of its own where there are several."""
    for path in sorted((HERE / "addon").glob("*.py")):
        yield path.name, path.read_bytes()
    manifest = (HERE / "addon" / "blender_manifest.toml").read_text(encoding="utf-8")
    own = f'version = "{VERSION}"\nplatforms = {json.dumps(list(libraries))}\n'
    yield "blender_manifest.toml", manifest.replace("\n[permissions]", f"\n{own}\n[permissions]").encode()
    for path in sorted(PACKAGE.glob("*.py")):
        yield f"shellwarp/{path.name}", path.read_bytes()
    for tag, library in libraries.items():
        yield f"shellwarp/{f'{tag}/' if len(libraries) > 1 else ''}{load_name(tag)}", stripped(library)
    for path in LICENCES:
        yield path.name, path.read_bytes()


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--library", type=Path, nargs="+", default=[built()], help="one of each platform")
    options.add_argument("--out", type=Path, default=HERE.parents[1] / "out" / "blender", help="the folder for shellwarp-blender-VERSION-PLATFORM.zip")
    given = options.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    libraries = {platform_tag(library.read_bytes()): library for library in sorted(given.library)}
    if len(libraries) < len(given.library):
        sys.exit("build_addon: two libraries are of one platform")
    path = given.out / f"shellwarp-blender-{VERSION}{f'-{next(iter(libraries))}' if len(libraries) == 1 else ''}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in contents(libraries):
            file.writestr(zipfile.ZipInfo(f"shellwarp/{name}", DATE), data, zipfile.ZIP_DEFLATED)
    print(path)


if __name__ == "__main__":
    main()
