"""What the command line writes for other programs, read by these: OBJ sequences, USD and glTF hold the motion of the PC2 file.

usage: export_test.py sequence|usd|gltf|validator PROGRAM OUT [VALIDATOR]

`usd` needs usd-core, `gltf` pygltflib and numpy. `validator` needs node, and Khronos' validator in VALIDATOR/node_modules, which npm is
asked for; where either is missing it exits with 77.
"""

import json
import shutil
import struct
import subprocess
import sys
from pathlib import Path

ROWS, COLUMNS, FRAMES, RATE = 9, 3, 12, 240
POINTS = [(0.01 * i, 0.01 * j, 0.0) for i in range(ROWS) for j in range(COLUMNS)]
QUADS = [[COLUMNS * i + j, COLUMNS * (i + 1) + j, COLUMNS * (i + 1) + j + 1, COLUMNS * i + j + 1]
         for i in range(ROWS - 1) for j in range(COLUMNS - 1)]
# With a seam: the last column of vertices has a texture coordinate of its own.
UVS = [(x / 0.08, y / 0.02) for x, y, _ in POINTS] + [(0.5, 0.25)]
CORNER_UVS = [v if v % COLUMNS < 2 else len(POINTS) for quad in QUADS for v in quad]


def run(program, out, *options, expect=0, scale=1.0):
    """Simulates the strip, its file in metres / scale: the folder with what was written."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    corners = iter(CORNER_UVS)
    lines = [f"v {x / scale:.9g} {y / scale:.9g} {z / scale:.9g}" for x, y, z in POINTS] + [f"vt {u:.9g} {v:.9g}" for u, v in UVS]
    lines += ["f " + " ".join(f"{v + 1}/{next(corners) + 1}" for v in quad) for quad in QUADS]
    (out / "strip.obj").write_text("\n".join(lines) + "\n")
    command = [program, "simulate", str(out / "strip.obj"), "--pin", "low-x", "--up", "z", "--method", "warp", "--frequency", "4", "--scale", str(scale),
               "--step", str(1 / RATE), "--frames", str(FRAMES), "--no-certify", "--quiet", "--out", str(out / "out"), *options]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == expect, (command, done.returncode, done.stderr)
    return out / "out" if expect == 0 else done.stderr


def cache(path):
    """The frames of a PC2 file, each a list of points."""
    data = path.read_bytes()
    points, samples = struct.unpack("<i", data[16:20])[0], struct.unpack("<i", data[28:32])[0]
    numbers = struct.unpack(f"<{3 * points * samples}f", data[32:])
    return [[numbers[3 * (s * points + i):3 * (s * points + i) + 3] for i in range(points)] for s in range(samples)]


def furthest(a, b):
    return max(abs(x - y) for p, q in zip(a, b, strict=True) for x, y in zip(p, q, strict=True))


def sequence(program, out):
    folder = run(program, out, "--every", "1")
    frames, files = cache(folder / "strip.pc2"), sorted(folder.glob("strip_frame_*.obj"))
    assert [path.name for path in files] == [f"strip_frame_{k:04}.obj" for k in range(FRAMES + 1)], files
    for frame, path in zip(frames, files):
        points = [tuple(map(float, line.split()[1:])) for line in path.read_text().splitlines() if line.startswith("v ")]
        assert furthest(points, frame) < 1e-9, path  # nine digits of 0.08
    assert furthest(frames[0], frames[-1]) > 0.001
    files = sorted(path.name for path in run(program, out, "--every", "5", "--formats", "usd").iterdir())
    assert [name for name in files if name.endswith(".obj") and "frame" in name] == [f"strip_frame_{k:04}.obj" for k in (0, 5, 10)], files
    assert "strip.usda" in files and "strip.pc2" not in files and "strip.glb" not in files, files
    for options, said in ((["--formats", "gltf", "--usd-prim", "/a"], "usd is not among the formats"), (["--formats", "usd", "--usd-prim", "a"], "must begin with '/'"),
                          (["--formats", "usd", "--usd-prim", "/World/2nd"], "'2nd' is no name of a prim"), (["--formats", "usd", "--up", "x"], "USD has y or z upward")):
        stderr = run(program, out, *options, expect=1) if "--up" not in options else refuse_x(program, out)
        assert said in stderr, (options, stderr)


def refuse_x(program, out):
    done = subprocess.run([program, "simulate", str(out / "strip.obj"), "--pin", "low-x", "--up", "x", "--formats", "usd", "--out", str(out / "x")],
                          capture_output=True, text=True)
    assert done.returncode == 1 and not (out / "x").exists(), done
    return done.stderr


def usd(program, out):
    import numpy
    from pxr import Usd, UsdGeom, UsdValidation
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    folder = run(program, out, "--formats", "pc2,usd")
    frames, stage = numpy.array(cache(folder / "strip.pc2")), Usd.Stage.Open(str(folder / "strip.usda"))
    assert not UsdValidation.ValidationContext(validators).Validate(stage)
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 1)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), round(stage.GetTimeCodesPerSecond(), 9)) == (0, FRAMES, RATE)
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    assert mesh.GetDoubleSidedAttr().Get() and mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert list(mesh.GetFaceVertexCountsAttr().Get()) == [4] * len(QUADS)
    assert list(mesh.GetFaceVertexIndicesAttr().Get()) == [v for quad in QUADS for v in quad]
    uvs = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert uvs.GetInterpolation() == "faceVarying" and mesh.GetNormalsInterpolation() == "vertex"
    assert numpy.abs(numpy.array(uvs.ComputeFlattened()) - [UVS[k] for k in CORNER_UVS]).max() < 1e-6
    for k, frame in enumerate(frames):
        points, extent = numpy.array(mesh.GetPointsAttr().Get(k)), numpy.array(mesh.GetExtentAttr().Get(k))
        assert (points == frame.astype(numpy.float32)).all() and (extent == [points.min(axis=0), points.max(axis=0)]).all()
        normals = numpy.array(mesh.GetNormalsAttr().Get(k))
        assert numpy.abs(numpy.linalg.norm(normals, axis=1) - 1).max() < 1e-6 and (normals[:, 2] > 0.5).all()
        if k:  # implicit Euler: the way since the last step, but for what turns on it, 0.02 here; a wrong unit of time would be off by half
            way = RATE * (frame - frames[k - 1])
            assert numpy.abs(numpy.array(mesh.GetVelocitiesAttr().Get(k)) - way).max() < 0.05 * numpy.abs(way).max() + 1e-5, k
    # Over an asset in centimetres: its prim, its unit, and nothing but what moves.
    folder = run(program, out.with_name(out.name + "_over"), "--formats", "pc2,usd", "--usd-prim", "/World/geo/leaf", scale=0.01)
    stage = Usd.Stage.Open(str(folder / "strip.usda"))
    assert not UsdValidation.ValidationContext(validators).Validate(stage)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01 and str(stage.GetDefaultPrim().GetPath()) == "/World"
    prim = stage.GetPrimAtPath("/World/geo/leaf")
    assert prim.IsValid() and not any(each.IsDefined() for each in stage.TraverseAll())
    assert sorted(each.GetName() for each in prim.GetAuthoredAttributes()) == ["extent", "normals", "points", "velocities", "xformOpOrder"]
    last = numpy.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(FRAMES))
    numpy.testing.assert_allclose(last, 100 * numpy.array(cache(folder / "strip.pc2")[-1]), rtol=1e-6, atol=1e-6)


def gltf(program, out):
    import numpy
    import pygltflib
    folder = run(program, out, "--formats", "pc2,gltf", "--metres-per-unit", "0.01")
    frames, file = numpy.array(cache(folder / "strip.pc2")), pygltflib.GLTF2().load(str(folder / "strip.glb"))
    blob = file.binary_blob()

    def values(number):
        accessor = file.accessors[number]
        size = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor.type]
        at = file.bufferViews[accessor.bufferView].byteOffset + accessor.byteOffset
        found = numpy.frombuffer(blob, {5126: "<f4", 5125: "<u4"}[accessor.componentType], accessor.count * size, at).reshape(-1, size)
        assert not accessor.min or ((found.min(axis=0) == numpy.float32(accessor.min)).all() and (found.max(axis=0) == numpy.float32(accessor.max)).all())
        return found

    primitive, node = file.meshes[0].primitives[0], file.nodes[0]
    assert file.materials[primitive.material].doubleSided and node.scale == [0.01] * 3
    base, normals, uvs = (values(getattr(primitive.attributes, name)) for name in ("POSITION", "NORMAL", "TEXCOORD_0"))
    # Each vertex once for every texture coordinate, with v downward.
    pairs = list(dict.fromkeys(zip((v for quad in QUADS for v in quad), CORNER_UVS)))
    assert len(base) == len(pairs) and numpy.abs(uvs - [(UVS[k][0], 1 - UVS[k][1]) for _, k in pairs]).max() < 1e-6
    of_mesh = [v for v, _ in pairs]
    triangles = {frozenset(of_mesh[i] for i in t) for t in values(primitive.indices).reshape(-1, 3)}
    assert len(triangles) == 2 * len(QUADS) and all(any(t <= set(quad) for quad in QUADS) for t in triangles)
    sampler = file.animations[0].samplers[0]
    times, weights = values(sampler.input)[:, 0], values(sampler.output).reshape(FRAMES + 1, FRAMES)
    assert numpy.abs(times - numpy.arange(FRAMES + 1) / RATE).max() < 1e-6 and file.animations[0].channels[0].target.path == "weights"
    targets = [(values(t["POSITION"]), values(t["NORMAL"])) for t in primitive.targets]
    w, x, y, z = node.rotation[3], *node.rotation[:3]
    turn = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    assert numpy.abs(turn @ [0, 0, 1] - [0, 1, 0]).max() < 1e-6, "z upward becomes glTF's y"
    for k, frame in enumerate(frames):
        points = base + sum(weight * moved for weight, (moved, _) in zip(weights[k], targets))
        assert numpy.abs(points - frame[of_mesh]).max() < 1e-8, k  # single precision of 0.08
        turned = normals + sum(weight * moved for weight, (_, moved) in zip(weights[k], targets))
        assert numpy.abs(numpy.linalg.norm(turned, axis=1) - 1).max() < 1e-6
    assert numpy.abs(frames[-1] - frames[0]).max() > 0.001


VALIDATE = """const fs = require("fs"), validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(report => console.log(JSON.stringify(report.issues)));"""


def validator(program, out, place):
    if not shutil.which("npm"):
        skip("node and npm are missing")
    if not (place / "node_modules").exists() and subprocess.run(["npm", "ci", "--silent", "--prefix", str(place)]).returncode:
        skip("npm could not install gltf-validator")
    for options in ([], ["--static"], ["--metres-per-unit", "0.01"]):
        folder = run(program, out, "--formats", "gltf", *options)
        said = subprocess.run(["node", "-e", VALIDATE, str(folder / "strip.glb")], cwd=place, capture_output=True, text=True, check=True).stdout
        issues = json.loads(said)
        # Texture coordinates are there for the textures that somebody else puts on.
        assert issues["numErrors"] == issues["numWarnings"] == 0 and {m["code"] for m in issues["messages"]} <= {"UNUSED_OBJECT"}, said


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


if __name__ == "__main__":
    part, program, out = sys.argv[1], str(Path(sys.argv[2]).resolve()), Path(sys.argv[3]).resolve()
    {"sequence": sequence, "usd": usd, "gltf": gltf, "validator": validator}[part](program, out, *map(Path, filter(None, sys.argv[4:])))
    print("ok")
