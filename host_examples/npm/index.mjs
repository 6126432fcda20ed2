// Thin shells in browsers and in node: models, states and colliders of the library, its memory and errors taken care of.

import layout from './layout.mjs';
import { Library } from './module.mjs';

const C = layout.constants;

/** What the library refused: `status` is a number of the C interface, `name` its word, such as "INVALID_MESH". */
export class ShellwarpError extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
    this.name = Object.keys(C).find((key) => key.startsWith('SW_ERROR_') && C[key] === status)?.slice(9) ?? 'ERROR';
  }
}

const snake = (name) => name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`);
const camel = (name) => name.replace(/_(\w)/g, (_, letter) => letter.toUpperCase());

/** Numbers of any kind as an array that the library reads, and its format. */
function floats(values) {
  const array = values instanceof Float32Array || values instanceof Float64Array ? values : Float64Array.from(values);
  return { array, format: array instanceof Float32Array ? C.SW_FORMAT_F32 : C.SW_FORMAT_F64 };
}

/** Positions along x, y and z for each vertex. */
function rows(values, name) {
  const found = floats(values);
  if (found.array.length % 3) throw new TypeError(`${name} has ${found.array.length} numbers, which are no rows of 3`);
  return { ...found, count: found.array.length / 3 };
}

const indices = (values) => (values instanceof Uint32Array ? values : Uint32Array.from(values ?? []));

/** Reads and writes structs by the names of their fields. */
class Calls {
  constructor(library) {
    this.library = library;
  }

  call(name, ...words) {
    const { calls } = this.library, status = calls[name](...words);
    if (status) throw new ShellwarpError(status, this.library.text(calls.sw_last_error_message()));
  }

  /** A struct at its defaults, and `values`: arrays of numbers where the struct has some, typed arrays for its pointers. */
  struct(type, values = {}) {
    const { library } = this, { bytes } = layout[type], start = library.alloc(bytes);
    library.calls.sw_struct_init(start, bytes);
    this.fill(type, start, values);
    return start;
  }

  fill(type, start, values) {
    const { at, kind } = layout[type];
    for (const [key, value] of Object.entries(values)) {
      const field = snake(key), [what, count] = kind[field] ?? [];
      if (!what) throw new TypeError(`${type} has no field ${key}: it has ${Object.keys(at).slice(1).map(camel).join(', ')}`);
      if (value === undefined || value === null) continue;
      const numbers = count > 1 ? Array.from(value) : [value];
      if (numbers.length !== count) throw new TypeError(`${key} takes ${count} numbers, not ${numbers.length}`);
      numbers.forEach((number, k) => this.write(start + at[field], what, k, number, key));
    }
  }

  write(at, what, k, value, key) {
    const { library } = this;
    if (what === 'pointer') {
      const address = typeof value === 'number' ? value : library.put(value);
      library.view.setUint32(at, address, true);
      return;
    }
    if (typeof value !== 'number') throw new TypeError(`${key} takes numbers`);
    if (what === 'f64') library.view.setFloat64(at + 8 * k, value, true);
    else if (!Number.isInteger(value) || value < 0) throw new TypeError(`${key} takes whole numbers from 0 on, not ${value}`);
    else if (what === 'u64') library.view.setBigUint64(at + 8 * k, BigInt(value), true);
    else library.view.setUint32(at + 4 * k, value, true);
  }

  /** The numbers of a struct that the library filled in. */
  read(type, start) {
    const { view } = this.library, { at, kind } = layout[type], out = {};
    const one = { u32: (x) => view.getUint32(x, true), u64: (x) => Number(view.getBigUint64(x, true)), f64: (x) => view.getFloat64(x, true) };
    const bytes = { u32: 4, u64: 8, f64: 8 };
    for (const [field, [what, count]] of Object.entries(kind)) {
      if (field === 'struct_size' || field.startsWith('reserved') || !one[what]) continue;
      const all = Array.from({ length: count }, (_, k) => one[what](start + at[field] + bytes[what] * k));
      out[camel(field)] = count > 1 ? all : all[0];
    }
    return out;
  }

  /** What a function fills in. */
  filled(name, type, ...before) {
    return this.library.within(() => {
      const out = this.struct(type);
      this.call(name, ...before, out);
      return this.read(type, out);
    });
  }

  /** The address of a new object, which `make` gets a place for. */
  made(make) {
    return this.library.within(() => {
      const out = this.library.alloc(4);
      make(out);
      return this.library.view.getUint32(out, true);
    });
  }

  /** The bytes of a function that is asked for their number first. */
  saved(name, object) {
    const { library } = this;
    return library.within(() => {
      const size = library.alloc(8);
      this.call(name, object, 0, 0n, size);
      const length = library.view.getBigUint64(size, true), at = library.alloc(Number(length));
      this.call(name, object, at, length, size);
      return library.bytes(at, Number(length)).slice();
    });
  }

  within(work) {
    return this.library.within(work);
  }

  put(array) {
    return this.library.put(array);
  }
}

/** An object of the library: used until `destroy`, which may be called again. */
class Handle {
  #at;
  #destroyer;

  constructor(calls, at, destroyer) {
    this.calls = calls;
    this.#at = at;
    this.#destroyer = destroyer;
  }

  /** Its address in the module's memory. */
  get at() {
    if (!this.#at) throw new TypeError('it was destroyed');
    return this.#at;
  }

  destroy() {
    if (this.#at) this.calls.library.calls[this.#destroyer](this.#at);
    this.#at = 0;
  }
}

/** A mesh with material and supports, and after `precompute` all that states need. */
export class Model extends Handle {
  constructor(calls, at) {
    super(calls, at, 'sw_model_destroy');
  }

  /** Modes, and fields where asked for. `onProgress(phase, fraction)` hears of it; what it returns as false cancels. */
  precompute({ onProgress, ...values } = {}) {
    const { calls } = this;
    let thrown;
    calls.within(() => {
      const progress = onProgress && calls.library.callback(['i32', 'i32', 'f64'], 'i32', (_user, phase, fraction) => {
        try {
          return onProgress(phase, fraction) === false ? C.SW_PROGRESS_CANCEL : C.SW_PROGRESS_CONTINUE;
        } catch (error) {
          thrown = error;
          return C.SW_PROGRESS_CANCEL;
        }
      });
      try {
        calls.call('sw_model_precompute', this.at, calls.struct('SwPrecomputeDesc', { ...values, progress }));
      } catch (error) {
        throw thrown ?? error;
      }
    });
    return this;
  }

  /** What it has: vertices, modes, fields, certificates, memory. */
  info() {
    return this.calls.filled('sw_model_info', 'SwModelInfo', this.at);
  }

  /** Hz of each mode. */
  frequencies() {
    const { calls } = this, { library } = calls;
    return calls.within(() => {
      const count = library.alloc(4);
      calls.call('sw_model_frequencies', this.at, 0, 0, count);
      const n = library.view.getUint32(count, true), out = library.alloc(8 * n);
      calls.call('sw_model_frequencies', this.at, out, n, count);
      return new Float64Array(library.bytes(out, 8 * n).slice().buffer);
    });
  }

  /** Whether states of a method can be made. */
  offers(method) {
    return this.calls.library.calls.sw_model_offers(this.at, numberOf(this.calls, method)) === C.SW_OK;
  }

  /** Bytes for `Shellwarp.loadModel`, here or on another machine. */
  save() {
    return this.calls.saved('sw_model_save', this.at);
  }

  /** A new state at rest, by a method's name. */
  state({ method, integrator = 'implicit-euler', deterministic = false } = {}) {
    const integrators = { 'implicit-euler': C.SW_INTEGRATOR_IMPLICIT_EULER, exact: C.SW_INTEGRATOR_EXACT, 'second-order': C.SW_INTEGRATOR_SECOND_ORDER };
    if (!(integrator in integrators)) throw new TypeError(`no integrator ${integrator}: implicit-euler, exact, second-order`);
    const { calls } = this;
    const at = calls.made((out) => calls.call('sw_state_create', this.at, calls.struct('SwStateDesc', {
      method: numberOf(calls, method), integrator: integrators[integrator], flags: deterministic ? C.SW_STATE_DETERMINISTIC : 0,
    }), out));
    return new State(calls, at, this.info().nVertices);
  }
}

function methodsOf({ library }) {
  const { calls } = library;
  return Array.from({ length: calls.sw_method_count() }, (_, k) => calls.sw_method_at(k))
    .map((number) => ({ number, name: library.text(calls.sw_method_name(number)), label: library.text(calls.sw_method_label(number)) }));
}

function numberOf(calls, name) {
  if (name === undefined) return 0;
  const methods = methodsOf(calls), found = methods.find((method) => method.name === name);
  if (!found) throw new TypeError(`no method ${name}: ${methods.map((method) => method.name).join(', ')}`);
  return found.number;
}

/** A moving shell. */
export class State extends Handle {
  constructor(calls, at, nVertices) {
    super(calls, at, 'sw_state_destroy');
    this.nVertices = nVertices;
  }

  #set(name, ...words) {
    this.calls.within(() => this.calls.call(name, this.at, ...words.map((word) => (typeof word === 'function' ? word() : word))));
    return this;
  }

  #vector(values) {
    if (values.length !== 3) throw new TypeError(`a vector has 3 numbers, not ${values.length}`);
    return () => this.calls.put(Float64Array.from(values));
  }

  /** Acceleration, world axes. */
  setGravity(gravity) {
    return this.#set('sw_state_set_gravity', this.#vector(gravity));
  }

  /** `ratios`: one fraction of critical damping for all modes, or one a mode; Rayleigh's coefficients beside. */
  setDamping({ ratios = [], ...values }) {
    const array = Float64Array.from([ratios].flat());
    return this.#set('sw_state_set_damping', () => this.calls.struct('SwDampingDesc', { ...values, ratios: array, nRatios: array.length }));
  }

  setWind(values) {
    return this.#set('sw_state_set_wind', () => this.calls.struct('SwWindDesc', values));
  }

  /** Forces (3 numbers each) on `vertices`, or on all in order. */
  setForces(forces, vertices) {
    const { array, format, count } = rows(forces, 'forces');
    const listed = vertices && indices(vertices);
    if (listed && listed.length !== count) throw new TypeError(`${count} forces on ${listed.length} vertices`);
    return this.#set('sw_state_set_forces', () => this.calls.struct('SwForceDesc', { forces: array, format, count, vertices: listed }));
  }

  /** Pose of the support frame: `origin`, `rotation` (9 numbers, row by row), and its motion where that is known. */
  setFrame(values, { teleport = false } = {}) {
    return this.#set('sw_state_set_frame', () => this.calls.struct('SwFrameDesc', { ...values, flags: teleport ? C.SW_FRAME_TELEPORT : values.flags }));
  }

  /** Supported vertices each where `positions` (nVertices rows) has them. */
  moveSupports(positions, { teleport = false } = {}) {
    const { array, format, count } = rows(positions, 'positions');
    return this.#set('sw_state_move_supports', format, () => this.calls.put(array), 0n, count, teleport ? C.SW_SUPPORTS_TELEPORT : 0);
  }

  /** Holds a vertex at `position`, or turned by `rotation` (9 numbers); `id` names the handle. */
  hold(id, { vertex, position, rotation, axes = 0, compliance = 0 }) {
    if ((position === undefined) === (rotation === undefined)) throw new TypeError('a handle has a position or a rotation');
    const kind = position ? C.SW_CONSTRAINT_POSITION : C.SW_CONSTRAINT_ORIENTATION;
    return this.#set('sw_state_set_constraint', () =>
      this.calls.struct('SwConstraintDesc', { id, kind, vertex, axes, compliance, ...(position ? { position } : { rotation }) }));
  }

  /** Lets go of a handle, or of all. */
  release(id = C.SW_ALL_CONSTRAINTS) {
    return this.#set('sw_state_clear_constraint', id);
  }

  /** The solids that the shell stays out of, from now on. */
  setColliders(colliders) {
    const list = Uint32Array.from(colliders, (collider) => collider.at);
    return this.#set('sw_state_set_colliders', () => this.calls.put(list), list.length);
  }

  /** Where a collider, by its place in the list, is at the end of the next step. */
  moveCollider(index, values, { teleport = false } = {}) {
    return this.#set('sw_state_move_collider', index, () =>
      this.calls.struct('SwColliderPoseDesc', { ...values, flags: teleport ? C.SW_COLLIDER_TELEPORT : 0 }));
  }

  step(seconds) {
    this.calls.call('sw_state_step', this.at, seconds);
    return this;
  }

  /** Moves to rest under the present loads. */
  equilibrium() {
    return this.calls.filled('sw_state_equilibrium', 'SwEquilibriumReport', this.at);
  }

  setMethod(method) {
    return this.#set('sw_state_set_method', numberOf(this.calls, method));
  }

  reset() {
    return this.#set('sw_state_reset');
  }

  #output(name, space, columns, out) {
    const { calls, nVertices } = this, { library } = calls, spaces = { world: C.SW_SPACE_WORLD, frame: C.SW_SPACE_FRAME };
    const target = out ?? new Float32Array(columns * nVertices);
    if (target.length !== columns * nVertices) throw new TypeError(`out has ${target.length} numbers, not ${columns * nVertices}`);
    if (!(space in spaces)) throw new TypeError(`no space ${space}: world, frame`);
    const { format } = floats(target);
    calls.within(() => {
      const at = library.alloc(target.byteLength);
      calls.call(name, this.at, spaces[space], format, at, 0n, nVertices);
      new Uint8Array(target.buffer, target.byteOffset, target.byteLength).set(library.bytes(at, target.byteLength));
    });
    return target;
  }

  /** x, y, z of each vertex: a Float32Array, or in `out` (Float32Array or Float64Array). */
  positions({ space = 'world', out } = {}) {
    return this.#output('sw_state_positions', space, 3, out);
  }

  normals({ space = 'world', out } = {}) {
    return this.#output('sw_state_normals', space, 3, out);
  }

  /** Unit quaternions w, x, y, z. */
  rotations({ space = 'world', out } = {}) {
    return this.#output('sw_state_rotations', space, 4, out);
  }

  report() {
    return this.calls.filled('sw_state_report', 'SwStateReport', this.at);
  }

  /** An estimate of the present error against the full shell. */
  certify() {
    return this.calls.filled('sw_state_certify', 'SwCertificate', this.at);
  }

  save() {
    return this.calls.saved('sw_state_save', this.at);
  }

  load(bytes) {
    return this.#set('sw_state_load', () => this.calls.put(bytes), BigInt(bytes.length));
  }

  clone() {
    const at = this.calls.made((out) => this.calls.call('sw_state_clone', this.at, out));
    return new State(this.calls, at, this.nVertices);
  }
}

/** A solid, for any number of states. */
export class Collider extends Handle {
  constructor(calls, at) {
    super(calls, at, 'sw_collider_destroy');
  }
}

const KINDS = ['plane', 'sphere', 'capsule', 'box', 'hull', 'mesh', 'deforming-mesh'];

/** One instance of the library. */
export class Shellwarp {
  #calls;

  constructor(instance) {
    this.#calls = new Calls(new Library(instance, layout));
  }

  get version() {
    const { library } = this.#calls;
    return library.text(library.calls.sw_version_string());
  }

  /** Number, name and label of each method. */
  get methods() {
    return methodsOf(this.#calls);
  }

  /** Materials by name: name, label, and the source of the numbers. */
  get presets() {
    const { library } = this.#calls, { calls } = library;
    const text = (name, k) => library.text(calls[name](k));
    return Array.from({ length: calls.sw_preset_count() }, (_, k) =>
      ({ name: text('sw_preset_name', k), label: text('sw_preset_label', k), source: text('sw_preset_source', k) }));
  }

  #material({ preset, metresPerUnit = 1, ...values }) {
    const calls = this.#calls;
    const at = calls.struct('SwMaterialDesc');
    if (preset !== undefined) {
      const index = this.presets.findIndex(({ name }) => name === preset);
      if (index < 0) throw new TypeError(`no material ${preset}: ${this.presets.map(({ name }) => name).join(', ')}`);
      calls.call('sw_preset_material', index, metresPerUnit, at);
    }
    calls.fill('SwMaterialDesc', at, values);
    return at;
  }

  #mesh(positions, triangles) {
    const { array, format, count } = rows(positions, 'positions'), corners = indices(triangles);
    if (corners.length % 3) throw new TypeError(`triangles has ${corners.length} numbers, which are no rows of 3`);
    return this.#calls.struct('SwMeshDesc', {
      positions: array, positionFormat: format, nVertices: count, triangles: corners, nTriangles: corners.length / 3,
    });
  }

  /** A model of positions (x, y, z of each vertex) and triangles (three vertices each), held at `fixed` and `clamped` vertices. */
  model({ positions, triangles, material = {}, fixed = [], clamped = [] }) {
    const calls = this.#calls, [pinned, held] = [indices(fixed), indices(clamped)];
    return new Model(calls, calls.made((out) => calls.call('sw_model_create', this.#mesh(positions, triangles), this.#material(material),
      calls.struct('SwSupportDesc', { fixed: pinned, nFixed: pinned.length, clamped: held, nClamped: held.length }), out)));
  }

  /** The model that `Model.save` wrote. */
  loadModel(bytes) {
    const calls = this.#calls;
    return new Model(calls, calls.made((out) => calls.call('sw_model_load', calls.put(bytes), BigInt(bytes.length), out)));
  }

  /** A solid of a kind: "plane", "sphere", "capsule", "box", "hull", "mesh", "deforming-mesh"; the last three of positions and triangles. Of the last two
   * `flags: constants.SW_COLLIDER_ONE_SIDED` takes an open mesh, solid behind its triangles by `depth`. */
  collider({ kind, positions, triangles, ...values }) {
    const calls = this.#calls, number = C[`SW_COLLIDER_${String(kind).toUpperCase().replace('-', '_')}`];
    if (!KINDS.includes(kind)) throw new TypeError(`no kind ${kind}: ${KINDS.join(', ')}`);
    return new Collider(calls, calls.made((out) => calls.call('sw_collider_create',
      calls.struct('SwColliderDesc', { ...values, kind: number, mesh: positions && this.#mesh(positions, triangles) }), out)));
  }
}

/** Starts the library: of the module beside this file, or of `source`, its bytes, a compiled module or a response of `fetch`. */
export async function load(source) {
  if (source instanceof WebAssembly.Module) return new Shellwarp(await WebAssembly.instantiate(source, {}));
  const { instance } = await WebAssembly.instantiate(await bytesOf(source), {});
  return new Shellwarp(instance);
}

async function bytesOf(source) {
  if (source === undefined) {
    const file = new URL('./shellwarp.wasm', import.meta.url);
    if (file.protocol !== 'file:') return (await fetch(file)).arrayBuffer();
    const { readFile } = await import('node:fs/promises');
    return readFile(file);
  }
  const answer = await source;
  return typeof answer.arrayBuffer === 'function' ? answer.arrayBuffer() : answer;
}

export { C as constants };
