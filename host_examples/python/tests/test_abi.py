"""The ctypes declarations are what include/shellwarp.h says, by three judges: the generator run anew, the table that the C
compilers check, and cffi's own parser of C."""

import ctypes
import re
import subprocess
import sys
import unittest
from pathlib import Path

from shellwarp import abi

ROOT = Path(__file__).resolve().parents[3]
HEADER = ROOT / "include" / "shellwarp.h"
STRUCTS = {name: kind for name, kind in vars(abi).items()
           if isinstance(kind, type) and issubclass(kind, ctypes.Structure) and hasattr(kind, "_fields_")}


class Abi(unittest.TestCase):
    def test_declarations_are_what_the_header_generates(self):
        here = ROOT / "host_examples" / "python"
        made = subprocess.run([sys.executable, here / "generate_abi.py", HEADER], stdout=subprocess.PIPE, text=True, check=True)
        present = (here / "shellwarp" / "_abi.py").read_text(encoding="utf-8")
        self.assertTrue(made.stdout == present, "shellwarp/_abi.py is out of date: run `make python-abi`")

    def test_a_declaration_that_the_generator_does_not_know_is_an_error(self):
        sys.path.insert(0, str(ROOT / "host_examples" / "python"))
        from generate_abi import Declarations
        for text in ("#define SW_X (1 << 3)\n", "union U { int a; };\n", "int32_t sw_f(void);\n", "#pragma pack(1)\n"):
            with self.assertRaises(ValueError, msg=text):
                Declarations(text)

    def test_every_struct_lies_as_the_c_compilers_say(self):
        table = (ROOT / "tests" / "c" / "struct_layout.def").read_text(encoding="utf-8")
        sizes = dict(re.findall(r"^STRUCT\((\w+), (\d+)\)", table, flags=re.M))
        fields = re.findall(r"^FIELD\((\w+), (\w+), (\d+), (\d+)\)", table, flags=re.M)
        self.assertEqual(sorted(sizes), sorted(STRUCTS))
        self.assertEqual({name: ctypes.sizeof(kind) for name, kind in STRUCTS.items()},
                         {name: int(size) for name, size in sizes.items()})
        found = [(name, field, getattr(kind, field).offset, getattr(kind, field).size)
                 for name, kind in STRUCTS.items() for field, _ in kind._fields_]
        self.assertEqual(sorted(found), sorted((s, f, int(o), int(n)) for s, f, o, n in fields))

    def test_every_exported_function_is_declared_and_no_other(self):
        listed = (ROOT / "tests" / "c" / "exported_symbols.txt").read_text(encoding="utf-8").split("\n")
        self.assertEqual(sorted(abi.FUNCTIONS), sorted(name for name in listed if name and not name.startswith("#")))

    def test_cffi_reads_the_same_constants_structs_and_parameters(self):
        try:
            import cffi
        except ImportError:
            self.skipTest("cffi is not installed (sh cmake/bootstrap.sh python)")
        text = re.sub(r"#(?:ifdef __cplusplus|ifndef SHELLWARP_NO_INLINE).*?#endif[^\n]*", "", HEADER.read_text(encoding="utf-8"), flags=re.S)
        text = re.sub(r"^#(?!define SW_\w+ \d).*$", "", text, flags=re.M)
        ffi = cffi.FFI()
        ffi.cdef(text)
        library = ffi.dlopen(None)
        constants = {name: value for name, value in vars(abi).items() if re.match(r"SW_[A-Z0-9_]+$", name)}
        self.assertGreater(len(constants), 50)
        self.assertEqual({name: getattr(library, name) for name in constants}, constants)
        for name, kind in STRUCTS.items():
            layout = dict(ffi.typeof(f"struct {name}").fields)
            self.assertEqual({f: (layout[f].offset, ffi.sizeof(layout[f].type)) for f in layout},
                             {f: (getattr(kind, f).offset, getattr(kind, f).size) for f, _ in kind._fields_}, name)
        for name, (_, parameters) in abi.FUNCTIONS.items():
            declared = re.search(rf"\b{name}\(([^)]*)\)", text)[1]
            signature = ffi.typeof(f"void (*)({declared})").args
            self.assertEqual([ctypes.sizeof(p) for p in parameters], [ffi.sizeof(p) for p in signature], name)


if __name__ == "__main__":
    unittest.main()
