"""A quad mesh follows a strip that is simulated as triangles: its cache, its OBJ files, and where its points go.

The environment has PROGRAM, MESHES and OUT.
"""

import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

PROGRAM, MESHES, OUT = os.environ["PROGRAM"], Path(os.environ["MESHES"]), Path(os.environ["OUT"])
FRAMES = 12


def strip_vertices():
    lines = (MESHES / "strip.off").read_text().split()
    return [tuple(map(float, lines[4 + 3 * i:7 + 3 * i])) for i in range(int(lines[1]))]


def asset():
    """Every vertex of the strip and a copy 0.01 above it, as quads with texture coordinates, normals and a material."""
    points = strip_vertices()
    lines = ["mtllib leaf.mtl"]
    lines += [f"v {x} {y} {z}" for x, y, z in points] + [f"v {x} {y} {z + 0.01}" for x, y, z in points]
    lines += ["vt 0 0", "vt 1 1", "vn 0 0 1", "g upper", "usemtl green", "f 1/1/1 2/2/1 5/1/1 4/2/1", "f 28//1 29//1 32//1 31//1  # above"]
    return "\n".join(lines) + "\n"


def cache(path):
    data = path.read_bytes()
    assert data[:12] == b"POINTCACHE2\0", data[:12]
    points, samples = struct.unpack("<i", data[16:20])[0], struct.unpack("<i", data[28:32])[0]
    numbers = struct.unpack(f"<{3 * points * samples}f", data[32:])
    return [[numbers[3 * (s * points + i):3 * (s * points + i) + 3] for i in range(points)] for s in range(samples)]


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    (OUT / "asset.obj").write_text(asset())
    (OUT / "scene.toml").write_text(f'''mesh = "{(MESHES / "strip.off").as_posix()}"
render = "asset.obj"
obj_frames = 1
[material]
frequency = 2
[[support]]
side = "low-x"
[simulation]
gravity = [0, 0, -9.8]
duration = 0.4
''')
    out = OUT / "out"
    ran = subprocess.run([PROGRAM, "run", str(OUT / "scene.toml"), "--out", str(out), "--no-certify"], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert "54 vertices follow the shell" in ran.stdout, ran.stdout
    simulated, followed = cache(out / "scene.pc2"), cache(out / "scene_render.pc2")
    assert len(followed) == len(simulated) == FRAMES + 1, (len(followed), len(simulated))
    n = len(simulated[0])
    moved = max(abs(c - d) for a, b in zip(simulated[-1], simulated[0]) for c, d in zip(a, b))
    assert moved > 0.02, moved
    for there, here in zip(followed, simulated):
        for k in range(n):  # points on vertices are the vertices, in 32 bits
            assert max(abs(a - b) for a, b in zip(there[k], here[k])) < 1e-5, k
            apart = sum((a - b) ** 2 for a, b in zip(there[k], there[n + k])) ** 0.5
            assert abs(apart / 0.01 - 1) < 0.02, apart
    frames = sorted(out.glob("scene_render_frame_*.obj"))
    assert len(frames) == 1 and (out / "scene_render_rest.obj").exists(), frames
    words = frames[0].read_text().split("\n")
    assert "f 1/1 2/2 5/1 4/2" in words and "f 28 29 32 31" in words and "usemtl green" in words and "vt 1 1" in words, words
    assert not any(line.startswith("vn") for line in words)
    at = int(frames[0].stem[-4:])
    written = [tuple(map(float, line.split()[1:])) for line in words if line.startswith("v ")]
    assert max(abs(a - b) for x, y in zip(written, followed[at]) for a, b in zip(x, y)) < 1e-6
    print("ok")


if __name__ == "__main__":
    sys.exit(main())
