#!/usr/bin/env python3
"""Prints the structs of include/shellwarp.h as a WebAssembly module has them, where pointers have 4 bytes.

    layout.py include/shellwarp.h            JSON of constants, offsets, sizes and kinds of fields
    layout.py include/shellwarp.h --types    the same as declarations for TypeScript
"""

import ctypes
import json
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from generate_abi import Declarations   # noqa: E402

POINTER = ctypes.c_uint32
KINDS = {"c_uint8": "u8", "c_char": "u8", "c_uint32": "u32", "c_uint64": "u64", "c_double": "f64"}
# Structs that a page fills in, and those that it reads.
WRITTEN = re.compile(r"Sw\w+Desc")
READ = re.compile(r"Sw(\w+Info|\w+Report|Certificate)")


def is_pointer(name, declared):
    return name.startswith(("POINTER(", "c_void_p", "c_char_p")) or name in declared.callbacks


def kind(name, declared, built):
    """The ctypes class of a field, as the generator of the Python declarations writes it."""
    if is_pointer(name, declared):
        return POINTER
    inner, _, count = name.partition(" * ")
    if count:
        return kind(inner, declared, built) * int(declared.constants.get(count, count))
    name = declared.aliases.get(name, name)
    return built.get(name) or getattr(ctypes, name)


def word(name, declared):
    """What a field holds: u8, u32, u64, f64, pointer or a struct, and how many."""
    if is_pointer(name, declared):
        return ["pointer", 1]
    inner, _, count = name.partition(" * ")
    inner = declared.aliases.get(inner, inner)
    return [KINDS.get(inner, inner), int(declared.constants.get(count, count)) if count else 1]


def camel(name):
    return re.sub(r"_(\w)", lambda found: found[1].upper(), name)


def typescript(declared):
    """Interfaces of the structs that a page writes or reads, by camelCase names."""
    of = {"u8": "number", "u32": "number", "u64": "number", "f64": "number", "pointer": "ArrayBufferView"}
    lines = ["// Written by host_examples/npm/layout.py from the C header, do not edit: the fields are explained there.\n"]
    for name, fields in declared.structs.items():
        if not (WRITTEN.fullmatch(name) or READ.fullmatch(name)):
            continue
        lines.append(f"export interface {name[2:]} {{")
        for field, text in fields:
            what, count = word(text, declared)
            if field in ("struct_size", "reserved", "reserved2") or what not in of or (READ.fullmatch(name) and what == "pointer"):
                continue
            lines.append(f"  {camel(field)}{'?' if WRITTEN.fullmatch(name) else ''}: {of[what]}{'[]' if count > 1 else ''};")
        lines.append("}\n")
    return "\n".join(lines)


def main():
    declared = Declarations(Path(sys.argv[1]).read_text(encoding="utf-8"))
    if sys.argv[2:] == ["--types"]:
        print(typescript(declared), end="")
        return
    built, out = {}, {"constants": declared.constants}
    for name, fields in declared.structs.items():
        built[name] = type(name, (ctypes.Structure,), {"_fields_": [(field, kind(text, declared, built)) for field, text in fields]})
        out[name] = {"bytes": ctypes.sizeof(built[name]), "at": {field: getattr(built[name], field).offset for field, _ in fields},
                     "kind": {field: word(text, declared) for field, text in fields}}
    print(json.dumps(out))


if __name__ == "__main__":
    main()
