"""Words for constants, checked numbers, and reports as dicts."""

import operator

from . import _abi
from .errors import InvalidArgumentError


def choice(table, value, name):
    """The constant that a word stands for."""
    if value not in table:
        raise InvalidArgumentError(f"{name}: {value!r}, expected one of {', '.join(map(repr, table))}")
    return table[value]


def uint32(value, name):
    """A number as the library takes it; ctypes alone would let 2**32 + 1 pass as 1."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InvalidArgumentError(f"{name}: {value!r}, expected an integer") from None
    if not 0 <= number <= 0xFFFFFFFF:
        raise InvalidArgumentError(f"{name}: {number}, expected 0 to 4294967295")
    return number


def newton_steps(value, name):
    """A number of Newton steps of the full shell, or what stands for "auto"."""
    return choice({"auto": _abi.SW_STEPS_AUTO}, value, name) if isinstance(value, str) else uint32(value, name)


def as_dict(struct):
    """The fields of a report as a dict, arrays as tuples; struct_size and reserved ones left out."""
    values = {name: getattr(struct, name) for name, *_ in struct._fields_ if name not in ("struct_size", "reserved")}
    return {name: value if isinstance(value, (int, float)) else tuple(value) for name, value in values.items()}


def guarded(call, raised):
    """A callback that never raises into C: what is raised is kept, and stops the work."""
    def callback(_user, *told):
        if raised:
            return _abi.SW_PROGRESS_CANCEL
        try:
            go_on = call(*told) is not False
        except BaseException as error:  # a KeyboardInterrupt as well: it is raised again outside
            raised.append(error)
            return _abi.SW_PROGRESS_CANCEL
        return _abi.SW_PROGRESS_CONTINUE if go_on else _abi.SW_PROGRESS_CANCEL
    return callback
