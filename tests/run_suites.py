#!/usr/bin/env python3
"""Runs the test suites of `make test` one after another and ends with one list of what was skipped, and a verdict.

    python3 tests/run_suites.py [--log FOLDER] [--name test] SUITE…      each a target of make

A test or a part of a suite that needs what is not installed says so in a line that begins with "skipped: " and tells how to get it.
What ctest ran is read from its own log, since it does not print what a skipped test says.
"""

import argparse
import os
from pathlib import Path
import re
import subprocess
import sys

CTEST_LOG = Path("build/Testing/Temporary/LastTest.log")
CTEST_COUNTS = re.compile(r"^\d+% tests passed, (\d+) tests failed out of (\d+)", re.M)
CARGO_COUNTS = re.compile(r"^test result: \w+\. (\d+) passed; (\d+) failed; (\d+) ignored", re.M)
NODE_COUNTS = re.compile(r"^# pass (\d+)\n# fail (\d+)\n# cancelled (\d+)\n# skipped (\d+)", re.M)
UNITTEST_RAN = re.compile(r"^Ran (\d+) tests? in .*\n\n(?:OK|FAILED)(?: \((.*)\))?", re.M)
SKIPPED = re.compile(r"^skipped: (.*)", re.M)


def of_ctest(log):
    """Name and reason of each test of ctest's log that was skipped."""
    tests = re.split(r"^\d+/\d+ Test: ", log, flags=re.M)[1:]
    found = [(test.split("\n", 1)[0].strip(), SKIPPED.search(test)) for test in tests]
    return [(name, reason[1]) for name, reason in found if reason]


def counts(text):
    """Passed, failed and skipped tests that an output tells of: cargo's, ctest's, node's and unittest's."""
    total = [0, 0, 0]

    def add(*more):
        total[:] = [a + b for a, b in zip(total, more)]

    for passed, failed, ignored in CARGO_COUNTS.findall(text):
        add(int(passed), int(failed), int(ignored))
    for failed, of in CTEST_COUNTS.findall(text):
        skipped = len(re.findall(r"\*\*\*Skipped", text))
        add(int(of) - int(failed) - skipped, int(failed), skipped)
    for passed, failed, cancelled, ignored in NODE_COUNTS.findall(text):
        add(int(passed), int(failed) + int(cancelled), int(ignored))
    for ran, notes in UNITTEST_RAN.findall(text):
        noted = {key: int(n) for key, n in re.findall(r"(\w+)=(\d+)", notes)}
        failed, skipped = noted.get("failures", 0) + noted.get("errors", 0), noted.get("skipped", 0)
        add(int(ran) - failed - skipped, failed, skipped)
    return total


def run(suite, folder):
    """Runs a suite, shows its output and keeps it. Returns exit code and output."""
    print(f"== {suite}", flush=True)
    lines = []
    with subprocess.Popen([os.environ.get("MAKE", "make"), "--no-print-directory", suite], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace") as process, \
            open(folder / f"{suite}.log", "w", encoding="utf-8") as log:
        for line in process.stdout:
            sys.stdout.write(line)
            sys.stdout.flush()
            log.write(line)
            lines.append(line)
    return process.returncode, "".join(lines)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--log", type=Path, default=Path("build/test-logs"), help="folder for each suite's output")
    arguments.add_argument("--name", default="test", help="what the verdict is of")
    arguments.add_argument("suites", nargs="+")
    options = arguments.parse_args()
    options.log.mkdir(parents=True, exist_ok=True)
    failed, skipped, total = [], [], [0, 0, 0]
    for suite in options.suites:
        before = CTEST_LOG.stat().st_mtime_ns if CTEST_LOG.exists() else 0
        code, text = run(suite, options.log)
        total = [a + b for a, b in zip(total, counts(text))]
        if code:
            failed.append(suite)
        if CTEST_LOG.exists() and CTEST_LOG.stat().st_mtime_ns != before:
            skipped += of_ctest(CTEST_LOG.read_text(encoding="utf-8", errors="replace"))
        skipped += [(suite, reason) for reason in SKIPPED.findall(text)]
    if skipped:
        print("\nskipped, and how to have it run:")
        for name, reason in skipped:
            print(f"  {name}: {reason}")
    print(f"\n{total[0]} passed, {total[1]} failed, {total[2]} skipped or ignored")
    print(f"{options.name}: FAILED: {' '.join(failed)}" if failed else f"{options.name}: OK")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
