"""Real-time thin shells by modal warping: a thin layer over the C library, numpy arrays in and out.

    shell = Shell(positions, triangles, Sheet.known("card"), clamped=[0, 1, 2])   # in metres
    with Model(shell) as model:
        model.precompute(modes=16)
        with model.state() as state:
            state.set_gravity([0, 0, -9.8])
            state.step(1 / 30)
            points = state.positions()

Every name, unit and rule is that of include/shellwarp.h, which says more about each. Failures raise ShellwarpError, whose
text is the library's own message. Calls release Python's global lock, so states step in parallel on threads; one state
belongs to one thread at a time, and a violation raises BusyError. What the library warns of is a ShellwarpWarning.
"""

from . import _abi as abi
from . import look, method
from .binding import Binding
from .collider import Collider
from ._library import library_path, load, version
from .errors import (BusyError, CancelledError, InternalError, InvalidArgumentError, InvalidDataError, InvalidMeshError,
                     LibraryNotFoundError, NotPrecomputedError, NumericalError, OutOfMemoryError, ShellwarpError,
                     ShellwarpWarning, UnsupportedError)
from .log import set_log
from .mesh import Diagnostic, Material, Sheet, Shell, check_mesh, directions_of_uvs, presets
from .method import Method, methods
from .model import Model
from .proxy import Proxy
from .state import State

__all__ = ["Binding", "BusyError", "CancelledError", "Collider", "Diagnostic", "InternalError", "InvalidArgumentError", "InvalidDataError",
           "InvalidMeshError", "LibraryNotFoundError", "Material", "Method", "Model", "NotPrecomputedError", "NumericalError", "OutOfMemoryError",
           "Proxy", "Sheet", "Shell", "ShellwarpError", "ShellwarpWarning", "State", "UnsupportedError", "abi", "check_mesh", "directions_of_uvs", "library_path", "load", "look", "method", "methods", "presets", "set_log", "version"]
