#!/usr/bin/env python3
"""docs/pictures/fronts.svg: error against the time of a frame on several shells, from docs/evidence/fronts.csv."""

import csv
from math import log10
from pathlib import Path

from leaf_front import COLOURS, NAMES

ROOT = Path(__file__).resolve().parents[2]
TABLE, PICTURE = ROOT / "docs/evidence/fronts.csv", ROOT / "docs/pictures/fronts.svg"
# Labels of points by method; those of frames with steps are "corrected".
LABELS = NAMES | {"corrected": "1, 2, 3 steps a frame", "shell-implicit": "full shell: no error"}
COLUMNS, WIDE, TALL = 2, 380, 250
LEFT, RIGHT, TOP, BOTTOM = 64, 14, 26, 24
TIMES, ERRORS = (0.8, 2e6), (2e-7, 1.5)   # microseconds, and shares of the displacement; what is less is drawn at the least


def across(t):
    return LEFT + (WIDE - LEFT - RIGHT) * log10(t / TIMES[0]) / log10(TIMES[1] / TIMES[0])


def down(error):
    return TOP + (TALL - TOP - BOTTOM) * log10(ERRORS[1] / max(error, ERRORS[0])) / log10(ERRORS[1] / ERRORS[0])


def text(x, y, words, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" {more}>{words}</text>'


def grid():
    parts = []
    for power in range(0, 7):
        t = 10.0 ** power
        words = f"{t:g} µs" if t < 1e3 else f"{t / 1e3:g} ms" if t < 1e6 else "1 s"
        parts += [f'<path d="M{across(t):.1f} {TOP}V{TALL - BOTTOM}" stroke="#e3e6ec"/>', text(across(t), TALL - BOTTOM + 15, words, 'text-anchor="middle"')]
    for power in range(-6, 1):
        e = 10.0 ** power
        parts += [f'<path d="M{LEFT} {down(e):.1f}H{WIDE - RIGHT}" stroke="#e3e6ec"/>', text(LEFT - 5, down(e) + 4, f"{100 * e:g} %", 'text-anchor="end"')]
    return parts


def panel(shell, rows):
    parts = [text(LEFT, 16, shell.replace("_", " "), 'font-weight="600" fill="#23272f"'), *grid()]
    for kind in LABELS:
        colour = COLOURS[kind]
        of = [row for row in rows if kind == ("corrected" if row["steps"] != "0" else row["method"])]
        points = sorted((float(row["frame_us"]), float(row["error"])) for row in of)
        places = [(across(t), down(e)) for t, e in points]
        way = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{way}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.2" fill="{colour}"/>' for x, y in places]
    return parts


def main():
    with open(TABLE, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    shells = list(dict.fromkeys(row["shell"] for row in rows))
    lines = -(-len(shells) // COLUMNS)
    wide, tall = COLUMNS * WIDE, lines * TALL + 70
    parts = []
    for at, shell in enumerate(shells):
        parts.append(f'<g transform="translate({at % COLUMNS * WIDE} {at // COLUMNS * TALL})">')
        parts += panel(shell, [row for row in rows if row["shell"] == shell])
        parts.append("</g>")
    for at, (kind, label) in enumerate(LABELS.items()):
        x, y = 20 + at % 4 * (wide / 4), lines * TALL + 20 + at // 4 * 20
        parts += [f'<circle cx="{x:.1f}" cy="{y - 4:.1f}" r="4" fill="{COLOURS[kind]}"/>', text(x + 10, y, label)]
    parts.append(text(20, lines * TALL + 62, "Median error against the full shell, and the time of a frame: a step and all positions."))
    PICTURE.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {tall}" width="{wide}" height="{tall}" '
                       'font-family="system-ui, DejaVu Sans, sans-serif" font-size="11" fill="#5c6370">'
                       f'<rect width="{wide}" height="{tall}" fill="#fff"/>' + "\n".join(parts) + "</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    main()
