"""Newton's VBD and XPBD cloth solvers on a sheet of 13,225 vertices on the CPU: microseconds a frame of 1/30 s.

usage: cloth_newton.py [FRAMES]

For scale only. Settings are those of Newton's own example of a hanging cloth (10 substeps a sixtieth of a second, 10
iterations), contacts left out; its materials and discretization are other ones. Prints one line of JSON.
"""

import json
import statistics
import sys
import time

import newton
import warp as wp

SIDE = 114  # cells; 115 x 115 vertices
FRAME = 1.0 / 30.0


def sheet(solver):
    """The model of a square sheet held along one side, and its solver."""
    builder = newton.ModelBuilder()
    membrane = (
        {"add_springs": True, "spring_ke": 1.0e3, "spring_kd": 1.0}
        if solver == "XPBD"
        else {"tri_ke": 1.0e3, "tri_ka": 1.0e3, "tri_kd": 1.0e2}
    )
    builder.add_cloth_grid(
        pos=wp.vec3(0.0, 0.0, 20.0),
        rot=wp.quat_identity(),
        vel=wp.vec3(0.0, 0.0, 0.0),
        dim_x=SIDE,
        dim_y=SIDE,
        cell_x=0.1,
        cell_y=0.1,
        mass=0.1,
        fix_left=True,
        edge_ke=1.0e1,
        edge_kd=0.0,
        particle_radius=0.05,
        **membrane,
    )
    if solver == "VBD":
        builder.color(include_bending=True)
        model = builder.finalize()
        return model, newton.solvers.SolverVBD(model=model, iterations=10, particle_enable_self_contact=False)
    model = builder.finalize()
    return model, newton.solvers.SolverXPBD(model=model, iterations=10)


def frame_times(solver, frames, substeps=20):
    """Seconds of each frame after one for warming up, and the vertices."""
    model, engine = sheet(solver)
    before, after, control = model.state(), model.state(), model.control()
    seconds = []
    for _ in range(frames + 1):
        start = time.perf_counter()
        for _ in range(substeps):
            before.clear_forces()
            engine.step(before, after, control, None, FRAME / substeps)
            before, after = after, before
        before.particle_q.numpy()
        seconds.append(time.perf_counter() - start)
    return seconds[1:], model.particle_count


def main():
    wp.config.quiet = True
    wp.init()
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    results = []
    with wp.ScopedDevice("cpu"):
        for solver in ["XPBD", "VBD"]:
            seconds, vertices = frame_times(solver, frames)
            results.append(
                {
                    "solver": f"Newton {newton.__version__}, {solver} on the CPU, 20 substeps of 10 iterations",
                    "vertices": vertices,
                    "us_per_frame": 1e6 * statistics.median(seconds),
                }
            )
    print(json.dumps(results))


if __name__ == "__main__":
    main()
