#!/usr/bin/env python3
"""Runs the demonstration scenes by the command-line program and draws what comes out; `make demo` calls it.

    demo.py --cli build/bin/shellwarp --python .venv/bin/python --out out/demo

Each scene's rest shape and the frames that the program wrote (those of largest displacement) become stills in --out,
coloured by displacement on one scale and from one camera, and a sheet of them. Of the scenes with handles each has
one still, its handles as yellow spheres and red, green, blue axes, and they share handles_sheet.png. The shapes of the
beams by the full shell (green), linear modal analysis (red) and the warp (blue), with bending stiffness x 1, 10, 100,
share beams_sheet.png; errors and areas over gravity become NAME_curves.png. The character has a still of
all its shells, on the body that wears them, at each of the times that its scene lists. The character and the dinosaur run by the
automatic choice and again by the paper's warp, and the certificates of their last frames are printed side by side. Without the renderer's packages the
scenes still run. Any Python 3 will do: only the stills need the Python given by --python.
"""

import argparse
import csv
import re
import subprocess
import sys
import time
from pathlib import Path

from palette import colors_of

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent.parent / "tests" / "scenes"
VIEWS = {
    "dinosaur": ["--view", "35", "18"],
    "flat_beam": ["--up", "z", "--gap", "0.15", "--view", "32", "20"],
    "v_beam": ["--up", "z", "--gap", "0.15", "--view", "48", "22"],
    "handles_position": ["--up", "z", "--gap", "0.15", "--view", "-12", "24"],
    "handles_orientation": ["--up", "z", "--gap", "0.15", "--view", "32", "20"],
    "handles_both": ["--up", "z", "--gap", "0.15", "--view", "32", "20"],
}
HELD = {"handles_position": "position", "handles_orientation": "orientation", "handles_both": "orientation and height"}
SHAPES = {"flat_beam_stiffness": "flat beam", "v_beam_stiffness": "V-beam"}
SIDE_BY_SIDE = ["--up", "z", "--gap", "0.1", "--view", "22", "14", "--apart", "0", "1.1", "0"]   # a beam is 0.8 wide
CURVES = {"v_beam_comparison": "V-beam with a soft membrane: rotation governs",
          "flat_beam_comparison": "flat beam",
          "v_beam_flattens": "V-beam pulled straight down: the section flattens",
          "v_beam_oblique": "V-beam pulled aslant"}
UNITS = {"dinosaur": "cm"}   # the beams' is nameless: they are 4 long
BALL = 0.08                  # radius of a handle that holds a position, in the mesh's unit
CHARACTER = "character"      # several shells on a skeleton, drawn together
SHELLS = {"hat": "#6a3fb0", "torso": "#c8372d", "leg_left": "#2d62ad", "leg_right": "#2d62ad"}
CHARACTER_VIEW = ["--view", 24, 15, "--size", 480, 640]
JOINT_BALL = 1.5             # cm
SCENES_SHOWN = [*VIEWS, CHARACTER, *SHAPES, *CURVES]
JUDGED = ["dinosaur", CHARACTER]   # beside the paper's method


def first_page(cli, out):
    """A page that plays the flat beam by three methods, seconds after the program is there and without the renderer; whether it was made."""
    out.mkdir(parents=True, exist_ok=True)
    page = out / "first.html"
    done = subprocess.run([cli, "run", str(SCENES / "flat_beam.toml"), "--compare", "rotation-strain,shell-implicit", "--html", str(page), "--frames", "60", "-q"],
                          check=False)
    print(f"demo: first picture, in any browser: {page}" if done.returncode == 0 else "demo: FAILED: first.html", flush=True)
    return done.returncode == 0


def run_scene(cli, name, folder, *more):
    """What the program prints for one scene, and whether it succeeded; its progress goes straight to the terminal."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in [*folder.glob("*_frames.csv"), *folder.glob("*_comparison.csv")]:
        old.unlink()
    print(f"demo: running {name}", flush=True)
    started = time.monotonic()
    try:
        done = subprocess.run([cli, "run", str(SCENES / f"{name}.toml"), "--out", str(folder), *more],
                              stdout=subprocess.PIPE, text=True, check=False)
    except OSError as error:
        return f"cannot run {cli}: {error.strerror}\n", False
    print(f"demo: {name} took {time.monotonic() - started:.1f} s", flush=True)
    return done.stdout, done.returncode == 0


def certificates(printed):
    """Each shell's method, largest error of its last frame as a length, and error of its displacement, of what the program printed."""
    judged = re.compile(r"^  method +([^\n]+)$.*?^error against the nonlinear shell.*?^  of the displacement +([0-9.e+-]+)$"
                        r".*?^  largest +([^\n]+)$", re.MULTILINE | re.DOTALL)
    return [(method, largest, 100 * float(share)) for method, share, largest in judged.findall(printed)]


def judge(name, ours, papers):
    """Lines that set the certificates of a scene by the automatic choice beside those by the paper's warp."""
    shells = list(SHELLS) if name == CHARACTER else [name]
    pairs = list(zip(shells, certificates(ours), certificates(papers)))
    lines = [f"  {shell}: {ours[0]} is {ours[2]:.2g} % off ({ours[1]} at most), the paper's warp {papers[2]:.2g} % ({papers[1]})"
             for shell, ours, papers in pairs]
    return "\n".join(lines or ["  no certificate was printed"]) + "\n"


def written_frames(folder):
    """The rest shape that a run wrote, and its frames: rows of NAME_frames.csv that name an OBJ file."""
    for table in folder.glob("*_frames.csv"):
        with open(table, encoding="utf-8", newline="") as file:
            frames = [row for row in csv.DictReader(file) if row["obj"]]
        return table.with_name(table.name.replace("_frames.csv", "_rest.obj")), frames
    return None, []


def scale_words(name):
    """The caption of a scene's colour scale, and what follows a length in its labels."""
    unit = UNITS.get(name)
    return ("displacement, " + unit, " " + unit) if unit else ("displacement (the beam is 4 long)", "")


def draw(python, out, *arguments):
    """Calls the renderer for one picture and returns the picture's path, None if that failed."""
    command = [python, str(HERE / "render.py"), "--out", str(out), *map(str, arguments)]
    return out if subprocess.run(command, check=False).returncode == 0 else None


def draw_scene(python, name, folder, out):
    """The stills of one scene and their sheet; None stands for a picture that could not be drawn."""
    for old in out.glob(f"{name}_*.png"):
        old.unlink()
    rest, frames = written_frames(folder)
    if not frames:
        print(f"demo: no frames of {name} in {folder}", file=sys.stderr)
        return [None]
    view = VIEWS[name] + ["--size", 800, 600]
    for path in [rest] + [folder / row["obj"] for row in frames]:
        view += ["--frame-on", path]
    top = max(float(row["max_displacement"]) for row in frames)
    caption, unit = scale_words(name)
    scale = ["--caption", caption, "--range", 0, top or 1]
    stills, labels = [draw(python, out / f"{name}_rest.png", *view, rest)], ["at rest"]
    for row in frames:
        picture = out / f"{name}_{int(row['frame']):04d}.png"
        stills.append(draw(python, picture, *view, *scale, "--values", folder / row["displacement"], folder / row["obj"]))
        labels.append(f"after {float(row['time']):.3g} s: moved by up to {float(row['max_displacement']):.3g}{unit}")
    if None in stills:
        return stills
    columns = next((n for n in (3, 2) if len(stills) % n == 0), len(stills))  # no cell is empty
    sheet = out / f"{name}_sheet.png"
    return stills + [draw(python, sheet, "--contact-sheet", "--columns", columns, *stills, "--labels", *labels)]


def handle_marks(table):
    """The renderer's options for the handles that a file of them lists; several on one vertex share the axes."""
    with open(table, encoding="utf-8", newline="") as file:
        handles = list(csv.DictReader(file))
    places = [[float(row[c]) for c in ("x", "y", "z")] for row in handles]
    balls = [x + [BALL] for x, row in zip(places, handles) if row["kind"] != "orientation"]
    frames = [x + [float(row[i + j]) for i in "xyz" for j in "xyz"]
              for x, row in zip(places, handles) if row["kind"] != "position"]
    words = [f"{n:.6f}" for ball in balls for n in ball]   # no exponents: -1e-7 looks like an option
    return (["--spheres", *words] if balls else []) + (["--axes", *(f"{n:.6f}" for n in frames[0])] if frames else [])


def draw_handles(python, name, folder, out):
    """One still of a scene with handles, where they have moved it most, and its label; None if it could not be drawn."""
    frames = [row for row in written_frames(folder)[1] if row["handles"]]
    if not frames:
        print(f"demo: no frames with handles of {name} in {folder}", file=sys.stderr)
        return None, ""
    row = max(frames, key=lambda row: float(row["max_displacement"]))
    picture = draw(python, out / f"{name}.png", *VIEWS[name], "--size", 800, 600, "--caption", scale_words(name)[0],
                   "--values", folder / row["displacement"], *handle_marks(folder / row["handles"]), folder / row["obj"])
    return picture, f"{HELD[name]} held, after {float(row['time']):.3g} s"


def joint_marks(tables):
    """The renderer's options for the joints of all shells: a sphere at each position, small axes at each orientation."""
    balls, axes = [], []
    for table in tables:
        with open(table, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                place = [f"{float(row[c]):.6f}" for c in ("x", "y", "z")]
                balls += [*place, JOINT_BALL] if row["kind"] != "orientation" else []
                if row["kind"] != "position":
                    axes += place + [f"{float(row[i + j]):.6f}" for i in "xyz" for j in "xyz"]
    return ["--spheres", *balls, "--axes", *axes, "--axes-length", 0.1]


def draw_body(python, folder, frame):
    """Writes the solids that wear the shells in one frame: pairs of colour and path, None if that failed."""
    done = subprocess.run([python, str(HERE / "figure.py"), str(folder / f"{CHARACTER}_bones.csv"), str(frame),
                           str(folder / f"body_{frame:04d}")], check=False, stdout=subprocess.PIPE, text=True)
    return None if done.returncode else [line.split(" ", 1) for line in done.stdout.splitlines()]


def draw_character(python, folder, out):
    """A still of all shells on the body at each frame that was written, and the sheet of them."""
    for old in out.glob(f"{CHARACTER}_*.png"):
        old.unlink()
    rows = {}
    for name in SHELLS:
        with open(folder / f"{CHARACTER}_{name}_frames.csv", encoding="utf-8", newline="") as file:
            rows[name] = {int(row["frame"]): row for row in csv.DictReader(file) if row["obj"]}
    frames = sorted(set.intersection(*(set(by_frame) for by_frame in rows.values())))
    bodies = {frame: draw_body(python, folder, frame) for frame in frames}
    if not frames or None in bodies.values():
        return [None]
    view = list(CHARACTER_VIEW)   # one camera, and one ground, so that a jump shows
    for frame in frames:
        view += [word for _, path in bodies[frame] for word in ("--frame-on", path)]
        view += [word for name in SHELLS if name != "torso" for word in ("--frame-on", folder / rows[name][frame]["obj"])]
    pictures, labels = [], []
    for frame in frames:
        here = [rows[name][frame] for name in SHELLS]
        pictures.append(draw(python, out / f"{CHARACTER}_{frame:04d}.png", *view,
                             "--colors", *SHELLS.values(), *(color for color, _ in bodies[frame]),
                             *joint_marks(folder / row["handles"] for row in here if row["handles"]),
                             *(folder / row["obj"] for row in here), *(path for _, path in bodies[frame])))
        labels.append(f"after {float(here[0]['time']):.3g} s")
    if None in pictures:
        return pictures
    sheet = out / f"{CHARACTER}_sheet.png"
    return pictures + [draw(python, sheet, "--contact-sheet", "--columns", 4, "--cell", 480, *pictures, "--labels", *labels)]


def draw_handle_scenes(python, names, out):
    """A still for each scene with handles, and their sheet."""
    stills, labels = zip(*(draw_handles(python, name, out / name, out) for name in names))
    if None in stills:
        return list(stills)
    return [*stills, draw(python, out / "handles_sheet.png", "--contact-sheet", *stills, "--labels", *labels)]


def shapes_of(folder, name):
    """The rows of a comparison that name a shape, and a colour for each method."""
    with open(folder / f"{name}_comparison.csv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["obj"]]
    return rows, colors_of(row["method"] for row in rows)


def draw_shapes(python, name, folder, out):
    """A still for each bending stiffness of a comparison at its largest gravity, the methods side by side, and its label."""
    rows, colors = shapes_of(folder, name)
    frame = [word for row in rows for word in ("--frame-on", folder / row["obj"])]
    stills = []
    for bending in dict.fromkeys(row["bending"] for row in rows):
        last = {row["method"]: row for row in rows if row["bending"] == bending}
        picture = draw(python, out / f"{name}_{bending}.png", *SIDE_BY_SIDE, "--size", 640, 480, *frame, "--colors",
                       *(colors[method] for method in last), *(folder / row["obj"] for row in last.values()))
        gravity = next(iter(last.values()))["gravity"]
        stills.append((picture, f"{SHAPES[name]}, gravity {gravity}, bending stiffness x {bending}"))
    return stills


def draw_all_shapes(python, names, out):
    """The shapes of all beams, and their sheet, a row for each beam."""
    stills, labels = zip(*(still for name in names for still in draw_shapes(python, name, out / name, out)))
    if None in stills:
        return list(stills)
    colors = shapes_of(out / names[0], names[0])[1]
    title = "from the front: " + ", ".join(f"{method} ({color})" for method, color in colors.items())
    sheet = draw(python, out / "beams_sheet.png", "--contact-sheet", "--columns", len(stills) // len(names), "--title", title,
                 *stills, "--labels", *labels)
    return [*stills, sheet]


def draw_curves(python, name, folder, out):
    picture = out / f"{name}_curves.png"
    command = [python, str(HERE / "curves.py"), "--out", str(picture), "--title", CURVES[name],
               str(folder / f"{name}_comparison.csv")]
    return picture if subprocess.run(command, check=False).returncode == 0 else None


def can_draw(python):
    try:
        return subprocess.run([python, "-c", "import matplotlib, mitsuba, numpy, PIL"], check=False, capture_output=True).returncode == 0
    except OSError:
        return False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", required=True, help="the command-line program")
    parser.add_argument("--python", default=sys.executable, help="a Python that has the renderer's packages")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder for everything written (out/demo)")
    parser.add_argument("--scenes", nargs="+", choices=SCENES_SHOWN, default=SCENES_SHOWN, help="which scenes (all)")
    parser.add_argument("--first", action="store_true", help="only the page that comes before all else")
    args = parser.parse_args()
    if args.first:
        return 0 if first_page(args.cli, args.out) else 1

    results = {name: run_scene(args.cli, name, args.out / name) for name in args.scenes}
    judged = {name: judge(name, results[name][0], run_scene(args.cli, name, args.out / name / "paper", "--method", "warp")[0])
              for name in JUDGED if name in results and results[name][1]}
    drawing = can_draw(args.python)
    pictures = []
    ready = [name for name in args.scenes if drawing and results[name][1]]
    handles = [name for name in ready if name in HELD]
    for name in ready:
        if name == CHARACTER:
            pictures += draw_character(args.python, args.out / name, args.out)
        elif name in CURVES:
            pictures.append(draw_curves(args.python, name, args.out / name, args.out))
        elif name in VIEWS and name not in handles:
            pictures += draw_scene(args.python, name, args.out / name, args.out)
    if handles:
        pictures += draw_handle_scenes(args.python, handles, args.out)
    shapes = [name for name in ready if name in SHAPES]
    if shapes:
        pictures += draw_all_shapes(args.python, shapes, args.out)

    for name, (printed, _) in results.items():
        print(f"\n== {name}\n{printed}", end="")
    for name, lines in judged.items():
        print(f"\n== {name}: last frame against the full shell\n{lines}", end="")
    print("\n== pictures\n" + ("\n".join(f"{path}" for path in pictures if path) or "none"))
    failed = [name for name, (_, good) in results.items() if not good] + ["pictures"] * (None in pictures)
    if failed:
        print("demo: FAILED: " + ", ".join(failed))
    elif not drawing:
        print("demo: OK, but without pictures: the renderer is not installed (sh cmake/bootstrap.sh render)")
    else:
        print("demo: OK")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
