#!/usr/bin/env python3
"""Stills of shells: OBJ meshes in, PNG pictures out, on the processor alone.

One mesh, plain or coloured by how far each vertex moved from its rest shape:

    render.py --out rest.png dinosaur.obj
    render.py --out bent.png --displacement dinosaur.obj --title "frame 40" frame_0040.obj
    render.py --out speed.png --values speed.txt --range 0 2 frame_0040.obj

Several meshes in one picture, each in its own colour (a name below or #rrggbb):

    render.py --out methods.png --up z --colors red blue green lma.obj warp.obj shells.obj

A sequence that shares one camera and one ground; handles as spheres; axes at a point:

    render.py --out 1.png --frame-on rest.obj --frame-on extreme.obj --spheres 0 0 1 0.05 --axes 0 0 0 frame.obj

Several stills side by side, a label below each:

    render.py --out sheet.png --contact-sheet --labels "at rest" "frame 40" rest.png bent.png

A still of 960 x 720 pixels takes about ten seconds of one core at the default 12 samples a pixel; a filter that follows edges
of colour and normal takes out the noise that is left. --samples 64 costs five times as much and is for print.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

COLORS = {"red": "#d23b30", "blue": "#2f6fc4", "green": "#3f9e4d", "yellow": "#f2c21b", "orange": "#e8833a",
          "purple": "#7b52ab", "teal": "#3b9fae", "grey": "#9a9a9a", "white": "#f0f0f0"}
CYCLE = ("red", "blue", "green", "orange", "purple", "teal")
VIRIDIS = ("#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725")
LIFT = 0.22
PLAIN = "teal"
GROUND = 0.80                # reflectance of the ground
GROUND_LIGHT = 0.86          # its brightness in full light, linear; 1 is white
KEY_SHARE = 0.68             # share of that light which the lamp gives; the sky gives the rest
FIELD_OF_VIEW = 26.0         # degrees, vertical
MARGIN = 1.16                # room left around the meshes
CREASE = np.cos(np.radians(35.0))   # neighbouring triangles that meet more sharply are shaded as an edge


class RenderError(Exception):
    """A message for the person at the keyboard."""


# ---------------------------------------------------------------------------------------------------------- reading

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


# ----------------------------------------------------------------------------------------------------------- colour

def color(name):
    """sRGB components in 0..1 of a named colour or #rrggbb."""
    text = COLORS.get(name, name)
    try:
        if len(text) != 7 or text[0] != "#":
            raise ValueError
        return np.array([int(text[i:i + 2], 16) for i in (1, 3, 5)]) / 255.0
    except ValueError:
        raise RenderError(f"unknown colour '{name}'; known: {', '.join(COLORS)}, or #rrggbb") from None


def reflectance(srgb):
    """Linear reflectance that shows as about this colour in full light."""
    return 0.85 * np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def viridis(t):
    """The perceptual colour map of that name, t in 0..1, as sRGB; its dark end is lifted so that shading still shows there."""
    table = np.array([color(code) for code in VIRIDIS])
    table += np.linspace(LIFT, 0, len(table))[:, None] * (1 - table)
    t = np.clip(t, 0.0, 1.0)
    return np.stack([np.interp(t, np.linspace(0, 1, len(table)), table[:, k]) for k in range(3)], axis=-1)


# ------------------------------------------------------------------------------------------------------------ scene

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


def matte(value):
    return {"type": "twosided", "inner": {"type": "diffuse", "reflectance": value}}


def rgb(value):
    return {"type": "rgb", "value": [float(x) for x in value]}


def mesh_shape(mi, vertices, triangles, colors):
    """A Mitsuba mesh with one colour (sRGB) for each vertex; corners are split so that creases stay sharp."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(matte({"type": "mesh_attribute", "name": "vertex_color"}))
    mesh = mi.Mesh("shell", 3 * len(triangles), len(triangles), props=properties, has_vertex_normals=True)
    mesh.add_attribute("vertex_color", 3, np.float32(reflectance(colors)[triangles].ravel()))
    data = mi.traverse(mesh)
    data["vertex_positions"] = np.float32(vertices[triangles].ravel())
    data["vertex_normals"] = np.float32(corner_normals(vertices, triangles).ravel())
    data["faces"] = np.arange(3 * len(triangles), dtype=np.uint32)
    data.update()
    return mesh


class Camera:
    """Looks along a fixed direction and stands just far enough off that every point lies inside the margin."""

    def __init__(self, points, azimuth, elevation, aspect):
        a, e = np.radians([azimuth, elevation])
        self.back = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
        self.right = np.array([np.cos(a), 0.0, -np.sin(a)])
        self.above = np.cross(self.back, self.right)
        self.reach = max(np.linalg.norm(np.ptp(points, axis=0)) / 2, 1e-9)
        tangent = np.tan(np.radians(FIELD_OF_VIEW / 2)) / MARGIN
        x, x_far = self.fit(points, self.right, tangent * aspect)
        y, y_far = self.fit(points, self.above, tangent)
        self.center = x * self.right + y * self.above
        self.eye = self.center + max(x_far, y_far) * self.back

    def fit(self, points, axis, tangent):
        """Where along `axis` to stand, and how far back, so that the view wedge just holds the points."""
        across, depth = points @ axis, (points @ self.back) * tangent
        plus, minus = (across + depth).max(), (depth - across).max()
        return (plus - minus) / 2, (plus + minus) / (2 * tangent)

    def sensor(self, mi, size, samples):
        pose = mi.ScalarTransform4f().look_at(
            origin=self.eye.tolist(), target=(self.eye - self.back).tolist(), up=[0, 1, 0])
        film = {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "gaussian"}}
        return {"type": "perspective", "fov": FIELD_OF_VIEW, "fov_axis": "y", "to_world": pose, "film": film,
                "near_clip": self.reach * 1e-3, "far_clip": self.reach * 1e4,
                "sampler": {"type": "multijitter", "sample_count": samples}}


def lights_and_ground(mi, camera, level, middle):
    """A lamp above the viewer's left shoulder, an even sky, and a ground so wide that no edge shows."""
    toward = -0.95 * camera.right + np.array([0, 1.35, 0]) + 0.40 * camera.back * [1, 0, 1]
    toward /= np.linalg.norm(toward)
    away, radius = 60 * camera.reach, 12 * camera.reach
    full = np.pi * GROUND_LIGHT / GROUND
    lamp = KEY_SHARE * full / (np.pi * (radius / away) ** 2 * toward[1])
    place = mi.ScalarTransform4f().translate([float(middle[0]), float(level), float(middle[2])])
    return {
        "lamp": {"type": "sphere", "center": (middle + away * toward).tolist(), "radius": radius,
                 "emitter": {"type": "area", "radiance": float(lamp)}},
        "sky": {"type": "constant", "radiance": float((1 - KEY_SHARE) * full / np.pi)},
        "ground": {"type": "rectangle", "to_world": place.rotate([1, 0, 0], -90).scale(float(500 * camera.reach)),
                   "bsdf": matte(GROUND)}}


def overlays(spheres, axes, reach, turn):
    """Yellow spheres (rows x y z r) and, from the point `axes` if given, cylinders along x, y, z in red, green, blue."""
    shapes = {}
    for i, (x, y, z, r) in enumerate(spheres):
        shapes[f"sphere{i}"] = {"type": "sphere", "center": (turn @ (x, y, z)).tolist(), "radius": float(r),
                                "bsdf": matte(rgb(reflectance(color("yellow"))))}
    for k, name in enumerate(("red", "green", "blue") if axes is not None else ()):
        start, end = turn @ axes, turn @ (axes + 0.45 * reach * np.eye(3)[k])
        shapes[name] = {"type": "cylinder", "p0": start.tolist(), "p1": end.tolist(), "radius": 0.012 * reach,
                        "bsdf": matte(rgb(reflectance(color(name))))}
    return shapes


# -------------------------------------------------------------------------------------------------------- rendering

def render(mi, scene, camera, size, samples):
    """Linear picture (height x width x 3), noise filtered."""
    world = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 3},
                          "sensor": camera.sensor(mi, size, samples), **scene})
    picture = np.array(mi.render(world, seed=1))[..., :3]
    guides = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
    features = np.array(mi.render(world, integrator=guides, spp=2, seed=2))
    return denoise(picture, features)


def denoise(picture, features, passes=3):
    """Edge-avoiding wavelets: 5 x 5 averages at widening strides over the pixels of like albedo and normal."""
    picture = np.float32(picture).transpose(2, 0, 1)
    features = np.float32(features).transpose(2, 0, 1) * np.float32([9, 9, 9, 5, 5, 5])[:, None, None]
    kernel = np.float32([1, 4, 6, 4, 1]) / 16
    _, height, width = picture.shape
    for stride in (2 ** k for k in range(passes)):
        margin = (2 * stride, 2 * stride)
        wide = [np.pad(x, ((0, 0), margin, margin), mode="edge") for x in (picture, features)]
        total, weights = np.zeros_like(picture), np.zeros_like(picture[0])
        for i, j in np.ndindex(5, 5):
            near, like = (x[:, i * stride:i * stride + height, j * stride:j * stride + width] for x in wide)
            apart = np.einsum("cij,cij->ij", like - features, like - features)
            weight = kernel[i] * kernel[j] * np.exp(-apart)
            total += weight * near
            weights += weight
        picture = total / weights
    return picture.transpose(1, 2, 0)


def to_image(picture):
    x = np.clip(picture, 0.0, 1.0)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return Image.fromarray(np.uint8(np.round(255 * srgb)))


# --------------------------------------------------------------------------------------------------- words and sheets

INK = (45, 48, 54)


def font(height):
    return ImageFont.load_default(size=max(9, round(height)))


def annotate(image, title, scale):
    """Draws the title in the upper left corner and, for `scale` = (caption, low, high), a colour bar below on the right."""
    draw, unit = ImageDraw.Draw(image), image.height / 720
    if title:
        draw.text((26 * unit, 20 * unit), title, fill=INK, font=font(25 * unit))
    if scale:
        caption, low, high = scale
        width, height = round(230 * unit), max(2, round(13 * unit))
        left, top = image.width - width - round(28 * unit), image.height - round(54 * unit)
        bar = np.tile(viridis(np.linspace(0, 1, width)), (height, 1, 1))
        image.paste(Image.fromarray(np.uint8(np.round(255 * bar))), (left, top))
        small = font(16 * unit)
        draw.text((left, top - 5 * unit), caption, fill=INK, font=small, anchor="ls")
        draw.text((left, top + height + 4 * unit), f"{low:.3g}", fill=INK, font=small, anchor="la")
        draw.text((left + width, top + height + 4 * unit), f"{high:.3g}", fill=INK, font=small, anchor="ra")
    return image


def contact_sheet(paths, labels, columns, title, cell_width=640):
    """The pictures in rows on white, each as wide as a cell, with its label below."""
    if len(labels) != len(paths):
        raise RenderError(f"{len(labels)} labels for {len(paths)} pictures")
    cells = [open_image(path).convert("RGB") for path in paths]
    cells = [cell.resize((cell_width, round(cell.height * cell_width / cell.width)), Image.LANCZOS) for cell in cells]
    columns = min(columns or len(cells), len(cells))
    rows, gap, line = -(-len(cells) // columns), 16, 44
    head, step = (60 if title else gap), max(cell.height for cell in cells) + line
    sheet = Image.new("RGB", (columns * (cell_width + gap) + gap, head + rows * step + gap // 2), "white")
    draw = ImageDraw.Draw(sheet)
    draw.text((gap, 16), title or "", fill=INK, font=font(28))
    for i, (cell, label) in enumerate(zip(cells, labels)):
        x, y = gap + i % columns * (cell_width + gap), head + i // columns * step
        sheet.paste(cell, (x, y))
        draw.text((x + cell_width / 2, y + step - line + 9), label, fill=INK, font=font(22), anchor="ma")
    return sheet


def open_image(path):
    try:
        return Image.open(path)
    except OSError as error:
        raise RenderError(f"cannot read the picture {path}: {error}") from None


# ------------------------------------------------------------------------------------------------------ command line

def arguments(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("files", nargs="*", metavar="FILE", help="OBJ meshes, or PNG pictures with --contact-sheet")
    add("--out", required=True, help="the PNG file to write")
    add("--displacement", metavar="REST.obj", help="colour the one mesh by each vertex's distance from this rest shape")
    add("--values", metavar="FILE", help="colour the one mesh by these numbers, one for each vertex")
    add("--range", nargs=2, type=float, metavar=("LOW", "HIGH"), help="ends of the colour scale (0 and the largest value)")
    add("--caption", help="words above the colour scale")
    add("--colors", nargs="+", default=[], metavar="COLOR", help=f"one for each mesh: {', '.join(COLORS)}, #rrggbb")
    add("--spheres", nargs="+", default=[], metavar="N", help="x y z radius, repeated: yellow spheres")
    add("--axes", nargs=3, type=float, metavar=("X", "Y", "Z"), help="axes from this point: x red, y green, z blue")
    add("--frame-on", action="append", default=[], metavar="FILE.obj", help="frame on these meshes instead; may be repeated")
    add("--view", nargs=2, type=float, default=(35, 18), metavar=("AZIMUTH", "ELEVATION"), help="degrees (35 18)")
    add("--up", choices="yz", default="y", help="which way is up (y)")
    add("--gap", type=float, default=0.0, help="height above the ground, in mesh radii (0: stands on it)")
    add("--size", nargs=2, type=int, default=(960, 720), metavar=("WIDTH", "HEIGHT"), help="pixels (960 720)")
    add("--samples", type=int, default=12, help="samples a pixel (12)")
    add("--title", help="words in the upper left corner")
    add("--contact-sheet", action="store_true", help="put several pictures on one sheet")
    add("--labels", nargs="+", help="words below each picture of the sheet (the file names)")
    add("--columns", type=int, help="pictures in a row of the sheet (all)")
    return check(parser.parse_intermixed_args(argv))


def check(args):
    """Meshes written right after --colors or --spheres belong to the meshes; then what no picture can be made of."""
    for name in ("colors", "spheres"):
        args.files += [word for word in getattr(args, name) if word.lower().endswith(".obj")]
        setattr(args, name, [word for word in getattr(args, name) if not word.lower().endswith(".obj")])
    if not args.files:
        raise RenderError("name at least one file to draw")
    if (args.displacement or args.values) and len(args.files) > 1:
        raise RenderError("--displacement and --values colour one mesh; found " + ", ".join(args.files))
    if args.colors and len(args.colors) != len(args.files):
        raise RenderError(f"{len(args.colors)} colours for {len(args.files)} meshes")
    try:
        args.spheres = np.array(args.spheres, dtype=np.float64).reshape(-1, 4)
    except ValueError:
        raise RenderError(f"--spheres takes x y z radius for each sphere; found {' '.join(args.spheres)}") from None
    if min(args.size) < 16 or max(args.size) > 8192 or not 1 <= args.samples <= 4096:
        raise RenderError("--size goes from 16 to 8192, --samples from 1 to 4096")
    if not 1 <= args.view[1] <= 89:
        raise RenderError(f"--view: the elevation goes from 1 to 89 degrees; found {args.view[1]:g}")
    return args


def vertex_colors(args, vertices):
    """Colours of the single mesh by value, and its colour scale; None where it has a plain colour."""
    if args.displacement:
        rest = read_obj(args.displacement)[0]
        if rest.shape != vertices.shape:
            raise RenderError(f"{args.displacement} has {len(rest)} vertices, {args.files[0]} has {len(vertices)}")
        values, caption = np.linalg.norm(vertices - rest, axis=1), "displacement"
    elif args.values:
        values, caption = read_values(args.values, len(vertices)), "value"
    else:
        return None, None
    low, high = args.range or (min(0.0, values.min()), values.max())
    if args.range and not low < high:
        raise RenderError(f"--range needs LOW below HIGH; found {low:g} {high:g}")
    print(f"{args.files[0]}: largest {caption} {values.max():.6g} at vertex {values.argmax() + 1}; colours {low:g} to {high:g}")
    return viridis((values - low) / max(high - low, 1e-300)), (args.caption or caption, low, high)


def still(args):
    mi = load_mitsuba()
    turn = np.eye(3) if args.up == "y" else np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    meshes = [read_obj(path) for path in args.files]
    framed = [read_obj(path)[0] for path in args.frame_on] or [vertices for vertices, _ in meshes]
    framed = np.concatenate(framed) @ turn.T
    camera = Camera(framed, *args.view, args.size[0] / args.size[1])
    by_value, scale = vertex_colors(args, meshes[0][0])
    names = args.colors or ([PLAIN] if len(meshes) == 1 else [CYCLE[i % len(CYCLE)] for i in range(len(meshes))])
    scene = lights_and_ground(mi, camera, framed[:, 1].min() - (args.gap + 1e-3) * camera.reach, (framed.min(0) + framed.max(0)) / 2)
    scene.update(overlays(args.spheres, args.axes, camera.reach, turn))
    for i, ((vertices, triangles), name) in enumerate(zip(meshes, names)):
        colors = np.tile(color(name), (len(vertices), 1)) if by_value is None else by_value
        scene[f"mesh{i}"] = mesh_shape(mi, vertices @ turn.T, triangles, colors)
    return annotate(to_image(render(mi, scene, camera, args.size, args.samples)), args.title, scale)


def load_mitsuba():
    try:
        import mitsuba
    except ImportError:
        raise RenderError("mitsuba is not installed; run: sh cmake/bootstrap.sh render") from None
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def main(argv=None):
    try:
        args = arguments(argv)
        if args.contact_sheet:
            labels = args.labels or [Path(path).stem for path in args.files]
            image = contact_sheet(args.files, labels, args.columns, args.title)
        else:
            image = still(args)
        Path(args.out).parent.mkdir(parents=True, exist_ok=True)
        image.save(args.out, format="PNG")
    except (RenderError, OSError) as error:
        print(f"render.py: {error}", file=sys.stderr)
        return 2
    print(f"wrote {args.out} ({image.width} x {image.height})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
