// Claims about the library as a WebAssembly module, in node: `make test-wasm`.
//
//   SHELLWARP_WASM=target/wasm32-unknown-unknown/release/shellwarp.wasm SHELLWARP_LAYOUT=layout.json node --test tests/wasm/

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Library } from '../../host_examples/npm/module.mjs';

const module = new WebAssembly.Module(readFileSync(process.env.SHELLWARP_WASM));
const layout = JSON.parse(readFileSync(process.env.SHELLWARP_LAYOUT));
const C = layout.constants;
const fresh = () => new Library(new WebAssembly.Instance(module, {}), layout);

const SIDE = 9, N = SIDE * SIDE, TIP = N - 1;

// A square sheet of side 1, its first row clamped.
function sheet(library) {
  const positions = new Float64Array(3 * N), triangles = [];
  for (let v = 0; v < N; ++v) positions.set([Math.floor(v / SIDE) / (SIDE - 1), (v % SIDE) / (SIDE - 1), 0], 3 * v);
  for (let i = 0; i + 1 < SIDE; ++i) {
    for (let j = 0; j + 1 < SIDE; ++j) {
      const a = SIDE * i + j, b = a + SIDE;
      triangles.push(a, b, b + 1, a, b + 1, a + 1);
    }
  }
  const held = Uint32Array.from({ length: SIDE }, (_, v) => v);
  const mesh = library.struct('SwMeshDesc', {
    positions: library.put(positions), position_format: C.SW_FORMAT_F64, n_vertices: N,
    triangles: library.put(Uint32Array.from(triangles)), n_triangles: triangles.length / 3,
  });
  const supports = library.struct('SwSupportDesc', { clamped: library.put(held), n_clamped: SIDE });
  const out = library.alloc(4);
  library.call('sw_model_create', mesh, 0, supports, out);
  return library.view.getUint32(out, true);
}

function precomputed(library, values = {}) {
  const model = sheet(library);
  library.call('sw_model_precompute', model, library.struct('SwPrecomputeDesc', { modes: 6, ...values }));
  return model;
}

function state(library, model, method) {
  const out = library.alloc(4);
  library.call('sw_state_create', model, library.struct('SwStateDesc', { method }), out);
  const made = library.view.getUint32(out, true);
  library.call('sw_state_set_gravity', made, library.put(Float64Array.of(0, 0, -9.8)));
  return made;
}

function positions(library, made) {
  const at = library.alloc(12 * N);
  library.call('sw_state_positions', made, C.SW_SPACE_WORLD, C.SW_FORMAT_F32, at, 0n, N);
  return library.bytes(at, 12 * N).slice();
}

const height = (bytes) => new Float32Array(bytes.buffer)[3 * TIP + 2];

test('the module asks nothing of the page', () => {
  assert.deepEqual(WebAssembly.Module.imports(module), []);
});

test('every function of the header is exported', () => {
  const exported = new Set(WebAssembly.Module.exports(module).map(({ name }) => name));
  const listed = readFileSync(new URL('../c/exported_symbols.txt', import.meta.url), 'utf8').split('\n').filter((line) => /^sw_/.test(line));
  assert.ok(listed.length > 40);
  assert.deepEqual(listed.filter((name) => !exported.has(name)), []);
});

test('a precompute with training needs no clock, and tells no seconds', () => {
  const library = fresh(), model = precomputed(library, { reduced_fields: 12 });
  const info = library.struct('SwModelInfo');
  library.call('sw_model_info', model, info);
  for (let phase = 0; phase < C.SW_PHASE_CAPACITY; ++phase) assert.equal(library.f64(info, 'SwModelInfo', 'seconds', phase), 0);
});

for (const [name, method, values] of [
  ['the warp', 'SW_METHOD_WARP', {}],
  ['rotation-strain', 'SW_METHOD_ROTATION_STRAIN', {}],
  ['the reduced shell', 'SW_METHOD_REDUCED_SHELL', { reduced_fields: 12 }],
  ['the polynomial shell', 'SW_METHOD_POLYNOMIAL_SHELL', { reduced_fields: 12 }],
  ['the full shell', 'SW_METHOD_SHELL_IMPLICIT', {}],
]) {
  test(`${name} falls under gravity`, () => {
    const library = fresh(), made = state(library, precomputed(library, values), C[method]);
    library.call('sw_state_step', made, 1 / 60);
    const first = height(positions(library, made));
    for (let frame = 0; frame < 5; ++frame) library.call('sw_state_step', made, 1 / 60);
    const later = height(positions(library, made));
    assert.ok(first < 0 && later < first, `${first} ${later}`);
  });
}

test('many states step in one call where threads are asked for, with the same bits as one by one', () => {
  const library = fresh(), model = precomputed(library);
  const many = Array.from({ length: 400 }, () => state(library, model, C.SW_METHOD_WARP));
  const alone = state(library, model, C.SW_METHOD_WARP);
  library.call('sw_set_threads', 2);
  const list = library.put(Uint32Array.from(many));
  for (let frame = 0; frame < 3; ++frame) {
    library.call('sw_states_step', list, many.length, 1 / 60, 0);
    library.call('sw_state_step', alone, 1 / 60);
  }
  const expected = positions(library, alone);
  assert.ok(height(expected) < 0);
  for (const made of [many[0], many[399]]) assert.deepEqual(positions(library, made), expected);
});

test('a saved model comes back with the same bits, in another instance', () => {
  const library = fresh(), model = precomputed(library), size = library.alloc(8);
  library.call('sw_model_save', model, 0, 0n, size);
  const length = library.view.getBigUint64(size, true), at = library.alloc(Number(length));
  library.call('sw_model_save', model, at, length, size);
  const other = fresh(), out = other.alloc(4);
  other.call('sw_model_load', other.put(library.bytes(at, Number(length)).slice()), length, out);
  const both = [[library, model], [other, other.view.getUint32(out, true)]].map(([where, which]) => {
    const made = state(where, which, C.SW_METHOD_WARP);
    for (let frame = 0; frame < 5; ++frame) where.call('sw_state_step', made, 1 / 60);
    return positions(where, made);
  });
  assert.deepEqual(both[0], both[1]);
});

test('progress is told to a function of the page, which may stop the work', () => {
  const library = fresh(), told = [];
  const answer = (stop) => library.callback(['i32', 'i32', 'f64'], 'i32', (_user, phase, fraction) => {
    told.push([phase, fraction]);
    return stop ? C.SW_PROGRESS_CANCEL : C.SW_PROGRESS_CONTINUE;
  });
  precomputed(library, { progress: answer(false) });
  assert.ok(told.length > 4 && told.every(([, fraction]) => fraction >= 0 && fraction <= 1));
  assert.throws(() => precomputed(library, { progress: answer(true) }), new RegExp(`status ${C.SW_ERROR_CANCELLED}`));
});

test('memory is given, aligned, given back, and refused where there is none', () => {
  const { calls } = fresh();
  const at = calls.sw_alloc(1000);
  assert.ok(at > 0 && at % 16 === 0);
  calls.sw_free(at, 1000);
  assert.equal(calls.sw_alloc(1000), at);
  assert.equal(calls.sw_alloc(0x7fffffff), 0);
  calls.sw_free(0, 16);
});

test('what is wrong is a status with the words of the library', () => {
  const library = fresh();
  assert.throws(() => library.call('sw_model_create', 0, 0, 0, 0), /status 1: /);
});
