"""Claims about files and the cache: whole or absent whoever is killed, shared by many processes, damage found and mended."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from shellwarp_farm import files
from shellwarp_farm.cache import Cache
from shellwarp_farm.errors import DamagedError

KEY = "ab" * 32

WRITER = """
import sys
from shellwarp_farm import files
print("ready", flush=True)
for k in range(10**6):
    with files.whole_file(sys.argv[1]) as partial:
        with open(partial, "wb") as file:
            for _ in range(64):
                file.write(bytes([k % 251]) * 4096)
"""


def hammer(folder, mark, rounds):
    """Looks the key up again and again: how often this process made it, and whether it ever saw anything else."""
    cache, made = Cache(folder), 0

    def make():
        nonlocal made
        made += 1
        time.sleep(0.05)   # long enough for all the others to ask too
        return mark * 1000

    seen = {cache.get_or_make(f"{k:064x}", make)[0] for k in range(rounds)}
    return made, seen == {mark * 1000}


class Atomic(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_a_writer_killed_at_any_time_leaves_a_whole_file_or_none(self):
        path, seen_partial = self.folder / "points.pc2", False
        for k in range(8):
            process = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE)
            process.stdout.readline()
            time.sleep(0.003 * (k + 1))
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            process.stdout.close()
            if path.exists():
                data = path.read_bytes()
                self.assertEqual((len(data), len(set(data))), (64 * 4096, 1))
                path.unlink()
            seen_partial |= bool(files.partials(self.folder))
            for left in files.partials(self.folder):
                self.assertNotEqual(left, path)
                left.unlink()
        self.assertTrue(seen_partial, "no kill fell into a write: the test has shown nothing")

    def test_a_block_that_raises_leaves_what_was_there_before(self):
        files.write_whole(self.folder / "a", b"before")
        with self.assertRaises(KeyError), files.whole_file(self.folder / "a") as partial:
            partial.write_bytes(b"half")
            raise KeyError
        self.assertEqual([p.read_bytes() for p in self.folder.iterdir()], [b"before"])

    def test_two_writers_of_one_file_do_not_meet(self):
        with files.whole_file(self.folder / "a") as first, files.whole_file(self.folder / "a") as second:
            self.assertNotEqual(first, second)
            first.write_bytes(b"same")
            second.write_bytes(b"same")
        self.assertEqual((self.folder / "a").read_bytes(), b"same")


class Shared(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.cache = Cache(self.folder)

    def test_processes_at_once_make_each_entry_once_and_all_read_it_whole(self):
        with ProcessPoolExecutor(3, mp_context=get_context("spawn")) as pool:
            results = [f.result() for f in [pool.submit(hammer, self.folder, b"x", 4) for _ in range(3)]]
        self.assertEqual(sum(made for made, _ in results), 4)
        self.assertTrue(all(right for _, right in results))

    def test_every_kind_of_damage_is_found_mended_and_told(self):
        self.cache.put(KEY, b"payload" * 100)
        good = self.cache.path(KEY).read_bytes()
        flipped = bytearray(good)
        flipped[len(good) // 2] ^= 1
        other = good.replace(KEY.encode(), b"cd" * 32)
        for name, bad in [("flipped bit", bytes(flipped)), ("cut short", good[:-1]), ("too long", good + b"x"), ("empty", b""),
                          ("head only", good[:30]), ("another's entry", other)]:
            with self.subTest(name):
                self.cache.path(KEY).write_bytes(bad)
                self.assertRaises(DamagedError, self.cache.get, KEY)
                payload, report = self.cache.get_or_make(KEY, lambda: b"payload" * 100)
                self.assertEqual((payload, report["cache"]), (b"payload" * 100, "rebuilt"))
                self.assertIn("damaged", report["damage"])
                self.assertEqual(self.cache.path(KEY).read_bytes(), good)
                self.assertEqual(self.cache.get_or_make(KEY, self.fail)[1]["cache"], "hit")

    def test_a_lock_dies_with_the_process_that_holds_it(self):
        holder = "import sys, time\nfrom shellwarp_farm.cache import Cache\n" \
                 "with Cache(sys.argv[1])._lock(sys.argv[2]):\n print('held', flush=True)\n time.sleep(600)"
        process = subprocess.Popen([sys.executable, "-c", holder, str(self.folder), KEY], stdout=subprocess.PIPE)
        process.stdout.readline()
        got = []
        waiting = threading.Thread(target=lambda: got.append(self.cache.get_or_make(KEY, lambda: b"mine")), daemon=True)
        waiting.start()
        waiting.join(0.3)
        self.assertEqual(got, [])
        process.kill()
        process.wait()
        process.stdout.close()
        waiting.join(60)
        self.assertEqual(got[0][0], b"mine")

    def test_a_maker_that_fails_leaves_no_entry_and_no_lock(self):
        with self.assertRaises(ZeroDivisionError):
            self.cache.get_or_make(KEY, lambda: 1 / 0)
        self.assertIsNone(self.cache.get(KEY))
        self.assertEqual(self.cache.get_or_make(KEY, lambda: b"x")[0], b"x")


if __name__ == "__main__":
    unittest.main()
