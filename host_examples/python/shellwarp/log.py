"""The library's log messages: warnings become Python's own unless set_log sends them elsewhere."""

import ctypes
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

from . import _abi, _library
from .errors import ShellwarpWarning

_LEVELS = {_abi.SW_LOG_INFO: "info", _abi.SW_LOG_WARNING: "warning"}
_HERE = str(Path(__file__).resolve().parent)
_kept = []  # a call under way on another thread may use the old callback once more: none is ever freed


def warn(level: str, message: str) -> None:
    """The receiver unless set_log sets another: the library's warnings as ShellwarpWarning of the line that called this package."""
    if level != "warning":
        return
    depth, frame = 1, sys._getframe()
    while frame.f_back is not None and str(Path(frame.f_code.co_filename).resolve().parent) == _HERE:
        depth, frame = depth + 1, frame.f_back
    warnings.warn(message, ShellwarpWarning, stacklevel=depth)


def set_log(receiver: "Callable[[str, str], None] | None") -> None:
    """Sends the library's messages to `receiver(level, message)`, level "info" or "warning"; None stops them. Without a call, warnings are
    Python's own, of ShellwarpWarning; `set_log(shellwarp.log.warn)` brings that back.

    For the whole process. What the receiver raises goes to sys.unraisablehook.
    """
    _set(_library.load(), receiver)


def _set(library: ctypes.CDLL, receiver: "Callable[[str, str], None] | None") -> None:
    def forward(_user, level, message):
        receiver(_LEVELS.get(level, str(level)), message.decode("utf-8", "replace"))

    callback = _abi.SwLogFn(forward) if receiver is not None else _abi.SwLogFn()
    _kept.append(callback)
    library.sw_set_log_callback(callback, None)
