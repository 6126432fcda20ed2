// Deterministic states have the bits of every other platform: the runs of tests/c/same_bits_test.c, in node.
//
//   SHELLWARP_WASM=… SHELLWARP_LAYOUT=… node --test tests/wasm/

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Library } from '../../host_examples/npm/module.mjs';

const module = new WebAssembly.Module(readFileSync(process.env.SHELLWARP_WASM));
const layout = JSON.parse(readFileSync(process.env.SHELLWARP_LAYOUT));
const C = layout.constants;
const saved = (name) => readFileSync(new URL(`../data/saved/${name}`, import.meta.url));

const COLUMNS = 41, ROWS = 3, N = COLUMNS * ROWS, FRAMES = 48, STEP = 1 / 64;
const vertex = (column, row) => column * ROWS + row;
const rest = Float64Array.from({ length: 3 * N }, (_, i) => {
  const v = Math.floor(i / 3);
  return [4 * Math.floor(v / ROWS) / (COLUMNS - 1), 0.2 * (v % ROWS) / (ROWS - 1) - 0.2 / 2, 0][i % 3];
});

// A turn about z whose half angle has the tangent t, by divisions alone.
function turnAboutZ(t) {
  const c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
  return [c, -s, 0, s, c, 0, 0, 0, 1];
}

function setLoads(library, state) {
  const put = (...numbers) => library.put(Float64Array.from(numbers));
  library.call('sw_state_set_gravity', state, put(0.03125, 0.125, -0.25));
  library.call('sw_state_set_damping', state,
    library.struct('SwDampingDesc', { ratios: put(0.03125), n_ratios: 1 }, { stiffness_coefficient: 0.0009765625 }));
  library.call('sw_state_set_wind', state,
    library.struct('SwWindDesc', {}, { velocity: [0, 0.5, 0.25], density: 0.125, normal_drag: 1, tangential_drag: 0.0625 }));
  library.call('sw_state_set_forces', state, library.struct('SwForceDesc', {
    vertices: library.put(Uint32Array.of(N - 2)), forces: put(0, 0.0009765625, 0.001953125), format: C.SW_FORMAT_F64, count: 1,
  }));
}

// A turning frame, and from a third to two thirds of the time a soft and a turned handle.
function lead(library, state, method, k) {
  library.call('sw_state_set_frame', state,
    library.struct('SwFrameDesc', {}, { origin: [0.0009765625 * k * k, 0, 0], rotation: turnAboutZ(0.0078125 * k) }));
  if (k === 32) library.call('sw_state_clear_constraint', state, C.SW_ALL_CONSTRAINTS);
  if (k < 16 || k >= 32) return;
  library.call('sw_state_set_constraint', state, library.struct('SwConstraintDesc',
    { id: 1, kind: C.SW_CONSTRAINT_POSITION, vertex: vertex(COLUMNS - 1, 0) },
    { compliance: 0.25, position: [3.5, 0.0625 * (k - 16), 0.5] }));
  if (method === C.SW_METHOD_LMA) return;
  library.call('sw_state_set_constraint', state, library.struct('SwConstraintDesc',
    { id: 2, kind: C.SW_CONSTRAINT_ORIENTATION, vertex: vertex((COLUMNS - 1) / 2, 1) },
    { compliance: 0.5, rotation: turnAboutZ(0.015625 * k) }));
}

function setColliders(library, state) {
  const made = [[C.SW_COLLIDER_SPHERE, 0.5, 0], [C.SW_COLLIDER_CAPSULE, 0.125, 1]].map(([kind, radius, half_length]) => {
    const out = library.alloc(4);
    library.call('sw_collider_create', library.struct('SwColliderDesc', { kind }, { radius, half_length, friction: 0.5 }), out);
    return library.view.getUint32(out, true);
  });
  library.call('sw_state_set_colliders', state, library.put(Uint32Array.from(made)), 2);
}

// A ball that comes from below, and a capsule that lies across and turns.
function moveColliders(library, state, k) {
  const pose = (values) => library.struct('SwColliderPoseDesc', {}, values);
  library.call('sw_state_move_collider', state, 0, pose({ origin: [2, 0, -0.75 + 0.015625 * k] }));
  library.call('sw_state_move_collider', state, 1, pose({ origin: [3.5, 0, -0.25], rotation: turnAboutZ(0.0078125 * k) }));
}

// The far end moves in and is sheared.
function moveSupports(library, state, k) {
  const x = rest.slice();
  for (let v = Math.floor(N / 2); v < N; ++v) {
    x[3 * v] += 0.0009765625 * k;
    x[3 * v + 2] += 0.00390625 * k * (1 + rest[3 * v + 1]);
  }
  library.call('sw_state_move_supports', state, C.SW_FORMAT_F64, library.put(x), 0n, N, 0);
}

// The whole shape gets longer, moves aside and is bent along its length.
function moveRest(library, state, k) {
  const x = rest.slice();
  for (let v = 0; v < N; ++v) {
    x[3 * v] = (1 + 0.0009765625 * k) * rest[3 * v];
    x[3 * v + 1] = rest[3 * v + 1] + 0.0009765625 * k;
    x[3 * v + 2] = 0.00048828125 * k * rest[3 * v] * rest[3 * v];
  }
  library.call('sw_state_move_rest', state, C.SW_FORMAT_F64, library.put(x), 0n, N, 0);
}

// FNV-1a of 64 bits.
function hashed(hash, bytes) {
  for (const byte of bytes) hash = ((hash ^ BigInt(byte)) * 0x100000001b3n) & 0xffffffffffffffffn;
  return hash;
}

function hashedOutput(library, hash, state, method) {
  const read = (name, space, format, size) => {
    const out = library.alloc(size);
    library.call(name, state, space, format, out, 0n, N);
    hash = hashed(hash, library.bytes(out, size));
  };
  read('sw_state_positions', C.SW_SPACE_WORLD, C.SW_FORMAT_F64, 24 * N);
  read('sw_state_positions', C.SW_SPACE_FRAME, C.SW_FORMAT_F32, 12 * N);
  if (method !== C.SW_METHOD_LMA) read('sw_state_rotations', C.SW_SPACE_WORLD, C.SW_FORMAT_F64, 32 * N);
  return hash;
}

const METHODS = {
  linear: 'SW_METHOD_LMA', warp: 'SW_METHOD_WARP', 'virtual-work': 'SW_METHOD_WARP_VIRTUAL_WORK',
  'rotation-strain': 'SW_METHOD_ROTATION_STRAIN', reduced: 'SW_METHOD_REDUCED_SHELL', polynomial: 'SW_METHOD_POLYNOMIAL_SHELL',
};

// The integrator of the runs whose names do not say it.
const EXACT = ['warp-supports', 'linear-supports', 'warp-rest', 'linear-rest'];

function played(name) {
  const library = new Library(new WebAssembly.Instance(module, {}), layout), out = library.alloc(4);
  const bytes = saved(name.endsWith('supports') ? 'same_bits_f64.bin' : 'same_bits_f32.bin');
  library.call('sw_model_load', library.put(bytes), BigInt(bytes.length), out);
  const method = C[Object.entries(METHODS).find(([key]) => name.startsWith(key))[1]];
  const exact = name.endsWith('exact') || EXACT.includes(name);
  const integrator = exact ? C.SW_INTEGRATOR_EXACT : C.SW_INTEGRATOR_IMPLICIT_EULER;
  const desc = library.struct('SwStateDesc', { method, integrator, flags: C.SW_STATE_DETERMINISTIC });
  library.call('sw_state_create', library.view.getUint32(out, true), desc, out);
  const state = library.view.getUint32(out, true);
  setLoads(library, state);
  if (name.endsWith('contact')) setColliders(library, state);
  let hash = 0xcbf29ce484222325n;
  for (let k = 0; k < FRAMES; ++k) {
    library.within(() => {
      if (name.endsWith('contact')) moveColliders(library, state, k);
      else if (name.endsWith('supports')) moveSupports(library, state, k);
      else if (name.endsWith('rest')) moveRest(library, state, k);
      else lead(library, state, method, k);
      library.call('sw_state_step', state, k % 3 ? STEP : 2 * STEP);
      if (k % 8 === 7) hash = hashedOutput(library, hash, state, method);
    });
  }
  return hash.toString(16).padStart(16, '0');
}

const expected = saved('same_bits.txt').toString().trim().split('\n').map((line) => line.split(' '));

test('there are runs', () => assert.ok(expected.length >= 22));

for (const [hash, name] of expected) {
  test(`${name} has the bits of every other platform`, () => assert.equal(played(name), hash));
}
