"""The picture of a sweep: error against the time of a step, and error against how far the shell is turned."""

import itertools

from . import files

COLOURS = ("#b05a3c", "#2b6ca3", "#2f8f5b", "#7b52ab", "#3b9fae", "#c8a415", "#7a7a7a", "#d23b30")   # of the methods in turn
MARKS = "osD^vP*X"


def draw(rows, path):
    """Draws the rows that have an error into a PNG file."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    rows = [row for row in rows if row["error"] is not None]
    assets = sorted({row["asset"] for row in rows})
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(12, 5.2), layout="constrained")
    colours = dict(zip(dict.fromkeys(row["method"] for row in rows), itertools.cycle(COLOURS)))
    for method in colours:
        for asset, mark in zip(assets, MARKS * len(assets)):
            chosen = [row for row in rows if (row["method"], row["asset"]) == (method, asset)]
            style = {"color": colours[method], "marker": mark, "linestyle": "none", "alpha": 0.65, "markersize": 5}
            left.plot([1e3 * row["step_seconds"] for row in chosen], [row["error"] for row in chosen], **style)
            right.plot([row["max_rotation"] for row in chosen], [row["error"] for row in chosen], **style)
    left.set(xscale="log", yscale="log", xlabel="a step with its positions, ms, one core", ylabel="error to the nonlinear shell")
    right.set(xscale="log", yscale="log", xlabel="largest modal rotation, rad", ylabel="error to the nonlinear shell")
    for axes in (left, right):
        axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    _legend(left, right, colours, assets)
    loads, modes = (", ".join(f"{value:g}" for value in sorted({row[key] for row in rows})) for key in ("load", "modes"))
    figure.suptitle(f"{len(rows)} equilibria: {len(assets)} shells; loads {loads}; {modes} modes", fontsize=11)
    with files.whole_file(path) as partial:
        figure.savefig(partial, dpi=110)
    pyplot.close(figure)


def _legend(left, right, colours, assets):
    for method, colour in colours.items():
        left.plot([], [], color=colour, marker="s", linestyle="none", label=method)
    for asset, mark in zip(assets, MARKS * len(assets)):
        right.plot([], [], color="#555555", marker=mark, linestyle="none", label=asset)
    for axes in (left, right):
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=6, frameon=False, fontsize=9)
