"""What a built shared library is for: the processor, the system, and the oldest version of it that it runs on.

    library_file.py FILE [at most GLIBC_X.Y]

prints the platform tag of a Python wheel that carries the file, and the versions of system libraries that it needs.
"""

import re
import shutil
import struct
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

ELF_MACHINES = {0x3E: "x86_64", 0xB7: "aarch64", 0x03: "i686", 0xF3: "riscv64"}
MACH_O = b"\xcf\xfa\xed\xfe"      # 64-bit, little-endian
MACH_O_MACHINES = {0x01000007: "x86_64", 0x0100000C: "arm64"}
LC_BUILD_VERSION = 0x32
PE_MACHINES = {0x8664: "win_amd64", 0xAA64: "win_arm64"}
VERSIONS_NEEDED = 0x6FFFFFFE   # SHT_GNU_verneed
WEAK = 2                       # VER_FLG_WEAK: asked for only by symbols that may be missing


def needed_versions(data):
    """The versions that an ELF file asks of other libraries, such as ("libc.so.6", "GLIBC_2.17"); those it can miss are left out."""
    if data[:4] != b"\x7fELF" or data[4:6] != b"\x02\x01":
        raise ValueError("no 64-bit little-endian ELF file")
    start, = struct.unpack_from("<Q", data, 0x28)
    size, count = struct.unpack_from("<HH", data, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, start + size * k) for k in range(count)]
    return sorted(found for section in sections if section[1] == VERSIONS_NEEDED
                  for found in _versions(data, section[4], section[7], sections[section[6]][4]))


def _versions(data, at, n_files, names):
    def text(offset):
        return data[names + offset:data.index(b"\0", names + offset)].decode()

    for _ in range(n_files):
        _, n_versions, file, first, following = struct.unpack_from("<HHIII", data, at)
        entry = at + first
        for _ in range(n_versions):
            _, flags, _, name, following_entry = struct.unpack_from("<IHHII", data, entry)
            if not flags & WEAK:
                yield text(file), text(name)
            entry += following_entry
        at += following


def oldest_glibc(data):
    """The oldest glibc that an ELF file runs with: (2, 17)."""
    found = [re.fullmatch(r"GLIBC_(\d+)\.(\d+)(?:\.\d+)?", name) for _, name in needed_versions(data)]
    return max((int(match[1]), int(match[2])) for match in found if match)


def load_commands(data):
    """Number and bytes of each load command of a Mach-O file."""
    count, at = struct.unpack_from("<I", data, 16)[0], 32
    for _ in range(count):
        command, size = struct.unpack_from("<II", data, at)
        yield command, data[at:at + size]
        at += size


def mach_o_machine(data):
    return MACH_O_MACHINES[struct.unpack_from("<I", data, 4)[0]]


def oldest_macos(data):
    """The oldest macOS that a Mach-O file is made for: (11, 0)."""
    version, = (struct.unpack_from("<I", command, 12)[0] for number, command in load_commands(data) if number == LC_BUILD_VERSION)
    return version >> 16, version >> 8 & 0xFF


def platform_tag(data):
    """The wheel's tag: manylinux of PEP 600 or macosx by what the file needs, win_amd64, or that of the running Python."""
    if data[:4] == b"\x7fELF":
        machine = ELF_MACHINES[struct.unpack_from("<H", data, 0x12)[0]]
        # PEP 600 begins at 2.5 on x86-64; nothing older is in use.
        return "manylinux_{}_{}_{}".format(*max(oldest_glibc(data), (2, 5)), machine)
    if data[:2] == b"MZ":
        header, = struct.unpack_from("<I", data, 0x3C)
        return PE_MACHINES[struct.unpack_from("<H", data, header + 4)[0]]
    if data[:4] == MACH_O:
        return "macosx_{}_{}_{}".format(*oldest_macos(data), mach_o_machine(data))
    return re.sub(r"[.-]", "_", sysconfig.get_platform())


def stripped(path):
    """The library without debugging information, where there is a program that can take it away."""
    strip = shutil.which("strip")
    if strip and path.read_bytes()[:4] == b"\x7fELF":
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "library"
            if subprocess.run([strip, "--strip-unneeded", "-o", copy, path], capture_output=True, check=False).returncode == 0:
                return copy.read_bytes()
    return path.read_bytes()


def main():
    data = Path(sys.argv[1]).read_bytes()
    print(platform_tag(data))
    if data[:4] != b"\x7fELF":
        return 0
    for file, version in needed_versions(data):
        print(f"  {file} {version}")
    if len(sys.argv) > 2:
        limit = tuple(map(int, re.fullmatch(r"GLIBC_(\d+)\.(\d+)", sys.argv[2]).groups()))
        if oldest_glibc(data) > limit:
            print(f"{sys.argv[1]}: needs a newer glibc than {sys.argv[2]}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
