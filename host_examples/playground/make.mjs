// Writes the playground: one page that holds the library, its workers, the shells and their saved models.
//
//   node make.mjs SHELLWARP_WASM LAYOUT_JSON FOLDER [--for-tests]
//
// --for-tests trains the dinosaur by one pose, in a quarter of the time. Saved models stay in FOLDER/models until the module is newer.

import { build } from 'esbuild';
import { existsSync, mkdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { gzipSync } from 'node:zlib';
import { stripped } from '../npm/strip.mjs';
import { SHAPES, shapeOf } from './shapes.mjs';
import { precompute, startLibrary } from './shell.mjs';

const here = import.meta.dirname, meshes = path.join(here, '../../tests/data/meshes');
const [wasmFile, layoutFile, folder, forTests] = process.argv.slice(2);
const layout = JSON.parse(readFileSync(layoutFile));
const recipes = ['shell.mjs', 'shapes.mjs'].map((file) => path.join(here, file));

const newerThan = (file, others) => existsSync(file) && others.every((other) => statSync(file).mtimeMs >= statSync(other).mtimeMs);

async function savedModel(wasm, shape, mesh) {
  const file = path.join(folder, 'models', `${shape.name}.bin`);
  if (!newerThan(file, [wasmFile, ...recipes])) {
    const library = await startLibrary(wasm, layout), start = Date.now();
    writeFileSync(file, precompute(library, mesh, { ...shape, poses: (forTests && shape.posesInTests) || shape.poses }));
    console.log(`playground: precomputed ${shape.label} (${mesh.positions.length / 3} vertices) in ${((Date.now() - start) / 1000).toFixed(0)} s`);
  }
  return readFileSync(file);
}

function meshBytes({ positions, triangles, held }) {
  const counts = Uint32Array.of(positions.length / 3, triangles.length / 3, held.length);
  return Buffer.concat([counts, Float32Array.from(positions), triangles, held].map((a) => Buffer.from(a.buffer, a.byteOffset, a.byteLength)));
}

async function bundled(entry) {
  const known = { name: 'layout', setup: (made) => {
    made.onResolve({ filter: /^layout\.json$/ }, () => ({ path: path.resolve(layoutFile), namespace: 'layout' }));
    made.onLoad({ filter: /.*/, namespace: 'layout' }, () => ({ contents: JSON.stringify(layout), loader: 'json' }));
  } };
  const { outputFiles } = await build({ entryPoints: [path.join(here, entry)], bundle: true, minify: true, format: 'iife', write: false, plugins: [known], logLevel: 'warning' });
  return outputFiles[0].text.replaceAll('</script', '<\\/script');
}

const embedded = (id, bytes) => `<script id="${id}" type="application/octet-stream">${gzipSync(bytes, { level: 9 }).toString('base64')}</script>`;

mkdirSync(path.join(folder, 'models'), { recursive: true });
const wasm = stripped(readFileSync(wasmFile)), parts = [embedded('wasm', wasm)];
for (const shape of SHAPES) {
  const mesh = shapeOf(shape, (file) => readFileSync(path.join(meshes, file), 'utf8'));
  parts.push(embedded(`mesh-${shape.name}`, meshBytes(mesh)), embedded(`model-${shape.name}`, await savedModel(wasm, shape, mesh)));
}
parts.push(`<script id="shapes-list" type="application/json">${JSON.stringify(SHAPES.map(({ name, label, frequency, fields, poses, soft }) => ({ name, label, frequency, fields, poses, soft })))}</script>`);
parts.push(`<script id="worker" type="text/plain">${await bundled('worker.js')}</script>`);
const fill = { style: readFileSync(path.join(here, 'style.css'), 'utf8'), data: parts.join('\n'), script: await bundled('page.js') };
const page = readFileSync(path.join(here, 'page.html'), 'utf8').replace(/\{\{(\w+)\}\}/g, (_, name) => fill[name]);
writeFileSync(path.join(folder, 'index.html'), page);
console.log(`playground: ${path.join(folder, 'index.html')}, ${(page.length / 1e6).toFixed(1)} MB; open it in a browser`);
