"""A mesh to simulate in another's place."""

import operator
from ctypes import POINTER, byref

import numpy
from numpy.typing import ArrayLike

from . import _abi, _arrays, _library
from ._handle import Handle
from ._types import Array, Report
from ._values import as_dict
from .mesh import Shell


class Proxy(Handle):
    """A manifold of a wanted number of vertices with even triangles, whatever the asset is made of. Immutable.

    Simulate `positions` and `triangles`, and bind the asset's vertices to the model: Binding(model, asset_positions).
    """

    _destroyer = "sw_proxy_destroy"

    def __init__(self, positions: ArrayLike, triangles: ArrayLike, n_vertices: int, weld: float = 0.0, thickness: float = 0.0, cut: bool = False,
                 keep_sides: bool = False, keep_pieces: bool = False, held: ArrayLike = ()) -> None:
        """Of an asset: SwProxyDesc says what the options mean. The outline of the vertices `held` is kept."""
        mesh, kept = Shell(positions, triangles).mesh_desc()
        desc = _library.initialised(_abi.SwProxyDesc)
        desc.n_vertices, desc.weld, desc.thickness = operator.index(n_vertices), weld, thickness
        vertices = _arrays.indices_in(held, "held")
        desc.held, desc.n_held = _arrays.address(vertices), len(vertices)
        flags = ((cut, _abi.SW_PROXY_CUT), (keep_sides, _abi.SW_PROXY_KEEP_SIDES), (keep_pieces, _abi.SW_PROXY_KEEP_PIECES))
        desc.flags = sum(flag for asked, flag in flags if asked)
        pointer = POINTER(_abi.SwProxy)()
        _library.call("sw_proxy_create", byref(mesh), byref(desc), byref(pointer))
        del kept, vertices
        self._adopt(pointer)
        info = self.info()
        self.n_vertices, self.n_triangles = int(info["n_vertices"]), int(info["n_triangles"])
        self.n_asset_vertices = int(info["n_asset_vertices"])

    def info(self) -> Report:
        """What was done: SwProxyInfo as a dict."""
        info = _library.initialised(_abi.SwProxyInfo)
        self._call("sw_proxy_info", byref(info))
        return as_dict(info)

    def positions(self) -> Array:
        """(n_vertices x 3), in the asset's axes and lengths."""
        out = numpy.empty((self.n_vertices, 3))
        self._call("sw_proxy_positions", _abi.SW_FORMAT_F64, _arrays.address(out), 0, self.n_vertices)
        return out

    def triangles(self) -> Array:
        """(n_triangles x 3)."""
        out = numpy.empty((self.n_triangles, 3), numpy.uint32)
        self._call("sw_proxy_triangles", _arrays.address(out), self.n_triangles)
        return out

    def sources(self) -> tuple[Array, Array]:
        """Of each vertex, three vertices of the asset and their weights (n_vertices x 3 each)."""
        vertices, weights = numpy.empty((self.n_vertices, 3), numpy.uint32), numpy.empty((self.n_vertices, 3))
        self._call("sw_proxy_sources", _arrays.address(vertices), _arrays.address(weights), self.n_vertices)
        return vertices, weights

    def carried(self, values: ArrayLike) -> Array:
        """Values at the asset's vertices (n_asset_vertices, ...) at the proxy's: painted maps, colours, weights."""
        vertices, weights = self.sources()
        return numpy.einsum("vk...,vk->v...", numpy.asarray(values, float)[vertices], weights)

    def nearest(self) -> Array:
        """Of each vertex of the asset, the nearest of the proxy."""
        out = numpy.empty(self.n_asset_vertices, numpy.uint32)
        self._call("sw_proxy_nearest", _arrays.address(out), self.n_asset_vertices)
        return out
