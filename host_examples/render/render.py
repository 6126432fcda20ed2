#!/usr/bin/env python3
"""Stills of shells: OBJ meshes in, PNG pictures out, on the processor alone.

One mesh, plain or coloured by how far each vertex moved from its rest shape:

    render.py --out rest.png dinosaur.obj
    render.py --out bent.png --displacement dinosaur.obj --title "frame 40" frame_0040.obj
    render.py --out speed.png --values speed.txt --range 0 2 frame_0040.obj

Several meshes in one picture, each in its own colour (a name below or #rrggbb):

    render.py --out methods.png --up z --colors red blue green --apart 0 1 0 lma.obj warp.obj shells.obj

A sequence that shares one camera and one ground; handles as spheres; axes at a point:

    render.py --out 1.png --frame-on rest.obj --frame-on extreme.obj --spheres 0 0 1 0.05 --axes 0 0 0 frame.obj

Several stills side by side, a label below each:

    render.py --out sheet.png --contact-sheet --labels "at rest" "frame 40" rest.png bent.png

A still of 960 x 720 pixels takes about ten seconds of one core at the default 9 samples a pixel; a filter that follows
edges of colour and normal takes out the noise that is left. --samples 64 costs six times as much and is for print.
"""

import argparse
import sys
from pathlib import Path

try:
    import numpy as np
    from meshes import RenderError, corner_normals, read_obj, read_values
    from paint import COLORS, annotate, color, contact_sheet, reflectance, to_image, viridis
except ImportError as error:
    sys.exit(f"render.py: {error}; sh cmake/bootstrap.sh render sets up .venv/, then use .venv/bin/python")

CYCLE = ("red", "blue", "green", "orange", "purple", "teal")
PLAIN = "teal"
GROUND = 0.80                # reflectance of the ground
GROUND_LIGHT = 0.86          # its brightness in full light, linear; 1 is white
KEY_SHARE = 0.68             # share of that light which the lamp gives; the sky gives the rest
FIELD_OF_VIEW = 26.0         # degrees, vertical
MARGIN = 1.16                # room left around the meshes
AXIS = 0.4                   # usual length of the axes, in mesh radii


# ------------------------------------------------------------------------------------------------------------ scene

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
                "near_clip": 1e-3, "far_clip": 1e4,
                "sampler": {"type": "multijitter", "sample_count": samples}}


def lights_and_ground(mi, camera, level):
    """A lamp above the viewer's left shoulder, an even sky, and a ground at height `level`, so wide that no edge shows."""
    toward = -0.95 * camera.right + np.array([0, 1.35, 0]) + 0.40 * camera.back * [1, 0, 1]
    toward /= np.linalg.norm(toward)
    away, radius = 60.0, 12.0
    full = np.pi * GROUND_LIGHT / GROUND
    lamp = KEY_SHARE * full / (np.pi * (radius / away) ** 2 * toward[1])
    ground = mi.ScalarTransform4f().translate([0, float(level), 0]).rotate([1, 0, 0], -90).scale(500)
    return {
        "lamp": {"type": "sphere", "center": (away * toward).tolist(), "radius": radius,
                 "emitter": {"type": "area", "radiance": float(lamp)}},
        "sky": {"type": "constant", "radiance": float((1 - KEY_SHARE) * full / np.pi)},
        "ground": {"type": "rectangle", "to_world": ground, "bsdf": matte(GROUND)}}


def overlays(spheres, axes, length, place, reach):
    """Yellow spheres (rows x y z r) and red, green, blue cylinders along axes: rows of a point and three directions."""
    shapes = {}
    for i, (x, y, z, r) in enumerate(spheres):
        shapes[f"sphere{i}"] = {"type": "sphere", "center": place((x, y, z)).tolist(), "radius": r / reach,
                                "bsdf": matte(rgb(reflectance(color("yellow"))))}
    for i, (row, tips) in enumerate(zip(axes, axis_tips(axes, length * reach))):
        for name, tip in zip(("red", "green", "blue"), tips):
            start, end = place(row[:3]), place(tip)
            shapes[f"{name}{i}"] = {"type": "cylinder", "p0": start.tolist(), "p1": end.tolist(), "radius": 0.03 * length,
                                    "bsdf": matte(rgb(reflectance(color(name))))}
    return shapes


def axis_tips(axes, length):
    """Ends of the axes: three for each row."""
    return axes[:, None, :3] + length * axes[:, 3:].reshape(-1, 3, 3)


# -------------------------------------------------------------------------------------------------------- rendering

def render(mi, scene, camera, size, samples):
    """Linear picture (height x width x 3), noise filtered."""
    world = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 3},
                          "sensor": camera.sensor(mi, size, samples), **scene})
    picture = np.array(mi.render(world, seed=1))[..., :3]
    guides = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
    features = np.array(mi.render(world, integrator=guides, spp=2, seed=2))
    return denoise(picture, features)


def denoise(picture, features, passes=4):
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
    add("--apart", nargs=3, type=float, default=(0, 0, 0), metavar=("X", "Y", "Z"),
        help="put each mesh this much further along than the one before, so that meshes alike do not hide each other")
    add("--spheres", nargs="+", default=[], metavar="N", help="x y z radius, repeated: yellow spheres")
    add("--axes", nargs="+", default=[], metavar="N",
        help="x y z: axes from this point, x red, y green, z blue; nine more numbers: directions of the three, and then "
             "more such twelve for more axes")
    add("--axes-length", type=float, default=AXIS, help=f"in mesh radii ({AXIS})")
    add("--frame-on", action="append", default=[], metavar="FILE.obj", help="frame on these meshes instead; may be repeated")
    add("--view", nargs=2, type=float, default=(35, 18), metavar=("AZIMUTH", "ELEVATION"), help="degrees (35 18)")
    add("--up", choices="yz", default="y", help="which way is up (y)")
    add("--gap", type=float, default=0.0, help="height above the ground, in mesh radii (0: stands on it)")
    add("--size", nargs=2, type=int, default=(960, 720), metavar=("WIDTH", "HEIGHT"), help="pixels (960 720)")
    add("--samples", type=int, default=9, help="samples a pixel (9)")
    add("--title", help="words in the upper left corner")
    add("--contact-sheet", action="store_true", help="put several pictures on one sheet")
    add("--labels", nargs="+", default=[], help="words below each picture of the sheet (the file names)")
    add("--columns", type=int, help="pictures in a row of the sheet (all)")
    add("--cell", type=int, default=640, help="width of a picture on the sheet, pixels (640)")
    return check(parser.parse_intermixed_args(argv))


def check(args):
    """Files written right after a list of colours, numbers or labels are taken out of it; nonsense is refused."""
    for name in ("colors", "spheres", "axes", "labels"):
        words = getattr(args, name)
        args.files += [word for word in words if word.lower().endswith((".obj", ".png"))]
        setattr(args, name, [word for word in words if not word.lower().endswith((".obj", ".png"))])
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
    try:
        args.axes = np.array(args.axes, dtype=np.float64)
        if len(args.axes) == 3:
            args.axes = np.concatenate([args.axes, np.eye(3).ravel()])
        args.axes = args.axes.reshape(-1, 12)
    except ValueError:
        raise RenderError(f"--axes takes x y z, or twelve numbers for each; found {' '.join(map(str, args.axes))}") from None
    if min(*args.size, args.cell) < 16 or max(*args.size, args.cell) > 8192 or not 1 <= args.samples <= 4096:
        raise RenderError("--size and --cell go from 16 to 8192, --samples from 1 to 4096")
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
    caption = args.caption or caption
    low, high = args.range or (min(0.0, values.min()), values.max())
    if args.range and not low < high:
        raise RenderError(f"--range needs LOW below HIGH; found {low:g} {high:g}")
    top = values.argmax()
    print(f"{args.files[0]}: largest {caption} {values[top]:.6g} at vertex {top}, counted from 0; colours {low:g} to {high:g}")
    return viridis((values - low) / max(high - low, 1e-300)), (caption, low, high)


def still(args):
    mi = load_mitsuba()
    meshes = [(vertices + i * np.array(args.apart), triangles)
              for i, (vertices, triangles) in enumerate(read_obj(path) for path in args.files)]
    points, middle, reach = framing(args, [vertices for vertices, _ in meshes])
    turn = np.eye(3) if args.up == "y" else np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])

    def place(p):
        """From the files' coordinates to the scene's: y up, around the origin, about as large as the unit ball."""
        return (np.asarray(p) - middle) / reach @ turn.T

    camera = Camera(place(points), *args.view, args.size[0] / args.size[1])
    scene = lights_and_ground(mi, camera, place(points)[:, 1].min() - args.gap - 1e-3)
    scene.update(overlays(args.spheres, args.axes, args.axes_length, place, reach))
    by_value, scale = vertex_colors(args, meshes[0][0])
    names = args.colors or ([PLAIN] if len(meshes) == 1 else [CYCLE[i % len(CYCLE)] for i in range(len(meshes))])
    for i, ((vertices, triangles), name) in enumerate(zip(meshes, names)):
        colors = np.tile(color(name), (len(vertices), 1)) if by_value is None else by_value
        scene[f"mesh{i}"] = mesh_shape(mi, place(vertices), triangles, colors)
    return annotate(to_image(render(mi, scene, camera, args.size, args.samples)), args.title, scale)


def framing(args, meshes):
    """The points to keep in the picture, and the middle and radius of the meshes; --frame-on replaces all of them."""
    places = [i * np.array(args.apart) for i in range(len(meshes))]
    shown = np.concatenate([read_obj(path)[0] + place for path in args.frame_on for place in places] or meshes)
    middle = (shown.min(axis=0) + shown.max(axis=0)) / 2
    reach = np.linalg.norm(np.ptp(shown, axis=0)) / 2
    if reach == 0:
        raise RenderError(f"{args.files[0]}: all vertices are at one point")
    if not args.frame_on:
        shown = np.concatenate([shown, args.spheres[:, :3],
                                axis_tips(args.axes, args.axes_length * reach).reshape(-1, 3)])
    return shown, middle, reach


def load_mitsuba():
    try:
        import mitsuba
    except ImportError:
        raise RenderError("mitsuba is missing; sh cmake/bootstrap.sh render installs it") from None
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)   # degenerate triangles are drawn as what they are: nothing
    return mitsuba


def main(argv=None):
    try:
        args = arguments(argv)
        if args.contact_sheet:
            labels = args.labels or [Path(path).stem for path in args.files]
            image = contact_sheet(args.files, labels, args.columns, args.title, args.cell)
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
