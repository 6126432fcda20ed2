"""Builds the wheel: the package, a built library inside, and the licences. pip calls it (PEP 517).

It needs nothing but Python, so `pip install ./host_examples/python` works without a network once cargo has its crates. The library is
the file that SHELLWARP_LIBRARY names, else the one that `cargo build` makes of the checkout. The same inputs give the same bytes.
"""

import base64
import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from library_file import platform_tag, stripped

try:
    import tomllib
except ImportError:   # Python 3.10
    import tomli as tomllib

HERE = Path(__file__).resolve().parents[1]
ROOT = HERE.parents[1]
LICENCES = ("LICENSE-MIT", "LICENSE-APACHE", "THIRD_PARTY.md")
DATE = (1980, 1, 1, 0, 0, 0)
BUILT = {"win32": "shellwarp.dll", "darwin": "libshellwarp.dylib"}.get(sys.platform, "libshellwarp.so")


def project():
    """The project table, its version from Cargo.toml: the one place where it is written."""
    table = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["package"]
    return {**table, "version": cargo["version"]}


def metadata():
    table = project()
    lines = ["Metadata-Version: 2.4", f"Name: {table['name']}", f"Version: {table['version']}", f"Summary: {table['description']}",
             f"License-Expression: {table['license']}", *(f"License-File: {name}" for name in LICENCES),
             f"Requires-Python: {table['requires-python']}", *(f"Requires-Dist: {need}" for need in table["dependencies"]),
             "Description-Content-Type: text/markdown", "", (HERE / table["readme"]).read_text(encoding="utf-8")]
    return "\n".join(lines).encode()


def library():
    """The file to put inside."""
    if os.environ.get("SHELLWARP_LIBRARY"):
        return Path(os.environ["SHELLWARP_LIBRARY"])
    cargo = os.environ.get("CARGO") or shutil.which("cargo") or Path.home() / ".cargo" / "bin" / "cargo"
    subprocess.run([cargo, "build", "--locked", "--release", "--lib"], cwd=ROOT, check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target") / "release" / BUILT


def load_name(data):
    """What the package loads it by."""
    return "libshellwarp.so.0" if data[:4] == b"\x7fELF" else "shellwarp.dll" if data[:2] == b"MZ" else "libshellwarp.dylib"


def write(folder, files, tag, pure):
    """Writes the wheel of {name: bytes} and returns its name."""
    name, version = project()["name"], project()["version"]
    info = f"{name}-{version}.dist-info"
    files = {**files, f"{info}/METADATA": metadata(), **{f"{info}/licenses/{name}": (ROOT / name).read_bytes() for name in LICENCES},
             f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: shellwarp_wheel\nRoot-Is-Purelib: {str(pure).lower()}\nTag: {tag}\n".encode()}
    record = []
    path = Path(folder) / f"{name}-{version}-{tag}.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        for file, data in sorted(files.items()):
            wheel.writestr(zipfile.ZipInfo(file, DATE), data, zipfile.ZIP_DEFLATED)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{file},sha256={digest},{len(data)}")
        record.append(f"{info}/RECORD,,\n")
        wheel.writestr(zipfile.ZipInfo(f"{info}/RECORD", DATE), "\n".join(record), zipfile.ZIP_DEFLATED)
    return path.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    data = stripped(library())
    files = {f"shellwarp/{path.name}": path.read_bytes() for path in (HERE / "shellwarp").iterdir() if path.suffix in (".py", ".typed")}
    return write(wheel_directory, {**files, f"shellwarp/{load_name(data)}": data}, f"py3-none-{platform_tag(data)}", pure=False)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """`pip install -e`: a line that leads to the checkout, whose build/lib has the library (make cli)."""
    return write(wheel_directory, {"shellwarp.pth": f"{HERE}\n".encode()}, "py3-none-any", pure=True)


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("a source package would lack the Rust sources: build a wheel from the checkout")


if __name__ == "__main__":   # shellwarp_wheel.py FOLDER
    Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
    print(Path(sys.argv[1]) / build_wheel(sys.argv[1]))
