"""Instructions that each kernel executes, counted by valgrind's callgrind, against the counts checked in.

usage: instructions.py [--update] [--tolerance 0.05]

Counts repeat to a fraction of a percent on one compiler, whatever the machine's load. Valgrind shows programs a processor of
its own, with AVX2 and without AVX-512, wherever the machine has AVX2: so every such machine runs the same kernels. Exits with
an error when a count is more than the tolerance above the checked-in one; counts of another compiler are shown, not judged.
Skipped, with a line that says so, without valgrind or AVX2. `make bench-instructions` runs it.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COUNTS = Path(__file__).with_suffix(".json")


def compiler():
    """The compiler's version and what it compiles for: only counts of the same are comparable."""
    lines = subprocess.run(["rustc", "-vV"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    host = next(line.split()[1] for line in lines if line.startswith("host:"))
    return f"{lines[0].split()[1]} {host}"


def reason_to_skip():
    """What is missing, or None."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    try:
        flags = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.M)
    except OSError:
        flags = None
    return None if flags and "avx2" in flags[1].split() else "the processor has no AVX2"


def build():
    """The program that runs one case."""
    command = ["cargo", "build", "--locked", "--release", "--example", "instructions"]
    subprocess.run(command, cwd=ROOT, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return target / "release" / "examples" / "instructions"


def count(program, case):
    """Instructions inside `measured`."""
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=*measured*", "--callgrind-out-file=/dev/null"]
    done = subprocess.run(command + [program, case], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found or int(found[1]) == 0:
        sys.exit(f"bench-instructions: FAILED: {case} was not counted\n{done.stderr}")
    return int(found[1])


def compare(counts, before, tolerance, judged):
    """Prints the table; the cases that got worse."""
    worse = []
    print(f"{'instructions':<24}{'now':>14}{'checked in':>14}{'ratio':>9}")
    for case, now in counts.items():
        then = before.get(case)
        ratio = now / then if then else None
        mark = ""
        if then is None or (judged and ratio > 1 + tolerance):
            worse.append(case)
            mark = "  worse" if then else "  not checked in"
        print(f"{case:<24}{now:>14}{then or '-':>14}{f'{ratio:.3f}' if ratio else '-':>9}{mark}")
    gone = [case for case in before if case not in counts]
    return worse + gone


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--update", action="store_true", help="check in the counts of this run")
    parser.add_argument("--tolerance", type=float, default=0.05)
    options = parser.parse_args()
    if reason := reason_to_skip():
        print(f"bench-instructions: skipped: {reason}")
        return 0
    program = build()
    cases = subprocess.run([program], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    counts = {case: count(program, case) for case in cases}
    if options.update:
        COUNTS.write_text(json.dumps({"compiler": compiler(), "registers": "AVX2", "counts": counts}, indent=2) + "\n")
        print(f"bench-instructions: wrote {COUNTS.relative_to(ROOT)}")
        return 0
    before = json.loads(COUNTS.read_text())
    judged = before["compiler"] == compiler()
    worse = compare(counts, before["counts"], options.tolerance, judged)
    if not judged:
        print(f"not judged: the counts are of rustc {before['compiler']}, this is {compiler()}")
    print("bench-instructions: " + (f"FAILED: {', '.join(worse)}" if worse else "OK"))
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
