"""What a model or a job is made of, as one hash: equal inputs give equal hashes, whatever file or list they came from.

A value is hashed by its type, its size and its bits, so that no two different values look alike one after another. -0 counts
as 0, the numbers 1 and 1.0 are the same, the keys of a table have no order, and an array of numbers is hashed as float64 or
int64 whatever it was stored as."""

import hashlib
import struct

import numpy


def content_hash(value):
    """64 hex digits of a value made of tables, lists, arrays, numbers, strings and None."""
    digest = hashlib.sha256()
    _add(digest, value)
    return digest.hexdigest()


def _add(digest, value):
    if value is None:
        digest.update(b"n")
    elif isinstance(value, str):
        data = value.encode()
        digest.update(b"s" + struct.pack("<q", len(data)) + data)
    elif isinstance(value, (bool, numpy.bool_)):
        digest.update(b"b1" if value else b"b0")
    elif isinstance(value, (int, float, numpy.number)):
        digest.update(b"d" + struct.pack("<d", float(value) + 0.0))
    elif isinstance(value, dict):
        digest.update(b"t" + struct.pack("<q", len(value)))
        for key in sorted(value):
            _add(digest, key)
            _add(digest, value[key])
    elif isinstance(value, (list, tuple)):
        digest.update(b"l" + struct.pack("<q", len(value)))
        for item in value:
            _add(digest, item)
    elif isinstance(value, numpy.ndarray):
        _add_array(digest, value)
    else:
        raise TypeError(f"{type(value).__name__} has no content hash")


def _add_array(digest, array):
    kind = {"f": "<f8", "i": "<i8", "u": "<i8"}.get(array.dtype.kind)
    if kind is None:
        raise TypeError(f"an array of {array.dtype} has no content hash")
    numbers = numpy.ascontiguousarray(array, dtype=kind)
    numbers = numbers + 0.0 if array.dtype.kind == "f" else numbers
    digest.update(b"a" + kind.encode() + struct.pack(f"<q{array.ndim}q", array.ndim, *array.shape))
    digest.update(numbers.tobytes())
