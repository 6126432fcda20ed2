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
import struct
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "cmake"), str(ROOT / "host_examples" / "python" / "backend")]
import library_file  # noqa: E402
from dist import VERSION, cmake  # noqa: E402
from dist_platforms import OLDEST_MACOS, PLATFORMS, TARGET, ZIG, places  # noqa: E402
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
PE = [*COMMON, "lib/libshellwarp.dll.a", "lib/shellwarp.lib", "bin/shellwarp.dll", "bin/shellwarp.exe"]
MACH_O = [*COMMON, "lib/libshellwarp.dylib", "bin/shellwarp"]
LC_ID_DYLIB, LC_LOAD_DYLIB, LC_CODE_SIGNATURE = 0xD, 0xC, 0x1D
# Of Microsoft's C library nothing is here, so a program that begins at its own first function. It ends with 42 where the two sides agree.
FREESTANDING = """#include "shellwarp.h"
int start(void) {
    SwMeshDesc mesh;
    sw_mesh_desc_init(&mesh);
    return mesh.struct_size == sizeof mesh && sw_abi_version() == SW_ABI_VERSION ? 42 : 1;
}
"""


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
    blender = ""   # its name of the platform

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
        if self.platform.macos and sys.platform != "darwin":
            self.skipTest("no macOS is here")
        if self.platform.runner and not shutil.which(self.platform.runner[0]):
            self.skipTest(f"{self.platform.runner[0]} is not installed")
        return list(self.platform.runner), environment(self.platform, self.folder, [self.prefix / "bin"])

    def binaries(self):
        return [self.prefix / name for name in self.expected if Path(name).suffix in (".0", ".dll", ".exe", ".dylib") or name == "bin/shellwarp"]

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
        if self.platform.macos:
            for path in self.binaries():
                self.assertNotIn(b"__debug_info", path.read_bytes(), path.name)
            return
        windows = "windows" in self.platform.name
        for path in [*self.binaries(), *([] if windows else [self.prefix / "lib/libshellwarp.a"])]:   # mingw's strip cannot read that
            tool = ["x86_64-w64-mingw32-objdump", "-h"] if windows else ["readelf", "-SW"]
            self.assertNotIn(".debug_", run(*tool, path), path.name)

    def test_outside_programs_in_c_and_cpp_build_run_and_agree(self):
        runner, environment = (None, None) if self.platform.macos and sys.platform != "darwin" else self.runs()
        for component in ("shared", "static"):
            out = self.folder / f"outside_{component}"
            library = "shellwarp::shellwarp" + ("_static" if component == "static" else "")
            # zig's C links no unwinder by itself, unlike gcc's and its own C++.
            unwinder = ["-DCMAKE_C_STANDARD_LIBRARIES=-lunwind"] if self.platform.zig and component == "static" else []
            run(cmake(), "-S", ROOT / "tests/install/consumer", "-B", out, *unwinder, f"--toolchain={ROOT / 'build/dist' / self.platform.name / 'toolchain.cmake'}",
                f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DSOURCES={CALLERS}", f"-DLIBRARY={library}", f"-DCOMPONENT={component}")
            run(cmake(), "--build", out)
            for language in ("c", "cpp") if environment else ():
                program = out / f"strip_{language}{'.exe' if 'windows' in self.platform.name else ''}"
                run(*runner, program, f"{component}_{language}.bin", env=environment, cwd=self.folder)
        if not environment:
            self.skipTest("no macOS is here: they were built and not run")
        written = {name.name: name.read_bytes() for name in self.folder.glob("*.bin")}
        self.assertEqual(len(written), 4)
        self.assertEqual(len(set(written.values())), 1, "shared and static, C and C++ give the same bytes")
        self.assertEqual(len(next(iter(written.values()))), 31 * 4 * 3 * 4)
        note(self.platform.name, strip=hashlib.sha256(written["shared_c.bin"]).hexdigest(), by=runner[0] if runner else "native")

    def test_the_blender_extension_has_this_platforms_library(self):
        found = list((self.prefix / "blender").glob("shellwarp-blender-*.zip")) if (self.prefix / "blender").exists() else []
        if not self.blender:
            self.assertEqual(found, [], "Blender has no build for it")
            return
        with zipfile.ZipFile(found[0]) as packed:
            manifest = packed.read("shellwarp/blender_manifest.toml").decode()
            tag = re.search(r'platforms = \["(.*)"\]', manifest)[1]
            self.assertEqual(tag, self.blender)
            self.assertEqual(found[0].name, f"shellwarp-blender-{VERSION}-{tag}.zip")
            library = next(name for name in packed.namelist() if name.endswith((".so.0", ".dll", ".dylib")))
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
    blender = "linux-x64"

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
    blender = "windows-x64"

    def test_a_program_of_microsofts_kind_links_to_it_and_agrees(self):
        runner, environment = self.runs()
        source, built, program = (self.folder / f"freestanding.{suffix}" for suffix in ("c", "obj", "exe"))
        source.write_text(FREESTANDING, encoding="utf-8")
        run(*ZIG, "cc", "-target", "x86_64-windows-msvc", "-ffreestanding", "-O1", "-fno-stack-protector", "-c", source, "-o", built, "-I", self.prefix / "include")
        run(*ZIG, "lld-link", "/entry:start", "/subsystem:console", "/nodefaultlib", f"/out:{program}", built, self.prefix / "lib/shellwarp.lib")
        self.assertEqual(subprocess.run([*runner, program], env=environment, check=False).returncode, 42)

    def test_the_library_needs_what_windows_has(self):
        listed = run("x86_64-w64-mingw32-objdump", "-p", self.prefix / "bin/shellwarp.dll")
        needed = {name.lower() for name in re.findall(r"DLL Name: (\S+)", listed)}
        windows = {"kernel32.dll", "ntdll.dll", "userenv.dll", "ws2_32.dll", "msvcrt.dll", "bcryptprimitives.dll", "api-ms-win-core-synch-l1-2-0.dll"}
        self.assertEqual(needed - windows, set())
        note(self.platform.name, system="Windows 10 or later")


class MachO(Archive):
    """Of macOS: built here and not run. What its loader asks of a file is read from the file."""

    expected = MACH_O

    def library(self):
        return (self.prefix / "lib/libshellwarp.dylib").read_bytes()

    def names(self, wanted):
        return [command[struct.unpack_from("<I", command, 8)[0]:].split(b"\0")[0].decode() for number, command in library_file.load_commands(self.library())
                if number == wanted]

    def test_programs_find_it_beside_them(self):
        self.assertEqual(self.names(LC_ID_DYLIB), ["@rpath/libshellwarp.dylib"])

    def test_it_needs_what_the_system_has(self):
        self.assertEqual(set(self.names(LC_LOAD_DYLIB)) - {f"/usr/lib/lib{name}.dylib" for name in ("System.B", "iconv.2", "charset.1")}, set())
        for path in self.binaries():
            self.assertLessEqual(library_file.oldest_macos(path.read_bytes()), tuple(map(int, OLDEST_MACOS.split("."))), path.name)
        note(self.platform.name, system=f"macOS {OLDEST_MACOS}", by="not run")

    def test_the_signature_that_the_loader_checks_is_that_of_the_file(self):
        """Of a code directory, every page's SHA-256. Intel's loader asks for none."""
        signed = 0
        for path in self.binaries():
            data = path.read_bytes()
            for number, command in library_file.load_commands(data):
                if number == LC_CODE_SIGNATURE:
                    signed += 1
                    self.check_pages(data, struct.unpack_from("<I", command, 8)[0])
        self.assertEqual(signed, 2 if "aarch64" in self.platform.name else signed)

    def check_pages(self, data, at):
        magic, _, count = struct.unpack_from(">III", data, at)
        self.assertEqual(magic, 0xFADE0CC0)
        places = [at + struct.unpack_from(">II", data, at + 12 + 8 * k)[1] for k in range(count)]
        place = next(place for place in places if struct.unpack_from(">I", data, place)[0] == 0xFADE0C02)
        hashes, _, _, slots, limit, size, kind, _, page = struct.unpack_from(">5I4B", data, place + 16)
        self.assertEqual((size, kind), (32, 2), "SHA-256")
        self.assertEqual(slots, (limit + (1 << page) - 1) >> page)
        for k in range(slots):
            digest = hashlib.sha256(data[k << page:min((k + 1) << page, limit)]).digest()
            self.assertEqual(digest, data[place + hashes + size * k:place + hashes + size * (k + 1)], f"page {k}")


class MacX86(MachO, unittest.TestCase):
    platform = PLATFORMS["macos-x86_64"]
    blender = "macos-x64"


class MacArm(MachO, unittest.TestCase):
    platform = PLATFORMS["macos-aarch64"]
    blender = "macos-arm64"


class Wheels(unittest.TestCase):
    def test_each_archive_has_a_wheel_with_its_library(self):
        wheels = {path.name: path for path in OUT.glob("shellwarp-*.whl")}
        found = [platform for platform in PLATFORMS.values() if list(OUT.glob(f"shellwarp-{VERSION}-{platform.name}.*"))]
        self.assertEqual(len(wheels), len(found))
        for platform in found:
            tag = library_file.platform_tag(platform.built().read_bytes())
            with zipfile.ZipFile(wheels[f"shellwarp-{VERSION}-py3-none-{tag}.whl"]) as packed:
                libraries = [name for name in packed.namelist() if name.endswith((".so.0", ".dll", ".dylib"))]
                self.assertEqual(len(libraries), 1)
                self.assertEqual(library_file.platform_tag(packed.read(libraries[0])), tag)
                self.assertIn(f"Tag: py3-none-{tag}\n", packed.read(f"shellwarp-{VERSION}.dist-info/WHEEL").decode())


class BlenderExtension(unittest.TestCase):
    """The one zip for all platforms that Blender has."""

    @classmethod
    def setUpClass(cls):
        cls.made = [of for of in (LinuxX86, Windows, MacX86, MacArm) if list(OUT.glob(f"shellwarp-{VERSION}-{of.platform.name}.*"))]
        if len(cls.made) < 2:
            raise unittest.SkipTest("the archives of two platforms make one extension (make dist)")
        cls.file = OUT / f"shellwarp-blender-{VERSION}.zip"

    def test_its_manifest_names_the_platforms_and_each_has_its_library(self):
        expected = {of.blender: of.platform for of in self.made}
        with zipfile.ZipFile(self.file) as packed:
            manifest = tomllib.loads(packed.read("shellwarp/blender_manifest.toml").decode())
            self.assertEqual(set(manifest["platforms"]), set(expected))
            self.assertEqual(manifest["version"], VERSION)
            for tag, platform in expected.items():
                library, = (name for name in packed.namelist() if name.startswith(f"shellwarp/shellwarp/{tag}/"))
                self.assertEqual(library_file.platform_tag(packed.read(library)), library_file.platform_tag(platform.built().read_bytes()))

    def test_blenders_own_checker_takes_it(self):
        checkers = list((ROOT / ".venv" / "blender").glob("lib/**/addons_core/bl_pkg/cli/blender_ext.py"))
        if not checkers:
            self.skipTest("Blender is not here (make test-blender)")
        run(ROOT / ".venv/blender/bin/python", checkers[0], "validate", self.file)


if __name__ == "__main__":
    unittest.main()
