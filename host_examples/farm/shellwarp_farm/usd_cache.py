"""USD layers: one mesh whose points have a time sample for each frame. Needs usd-core."""

import numpy


class UsdFile:
    """Written frame by frame; time codes are frame numbers."""

    def __init__(self, path, name, faces, frames, frame_rate, up_axis):
        """`faces`: the vertices of each, any number of them."""
        from pxr import Usd, UsdGeom, Vt
        self._vectors = Vt.Vec3fArray.FromNumpy
        self._stage = Usd.Stage.CreateNew(str(path))
        self._stage.SetStartTimeCode(frames[0])
        self._stage.SetEndTimeCode(frames[-1])
        self._stage.SetTimeCodesPerSecond(frame_rate)
        self._stage.SetFramesPerSecond(frame_rate)
        UsdGeom.SetStageUpAxis(self._stage, up_axis.upper())
        mesh = UsdGeom.Mesh.Define(self._stage, "/" + "".join(c if c.isalnum() else "_" for c in "shell_" + name))
        self._stage.SetDefaultPrim(mesh.GetPrim())
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([len(face) for face in faces]))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray([int(vertex) for face in faces for vertex in face]))
        self._points, self._extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
        self._frames = iter(frames)

    def append(self, positions):
        """The next frame, (n_points x 3) float32."""
        frame = next(self._frames)
        self._points.Set(self._vectors(positions), frame)
        self._extent.Set(self._vectors(numpy.stack([positions.min(axis=0), positions.max(axis=0)])), frame)

    def close(self):
        self._stage.GetRootLayer().Save()
        self._stage = None
