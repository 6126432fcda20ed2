"""A moving shell."""

from ctypes import POINTER, byref, c_double, c_uint32, c_uint64, create_string_buffer, sizeof
from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

import numpy
from numpy.typing import ArrayLike, DTypeLike

from . import _abi, _arrays, _library
from ._handle import Handle
from ._types import Array, Buffer, Report, Steps, Watch
from ._values import as_dict, choice, guarded, newton_steps, uint32
from .binding import Binding
from .collider import Collider
from .errors import CancelledError, InvalidArgumentError
from .method import DEFAULT, methods

if TYPE_CHECKING:
    from .model import Model

INTEGRATORS = {"implicit-euler": _abi.SW_INTEGRATOR_IMPLICIT_EULER, "exact": _abi.SW_INTEGRATOR_EXACT,
               "second-order": _abi.SW_INTEGRATOR_SECOND_ORDER}
SPACES = {"world": _abi.SW_SPACE_WORLD, "frame": _abi.SW_SPACE_FRAME}
KINDS = {"position": _abi.SW_CONSTRAINT_POSITION, "orientation": _abi.SW_CONSTRAINT_ORIENTATION}
AXES = {"x": _abi.SW_AXIS_X, "y": _abi.SW_AXIS_Y, "z": _abi.SW_AXIS_Z}


def _fill(target, values, name):
    target[:] = _arrays.numbers_in(values, name, len(target)).tolist()


class State(Handle):
    """Made by Model.state. One thread at a time; the readers may run at the same time as each other."""

    _destroyer = "sw_state_destroy"

    def __init__(self, model: "Model", method: str = DEFAULT, integrator: str = "implicit-euler",
                 deterministic: bool = False) -> None:
        desc = _library.initialised(_abi.SwStateDesc)
        desc.method, desc.integrator = choice(methods(), method, "method"), choice(INTEGRATORS, integrator, "integrator")
        desc.flags = _abi.SW_STATE_DETERMINISTIC if deterministic else 0
        pointer = POINTER(_abi.SwState)()
        model._call("sw_state_create", byref(desc), byref(pointer))
        self._adopt(pointer)
        self.n_vertices = model.n_vertices

    def clone(self) -> "State":
        """An independent copy: stepped alike, the same bits."""
        pointer = POINTER(_abi.SwState)()
        self._call("sw_state_clone", byref(pointer))
        other = State.__new__(State)
        other._adopt(pointer)
        other.n_vertices = self.n_vertices
        return other

    # ------------------------------------------------------------------------------------------------------- inputs

    def set_gravity(self, gravity: ArrayLike) -> None:
        """Acceleration (3), world axes."""
        self._call("sw_state_set_gravity", _arrays.address(_arrays.numbers_in(gravity, "gravity", 3)))

    def set_method(self, method: str) -> None:
        """Goes on by another method from the nearest pose and velocities."""
        self._call("sw_state_set_method", choice(methods(), method, "method"))

    def set_rest_tolerance(self, length: float) -> None:
        """How little motion must be left for the state to rest and skip its steps; 0 for none at all."""
        self._call("sw_state_set_rest_tolerance", length)

    def set_stiffness(self, factor: float) -> None:
        """Multiplies all stiffness from the next step on, without a precompute; 1 at first. Shape and velocities stay."""
        self._call("sw_state_set_stiffness", factor)

    def set_frequency(self, hertz: float) -> float:
        """Sets the stiffness by which the slowest swing has this frequency; returns the factor."""
        factor = c_double()
        self._call("sw_state_set_frequency", hertz, byref(factor))
        return factor.value

    def set_sag(self, length: float, tolerance: float = 0.01) -> float:
        """Sets the stiffness by which the vertex that moves furthest is so far from rest at the equilibrium of the present loads, where the state then is; returns the factor."""
        factor = c_double()
        self._call("sw_state_set_sag", length, tolerance, byref(factor))
        return factor.value

    def set_damping(self, ratio: ArrayLike = 0.0, mass: float = 0.0, stiffness: float = 0.0, factors: "ArrayLike | None" = None) -> None:
        """Fraction of critical damping, one or (modes), of the full shell one, that of its slowest swing; Rayleigh's coefficients in 1/s and s.

        `factors` (n_vertices) are what `ratio` and `mass` are multiplied by on a part of the shell.
        """
        ratios = _arrays.numbers_in(ratio, "ratio")
        if ratios.size == 1 and ratios[0] == 0:
            ratios = ratios[:0]   # no ratio: all that a nonlinear shell takes
        desc = _library.initialised(_abi.SwDampingDesc)
        desc.mass_coefficient, desc.stiffness_coefficient = mass, stiffness
        desc.ratios, desc.n_ratios = _arrays.address(ratios), ratios.size
        by_vertices = numpy.ascontiguousarray([] if factors is None else factors, dtype=numpy.float64).ravel()
        desc.factors, desc.n_factors, desc.factor_format = _arrays.address(by_vertices), by_vertices.size, _abi.SW_FORMAT_F64
        self._call("sw_state_set_damping", byref(desc))

    def set_frame(self, origin: ArrayLike = (0, 0, 0), rotation: "ArrayLike | None" = None, teleport: bool = False,
                  motion: "ArrayLike | None" = None) -> None:
        """Where the support frame is at the end of the next step: world = origin + rotation local, rotation (3 x 3).

        `motion` gives velocity, acceleration, angular velocity and angular acceleration (4 x 3) instead of differences.
        """
        desc = _library.initialised(_abi.SwFrameDesc)
        _fill(desc.origin, origin, "origin")
        if rotation is not None:
            _fill(desc.rotation, rotation, "rotation")
        desc.flags = _abi.SW_FRAME_TELEPORT if teleport else 0
        if motion is not None:
            desc.flags |= _abi.SW_FRAME_MOTION_GIVEN
            fields = (desc.velocity, desc.acceleration, desc.angular_velocity, desc.angular_acceleration)
            for target, values in zip(fields, _arrays.numbers_in(motion, "motion", 12).reshape(4, 3)):
                target[:] = values.tolist()
        self._call("sw_state_set_frame", byref(desc))

    def set_forces(self, forces: "ArrayLike | None", vertices: "ArrayLike | None" = None, one_step: bool = False) -> None:
        """Forces (n x 3), world axes, on `vertices` (n) or on all in order; None removes them."""
        desc = _library.initialised(_abi.SwForceDesc)
        forces, form, stride = _arrays.vectors_in(numpy.empty((0, 3)) if forces is None else forces, "forces")
        if vertices is not None:
            vertices = _arrays.indices_in(vertices, "vertices")
            if len(vertices) != len(forces):
                raise InvalidArgumentError(f"forces: {len(forces)} forces on {len(vertices)} vertices")
        desc.flags = _abi.SW_FORCES_ONE_STEP if one_step else 0
        desc.format, desc.count, desc.forces, desc.stride = form, len(forces), _arrays.address(forces), stride
        desc.vertices = _arrays.address(vertices)
        self._call("sw_state_set_forces", byref(desc))

    def set_wind(self, velocity: ArrayLike = (0, 0, 0), density: float = 0.0, normal_drag: float = 0.0, tangential_drag: float = 0.0,
                 local_velocities: "ArrayLike | None" = None) -> None:
        """Air that drags at the triangles: SwWindDesc. A density of 0 is no wind."""
        desc = _library.initialised(_abi.SwWindDesc)
        _fill(desc.velocity, velocity, "velocity")
        desc.density, desc.normal_drag, desc.tangential_drag = density, normal_drag, tangential_drag
        if local_velocities is not None:
            local, desc.local_format, desc.local_stride = _arrays.vectors_in(local_velocities, "local_velocities")
            if len(local) != self.n_vertices:
                raise InvalidArgumentError(f"local_velocities: {len(local)} rows, the mesh has {self.n_vertices} vertices")
            desc.local_velocities = _arrays.address(local)
        self._call("sw_state_set_wind", byref(desc))

    def set_colliders(self, colliders: "Sequence[Collider]" = ()) -> None:
        """Replaces the solids that it touches; none for none. Each is in the world's axes until move_collider."""
        with ExitStack() as stack:
            pointers = [stack.enter_context(collider._use()) for collider in colliders]
            self._call("sw_state_set_colliders", (POINTER(_abi.SwCollider) * max(len(pointers), 1))(*pointers), len(pointers))

    def move_collider(self, number: int, origin: ArrayLike = (0, 0, 0), rotation: "ArrayLike | None" = None,
                      teleport: bool = False) -> None:
        """Where the collider of this place in the list is at the end of the next step: world = origin + rotation local (3 x 3)."""
        desc = _library.initialised(_abi.SwColliderPoseDesc)
        _fill(desc.origin, origin, "origin")
        if rotation is not None:
            _fill(desc.rotation, rotation, "rotation")
        desc.flags = _abi.SW_COLLIDER_TELEPORT if teleport else 0
        self._call("sw_state_move_collider", uint32(number, "number"), byref(desc))

    def deform_collider(self, number: int, positions: ArrayLike, teleport: bool = False) -> None:
        """The shape of a deforming collider at the end of the next step: positions (n x 3) of its vertices, in its axes."""
        positions, form, stride = _arrays.vectors_in(positions, "positions")
        self._call("sw_state_deform_collider", uint32(number, "number"), _abi.SW_COLLIDER_TELEPORT if teleport else 0, form,
                   _arrays.address(positions), stride, len(positions))

    def set_constraint(self, number: int, kind: str, vertex: int, position: "ArrayLike | None" = None, rotation: "ArrayLike | None" = None,
                       axes: str = "xyz", compliance: float = 0.0) -> None:
        """Adds, moves or replaces the handle `number`: holds a vertex's "position" (3) or "orientation" (3 x 3), in the world."""
        desc = _library.initialised(_abi.SwConstraintDesc)
        desc.id, desc.kind, desc.vertex = uint32(number, "number"), choice(KINDS, kind, "kind"), uint32(vertex, "vertex")
        desc.axes = sum(choice(AXES, axis, "axes") for axis in set(axes))
        desc.compliance = compliance
        if not axes:
            raise InvalidArgumentError("axes: none, expected some of 'xyz'")
        if (position is None) == (kind == "position") or (kind == "position" and rotation is not None):
            raise InvalidArgumentError("a position constraint takes a position, an orientation constraint a rotation")
        if position is not None:
            _fill(desc.position, position, "position")
        if rotation is not None:
            _fill(desc.rotation, rotation, "rotation")
        self._call("sw_state_set_constraint", byref(desc))

    def clear_constraint(self, number: "int | None" = None) -> None:
        """Lets one go, or all."""
        self._call("sw_state_clear_constraint", _abi.SW_ALL_CONSTRAINTS if number is None else uint32(number, "number"))

    def set_amplitudes(self, amplitudes: ArrayLike, velocities: "ArrayLike | None" = None) -> None:
        """Modal amplitudes and their rates (modes), rates 0 by default."""
        amplitudes = _arrays.numbers_in(amplitudes, "amplitudes")
        velocities = numpy.zeros_like(amplitudes) if velocities is None else velocities
        velocities = _arrays.numbers_in(velocities, "velocities", amplitudes.size)
        self._call("sw_state_set_amplitudes", _arrays.address(amplitudes), _arrays.address(velocities), amplitudes.size)

    def move_supports(self, positions: ArrayLike, teleport: bool = False) -> None:
        """Sets where supported vertices are at the end of the next step, each on a path of its own, in world space.

        `positions` (n_vertices x 3) has a row for every vertex; only those of supports are read. The frame follows them as a whole. What is left bends the
        shell, by the model's support_fields or, of the full shell, exactly. With `teleport` they are there without having moved."""
        x, form, stride = _arrays.vectors_in(positions, "positions")
        self._call("sw_state_move_supports", form, _arrays.address(x), stride, len(x), _abi.SW_SUPPORTS_TELEPORT if teleport else 0)

    def move_rest(self, positions: "ArrayLike | None", teleport: bool = False) -> None:
        """Sets where the rest shape is at the end of the next step (n_vertices x 3), in world space: blend shapes, skinned cloth. None is the mesh again.

        The displacement is added to it, turned with its triangles; its inertia acts. With `teleport` it is there without having moved."""
        if positions is None:
            self._call("sw_state_move_rest", _abi.SW_FORMAT_F64, None, 0, 0, 0)
            return
        x, form, stride = _arrays.vectors_in(positions, "positions")
        self._call("sw_state_move_rest", form, _arrays.address(x), stride, len(x), _abi.SW_REST_TELEPORT if teleport else 0)

    def set_pose(self, positions: ArrayLike, velocities: "ArrayLike | None" = None, space: str = "world") -> float:
        """Takes the nearest pose to positions (n_vertices x 3) that the method has, and the nearest velocities, or rest in the frame.

        Returns how far the vertices are from where they were to be: the root of the mean square, weighted by mass."""
        x, form, stride = _arrays.vectors_in(positions, "positions")
        rates, rate_stride = None, 0
        if velocities is not None:
            rates, _, rate_stride = _arrays.vectors_in(numpy.asarray(velocities, dtype=x.dtype), "velocities")
            if len(rates) != len(x):
                raise InvalidArgumentError(f"velocities: {len(rates)} of {len(x)} positions")
        missed = c_double()
        self._call("sw_state_set_pose", choice(SPACES, space, "space"), form, _arrays.address(x), stride, _arrays.address(rates),
                   rate_stride, len(x), byref(missed))
        return missed.value

    # --------------------------------------------------------------------------------------------------------- time

    def step(self, seconds: float) -> None:
        """Advances by `seconds` > 0. Releases the global lock."""
        self._call("sw_state_step", seconds)

    def reset(self) -> None:
        """Back to rest and time 0."""
        self._call("sw_state_reset")

    def _search(self, name, given, watch):
        """Calls sw_state_NAME, watched where somebody watches."""
        if watch is None:
            self._call(f"sw_state_{name}", given)
            return
        raised = []
        callback = _abi.SwWatchFn(guarded(watch, raised))
        try:
            self._call(f"sw_state_{name}_watched", given, callback, None)
        except CancelledError:
            if raised:
                raise raised[0] from None
            raise

    def equilibrium(self, watch: Watch = None) -> Report:
        """Moves to the static solution under the present loads: {"iterations", "residual", "seconds"}. `watch(residual)` is called as the search goes on, with
        what is left of the force. It may return False to stop, which raises CancelledError; then nothing has moved."""
        report = _library.initialised(_abi.SwEquilibriumReport)
        self._search("equilibrium", byref(report), watch)
        return as_dict(report)

    def save(self) -> bytes:
        """The dynamic state as bytes, under a kilobyte at 50 modes. Loads, damping and constraints are inputs, not in it."""
        size = c_uint64()
        self._call("sw_state_save", None, 0, byref(size))
        data = create_string_buffer(size.value)
        self._call("sw_state_save", data, size.value, byref(size))
        return data.raw[:size.value]

    def load(self, data: Buffer) -> None:
        """Restores what save gave, on a model of the same inputs; the run goes on with the same bits."""
        data = bytes(data)
        self._call("sw_state_load", data, len(data))

    # ------------------------------------------------------------------------------------------------------ results

    def _read(self, name, columns, out, space, dtype):
        out, form, stride = _arrays.vectors_out(out, (self.n_vertices, columns), dtype, name)
        self._call(f"sw_state_{name}", choice(SPACES, space, "space"), form, _arrays.address(out), stride, self.n_vertices)
        return out

    def positions(self, out: "Array | None" = None, space: str = "world", dtype: DTypeLike = numpy.float32) -> Array:
        """Deformed positions (n_vertices x 3), written into `out` if given."""
        return self._read("positions", 3, out, space, dtype)

    def positions_of(self, vertices: ArrayLike, space: str = "world", dtype: DTypeLike = numpy.float32) -> Array:
        """Deformed positions of some vertices alone (n x 3), in their order."""
        vertices = numpy.ascontiguousarray(vertices, dtype=numpy.uint32)
        out, form, stride = _arrays.vectors_out(None, (vertices.size, 3), dtype, "positions")
        self._call("sw_state_positions_of", choice(SPACES, space, "space"), form, _arrays.address(vertices), vertices.size,
                   _arrays.address(out), stride)
        return out

    def positions_outside(self, space: str = "world", dtype: DTypeLike = numpy.float32) -> tuple[Array, float]:
        """Positions for the eye, out of colliders (n_vertices x 3), and how deep a vertex still is. The motion does not know."""
        out, form, stride = _arrays.vectors_out(None, (self.n_vertices, 3), dtype, "positions")
        deepest = c_double()
        self._call("sw_state_positions_outside", choice(SPACES, space, "space"), form, _arrays.address(out), stride, self.n_vertices,
                   byref(deepest))
        return out, deepest.value

    def correct(self, steps: Steps = "auto", watch: Watch = None) -> None:
        """Takes Newton steps of the full nonlinear shell that go on from frame to frame, for output alone. Once after a frame's steps, before `positions_corrected`.

        "auto" goes on to the full shell's equilibrium, as `certify` seeks it, where that finds more than 5 % of the displacement wrong: of a state at rest that moves by fields,
        as after `equilibrium`. Where more than half is wrong, or no equilibrium is found, it takes the full shell's way from rest, up to 2,500 vertices.
        Of any other state, one in motion too, it keeps nothing. 0 forgets what was kept.
        Steps by number are for loads that change slowly: near a fold they lead quick motion astray. `watch` as of `certify`; after a stop what was kept before stays."""
        self._search("correct", newton_steps(steps, "steps"), watch)

    def positions_corrected(self, steps: Steps = "auto", out: "Array | None" = None, space: str = "world", dtype: DTypeLike = numpy.float32) -> Array:
        """Positions (n_vertices x 3) where `correct` led since the last step, or else after so many Newton steps of the full nonlinear shell, for output alone.

        "auto" takes no step: without `correct` it gives `positions`."""
        out, form, stride = _arrays.vectors_out(out, (self.n_vertices, 3), dtype, "positions")
        self._call("sw_state_positions_corrected", newton_steps(steps, "steps"), choice(SPACES, space, "space"), form, _arrays.address(out), stride,
                   self.n_vertices)
        return out

    def normals(self, out: "Array | None" = None, space: str = "world", dtype: DTypeLike = numpy.float32) -> Array:
        """Unit normals (n_vertices x 3)."""
        return self._read("normals", 3, out, space, dtype)

    def rotations(self, out: "Array | None" = None, space: str = "world", dtype: DTypeLike = numpy.float32) -> Array:
        """Rotation of each vertex from rest, unit quaternions w x y z (n_vertices x 4)."""
        return self._read("rotations", 4, out, space, dtype)

    def bound_points(self, binding: "Binding", wanted: Sequence[str] = ("positions",), out: "dict[str, Array] | None" = None,
                     space: str = "world", dtype: DTypeLike = numpy.float32, correction_steps: Steps = 0, outside: bool = False) -> dict[str, Array]:
        """What of "positions", "normals", "tangents" and "velocities" is wanted of a binding's points, each (n_points x 3).

        `out` has arrays to fill, of one dtype; otherwise they are new. For the eye, points follow the shell after `correction_steps` as `positions_corrected`
        has it, or are `outside` colliders as by `positions_outside`, beside which "auto" is 0; velocities are those of the motion."""
        desc = _library.initialised(_abi.SwBoundPointsDesc)
        names = ("positions", "normals", "tangents", "velocities")
        arrays = dict(out) if out is not None else {name: numpy.empty((binding.n_points, 3), dtype) for name in wanted}
        for name, values in arrays.items():
            if name not in names:
                raise InvalidArgumentError(f"{name!r} is none of {', '.join(names)}")
            _, form, stride = _arrays.vectors_out(values, (binding.n_points, 3), dtype, name)
            if desc.format not in (0, form):
                raise InvalidArgumentError("the arrays are of different dtypes")
            desc.format = form
            setattr(desc, name, _arrays.address(values))
            setattr(desc, {"velocities": "velocity"}.get(name, name[:-1]) + "_stride", stride)
        desc.space = choice(SPACES, space, "space")
        desc.correction_steps, desc.flags = newton_steps(correction_steps, "correction_steps"), _abi.SW_BOUND_OUTSIDE if outside else 0
        if arrays:
            with binding._use() as pointer:
                self._call("sw_state_bound_points", pointer, byref(desc))
        return arrays

    def amplitudes(self) -> tuple[Array, Array]:
        """Modal amplitudes and their rates, two arrays (modes)."""
        count = c_uint32()
        self._call("sw_state_amplitudes", None, None, 0, byref(count))
        q, rates = numpy.empty(count.value), numpy.empty(count.value)
        self._call("sw_state_amplitudes", _arrays.address(q), _arrays.address(rates), count.value, byref(count))
        return q, rates

    def report(self) -> Report:
        """Energies, and how far the shell is bent: SwStateReport as a dict."""
        report = _library.initialised(_abi.SwStateReport)
        self._call("sw_state_report", byref(report))
        return as_dict(report)

    def certify(self, watch: Watch = None) -> Report:
        """How far it is from the full nonlinear shell, by an estimate: SwCertificate as a dict. `watch(residual)` is called after each iteration with
        what it leaves of the force; it may return False to stop, which raises CancelledError."""
        certificate = _library.initialised(_abi.SwCertificate)
        self._search("certify", byref(certificate), watch)
        return as_dict(certificate)

    def fall_back(self, watch: Watch = None) -> Report:
        """Goes on by the paper's warp where that is nearer to the full nonlinear shell: SwCertificate of the method that goes on. `watch` as of `certify`; after a stop
        the state is as it was."""
        certificate = _library.initialised(_abi.SwCertificate)
        self._search("fall_back", byref(certificate), watch)
        return as_dict(certificate)

    def plan(self, seconds: float) -> list[Report]:
        """What a step of that length uses and leaves out: a list of dicts as SwPlanPart."""
        count = c_uint32()
        self._call("sw_state_plan", seconds, None, sizeof(_abi.SwPlanPart), 0, byref(count))
        parts = (_abi.SwPlanPart * count.value)()
        self._call("sw_state_plan", seconds, parts, sizeof(_abi.SwPlanPart), count.value, byref(count))
        return [as_dict(part) for part in parts]

    def plan_text(self, seconds: float) -> str:
        """The same as a table."""
        size = c_uint64()
        self._call("sw_state_plan_text", seconds, None, 0, byref(size))
        text = create_string_buffer(size.value)
        self._call("sw_state_plan_text", seconds, text, size.value, byref(size))
        return text.value.decode()

    def constraint_report(self) -> list[Report]:
        """What the last step made of each handle: a list of dicts as SwConstraintReport, by ascending id."""
        count = c_uint32()
        self._call("sw_state_constraint_report", None, sizeof(_abi.SwConstraintReport), 0, byref(count))
        found = (_abi.SwConstraintReport * max(count.value, 1))()
        self._call("sw_state_constraint_report", found, sizeof(_abi.SwConstraintReport), count.value, byref(count))
        return [as_dict(item) for item in found[:count.value]]

    def contacts(self) -> list[Report]:
        """Where it touched at the end of the last step: a list of dicts as SwContact."""
        count = c_uint32()
        self._call("sw_state_contacts", None, sizeof(_abi.SwContact), 0, byref(count))
        found = (_abi.SwContact * max(count.value, 1))()
        self._call("sw_state_contacts", found, sizeof(_abi.SwContact), count.value, byref(count))
        return [as_dict(item) for item in found[:count.value]]
