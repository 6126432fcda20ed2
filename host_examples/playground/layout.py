#!/usr/bin/env python3
"""Prints the structs of include/shellwarp.h as a WebAssembly module has them, where pointers have 4 bytes: JSON of offsets and sizes.

    layout.py include/shellwarp.h
"""

import ctypes
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from generate_abi import Declarations   # noqa: E402

POINTER = ctypes.c_uint32


def kind(name, declared, built):
    """The ctypes class of a field, as the generator of the Python declarations writes it."""
    if name.startswith(("POINTER(", "c_void_p", "c_char_p")) or name in declared.callbacks:
        return POINTER
    inner, _, count = name.partition(" * ")
    if count:
        return kind(inner, declared, built) * int(declared.constants.get(count, count))
    name = declared.aliases.get(name, name)
    return built.get(name) or getattr(ctypes, name)


def main():
    declared = Declarations(Path(sys.argv[1]).read_text(encoding="utf-8"))
    built, out = {}, {"constants": declared.constants}
    for name, fields in declared.structs.items():
        built[name] = type(name, (ctypes.Structure,), {"_fields_": [(field, kind(text, declared, built)) for field, text in fields]})
        out[name] = {"bytes": ctypes.sizeof(built[name]), "at": {field: getattr(built[name], field).offset for field, _ in fields}}
    print(json.dumps(out))


if __name__ == "__main__":
    main()
