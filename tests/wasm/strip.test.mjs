// The strip of tests/callers, in node: its motion is compared with the other platforms' in docs/reference/platforms.md.
//
//   SHELLWARP_WASM=… SHELLWARP_LAYOUT=… node --test tests/wasm/strip.test.mjs

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Library } from '../../host_examples/npm/module.mjs';

const module = new WebAssembly.Module(readFileSync(process.env.SHELLWARP_WASM));
const layout = JSON.parse(readFileSync(process.env.SHELLWARP_LAYOUT));
const C = layout.constants;

const ROWS = 31, COLUMNS = 4, N = ROWS * COLUMNS, FRAMES = 60, CORNER = N - 1;

function precomputed(library) {
  const points = Float32Array.from({ length: 3 * N }, (_, i) => {
    const v = Math.floor(i / 3);
    return [Math.floor(v / COLUMNS) / 64, (v % COLUMNS) / 64, 0][i % 3];
  });
  const triangles = [];
  for (let i = 0; i + 1 < ROWS; ++i) {
    for (let a = COLUMNS * i; a < COLUMNS * i + COLUMNS - 1; ++a) triangles.push(a, a + 4, a + 5, a, a + 5, a + 1);
  }
  const mesh = library.struct('SwMeshDesc', {
    positions: library.put(points), position_format: C.SW_FORMAT_F32, n_vertices: N,
    triangles: library.put(Uint32Array.from(triangles)), n_triangles: triangles.length / 3,
  });
  const card = library.struct('SwMaterialDesc', {}, { area_density: 0.25, k_bend: 1 / 256, k_area: 4096, k_length: 4096 });
  const held = Uint32Array.from({ length: 8 }, (_, v) => v);
  const supports = library.struct('SwSupportDesc', { fixed: library.put(held), n_fixed: held.length });
  const out = library.alloc(4);
  library.call('sw_model_create', mesh, card, supports, out);
  const model = library.view.getUint32(out, true);
  library.call('sw_model_precompute', model, library.struct('SwPrecomputeDesc', { modes: 12 }));
  return model;
}

function led(library, state) {
  library.call('sw_state_set_gravity', state, library.put(Float64Array.of(0, 1, -8)));
  library.call('sw_state_set_damping', state, library.struct('SwDampingDesc', { ratios: library.put(Float64Array.of(0.125)), n_ratios: 1 }));
  for (let frame = 1; frame <= FRAMES; ++frame) {
    library.within(() => {
      library.call('sw_state_set_constraint', state, library.struct('SwConstraintDesc',
        { id: 7, kind: C.SW_CONSTRAINT_POSITION, vertex: CORNER, axes: C.SW_AXIS_Z }, { position: [0, 0, frame / 1024] }));
      library.call('sw_state_step', state, 1 / 32);
    });
  }
}

test('the strip is led to where its handle is', (t) => {
  const library = new Library(new WebAssembly.Instance(module, {}), layout), out = library.alloc(4);
  library.call('sw_state_create', precomputed(library), library.struct('SwStateDesc', {}), out);
  const state = library.view.getUint32(out, true);
  led(library, state);
  const at = library.alloc(12 * N);
  library.call('sw_state_positions', state, C.SW_SPACE_WORLD, C.SW_FORMAT_F32, at, 0n, N);
  const bytes = library.bytes(at, 12 * N).slice(), points = new Float32Array(bytes.buffer);
  assert.ok(Math.abs(points[3 * CORNER + 2] - FRAMES / 1024) < 1e-6, `${points[3 * CORNER + 2]}`);   // float32 of a shell half a unit long
  assert.ok(points.every(Number.isFinite));
  t.diagnostic(`strip ${createHash('sha256').update(bytes).digest('hex')}`);   // read by tests/check_platforms.py
});
