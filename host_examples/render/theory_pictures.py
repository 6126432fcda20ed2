#!/usr/bin/env python3
"""The pictures of docs/theory, each measured or drawn from the library itself.

    theory_pictures.py --out docs/theory/pictures [NAME ...]

It needs the Python package (make cli leaves its library in build/lib) and what `cmake/bootstrap.sh pictures` sets up. Two minutes on one core.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_examples" / "python"))

import matplotlib   # noqa: E402
matplotlib.use("svg")
import matplotlib.pyplot as plt   # noqa: E402
from PIL import Image, ImageDraw   # noqa: E402

import shellwarp as sw   # noqa: E402
from paint import COLORS, INK, font, viridis   # noqa: E402
from raster import View, draw   # noqa: E402

plt.rcParams.update({"svg.hashsalt": "shellwarp", "font.size": 10, "axes.grid": True, "grid.alpha": 0.3, "figure.facecolor": "white"})
SOFT = sw.Material(area=700, length=2, bend=1.5e-6, density=0.2)   # a leaf of 12 cm that sags by a tenth of its length
FULL, WARP, LINEAR, STRAIN, SAMPLED, POLYNOMIAL = (COLORS[name] for name in ("green", "red", "grey", "orange", "purple", "blue"))


def grid(columns, rows, place):
    """Vertices place(u, v), u and v from 0 to 1, and triangles in alternating diagonals."""
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows), indexing="ij")
    points = np.stack(place(u.ravel(), v.ravel()), axis=-1)
    i, j = np.meshgrid(np.arange(columns - 1), np.arange(rows - 1), indexing="ij")
    a = (i * rows + j).ravel()
    even = ((i + j) % 2 == 0).ravel()
    b, c, d = a + rows, a + rows + 1, a + 1
    first = np.where(even[:, None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even[:, None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return points, np.concatenate([first, second])


def strip(columns=61, rows=7, length=1.0, width=0.1):
    return grid(columns, rows, lambda u, v: (length * u, width * (v - 0.5), 0 * u))


def leaf(columns=41, rows=13, curl=1.0):
    """A leaf on a short stalk, 12 cm long, curved along and across."""
    def place(u, v):
        wide = 0.024 * np.sin(np.pi * np.clip(0.06 + 0.94 * u, 0, 0.985)) ** 0.8
        across = 2 * v - 1
        return 0.12 * u, wide * across, curl * (0.012 * across ** 2 * wide / 0.024 + 0.012 * np.sin(np.pi * u / 2))
    return grid(columns, rows, place)


def held(points, length):
    return np.flatnonzero(points[:, 0] <= length)


def model(points, triangles, material, clamped, **options):
    made = sw.Model(sw.Shell(points, triangles, material, fixed=clamped))
    made.precompute(**options)
    return made


def rest(made, method, gravity):
    """The equilibrium of a method under a gravity, (n x 3), by way of smaller ones."""
    state = made.state(method)
    for share in (0.25, 0.5, 1.0):
        state.set_gravity(share * np.asarray(gravity, float))
        state.equilibrium()
    return state.positions(dtype=np.float64)


def miss(shape, truth, at_rest):
    return np.linalg.norm(shape - truth) / np.linalg.norm(truth - at_rest)


def save(figure, out, name):
    figure.savefig(out / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")
    plt.close(figure)
    text = (out / f"{name}.svg").read_text(encoding="utf-8")
    (out / f"{name}.svg").write_text("\n".join(line.rstrip() for line in text.splitlines()) + "\n", encoding="utf-8")


def beam():
    """A strip of 1 m by 10 cm that hangs by its clamped end, and its middle line."""
    points, triangles = strip()
    made = model(points, triangles, sw.Material(area=1e4, length=1e3, bend=0.02, density=0.3), held(points, 1.01 / 60), modes=8)
    return points, made, np.flatnonzero(abs(points[:, 1]) < 1e-9)


def energies(out):
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 2.9), layout="constrained")
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.axis("off")
    # Two triangles over an edge, drawn in parallel projection.
    a, b, c, d = np.array([0, 0.0]), np.array([1.9, 0.35]), np.array([0.55, 1.25]), np.array([1.45, -1.05])
    for corner, shade in ((c, "#cfe3d2"), (d, "#bcd0ea")):
        left.fill(*np.array([a, b, corner]).T, facecolor=shade, edgecolor="#555555", linewidth=1.2)
    left.plot(*np.array([a, b]).T, color=COLORS["red"], linewidth=3)
    left.text(*(0.42 * a + 0.58 * b + [0, 0.07]), "l", color=COLORS["red"], fontsize=14, style="italic")
    left.text(*((a + b + c) / 3 - [0.1, 0]), "$A_1$", fontsize=13)
    left.text(*((a + b + d) / 3 - [0.1, 0.05]), "$A_2$", fontsize=13)
    left.set_title("a hinge: an edge of length l, two triangles of areas A")
    right.plot([-1.5, 0, 1.25], [0.1, 0, 0.75], color="#555555", linewidth=3, solid_capstyle="round")
    right.plot([0, 1.5], [0, -0.1], color="#999999", linewidth=1.2, linestyle="--")
    turn = np.linspace(-0.066, 0.54, 40)
    right.plot(0.8 * np.cos(turn), 0.8 * np.sin(turn), color=COLORS["red"], linewidth=1.6)
    right.text(0.9, 0.16, "θ", color=COLORS["red"], fontsize=15)
    for foot, way in (((-0.75, 0.05), (0.066, 1.0)), ((0.7, 0.42), (-0.51, 0.86))):
        right.annotate("", xy=np.add(foot, np.multiply(way, 0.6)), xytext=foot, arrowprops={"arrowstyle": "->", "color": COLORS["blue"], "lw": 1.6})
    right.text(-0.95, 0.72, "$n_1$", color=COLORS["blue"], fontsize=13)
    right.text(0.1, 0.98, "$n_2$", color=COLORS["blue"], fontsize=13)
    right.set_xlim(-1.7, 1.7)
    right.set_ylim(-0.4, 1.3)
    right.set_title("along the edge: the angle θ between the normals")
    save(figure, out, "energies")


def modes(out):
    points, triangles = leaf()
    made = model(points, triangles, SOFT, held(points, 0.0031), modes=8)
    hertz = made.frequencies()
    sheet = Image.new("RGB", (4 * 300, 232), "white")
    low, high = np.array([0, -0.026, -0.008]), np.array([0.12, 0.026, 0.03])
    for k in range(4):
        shape = made.mode_shape(k)
        moved = points + 0.03 * shape / np.linalg.norm(shape, axis=1).max()
        far = np.linalg.norm(shape, axis=1)
        faces = far[triangles].mean(axis=1) / far.max()
        color = 255 * viridis(faces)
        view = View(low, high, (296, 200), azimuth=-60, elevation=28, up=2)
        sheet.paste(draw(view, [(moved, triangles, color[:, None, :])], low[2]), (2 + 300 * k, 0))
        ImageDraw.Draw(sheet).text((150 + 300 * k, 206), f"mode {k + 1}, {hertz[k]:.2f} Hz", fill=INK, font=font(17), anchor="ma")
    sheet.save(out / "modes.png", optimize=True)


def warp(out):
    points, made, line = beam()
    figure, axes = plt.subplots(figsize=(7.2, 3.6), layout="constrained")
    for k, strength in enumerate((0.4, 1.2, 4.0)):
        for method, name, color in (("shell-implicit", "full shell", FULL), ("lma", "linear modes", LINEAR), ("warp", "warp", WARP)):
            shape = rest(made, method, [0, 0, -strength])[line]
            axes.plot(shape[:, 0], shape[:, 2], color=color, linewidth=3 if method == "shell-implicit" else 1.6, alpha=0.75 if method == "shell-implicit" else 1,
                      label=name if k == 0 else None)
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("z (m)")
    axes.set_title("A strip at rest under three gravities: linear modes grow, the warp bends")
    axes.legend()
    save(figure, out, "warp")


def step(out):
    points, made, line = beam()
    figure, axes = plt.subplots(figsize=(7.2, 3.0), layout="constrained")
    tip, h = line[-1], 1 / 30
    for integrator, name, color in (("exact", "exact propagator", FULL), ("implicit-euler", "implicit Euler", WARP)):
        state = made.state("lma", integrator)
        state.set_gravity([0, 0, -0.1])
        state.equilibrium()
        state.set_gravity([0, 0, 0])
        heights = [state.positions()[tip, 2]]
        for _ in range(240):
            state.step(h)
            heights.append(state.positions()[tip, 2])
        axes.plot(h * np.arange(241), 100 * np.array(heights), color=color, label=name)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("height of the tip (cm)")
    axes.set_title("A strip let go, steps of 1/30 s, no damping asked for")
    axes.legend(loc="upper right")
    save(figure, out, "step")


def constraints(out):
    points, made, line = beam()
    figure, axes = plt.subplots(figsize=(7.2, 3.4), layout="constrained")
    target = np.array([0.55, 0.0, 0.55])
    for method, name, color in (("shell-implicit", "full shell", FULL), ("lma", "linear modes", LINEAR), ("warp", "warp", WARP)):
        state = made.state(method)
        for share in np.linspace(0.05, 1, 20):
            turn = share * np.pi / 2.6
            state.set_constraint(0, "position", int(line[-1]), position=np.array([np.sin(turn) / turn, 0, (1 - np.cos(turn)) / turn]) if share < 1 else target)
            state.equilibrium()
        shape = state.positions()[line]
        axes.plot(shape[:, 0], shape[:, 2], color=color, linewidth=3 if color == FULL else 1.6, alpha=0.75 if color == FULL else 1, label=name)
    axes.plot(target[0], target[2], "o", color="#2d3036", markersize=9, markerfacecolor="none", label="target of the tip")
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("z (m)")
    axes.set_title("A strip whose tip is led to a target")
    axes.legend(loc="upper left")
    save(figure, out, "constraints")


def rotation_strain(out):
    points, made, line = beam()
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.2), layout="constrained")
    strengths = np.array([0.1, 0.2, 0.4, 0.8, 1.5, 3.0])
    triangles = strip()[1]

    def area(shape):
        edge = shape[triangles]
        return np.linalg.norm(np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0]), axis=1).sum()

    truth = [rest(made, "shell-implicit", [0, 0, -g]) for g in strengths]
    for method, name, color in (("lma", "linear modes", LINEAR), ("warp", "warp", WARP), ("rotation-strain", "rotation–strain", STRAIN)):
        shapes = [rest(made, method, [0, 0, -g]) for g in strengths]
        left.loglog(strengths, [100 * miss(shape, true, points) for shape, true in zip(shapes, truth)], "o-", color=color, label=name)
        right.loglog(strengths, [100 * abs(area(shape) / area(points) - 1) for shape in shapes], "o-", color=color, label=name)
    left.set_ylabel("error of displacement (%)")
    right.set_ylabel("change of area (%)")
    for axes in (left, right):
        axes.set_xlabel("gravity (m/s²)")
    left.legend()
    figure.suptitle("A flat strip at rest: triangles that are turned keep their area")
    save(figure, out, "rotation_strain")


def full_shell(out):
    """Against the heavy elastica of tests/data/reference: the tip's drop over the load."""
    rows = [line.split(",") for line in (ROOT / "tests/data/reference/elastica_self_weight.csv").read_text(encoding="utf-8").splitlines() if line[:1].isdigit()]
    load, drop = np.array([[float(row[0]), float(row[1])] for row in rows if float(row[0]) <= 100]).T
    figure, axes = plt.subplots(figsize=(7.2, 3.2), layout="constrained")
    axes.semilogx(load, drop, color="#2d3036", label="heavy elastica, closed problem")
    sheet = sw.Sheet(young=1e7, poisson=0.0, thickness=1e-3, volume_density=300)
    rigidity, density = 1e7 * 1e-9 / 12, 0.3
    for columns, marker in ((16, "s"), (61, "o")):
        points, triangles = strip(columns, 5)
        clamp = np.flatnonzero(points[:, 0] == 0)
        made = sw.Model(sw.Shell(points, triangles, sheet, clamped=clamp))
        made.precompute(modes=4)
        tip = np.flatnonzero((points[:, 0] > 0.999) & (abs(points[:, 1]) < 1e-9))[0]
        strengths = np.array([0.5, 1, 2, 4, 8, 16, 32, 64])
        drops = [-rest(made, "shell-implicit", [0, 0, -g * rigidity / density])[tip, 2] for g in strengths]
        axes.plot(strengths, drops, marker, color=FULL, markerfacecolor="none" if columns == 16 else FULL, label=f"full shell, {columns - 1} cells along")
    axes.set_xlabel("weight over rigidity, ρ g L³/D")
    axes.set_ylabel("drop of the tip over L")
    axes.set_title("The full shell against the heavy elastica")
    axes.legend()
    save(figure, out, "full_shell")


def reduced_models():
    points, triangles = leaf(31, 9, 0.35)
    material = SOFT
    clamp = held(points, 0.0041)
    ways = np.array([[0, 0, -1], [0, 0.8, -0.6], [0, -0.6, 0.8], [0.6, 0.6, -0.5], [-0.5, 0.7, 0.5]], float)   # none is along an axis but the first
    return points, triangles, material, clamp, ways / np.linalg.norm(ways, axis=1)[:, None]


def reduced_shell(out):
    points, triangles, material, clamp, ways = reduced_models()
    figure, axes = plt.subplots(figsize=(7.2, 3.2), layout="constrained")
    strength, counts, truth, errors = 1.2, (8, 12, 16, 24, 32, 40), None, {"reduced-shell": [], "polynomial-shell": []}
    for count in counts:
        made = model(points, triangles, material, clamp, modes=8, reduced_fields=count)
        if truth is None:
            truth = [rest(made, "shell-implicit", strength * way) for way in ways]
            warped = np.median([miss(rest(made, "warp", strength * way), true, points) for way, true in zip(ways, truth)])
        for method, list_ in errors.items():
            list_.append(np.median([miss(rest(made, method, strength * way), true, points) for way, true in zip(ways, truth)]))
    axes.axhline(100 * warped, color=WARP, linestyle="--", label="warp, 8 modes")
    for (method, list_), color, name in zip(errors.items(), (SAMPLED, POLYNOMIAL), ("sampled", "polynomial")):
        axes.semilogy([8 + count for count in counts], 100 * np.array(list_), "o-", color=color, label=f"reduced shell, {name}")
    axes.set_xlabel("modes and fields")
    axes.set_ylabel("median error (%)")
    axes.set_title("A curved leaf at rest under five gravities of other directions")
    axes.legend()
    save(figure, out, "reduced_shell")


def polynomial_shell(out):
    points, triangles, material, clamp, ways = reduced_models()
    made = model(points, triangles, material, clamp, modes=8, reduced_fields=20)
    figure, axes = plt.subplots(figsize=(7.2, 3.2), layout="constrained")
    strengths, size = (0.1, 0.3, 0.5, 0.6, 0.8, 1.2), np.ptp(points[:, 0])
    truth = {s: [rest(made, "shell-implicit", s * way) for way in ways[1:]] for s in strengths}
    far = [100 * np.mean([np.linalg.norm(true - points, axis=1).max() for true in truth[s]]) / size for s in strengths]
    for method, name, color in (("lma", "linear modes", LINEAR), ("warp", "warp", WARP), ("reduced-shell", "reduced shell, sampled", SAMPLED),
                                ("polynomial-shell", "reduced shell, polynomial", POLYNOMIAL)):
        axes.loglog(far, [100 * np.median([miss(rest(made, method, s * way), true, points) for way, true in zip(ways[1:], truth[s])]) for s in strengths],
                    "o-", color=color, label=name)
    axes.set_xlabel("largest displacement, part of the leaf's length (%)")
    axes.set_ylabel("median error (%)")
    axes.set_title("A curved leaf at rest under gravities that it was not trained on")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    save(figure, out, "polynomial_shell")


def error_estimate(out):
    points, triangles, material, clamp, ways = reduced_models()
    made = model(points, triangles, material, clamp, modes=8, reduced_fields=20)
    figure, axes = plt.subplots(figsize=(4.6, 4.2), layout="constrained")
    for method, name, color in (("warp", "warp", WARP), ("reduced-shell", "sampled", SAMPLED), ("polynomial-shell", "polynomial", POLYNOMIAL)):
        told, true = [], []
        for strength in (0.3, 0.8, 1.6):
            for way in ways:
                state = made.state(method)
                state.set_gravity(strength * way)
                state.equilibrium()
                told.append(100 * state.certify()["error"])
                true.append(100 * miss(state.positions(dtype=np.float64), rest(made, "shell-implicit", strength * way), points))
        axes.loglog(true, told, "o", color=color, markersize=5, alpha=0.8, label=name)
    low, high = axes.get_xlim()
    axes.plot([low, high], [low, high], color="#2d3036", linewidth=0.8)
    axes.set_xlabel("error (%)")
    axes.set_ylabel("estimated error (%)")
    axes.set_title("A leaf at rest under 15 gravities")
    axes.legend()
    save(figure, out, "error_estimate")


def contact(out):
    points, triangles = leaf(curl=0.15)
    made = model(points, triangles, SOFT, held(points, 0.0031), modes=16)
    center, radius = np.array([0.075, 0.0, -0.024]), 0.02
    ball = grid(25, 25, lambda u, v: tuple(center[:, None] + radius * np.stack([np.sin(np.pi * u) * np.cos(2 * np.pi * v), np.sin(np.pi * u) * np.sin(2 * np.pi * v),
                                                                               np.cos(np.pi * u)])))
    sheet = Image.new("RGB", (2 * 460, 322), "white")
    low, high = np.array([0, -0.03, -0.07]), np.array([0.12, 0.03, 0.01])
    for k, (name, colliders) in enumerate((("without the ball", []), ("with it", [sw.Collider.sphere(radius, friction=0.0)]))):
        state = made.state("warp")
        state.set_gravity([0, 0, -3.0])
        state.set_damping(ratio=0.3)
        if colliders:
            state.set_colliders(colliders)
            state.move_collider(0, origin=center, teleport=True)
        for _ in range(240):
            state.step(1 / 60)
        view = View(low, high, (456, 290), azimuth=-62, elevation=12, up=2)
        shapes = [(state.positions(dtype=np.float64), triangles, np.array([104, 168, 84]))]
        if colliders:
            shapes.append((ball[0], ball[1], np.array([200, 190, 178])))
        sheet.paste(draw(view, shapes, low[2]), (2 + 460 * k, 0))
        ImageDraw.Draw(sheet).text((230 + 460 * k, 296), name, fill=INK, font=font(17), anchor="ma")
    sheet.save(out / "contact.png", optimize=True)


def floating(out):
    """A strip that is bent, let go and thrown with a spin, every 0.12 s, and the way of its centre of mass."""
    points, triangles = strip(31, 7, 0.4, 0.08)
    made = sw.Model(sw.Shell(points, triangles, sw.Material(area=700, length=20, bend=3e-5, density=0.2)))
    made.precompute(modes=14, reduced_fields=20)
    state = made.state("polynomial-shell")
    state.set_gravity([0, 0, -9.81])
    middle = points.mean(axis=0)
    bent = points + np.outer(0.5 * (points[:, 0] - middle[0]) ** 2, [0, 0, 1])
    start = bent - middle
    spin, throw = np.array([0.0, 7.0, 2.0]), np.array([2.4, 0.0, 3.4])
    state.set_pose(bent, throw + np.cross(spin, start))
    shapes, centres, shades = [], [], ("#4f81b5", "#6d97c3", "#8cacd0", "#a9c1dc", "#7fa36a", "#5f8f4c", "#3f7a32")
    mass = np.zeros(len(points))
    np.add.at(mass, triangles.ravel(), np.repeat(np.linalg.norm(np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]), axis=1), 3))
    for frame in range(42):
        shape = state.positions(dtype=np.float64)
        centres.append(mass @ shape / mass.sum())
        if frame % 7 == 0:
            color = np.array([int(shades[frame // 7][c:c + 2], 16) for c in (1, 3, 5)])
            shapes.append((shape, triangles, color))
        state.step(1 / 60)
    t = np.arange(42) / 60
    parabola = centres[0] + np.outer(t, throw + np.cross(spin, mass @ start / mass.sum())) + np.outer(t ** 2 / 2, [0, 0, -9.81])
    off = np.linalg.norm(np.array(centres) - parabola, axis=1).max()
    every = np.concatenate([shape for shape, _, _ in shapes])
    view = View(every.min(axis=0), every.max(axis=0), (920, 380), azimuth=-70, elevation=8, up=2)
    sheet = draw(view, shapes, every[:, 2].min() - 0.05)
    pen = ImageDraw.Draw(sheet)
    for x, y, _ in view.project(np.array(centres)):
        scale = sheet.width / view.width
        pen.ellipse([scale * x - 2, scale * y - 2, scale * x + 2, scale * y + 2], fill=INK)
    print(f"theory_pictures: floating: the centre is within {off:.1e} m of the parabola")
    sheet.save(out / "floating.png", optimize=True)


PICTURES = (energies, modes, warp, step, constraints, rotation_strain, full_shell, reduced_shell, polynomial_shell, error_estimate, contact, floating)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(picture.__name__ for picture in PICTURES))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    unknown = set(args.names) - {picture.__name__ for picture in PICTURES}
    if unknown:
        parser.error(f"no picture {', '.join(sorted(unknown))}")
    for picture in PICTURES:
        if not args.names or picture.__name__ in args.names:
            picture(args.out)
            print(f"theory_pictures: {picture.__name__}", flush=True)


if __name__ == "__main__":
    main()
