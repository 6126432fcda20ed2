"""Every public name of the package says its types, and a program that uses them is accepted by mypy where that is installed."""

import importlib.util
import inspect
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import shellwarp as sw

PROGRAM = """
import numpy
import shellwarp as sw

shell = sw.Shell([[0, 0, 0], [1, 0, 0], [0, 1, 0]], numpy.array([[0, 1, 2]]), sw.Material(bend=1), fixed=[0])
with sw.Model(shell) as model:
    model.precompute(modes=4, progress=lambda phase, fraction: fraction < 1)
    with model.state("lma") as state:
        state.set_gravity([0, 0, -1])
        state.set_frame(rotation=numpy.eye(3))
        reveal_type(state.positions())
        reveal_type(model.save())
        state.correct()
        state.correct(steps="auto")
        state.positions_corrected(2)
        error: float = state.certify()["error"]
"""
WRONG = "import shellwarp as sw\nsw.methods() + 1\nsw.Model(3)\nsw.State.correct(steps='all')\n"


def public():
    """Each function and method that users call, by its name."""
    for name in sw.__all__:
        thing = getattr(sw, name)
        if inspect.isclass(thing):
            for member, value in inspect.getmembers(thing):
                value = value.fget if isinstance(value, property) else value
                if not member.startswith("_") and inspect.isroutine(value) and getattr(value, "__module__", "").startswith("shellwarp"):
                    yield f"{name}.{member}", value
        elif inspect.isroutine(thing):
            yield name, thing
    for name, value in vars(sw.method).items():
        if inspect.isfunction(value) and value.__module__ == sw.method.__name__ and not name.startswith("_"):
            yield f"method.{name}", value


def mypy(program):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "program.py").write_text(program, encoding="utf-8")
        done = subprocess.run([sys.executable, "-m", "mypy", "--follow-imports=silent", "--cache-dir", f"{folder}/cache", "program.py"], cwd=folder, capture_output=True, text=True,
                              check=False, env={"MYPYPATH": str(Path(sw.__file__).resolve().parents[1]), "PATH": ""})
        return done.returncode, done.stdout


class Types(unittest.TestCase):
    def test_every_public_function_says_what_it_takes_and_gives(self):
        found = dict(public())
        self.assertGreater(len(found), 50)
        for name, function in found.items():
            signature = inspect.signature(function)
            untold = [p.name for p in signature.parameters.values() if p.name not in ("self", "cls") and p.annotation is inspect.Parameter.empty]
            self.assertEqual((name, untold), (name, []))
            self.assertIsNot(signature.return_annotation, inspect.Signature.empty, f"{name} does not say what it gives")

    def test_the_package_tells_type_checkers_so(self):
        self.assertTrue((Path(sw.__file__).parent / "py.typed").exists())

    @unittest.skipUnless(importlib.util.find_spec("mypy"), "mypy is not installed (sh cmake/bootstrap.sh python)")
    def test_mypy_accepts_a_program_and_finds_its_mistakes(self):
        code, text = mypy(PROGRAM)
        self.assertEqual(code, 0, text)
        self.assertIn("ndarray", text)
        self.assertIn('is "bytes"', text)
        code, text = mypy(WRONG)
        self.assertEqual((code, text.count("error:")), (1, 4), text)


if __name__ == "__main__":
    unittest.main()
