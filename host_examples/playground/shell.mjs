// Shells by the library: precompute, steps, handles, loads, colliders, the certificate. For workers and for node alike.

import { Library } from '../npm/module.mjs';

const MODES = 8, FIELDS = 24, POSES = 0;             // 0 poses: as many as the library thinks fit
const AIR = 1.2, DRAG = 1.3;                       // kg/m^3; of a plate
const DAMPING = 0.06;                              // of critical, at the slowest swing and at ten times its frequency
const TIMED = 3;                                   // ms: steps are repeated until they took so long
const THICKNESS = 0.004, FRICTION = 0.4;           // of the colliders, m
const LEFT_OUT = ['auto', 'shell-explicit'];       // one of the others; needs steps of 1/30000 s

export async function startLibrary(wasm, layout) {
  const { instance } = await WebAssembly.instantiate(wasm, {});
  return new Library(instance, layout);
}

function meanEdge({ positions, triangles }) {
  let sum = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = 3 * triangles[t + k], b = 3 * triangles[t + ((k + 1) % 3)];
      sum += Math.hypot(positions[a] - positions[b], positions[a + 1] - positions[b + 1], positions[a + 2] - positions[b + 2]);
    }
  }
  return sum / triangles.length;
}

// A model of a sheet a 200th of a metre thick, 1 kg/m^2, its stiffness times `stiffness`.
function createModel(library, mesh, stiffness) {
  const { positions, triangles, held } = mesh;
  const desc = library.struct('SwMeshDesc', {
    positions: library.put(positions), position_format: library.layout.constants.SW_FORMAT_F64, n_vertices: positions.length / 3,
    triangles: library.put(triangles), n_triangles: triangles.length / 3,
  });
  const material = library.struct('SwMaterialDesc', {}, {
    k_length: stiffness * (Math.sqrt(3) / 4) * meanEdge(mesh), k_area: 0.5 * stiffness, k_bend: stiffness * (1 / 200) ** 2 / 64, area_density: 1,
  });
  const supports = library.struct('SwSupportDesc', { clamped: library.put(held), n_clamped: held.length });
  const out = library.alloc(4);
  library.call('sw_model_create', desc, material, supports, out);
  return library.view.getUint32(out, true);
}

function slowest(library, model) {
  return library.within(() => {
    const count = library.alloc(4);
    library.call('sw_model_frequencies', model, 0, 0, count);
    const n = library.view.getUint32(count, true), hertz = library.alloc(8 * n);
    library.call('sw_model_frequencies', model, hertz, n, count);
    for (let k = 0; k < n; ++k) if (library.view.getFloat64(hertz + 8 * k, true) > 0) return library.view.getFloat64(hertz + 8 * k, true);
    throw new Error('nothing swings: hold some vertices');
  });
}

/** The saved model of a mesh that swings at `frequency` Hz, all stiffnesses scaled alike. `told` hears of phases and fractions. */
export function precompute(library, mesh, { frequency, fields = FIELDS, poses = POSES }, told = () => {}) {
  if (!mesh.held.length) throw new Error('nothing is held: paint some vertices');
  return library.within(() => {
    const probe = createModel(library, mesh, 1);
    library.call('sw_model_precompute', probe, library.struct('SwPrecomputeDesc', { modes: 4 }));
    const model = createModel(library, mesh, (frequency / slowest(library, probe)) ** 2);
    library.calls.sw_model_destroy(probe);
    const progress = library.callback(['i32', 'i32', 'f64'], 'i32', (_user, phase, fraction) => {
      told(phase, fraction);
      return library.layout.constants.SW_PROGRESS_CONTINUE;
    });
    library.call('sw_model_precompute', model, library.struct('SwPrecomputeDesc', { modes: MODES, reduced_fields: fields, reduced_poses: poses, progress }));
    const size = library.alloc(8);
    library.call('sw_model_save', model, 0, 0n, size);
    const length = library.view.getBigUint64(size, true), at = library.alloc(Number(length));
    library.call('sw_model_save', model, at, length, size);
    library.calls.sw_model_destroy(model);
    return library.bytes(at, Number(length)).slice();
  });
}

/** A precomputed model, by its saved bytes. */
export class Model {
  constructor(library, bytes) {
    this.library = library;
    library.within(() => {
      const out = library.alloc(4), info = library.struct('SwModelInfo'), at = library.layout.SwModelInfo.at;
      library.call('sw_model_load', library.put(bytes), BigInt(bytes.length), out);
      this.at = library.view.getUint32(out, true);
      library.call('sw_model_info', this.at, info);
      this.vertices = library.view.getUint32(info + at.n_vertices, true);
      this.modes = library.view.getUint32(info + at.modes, true);
      this.fields = library.view.getUint32(info + at.reduced_fields, true);
      this.mass = library.f64(info, 'SwModelInfo', 'total_mass');
    });
    this.frequency = slowest(library, this.at);
  }

  /** The methods that it offers, in the order for menus. */
  get methods() {
    const { calls } = this.library;
    return Array.from({ length: calls.sw_method_count() }, (_, k) => calls.sw_method_at(k))
      .map((number) => ({ number, name: this.library.text(calls.sw_method_name(number)), label: this.library.text(calls.sw_method_label(number)) }))
      .filter(({ number, name }) => !LEFT_OUT.includes(name) && calls.sw_model_offers(this.at, number) === 0);
  }

  destroy() {
    this.library.calls.sw_model_destroy(this.at);
  }
}

/** A shell in motion, by one method. */
export class Motion {
  constructor(model, method) {
    this.model = model;
    this.library = model.library;
    this.method = method;
    this.known = {};
    this.ids = new Set();
    this.targets = new Map();
    this.colliders = [];
    this.spent = 0;
    const { library } = this;
    library.within(() => {
      const out = library.alloc(4), slow = 2 * Math.PI * model.frequency, fast = 10 * slow;
      library.call('sw_state_create', model.at, library.struct('SwStateDesc', { method }), out);
      this.at = library.view.getUint32(out, true);
      library.call('sw_state_set_damping', this.at, library.struct('SwDampingDesc', {}, {
        mass_coefficient: (2 * DAMPING * slow * fast) / (slow + fast), stiffness_coefficient: (2 * DAMPING) / (slow + fast),
      }));
    });
    this.out = library.alloc(12 * model.vertices);
  }

  destroy() {
    this.library.calls.sw_state_destroy(this.at);
    this.library.calls.sw_free(this.out, 12 * this.model.vertices);
    for (const collider of this.colliders) this.library.calls.sw_collider_destroy(collider);
  }

  /** Goes on by another method, from the nearest shape. */
  setMethod(method) {
    this.library.call('sw_state_set_method', this.at, method);
    this.method = method;
    this.spent = 0;
  }

  reset() {
    this.library.call('sw_state_reset', this.at);
  }

  // Whether a part of the inputs differs from what the state has.
  changed(part, value) {
    const key = JSON.stringify(value);
    if (this.known[part] === key) return false;
    this.known[part] = key;
    return true;
  }

  /** Sets gravity and wind (3 numbers each), floor (its height or null) and ball (centre and radius, or null). */
  setLoads({ gravity, wind, floor, ball }) {
    const { library } = this;
    library.within(() => {
      if (this.changed('gravity', gravity)) library.call('sw_state_set_gravity', this.at, library.put(Float64Array.from(gravity)));
      if (this.changed('wind', wind)) {
        const density = Math.hypot(...wind) > 0 ? AIR : 0;
        library.call('sw_state_set_wind', this.at, library.struct('SwWindDesc', {}, { velocity: wind, density, normal_drag: DRAG, tangential_drag: 0.05 }));
      }
      if (this.changed('solids', [floor !== null, ball?.radius])) this.setSolids(floor, ball);
      if (floor !== null && this.changed('floor', floor)) this.place(0, [0, 0, floor]);
      if (ball && this.changed('ball', ball.centre)) this.place(floor === null ? 0 : 1, ball.centre);
    });
  }

  setSolids(floor, ball) {
    const { library } = this, C = library.layout.constants, before = this.colliders;
    const create = (kind, radius) => {
      const out = library.alloc(4);
      library.call('sw_collider_create', library.struct('SwColliderDesc', { kind }, { radius, friction: FRICTION, thickness: THICKNESS }), out);
      return library.view.getUint32(out, true);
    };
    this.colliders = [...(floor === null ? [] : [create(C.SW_COLLIDER_PLANE, 0)]), ...(ball ? [create(C.SW_COLLIDER_SPHERE, ball.radius)] : [])];
    library.call('sw_state_set_colliders', this.at, library.put(Uint32Array.from(this.colliders)), this.colliders.length);
    delete this.known.floor;
    delete this.known.ball;
    for (const collider of before) library.calls.sw_collider_destroy(collider);
  }

  place(collider, origin) {
    const { library } = this;
    library.call('sw_state_move_collider', this.at, collider, library.struct('SwColliderPoseDesc', {}, { origin }));
  }

  // One constraint: its position, or with a rotation its orientation.
  constrain(id, vertex, { position, rotation, compliance = 0 }) {
    const { library } = this, C = library.layout.constants;
    const kind = rotation ? C.SW_CONSTRAINT_ORIENTATION : C.SW_CONSTRAINT_POSITION;
    library.call('sw_state_set_constraint', this.at,
      library.struct('SwConstraintDesc', { id, kind, vertex }, rotation ? { rotation, compliance } : { position, compliance }));
    this.ids.add(id);
  }

  // The handles, `share` of the way from where they were to where they go.
  lead(handles, share) {
    const wanted = new Set();
    for (const { vertex, position, rotation, compliance } of handles) {
      const from = this.targets.get(vertex) ?? position;
      this.constrain(2 * vertex, vertex, { position: position.map((x, c) => from[c] + share * (x - from[c])), compliance });
      wanted.add(2 * vertex);
      if (rotation) this.constrain(2 * vertex + 1, vertex, { rotation }), wanted.add(2 * vertex + 1);
    }
    for (const id of [...this.ids].filter((known) => !wanted.has(known))) {
      this.library.call('sw_state_clear_constraint', this.at, id);
      this.ids.delete(id);
    }
  }

  /** Sets the handles where they are wanted, at once. */
  hold(handles) {
    this.library.within(() => this.lead(handles, 1));
  }

  /** Advances by `seconds` in equal steps no longer than `longest`, while the handles go to where they are wanted. */
  advance(seconds, longest, handles) {
    const steps = Math.ceil(seconds / longest);
    for (let k = 1; k <= steps; ++k) {
      this.library.within(() => this.lead(handles, k / steps));
      const start = performance.now();
      this.library.call('sw_state_step', this.at, seconds / steps);
      const spent = performance.now() - start;
      this.spent = this.spent ? 0.8 * this.spent + 0.2 * spent : spent;
    }
    if (steps) this.targets = new Map(handles.map(({ vertex, position }) => [vertex, position]));
    return steps;
  }

  /** Microseconds of a step from here. Short ones are repeated on a clone, since a page's clock is coarse. */
  microseconds(seconds) {
    if (this.spent > TIMED) return 1000 * this.spent;
    const { library } = this;
    return library.within(() => {
      const out = library.alloc(4);
      library.call('sw_state_clone', this.at, out);
      const clone = library.view.getUint32(out, true), start = performance.now();
      let steps = 0;
      try {
        while (performance.now() - start < TIMED) for (let k = 0; k < 4; ++k, ++steps) library.call('sw_state_step', clone, seconds);
        return (1000 * (performance.now() - start)) / steps;
      } finally {
        library.calls.sw_state_destroy(clone);
      }
    });
  }

  positions() {
    const { library, model, out } = this, C = library.layout.constants;
    library.call('sw_state_positions', this.at, C.SW_SPACE_WORLD, C.SW_FORMAT_F32, out, 0n, model.vertices);
    return new Float32Array(library.bytes(out, 12 * model.vertices).slice().buffer);
  }

  save() {
    const { library } = this;
    return library.within(() => {
      const size = library.alloc(8);
      library.call('sw_state_save', this.at, 0, 0n, size);
      const length = library.view.getBigUint64(size, true), at = library.alloc(Number(length));
      library.call('sw_state_save', this.at, at, length, size);
      return library.bytes(at, Number(length)).slice();
    });
  }

  load(bytes) {
    this.library.within(() => this.library.call('sw_state_load', this.at, this.library.put(bytes), BigInt(bytes.length)));
  }

  /** The estimated error of the present shape against the full shell's, relative to its displacement. */
  error() {
    const { library } = this;
    return library.within(() => {
      const certificate = library.struct('SwCertificate');
      library.call('sw_state_certify', this.at, certificate);
      return library.f64(certificate, 'SwCertificate', 'error');
    });
  }
}
