#!/usr/bin/env python3
"""Packs a folder into an archive: the same files give the same bytes.

    pack.py FOLDER ARCHIVE.zip|ARCHIVE.tar.gz [--inside NAME]

Names are sorted, times and owners left out. With --inside the archive holds one folder of that name, with all in it.
"""

import argparse
import gzip
import io
import os
import tarfile
import zipfile
from pathlib import Path

DATE = (1980, 1, 1, 0, 0, 0)


def entries(folder):
    """What is in a folder, sorted by name: files and links, not the folders themselves."""
    return sorted((path for path in folder.rglob("*") if path.is_symlink() or path.is_file()), key=lambda path: path.relative_to(folder).as_posix())


def mode_of(path):
    return 0o755 if path.stat().st_mode & 0o100 else 0o644


def write_zip(folder, archive, inside):
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
        for path in entries(folder):
            info = zipfile.ZipInfo((inside / path.relative_to(folder)).as_posix(), DATE)
            info.create_system = 3   # of Unix, on every system: the mode counts
            info.external_attr = (0o100000 | mode_of(path)) << 16
            out.writestr(info, path.read_bytes(), zipfile.ZIP_DEFLATED)   # a link is packed as the file that it leads to


def write_tar(folder, archive, inside):
    with archive.open("wb") as file, gzip.GzipFile("", "wb", 9, file, mtime=0) as packed, tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as out:
        for path in entries(folder):
            info = tarfile.TarInfo((inside / path.relative_to(folder)).as_posix())
            if path.is_symlink():
                info.type, info.linkname, info.mode = tarfile.SYMTYPE, os.readlink(path), 0o777
                out.addfile(info)
            else:
                data = path.read_bytes()
                info.size, info.mode = len(data), mode_of(path)
                out.addfile(info, io.BytesIO(data))


def pack(folder, archive, inside=""):
    archive.parent.mkdir(parents=True, exist_ok=True)
    write = write_zip if archive.suffix == ".zip" else write_tar
    write(folder, archive, Path(inside))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("archive", type=Path)
    parser.add_argument("--inside", default="")
    options = parser.parse_args()
    if not options.folder.is_dir():
        parser.error(f"{options.folder} is no folder")
    if not options.archive.name.endswith((".zip", ".tar.gz")):
        parser.error(f"{options.archive.name} is neither a .zip nor a .tar.gz")
    pack(options.folder, options.archive, options.inside)
    print(options.archive)


if __name__ == "__main__":
    main()
