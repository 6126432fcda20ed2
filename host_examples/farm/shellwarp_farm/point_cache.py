"""PC2 point caches: a header of 32 bytes, then the positions of each frame in float32."""

import struct


class PointCacheFile:
    """Written frame by frame."""

    def __init__(self, path, n_points, first_frame, n_frames):
        self._file = open(path, "wb")
        self._file.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, n_points, float(first_frame), 1.0, n_frames))

    def append(self, positions, velocities=None):
        """One frame, (n_points x 3); the format has no velocities."""
        self._file.write(positions.astype("<f4", copy=False).tobytes())

    def close(self):
        self._file.close()
