"""Precomputed models in a folder that any number of workers share, each under the hash of what it was made of.

An entry is its key, the SHA-256 and the size of what follows, and what Model.save gave. It is written whole or not at all, and
checked whole whenever it is read: a damaged one, or one under another's name, is put aside, made anew and reported. A lock
on a file of the key keeps two workers from making the same entry at once. The system drops the lock with the process that
holds it, however that ends; where the file system has no locks the worst is the same work done twice."""

import fcntl
import hashlib
import os
import time
from contextlib import contextmanager
from pathlib import Path

from . import files
from .errors import DamagedError

MAGIC = b"shellwarp model cache 1"


class Cache:
    """`folder` may be shared through a network file system."""

    def __init__(self, folder):
        self.folder = Path(folder)

    def path(self, key):
        """Where the entry of a key lies."""
        return self.folder / key[:2] / f"{key}.model"

    def get(self, key):
        """The bytes under a key, None if there are none; DamagedError if they are not what was put."""
        try:
            data = self.path(key).read_bytes()
        except FileNotFoundError:
            return None
        head, _, payload = data.partition(b"\n")
        if head != _head(key, payload):
            raise DamagedError(f"the cache entry {self.path(key)} is damaged")
        return payload

    def put(self, key, payload):
        files.write_whole(self.path(key), _head(key, payload) + b"\n" + payload)

    def get_or_make(self, key, make):
        """The bytes under a key, made by make() if they must be: (bytes, {"cache": "hit", "made" or "rebuilt", "seconds": …})."""
        start = time.perf_counter()
        payload, damage = self._look(key)
        if payload is not None:
            return payload, _report("hit", start, None)
        with self._lock(key):
            payload, damage_now = self._look(key)   # another may have made it while this one waited
            if payload is not None:
                return payload, _report("hit", start, damage)
            if damage_now:
                self._put_aside(key)
            payload = make()
            self.put(key, payload)
        return payload, _report("rebuilt" if damage_now else "made", start, damage or damage_now)

    def _look(self, key):
        try:
            return self.get(key), None
        except DamagedError as error:
            return None, str(error)

    def _put_aside(self, key):
        aside = self.folder / "damaged" / f"{key}.{time.time_ns()}"
        aside.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.replace(self.path(key), aside)
        except FileNotFoundError:   # another worker was faster
            pass

    @contextmanager
    def _lock(self, key):
        folder = self.folder / "locks"
        folder.mkdir(parents=True, exist_ok=True)
        with open(folder / key, "a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX)
            except OSError:   # no locks here
                pass
            yield


def _head(key, payload):
    return b" ".join([MAGIC, key.encode(), hashlib.sha256(payload).hexdigest().encode(), str(len(payload)).encode()])


def _report(what, start, damage):
    report = {"cache": what, "seconds": time.perf_counter() - start}
    return {**report, "damage": damage} if damage else report
