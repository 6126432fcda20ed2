"""Claims about the writer of point caches, which needs no Blender."""

import importlib.util
import os
import tempfile
import unittest
from pathlib import Path

import numpy

SOURCE = Path(__file__).parent.parent / "addon" / "point_cache.py"
spec = importlib.util.spec_from_file_location("point_cache", SOURCE)
point_cache = importlib.util.module_from_spec(spec)
spec.loader.exec_module(point_cache)

FRAME = numpy.zeros((1000, 3), numpy.float32)   # 12,000 bytes


class PointCache(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.path = self.folder / "a.pc2"

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_a_cache_takes_its_name_when_it_is_whole(self):
        self.path.write_text("earlier")
        cache = point_cache.PointCache(str(self.path), 1000, 1)
        cache.append(FRAME)
        self.assertEqual(self.path.read_text(), "earlier")
        cache.close()
        self.assertEqual(self.path.stat().st_size, 32 + 12000)
        self.assertEqual(self.names(), ["a.pc2"])

    @unittest.skipUnless(hasattr(os, "fork"), "needs limits of the size of files")
    def test_a_full_disk_leaves_the_earlier_cache_and_nothing_else(self):
        import resource
        self.path.write_text("earlier")
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20000, before[1]))
        try:
            cache = point_cache.PointCache(str(self.path), 1000, 1)
            with self.assertRaises(OSError):
                for _ in range(3):
                    cache.append(FRAME)
                cache.close()
            with self.assertRaises(OSError):
                cache.discard()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        self.assertEqual(self.path.read_text(), "earlier")
        self.assertEqual(self.names(), ["a.pc2"])

    def test_an_input_is_never_replaced(self):
        self.path.write_text("scene")
        link = self.folder / "link.pc2"
        os.link(self.path, link)
        for name in (self.path, link):
            with self.assertRaises(FileExistsError):
                point_cache.PointCache(str(name), 1000, 1, [str(self.path)])
        point_cache.PointCache(str(self.folder / "b.pc2"), 1000, 1, [str(self.path), ""]).discard()
        self.assertEqual(self.path.read_text(), "scene")


if __name__ == "__main__":
    unittest.main()
