"""No host has a table of methods of its own: names come from the library, and the same ones everywhere. Run by ctest as `method_tables`.

A file that names two methods or more has a table, unless it is listed below with a reason: it would have to be touched when the
library gets another method."""

import ast
import re
import unittest
from pathlib import Path

import shellwarp

ROOT = Path(__file__).resolve().parents[2]
HOSTS = ROOT / "host_examples"
METHODS = shellwarp.method.table()
NAMES = {method.name for method in METHODS}
CONSTANTS = {name: number for name, number in vars(shellwarp.abi).items() if name.startswith("SW_METHOD_")}

# By file: the methods that it names, and why it may.
REASONS = {
    "python/shellwarp/_abi.py": "made from the header, where every method has its constant",
    "python/shellwarp/method.py": "the default, and linear modal analysis, the one of which the needs do not tell how it moves",
    "cli/advice.cpp": "what a run that is far off is told to take: the automatic choice, and the full shell",
    "cli/choice.cpp": "what moves limp cloth in the automatic choice's place, and whether there is a reduced shell",
    "cli/comparison.cpp": "the expectation warp_below_lma is about these two; the full shell is what all are compared with",
    "blender/addon/inputs.py": "those that follow supports by fields; the library's table does not tell",
    "blender/addon/simulation.py": "whether the automatic choice took a reduced shell, and why not",
    "common/method.cpp": "linear modes, of which the needs do not tell how it moves, and the one that moves by modes and has no support fields",
    "render/moving_supports_picture.py": "the picture is of these two",
    "render/theory_pictures.py": "each picture is of the methods that its page explains",
}


def words_of_python(text):
    """What a program says: strings but for docstrings, and names."""
    tree = ast.parse(text)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {id(node.body[0].value) for node in ast.walk(tree)
                  if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield from {node.value, *re.findall(r'"([^"]*)"', node.value)}   # also a table in another language
        elif isinstance(node, (ast.Name, ast.Attribute)):
            yield node.id if isinstance(node, ast.Name) else node.attr


def words_of_cpp(text):
    """The same: what is in quotes, and names. Comments are left out."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
    return re.findall(r'"([^"\n]*)"', code) + re.findall(r"\bSW_METHOD_\w+", code)


def methods_in(path, text):
    """The numbers of the methods that a source names, by name, label or constant."""
    words = set(words_of_python(text) if path.suffix == ".py" else words_of_cpp(text))
    by_word = {word: method.number for method in METHODS for word in (method.name, method.label)}
    return {number for word, number in {**by_word, **CONSTANTS}.items() if word in words}


def sources():
    for path in sorted(HOSTS.rglob("*")):
        inside = path.relative_to(HOSTS).parts
        if path.suffix in (".py", ".cpp", ".hpp") and not {"tests", "third_party", "build"} & set(inside) and not path.name.startswith("test_"):
            yield path


class Tables(unittest.TestCase):
    def test_no_host_has_a_table_of_methods(self):
        found = {str(path.relative_to(HOSTS)): methods_in(path, path.read_text(encoding="utf-8")) for path in sources()}
        self.assertGreater(len(found), 80, "all hosts are read")
        tables = {name: sorted(numbers) for name, numbers in found.items() if len(numbers) > 1 and name not in REASONS}
        self.assertEqual(tables, {}, "these name several methods: take them from the library's table, or give a reason here")
        self.assertEqual({name for name in REASONS if len(found.get(name, ())) < 2}, set(), "reasons that nothing needs any more")

    def test_a_table_is_found_in_any_language_and_a_comment_is_none(self):
        first, second = METHODS[0], METHODS[1]
        for name, text, count in [
                ("a.cpp", f'const char *const kNames[] = {{"{first.name}", "{second.name}"}};', 2),
                ("a.cpp", f'fn.addField("{first.label}", 0);\nfn.addField("{second.label}", 1);', 2),
                ("a.cpp", "return k ? SW_METHOD_WARP : SW_METHOD_LMA;", 2),
                ("a.cpp", f'// "{first.name}", "{second.name}"\nint k;  /* SW_METHOD_WARP, SW_METHOD_LMA */', 0),
                ("a.py", f'COLOURS = {{"{first.name}": 1, "{second.name}": 2}}', 2),
                ("a.py", f"SCRIPT = '''menu {{ \"{first.name}\" \"A\" \"{second.name}\" \"B\" }}'''", 2),
                ("a.py", "METHODS = [abi.SW_METHOD_WARP, abi.SW_METHOD_LMA]", 2),
                ("a.py", f'"""Takes "{first.name}" or "{second.name}"."""\nDEFAULT = "{first.name}"', 1)]:
            with self.subTest(text=text):
                self.assertEqual(len(methods_in(Path(name), text)), count)


class Default(unittest.TestCase):
    def test_every_host_takes_the_same_method_unless_told_otherwise(self):
        def found(path, pattern):
            return re.search(pattern, (HOSTS / path).read_text(encoding="utf-8"))[1]

        default = shellwarp.method.find(shellwarp.method.DEFAULT)
        self.assertEqual(CONSTANTS[found("common/method.hpp", r"kDefaultMethod = (SW_METHOD_\w+);")], default.number)
        self.assertEqual(found("houdini/SOP_ShellWarp.cpp", r'name "method" .* type string default { "([a-z-]+)" }'), default.name)
        self.assertEqual(int(found("blender/addon/properties.py", r"default=(\d+), options=NOT_KEYED, items=methods")), default.number)


class Names(unittest.TestCase):
    def test_scenes_and_lists_have_names_of_the_library(self):
        given = []
        for path in [*(ROOT / "tests" / "scenes").glob("*.toml"), *(HOSTS / "farm" / "lists").glob("*.toml")]:
            text = path.read_text(encoding="utf-8")
            given += [(path.name, name) for name in re.findall(r'\bmethod = "([^"]*)"', text)]
            given += [(path.name, name) for names in re.findall(r"^methods = \[(.*)\]", text, re.M) for name in re.findall(r'"([^"]*)"', names)]
        self.assertGreater(len(given), 20)
        self.assertEqual([(path, name) for path, name in given if name not in NAMES], [])

    def test_pages_and_tests_give_the_program_names_of_the_library(self):
        files = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", *(ROOT / "tests").rglob("*.txt"), *(ROOT / "tests" / "scenes").glob("*.toml")]
        given = [(path.name, name) for path in files for name in re.findall(r"--method ([a-z][a-z-]*)", path.read_text(encoding="utf-8"))]
        self.assertGreater(len(given), 5)
        self.assertEqual([(path, name) for path, name in given if name not in NAMES | {"ds"}], [], '"ds" is a test of an unknown one')

    def test_the_page_of_names_has_those_of_the_library(self):
        rows = re.findall(r"^\| `([a-z-]+)` \| ([^|]*) \| `(SW_METHOD_\w+)` \|", (ROOT / "docs/guide/methods.md").read_text(encoding="utf-8"), re.M)
        self.assertGreater(len(rows), 7)
        table = {method.name: (method.label, method.number) for method in METHODS}
        for name, label, constant in rows:
            self.assertEqual((label, CONSTANTS[constant]), table[name])


if __name__ == "__main__":
    unittest.main()
