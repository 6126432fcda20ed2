"""Status codes as exceptions. The text is the library's message, which names the item and the numbers."""

from . import _abi


class ShellwarpError(Exception):
    """A failed call; `status` is SW_ERROR_....  The call has changed nothing."""

    def __init__(self, message: str, status: "int | None" = None) -> None:
        super().__init__(message)
        self.status = status

    def __reduce__(self):  # so that a worker process can hand it to its parent
        return type(self), (str(self), self.status)


class ShellwarpWarning(UserWarning):
    """What the library warns of: numbers that are most likely not meant. See set_log."""


class LibraryNotFoundError(ShellwarpError, OSError):
    """libshellwarp was not found, could not be loaded, or is too old."""


class InvalidArgumentError(ShellwarpError, ValueError):
    """A value is out of its range, of the wrong shape, or not finite."""


class InvalidMeshError(ShellwarpError, ValueError):
    """The mesh has an error; check_mesh lists them all."""


class NotPrecomputedError(ShellwarpError):
    """The model has no modes yet."""


class CancelledError(ShellwarpError):
    """The progress callback returned False."""


class NumericalError(ShellwarpError, ArithmeticError):
    """A factorization or iteration failed, or a result would not be finite."""


class InvalidDataError(ShellwarpError, ValueError):
    """Saved bytes are damaged, of another version, or of another model."""


class BusyError(ShellwarpError):
    """The object is in use by another thread."""


class UnsupportedError(ShellwarpError):
    """This build or this method does not offer what was asked for."""


class InternalError(ShellwarpError):
    """A defect of the library was caught; the object can only be closed."""


class OutOfMemoryError(ShellwarpError, MemoryError):
    """The memory could not be had."""


CLASSES = {
    _abi.SW_ERROR_INVALID_ARGUMENT: InvalidArgumentError,
    _abi.SW_ERROR_INVALID_MESH: InvalidMeshError,
    _abi.SW_ERROR_NOT_PRECOMPUTED: NotPrecomputedError,
    _abi.SW_ERROR_CANCELLED: CancelledError,
    _abi.SW_ERROR_OUT_OF_MEMORY: OutOfMemoryError,
    _abi.SW_ERROR_NUMERICAL: NumericalError,
    _abi.SW_ERROR_INVALID_DATA: InvalidDataError,
    _abi.SW_ERROR_BUSY: BusyError,
    _abi.SW_ERROR_UNSUPPORTED: UnsupportedError,
    _abi.SW_ERROR_INTERNAL: InternalError,
}
