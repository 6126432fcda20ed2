"""The Python package `shellwarp` and the library under it: the copies beside the add-on, or installed ones."""

import importlib
import platform
import sys
from pathlib import Path

from . import preferences

_package = None


def ours(folder):
    """This platform's library in a zip that has several, "" in others."""
    system = {"linux": "linux", "darwin": "macos", "win32": "windows"}.get(sys.platform, "")
    machine = "arm64" if platform.machine().lower() in ("arm64", "aarch64") else "x64"
    return next((str(path) for path in (folder / f"{system}-{machine}").glob("*shellwarp.*")), "")


def package():
    """The package, its library loaded: from the path in the preferences if there is one, else as the package finds it.

    Raises the package's LibraryNotFoundError or ImportError, whose texts say what is missing.
    """
    global _package
    if _package is None:
        beside = (Path(__file__).parent / "shellwarp" / "__init__.py").is_file()
        module = importlib.import_module(f"{__package__}.shellwarp" if beside else "shellwarp")
        module.load(preferences.library_path() or ours(Path(module.__file__).parent) or None)
        _package = module
    return _package
