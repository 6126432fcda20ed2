"""The platforms for which archives are made: what compiles for each, and what runs its programs on this machine.

    dist_platforms.py library PLATFORM   build the library as the archives have it, and print where it is
"""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target").resolve()
ZIG = [str(ROOT / ".venv" / "bin" / "python"), "-m", "ziglang"]
OLDEST_GLIBC = "2.17"   # of 2013: RHEL 7's
OLDEST_MACOS = "11.0"   # of 2020, the first on ARM


@dataclass(frozen=True)
class Platform:
    name: str            # of the archive
    rust: str            # cargo's name of it
    library: str         # the file that cargo writes
    needs: tuple         # programs that build for it
    apt: str             # Debian's packages of these
    strip: str
    runner: tuple = ()   # what runs its programs here; nothing where they run by themselves

    @property
    def zig(self):
        """Zig's name of it, where zig compiles its C and C++."""
        if self.macos:
            return f"{self.rust.split('-', maxsplit=1)[0]}-macos.{OLDEST_MACOS}"
        return self.rust.replace("-unknown", "") + f".{OLDEST_GLIBC}" if "linux" in self.rust else ""

    @property
    def macos(self):
        return "apple" in self.rust

    def missing(self):
        """What is not here that builds for it: a text, or nothing."""
        names = [name for name in self.needs if not shutil.which(name)]
        if names:
            return f"{', '.join(names)} (apt install {self.apt})"
        if self.zig and subprocess.run([*ZIG, "version"], capture_output=True, check=False).returncode:
            return "zig (sh cmake/bootstrap.sh portable)"
        if self.rust not in installed_targets():
            return f"Rust's target (rustup target add {self.rust})"
        return ""

    def built(self):
        """Where cargo leaves the library."""
        return TARGET / self.rust / "release" / self.library


ARM_ROOT = "/usr/aarch64-linux-gnu"   # of Debian's libc6-arm64-cross
PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("linux-x86_64", "x86_64-unknown-linux-gnu", "libshellwarp.so", ("strip",), "binutils", "strip"),
        Platform("linux-aarch64", "aarch64-unknown-linux-gnu", "libshellwarp.so", ("aarch64-linux-gnu-strip",), "binutils-aarch64-linux-gnu",
                 "aarch64-linux-gnu-strip", ("qemu-aarch64", "-L", ARM_ROOT)),
        Platform("windows-x86_64", "x86_64-pc-windows-gnu", "shellwarp.dll", ("x86_64-w64-mingw32-gcc-posix", "x86_64-w64-mingw32-g++-posix"),
                 "g++-mingw-w64-x86-64-posix", "x86_64-w64-mingw32-strip", ("wine",)),
        # Linked against what zig has of the system, without Apple's kit. Nothing runs them here.
        Platform("macos-x86_64", "x86_64-apple-darwin", "libshellwarp.dylib", (), "", ""),
        Platform("macos-aarch64", "aarch64-apple-darwin", "libshellwarp.dylib", (), "", ""),
    )
}


def installed_targets():
    done = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True)
    return {path.name for path in (Path(done.stdout.strip()) / "lib" / "rustlib").iterdir()}


def places():
    """Folders of this machine, and what stands for them in binaries."""
    cargo = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    # rustc takes the last that fits.
    return {sysroot: "rust", str(cargo / "registry" / "src"): "crates", str(TARGET): "target", str(ROOT): "shellwarp"}


def without_places():
    """Flags of rustc that leave the folders of this machine out."""
    return [f"--remap-path-prefix={place}={name}" for place, name in sorted(places().items(), key=lambda pair: len(pair[0]))]


def build_module():
    """The WebAssembly module with SIMD, without folders of this machine inside; its names stay, for profilers."""
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": "\x1f".join([*without_places(), "-Ctarget-feature=+simd128"])}
    subprocess.run(["cargo", "build", "--locked", "--release", "--lib", "--target", "wasm32-unknown-unknown"], cwd=ROOT, env=environment, check=True)
    return TARGET / "wasm32-unknown-unknown" / "release" / "shellwarp.wasm"


def build_library(platform):
    """The library, stripped and without folders of this machine inside; returns its file."""
    flags = without_places()
    if "windows" in platform.rust:
        flags.append("-Clink-arg=-Wl,--no-insert-timestamp")
    environment = {**os.environ, "CARGO_ENCODED_RUSTFLAGS": "\x1f".join(flags), "CARGO_PROFILE_RELEASE_DEBUG": "false",
                   "CARGO_PROFILE_RELEASE_STRIP": "symbols", "CARGO_INCREMENTAL": "0"}
    words, target = ["cargo", "build"], platform.rust
    if platform.macos:   # the linker strips as it signs: who strips afterwards breaks the signature
        environment |= {"CARGO_PROFILE_RELEASE_STRIP": "none", "MACOSX_DEPLOYMENT_TARGET": OLDEST_MACOS,
                        "CARGO_ENCODED_RUSTFLAGS": "\x1f".join([*flags, "-Clink-arg=-Wl,-s"])}
    if platform.zig:
        environment["PATH"] = f"{ROOT / '.venv' / 'bin'}{os.pathsep}{environment['PATH']}"
        words, target = ["cargo-zigbuild", "zigbuild"], platform.rust + ("" if platform.macos else f".{OLDEST_GLIBC}")
    else:
        key = platform.rust.upper().replace("-", "_")
        environment[f"CARGO_TARGET_{key}_LINKER"] = platform.needs[0]
    subprocess.run([*words, "--locked", "--release", "--lib", "--target", target], cwd=ROOT, env=environment, check=True)
    return platform.built()


def main():
    if sys.argv[1:] == ["module"]:
        print(build_module())
        return
    if len(sys.argv) != 3 or sys.argv[1] != "library" or sys.argv[2] not in PLATFORMS:
        sys.exit(f"usage: dist_platforms.py module | library {'|'.join(PLATFORMS)}")
    platform = PLATFORMS[sys.argv[2]]
    if platform.missing():
        sys.exit(f"dist: {platform.name}: missing {platform.missing()}")
    print(build_library(platform))


if __name__ == "__main__":
    main()
