"""A sheet of 13,225 vertices that falls onto a ball, by shellwarp and by other programs: the table of docs/evidence/speed.md.

usage: contact_peers.py [--docs FILE] [--only NAME ...] [--frames N] [--hanging]

The same sheet, ball, gravity and frames of 1/60 s for all. With --hanging no ball, frames of 1/30 s and of shellwarp the full shell alone: the table of
docs/evidence/solver.md. Each program takes the steps and settings that it needs for
them; the table tells which. Each runs alone in a process of its own, on the interpreter of --python, or Blender's on that of
--blender. What is not installed is skipped by name. `make bench-contact-peers` runs it.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sections import put_section

ROOT = Path(__file__).resolve().parents[2]
# The sheet: 1 m by 1 m in z = 0, its first two columns held. A plate of this material sags by half its length there.
SIDE, HELD = 115, 2
YOUNG, POISSON, THICKNESS, DENSITY = 2e8, 0.3, 5e-3, 200.0
# The ball: its top is 0.1 m below the sheet.
RADIUS, CENTER, FRICTION = 0.2, (0.65, 0.0, -0.3), 0.3
G = 9.81
HANGING = "--hanging" in sys.argv
FRAME = 1.0 / 30.0 if HANGING else 1.0 / 60.0
METHODS = [("warp", 16, 0), ("warp", 48, 0), ("rotation-strain", 16, 0), ("reduced-shell", 16, 20), ("shell-implicit", 16, 0)]


def sheet():
    """Positions, triangles and the vertices that are held."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, SIDE), np.linspace(-0.5, 0.5, SIDE), indexing="ij")
    positions = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    a = (SIDE * np.arange(SIDE - 1)[:, None] + np.arange(SIDE - 1)).ravel()
    triangles = np.stack([a, a + SIDE, a + SIDE + 1, a, a + SIDE + 1, a + 1], axis=-1).reshape(-1, 3)
    return positions, triangles.astype(np.uint32), np.arange(HELD * SIDE)


def bending():
    """D of a plate, N m."""
    return YOUNG * THICKNESS**3 / (12 * (1 - POISSON**2))


def timed(name, models, frames, advance):
    """Runs frames by `advance`, which returns all positions; the row of the table."""
    seconds, depths, lowest = [], [], 0.0
    for _ in range(frames):
        start = time.perf_counter()
        x = np.asarray(advance(), dtype=float)
        seconds.append(time.perf_counter() - start)
        depths.append(max(0.0, RADIUS - np.linalg.norm(x - CENTER, axis=1).min()) if np.isfinite(x).all() else float("nan"))
        lowest = float(x[:, 2].min())
    return {
        "name": name,
        "models": models,
        "vertices": SIDE**2,
        "note": "",
        "seconds": statistics.median(seconds[1:]),  # the first makes what others reuse
        "worst": max(seconds[1:]),
        "deepest": max(depths),
        "rest": max(depths[-frames // 4 :]),
        "lowest": lowest,
    }


def shellwarp(frames):
    sys.path.insert(0, str(ROOT / "host_examples" / "python"))
    import shellwarp as sw

    positions, triangles, held = sheet()
    shell = sw.Shell(positions, triangles, sw.Sheet(YOUNG, POISSON, THICKNESS, DENSITY), fixed=held)
    rows = []
    for method, modes, fields in METHODS[-1:] if HANGING else METHODS:
        model = sw.Model(shell)
        model.precompute(modes=modes, reduced_fields=fields)
        state = model.state(method)
        state.set_gravity([0, 0, -G])
        if not HANGING:
            state.set_colliders([sw.Collider.sphere(RADIUS, friction=FRICTION)])
            state.move_collider(0, list(CENTER))
        out = np.empty((len(positions), 3), np.float32)

        def advance():
            state.step(FRAME)
            return state.positions(out=out)

        fields = f", {fields} fields" if fields else ""
        modes = "" if method == "shell-implicit" else f", {modes} modes{fields}"
        models = "thin shell that bends and stretches; exact ball, Coulomb friction; a step a frame"
        rows.append(timed(f"shellwarp, {method}{modes}", models, frames, advance))
    return rows


def mujoco(frames):
    import mujoco as mj

    rows = []
    for side in [SIDE, 24]:  # its solve ends only on coarse sheets
        spacing, pins = 1.0 / (side - 1), " ".join(str(i) for i in range(HELD * side))
        text = f"""<mujoco><option timestep="{FRAME}" integrator="discrete" jacobian="sparse"/><size memory="2G"/><worldbody>
            <geom type="sphere" size="{RADIUS}" pos="{CENTER[0]} {CENTER[1]} {CENTER[2]}" friction="{FRICTION}"/>
            <flexcomp name="sheet" type="grid" count="{side} {side} 1" spacing="{spacing} {spacing} {spacing}" pos="0.5 0 0" dim="2"
                mass="{DENSITY * THICKNESS}" radius="1e-4">
            <elasticity young="{YOUNG}" poisson="{POISSON}" thickness="{THICKNESS}" elastic2d="both"/>
            <contact selfcollide="none" friction="{FRICTION}"/><pin id="{pins}"/></flexcomp></worldbody></mujoco>"""
        model = mj.MjModel.from_xml_string(text)
        data = mj.MjData(model)

        def advance():
            mj.mj_step(model, data)
            return data.flexvert_xpos.copy()

        name = f"MuJoCo {mj.__version__}, flex, integrator discrete, {model.opt.iterations} iterations"
        count = min(frames, 20) if side == SIDE else frames
        row = timed(name, "plate that bends and stretches; soft contact with friction; a step a frame", count, advance)
        told = any(warning.number for warning in data.warning)
        row["note"] = "its solve ran out of iterations, it warns: the sheet hardly falls" if told else ""
        rows.append(row | {"vertices": side * side})
    return rows


def newton(frames):
    import newton as nt
    import warp as wp

    wp.config.quiet = True
    wp.init()
    positions, triangles, held = sheet()
    substeps, iterations = 20, 10
    rows = []
    with wp.ScopedDevice("cpu"):
        builder = nt.ModelBuilder(gravity=(0.0, 0.0, -G))
        builder.add_cloth_mesh(
            pos=wp.vec3(0.0, 0.0, 0.0),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(0.0, 0.0, 0.0),
            vertices=[wp.vec3(*p) for p in positions],
            indices=triangles.ravel().tolist(),
            density=DENSITY * THICKNESS,
            tri_ke=YOUNG * THICKNESS / (2 * (1 + POISSON)),
            tri_ka=YOUNG * POISSON * THICKNESS / (1 - POISSON**2),
            tri_kd=0.0,
            edge_ke=bending() * (SIDE - 1),
            edge_kd=0.0,
            particle_radius=1e-3,
        )
        for v in held:
            builder.particle_mass[v] = 0.0
        solid = nt.ModelBuilder.ShapeConfig()
        solid.ke, solid.kd, solid.mu = 1e5, 1e1, FRICTION
        if not HANGING:
            builder.add_shape_sphere(-1, xform=wp.transform(wp.vec3(*CENTER), wp.quat_identity()), radius=RADIUS, cfg=solid)
        builder.color(include_bending=True)
        model = builder.finalize()
        model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = 1e5, 1e1, FRICTION
        solver = nt.solvers.SolverVBD(model=model, iterations=iterations, particle_enable_self_contact=False)
        states, control = [model.state(), model.state()], model.control()
        pipeline = nt.CollisionPipeline(model)
        contacts = pipeline.contacts()

        def advance():
            for _ in range(substeps):
                states[0].clear_forces()
                if not HANGING:
                    pipeline.collide(states[0], contacts)
                solver.step(states[0], states[1], control, None if HANGING else contacts, FRAME / substeps)
                states.reverse()
            return states[0].particle_q.numpy()

        name = f"Newton {nt.__version__}, VBD on the CPU, {substeps} substeps of {iterations} iterations"
        rows.append(timed(name, "St. Venant-Kirchhoff membrane, hinges; contact springs with friction", frames, advance))
    return rows


def blender(frames):
    import bpy

    positions, triangles, held = sheet()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.gravity = round(1 / FRAME), (0, 0, -G)
    scene.frame_end = frames + 1
    if not HANGING:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=RADIUS, location=CENTER)
        ball = bpy.context.object
        ball.modifiers.new("Collision", "COLLISION")
        ball.collision.thickness_outer, ball.collision.cloth_friction = 0.001, 5.0
    mesh = bpy.data.meshes.new("sheet")
    mesh.from_pydata(positions.tolist(), [], triangles.tolist())
    cloth_object = bpy.data.objects.new("sheet", mesh)
    scene.collection.objects.link(cloth_object)
    cloth_object.vertex_groups.new(name="held").add(held.tolist(), 1.0, "REPLACE")
    cloth = cloth_object.modifiers.new("Cloth", "CLOTH")
    settings = cloth.settings
    settings.quality, settings.vertex_group_mass = 5, "held"
    settings.mass = DENSITY * THICKNESS / SIDE**2  # of a vertex
    settings.bending_model = "ANGULAR"
    settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = 80.0
    settings.bending_stiffness = 150.0
    settings.air_damping = 0.0
    cloth.collision_settings.collision_quality, cloth.collision_settings.distance_min = 2, 0.001
    cloth.collision_settings.use_collision, cloth.collision_settings.use_self_collision = not HANGING, False
    cloth.point_cache.frame_end = frames + 1
    frame = [1]
    scene.frame_set(1)

    def advance():
        frame[0] += 1
        scene.frame_set(frame[0])
        seen = cloth_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        x = np.empty(3 * len(positions), np.float32)
        seen.vertices.foreach_get("co", x)
        return x.reshape(-1, 3)

    name = f"Blender {bpy.app.version_string}, cloth, {settings.quality} steps of quality"
    return [timed(name, "springs (leather's); contact with a mesh of 64 by 32", frames, advance)]


PEERS = {"shellwarp": shellwarp, "mujoco": mujoco, "newton": newton, "blender": blender}
MODULES = {"shellwarp": "numpy", "mujoco": "mujoco", "newton": "newton", "blender": "bpy"}


def measure(name, python, frames):
    """Rows of a peer, from a process of its own, or why there are none."""
    if python is None or subprocess.run([python, "-c", f"import {MODULES[name]}"], capture_output=True).returncode:
        return None, f"skipped: the Python package {MODULES[name]} is not installed"
    with tempfile.TemporaryDirectory() as folder:  # some write logs where they run
        command = [python, str(Path(__file__).resolve()), "--run", name, "--frames", str(frames), *(["--hanging"] if HANGING else [])]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines or not lines[-1].startswith("["):
        trouble = (done.stderr.strip() or done.stdout.strip()).splitlines()
        return None, f"failed: {trouble[-1] if trouble else done.returncode}"
    return json.loads(lines[-1]), None


def table(found, frames):
    """The section of the document."""
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
    text = f"{processor}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} after. {frames} frames of 1/{1 / FRAME:.0f} s each.\n\n"
    if HANGING:
        text += "| program | s a frame, median | worst | tip's height, m |\n|---|---|---|---|\n"
        text += "".join(f"| {row['name']} | {row['seconds']:.2g} | {row['worst']:.2g} | {row['lowest']:.3f} |\n" for rows, _ in found.values() for row in rows or [])
        return text + "".join(f"\n{name}: {trouble}\n" for name, (_, trouble) in found.items() if trouble)
    text += "| program | vertices | s a frame | worst | deepest, m | in the last quarter | tip's height, m | what it models |\n|---|---|---|---|---|---|---|---|\n"
    notes = []
    for name, (rows, trouble) in found.items():
        if trouble:
            notes.append(f"{name}: {trouble}")
        for row in rows or []:
            numbers = " | ".join(f"{row[key]:.2g}" for key in ("seconds", "worst", "deepest", "rest"))
            told = row["models"] + (f"; {row['note']}" if row["note"] else "")
            text += f"| {row['name']} | {row['vertices']} | {numbers} | {row['lowest']:.3f} | {told} |\n"
    return text + "".join(f"\n{note}\n" for note in notes)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", help="a document with a line <!-- end of contact_peers -->, or <!-- end of hanging -->")
    parser.add_argument("--only", nargs="+", choices=PEERS, default=list(PEERS))
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--blender", default=str(ROOT / ".venv" / "blender" / "bin" / "python"))
    parser.add_argument("--hanging", action="store_true", help="no ball, the full shell alone")
    parser.add_argument("--run", choices=PEERS, help="this one alone, in this process; prints JSON")
    options = parser.parse_args()
    if options.run:
        print(json.dumps(PEERS[options.run](options.frames)))
        return 0
    if "SHELLWARP_LIBRARY" in os.environ:  # they run elsewhere
        os.environ["SHELLWARP_LIBRARY"] = os.path.abspath(os.environ["SHELLWARP_LIBRARY"])
    found = {}
    for name in options.only:
        python = options.blender if name == "blender" else options.python
        found[name] = measure(name, python if Path(python).exists() else None, options.frames)
    text = table(found, options.frames)
    print(text)
    if options.docs:
        put_section(options.docs, "hanging" if HANGING else "contact_peers", text)
    failed = [name for name, (_, trouble) in found.items() if trouble and trouble.startswith("failed")]
    print("bench-contact-peers: " + (f"FAILED: {', '.join(failed)}" if failed else "OK"))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
