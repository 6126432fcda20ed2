"""USD layers: one mesh whose points, normals, velocities and extent have a sample for each frame. Needs usd-core."""

import numpy


class UsdFile:
    """Written frame by frame; time codes are frame numbers. Of a mesh that an asset has, a layer that lies over the asset's prim."""

    def __init__(self, path, name, drawn, triangles, frames, frame_rate, up_axis, metres_per_unit):
        """`drawn` is what read_drawn gave, `triangles` are its faces cut."""
        from pxr import Usd, UsdGeom
        self._triangles, self._frames = triangles, iter(frames)
        self._stage = Usd.Stage.CreateNew(str(path))
        self._stage.SetStartTimeCode(frames[0])
        self._stage.SetEndTimeCode(frames[-1])
        self._stage.SetTimeCodesPerSecond(frame_rate)
        self._stage.SetFramesPerSecond(frame_rate)
        asset = drawn.asset
        UsdGeom.SetStageUpAxis(self._stage, asset.up_axis if asset and asset.up_axis else up_axis.upper())
        UsdGeom.SetStageMetersPerUnit(self._stage, asset.metres_per_unit if asset and asset.metres_per_unit else metres_per_unit)
        mesh = self._over(asset) if asset else self._define(name, drawn)
        self._stage.SetDefaultPrim(self._stage.GetPrimAtPath(mesh.GetPath().GetPrefixes()[0]))
        self._mesh, self._points, self._extent, self._normals = mesh, mesh.CreatePointsAttr(), mesh.CreateExtentAttr(), None
        if len(triangles) and not (asset and asset.subdivided):   # of subdivided meshes normals count for nothing
            self._normals = mesh.CreateNormalsAttr()
            mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)

    def _define(self, name, drawn):
        from pxr import Sdf, UsdGeom, Vt
        mesh = UsdGeom.Mesh.Define(self._stage, "/" + "".join(c if c.isascii() and c.isalnum() else "_" for c in "shell_" + name))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([len(face) for face in drawn.faces]))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray([int(vertex) for face in drawn.faces for vertex in face]))
        if drawn.uvs is not None:
            uvs = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
            uvs.Set(Vt.Vec2fArray.FromNumpy(drawn.uvs.astype(numpy.float32)))
            uvs.SetIndices(Vt.IntArray.FromNumpy(drawn.corner_uvs.astype(numpy.int32)))
        return mesh

    def _over(self, asset):
        """The asset has faces, texture coordinates and look; its transforms are left out, as the points stand in the world."""
        from pxr import Sdf, UsdGeom, Vt
        mesh = UsdGeom.Mesh(self._stage.OverridePrim(asset.prim))
        mesh.GetPrim().CreateAttribute("xformOpOrder", Sdf.ValueTypeNames.TokenArray, False, Sdf.VariabilityUniform).Set(Vt.TokenArray(["!resetXformStack!"]))
        if asset.has_normals:   # which would go before ours
            mesh.GetPrim().CreateAttribute("primvars:normals", Sdf.ValueTypeNames.Normal3fArray, False).Block()
        return mesh

    def append(self, positions, velocities=None):
        """The next frame, each (n_points x 3) float32."""
        from pxr import Vt
        vectors, frame = Vt.Vec3fArray.FromNumpy, next(self._frames)
        self._points.Set(vectors(positions), frame)
        if velocities is not None:
            self._mesh.CreateVelocitiesAttr().Set(vectors(velocities), frame)
        self._extent.Set(vectors(numpy.stack([positions.min(axis=0), positions.max(axis=0)])), frame)
        if self._normals:
            self._normals.Set(vectors(vertex_normals(positions, self._triangles)), frame)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._stage = None   # closed before, unless there was an error, after which nothing is saved

    def close(self):
        self._stage.GetRootLayer().Save()
        self._stage = None


def vertex_normals(positions, triangles):
    """Unit normals of vertices (n x 3, float32), by the areas of the triangles around; z where there is none."""
    corners = positions.astype(numpy.float64)[triangles]
    across = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = numpy.zeros(positions.shape)
    for k in range(3):
        numpy.add.at(sums, triangles[:, k], across)
    lengths = numpy.linalg.norm(sums, axis=1, keepdims=True)
    return numpy.where(lengths > 0, sums / numpy.where(lengths > 0, lengths, 1), (0.0, 0.0, 1.0)).astype(numpy.float32)
