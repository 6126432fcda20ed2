"""See README.md here."""

import re
import sys
from pathlib import Path

import cffi

header, library, out = sys.argv[1:]
text = Path(header).read_text(encoding="utf-8")
text = re.sub(r"#(ifdef __cplusplus|ifndef SHELLWARP_NO_INLINE).*?#endif", "", text, flags=re.S)
ffi = cffi.FFI()
ffi.cdef(re.sub(r"^#(?!define SW_\w+ \d).*$", "", text, flags=re.M))
lib = ffi.dlopen(library)


def check(status):
    if status != lib.SW_OK:
        sys.exit(ffi.string(lib.sw_last_error_message()).decode())


def initialised(name):
    desc = ffi.new(f"Sw{name}Desc *")
    lib.sw_struct_init(desc, ffi.sizeof(desc[0]))
    return desc


points = ffi.new("float[]", [x for i in range(31) for j in range(4) for x in (i / 64, j / 64, 0)])
triangles = ffi.new("uint32_t[]", [v for i in range(30) for a in range(4 * i, 4 * i + 3)
                                   for v in (a, a + 4, a + 5, a, a + 5, a + 1)])
held = ffi.new("uint32_t[]", list(range(8)))
mesh, card, supports, precompute = map(initialised, ("Mesh", "Material", "Support", "Precompute"))
mesh.position_format, mesh.positions, mesh.n_vertices = lib.SW_FORMAT_F32, points, 124
mesh.triangles, mesh.n_triangles = triangles, 180
card.area_density, card.k_bend, card.k_area, card.k_length = 0.25, 1 / 256, 4096, 4096
supports.fixed, supports.n_fixed, precompute.modes = held, 8, 12
model, state, heard = ffi.new("SwModel **"), ffi.new("SwState **"), []


@ffi.callback("uint32_t(void *, uint32_t, double)")
def progress(_user, phase, _fraction):
    heard.append(phase)
    return lib.SW_PROGRESS_CONTINUE


precompute.progress = progress
check(lib.sw_model_create(mesh, card, supports, model))
check(lib.sw_model_precompute(model[0], precompute))
assert set(heard) >= {lib.SW_PHASE_ASSEMBLY, lib.SW_PHASE_MODES}, heard
check(lib.sw_state_create(model[0], ffi.NULL, state))
check(lib.sw_state_set_gravity(state[0], ffi.new("double[]", [0, 1, -8])))
damping, handle, ratio = initialised("Damping"), initialised("Constraint"), ffi.new("double[]", [0.125])
damping.ratios, damping.n_ratios = ratio, 1
check(lib.sw_state_set_damping(state[0], damping))
handle.id, handle.kind, handle.vertex, handle.axes = 7, lib.SW_CONSTRAINT_POSITION, 123, lib.SW_AXIS_Z
for frame in range(1, 61):
    handle.position[2] = frame / 1024
    check(lib.sw_state_set_constraint(state[0], handle))
    check(lib.sw_state_step(state[0], 1 / 32))
check(lib.sw_state_positions(state[0], lib.SW_SPACE_WORLD, lib.SW_FORMAT_F32, points, 0, 124))
lib.sw_state_destroy(state[0])
lib.sw_model_destroy(model[0])
Path(out).write_bytes(bytes(ffi.buffer(points)))
