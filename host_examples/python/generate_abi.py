#!/usr/bin/env python3
"""Writes shellwarp/_abi.py, the ctypes declarations, from include/shellwarp.h; `make python-abi` calls it.

    generate_abi.py HEADER > shellwarp/_abi.py

The header is the one source of the interface. It is written by cbindgen, so its C is plain: comments, `#define NAME number`,
typedefs of structs, of function pointers and of integers, and prototypes; what stands between #ifndef SHELLWARP_NO_INLINE and
#endif is left out. Anything else is an error here, not a guess.
"""

import re
import sys

SCALARS = {"uint8_t": "c_uint8", "uint32_t": "c_uint32", "uint64_t": "c_uint64", "double": "c_double", "char": "c_char"}


class Declarations:
    """What the header declares, in its order."""

    def __init__(self, text):
        self.constants, self.structs, self.callbacks, self.functions = {}, {}, {}, {}
        self.aliases, self.opaque = {}, []
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.S)
        text = re.sub(r"#(ifdef __cplusplus|ifndef SHELLWARP_NO_INLINE).*?#endif", "", text, flags=re.S)
        for line in re.findall(r"^#.*$", text, flags=re.M):
            self.directive(line)
        text = re.sub(r"^#.*$", "", text, flags=re.M)
        for statement in re.findall(r"[^;{}]*(?:\{[^}]*\}[^;]*)?;", text):
            self.statement(" ".join(statement.split()))

    def directive(self, line):
        found = re.fullmatch(r"#define (SW_\w+) (\d+)", line)
        if found:
            self.constants[found[1]] = int(found[2])
        elif not re.match(r"#(ifndef|define) SHELLWARP_H|#include <std\w+\.h>|#endif", line):
            raise ValueError(f"a preprocessor line that is not understood: {line}")

    def statement(self, text):
        opaque = re.fullmatch(r"typedef struct (\w+) \1;", text)
        struct = re.fullmatch(r"typedef struct (\w+) \{(.*)\} \1;", text)
        callback = re.fullmatch(r"typedef (.+?) ?\(\*(\w+)\)\((.*)\);", text)
        alias = re.fullmatch(r"typedef (\w+) (\w+);", text)
        function = re.fullmatch(r"(.+?)(sw_\w+)\((.*)\);", text)
        if opaque:
            self.opaque.append(opaque[1])
        elif struct:
            self.structs[struct[1]] = [self.field(part.strip()) for part in struct[2].split(";") if part.strip()]
        elif callback:
            self.callbacks[callback[2]] = [self.type(callback[1]), *self.parameters(callback[3])]
        elif alias:
            self.aliases[alias[2]] = self.type(alias[1])
        elif function:
            self.functions[function[2]] = (self.type(function[1]), self.parameters(function[3]))
        else:
            raise ValueError(f"a declaration that is not understood: {text}")

    def field(self, text):
        found = re.fullmatch(r"(.*?)(\w+)(?:\[(\w+)\])?", text)
        name, kind = found[2], self.type(found[1])
        return name, f"{kind} * {self.constants.get(found[3], found[3])}" if found[3] else kind

    def parameters(self, text):
        return [] if text == "void" else [self.field(part.strip())[1] for part in text.split(",")]

    def type(self, text):
        """The ctypes type of a C type. Buffers of the caller are plain addresses, structs of this header are typed."""
        words = text.replace("const ", "").replace("struct ", "").replace(" ", "")
        name, stars = words.rstrip("*"), words.count("*")
        if name == "void":
            return "c_void_p" if stars else "None"
        if name == "char" and stars == 1:
            return "c_char_p"
        if name in self.structs or name in self.opaque:
            kind = name
        elif stars:
            return "c_void_p"
        else:
            kind = self.aliases.get(name) or SCALARS.get(name) or (name if name in self.callbacks else None)
        if kind is None:
            raise ValueError(f"a type that is not understood: {text}")
        return "POINTER(" * stars + kind + ")" * stars


def python_source(declared):
    lines = ['"""The C interface in ctypes. Generated from include/shellwarp.h by `make python-abi`, do not edit."""', "",
             "from ctypes import CFUNCTYPE, POINTER, Structure, c_char, c_char_p, c_double, c_uint32, c_uint64, c_void_p", ""]
    lines += [f"{name} = {value}" for name, value in declared.constants.items()]
    for name in declared.opaque:
        lines += ["", "", f"class {name}(Structure):", '    """Opaque."""']
    lines += ["", ""]
    lines += [f"{name} = CFUNCTYPE({', '.join(types)})" for name, types in declared.callbacks.items()]
    for name, fields in declared.structs.items():
        lines += ["", "", f"class {name}(Structure):", "    _fields_ = ["]
        lines += [f'        ("{field}", {kind}),' for field, kind in fields] + ["    ]"]
    lines += ["", "", "# Result and parameters of every function.", "FUNCTIONS = {"]
    lines += [f'    "{name}": ({result}, [{", ".join(types)}]),' for name, (result, types) in declared.functions.items()]
    return "\n".join(lines + ["}"]) + "\n"


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.write(python_source(Declarations(file.read())))


if __name__ == "__main__":
    main()
