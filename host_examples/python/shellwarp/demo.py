"""A strip of card that is let go, as a page that plays it or a mesh of its last frame."""

import json
import time
from pathlib import Path

import numpy

from .mesh import Material, Shell
from .model import Model

ROWS, COLUMNS, FRAMES, RATE = 31, 4, 120, 60   # 30 x 3 cm, two seconds
METHOD = "rotation-strain"

PAGE = """<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>shellwarp</title>
<style>body{font:15px system-ui;margin:1em;background:#fafaf7;color:#222}canvas{width:100%;max-width:720px}</style>
<canvas width="1440" height="960"></canvas><p>SAID</p><script>
const data = DATA, canvas = document.querySelector('canvas'), pen = canvas.getContext('2d');
const at = ([x, y, z]) => [220 + 3000 * (x + 0.5 * y), 220 - 3000 * (z + 0.3 * y)];
const draw = (now) => {
  const points = data.frames[Math.floor(now / 1000 * data.rate) % data.frames.length];
  pen.clearRect(0, 0, canvas.width, canvas.height);
  for (const corners of data.squares) {
    pen.beginPath();
    for (const corner of corners) pen.lineTo(...at(points[corner]));
    pen.closePath();
    pen.fillStyle = '#d98040'; pen.fill(); pen.strokeStyle = '#6b3a16'; pen.stroke();
  }
  requestAnimationFrame(draw);
};
requestAnimationFrame(draw);
</script>
"""


def strip() -> Shell:
    """30 x 3 cm of card, 0.4 mm, 300 g/m², held at its first two rows."""
    i, j = numpy.meshgrid(numpy.arange(ROWS), numpy.arange(COLUMNS), indexing="ij")
    points = 0.01 * numpy.stack([i, j, 0 * i], axis=-1).reshape(-1, 3)
    a = squares()[:, 0]
    triangles = numpy.stack([a, a + COLUMNS, a + COLUMNS + 1, a, a + COLUMNS + 1, a + 1], axis=-1).reshape(-1, 3)
    return Shell(points, triangles, Material(area=5e3, length=5e3, bend=2.7e-3, density=0.3), fixed=numpy.arange(2 * COLUMNS))


def squares() -> numpy.ndarray:
    """The corners of each square of the strip, around it."""
    a = (COLUMNS * numpy.arange(ROWS - 1)[:, None] + numpy.arange(COLUMNS - 1)).ravel()
    return numpy.stack([a, a + COLUMNS, a + COLUMNS + 1, a + 1], axis=-1)


def run(out: "str | Path") -> str:
    """Lets the strip go for two seconds, writes `out` and says what happened."""
    shell, frames, spent = strip(), [], 0.0
    with Model(shell) as model:
        model.precompute(modes=12)
        with model.state(METHOD) as state:
            state.set_gravity([0, 0, -9.8])
            state.set_damping(ratio=0.05)
            for _ in range(FRAMES):
                began = time.perf_counter()
                state.step(1 / RATE)
                points = state.positions()
                spent += time.perf_counter() - began
                frames.append(points)
            off = state.certify()["error"]
    said = (f"the tip of a 30 cm strip of card hangs {-100 * frames[-1][-1, 2]:.1f} cm low after {FRAMES / RATE:.0f} s; "
            f"{1e6 * spent / FRAMES:.0f} µs a frame; off the full shell by {100 * off:.1g} % (an estimate)")
    _write(Path(out), frames, numpy.asarray(shell.triangles), said)
    return f"{said}; wrote {out}"


def _write(out, frames, triangles, said):
    if out.suffix == ".obj":
        lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in frames[-1]] + [f"f {a} {b} {c}" for a, b, c in triangles + 1]
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return
    data = {"rate": RATE, "squares": squares().tolist(), "frames": [[[round(float(v), 5) for v in point] for point in frame] for frame in frames]}
    out.write_text(PAGE.replace("SAID", said).replace("DATA", json.dumps(data, separators=(",", ":"))), encoding="utf-8")
