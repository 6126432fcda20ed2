"""Points that follow a shell."""

from ctypes import POINTER, byref, c_uint64, create_string_buffer
from typing import TYPE_CHECKING

import numpy
from numpy.typing import ArrayLike

from . import _abi, _arrays, _library
from ._handle import Handle
from ._types import Buffer, Report
from ._values import as_dict
from .errors import InvalidArgumentError

if TYPE_CHECKING:
    from .model import Model


class Binding(Handle):
    """Points bound to a model's mesh, for any number of states: what is drawn where a coarser mesh is simulated. Immutable."""

    _destroyer = "sw_binding_destroy"

    def __init__(self, model: "Model", points: ArrayLike, normals: "ArrayLike | None" = None, tangents: "ArrayLike | None" = None,
                 max_distance: float = 0.0) -> None:
        """`points` (n x 3) where they are at rest, with `normals` and `tangents` (n x 3) if states are to give these."""
        desc = _library.initialised(_abi.SwBindingDesc)
        arrays = {"points": points, "normals": normals, "tangents": tangents}
        given = {name: numpy.asarray(values) for name, values in arrays.items() if values is not None}
        # One format for all: of single precision where all are.
        single = all(values.dtype == numpy.float32 for values in given.values())
        kept = []
        for name, values in given.items():
            values, desc.format, stride = _arrays.vectors_in(values if single else values.astype(numpy.float64), name)
            kept.append(values)
            if len(values) != len(kept[0]):
                raise InvalidArgumentError(f"{name}: {len(values)} rows, there are {len(kept[0])} points")
            setattr(desc, name, _arrays.address(values))
            setattr(desc, name[:-1] + "_stride", stride)
        desc.n_points, desc.max_distance = len(kept[0]), max_distance
        pointer = POINTER(_abi.SwBinding)()
        model._call("sw_binding_create", byref(desc), byref(pointer))
        self._take(pointer)

    def _take(self, pointer):
        self._adopt(pointer)
        self.n_points = int(self.info()["n_points"])

    def info(self) -> Report:
        """What it has: SwBindingInfo as a dict."""
        info = _library.initialised(_abi.SwBindingInfo)
        self._call("sw_binding_info", byref(info))
        return as_dict(info)

    def save(self) -> bytes:
        """As bytes, for load."""
        size = c_uint64()
        self._call("sw_binding_save", None, 0, byref(size))
        data = create_string_buffer(size.value)
        self._call("sw_binding_save", data, size.value, byref(size))
        return data.raw[:size.value]

    @classmethod
    def load(cls, model: "Model", data: Buffer) -> "Binding":
        """What save gave, for a model of the same mesh."""
        data = bytes(data)
        pointer = POINTER(_abi.SwBinding)()
        model._call("sw_binding_load", data, len(data), byref(pointer))
        made = cls.__new__(cls)
        made._take(pointer)
        return made
