"""The Python package `shellwarp` and the library under it: the copies beside the add-on, or installed ones."""

import importlib
from pathlib import Path

from . import preferences

_package = None


def package():
    """The package, its library loaded: from the path in the preferences if there is one, else as the package finds it.

    Raises the package's LibraryNotFoundError or ImportError, whose texts say what is missing.
    """
    global _package
    if _package is None:
        beside = (Path(__file__).parent / "shellwarp" / "__init__.py").is_file()
        module = importlib.import_module(f"{__package__}.shellwarp" if beside else "shellwarp")
        module.load(preferences.library_path() or None)
        _package = module
    return _package
