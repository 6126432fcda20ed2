"""The wheel works in a clean environment: it has all that it needs inside, and says truly where it runs.

SHELLWARP_WHEEL names one to test, which `make wheel` does; else one is built, of the library that SHELLWARP_LIBRARY names, as
`pip install ./host_examples/python` builds it. No network is used: numpy is lent by the Python that runs this.
"""

import base64
import csv
import hashlib
import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path

import numpy

PACKAGE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PACKAGE / "backend"))
import library_file   # noqa: E402

LIBRARY = re.compile(r"shellwarp/(libshellwarp\.so\.0|libshellwarp\.dylib|shellwarp\.dll)")
PIP = importlib.util.find_spec("pip") and importlib.util.find_spec("ensurepip")


def run(*words, **options):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def pip(*words):
    return run(sys.executable, "-m", "pip", "--disable-pip-version-check", *words, env={**os.environ, "PIP_NO_INDEX": "1", "PIP_CACHE_DIR": "0"})


@unittest.skipUnless(PIP, "this Python has no pip and venv (Debian, Ubuntu: apt install python3-venv)")
class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp()).resolve()
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        cls.wheel = cls.built(cls.folder / "wheel")
        cls.python = cls.clean(cls.folder / "clean")

    @staticmethod
    def built(folder):
        if os.environ.get("SHELLWARP_WHEEL"):
            return Path(os.environ["SHELLWARP_WHEEL"])
        pip("wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", folder, PACKAGE)
        wheel, = folder.glob("*.whl")
        return wheel

    @classmethod
    def clean(cls, folder):
        """An environment with the wheel, and numpy lent by a link to that folder alone."""
        run(sys.executable, "-m", "venv", "--without-pip", folder)
        python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        pip("--python", python, "install", "--no-deps", cls.wheel)
        lent = folder / "lent"
        lent.mkdir()
        origin = Path(numpy.__file__).parents[1]
        for path in origin.glob("numpy*"):
            (lent / path.name).symlink_to(path)
        site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
        (site / "lent.pth").write_text(f"{lent}\n", encoding="utf-8")
        return python

    def inside(self, *words):
        """Runs the clean environment's Python where nothing else leads to the package or to a library."""
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("SHELLWARP", "PYTHON", "LD_"))}
        return run(self.python, *words, cwd=self.folder, env=environment)

    def files(self):
        with zipfile.ZipFile(self.wheel) as wheel:
            return {name: wheel.read(name) for name in wheel.namelist()}

    def library(self):
        found = [data for name, data in self.files().items() if LIBRARY.fullmatch(name)]
        self.assertEqual(len(found), 1, "one library is inside")
        return found[0]

    def test_the_name_tells_where_the_library_runs(self):
        tag = library_file.platform_tag(self.library())
        self.assertTrue(self.wheel.name.endswith(f"-py3-none-{tag}.whl"), (self.wheel.name, tag))
        limit = os.environ.get("SHELLWARP_OLDEST_GLIBC")   # of make wheel: 2.17
        if limit:
            self.assertLessEqual(library_file.oldest_glibc(self.library()), tuple(map(int, limit.split("."))))

    @unittest.skipUnless(shutil.which("readelf") and sys.platform.startswith("linux"), "readelf is not installed (apt install binutils)")
    def test_what_the_library_needs_is_what_readelf_reads(self):
        path = self.folder / "library.so"
        path.write_bytes(self.library())
        section = run("readelf", "-V", path).split("Version needs section", 1)[1]
        names = {name for name, flags in re.findall(r"Name: (\S+)\s+Flags: (\S+)", section) if "WEAK" not in flags}
        self.assertEqual({name for _, name in library_file.needed_versions(self.library())}, names)
        self.assertIn("GLIBC_2.2.5" if os.uname().machine == "x86_64" else "GLIBC_2.17", names)

    def test_every_file_is_recorded_with_its_hash(self):
        files = self.files()
        record = next(name for name in files if name.endswith(".dist-info/RECORD"))
        listed = {name: digest for name, digest, _ in csv.reader(io.StringIO(files[record].decode()))}
        self.assertEqual(set(listed), set(files))
        for name, data in files.items():
            if name != record:
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                self.assertEqual(listed[name], f"sha256={digest}", name)

    def test_the_licences_and_types_are_inside(self):
        names = "\n".join(self.files())
        for name in ("licenses/LICENSE-MIT", "licenses/LICENSE-APACHE", "licenses/THIRD_PARTY.md", "shellwarp/py.typed"):
            self.assertIn(name, names)

    def test_the_version_is_that_of_cargo(self):
        version = re.search(r'^version = "(.*)"', (PACKAGE.parents[1] / "Cargo.toml").read_text(encoding="utf-8"), re.M)[1]
        told = self.inside("-c", "import shellwarp, importlib.metadata as m; print(shellwarp.version(), m.version('shellwarp'))")
        self.assertEqual(told.split(), [version, version])

    def test_the_package_finds_the_library_inside_it(self):
        path = Path(self.inside("-c", "import shellwarp; print(shellwarp.library_path())").strip())
        self.assertTrue(path.is_relative_to(self.folder / "clean"), path)

    def test_the_demo_moves_a_strip_and_writes_a_page_and_a_mesh(self):
        said = self.inside("-m", "shellwarp", "demo")
        hangs = float(re.search(r"hangs ([\d.]+) cm low", said)[1])
        self.assertTrue(1 < hangs < 30, said)   # it hangs, and no further than it is long
        page = (self.folder / "shellwarp_demo.html").read_text(encoding="utf-8")
        frames = json.loads(re.search(r"const data = (\{.*?\}), canvas", page)[1])["frames"]
        self.assertEqual((len(frames), len(frames[0])), (120, 124))
        self.assertAlmostEqual(-100 * frames[-1][-1][2], hangs, delta=0.06)   # told to a millimetre
        self.inside("-m", "shellwarp", "demo", "--out", "strip.obj")
        lines = (self.folder / "strip.obj").read_text(encoding="utf-8").splitlines()
        self.assertEqual([sum(line.startswith(key) for line in lines) for key in ("v ", "f ")], [124, 180])

    def test_a_wrong_call_says_so(self):
        with self.assertRaisesRegex(AssertionError, "No such file|cannot"):
            self.inside("-m", "shellwarp", "demo", "--out", "no/such/folder/page.html")


if __name__ == "__main__":
    unittest.main()
