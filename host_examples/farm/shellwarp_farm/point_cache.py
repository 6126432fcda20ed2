"""PC2 point caches: a header of 32 bytes, then the positions of each frame in float32."""

import struct
from pathlib import Path

import numpy

from .errors import SceneError

HEADER = "<12siiffi"


class PointCacheFile:
    """Written frame by frame. A block of `with` leaves no file open, however it ends."""

    def __init__(self, path, n_points, first_frame, n_frames):
        self._file = open(path, "wb")
        self._file.write(struct.pack(HEADER, b"POINTCACHE2\0", 1, n_points, float(first_frame), 1.0, n_frames))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def append(self, positions, velocities=None):
        """One frame, (n_points x 3); the format has no velocities."""
        self._file.write(positions.astype("<f4", copy=False).tobytes())

    def close(self):
        self._file.close()


def read(path):
    """The frame of each sample (k), and their points (k x n x 3, float32)."""
    data = Path(path).read_bytes()
    if len(data) < struct.calcsize(HEADER) or not data.startswith(b"POINTCACHE2\0"):
        raise SceneError(f"{path}: is no PC2 point cache")
    _, _, n_points, first, rate, samples = struct.unpack_from(HEADER, data)
    if samples < 1 or n_points < 1 or len(data) < struct.calcsize(HEADER) + 12 * n_points * samples:
        raise SceneError(f"{path}: {samples} samples of {n_points} points are said, and {len(data)} bytes are there")
    points = numpy.frombuffer(data, "<f4", 3 * n_points * samples, struct.calcsize(HEADER))
    return first + rate * numpy.arange(samples), points.reshape(samples, n_points, 3)
