#!/usr/bin/env python3
"""Packs the add-on, the Python package and a built library into one zip that Blender installs; `make blender-addon` calls it.

    build_addon.py [--library build/lib/libshellwarp.so.0] [--out out/blender]

The library goes in without debugging information. The same inputs give the same bytes.
"""

import argparse
import platform
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python" / "backend"))
from library_file import stripped  # noqa: E402 - of the wheel's builder

PACKAGE = HERE.parent / "python" / "shellwarp"
LICENCES = [HERE.parents[1] / name for name in ("LICENSE-MIT", "LICENSE-APACHE", "THIRD_PARTY.md")]
DATE = (1980, 1, 1, 0, 0, 0)


def platform_tag():
    """Blender's name of this machine."""
    system = {"linux": "linux", "darwin": "macos", "win32": "windows"}[sys.platform]
    return f"{system}-{'arm64' if platform.machine().lower() in ('arm64', 'aarch64') else 'x64'}"


def load_name():
    return {"darwin": "libshellwarp.dylib", "win32": "shellwarp.dll"}.get(sys.platform, "libshellwarp.so.0")


def contents(library, tag):
    """Names in the zip and their bytes."""
    for path in sorted((HERE / "addon").glob("*.py")):
        yield path.name, path.read_bytes()
    manifest = (HERE / "addon" / "blender_manifest.toml").read_text(encoding="utf-8")
    yield "blender_manifest.toml", manifest.replace("\n[permissions]", f'\nplatforms = ["{tag}"]\n\n[permissions]').encode()
    for path in sorted(PACKAGE.glob("*.py")):
        yield f"shellwarp/{path.name}", path.read_bytes()
    yield f"shellwarp/{load_name()}", stripped(library)
    for path in LICENCES:
        yield path.name, path.read_bytes()


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    options.add_argument("--library", type=Path, default=HERE.parents[1] / "build" / "lib" / load_name())
    options.add_argument("--out", type=Path, default=HERE.parents[1] / "out" / "blender", help="the folder for shellwarp-blender-VERSION-PLATFORM.zip")
    given = options.parse_args()
    manifest = (HERE / "addon" / "blender_manifest.toml").read_text(encoding="utf-8")
    version = manifest.split('\nversion = "', 1)[1].split('"', 1)[0]
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / f"shellwarp-blender-{version}-{platform_tag()}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in contents(given.library, platform_tag()):
            file.writestr(zipfile.ZipInfo(f"shellwarp/{name}", DATE), data, zipfile.ZIP_DEFLATED)
    print(path)


if __name__ == "__main__":
    main()
