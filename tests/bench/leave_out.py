"""What scenes pay for what they do not use: docs/evidence/leave_out.md. `make bench-leave-out` runs it.

usage: leave_out.py [--docs FILE] [--only TABLE ...]

Counts the instructions of a step by valgrind's callgrind, which shows programs a processor with AVX2, beside what sw_state_plan
estimates; a scene that had loads, wind, a turning frame and a handle and lost them, beside one that never had; and scenes on
builds of the library that lack a Cargo feature, beside the whole library: instructions, memory and the library's size. Fails when an
estimate is off by more than a quarter, or a scene pays more than 2 % for what it does not use. Beside these, what a tolerance saves on
twelve scenes (tests/bench/demand.rs), in modes and in time.
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


def name(without):
    return "all of them" if without == FEATURES else ", ".join(without)


def cargo(*arguments):
    subprocess.run(["cargo", *arguments], cwd=ROOT, check=True, stderr=subprocess.DEVNULL)


def build(features):
    """The program with these features."""
    cargo("build", "--locked", "--release", "--no-default-features", "--features", ",".join(features), "--example", "leave_out")
    return TARGET / "release" / "examples" / "leave_out"


def library_size(features):
    """Bytes of the library with these features, stripped."""
    cargo("rustc", "--locked", "--release", "--lib", "--crate-type", "cdylib", "--no-default-features", "--features", ",".join(features))
    stripped = TARGET / "stripped.so"
    subprocess.run(["strip", "-o", stripped, TARGET / "release" / "libshellwarp.so"], check=True)
    return stripped.stat().st_size


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


def estimates(worse):
    """The plan beside the counts, and what was used and is gone."""
    program = build(FEATURES)
    cases = subprocess.run([program, "--cases"], capture_output=True, text=True, check=True).stdout.splitlines()
    counts = {case: count(program, case)[0] for case in cases}
    lines = [row("a step of", "instructions", "sw_state_plan", "ratio"), "| --- " * 4 + "|"]
    for case in cases:
        estimate = plan(program, case)[0]
        ratio = estimate / counts[case]
        if case != "warp, at rest" and abs(ratio - 1) > ESTIMATE:
            worse.append(f"the estimate of {case} is {ratio:.2f} of the count")
        lines.append(row(case, counts[case], f"{estimate:.0f}", f"{ratio:.2f}" if estimate else "–"))
    gone, never = counts["warp, all of it once and gone"], counts["warp"]
    if gone > never * (1 + EXCESS):
        worse.append("a scene pays for what it no longer uses")
    return lines + ["", "A step of a scene that had 30 forces, wind, a turning frame and a handle and lost them takes",
                    f"{gone} instructions; of one that never had any, {never} ({gone / never - 1:+.2%})."]


def lacking(worse):
    """Scenes on the whole library beside builds without what they do not use."""
    program = build(FEATURES)
    whole = {case: count(program, case) for case in PLAIN}
    lines = ["The whole library beside one that was built without the feature, on scenes that do not use it: instructions of a step, and",
             "most memory held by the program, in percent more.", "",
             row("without", "instructions: " + "; ".join(PLAIN), "memory"), "| --- " * 3 + "|"]
    for without in WITHOUT:
        program = build([feature for feature in FEATURES if feature not in without])
        excess = []
        for case in PLAIN:
            instructions, held = count(program, case)
            excess.append((whole[case][0] / instructions - 1, whole[case][1] / held - 1))
            if max(excess[-1]) > EXCESS:
                worse.append(f"{case} pays {excess[-1][0]:.1%} and {excess[-1][1]:.1%} for {name(without)}")
        memory = max(held for _, held in excess)
        lines.append(row(name(without), "; ".join(f"{more:+.2%}" for more, _ in excess), f"{memory:+.2%}"))
    build(FEATURES)
    return lines


def sizes(_):
    """The stripped library without features."""
    lines = [row("without", "library", "less"), "| --- " * 3 + "|"]
    whole = library_size(FEATURES)
    lines.append(row("nothing", f"{whole / 1e6:.2f} MB", ""))
    for without in WITHOUT:
        size = library_size([feature for feature in FEATURES if feature not in without])
        lines.append(row(name(without), f"{size / 1e6:.2f} MB", f"{(whole - size) / 1e3:.0f} kB"))
    return lines


def tolerances(_):
    """The table of tests/bench/demand.rs."""
    command = ["cargo", "run", "--locked", "--release", "--quiet", "--example", "demand"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


TABLES = {
    "estimates": ("The plan's estimate", estimates),
    "lacking": ("Builds that lack a feature", lacking),
    "sizes": ("Size of the library", sizes),
    "tolerances": ("What a tolerance saves", tolerances),
}


def put(text, title, lines):
    """The document with the table under `title`."""
    body = f"## {title}\n\n" + "\n".join(lines) + "\n\n"
    found = re.search(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", text, re.M | re.S)
    return text[: found.start()] + body + text[found.end() :] if found else text.rstrip() + "\n\n" + body


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", type=Path, help="the document whose tables are replaced")
    parser.add_argument("--only", nargs="+", choices=TABLES, default=TABLES, help="tables; all by default")
    options = parser.parse_args()
    worse = []
    for title, table in [TABLES[name] for name in options.only]:
        lines = table(worse)
        print("\n".join([f"## {title}", "", *lines, ""]), flush=True)
        if options.docs:
            options.docs.write_text(put(options.docs.read_text(), title, lines).rstrip() + "\n")
    print("bench-leave-out: " + (f"FAILED: {'; '.join(worse)}" if worse else "OK"))
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
