"""The library's table of methods: the one list of their names. Hosts build their menus, checks and precomputes from it."""

from dataclasses import dataclass
from typing import Any

from . import _abi, _library
from .errors import InvalidArgumentError

DEFAULT = "auto"   # what states and hosts take unless told otherwise
FIELDS = 40   # reduced_fields where a host says none, as SwPrecomputeDesc suggests


@dataclass(frozen=True)
class Method:
    """A line of the table."""

    number: int   # SW_METHOD_..., for good
    name: str     # for files and scripts, for good
    label: str    # for menus
    needs: int    # SW_NEEDS_...

    @property
    def needs_fields(self) -> bool:
        """A precompute with reduced_fields."""
        return self.needs == _abi.SW_NEEDS_REDUCED_FIELDS

    @property
    def needs_choice(self) -> bool:
        """Something to choose from: a precompute with auto, reduced_fields, auto_error or auto_operations."""
        return self.needs == _abi.SW_NEEDS_CHOICE

    @property
    def is_full_shell(self) -> bool:
        """The nonlinear shell, vertex by vertex. Of the methods that need no more than modes, all but linear modal analysis are."""
        return self.needs == _abi.SW_NEEDS_MODES and self.number != _abi.SW_METHOD_LMA

    @property
    def moves_by_modes(self) -> bool:
        """By amplitudes of modes alone."""
        return self.needs == _abi.SW_NEEDS_ROTATIONS or self.number == _abi.SW_METHOD_LMA


def table() -> tuple[Method, ...]:
    """All methods, in the order for menus."""
    library = _library.load()
    numbers = [library.sw_method_at(k) for k in range(library.sw_method_count())]
    return tuple(Method(number, library.sw_method_name(number).decode(), library.sw_method_label(number).decode(),
                        library.sw_method_needs(number)) for number in numbers)


def methods() -> dict[str, int]:
    """The number of each name, in the order for menus."""
    return {method.name: method.number for method in table()}


def find(name: "Method | str | int") -> Method:
    """The method of a name, or of a number; a Method is itself."""
    if isinstance(name, Method):
        return name
    for method in table():
        if name in (method.name, method.number):
            return method
    raise InvalidArgumentError(f"method: {name!r}, expected one of {', '.join(map(repr, methods()))}")


def precompute_options(name: "Method | str | int", reduced_fields: int = 0, auto_error: float = 0.0, auto_operations: float = 0.0,
                       gravity: float = 0.0) -> dict[str, Any]:
    """What Model.precompute must be told beside modes so that the model offers a method, and takes no longer than it needs.

    `reduced_fields` is 40 where it is 0. A choice by `auto_error` and `auto_operations` is made for `gravity`, its strength, in any
    direction. One by neither is a reduced shell where the shell can have one, else the warp."""
    method = find(name)
    if method.needs_fields:
        return {"reduced_fields": reduced_fields or FIELDS}
    if not method.needs_choice:
        return {"reduced_fields": 0}
    if auto_error or auto_operations:
        return {"reduced_fields": reduced_fields, "auto_error": auto_error, "auto_operations": auto_operations, "demand_acceleration": gravity}
    return {"auto": True, "reduced_fields": reduced_fields}
