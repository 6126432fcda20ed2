"""The error that a run tells of its time step is within a factor of 3 of what steps of an eighth show, and no more where the motion is not resolved.

    python step_error_test.py PROGRAM FOLDER [all]

`all` makes the table of docs/guide/command_line.md. Both errors are root mean squares over the vertices, at the worst frame, in percent of the largest
displacement.
"""

import re
import subprocess
import sys
from array import array
from pathlib import Path

from kite import kite

PROGRAM, OUT = sys.argv[1], Path(sys.argv[2])
EIGHTH = 8  # of second order its own error is a 64th, of first an eighth, of what is judged

LEAF = ["LEAF", "--pin", "low-x", "--up", "z"]
KITE = ["KITE", "--scale", "0.01", "--up", "y", *(w for p in ("0,0.6,0", "-0.2,0.36,0", "0.2,0.36,0") for w in ("--pin", f"nearest:{p}")), "--material", "cotton",
        "--wind", "0", "0", "4", "--gust", "0.5"]
FULL = ["--method", "shell-implicit"]
SECOND = FULL + ["--second-order"]
# name: arguments, steps a second, seconds, whether it is tested
CASES = {
    "leaf of 5 Hz, damped, auto": (LEAF + ["--frequency", "5", "--damping-ratio", "0.05"], 30, 1, True),
    "leaf of 3 Hz, undamped, auto": (LEAF + ["--frequency", "3"], 30, 3, False),
    "leaf of 3 Hz, warp, implicit Euler": (LEAF + ["--frequency", "3", "--method", "warp"], 30, 3, False),
    "leaf of 3 Hz, full shell, implicit Euler": (LEAF + ["--frequency", "3"] + FULL, 30, 2, False),
    "leaf of 3 Hz, full shell, second order": (LEAF + ["--frequency", "3"] + SECOND, 30, 2, False),
    "leaf of 3 Hz, damped, full shell, second order": (LEAF + ["--frequency", "3", "--damping-ratio", "0.1"] + SECOND, 30, 0.6, True),
    "oak leaf in gusts, full shell, second order": (LEAF + ["--material", "oak-leaf", "--wind", "0", "3", "0", "--gust", "0.5"] + SECOND, 30, 2, False),
    "cotton kite in gusts, full shell, second order": (KITE + SECOND, 30, 1.5, False),
    "the same by 0.01 s": (KITE + SECOND, 100, 0.8, False),
    "leaf that falls on a ball within three frames, full shell": (LEAF + ["--frequency", "4", "--collider", "sphere:0.02@0.08,0,-0.045"] + FULL, 30, 1.5, False),
}


def frames(path):
    """Of a PC2 file, each a list of coordinates."""
    data = path.read_bytes()
    n, count = int.from_bytes(data[16:20], "little"), int.from_bytes(data[28:32], "little")
    all_of = array("f", data[32 : 32 + 12 * n * count])
    return [all_of[3 * n * k : 3 * n * (k + 1)] for k in range(count)]


def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


def run(arguments, rate, seconds, folder, *more):
    ran = subprocess.run([PROGRAM, "simulate", *arguments, "--step", repr(1 / rate), "--duration", str(seconds), "--out", str(folder), *more], capture_output=True, text=True)
    if ran.returncode:
        sys.exit(ran.stdout[-500:] + ran.stderr[-500:])
    return ran.stdout, frames(folder / (Path(arguments[0]).stem + ".pc2"))


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "kite.obj").write_text(kite())
    if not (OUT / "leaf.obj").exists():
        subprocess.run([PROGRAM, "new-scene", str(OUT / "leaf.toml")], check=True)
    everything = sys.argv[3:] == ["all"]
    wrong = []
    print("| shell | told, % | by steps of an eighth, % | told / found |\n|---|---|---|---|")
    for name, (arguments, rate, seconds, tested) in CASES.items():
        if not (tested or everything):
            continue
        arguments = [str(OUT / "leaf.obj"), *arguments[1:]] if arguments[0] == "LEAF" else [str(OUT / "kite.obj"), *arguments[1:]]
        said, coarse = run(arguments, rate, seconds, OUT / "coarse")
        told = re.search(r"its error [^\n]*?([\d.]+) % time step", said)
        if not told:
            sys.exit(f"{name}: nothing is told of the time step:\n{said[-600:]}")
        # By the same method: the choice is the same as before, and its error is not asked for again.
        fine = run(arguments, EIGHTH * rate, seconds, OUT / "fine", "--no-certify")[1][::EIGHTH]
        off = max(distance(a, b) for a, b in zip(coarse, fine))
        found = 100 * off / max(distance(b, fine[0]) for b in fine)
        ratio = float(told[1]) / found
        print(f"| {name} | {told[1]} | {found:.2g} | {ratio:.2f} |", flush=True)
        if tested and not 1 / 3 < ratio < 3:
            wrong.append(name)
    if wrong:
        sys.exit("not within a factor of 3: " + ", ".join(wrong))


main()
