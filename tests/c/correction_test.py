"""A scene's correction_steps bring what is written nearer to the full shell, and leave the motion as it is.

usage: correction_test.py PROGRAM MESH FOLDER
"""

import shutil
import struct
import subprocess
import sys
from pathlib import Path

# Bent by about half its length, where the warp is some percent off.
SCENE = """mesh = "{mesh}"
formats = ["pc2"]
{top}
[material]
k_area = 1e4
k_length = 1e4
k_bend = 1
[[support]]
kind = "fixed"
box = [-0.1, -1, -1, 0.3, 1, 1]
[simulation]
static = true
modes = 6
gravity = [0, 0, -2]
method = "{method}"
correction_steps = {steps}
"""


def run(program, mesh, folder, method, steps, top="", more="", moves=False):
    name = f"{method}_{steps}"
    scene = folder / f"{name}.toml"
    text = SCENE.format(mesh=mesh, method=method, steps=steps, top=top) + more
    text = text.replace("correction_steps = unasked\n", "")
    scene.write_text(text.replace("static = true", "duration = 0.2") if moves else text)
    return subprocess.run([program, "run", scene, "--out", folder], capture_output=True, text=True, check=False), name


def last_positions(path):
    """Of the last sample of a point cache."""
    data = path.read_bytes()
    n, samples = struct.unpack_from("<i", data, 16)[0], struct.unpack_from("<i", data, 28)[0]
    assert data[:11] == b"POINTCACHE2" and len(data) == 32 + 12 * n * samples, path
    return struct.unpack_from(f"<{3 * n}f", data, 32 + 12 * n * (samples - 1))


def main(program, mesh, folder):
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shown, displacements, tables = {}, {}, {}
    for method, steps in [("shell-implicit", 0), ("warp", 0), ("warp", 1), ("warp", 3)]:
        done, name = run(program, mesh, folder, method, steps)
        assert done.returncode == 0, done.stderr
        shown[method, steps] = last_positions(folder / f"{name}.pc2")
        tables[method, steps] = [line.split(",")[1:6] for line in (folder / f"{name}_frames.csv").read_text().splitlines()]
        displacements[method, steps] = [float(u) for u in (folder / f"{name}_frame_0001_displacement.txt").read_text().split()]
    exact, lengths = shown["shell-implicit", 0], displacements["shell-implicit", 0]
    off = [max(abs(x - y) for x, y in zip(shown["warp", steps], exact)) for steps in (0, 1, 3)]
    bent = [max(abs(x - y) for x, y in zip(displacements["warp", steps], lengths)) for steps in (0, 1, 3)]
    print("from the full shell after 0, 1 and 3 steps:", off, "of displacements:", bent)
    assert off[1] < off[0] and off[2] < 0.1 * off[0] and bent[2] < 0.1 * bent[0]
    assert tables["warp", 0] == tables["warp", 3]  # of the motion, which does not know
    done, _ = run(program, mesh, folder, "warp", 3, top=f'render = "{mesh}"')
    assert done.returncode == 0, done.stderr
    follows = last_positions(folder / "warp_3_render.pc2")
    # The mesh's own vertices follow themselves, to 32 bits of the displacement.
    assert max(abs(x - y) for x, y in zip(follows, shown["warp", 3])) < 1e-5 * max(lengths) and off[0] > 1e-3 * max(lengths)
    for steps in (101, 4294967295):
        done, _ = run(program, mesh, folder, "warp", steps)
        assert done.returncode == 1 and "correction_steps must be at most 100" in done.stderr, done.stderr
    as_needed(program, mesh, folder)


def as_needed(program, mesh, folder):
    """One field does not hold a strip, forty do: unasked, steps correct the one at rest, and not the other or motion."""
    poor, good = "reduced_fields = 1\n", "reduced_fields = 40\n"

    def shown(steps, more, method="auto", moves=False):
        done, name = run(program, mesh, folder, method, steps, more=more, moves=moves)
        assert done.returncode == 0, done.stderr
        return last_positions(folder / f"{name}.pc2"), done.stdout

    exact, _ = shown(0, "", "shell-implicit")
    (own, said), (corrected, told) = shown(0, poor), shown("unasked", poor)
    off = [max(abs(x - y) for x, y in zip(positions, exact)) for positions in (own, corrected)]
    print("from the full shell without steps, and as needed:", off)
    # Both are equilibria to 1e-6 of the force; files have 32 bits.
    assert off[1] < 1e-4 * off[0], off
    assert "before" not in said and "after Newton steps of it" in told, told
    assert shown(0, good)[0] == shown("unasked", good)[0]
    assert shown(0, poor, moves=True)[0] == shown("unasked", poor, moves=True)[0]


if __name__ == "__main__":
    main(*sys.argv[1:])
