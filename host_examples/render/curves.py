#!/usr/bin/env python3
"""Curves of a comparison of methods: relative error and change of area over gravity, as the paper's figure 6.

    curves.py --out curves.png --title "V-beam" NAME_comparison.csv

The table is what `shellwarp run` writes for a scene with [comparison]; .png and .svg are known. Where it has several bending
stiffnesses the first is drawn. Methods have the colours of the stills: the full
shell, the first of the table, is green, the next red, then blue.
"""

import argparse
import csv
import sys
from pathlib import Path

try:
    import matplotlib
    matplotlib.use("agg")
    import matplotlib.pyplot as plt
    from meshes import RenderError
    from paint import COLORS
    from palette import colors_of
except ImportError as error:
    sys.exit(f"curves.py: {error}; sh cmake/bootstrap.sh render sets up .venv/, then use .venv/bin/python")

MARKERS = "Dso^vP*X"


def read_table(path):
    """For each method, by its name, the rows of the first bending stiffness that have an equilibrium. The full shell is the first."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        first = rows[0]["bending"]
        methods = {}
        for row in rows:
            if row["bending"] == first and row["error"]:
                numbers = tuple(float(row[key]) for key in ("gravity", "error", "area_change"))
                methods.setdefault(row["method"], []).append(numbers)
    except (OSError, LookupError, ValueError) as error:
        raise RenderError(f"{path}: not a table of a comparison: {error!r}") from None
    return methods


def draw(methods, title):
    figure, (errors, areas) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    colors = colors_of(methods)
    for k, (name, rows) in enumerate(methods.items()):
        style = {"label": name, "color": COLORS[colors[name]], "marker": MARKERS[k % len(MARKERS)], "markersize": 5}
        gravity, error, area = zip(*rows)
        if k > 0:
            errors.plot(gravity, [100 * x for x in error], **style)
        areas.plot(gravity, [100 * x for x in area], **style)
    errors.set_ylabel("error of displacement, relative to the nonlinear shell (%)")
    areas.set_ylabel("change of area (%)")
    errors.set_ylim(bottom=0)
    for axes, heading in ((errors, "(a) L2 error"), (areas, "(b) area")):
        axes.set_title(heading)
        axes.set_xlabel("gravity (length units / s\u00b2)")
        axes.set_xlim(left=0)
        axes.grid(alpha=0.3)
        axes.legend()
    figure.suptitle(title)
    return figure


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", metavar="NAME_comparison.csv")
    parser.add_argument("--out", required=True, help="the PNG or SVG file to write")
    parser.add_argument("--title", default="", help="words above the curves")
    args = parser.parse_args(argv)
    try:
        figure = draw(read_table(args.table), args.title)
        Path(args.out).parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(args.out, dpi=110)
    except (RenderError, OSError, ValueError) as error:
        print(f"curves.py: {error}", file=sys.stderr)
        return 2
    finally:
        plt.close("all")
    print(f"wrote {args.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
