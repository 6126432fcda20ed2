"""numpy arrays as the library's buffers: an address, a format and a stride, without a copy where the layout allows."""

import numpy

from . import _abi
from .errors import InvalidArgumentError

FORMATS = {numpy.dtype(numpy.float32): _abi.SW_FORMAT_F32, numpy.dtype(numpy.float64): _abi.SW_FORMAT_F64}


def _fits(array, columns):
    """Whether the library can walk the array as it lies: rows packed, one after the other. A stride of 0 means packed there."""
    if array.dtype not in FORMATS or array.strides[1] != array.itemsize:
        return False
    return array.shape[0] == 1 or array.strides[0] >= columns * array.itemsize


def vectors_in(values, name):
    """(n x 3) numbers as an array that can be read in place: (array, format, stride). Copied only if it must be."""
    array = numpy.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidArgumentError(f"{name}: shape {array.shape}, expected (n, 3)")
    if not _fits(array, 3):
        array = numpy.array(array, dtype=array.dtype if array.dtype in FORMATS else numpy.float64, order="C", copy=True)
    stride = array.strides[0] if array.shape[0] > 1 else 0
    return array, FORMATS[array.dtype], stride


def vectors_out(out, shape, dtype, name):
    """An array of this shape for results, `out` itself if given: (array, format, stride)."""
    if out is None:
        out = numpy.empty(shape, dtype)
    if not isinstance(out, numpy.ndarray) or out.shape != shape or out.dtype not in FORMATS:
        raise InvalidArgumentError(f"{name}: out must be a float32 or float64 array of shape {shape}")
    if not out.flags.writeable or not _fits(out, shape[1]):
        raise InvalidArgumentError(f"{name}: out must be writable, its rows packed and in order")
    return out, FORMATS[out.dtype], out.strides[0] if shape[0] > 1 else 0


def indices_in(values, name, columns=None):
    """Indices as a packed uint32 array, (n) or (n x columns). Negative ones are refused here: they would wrap around."""
    array = numpy.asarray(values)
    if array.size == 0:
        array = array.astype(numpy.uint32)
    if array.ndim != (1 if columns is None else 2) or (columns and array.shape[1] != columns):
        raise InvalidArgumentError(f"{name}: shape {array.shape}, expected {'(n)' if columns is None else f'(n, {columns})'}")
    if array.dtype.kind not in "iu":
        raise InvalidArgumentError(f"{name}: {array.dtype} numbers, expected integers")
    if array.size and (array.min() < 0 or array.max() > 0xFFFFFFFF):
        raise InvalidArgumentError(f"{name}: {array.min()} to {array.max()}, expected 0 to 4294967295")
    return numpy.ascontiguousarray(array, dtype=numpy.uint32)


def numbers_in(values, name, count=None):
    """Numbers as a packed float64 array of `count`."""
    array = numpy.ascontiguousarray(values, dtype=numpy.float64).ravel()
    if count is not None and array.size != count:
        raise InvalidArgumentError(f"{name}: {array.size} numbers, expected {count}")
    return array


def address(array):
    """The address of an array's data, NULL of an empty one. The array must outlive the call."""
    return array.ctypes.data if array is not None and array.size else None
