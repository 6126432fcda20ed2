"""Quick pictures without the renderer: triangles by a depth buffer, smooth normals, a soft shadow on the ground. numpy and Pillow only."""

import numpy as np
from PIL import Image, ImageFilter

SKY, GROUND = np.array([238, 241, 245.0]), np.array([219, 225, 234.0])
FINER = 2                    # each way: edges are averaged
SUN = np.array([-0.5, 1.0, 0.45])   # right, up, toward the viewer
FIELD_OF_VIEW = np.radians(26.0)


class View:
    """Looks at the middle of a box from a direction, far enough off that all its corners are in the picture."""

    def __init__(self, low, high, size, azimuth=30.0, elevation=16.0, up=1, margin=1.12):
        axis = np.eye(3)[[2, 0, 1] if up == 1 else [0, 1, 2] if up == 2 else [1, 2, 0]]   # forward, right, up of azimuth 0
        a, e = np.radians([azimuth, elevation])
        flat = np.cos(a) * axis[0] + np.sin(a) * axis[1]
        self.back = np.cos(e) * flat + np.sin(e) * axis[2]
        self.right = np.cross(axis[2], self.back)
        self.right /= np.linalg.norm(self.right)
        self.above, self.up = np.cross(self.back, self.right), axis[2]
        self.width, self.height = FINER * size[0], FINER * size[1]
        corners = np.array([[(low, high)[k >> c & 1][c] for c in range(3)] for k in range(8)])
        self.middle = (np.asarray(low) + high) / 2
        tangent = np.tan(FIELD_OF_VIEW / 2) / margin
        d = corners - self.middle
        reach = np.maximum(abs(d @ self.right) / (tangent * size[0] / size[1]), abs(d @ self.above) / tangent)
        self.far = (d @ self.back + reach).max()
        self.zoom = self.height / 2 / np.tan(FIELD_OF_VIEW / 2)

    def project(self, points):
        """Columns: x and y in pixels, and the distance."""
        d = points - self.middle
        depth = self.far - d @ self.back
        return np.stack([self.width / 2 + self.zoom * (d @ self.right) / depth, self.height / 2 - self.zoom * (d @ self.above) / depth, depth], axis=-1)


def covered(view, screen, triangles):
    """Pixels that triangles cover, in batches of like size: pixel, triangle, barycentric weights."""
    corners = screen[triangles][:, :, :2]
    low, high = np.floor(corners.min(axis=1)).astype(int), np.ceil(corners.max(axis=1)).astype(int)
    extent = (high - low).max(axis=1)
    done = 0
    for side in (4, 8, 16, 32, 64, 128, 256, 512, 1024):
        chosen = np.flatnonzero((extent <= side) & (extent > done))
        done = side
        for some in np.array_split(chosen, max(1, len(chosen) * side * side // 4_000_000)):
            if not len(some):
                continue
            y, x = np.mgrid[0:side + 1, 0:side + 1]
            px, py = low[some, 0, None] + x.ravel(), low[some, 1, None] + y.ravel()
            a, b, c = (corners[some, k, :, None] for k in range(3))
            area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
            area = np.where(abs(area) < 1e-12, np.nan, area)
            wb = ((px - a[:, 0]) * (c[:, 1] - a[:, 1]) - (py - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
            wc = ((b[:, 0] - a[:, 0]) * (py - a[:, 1]) - (b[:, 1] - a[:, 1]) * (px - a[:, 0])) / area
            with np.errstate(invalid="ignore"):
                inside = (wb >= -1e-9) & (wc >= -1e-9) & (wb + wc <= 1 + 1e-9) & (px >= 0) & (py >= 0) & (px < view.width) & (py < view.height)
            i, j = np.nonzero(inside)
            yield (py[i, j] * view.width + px[i, j]), some[i], np.stack([1 - wb[i, j] - wc[i, j], wb[i, j], wc[i, j]], axis=-1)


def lit(view, points, triangles, color):
    """Colours (m x 3 corners x 3): the side that is seen, under the sun and the sky."""
    edge = points[triangles]
    face = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    normal = np.zeros_like(points)
    for k in range(3):
        np.add.at(normal, triangles[:, k], face)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    eye = view.middle + view.far * view.back
    seen = np.einsum("fc,fc->f", face, eye - edge[:, 0])
    n = normal[triangles] * np.where(seen < 0, -1.0, 1.0)[:, None, None]
    sun = SUN[0] * view.right + SUN[1] * view.up + SUN[2] * view.back
    key = np.clip(n @ (sun / np.linalg.norm(sun)), 0, None)
    sky = 0.5 + 0.5 * n @ view.up
    return np.asarray(color, float) * (0.36 + 0.24 * sky + 0.56 * key)[..., None]


def shadow(view, shapes, level):
    """The share of light that the ground loses, pixel by pixel, softened."""
    sun = SUN[0] * view.right + SUN[1] * view.up + SUN[2] * view.back
    dark = np.zeros(view.width * view.height, np.uint8)
    for points, triangles, _ in shapes:
        fallen = points - ((points @ view.up - level) / (sun @ view.up))[:, None] * sun
        for pixels, _, _ in covered(view, view.project(fallen), triangles):
            dark[pixels] = 255
    soft = Image.fromarray(dark.reshape(view.height, view.width)).filter(ImageFilter.GaussianBlur(2.5 * FINER))
    return np.asarray(soft, float)[..., None] / 255


def backdrop(view, level):
    """Ground that fades into the sky with distance."""
    rows = (view.height / 2 - np.arange(view.height) - 0.5) / view.zoom
    slope = rows * (view.above @ view.up) - view.back @ view.up           # how steeply a ray of that row falls
    height = (view.middle + view.far * view.back) @ view.up - level
    away = np.where(slope < 0, height / np.maximum(-slope, 1e-9), np.inf)
    share = np.exp(-np.maximum(away / view.far - 0.6, 0) / 0.9)[:, None, None]
    return share * GROUND + (1 - share) * SKY + np.zeros((1, view.width, 1))


def draw(view, shapes, level):
    """A picture of shapes (points, triangles, colour of 0 to 255) over the ground at a height."""
    picture = backdrop(view, level) * (1 - 0.24 * shadow(view, shapes, level))
    picture = picture.reshape(-1, 3)
    nearest = np.full(len(picture), np.inf)
    for points, triangles, color in shapes:
        screen, colors = view.project(points), lit(view, points, triangles, color)
        for pixels, of, weights in covered(view, screen, triangles):
            depth = np.einsum("pk,pk->p", weights, screen[triangles[of], 2])
            order = np.argsort(-depth, kind="stable")                     # the nearest is written last
            pixels, of, weights, depth = pixels[order], of[order], weights[order], depth[order]
            front = depth < nearest[pixels]
            pixels, of, weights, depth = pixels[front], of[front], weights[front], depth[front]
            picture[pixels] = np.einsum("pk,pkc->pc", weights, colors[of])
            nearest[pixels] = depth
    image = Image.fromarray(np.uint8(np.clip(picture, 0, 255)).reshape(view.height, view.width, 3))
    return image.resize((view.width // FINER, view.height // FINER), Image.LANCZOS)
