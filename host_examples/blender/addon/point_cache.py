"""Writes PC2 point caches, the format of Blender's Mesh Cache modifier: a header of 32 bytes, then float32 positions."""

import os
import struct

HEAD, MAGIC = struct.Struct("<12siiffi"), b"POINTCACHE2\0"


def points_of(path):
    """How many points a cache has, 0 of a file that is none."""
    with open(path, "rb") as file:
        head = file.read(HEAD.size)
    return HEAD.unpack(head)[2] if len(head) == HEAD.size and head.startswith(MAGIC) else 0


class PointCache:
    """A file under way: it has another name until close, so that a stopped bake leaves the one before as it was."""

    def __init__(self, path, n_points, first_frame, inputs=()):
        """No file of `inputs` is replaced, by whatever name or link."""
        for name in inputs:
            if os.path.exists(path) and os.path.exists(name) and os.path.samefile(path, name):
                raise FileExistsError(f"{path} is the file {name} itself; name another cache")
        self.path, self._partial = path, path + ".partial"
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        self._head = (MAGIC, 1, n_points, float(first_frame), 1.0)
        self._samples = 0
        self._file = open(self._partial, "wb")
        self._write_head()

    def _write_head(self):
        self._file.write(HEAD.pack(*self._head, self._samples))

    def append(self, positions):
        """One frame, (n_points x 3) float32."""
        self._file.write(positions.astype("<f4", copy=False).tobytes())
        self._samples += 1

    def close(self):
        """Puts the file in its place."""
        self._file.seek(0)
        self._write_head()
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        os.replace(self._partial, self.path)

    def discard(self):
        """Removes what was written."""
        try:
            self._file.close()   # on a full disk it raises: what is buffered is tried once more
        finally:
            os.unlink(self._partial)
