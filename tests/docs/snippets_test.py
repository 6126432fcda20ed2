"""The pieces of C and Python in the pages run, around a strip that hangs, and do what their page says.

usage: snippets_test.py FOLDER BUILD INCLUDE CC

A piece is an indented block. What a piece leaves open, such as `model` and `state`, is the strip's. Every status is checked.
Whole programs in fences are run by other tests: guide_snippet, guide_commands, docs_cmake, tutorial_….
"""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "c"))
from readme_test import has_numpy, library

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(?:^    .*\n)(?:(?:^    .*)?\n)*(?=^\S|\Z)", re.M)

# 21 x 3 vertices of a strip of 1 by 0.1 m, held at its first row.
STRIP = r"""
#include "shellwarp.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { n_vertices = 63, n = n_vertices };
static SwStatus checked(SwStatus status) {
    if (status == SW_OK) return status;
    fprintf(stderr, "%s\n", sw_last_error_message());
    exit(1);
}
static float positions[n][3];
static uint32_t triangles[80][3];
static SwMaterialDesc material;
static SwModel *model;
static SwState *state;

static void begin(void) {
    uint32_t t = 0;
    for (uint32_t v = 0; v < n; v++) positions[v][0] = (float)(v / 3) / 20, positions[v][1] = (float)(v % 3) / 20;
    for (uint32_t i = 0; i < 20; i++)
        for (uint32_t a = 3 * i; a < 3 * i + 2; a++) {
            const uint32_t both[2][3] = {{a, a + 3, a + 4}, {a, a + 4, a + 1}};
            memcpy(triangles[t], both, sizeof both);
            t += 2;
        }
    sw_material_desc_init(&material);
    material.area_density = 0.3, material.k_bend = 0.02, material.k_area = material.k_length = 5e3;
}
static void make_model(void) {
    static const uint32_t held[3] = {0, 1, 2};
    SwMeshDesc mesh;
    sw_mesh_desc_init(&mesh);
    mesh.position_format = SW_FORMAT_F32;
    mesh.positions = positions, mesh.n_vertices = n;
    mesh.triangles = &triangles[0][0], mesh.n_triangles = 80;
    SwSupportDesc supports;
    sw_support_desc_init(&supports);
    supports.clamped = held, supports.n_clamped = 3;
    checked(sw_model_create(&mesh, &material, &supports, &model));
}
static void make_state(void) {
    const double gravity[3] = {0, 0, -9.8};
    checked(sw_state_create(model, NULL, &state));
    checked(sw_state_set_gravity(state, gravity));
}
static void read_positions(void) { checked(sw_state_positions(state, SW_SPACE_WORLD, SW_FORMAT_F32, positions, 0, n)); }
static void expect(int holds, const char *what) {
    if (holds) return;
    fprintf(stderr, "it does not hold that %s\n", what);
    exit(1);
}
static double frequency(void) {
    double hertz[16];
    uint32_t count;
    checked(sw_model_frequencies(model, hertz, 16, &count));
    return hertz[0];
}
"""
READY = "begin(); make_model(); checked(sw_model_precompute(model, NULL)); make_state();"
STIFFER = """{
    make_model(); checked(sw_model_precompute(model, NULL));
    const double changed = frequency();
    begin(); EQUAL; make_model(); checked(sw_model_precompute(model, NULL));
    expect(fabs(frequency() / changed - 1) > 0.01, "%s");
}"""

SENT = """
            float skinned_positions[n][3];
            for (int v = 0; v < n; v++) memcpy(skinned_positions[v], positions[v], 12), skinned_positions[v][2] += 0.01f;"""

# Of a page, by a word of the piece: what stands before it and after it.
C = {
    "contact": [("ball.radius", READY, """
        for (int frame = 0; frame < 30; frame++) checked(sw_state_step(state, 1.0 / 30));
        read_positions();
        for (int v = 0; v < n; v++) {
            const double *o = pose.origin, x = positions[v][0] - o[0], y = positions[v][1] - o[1], z = positions[v][2] - o[2];
            expect(sqrt(x * x + y * y + z * z) > 0.3 - 1e-3, "the strip stays out of the ball");   /* a thousandth of its length */
        }""")],
    "moving_supports": [
        ("support_fields", "begin(); make_model();", "make_state();" + SENT + """
            checked(sw_state_move_supports(state, SW_FORMAT_F32, skinned_positions, 0, n, 0));"""),
        ("sw_state_step", """
            SwPrecomputeDesc desc;
            sw_precompute_desc_init(&desc);
            desc.support_fields = 24;
            begin(); make_model(); checked(sw_model_precompute(model, &desc)); make_state();""" + SENT, """
            read_positions();
            for (int v = 0; v < 3; v++) expect(fabsf(positions[v][2] - 0.01f) < 1e-6f, "the supports are where they were sent");"""),
    ],
    "render_mesh": [("sw_model_calibrate", """
        begin();
        const uint32_t held[3] = {0, 1, 2};
        SwMeshDesc asset, mesh;
        sw_mesh_desc_init(&asset);
        asset.position_format = SW_FORMAT_F32, asset.positions = positions, asset.n_vertices = n;
        asset.triangles = &triangles[0][0], asset.n_triangles = 80;
        SwProxyDesc wanted;
        sw_proxy_desc_init(&wanted);
        wanted.n_vertices = 40, wanted.held = held, wanted.n_held = 3;
        SwProxy *proxy = NULL;
        checked(sw_proxy_create(&asset, &wanted, &proxy));
        SwProxyInfo made;
        sw_proxy_info_init(&made);
        checked(sw_proxy_info(proxy, &made));
        double *x = malloc(24 * made.n_vertices);
        uint32_t *t = malloc(12 * made.n_triangles), nearest[n], clamped[3];
        checked(sw_proxy_positions(proxy, SW_FORMAT_F64, x, 0, made.n_vertices));
        checked(sw_proxy_triangles(proxy, t, made.n_triangles));
        checked(sw_proxy_nearest(proxy, nearest, n));
        for (int k = 0; k < 3; k++) clamped[k] = nearest[held[k]];
        sw_mesh_desc_init(&mesh);
        mesh.position_format = SW_FORMAT_F64, mesh.positions = x, mesh.n_vertices = made.n_vertices;
        mesh.triangles = t, mesh.n_triangles = made.n_triangles;
        SwSupportDesc supports;
        sw_support_desc_init(&supports);
        supports.clamped = clamped, supports.n_clamped = 3;""", """
        double hertz[16];
        uint32_t count;
        checked(sw_model_frequencies(model, hertz, 16, &count));
        expect(hertz[0] > 0, "the model on the proxy swings");"""),
                    ("sw_binding_create", READY + """
        float vertices[n][3], normals[n][3], vertices_out[n][3], normals_out[n][3], velocities_out[n][3];
        memcpy(vertices, positions, sizeof vertices);
        for (int v = 0; v < n; v++) normals[v][0] = normals[v][1] = 0, normals[v][2] = 1;
        for (int frame = 0; frame < 3; frame++) checked(sw_state_step(state, 1.0 / 30));""", """
        read_positions();
        for (int v = 0; v < n; v++) expect(fabsf(vertices_out[v][2] - positions[v][2]) < 1e-6f, "points on vertices follow them");
        expect(velocities_out[n - 1][2] < -0.1f && normals_out[12][0] > 0.01f, "the tip falls, and the strip turns near its support");""")],
    "materials": [
        ("young_across", "begin(); material.thickness = 1e-3; material.volume_density = 500;",
         STIFFER.replace("EQUAL", "material.thickness = 1e-3; material.volume_density = 500; material.energy = SW_ENERGY_KOITER; "
                         "material.young = 3e9; material.poisson = 0.3") % "directions change the frequency"),
        ("sw_state_set_frequency", READY + " const double wanted = 2;",
         'expect(factor > 0, "there is a factor"); read_positions(); expect(fabsf(positions[n - 1][2] + 0.03f) < 1e-3f, "it hangs so far");'),
        ("crease_factors", "begin();", STIFFER.replace("EQUAL", "") % "creases change the frequency"),
    ],
}

PYTHON = """
import numpy
import shellwarp
from shellwarp import *
positions = numpy.array([[i / 20, j / 20, 0] for i in range(21) for j in range(3)], numpy.float32)
triangles = numpy.array([t for i in range(20) for a in (3 * i, 3 * i + 1) for t in ((a, a + 3, a + 4), (a, a + 4, a + 1))])
material = Material(bend=0.02, density=0.3, area=5e3, length=5e3)
model = Model(Shell(positions, triangles, material, clamped=[0, 1, 2]))
BEFORE
PIECE
AFTER
"""
STATE = "\nstate = model.state()\nstate.set_gravity([0, 0, -9.8])"
PYTHON_OF = {
    "contact": [("Collider.sphere", "model.precompute()" + STATE, "assert state.positions()[:, 2].min() > -1 - 1e-3"),
                ("Collider.hull", "model.precompute()", """
for shell, down in ((upper, 1), (lower, -1)):   # the lower one is pushed up
    shell.set_gravity([0, 0, -9.8 * down])
    shell.set_damping(0.1)
    for frame in range(60):
        shell.step(1 / 30)
    assert abs((down * shell.positions()[:, 2]).min() + 0.098) < 1e-4   # of a strip of 1 m, what is left of a gap is 2e-5
""")],
    "moving_supports": [("support_fields", "", "assert model.frequencies()[0] > 0"),
                        ("move_supports", "skinned = positions + numpy.float32([0, 0, 0.01]); model.precompute(support_fields=24)" + STATE,
                         "assert abs(state.positions()[:3, 2] - 0.01).max() < 1e-6")],
    "render_mesh": [("Proxy(", "pinned = positions[:, 0] < 0.01; model.precompute()", "assert proxy.positions().shape[1] == 3"),
                    ("bound_points", "vertices = positions; normals = [0, 0, 1] + 0 * positions; model.precompute()" + STATE,
                     "assert sorted(drawn) == ['normals', 'positions', 'velocities']")],
    "materials": [("directions_of_uvs", "uvs = positions[:, :2]; model.precompute()", ""),
                  ("set_frequency", "model.precompute()" + STATE, ""),
                  ("rest_positions", "flat = positions; curled = positions + [0, 0, 0.01] * positions[:, :1] ** 2; model.precompute()", ""),
                  ("growth", "at_the_rim = (positions[:, 1] > 0.09).astype(float)", "")],
}


def pieces(page):
    text = re.sub(r"^```.*?^```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.S | re.M)
    return [re.sub(r"^    ", "", block, flags=re.M) for block in BLOCK.findall(text)]


def is_c(piece):
    return bool(re.search(r"\bsw_\w+\(|\bSw[A-Z]\w+ |\bmaterial\.\w+ = .*;", piece))


def is_python(piece):
    if is_c(piece) or piece.lstrip().startswith("["):
        return False
    try:
        ast.parse(piece)
    except SyntaxError:
        return False
    return "(" in piece


def of(table, page, piece):
    found = [(before, after) for word, before, after in table.get(page, []) if word in piece]
    assert len(found) == 1, f"{page}: no test of this piece:\n{piece}"
    return found[0]


def run_c(page, piece, folder, build, include, compiler):
    before, after = of(C, page, piece)
    # Each call of the piece goes through `checked`.
    called = sorted(name for name in set(re.findall(r"\bsw_\w+(?=\()", piece)) if not name.endswith("_init"))
    macros = "\n".join(f"#define {name}(...) checked({name}(__VA_ARGS__))" for name in called)
    source = folder / f"{page}.c"
    source.write_text(f"{STRIP}\nint main(void) {{\n{before}\n{macros}\n{piece}\n{after}\nreturn 0;\n}}\n", encoding="utf-8")
    program = source.with_suffix("")
    subprocess.run([compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-unused-value", f"-I{include}", source,
                    "-o", program, f"-L{build / 'lib'}", f"-Wl,-rpath,{build / 'lib'}", "-lshellwarp", "-lm"], check=True)
    subprocess.run([program], check=True)


def run_python(page, piece, python, environment):
    before, after = of(PYTHON_OF, page, piece)
    # An ellipsis stands for what the strip has.
    piece = piece.replace("Sheet(...)", "Sheet(3e9, 0.3, 1e-3, 800)").replace("clamped=[...]", "clamped=[0, 1, 2]")
    piece = piece.replace("Shell(...,", "Shell(positions, triangles, Sheet(3e9, 0.3, 1e-3, 800, young_across=1e9), clamped=[0, 1, 2],")
    program = PYTHON.replace("BEFORE", before).replace("PIECE", piece).replace("AFTER", after)
    done = subprocess.run([python, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{page}:\n{piece}\n{done.stderr}"


def main():
    folder, build, include, compiler = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), sys.argv[3], sys.argv[4]
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "host_examples" / "python"), "SHELLWARP_LIBRARY": str(library(build))}
    pythons = [python for python in (str(ROOT / ".venv" / "bin" / "python"), sys.executable) if has_numpy(python)]
    ran = {"C": 0, "Python": 0}
    for page in sorted({*C, *PYTHON_OF}):
        path = next(path for path in (ROOT / "docs").glob(f"*/{page}.md") if path.parent.name != "theory")
        for piece in pieces(path):
            if is_c(piece):
                run_c(page, piece, folder, build, include, compiler)
                ran["C"] += 1
            elif is_python(piece) and pythons:
                run_python(page, piece, pythons[0], environment)
                ran["Python"] += 1
    assert ran["C"] == sum(map(len, C.values())), ran
    if not pythons:
        print("skipped: the pieces of Python, which need numpy")
    else:
        assert ran["Python"] == sum(map(len, PYTHON_OF.values())), ran
    print(f"pages: {ran['C']} pieces of C, {ran['Python']} of Python")


if __name__ == "__main__":
    main()
