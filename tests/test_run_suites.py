"""What `make test` says at its end: counts, what was skipped and how to get it, and the verdict."""

import os
from pathlib import Path
import subprocess
import sys
import tempfile
import unittest

import run_suites

CTEST = """\
1/3 Testing: callers_c
1/3 Test: callers_c
Command: "strip_c"
Output:
fine
----------------------------------------------------------
2/3 Testing: callers_luajit
2/3 Test: callers_luajit
Command: "cmake"
Output:
----------------------------------------------------------
skipped: luajit is not installed (apt install luajit)
<end of output>
"""

MAKEFILE = """\
good:
\t@echo "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.1s"
\t@echo "skipped: the renderer is not set up (make demo)"
bad:
\t@echo "50% tests passed, 1 tests failed out of 2"
\t@exit 2
"""


def run(*suites):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "Makefile").write_text(MAKEFILE)
        command = [sys.executable, str(Path(run_suites.__file__).resolve()), *suites]
        environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
        return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)


class Verdict(unittest.TestCase):
    def test_a_run_ends_with_what_was_skipped_and_a_plain_verdict(self):
        done = run("good")
        self.assertEqual(done.returncode, 0)
        lines = done.stdout.splitlines()
        self.assertEqual(lines[-1], "test: OK")
        self.assertEqual(lines[-2], "3 passed, 0 failed, 1 skipped or ignored")
        self.assertIn("  good: the renderer is not set up (make demo)", lines)

    def test_a_failed_suite_fails_the_run_and_the_others_still_run(self):
        done = run("bad", "good")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stdout.splitlines()[-1], "test: FAILED: bad")
        self.assertIn("4 passed, 1 failed, 1 skipped or ignored", done.stdout)

    def test_a_skipped_test_of_ctest_is_named_with_its_reason(self):
        self.assertEqual(run_suites.of_ctest(CTEST), [("callers_luajit", "luajit is not installed (apt install luajit)")])

    def test_counts_of_unittest_leave_out_what_was_skipped(self):
        self.assertEqual(run_suites.counts("Ran 12 tests in 0.3s\n\nFAILED (failures=1, errors=1, skipped=2)\n"), [8, 2, 2])
        self.assertEqual(run_suites.counts("Ran 1 test in 0.3s\n\nOK\n"), [1, 0, 0])


if __name__ == "__main__":
    unittest.main()
