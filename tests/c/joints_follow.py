#!/usr/bin/env python3
"""Judges what the command-line program wrote of a scene with a skeleton: is every joint where its bone takes it?

    joints_follow.py tests/scenes/character.toml OUT

Nothing of the program is used: the poses of the bones come anew from the scene, by quaternions where the program has
matrices, the vertices from the mesh files. Read are every frame of the point caches, for positions; the vertices' axes in the
files of handles, for orientations; and the bones' own table. Exit status 77: Python is older than 3.11 and reads no TOML.
"""

import csv
import math
import struct
import sys
from pathlib import Path

try:
    import tomllib
except ImportError:
    print("skipped: Python 3.11 or later is needed to read the scene")
    sys.exit(77)

# A cache holds 32-bit numbers: half a unit in the last of 24 bits, 1e-7, of places some three model sizes from the origin; the
# program's 32-bit basis adds about 1e-6 of the displacement, a fraction of a model size.
POSITION = 1e-6                 # of the model's size
# rad, in small angles: a floating reduced shell meets an orientation as nearly as the four passes of a step come, a millionth or two.
AXIS = 5e-6
TABLE = 1e-8                    # of the place: nine digits in the table of bones, half a unit in the last for each number


def multiply(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def turn(q, v):
    return multiply(multiply(q, (0, *v)), (q[0], -q[1], -q[2], -q[3]))[1:]


def quaternion(r):
    angle = math.hypot(*r)
    return (math.cos(angle / 2), *(math.sin(angle / 2) * c / angle for c in r)) if angle else (1, 0, 0, 0)


def swell(x):
    """0 to 1, its first two derivatives 0 at both ends: 6 x^5 - 15 x^4 + 10 x^3."""
    x = max(0, min(1, x))
    return 6 * x ** 5 - 15 * x ** 4 + 10 * x ** 3


def waves(table, time):
    total = [0, 0, 0]
    for w in table:
        value = w["amplitude"] * math.sin(math.tau * w["frequency"] * time + math.radians(w.get("phase_degrees", 0)))
        total = [t + value * a for t, a in zip(total, w["axis"])]
    return total


class Skeleton:
    def __init__(self, scene):
        self.bones = {bone["name"]: bone for bone in scene["bone"]}
        self.duration = scene["simulation"]["duration"]

    def place(self, name, x, time):
        """Where the bone takes a point of the rest pose: its own turn about its joint first, its root's last."""
        bone = self.bones[name]
        share = swell(time / bone.get("rise", 1)) * swell((bone.get("end", self.duration) - time) / bone.get("fall", 1))
        shift = waves(bone.get("translate", []), time)
        turned = turn(self.own_turn(bone, time, share), [a - j for a, j in zip(x, bone["joint"])])
        x = [j + share * s + t for j, s, t in zip(bone["joint"], shift, turned)]
        return self.place(bone["parent"], x, time) if "parent" in bone else x

    def own_turn(self, bone, time, share):
        return quaternion([math.radians(share * r) for r in waves(bone.get("rotate_degrees", []), time)])

    def axes(self, name, time):
        origin = self.place(name, (0, 0, 0), time)
        return [[a - o for a, o in zip(self.place(name, e, time), origin)] for e in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


def read_vertices(path):
    return [tuple(map(float, line.split()[1:4])) for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("v ")]


def read_table(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read_cache(path, wanted):
    """For each sample the places of the wanted vertices."""
    data = path.read_bytes()
    n_points, _, _, n_samples = struct.unpack_from("<iffi", data, 16)
    at = [[32 + 12 * (sample * n_points + v) for v in wanted] for sample in range(n_samples)]
    return [[struct.unpack_from("<3f", data, offset) for offset in row] for row in at]


class Judge:
    def __init__(self):
        self.worst, self.count, self.failures = {}, {}, []

    def compare(self, what, found, expected, unit, tolerance):
        error = math.dist(found, expected) / unit
        kind = what.split(",")[0]
        self.worst[kind] = max(self.worst.get(kind, 0), error)
        self.count[kind] = self.count.get(kind, 0) + 1
        if not error <= tolerance:
            self.failures.append(f"{what}: {list(found)} where {list(expected)} is expected, {error:.2g} off")


def judge_shell(shell, scene_path, out, skeleton, rate, judge):
    name = f"{scene_path.stem}_{shell['name']}"
    rest = read_vertices(scene_path.parent / shell["mesh"])
    size = math.dist([min(c) for c in zip(*rest)], [max(c) for c in zip(*rest)])
    joints = shell["attach"]
    vertices = [min(range(len(rest)), key=lambda v: math.dist(rest[v], joint["nearest"])) for joint in joints]
    for frame, places in enumerate(read_cache(out / f"{name}.pc2", vertices)):
        for joint, vertex, x in zip(joints, vertices, places):
            if frame > 0 and joint["kind"] != "orientation":   # frame 0 is the start, before any step
                goal = skeleton.place(joint["bone"], rest[vertex], frame / rate)
                judge.compare(f"joint places, {name} vertex {vertex} frame {frame}", x, goal, size, POSITION)
    for frame in read_table(out / f"{name}_frames.csv"):
        for joint, row in zip(joints, read_table(out / frame["handles"]) if frame["handles"] else []):
            if joint["kind"] != "position":
                for i, goal in zip("xyz", skeleton.axes(joint["bone"], int(frame["frame"]) / rate)):
                    axis = [float(row[i + j]) for j in "xyz"]
                    judge.compare(f"joint axes, {frame['handles']} vertex {row['vertex']}", axis, goal, 1, AXIS)


def judge_bones(path, skeleton, rate, judge):
    for row in read_table(path):
        goal = skeleton.place(row["bone"], skeleton.bones[row["bone"]]["joint"], int(row["frame"]) / rate)
        judge.compare(f"bones, {row['bone']} frame {row['frame']}", [float(row[c]) for c in "xyz"], goal,
                      math.hypot(*goal), TABLE)


def main(scene_path, out):
    scene = tomllib.loads(scene_path.read_text(encoding="utf-8"))
    skeleton, judge = Skeleton(scene), Judge()
    rate = scene["simulation"]["frame_rate"]
    for shell in scene["shell"]:
        judge_shell(shell, scene_path, out, skeleton, rate, judge)
    judge_bones(out / f"{scene_path.stem}_bones.csv", skeleton, rate, judge)
    for kind, worst in judge.worst.items():
        print(f"{kind}: {judge.count[kind]} compared, worst {worst:.2g}")
    for failure in judge.failures[:10]:
        print(failure, file=sys.stderr)
    return 1 if judge.failures or len(judge.worst) < 3 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
