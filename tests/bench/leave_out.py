"""What scenes pay for what they do not use: docs/leave_out.md. `make bench-leave-out` runs it.

usage: leave_out.py [--docs FILE]

Counts the instructions of a step by valgrind's callgrind, which shows programs a processor with AVX2, beside what sw_state_plan
estimates; a scene that had loads, wind, a turning frame and a handle and lost them, beside one that never had; and scenes on
builds of the library that lack a Cargo feature, beside the whole library: instructions, memory and the library's size. Fails when an
estimate is off by more than a quarter, or a scene pays more than 2 % for what it does not use.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
FEATURES = ["reduced-shell", "nonlinear-shell", "wind", "saved-models", "f64-basis", "i16-basis"]
# The reduced shell is found by the nonlinear one.
WITHOUT = [["reduced-shell"], ["reduced-shell", "nonlinear-shell"], ["wind"], ["saved-models"], ["f64-basis"], ["i16-basis"], FEATURES]
ESTIMATE, EXCESS = 0.25, 0.02
PLAIN = ["warp", "virtual work", "linear", "warp, 3 forces", "warp, turning frame", "warp, 1 handle"]


def build(features):
    """The library and the program with these features; the program and the size of the stripped library."""
    command = ["cargo", "build", "--release", "--no-default-features", "--features", ",".join(features)]
    subprocess.run(command + ["--lib", "--example", "leave_out"], cwd=ROOT, check=True, stderr=subprocess.DEVNULL)
    library = TARGET / "release" / "libshellwarp.so"
    stripped = TARGET / "stripped.so"
    subprocess.run(["strip", "-o", stripped, library], check=True)
    return TARGET / "release" / "examples" / "leave_out", stripped.stat().st_size


def count(program, case):
    """Instructions of a step, and the most bytes that the program holds at once."""
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=*measured*", "--callgrind-out-file=/dev/null"]
    done = subprocess.run(command + [program, case], cwd=ROOT, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        sys.exit(f"bench-leave-out: FAILED: {case} was not counted\n{done.stderr}")
    held = re.search(r"bytes held: (\d+)", done.stdout)
    return int(found[1]), int(held[1])


def plan(program, case):
    """Operations and bytes by sw_state_plan."""
    words = subprocess.run([program, "--plan", case], capture_output=True, text=True, check=True).stdout.split()
    return float(words[0]), int(words[1])


def row(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def measure():
    """The text of the document, and what is worse than it may be."""
    worse, whole = [], build(FEATURES)
    cases = subprocess.run([whole[0], "--cases"], capture_output=True, text=True, check=True).stdout.splitlines()
    counts = {case: count(whole[0], case) for case in cases}
    lines = ["## The plan's estimate", "", row("a step of", "instructions", "sw_state_plan", "ratio"), "| --- " * 4 + "|"]
    for case in cases:
        instructions, estimate = counts[case][0], plan(whole[0], case)[0]
        ratio = estimate / instructions
        if case != "warp, at rest" and abs(ratio - 1) > ESTIMATE:
            worse.append(f"the estimate of {case} is {ratio:.2f} of the count")
        lines.append(row(case, instructions, f"{estimate:.0f}", f"{ratio:.2f}" if estimate else "–"))

    gone, never = counts["warp, all of it once and gone"][0], counts["warp"][0]
    lines += ["", "## What was used and is gone", "",
              f"A step of a scene that had 30 forces, wind, a turning frame and a handle and lost them: {gone} instructions; of",
              f"one that never had any: {never} ({gone / never - 1:+.2%})."]
    if gone > never * (1 + EXCESS):
        worse.append("a scene pays for what it no longer uses")

    lines += ["", "## Builds that lack a feature", "",
              "The whole library beside one that was built without the feature, on scenes that do not use it: instructions of a step,",
              "most memory held by the program, in percent more; and the size of the stripped library.", "",
              row("without", "library", "instructions: " + "; ".join(PLAIN), "memory"), "| --- " * 4 + "|",
              row("nothing", f"{whole[1] / 1e6:.2f} MB", "", "")]
    for lacking in WITHOUT:
        program, size = build([feature for feature in FEATURES if feature not in lacking])
        name = "all of them" if lacking == FEATURES else ", ".join(lacking)
        excess = []
        for case in PLAIN:
            instructions, held = count(program, case)
            excess.append((counts[case][0] / instructions - 1, counts[case][1] / held - 1))
            if max(excess[-1]) > EXCESS:
                worse.append(f"{case} pays {excess[-1][0]:.1%} and {excess[-1][1]:.1%} for {name}")
        memory = max(held for _, held in excess)
        lines.append(row(name, f"{size / 1e6:.2f} MB", "; ".join(f"{more:+.2%}" for more, _ in excess), f"{memory:+.2%}"))
    build(FEATURES)
    return "\n".join(lines) + "\n", worse


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", type=Path, help="the document whose tables are replaced")
    options = parser.parse_args()
    text, worse = measure()
    print(text)
    if options.docs:
        head = options.docs.read_text().split("<!-- tables -->")[0]
        options.docs.write_text(head + "<!-- tables -->\n\n" + text)
    print("bench-leave-out: " + (f"FAILED: {'; '.join(worse)}" if worse else "OK"))
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
