// Writes the npm package into a folder: `make npm`.
//
//   node make.mjs SHELLWARP_WASM LAYOUT_JSON DESCRIPTORS_D_TS FOLDER

import { copyFileSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { stripped } from './strip.mjs';

const here = import.meta.dirname, root = path.join(here, '../..');
const [wasmFile, layoutFile, typesFile, folder] = process.argv.slice(2);
const version = /^version = "(.*)"/m.exec(readFileSync(path.join(root, 'Cargo.toml'), 'utf8'))[1];

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const into = (name) => path.join(folder, name);
for (const file of ['index.mjs', 'index.d.ts', 'module.mjs', 'README.md']) copyFileSync(path.join(here, file), into(file));
for (const file of ['LICENSE-MIT', 'LICENSE-APACHE', 'THIRD_PARTY.md']) copyFileSync(path.join(root, file), into(file));
copyFileSync(typesFile, into('descriptors.d.ts'));
writeFileSync(into('layout.mjs'), `// Written by layout.py from the C header, do not edit.\nexport default ${readFileSync(layoutFile, 'utf8').trim()};\n`);
writeFileSync(into('shellwarp.wasm'), stripped(readFileSync(wasmFile)));
const { name, devDependencies, ...rest } = JSON.parse(readFileSync(path.join(here, 'package.json'), 'utf8'));
writeFileSync(into('package.json'), `${JSON.stringify({ name, version, ...rest }, null, 2)}\n`);
console.log(`npm: ${folder}, version ${version}`);
