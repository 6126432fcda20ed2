"""Reading triangle meshes from OBJ files, values for their vertices, and normals to shade them by."""

from pathlib import Path

import numpy as np

CREASE = np.cos(np.radians(35.0))   # neighbouring triangles that meet more sharply are shaded as an edge


class RenderError(Exception):
    """A message for the person at the keyboard."""


def read_text(path):
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise RenderError(f"cannot read {path}: {error.strerror}") from None


def read_obj(path):
    """Vertices (n x 3) and triangles (m x 3, from 0) of an OBJ file; polygons become fans; all but v and f is skipped."""
    points, faces = [], []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        words = line.split()
        if words and words[0] == "v":
            points.append((number, words[1:4]))
        elif words and words[0] == "f":
            faces.append((number, len(points), words[1:]))
    if not points or not faces:
        raise RenderError(f"{path}: no {'faces' if points else 'vertices'} found; is it an OBJ mesh?")
    return parse_points(path, points), parse_faces(path, faces, len(points))


def parse_points(path, points):
    try:
        vertices = np.array([words for _, words in points], dtype=np.float64)
        if vertices.ndim == 2 and vertices.shape[1] == 3 and np.isfinite(vertices).all():
            return vertices
    except ValueError:
        pass
    for index, (number, words) in enumerate(points, 1):
        try:
            good = len(words) == 3 and np.isfinite([float(word) for word in words]).all()
        except ValueError:
            good = False
        if not good:
            break
    raise RenderError(f"{path}:{number}: vertex {index} needs three finite numbers, found '{' '.join(words)}'")


def parse_faces(path, faces, count):
    """Triangles; a corner is v, v/vt, v//vn or v/vt/vn, and a negative v counts back from the vertices read so far."""
    triangles = []
    for number, so_far, corners in faces:
        try:
            loop = [int(corner.split("/", 1)[0]) for corner in corners]
        except ValueError:
            raise RenderError(f"{path}:{number}: cannot read the face '{' '.join(corners)}'") from None
        loop = [index - 1 if index > 0 else so_far + index if index < 0 else -1 for index in loop]
        if len(loop) < 3:
            raise RenderError(f"{path}:{number}: a face needs three corners, found {len(loop)}")
        if min(loop) < 0 or max(loop) >= count:
            raise RenderError(f"{path}:{number}: face '{' '.join(corners)}' names a vertex outside 1..{count}")
        triangles.extend((loop[0], b, c) for b, c in zip(loop[1:], loop[2:]))
    return np.array(triangles)


def read_values(path, count):
    """One number for each vertex, white space between."""
    try:
        values = np.array(read_text(path).split(), dtype=np.float64)
    except ValueError as error:
        raise RenderError(f"{path}: {error}") from None
    if len(values) != count or not np.isfinite(values).all():
        raise RenderError(f"{path}: {count} finite numbers are needed, one for each vertex; found {len(values)}")
    return values


def corner_normals(vertices, triangles):
    """Normals (m x 3 x 3), smooth except across creases: each corner averages, by area, the triangles it continues into."""
    edge = vertices[triangles]
    area = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    order = np.argsort(triangles.ravel(), kind="stable")
    owner = triangles.ravel()[order]
    valence = np.bincount(owner, minlength=len(vertices))
    slot = np.arange(len(owner)) - (np.cumsum(valence) - valence)[owner]
    around = np.full((len(vertices), valence.max()), -1)
    around[owner, slot] = order // 3
    normals = np.zeros(triangles.shape + (3,))
    for k in range(valence.max()):
        other = around[triangles, k]
        smooth = (other >= 0) & (np.einsum("fd,fcd->fc", unit, unit[other]) > CREASE)
        normals += np.where(smooth[..., None], area[other], 0.0)
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-300), unit[:, None])
