-- See README.md here.
local ffi = require("ffi")
local header, library, out = arg[1], arg[2], arg[3]

local text = assert(io.open(header)):read("*a")
text = text:gsub("/%*.-%*/", ""):gsub("//[^\n]*", ""):gsub("#ifdef __cplusplus.-#endif", "")
text = text:gsub("#ifndef SHELLWARP_NO_INLINE.-#endif", "")
local SW = {}
for name, value in text:gmatch("#define (SW_[%w_]+) (%d+)") do SW[name] = tonumber(value) end
text = text:gsub("%[(SW_[%w_]+)%]", function(name) return "[" .. SW[name] .. "]" end)
ffi.cdef((text:gsub("#[^\n]*", "")))
local lib = ffi.load(library)

local function check(status)
  if status ~= SW.SW_OK then error(ffi.string(lib.sw_last_error_message())) end
end

local function initialised(type_name)
  local desc = ffi.new(type_name)
  lib.sw_struct_init(desc, ffi.sizeof(desc))
  return desc
end

local points = ffi.new("float[124][3]")
for i = 0, 30 do
  for j = 0, 3 do points[4 * i + j][0], points[4 * i + j][1] = i / 64, j / 64 end
end
local triangles, n = ffi.new("uint32_t[540]"), 0
for i = 0, 29 do
  for a = 4 * i, 4 * i + 2 do
    for _, v in ipairs({a, a + 4, a + 5, a, a + 5, a + 1}) do triangles[n] = v; n = n + 1 end
  end
end
local held = ffi.new("uint32_t[8]", {0, 1, 2, 3, 4, 5, 6, 7})

local mesh = initialised("SwMeshDesc")
mesh.position_format, mesh.positions, mesh.n_vertices = SW.SW_FORMAT_F32, points, 124
mesh.triangles, mesh.n_triangles = triangles, 180
local card = initialised("SwMaterialDesc")
card.area_density, card.k_bend, card.k_area, card.k_length = 0.25, 1 / 256, 4096, 4096
local supports = initialised("SwSupportDesc")
supports.fixed, supports.n_fixed = held, 8
local precompute = initialised("SwPrecomputeDesc")
precompute.modes = 12

local model, state = ffi.new("SwModel *[1]"), ffi.new("SwState *[1]")
check(lib.sw_model_create(mesh, card, supports, model))
check(lib.sw_model_precompute(model[0], precompute))
check(lib.sw_state_create(model[0], nil, state))
check(lib.sw_state_set_gravity(state[0], ffi.new("double[3]", {0, 1, -8})))
local damping, ratio = initialised("SwDampingDesc"), ffi.new("double[1]", {0.125})
damping.ratios, damping.n_ratios = ratio, 1
check(lib.sw_state_set_damping(state[0], damping))
local handle = initialised("SwConstraintDesc")
handle.id, handle.kind, handle.vertex, handle.axes = 7, SW.SW_CONSTRAINT_POSITION, 123, SW.SW_AXIS_Z
for frame = 1, 60 do
  handle.position[2] = frame / 1024
  check(lib.sw_state_set_constraint(state[0], handle))
  check(lib.sw_state_step(state[0], 1 / 32))
end
check(lib.sw_state_positions(state[0], SW.SW_SPACE_WORLD, SW.SW_FORMAT_F32, points, 0, 124))
lib.sw_state_destroy(state[0])
lib.sw_model_destroy(model[0])
local file = assert(io.open(out, "wb"))
file:write(ffi.string(points, ffi.sizeof(points)))
file:close()
