// Claims about the npm package: packed, installed in a clean folder, used from node and from TypeScript.
//
//   SHELLWARP_NPM=out/npm/shellwarp node --test tests/wasm/package.test.mjs      (`make npm` does it)

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import os from 'node:os';
import path from 'node:path';
import { after, test } from 'node:test';
import { pathToFileURL } from 'node:url';

const source = path.join(import.meta.dirname, '../../host_examples/npm');
const packed = path.resolve(process.env.SHELLWARP_NPM), clean = mkdtempSync(path.join(os.tmpdir(), 'shellwarp-npm-'));
after(() => rmSync(clean, { recursive: true }));

const npm = (...words) => execFileSync('npm', words, { cwd: clean, encoding: 'utf8' });
writeFileSync(path.join(clean, 'package.json'), '{ "private": true, "type": "module" }');
const [{ filename, files }] = JSON.parse(npm('pack', '--json', packed));
npm('install', '--offline', '--no-audit', '--no-fund', path.join(clean, filename));
const { load, ShellwarpError, constants } = await import(pathToFileURL(createRequire(path.join(clean, 'x.js')).resolve('shellwarp')));

const ACROSS = 5, ALONG = 21, N = ACROSS * ALONG;

// A strip of 20 by 4 cm.
function strip() {
  const positions = [], triangles = [];
  for (let i = 0; i < ALONG; ++i) for (let j = 0; j < ACROSS; ++j) positions.push(0.01 * i, 0.01 * j, 0);
  for (let i = 0; i + 1 < ALONG; ++i) {
    for (let j = 0; j + 1 < ACROSS; ++j) {
      const a = ACROSS * i + j, b = a + ACROSS;
      triangles.push(a, b, b + 1, a, b + 1, a + 1);
    }
  }
  return { positions, triangles, clamped: Array.from({ length: ACROSS }, (_, j) => j), material: { preset: 'pet-bottle' } };
}

const shellwarp = await load();
const ready = (options = { modes: 6 }) => shellwarp.model(strip()).precompute(options);
const tip = (state) => state.positions()[3 * (N - 1) + 2];

test('the package holds the module, the wrapper, its types and the licences, and nothing of a machine', () => {
  const names = files.map((file) => file.path).sort();
  assert.deepEqual(names, ['LICENSE-APACHE', 'LICENSE-MIT', 'README.md', 'THIRD_PARTY.md', 'descriptors.d.ts', 'index.d.ts', 'index.mjs',
    'layout.mjs', 'module.mjs', 'package.json', 'shellwarp.wasm']);
  const wasm = readFileSync(path.join(packed, 'shellwarp.wasm'));
  assert.ok(wasm.length < 6e6, `${wasm.length} bytes`);
  assert.ok(!wasm.includes(os.homedir()) && !wasm.includes(path.resolve(source, '../..')));
});

test('its version is the library’s', () => {
  assert.equal(JSON.parse(readFileSync(path.join(packed, 'package.json'))).version, shellwarp.version);
});

test('the example of its README runs as it stands', () => {
  const [, code] = /```js\n([^]*?)```/.exec(readFileSync(path.join(packed, 'README.md'), 'utf8'));
  writeFileSync(path.join(clean, 'example.js'), code);
  const said = execFileSync('node', ['example.js'], { cwd: clean, encoding: 'utf8' });
  const error = Number(/^certified error (\d+\.\d) %$/m.exec(said)[1]);
  assert.ok(error < 20, said);
});

test('the example of docs/guide/webassembly.md runs', () => {
  const page = readFileSync(new URL('../../docs/guide/webassembly.md', import.meta.url), 'utf8');
  const code = /(?:^ {4}import \{ load \}.*\n)(?:(?: {4}.*)?\n)*/m.exec(page)[0].replace(/^ {4}/gm, '');
  const given = `const { positions, triangles, clamped } = ${JSON.stringify(strip())}, show = (phase, fraction) => {};\n`;
  writeFileSync(path.join(clean, 'guide.js'), `${given}${code}console.log(x.length, x[${3 * N - 1}]);\n`);
  const [length, height] = execFileSync('node', ['guide.js'], { cwd: clean, encoding: 'utf8' }).split(' ').map(Number);
  assert.ok(length === 3 * N && height < 0, `${length} ${height}`);
});

test('TypeScript takes what the types allow, and nothing else', (context) => {
  const tsc = path.join(source, 'node_modules/typescript/bin/tsc');
  try {
    readFileSync(tsc);
  } catch {
    context.skip('typescript is not installed: npm ci --prefix host_examples/npm');
    return;
  }
  copyFileSync(path.join(source, 'types_test.ts'), path.join(clean, 'types_test.ts'));
  const words = [tsc, '--noEmit', '--strict', '--target', 'es2022', '--module', 'nodenext', '--lib', 'es2022,dom', 'types_test.ts'];
  try {
    execFileSync('node', words, { cwd: clean, encoding: 'utf8' });
  } catch (error) {
    assert.fail(error.stdout);
  }
});

for (const method of ['warp', 'rotation-strain', 'reduced-shell', 'shell-implicit']) {
  test(`${method} bends under gravity, and is certified`, () => {
    const model = ready({ modes: 6, reducedFields: 12 }), state = model.state({ method }).setGravity([0, 0, -9.81]).setDamping({ massCoefficient: 1 });
    for (let frame = 0; frame < 5; ++frame) state.step(1 / 60);
    assert.ok(tip(state) < -1e-4, `${tip(state)}`);
    state.equilibrium();
    const { error } = state.certify();
    assert.ok(error >= 0 && error < 0.3, `${error}`);
    state.destroy();
    model.destroy();
  });
}

test('a saved model and state go on in another instance with the same bits', async () => {
  const model = ready(), state = model.state({ deterministic: true }).setGravity([0, 0, -9.81]);
  state.step(1 / 60);
  const other = (await load()).loadModel(model.save()).state({ deterministic: true }).setGravity([0, 0, -9.81]).load(state.save());
  assert.deepEqual(other.step(1 / 60).positions(), state.step(1 / 60).positions());
});

test('handles, frames, forces, wind and colliders act', () => {
  const state = ready().state({ integrator: 'exact' }).setDamping({ ratios: 0.3 }), end = [0.2, 0.04, 0.02];
  state.hold(1, { vertex: N - 1, position: end, axes: constants.SW_AXIS_Z });
  for (let frame = 0; frame < 5; ++frame) state.step(1 / 60);
  assert.ok(Math.abs(tip(state) - 0.02) < 1e-5);
  state.release().reset().setFrame({ origin: [0, 0, 1] }, { teleport: true }).step(1 / 60);
  assert.ok(Math.abs(tip(state) - 1) < 1e-6);
  state.setFrame({}, { teleport: true }).reset().setForces([0, 0, 0.001], [N - 1]).step(1 / 60);
  const pushed = tip(state);
  state.reset().setForces([]).setWind({ velocity: [0, 0, 5], density: 1.2, normalDrag: 1 }).step(1 / 60);
  assert.ok(pushed > 0 && tip(state) > 0);
  const ball = shellwarp.collider({ kind: 'sphere', radius: 0.05 });
  state.setWind({}).reset().setColliders([ball]).moveCollider(0, { origin: [0.2, 0.02, -0.04] });
  for (let frame = 0; frame < 20; ++frame) state.step(1 / 60);
  assert.ok(state.report().contactCount > 0 && tip(state) > 0.005, `${tip(state)}`);
});

test('progress is told, and stops the work; what it throws comes out', () => {
  const told = [];
  ready({ modes: 6, onProgress: (phase, fraction) => void told.push([phase, fraction]) });
  assert.ok(told.length > 4);
  const failing = (onProgress) => () => ready({ modes: 6, onProgress });
  assert.throws(failing(() => false), { name: 'CANCELLED' });
  assert.throws(failing(() => { throw new RangeError('mine'); }), /mine/);
});

test('mistakes are named', () => {
  assert.throws(() => shellwarp.model({ ...strip(), triangles: [0, 1, 900] }), (error) => error instanceof ShellwarpError && /900/.test(error.message));
  assert.throws(() => shellwarp.model({ ...strip(), positions: [0, 1] }), /positions has 2 numbers/);
  assert.throws(() => shellwarp.model({ ...strip(), material: { preset: 'tweed' } }), /no material tweed: .*denim/);
  assert.throws(() => shellwarp.model({ ...strip(), material: { stiffness: 1 } }), /no field stiffness: it has .*kBend/);
  assert.throws(() => shellwarp.model(strip()).state(), { name: 'NOT_PRECOMPUTED' });
  const model = ready(), state = model.state();
  assert.throws(() => model.state({ method: 'warped' }), /no method warped: warp/);
  assert.throws(() => state.setGravity([0, 0]), /3 numbers, not 2/);
  assert.throws(() => state.hold(1, { vertex: 0 }), /position or a rotation/);
  assert.throws(() => state.positions({ out: new Float32Array(3) }), /out has 3 numbers/);
  assert.throws(() => model.precompute({ modes: -1 }), /whole numbers/);
  state.destroy();
  state.destroy();
  assert.throws(() => state.step(1), /destroyed/);
});

test('a hundred models and states leave the memory as it was', () => {
  const cycle = () => {
    const model = ready({ modes: 2 }), state = model.state().setGravity([0, 0, -1]).step(1 / 60);
    state.positions();
    state.destroy();
    model.destroy();
  };
  const pages = () => shellwarp.methods && model.calls.library.calls.memory.buffer.byteLength;
  const model = ready({ modes: 2 });
  for (let i = 0; i < 20; ++i) cycle();
  const before = pages();
  for (let i = 0; i < 100; ++i) cycle();
  assert.equal(pages(), before);
});
