"""What a model is made of: plain data, which can be pickled and sent to other processes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from ctypes import byref, c_uint32, sizeof
from typing import Any

import numpy
from numpy.typing import ArrayLike

from . import _abi, _arrays, _library
from ._types import Array
from .errors import InvalidArgumentError


QUANTITIES = {"k_area": _abi.SW_MAP_K_AREA, "k_length": _abi.SW_MAP_K_LENGTH, "k_bend": _abi.SW_MAP_K_BEND,
              "area_density": _abi.SW_MAP_AREA_DENSITY, "young": _abi.SW_MAP_YOUNG, "thickness": _abi.SW_MAP_THICKNESS,
              "volume_density": _abi.SW_MAP_VOLUME_DENSITY, "growth": _abi.SW_MAP_GROWTH}


@dataclass(frozen=True)
class Material:
    """The paper's constants, of SwMaterialDesc. A stiffness of 0 is one of 0; not all three can be, nor the density."""

    area: float = 1e4      # k_A, energy per area
    length: float = 1e4    # k_L, energy per length
    bend: float = 1.0      # k_B, energy
    density: float = 1.0   # mass per area

    def desc(self) -> _abi.SwMaterialDesc:
        desc = _library.initialised(_abi.SwMaterialDesc)
        if not (self.area or self.length or self.bend):  # which the library takes for its defaults, as it does a density of 0
            raise InvalidArgumentError("area, length and bend are all 0, so that nothing resists anything: give one, or leave all out for the defaults")
        if not self.density:
            raise InvalidArgumentError("density is 0: it must be above 0")
        desc.k_area, desc.k_length, desc.k_bend, desc.area_density = self.area, self.length, self.bend, self.density
        return desc


@dataclass(frozen=True)
class Sheet:
    """A material in engineering units, SW_ENERGY_KOITER: of it every mesh makes the same shell. All four must be given."""

    young: float           # E, force per area: Pa with metres and kilograms
    poisson: float         # above -1 and at most 0.5
    thickness: float       # a length
    volume_density: float  # mass per volume
    young_across: float = 0.0  # E across Shell.directions, where `young` is that along and `poisson` what stretching along takes away across; 0: isotropic
    shear: float = 0.0     # G between the two; 0: Huber's estimate
    metres_per_unit: float = 1.0  # in whose unit the numbers are: 0.01 for centimetres, where `young` is in kg/(cm s^2). For warnings alone

    @classmethod
    def known(cls, name: str, metres_per_unit: float = 1.0) -> "Sheet":
        """The sheet of a name in presets(), such as "card", for a mesh whose unit has this length."""
        names = list(presets())
        if name not in names:
            raise InvalidArgumentError(f"no known material is called {name!r}; there are {', '.join(names)}")
        desc = _library.initialised(_abi.SwMaterialDesc)
        _library.call("sw_preset_material", names.index(name), float(metres_per_unit), byref(desc))
        return cls(desc.young, desc.poisson, desc.thickness, desc.volume_density, metres_per_unit=float(metres_per_unit))

    def desc(self) -> _abi.SwMaterialDesc:
        desc = _library.initialised(_abi.SwMaterialDesc)
        desc.energy, desc.young, desc.poisson = _abi.SW_ENERGY_KOITER, self.young, self.poisson
        desc.thickness, desc.volume_density = self.thickness, self.volume_density
        desc.young_across, desc.shear = self.young_across, self.shear
        return desc


def presets() -> dict[str, tuple[str, str]]:
    """Label and source of each known material, by its name."""
    library = _library.load()
    texts = (library.sw_preset_name, library.sw_preset_label, library.sw_preset_source)
    rows = [[text(index).decode() for text in texts] for index in range(library.sw_preset_count())]
    return {name: (label, source) for name, label, source in rows}


@dataclass(frozen=True, eq=False)
class Shell:
    """A mesh at rest, its material (Material or Sheet), and the vertices that hold it."""

    positions: ArrayLike                                       # (n_vertices x 3), float32 or float64, any row stride
    triangles: ArrayLike                                       # (n_triangles x 3), vertex indices from 0
    material: "Material | Sheet" = field(default_factory=Material)
    fixed: ArrayLike = ()                                      # vertices held in place
    clamped: ArrayLike = ()                                    # held with their slope; of a Material by all their edge neighbours
    maps: Mapping[str, ArrayLike] = field(default_factory=dict)  # values of a material's constant, by its name: a vertex or a triangle each; and "growth", length without stress over that of the mesh or rest_positions
    creases: "Sequence[tuple[Any, ...]]" = ()   # (a, b[, factor[, angle[, yield]]]): edges of another stiffness or rest angle, rad, None as the mesh has it; and how far from that they spring back, rad
    rest_positions: "ArrayLike | None" = None   # the shape without stress (n_vertices x 3), where it is not `positions`
    directions: "ArrayLike | None" = None       # along which a Sheet with young_across has `young`: one (3), or one a triangle (n_triangles x 3)
    ties: "Sequence[tuple[Any, ...]]" = ()      # (a, b) or (a, b, stiffness): vertex a held where it is beside vertex b; stiff without a stiffness
    triangle_ties: "Sequence[tuple[Any, ...]]" = ()  # (a, t) or (a, t, stiffness): the same beside triangle t
    tie_distance: float = 0.0                   # pieces within this distance of each other are tied, stiffly
    axes: "Mapping[int, str | ArrayLike]" = field(default_factory=dict)  # held along axes alone: "xz", or a direction, or some of them, by vertex
    symmetric: "Mapping[int, str | ArrayLike]" = field(default_factory=dict)  # the same on planes of symmetry, by their normals: held along them, and so is the slope
    metres_per_unit: "float | None" = None      # of lengths: 1, 0.01 for centimetres; 0: not told; None: a Sheet's own, and of a Material not told. A wrong unit, or GPa for Pa, then shows in a warning and in info()
    rest_lengths: "Mapping[tuple[int, int], float]" = field(default_factory=dict)  # without stress, of edges (a, b) that have another than in `positions` or `rest_positions`

    def mesh_desc(self) -> tuple[_abi.SwMeshDesc, tuple[Array, ...]]:
        """The SwMeshDesc and the arrays that it points into, which must outlive it."""
        positions, form, stride = _arrays.vectors_in(self.positions, "positions")
        triangles = _arrays.indices_in(self.triangles, "triangles", 3)
        desc = _library.initialised(_abi.SwMeshDesc)
        desc.positions, desc.position_format, desc.position_stride = _arrays.address(positions), form, stride
        desc.triangles, desc.n_vertices, desc.n_triangles = _arrays.address(triangles), len(positions), len(triangles)
        return desc, (positions, triangles)

    def material_desc(self) -> tuple[_abi.SwMaterialDesc, tuple[Any, ...]]:
        """The SwMaterialDesc and what it points into, which must outlive it."""
        desc = self.material.desc()
        own = self.material.metres_per_unit if isinstance(self.material, Sheet) else 0.0
        desc.metres_per_unit = own if self.metres_per_unit is None else self.metres_per_unit
        maps = (_abi.SwMaterialMap * len(self.maps))()
        kept: list[Any] = [maps]
        for item, (name, given) in zip(maps, self.maps.items()):
            if name not in QUANTITIES:
                raise InvalidArgumentError(f"maps: no constant is called {name!r}; there are {', '.join(QUANTITIES)}")
            values = numpy.ascontiguousarray(given, dtype=numpy.float64)
            counts = {numpy.shape(self.positions)[:1]: _abi.SW_MAP_ON_VERTICES, numpy.shape(self.triangles)[:1]: _abi.SW_MAP_ON_TRIANGLES}
            if len(counts) < 2:
                raise InvalidArgumentError("maps: the mesh has as many vertices as triangles, so that what a map is on cannot be told")
            if values.shape not in counts:
                raise InvalidArgumentError(f"maps: {name} has the shape {values.shape}, expected one of {', '.join(map(str, counts))}")
            kept.append(values)
            item.struct_size, item.quantity, item.on = sizeof(_abi.SwMaterialMap), QUANTITIES[name], counts[values.shape]
            item.format, item.values, item.count = _abi.SW_FORMAT_F64, _arrays.address(values), len(values)
        desc.maps, desc.n_maps = (maps if self.maps else None), len(self.maps)
        kept += self._creases(desc) + self._ties(desc) + self._rest_lengths(desc)
        if self.rest_positions is not None:
            rest, desc.rest_format, desc.rest_stride = _arrays.vectors_in(self.rest_positions, "rest_positions")
            if len(rest) != len(self.positions):  # type: ignore[arg-type]
                raise InvalidArgumentError(f"rest_positions: {len(rest)} rows, the mesh has {len(self.positions)} vertices")  # type: ignore[arg-type]
            desc.rest_positions = _arrays.address(rest)
            kept.append(rest)
        if self.directions is not None:
            directions, desc.direction_format, desc.direction_stride = _arrays.vectors_in(numpy.atleast_2d(self.directions), "directions")
            desc.directions, desc.n_directions = _arrays.address(directions), len(directions)
            kept.append(directions)
        return desc, tuple(kept)

    def _creases(self, desc: _abi.SwMaterialDesc) -> list[Any]:
        """Puts them into the descriptor; what it points into."""
        if not len(self.creases):
            return []
        if any(not 2 <= len(crease) <= 5 for crease in self.creases):
            raise InvalidArgumentError("creases: each is (a, b), (a, b, factor), (a, b, factor, angle) or (a, b, factor, angle, yield)")
        ends = _arrays.indices_in([crease[:2] for crease in self.creases], "creases", 2)
        factors = numpy.array([crease[2] if len(crease) > 2 else 1.0 for crease in self.creases], dtype=numpy.float64)
        of_mesh = _abi.SW_CREASE_ANGLE_OF_MESH
        angles = numpy.array([of_mesh if len(crease) < 4 or crease[3] is None else crease[3] for crease in self.creases], dtype=numpy.float64)
        yields = numpy.array([crease[4] if len(crease) > 4 else numpy.inf for crease in self.creases], dtype=numpy.float64)
        desc.creases, desc.n_creases = _arrays.address(ends), len(ends)
        desc.crease_factors, desc.crease_angles, desc.crease_yields = (_arrays.address(numbers) for numbers in (factors, angles, yields))
        return [ends, factors, angles, yields]

    def _rest_lengths(self, desc: _abi.SwMaterialDesc) -> list[Any]:
        """Puts them into the descriptor; what it points into."""
        if not self.rest_lengths:
            return []
        ends = _arrays.indices_in(list(self.rest_lengths), "rest_lengths", 2)
        lengths = numpy.array(list(self.rest_lengths.values()), dtype=numpy.float64)
        desc.length_edges, desc.rest_lengths, desc.n_rest_lengths = _arrays.address(ends), _arrays.address(lengths), len(ends)
        return [ends, lengths]

    def _ties(self, desc: _abi.SwMaterialDesc) -> list[Any]:
        """Puts them into the descriptor; what it points into."""
        desc.tie_distance = self.tie_distance
        both = [(tie, False) for tie in self.ties] + [(tie, True) for tie in self.triangle_ties]
        if not both:
            return []
        if any(not 2 <= len(tie) <= 3 for tie, _ in both):
            raise InvalidArgumentError("ties: each is (a, b) or (a, b, stiffness)")
        ends = _arrays.indices_in([tie[:2] for tie, _ in both], "ties", 2)
        on_triangles = numpy.array([on for _, on in both], dtype=numpy.uint8)
        stiffness = numpy.array([tie[2] if len(tie) > 2 else 0.0 for tie, _ in both], dtype=numpy.float64)
        desc.ties, desc.n_ties = _arrays.address(ends), len(ends)
        desc.tie_on_triangles, desc.tie_stiffness = _arrays.address(on_triangles), _arrays.address(stiffness)
        return [ends, on_triangles, stiffness]

    def support_desc(self) -> tuple[_abi.SwSupportDesc, tuple[Array, ...]]:
        """The SwSupportDesc and the arrays that it points into, which must outlive it."""
        fixed, clamped = _arrays.indices_in(self.fixed, "fixed"), _arrays.indices_in(self.clamped, "clamped")
        desc = _library.initialised(_abi.SwSupportDesc)
        desc.fixed, desc.n_fixed = _arrays.address(fixed), len(fixed)
        desc.clamped, desc.n_clamped = _arrays.address(clamped), len(clamped)
        rows = [(int(v), *row) for v, held in self.axes.items() for row in _held_along(held, "axes")]
        planes = [(int(v), *row) for v, held in self.symmetric.items() for row in _held_along(held, "symmetric")]
        along = _arrays.indices_in([row[0] for row in rows + planes], "axes")
        axes = numpy.array([row[1] for row in rows + planes], dtype=numpy.uint8)
        symmetric = numpy.array([0] * len(rows) + [row[1] or _abi.SW_AXIS_DIRECTION for row in planes], dtype=numpy.uint8)
        directions = numpy.array([row[2] for row in rows + planes], dtype=numpy.float64).reshape(-1, 3)
        desc.axis_vertices, desc.n_axis_vertices = _arrays.address(along), len(along)
        desc.axes, desc.axis_directions = _arrays.address(axes), _arrays.address(directions)
        desc.symmetric_axes = _arrays.address(symmetric)
        return desc, (fixed, clamped, along, axes, directions, symmetric)


def _held_along(held: Any, name: str) -> "list[tuple[int, tuple[float, ...]]]":
    """Axes as bits and a direction, of each thing that a vertex is held along."""
    if isinstance(held, str):
        if not held or set(held) - set("xyz"):
            raise InvalidArgumentError(f"{name}: {held!r} is not some of the letters xyz")
        return [(sum(1 << "xyz".index(letter) for letter in set(held)), (0.0, 0.0, 0.0))]
    directions = numpy.asarray(held, dtype=numpy.float64)
    if directions.ndim not in (1, 2) or directions.shape[-1] != 3 or not directions.any(axis=-1).all():
        raise InvalidArgumentError(f"{name}: {held!r} is neither some of the letters xyz nor directions, which are not zero")
    return [(0, tuple(row)) for row in directions.reshape(-1, 3)]


def directions_of_uvs(positions: ArrayLike, triangles: ArrayLike, uvs: ArrayLike) -> Array:
    """The direction in which u grows (n_triangles x 3), for Shell.directions; uvs are of vertices (n_vertices x 2) or of corners (n_triangles x 3 x 2)."""
    x, t, uv = numpy.asarray(positions, float), numpy.asarray(triangles), numpy.asarray(uvs, float)
    if uv.shape not in ((len(x), 2), (len(t), 3, 2)):
        raise InvalidArgumentError(f"uvs: the shape is {uv.shape}, expected ({len(x)}, 2) of vertices or ({len(t)}, 3, 2) of corners")
    corners = uv if uv.ndim == 3 else uv[t]
    (first, second), (du, dv) = (x[t[:, k]] - x[t[:, 0]] for k in (1, 2)), (corners[:, k] - corners[:, 0] for k in (1, 2))
    area = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
    if not numpy.all(area != 0):
        raise InvalidArgumentError(f"uvs: those of triangle {numpy.flatnonzero(~(area != 0))[0]} are on a line, so that no direction follows")
    along = (first * dv[:, 1:] - second * du[:, 1:]) * numpy.sign(area)[:, None]
    return along / numpy.linalg.norm(along, axis=1, keepdims=True)


@dataclass(frozen=True)
class Diagnostic:
    """One located problem of a mesh."""

    kind: int          # SW_DIAGNOSTIC_...
    is_error: bool     # the mesh is refused; else it is handled
    element: int       # triangle or vertex, as the kind says
    vertices: tuple[int, ...]   # those concerned
    message: str


def check_mesh(positions: ArrayLike, triangles: ArrayLike) -> list[Diagnostic]:
    """Every problem of a mesh as a list of Diagnostic, errors first; empty when it is sound."""
    desc, kept = Shell(positions, triangles).mesh_desc()
    count = c_uint32()
    _library.call("sw_mesh_check", byref(desc), None, sizeof(_abi.SwDiagnostic), 0, byref(count))
    found = (_abi.SwDiagnostic * max(count.value, 1))()
    _library.call("sw_mesh_check", byref(desc), found, sizeof(_abi.SwDiagnostic), count.value, byref(count))
    del kept
    return [_diagnostic(item) for item in found[:count.value]]


def _diagnostic(item):
    vertices = tuple(v for v in item.vertices if v != 0xFFFFFFFF)
    return Diagnostic(item.kind, item.severity == _abi.SW_SEVERITY_ERROR, item.element, vertices,
                      item.message.decode("utf-8", "replace"))
