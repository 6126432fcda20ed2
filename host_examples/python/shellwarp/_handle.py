"""Ownership of a model or a state: destroyed once, never while a call is in it, and at the latest with its Python object."""

import threading
import weakref
from contextlib import contextmanager
from typing import TypeVar

from . import _library
from .errors import BusyError, InvalidArgumentError

Self = TypeVar("Self")


def _destroy(function, cell):
    pointer = cell.pop() if cell else None
    if pointer:
        function(pointer)


class Handle:
    """Base of Model and State. Closing twice does nothing; using a closed one raises InvalidArgumentError."""

    _destroyer = ""

    def _adopt(self, pointer):
        self._cell = [pointer]
        self._lock = threading.Lock()
        self._calls = 0
        self._finalizer = weakref.finalize(self, _destroy, getattr(_library.load(), self._destroyer), self._cell)

    @contextmanager
    def _use(self):
        """The C pointer, kept alive until the block ends."""
        with self._lock:
            if not self._cell:
                raise InvalidArgumentError(f"this {type(self).__name__} is closed")
            self._calls += 1
            pointer = self._cell[0]
        try:
            yield pointer
        finally:
            with self._lock:
                self._calls -= 1

    def _call(self, name, *arguments):
        with self._use() as pointer:
            _library.call(name, pointer, *arguments)

    @property
    def closed(self) -> bool:
        """Whether close has been called."""
        return not self._cell

    def close(self) -> None:
        """Frees the memory now rather than with the last reference. BusyError while a call is in it on any thread."""
        with self._lock:
            if self._calls:
                raise BusyError(f"this {type(self).__name__} is in use by another call")
            self._finalizer()

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __reduce__(self):
        raise TypeError(f"a {type(self).__name__} cannot be pickled: send the Shell, and State.save's or Model.save's bytes")
