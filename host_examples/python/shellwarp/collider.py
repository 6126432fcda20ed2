"""Solids that shells touch."""

from ctypes import POINTER, byref, c_uint64, create_string_buffer

from numpy.typing import ArrayLike

from . import _abi, _arrays, _library
from ._handle import Handle
from ._types import Buffer, Report
from ._values import as_dict, uint32
from .mesh import Shell


class Collider(Handle):
    """An immutable solid in axes of its own, for any number of states. Made by plane, sphere, capsule, box, hull or mesh."""

    _destroyer = "sw_collider_destroy"

    def __init__(self, kind: int, friction: float = 0.0, thickness: float = 0.0, radius: float = 0.0,
                 half_length: float = 0.0, half_extents: ArrayLike = (0, 0, 0), shape: "Shell | None" = None, cells: int = 0, one_sided: bool = False,
                 depth: float = 0.0) -> None:
        desc = _library.initialised(_abi.SwColliderDesc)
        desc.kind, desc.friction, desc.thickness = kind, friction, thickness
        desc.radius, desc.half_length = radius, half_length
        desc.flags, desc.depth = _abi.SW_COLLIDER_ONE_SIDED if one_sided else 0, depth
        desc.half_extents[:] = _arrays.numbers_in(half_extents, "half_extents", 3).tolist()
        if shape is not None:
            mesh, _kept = shape.mesh_desc()
            desc.mesh, desc.cells = POINTER(_abi.SwMeshDesc)(mesh), uint32(cells, "cells")
        pointer = POINTER(_abi.SwCollider)()
        _library.call("sw_collider_create", byref(desc), byref(pointer))
        self._adopt(pointer)

    @classmethod
    def plane(cls, friction: float = 0.0, thickness: float = 0.0) -> "Collider":
        """The half-space z <= 0."""
        return cls(_abi.SW_COLLIDER_PLANE, friction, thickness)

    @classmethod
    def sphere(cls, radius: float, friction: float = 0.0, thickness: float = 0.0) -> "Collider":
        """A ball about the origin."""
        return cls(_abi.SW_COLLIDER_SPHERE, friction, thickness, radius=radius)

    @classmethod
    def capsule(cls, half_length: float, radius: float, friction: float = 0.0, thickness: float = 0.0) -> "Collider":
        """All points within `radius` of the segment from -half_length to half_length along z."""
        return cls(_abi.SW_COLLIDER_CAPSULE, friction, thickness, radius=radius, half_length=half_length)

    @classmethod
    def box(cls, half_extents: ArrayLike, friction: float = 0.0, thickness: float = 0.0) -> "Collider":
        """A box about the origin, half as long along each axis to either side (3)."""
        return cls(_abi.SW_COLLIDER_BOX, friction, thickness, half_extents=half_extents)

    @classmethod
    def hull(cls, points: ArrayLike, friction: float = 0.0, thickness: float = 0.0) -> "Collider":
        """The convex hull of points (n x 3)."""
        return cls(_abi.SW_COLLIDER_HULL, friction, thickness, shape=Shell(points, [[0, 0, 0]]))

    @classmethod
    def mesh(cls, positions: ArrayLike, triangles: ArrayLike, friction: float = 0.0, thickness: float = 0.0, cells: int = 0,
             one_sided: bool = False, depth: float = 0.0) -> "Collider":
        """The inside of a closed mesh (n x 3, m x 3), by distances on a grid of `cells` along its longest side; 0 for 64. One that is one-sided may be
        open: it is solid behind its triangles by `depth`, 0 for four cells."""
        return cls(_abi.SW_COLLIDER_MESH, friction, thickness, shape=Shell(positions, triangles), cells=cells, one_sided=one_sided, depth=depth)

    @classmethod
    def deforming(cls, positions: ArrayLike, triangles: ArrayLike, friction: float = 0.0, thickness: float = 0.0, one_sided: bool = False,
                  depth: float = 0.0) -> "Collider":
        """The inside of a closed mesh (n x 3, m x 3) whose vertices State.deform_collider moves. One that is one-sided may be open: it is solid behind
        its triangles by `depth`, 0 for a 16th of its longest side."""
        return cls(_abi.SW_COLLIDER_DEFORMING_MESH, friction, thickness, shape=Shell(positions, triangles), one_sided=one_sided, depth=depth)

    @staticmethod
    def fit_capsule(points: ArrayLike) -> Report:
        """A small capsule about points (n x 3): radius, half_length, origin (3) and rotation (9), for capsule and move_collider."""
        points, form, stride = _arrays.vectors_in(points, "points")
        fit = _library.initialised(_abi.SwCapsuleFit)
        _library.call("sw_fit_capsule", form, _arrays.address(points), stride, len(points), byref(fit))
        return as_dict(fit)

    def save(self) -> bytes:
        """As bytes, for load: a mesh need not be prepared again."""
        size = c_uint64()
        self._call("sw_collider_save", None, 0, byref(size))
        data = create_string_buffer(size.value)
        self._call("sw_collider_save", data, size.value, byref(size))
        return data.raw[:size.value]

    @classmethod
    def load(cls, data: Buffer) -> "Collider":
        """What save gave."""
        data = bytes(data)
        pointer = POINTER(_abi.SwCollider)()
        _library.call("sw_collider_load", data, len(data), byref(pointer))
        made = cls.__new__(cls)
        made._adopt(pointer)
        return made
