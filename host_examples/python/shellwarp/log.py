"""The library's log messages."""

from collections.abc import Callable

from . import _abi, _library

_LEVELS = {_abi.SW_LOG_INFO: "info", _abi.SW_LOG_WARNING: "warning"}
_kept = []  # a call under way on another thread may use the old callback once more: none is ever freed


def set_log(receiver: "Callable[[str, str], None] | None") -> None:
    """Sends the library's messages to `receiver(level, message)`, level "info" or "warning"; None stops them.

    For the whole process. What the receiver raises goes to sys.unraisablehook.
    """
    def forward(_user, level, message):
        receiver(_LEVELS.get(level, str(level)), message.decode("utf-8", "replace"))

    callback = _abi.SwLogFn(forward) if receiver is not None else _abi.SwLogFn()
    _kept.append(callback)
    _library.call("sw_set_log_callback", callback, None)
