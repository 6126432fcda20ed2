"""A shell and its modes."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from ctypes import POINTER, byref, c_double, c_uint32, c_uint64, create_string_buffer, cast, c_void_p, sizeof

import numpy
from numpy.typing import ArrayLike, DTypeLike

from . import _abi, _arrays, _library
from ._handle import Handle
from ._types import Array, Buffer, Report
from ._values import as_dict, choice, guarded, uint32
from .collider import Collider
from .errors import CancelledError, UnsupportedError
from .mesh import Shell
from .method import DEFAULT, methods
from .proxy import Proxy
from .state import AXES, State

PRECISIONS = {"f32": _abi.SW_PRECISION_F32, "f64": _abi.SW_PRECISION_F64, "i16": _abi.SW_PRECISION_I16}
SHAPES = {"displacement": _abi.SW_SHAPE_DISPLACEMENT, "rotation": _abi.SW_SHAPE_ROTATION}
PHASES = {_abi.SW_PHASE_ASSEMBLY: "assembly", _abi.SW_PHASE_ORDERING: "ordering",
          _abi.SW_PHASE_FACTORIZATION: "factorization", _abi.SW_PHASE_MODES: "modes",
          _abi.SW_PHASE_CERTIFICATE: "certificate", _abi.SW_PHASE_ROTATION: "rotation",
          _abi.SW_PHASE_TRAINING: "training"}


class Model(Handle):
    """Made of a Shell; has modes after precompute and does not change any more then. Any number of states on any threads
    may share it, and states live on when it is closed."""

    _destroyer = "sw_model_destroy"

    def __init__(self, shell: Shell) -> None:
        mesh, mesh_arrays = shell.mesh_desc()
        material, maps = shell.material_desc()
        supports, support_arrays = shell.support_desc()
        pointer = POINTER(_abi.SwModel)()
        _library.call("sw_model_create", byref(mesh), byref(material), byref(supports), byref(pointer))
        del mesh_arrays, maps, support_arrays
        self._adopt(pointer)
        self.n_vertices = int(mesh.n_vertices)

    def calibrate(self, proxy: Proxy, held: ArrayLike = ()) -> Report:
        """Before precompute: fits the stiffness so that the model, which is of the proxy's mesh, answers as the asset would.

        Supports hold the vertices `held` of the asset; none are those that the proxy was made with. SwCalibrationInfo as a dict.
        """
        desc, info = _library.initialised(_abi.SwCalibrationDesc), _library.initialised(_abi.SwCalibrationInfo)
        vertices = _arrays.indices_in(held, "held")
        desc.held, desc.n_held = _arrays.address(vertices), len(vertices)
        with proxy._use() as pointer:
            self._call("sw_model_calibrate", pointer, byref(desc), byref(info))
        del vertices
        return as_dict(info)

    def precompute(self, modes: int = 16, precision: str = "f32", progress: "Callable[[str, float], bool | None] | None" = None,
                   sag_gravity: Sequence[float] = (0.0, 0.0, 0.0), reduced_fields: "int | None" = None, reduced_elements: int = 0,
                   reduced_poses: int = 0, reduced_trained: bool = True, reduced_gravity: float = 0.0, reduced_seconds: float = 0.0,
                   auto_error: float = 0.0, auto_operations: float = 0.0, demand_gravity: Sequence[float] = (0.0, 0.0, 0.0),
                   demand_acceleration: float = 0.0, handles: Sequence[int] = (), handle_distance: float = 0.0,
                   handle_axes: str = "xyz", handle_speed: float = 0.0, tolerance: float = 0.0,
                   demand_amplification: float = 0.0, contact_patches: Sequence[int] = (), support_fields: int = 0, auto: bool = False,
                   auto_full: bool = True) -> None:
        """Finds the `modes` lowest (0: 16); seconds on large meshes.

        `precision` is that of the run-time basis: "i16" takes half the memory of "f32" and moves vertices by about 1e-5 of the
        displacement; info()["basis_rounding"] gives the bound.

        With `sag_gravity`, an acceleration in frame axes, the modes are those of the shape that hangs at rest under it, and
        states begin there.

        A reduced shell is trained for the default method "auto", where the shell can have one, for up to half a minute; lacks("polynomial-shell")
        tells why where it cannot. `reduced_fields` says how many fields it has and that it must be; 0 is none, and "auto" is then the
        warp. With `auto` it may have so many. Where fields do not hold the shell "auto" is the full shell, up to 2,500 vertices, unless `auto_full` is False: a step then takes
        a hundredth of a second and more. It is trained on equilibria of the shell unless `reduced_trained` is False; the header tells of the others.

        With `auto_error`, a length, or `auto_operations` of a step, the model is made for the method that suits the scene of
        `demand_gravity`, `demand_acceleration` and `handles` that hold `handle_axes` and go `handle_distance` far best: that of its
        "auto" states.

        With a `tolerance`, a length, modes are left out that the same scene cannot show, at most `modes` of them computed (0: 256);
        `handle_speed` and `demand_amplification` as the header has them.

        With `support_fields`, say 24, modal methods follow supports that move against each other (State.move_supports).

        With `contact_patches`, vertices, the shell's static answers to a push along the normal there join the modes: for what touches it and is
        smaller than they are.

        `progress(phase, fraction)` is called with the phase's name and the fraction of it, 0 to 1. It may return False to
        stop (CancelledError). What it raises stops the precompute too and is raised here. On both the model stays as it was.
        """
        desc = _library.initialised(_abi.SwPrecomputeDesc)
        desc.modes, desc.precision = uint32(modes, "modes"), choice(PRECISIONS, precision, "precision")
        desc.sag_gravity[:] = [float(g) for g in sag_gravity]
        desc.flags = (_abi.SW_PRECOMPUTE_AUTO if auto or reduced_fields is None else 0) | (_abi.SW_PRECOMPUTE_AUTO_FULL if auto_full else 0)
        desc.reduced_fields = uint32(reduced_fields or 0, "reduced_fields")
        desc.reduced_elements = uint32(reduced_elements, "reduced_elements")
        desc.reduced_poses = uint32(reduced_poses, "reduced_poses")
        desc.reduced_flags = 0 if reduced_trained else _abi.SW_REDUCED_UNTRAINED
        desc.reduced_gravity, desc.reduced_seconds = float(reduced_gravity), float(reduced_seconds)
        desc.auto_error, desc.auto_operations = float(auto_error), float(auto_operations)
        desc.demand_gravity[:] = [float(g) for g in demand_gravity]
        desc.demand_acceleration, desc.handle_distance = float(demand_acceleration), float(handle_distance)
        desc.tolerance, desc.demand_amplification = float(tolerance), float(demand_amplification)
        desc.handle_speed = float(handle_speed)
        desc.handle_axes = sum(choice(AXES, axis, "handle_axes") for axis in set(handle_axes))
        held = (c_uint32 * len(handles))(*[uint32(v, "handles") for v in handles])
        desc.handles, desc.n_handles = cast(held, c_void_p), len(held)  # `held` lives through the call
        touched = (c_uint32 * len(contact_patches))(*[uint32(v, "contact_patches") for v in contact_patches])
        desc.contact_patches, desc.n_contact_patches = cast(touched, c_void_p), len(touched)
        desc.support_fields = uint32(support_fields, "support_fields")
        raised = []
        if progress is not None:
            desc.progress = _abi.SwProgressFn(guarded(lambda phase, fraction: progress(PHASES.get(phase, str(phase)), fraction), raised))
        try:
            self._call("sw_model_precompute", byref(desc))
        except CancelledError:
            if raised:
                raise raised[0] from None
            raise

    def patches_near(self, colliders: Sequence[Collider], distance: float, most: int = 16,
                     poses: "Sequence[tuple[Sequence[float], Sequence[float]]] | None" = None) -> "list[int]":
        """Vertices for contact_patches: where the shell is likely to be touched, by colliders at `poses`, pairs of an origin (3) and a rotation
        matrix (9, or () for none); None has all at the origin.

        Of the vertices that rest no farther than `distance` from a collider, the nearest, and then those farthest from each other, at most `most`.
        """
        numbers = [float(x) for origin, turn in poses or () for x in (*origin, *(turn or (0.0,) * 9))]
        if len(numbers) != (12 * len(colliders) if poses else 0):
            raise ValueError("poses has not an origin (3) and a rotation matrix (9, or ()) of each collider")
        places = (c_double * len(numbers))(*numbers) if numbers else None
        found, count = (c_uint32 * uint32(most, "most"))(), c_uint32()
        with ExitStack() as stack:
            pointers = [stack.enter_context(collider._use()) for collider in colliders]
            solids = (POINTER(_abi.SwCollider) * max(len(pointers), 1))(*pointers)
            self._call("sw_model_patches_near", solids, cast(places, c_void_p), len(pointers), float(distance), cast(found, c_void_p), most, byref(count))
        return list(found[:count.value])

    def save(self) -> bytes:
        """The precomputed model as bytes, for load: about 24 a vertex and mode, 48 with "f64", 12 with "i16"."""
        size = c_uint64()
        self._call("sw_model_save", None, 0, byref(size))
        data = create_string_buffer(size.value)
        self._call("sw_model_save", data, size.value, byref(size))
        return data.raw[:size.value]

    @classmethod
    def load(cls, data: Buffer) -> "Model":
        """The model that save wrote, with the same bits and no precompute; InvalidDataError on any other bytes."""
        data = bytes(data)
        pointer = POINTER(_abi.SwModel)()
        _library.call("sw_model_load", data, len(data), byref(pointer))
        model = cls.__new__(cls)
        model._adopt(pointer)
        model.n_vertices = model.info()["n_vertices"]
        return model

    def info(self) -> Report:
        """Counts, sizes, the certificate and timings: SwModelInfo as a dict."""
        info = _library.initialised(_abi.SwModelInfo)
        self._call("sw_model_info", byref(info))
        return as_dict(info)

    def front(self) -> list[Report]:
        """The methods that were tried for "auto": a list of dicts as SwFrontPoint."""
        count = c_uint32()
        self._call("sw_model_front", None, sizeof(_abi.SwFrontPoint), 0, byref(count))
        points = (_abi.SwFrontPoint * max(count.value, 1))()
        self._call("sw_model_front", points, sizeof(_abi.SwFrontPoint), count.value, byref(count))
        return [as_dict(point) for point in points[:count.value]]

    def frequencies(self) -> Array:
        """Frequencies in Hz, ascending (modes)."""
        count = c_uint32()
        self._call("sw_model_frequencies", None, 0, byref(count))
        hertz = numpy.empty(count.value)
        self._call("sw_model_frequencies", _arrays.address(hertz), count.value, byref(count))
        return hertz

    def mode_shape(self, mode: int, shape: str = "displacement", out: "Array | None" = None, dtype: DTypeLike = numpy.float64) -> Array:
        """One mode (n_vertices x 3), its "displacement" or "rotation" per unit amplitude."""
        out, form, stride = _arrays.vectors_out(out, (self.n_vertices, 3), dtype, "mode_shape")
        self._call("sw_model_mode_shape", uint32(mode, "mode"), choice(SHAPES, shape, "shape"), form,
                   _arrays.address(out), stride, self.n_vertices)
        return out

    def offers(self, method: str) -> bool:
        """Whether states of a method can be made on this model; `method` is a name of shellwarp.methods()."""
        return not self.lacks(method)

    def lacks(self, method: str) -> str:
        """Why states of a method cannot be made on this model, in the library's words; "" where they can."""
        try:
            self._call("sw_model_offers", choice(methods(), method, "method"))
        except UnsupportedError as error:
            return str(error)
        return ""

    def state(self, method: str = DEFAULT, integrator: str = "implicit-euler", deterministic: bool = False) -> State:
        """A new State at rest; a deterministic one gives the same bits on every processor, on one saved model."""
        return State(self, method, integrator, deterministic)
