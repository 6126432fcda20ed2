"""Finding and loading libshellwarp, and calling it.

Looked for, in this order: the path given to load(), the file named by SHELLWARP_LIBRARY, this package's own folder, the
library folder of the checkout or installation that this package lies in, and last the system's loader.
"""

import ctypes
import os
import re
import sys
import threading
from pathlib import Path

from . import _abi
from .errors import CLASSES, LibraryNotFoundError, ShellwarpError

FILE_NAME = {"win32": "shellwarp.dll", "darwin": "libshellwarp.dylib"}.get(sys.platform, "libshellwarp.so.0")
HERE = Path(__file__).resolve().parent

_lock = threading.Lock()
_loaded = None


def load(path: "str | os.PathLike[str] | None" = None) -> ctypes.CDLL:
    """Loads the library, from `path` if given. Happens by itself at the first use; a second call must name the same file."""
    global _loaded
    with _lock:
        if _loaded is None:
            _loaded = _open(path)
            from . import log  # which uses this module
            log._set(_loaded, log.warn)
        elif path is not None and not _same_file(path, _loaded._name):
            raise LibraryNotFoundError(f"{_loaded._name} is loaded already; {path} would need a new process")
        return _loaded


def library_path() -> str:
    """The file, or the plain name, that the library was loaded by."""
    return load()._name


def version() -> str:
    """Version of the library, such as "0.1.0"."""
    return load().sw_version_string().decode()


def call(name, *arguments):
    """Calls a function that returns a status, and raises what it tells."""
    library = load()
    status = getattr(library, name)(*arguments)
    if status != _abi.SW_OK:
        message = _in_python(library.sw_last_error_message().decode("utf-8", "replace"))
        raise CLASSES.get(status, ShellwarpError)(message, status)


def _in_python(message):
    """A message without C's names of structs and lengths: "material->young_across" is young_across here, "desc->n_factors" the number of factors."""
    return re.sub(r"\b[a-z_]+->", "", re.sub(r"\b[a-z_]+->n_([a-z_]+)", r"the number of \1", message))


def initialised(struct):
    """A descriptor or report of the class `struct`, at its defaults."""
    desc = struct()
    load().sw_struct_init(ctypes.byref(desc), ctypes.sizeof(desc))
    return desc


def _candidates():
    if os.environ.get("SHELLWARP_LIBRARY"):
        return [os.environ["SHELLWARP_LIBRARY"]]  # who names a file means that one
    roots = HERE.parents
    places = [HERE / FILE_NAME]
    if len(roots) > 2:  # host_examples/python/shellwarp in a checkout, share/shellwarp/python/shellwarp when installed
        places += [roots[2] / "build" / "lib" / FILE_NAME]
    if len(roots) > 3:
        places += [roots[3] / folder / FILE_NAME for folder in ("lib", "lib64", "bin")]
    return [str(place) for place in places if place.is_file()] + [FILE_NAME]


def _open(path):
    failures = []
    for candidate in [os.fspath(path)] if path else _candidates():
        try:
            return _declare(ctypes.CDLL(candidate), candidate)
        except OSError as error:
            failures.append(str(error))
    raise LibraryNotFoundError("libshellwarp cannot be loaded: " + "; ".join(failures))


def _declare(library, path):
    library.sw_abi_version.restype = ctypes.c_uint32
    if library.sw_abi_version() < _abi.SW_ABI_VERSION:
        raise LibraryNotFoundError(f"{path}: interface version {library.sw_abi_version()}, "
                                   f"this package needs {_abi.SW_ABI_VERSION} or newer")
    for name, (result, parameters) in _abi.FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, parameters
    return library


def _same_file(path, other):
    try:
        return os.path.samefile(path, other)
    except OSError:
        return False
