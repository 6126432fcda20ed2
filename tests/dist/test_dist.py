#!/usr/bin/env python3
"""The archives of out/dist hold what they should, and outside projects build and run with them; `make test-dist` calls it.

What needs a compiler or an emulator that is not here is skipped with its name. What ran how goes to build/dist/ran.json, for
docs/reference/platforms.md.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "cmake"), str(ROOT / "host_examples" / "python" / "backend")]
import library_file  # noqa: E402
from dist import VERSION, cmake  # noqa: E402
from dist_platforms import PLATFORMS, TARGET, places  # noqa: E402
from emulator import environment  # noqa: E402

OUT = ROOT / "out" / "dist"
CALLERS = ROOT / "tests" / "callers"
RAN = ROOT / "build" / "dist" / "ran.json"
PYTHON = ROOT / ".venv" / "bin" / "python"
COMMON = ["include/shellwarp.h", "include/shellwarp.hpp", "lib/cmake/shellwarp/shellwarpConfig.cmake", "lib/cmake/shellwarp/shellwarpConfigVersion.cmake",
          "lib/pkgconfig/shellwarp.pc", "lib/libshellwarp.a", "share/doc/shellwarp/LICENSE-APACHE", "share/doc/shellwarp/LICENSE-MIT",
          "share/doc/shellwarp/THIRD_PARTY.md", "share/doc/shellwarp/CHANGELOG.md", "share/shellwarp/python/shellwarp/__init__.py",
          "share/shellwarp/plugins/CMakeLists.txt", "share/shellwarp/plugins/host_examples/maya/plugin.cpp",
          "share/shellwarp/plugins/host_examples/houdini/SOP_ShellWarp.cpp"]
ELF = [*COMMON, "lib/libshellwarp.so", "lib/libshellwarp.so.0", "bin/shellwarp"]
PE = [*COMMON, "lib/libshellwarp.dll.a", "bin/shellwarp.dll", "bin/shellwarp.exe"]


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def unpack(archive, folder):
    if archive.suffix == ".zip":
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(folder)
    else:
        with tarfile.open(archive) as packed:
            packed.extractall(folder, filter="data")
    inside, = folder.iterdir()
    return inside


def note(platform, **words):
    """What ran how, for the page."""
    ran = json.loads(RAN.read_text(encoding="utf-8")) if RAN.exists() else {}
    ran[platform] = {**ran.get(platform, {}), **words}
    RAN.write_text(json.dumps(ran, indent=1), encoding="utf-8")


class Sums(unittest.TestCase):
    def test_the_sums_are_those_of_the_archives(self):
        listed = dict(reversed(line.split("  ")) for line in (OUT / "SHA256SUMS").read_text(encoding="utf-8").splitlines())
        archives = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in OUT.glob("shellwarp-*")}
        self.assertTrue(archives, "make dist")
        self.assertEqual(listed, archives)


class Archive:
    """The tests of one archive; a class for each platform comes below."""

    platform = None
    expected = ELF

    @classmethod
    def setUpClass(cls):
        found = list(OUT.glob(f"shellwarp-{VERSION}-{cls.platform.name}.*"))
        if not found:
            raise unittest.SkipTest(f"no archive of {cls.platform.name}: {cls.platform.missing() or 'make dist'}")
        cls.folder = Path(tempfile.mkdtemp()).resolve()
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        cls.prefix = unpack(found[0], cls.folder / "unpacked")

    def runs(self):
        """What comes before a program's name to run it here, with its environment."""
        if self.platform.runner and not shutil.which(self.platform.runner[0]):
            self.skipTest(f"{self.platform.runner[0]} is not installed")
        return list(self.platform.runner), environment(self.platform, self.folder, [self.prefix / "bin"])

    def binaries(self):
        return [self.prefix / name for name in self.expected if Path(name).suffix in (".0", ".dll", ".exe") or name == "bin/shellwarp"]

    def test_everything_is_inside(self):
        self.assertEqual(self.prefix.name, f"shellwarp-{VERSION}-{self.platform.name}")
        self.assertEqual([name for name in self.expected if not (self.prefix / name).exists()], [])

    def test_no_file_names_a_folder_of_this_machine(self):
        words = {str(place).encode() for place in (*places(), TARGET, Path.home() / ".cargo", Path.home() / ".cache")}
        found = [(path.relative_to(self.prefix).as_posix(), word) for path in sorted(self.prefix.rglob("*")) if path.is_file()
                 for word in words if word in path.read_bytes()]
        self.assertEqual(found, [])

    def test_every_place_tells_the_version(self):
        runner, environment = self.runs()
        program = next(path for path in self.binaries() if path.stem == "shellwarp" and path.suffix != ".dll")
        self.assertEqual(run(*runner, program, "--version", env=environment).strip(), f"shellwarp {VERSION}")
        self.assertIn(f"Version: {VERSION}\n", (self.prefix / "lib/pkgconfig/shellwarp.pc").read_text(encoding="utf-8"))
        self.assertIn(f'set(PACKAGE_VERSION "{VERSION}")', (self.prefix / "lib/cmake/shellwarp/shellwarpConfigVersion.cmake").read_text(encoding="utf-8"))

    def test_binaries_have_no_debugging_information(self):
        windows = "windows" in self.platform.name
        for path in [*self.binaries(), *([] if windows else [self.prefix / "lib/libshellwarp.a"])]:   # mingw's strip cannot read that
            tool = ["x86_64-w64-mingw32-objdump", "-h"] if windows else ["readelf", "-SW"]
            self.assertNotIn(".debug_", run(*tool, path), path.name)

    def test_outside_programs_in_c_and_cpp_build_run_and_agree(self):
        runner, environment = self.runs()
        for component in ("shared", "static"):
            out = self.folder / f"outside_{component}"
            library = "shellwarp::shellwarp" + ("_static" if component == "static" else "")
            # zig's C links no unwinder by itself, unlike gcc's and its own C++.
            unwinder = ["-DCMAKE_C_STANDARD_LIBRARIES=-lunwind"] if self.platform.zig and component == "static" else []
            run(cmake(), "-S", ROOT / "tests/install/consumer", "-B", out, *unwinder, f"--toolchain={ROOT / 'build/dist' / self.platform.name / 'toolchain.cmake'}",
                f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DSOURCES={CALLERS}", f"-DLIBRARY={library}", f"-DCOMPONENT={component}")
            run(cmake(), "--build", out)
            for language in ("c", "cpp"):
                program = out / f"strip_{language}{'.exe' if 'windows' in self.platform.name else ''}"
                run(*runner, program, f"{component}_{language}.bin", env=environment, cwd=self.folder)
        written = {name.name: name.read_bytes() for name in self.folder.glob("*.bin")}
        self.assertEqual(len(written), 4)
        self.assertEqual(len(set(written.values())), 1, "shared and static, C and C++ give the same bytes")
        self.assertEqual(len(next(iter(written.values()))), 31 * 4 * 3 * 4)
        note(self.platform.name, strip=hashlib.sha256(written["shared_c.bin"]).hexdigest(), by=runner[0] if runner else "native")

    def test_the_blender_extension_has_this_platforms_library(self):
        found = list((self.prefix / "blender").glob("shellwarp-blender-*.zip")) if (self.prefix / "blender").exists() else []
        if "aarch64" in self.platform.name:
            self.assertEqual(found, [], "Blender has no build for it")
            return
        with zipfile.ZipFile(found[0]) as packed:
            manifest = packed.read("shellwarp/blender_manifest.toml").decode()
            tag = re.search(r'platforms = \["(.*)"\]', manifest)[1]
            self.assertEqual(tag, {"linux": "linux-x64", "windows": "windows-x64"}[self.platform.name.split("-")[0]])
            self.assertEqual(found[0].name, f"shellwarp-blender-{VERSION}-{tag}.zip")
            library = next(name for name in packed.namelist() if name.endswith((".so.0", ".dll")))
            self.assertEqual(library_file.platform_tag(packed.read(library)), library_file.platform_tag((self.binaries()[0]).read_bytes()))


class Elf(Archive):
    def test_the_library_has_its_soname_and_its_link(self):
        self.assertIn("Library soname: [libshellwarp.so.0]", run("readelf", "-dW", self.prefix / "lib/libshellwarp.so.0"))
        self.assertEqual(os.readlink(self.prefix / "lib/libshellwarp.so"), "libshellwarp.so.0")

    def test_glibc_of_2013_is_enough(self):
        for path in self.binaries():
            self.assertLessEqual(library_file.oldest_glibc(path.read_bytes()), (2, 17), path.name)
        note(self.platform.name, system="glibc {}.{}".format(*library_file.oldest_glibc(self.binaries()[0].read_bytes())))


class LinuxX86(Elf, unittest.TestCase):
    platform = PLATFORMS["linux-x86_64"]

    def test_the_systems_compilers_build_against_it(self):
        shutil.copy(CALLERS / "strip.c", self.folder)
        run("cc", self.folder / "strip.c", "-o", self.folder / "expected", "-I", self.prefix / "include", self.prefix / "lib/libshellwarp.so.0",
            f"-Wl,-rpath,{self.prefix / 'lib'}")
        run(self.folder / "expected", self.folder / "expected.out")
        options = {"LIBDIR": "lib", "PREFIX": self.prefix, "SOURCES": CALLERS, "READELF": "readelf", "CC": shutil.which("cc"), "CXX": shutil.which("c++"),
                   "PKG_CONFIG": shutil.which("pkg-config"), "EXPECTED": self.folder / "expected.out"}
        for how in ("cmake", "pkg-config") if options["PKG_CONFIG"] else ("cmake",):
            for kind in ("shared", "static"):
                run(cmake(), *[f"-D{key}={value}" for key, value in {**options, "HOW": how, "KIND": kind, "OUT": self.folder / f"{how}_{kind}"}.items()],
                    "-P", ROOT / "tests/install/consume.cmake")

    def test_the_python_package_finds_the_library(self):
        if not PYTHON.exists():
            self.skipTest("no Python with numpy (sh cmake/bootstrap.sh python)")
        _, environment = self.runs()
        script = "import shellwarp; print(shellwarp.version(), shellwarp.library_path())"
        told = run(PYTHON, "-c", script, env={**environment, "PYTHONPATH": str(self.prefix / "share/shellwarp/python"), "PYTHONDONTWRITEBYTECODE": "1"})
        self.assertEqual(told.split(), [VERSION, str(self.prefix / "lib/libshellwarp.so.0")])


class LinuxArm(Elf, unittest.TestCase):
    platform = PLATFORMS["linux-aarch64"]


class Windows(Archive, unittest.TestCase):
    platform = PLATFORMS["windows-x86_64"]
    expected = PE

    def test_the_library_needs_what_windows_has(self):
        listed = run("x86_64-w64-mingw32-objdump", "-p", self.prefix / "bin/shellwarp.dll")
        needed = {name.lower() for name in re.findall(r"DLL Name: (\S+)", listed)}
        windows = {"kernel32.dll", "ntdll.dll", "userenv.dll", "ws2_32.dll", "msvcrt.dll", "bcryptprimitives.dll", "api-ms-win-core-synch-l1-2-0.dll"}
        self.assertEqual(needed - windows, set())
        note(self.platform.name, system="Windows 10 or later")


if __name__ == "__main__":
    unittest.main()
