"""Files that are there whole or not at all, whoever is killed when: written under another name in the same folder, brought to
the disk, then renamed. The folder is brought to the disk too, so that a record never outlives the file it speaks of."""

import hashlib
import os
import socket
import uuid
from contextlib import contextmanager
from pathlib import Path

PARTIAL = ".partial"
CHUNK = 1 << 20


@contextmanager
def whole_file(path):
    """A path to write to; it becomes `path` at the end of the block, or nothing does if the block raises.

    Its name is this writer's own, so that two writers of the same file do not meet; it keeps the suffix, which USD goes by."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.stem}.{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex[:8]}{PARTIAL}{path.suffix}")
    try:
        yield partial
        _sync(partial)
        os.replace(partial, path)
        _sync(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def write_whole(path, data):
    """Bytes as a file."""
    with whole_file(path) as partial:
        partial.write_bytes(data)


def checksum(path):
    """SHA-256 of a file, as hex digits."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while chunk := file.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def partials(folder):
    """What killed writers left below a folder."""
    return [path for path in Path(folder).rglob(f"*{PARTIAL}*") if path.is_file()]


def _sync(path):
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)
