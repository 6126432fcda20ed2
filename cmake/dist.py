#!/usr/bin/env python3
"""Makes the archives and Python wheels of a release, one a platform, and their SHA256SUMS; `make dist` calls it.

    dist.py [PLATFORM ...] [--out out/dist] [--again]

Without a platform: all for which this machine has what builds them; the others are named with what is missing. With --again nothing is kept: the
sources are copied to another folder and built there anew, and what differs from the archives in --out is listed.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

from dist_platforms import PLATFORMS, ROOT, ZIG, build_library, places
from pack import pack

EPOCH = "315532800"   # 1980, as in the archives
VERSION = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(encoding="utf-8"), re.M)[1]


def run(*words, **options):
    subprocess.run([str(word) for word in words], check=True, **options)


def cmake():
    """The CMake that cmake/bootstrap.sh found."""
    return re.search(r"^CMAKE='(.*)'$", (ROOT / "build" / "tools.sh").read_text(encoding="utf-8"), re.M)[1]


def compilers(platform, folder):
    """C, C++, ar and ranlib for a platform: zig's behind scripts of one name each, or mingw's."""
    if not platform.zig:
        prefix = "x86_64-w64-mingw32-"
        return [*platform.needs, f"{prefix}ar", f"{prefix}ranlib"]
    for name in ("cc", "c++", "ar", "ranlib"):
        target = ["-target", platform.zig] if name.startswith("c") else []
        script = folder / f"zig-{name}"
        last = " -Wno-c11-extensions" if name == "cc" else ""   # zig's string.h has them in C99, too; the last word counts
        script.write_text(f"#!/bin/sh\nexec {' '.join([*ZIG, name, *target])} \"$@\"{last}\n", encoding="utf-8")
        script.chmod(0o755)
    return [folder / f"zig-{name}" for name in ("cc", "c++", "ar", "ranlib")]


def toolchain(platform, folder):
    """A toolchain file for CMake."""
    folder.mkdir(parents=True, exist_ok=True)
    system, processor = platform.name.split("-")
    values = dict(zip(("C_COMPILER", "CXX_COMPILER", "AR", "RANLIB"), compilers(platform, folder)))
    values |= {"SYSTEM_NAME": {"macos": "Darwin"}.get(system, system.title()), "SYSTEM_PROCESSOR": processor}
    if platform.strip:
        values["STRIP"] = shutil.which(platform.strip)
    if platform.macos:   # programs are linked as they will be installed, so that nothing edits them later
        values |= {"INSTALL_NAME_TOOL": "false", "OSX_SYSROOT": "", "BUILD_WITH_INSTALL_RPATH": "ON", "EXE_LINKER_FLAGS_INIT": "-s"}
    if platform.runner:
        values["CROSSCOMPILING_EMULATOR"] = ";".join(platform.runner)
    maps = " ".join(f"-ffile-prefix-map={place}={name}" for place, name in places().items())
    lines = [f'set(CMAKE_{key} "{value}")' for key, value in values.items()]
    lines += [f'set(CMAKE_{language}_FLAGS_INIT "{maps}")' for language in ("C", "CXX")]
    lines += ['set(SHELLWARP_MATH_LIBRARY m CACHE STRING "Of the platform, not of this machine")']
    if system == "windows":
        lines += ['set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -Wl,--no-insert-timestamp")']   # no DLL of the compiler's beside the program
    file = folder / "toolchain.cmake"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def configure(platform, *options, folder=None):
    """CMake's folder for a platform, with the library that is built."""
    folder = folder or ROOT / "build" / "dist" / platform.name
    run(cmake(), "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", f"--toolchain={toolchain(platform, folder)}", "-DCMAKE_INSTALL_LIBDIR=lib",
        f"-DSHELLWARP_PREBUILT_LIBRARY={platform.built()}", *options, stdout=subprocess.DEVNULL)
    return folder


def plugin_trees(platform, stage):
    """The plug-ins of hosts whose kits are named in the environment, built by the system's compiler."""
    if platform.name != "linux-x86_64" or sys.platform != "linux":
        return
    folder = ROOT / "build" / "dist" / "plugins"
    run(cmake(), "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", f"-DSHELLWARP_PREBUILT_LIBRARY={platform.built()}", "-DSHELLWARP_BUILD_CLI=OFF",
        "-DSHELLWARP_BUILD_TESTS=OFF", stdout=subprocess.DEVNULL)
    for host in ("maya", "houdini"):
        done = subprocess.run([cmake(), "--build", folder, "--target", f"shellwarp_{host}_tree"], capture_output=True, text=True, check=False)
        if done.returncode:
            why = re.search(rf"^{host.title()}: .*", done.stdout, re.M)
            if not why:
                sys.exit(f"dist: {host}: the plug-in could not be built\n{done.stdout}{done.stderr}")
            print(f"dist: left out: the plug-in for {why[0]}", flush=True)
            continue
        for tree in (folder / host / "trees").iterdir():
            shutil.copytree(tree, stage / host / tree.name)


def make(platform, out):
    """Builds one archive and returns its file."""
    library = build_library(platform)
    # The run path of the build tree would leave its length in the program; nothing runs there.
    folder = configure(platform, "-DSHELLWARP_BUILD_TESTS=OFF", "-DSHELLWARP_BUILD_HOSTS=OFF", "-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON")
    run(cmake(), "--build", folder, "--target", "shellwarp_library", "shellwarp_cli", stdout=subprocess.DEVNULL)
    name = f"shellwarp-{VERSION}-{platform.name}"
    stage = folder / "stage" / name
    shutil.rmtree(folder / "stage", ignore_errors=True)
    run(cmake(), "--install", folder, *([] if platform.macos else ["--strip"]), "--prefix", stage, stdout=subprocess.DEVNULL,
        env={**os.environ, "SOURCE_DATE_EPOCH": EPOCH})   # mingw's strip writes the time otherwise
    if platform.name.startswith("windows"):
        microsofts_import_library(stage)
    if platform.name != "linux-aarch64":   # Blender has no such build
        run(sys.executable, ROOT / "host_examples" / "blender" / "build_addon.py", "--library", library, "--out", stage / "blender", stdout=subprocess.DEVNULL)
    plugin_trees(platform, stage)
    archive = out / f"{name}{'.zip' if platform.name.startswith('windows') else '.tar.gz'}"
    pack(stage, archive, name)
    return archive


def microsofts_import_library(stage):
    """lib/shellwarp.lib, by which Microsoft's linker takes the DLL; mingw's has a format of its own."""
    listed = (ROOT / "tests" / "c" / "exported_symbols.txt").read_text(encoding="utf-8").splitlines()
    exported = [name for name in listed if not name.startswith("#")]
    definition = stage / "shellwarp.def"
    definition.write_text("LIBRARY shellwarp.dll\nEXPORTS\n" + "".join(f"    {name}\n" for name in exported), encoding="utf-8")
    run(*ZIG, "dlltool", "-m", "i386:x86-64", "-d", definition, "-l", stage / "lib" / "shellwarp.lib")
    definition.unlink()


def wheel(platform, out):
    """The Python wheel with a platform's library inside."""
    run(sys.executable, ROOT / "host_examples" / "python" / "backend" / "shellwarp_wheel.py", out,
        env={**os.environ, "SHELLWARP_LIBRARY": str(platform.built())})


def extension(built, out):
    """One Blender extension for all platforms of archives that were made here, but those for which there is no Blender."""
    libraries = [platform.built() for platform in built if platform.name != "linux-aarch64"]
    if len(libraries) > 1:
        run(sys.executable, ROOT / "host_examples" / "blender" / "build_addon.py", "--library", *libraries, "--out", out)


def npm_package(out):
    """The npm package, where npm and the WebAssembly target are."""
    targets = subprocess.run(["rustup", "target", "list", "--installed"], capture_output=True, text=True, check=False).stdout if shutil.which("rustup") else ""
    missing = "npm" if not shutil.which("npm") else "" if "wasm32-unknown-unknown" in targets else "rustup target add wasm32-unknown-unknown"
    if missing:
        print(f"dist: left out: the npm package: missing {missing}")
        return
    run("make", "--no-print-directory", "npm", cwd=ROOT, stdout=subprocess.DEVNULL)
    package = ROOT / "out" / "npm" / f"shellwarp-{VERSION}.tgz"
    print(shutil.copy2(package, out / f"shellwarp-npm-{VERSION}.tgz"))


def sums(out):
    """Writes SHA256SUMS of all archives in a folder."""
    archives = sorted(path for path in out.iterdir() if path.name.endswith((".zip", ".tar.gz", ".tgz", ".whl")))
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in archives]
    (out / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


def members(archive):
    """Names in an archive and the digests of what they hold."""
    if archive.suffix == ".zip":
        with zipfile.ZipFile(archive) as packed:
            return {name: hashlib.sha256(packed.read(name)).hexdigest() for name in packed.namelist()}
    with tarfile.open(archive) as packed:
        return {member.name: hashlib.sha256(packed.extractfile(member).read()).hexdigest() if member.isfile() else member.linkname
                for member in packed.getmembers()}


def again(names, out):
    """Builds the archives in another folder and lists what differs; how many archives do."""
    with tempfile.TemporaryDirectory(prefix="shellwarp-built-elsewhere-") as folder:
        copy = Path(folder) / "sources"
        files = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, check=True)
        for name in files.stdout.decode().split("\0"):
            if name and (ROOT / name).is_file():
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, copy / name)
        environment = {key: value for key, value in os.environ.items() if key not in ("CARGO_TARGET_DIR", "MAKEFLAGS")}
        run("sh", "cmake/bootstrap.sh", "portable", cwd=copy, env=environment)
        run(sys.executable, "cmake/dist.py", *names, "--out", copy / "out", cwd=copy, env=environment)
        differ = 0
        for archive in sorted(path for path in (copy / "out").glob("shellwarp-*") if (out / path.name).exists()):
            first, second = out / archive.name, archive
            same = first.read_bytes() == second.read_bytes()
            print(f"dist: {archive.name}: {'the same bytes' if same else 'differs'} when built in another folder")
            differ += not same
            a, b = members(first), members(second)
            for name in sorted(name for name in {*a, *b} if a.get(name) != b.get(name)):
                print(f"dist:   {name}")
    return differ


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=", ".join(PLATFORMS))
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "dist")
    parser.add_argument("--again", action="store_true", help="build elsewhere and compare")
    options = parser.parse_args()
    unknown = [name for name in options.platforms if name not in PLATFORMS]
    if unknown:
        parser.error(f"no platform {unknown[0]}; there are {', '.join(PLATFORMS)}")
    if options.again:
        built = [name for name in options.platforms or PLATFORMS if list(options.out.glob(f"shellwarp-{VERSION}-{name}.*"))]
        return 1 if again(built, options.out) else 0
    options.out.mkdir(parents=True, exist_ok=True)
    built = []
    for platform in [PLATFORMS[name] for name in options.platforms or PLATFORMS]:
        missing = platform.missing()
        if missing and options.platforms:
            sys.exit(f"dist: {platform.name}: missing {missing}")
        print(f"dist: left out: {platform.name}: missing {missing}" if missing else make(platform, options.out), flush=True)
        if not missing:
            wheel(platform, options.out)
            built.append(platform)
    extension(built, options.out)
    npm_package(options.out)
    sums(options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
