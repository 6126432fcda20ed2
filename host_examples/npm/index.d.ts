// Types of index.mjs. Lengths, masses and seconds are the user's; angles are rad. Arrays of positions have x, y, z of each vertex in turn.

import type {
  Certificate, ColliderDesc, ColliderPoseDesc, DampingDesc, EquilibriumReport, FrameDesc, MaterialDesc, ModelInfo, PrecomputeDesc, StateReport, WindDesc,
} from './descriptors.js';

export * from './descriptors.js';

export type Floats = Float32Array | Float64Array | ArrayLike<number>;
export type Indices = Uint32Array | ArrayLike<number>;
export type Vector = readonly [number, number, number] | Float64Array | Float32Array;
export type Space = 'world' | 'frame';
/** Names of methods; others that `Shellwarp.methods` lists are taken too. */
export type MethodName =
  | 'warp' | 'warp-virtual-work' | 'rotation-strain' | 'reduced-shell' | 'polynomial-shell' | 'adaptive-shell' | 'shell-implicit' | 'shell-explicit' | 'lma' | (string & {});

/** What the library refused: `status` is a number of the C interface, `name` its word, such as "INVALID_MESH". */
export class ShellwarpError extends Error {
  constructor(status: number, message: string);
  readonly status: number;
}

/** Fields of the C descriptor by camelCase names, or a known material by name. */
export interface Material extends MaterialDesc {
  /** A name of `Shellwarp.presets`. */
  preset?: string;
  /** How long the mesh's unit is, for a preset: 1 for metres, 0.01 for centimetres. */
  metresPerUnit?: number;
}

export interface Shape {
  positions: Floats;
  /** Three vertices each. */
  triangles: Indices;
}

export interface Method {
  readonly number: number;
  readonly name: string;
  readonly label: string;
}

declare abstract class Handle {
  /** Its address in the module's memory. */
  readonly at: number;
  /** Gives its memory back. May be called again; nothing else may. */
  destroy(): void;
}

/** A mesh with material and supports, and after `precompute` all that states need. */
export class Model extends Handle {
  private constructor();
  /** Modes, and fields where asked for. `onProgress` hears of it; false from it cancels. */
  precompute(options?: Omit<PrecomputeDesc, 'progress' | 'progressUser'> & { onProgress?: (phase: number, fraction: number) => boolean | void }): this;
  info(): ModelInfo;
  /** Hz of each mode. */
  frequencies(): Float64Array;
  offers(method: MethodName): boolean;
  /** Bytes for `Shellwarp.loadModel`, here or on another machine. */
  save(): Uint8Array;
  /** A new state at rest. A deterministic one has the same bits on every processor, on one saved model. */
  state(options?: { method?: MethodName; integrator?: 'implicit-euler' | 'exact' | 'second-order'; deterministic?: boolean }): State;
}

/** A moving shell. */
export class State extends Handle {
  private constructor();
  readonly nVertices: number;
  /** Acceleration, world axes. */
  setGravity(gravity: Vector): this;
  /** `ratios`: one fraction of critical damping for all modes, or one a mode. */
  setDamping(values: Omit<DampingDesc, 'ratios' | 'nRatios'> & { ratios?: number | ArrayLike<number> }): this;
  setWind(values: WindDesc): this;
  /** Forces (3 numbers each) on `vertices`, or on all in order. */
  setForces(forces: Floats, vertices?: Indices): this;
  /** Pose of the support frame; `rotation` has 9 numbers, row by row. */
  setFrame(values: FrameDesc, options?: { teleport?: boolean }): this;
  /** Supported vertices each where `positions` (nVertices rows) has them; other rows are not read. */
  moveSupports(positions: Floats, options?: { teleport?: boolean }): this;
  /** Holds a vertex at a position, or turned by a rotation; `id` names the handle. */
  hold(id: number, handle: { vertex: number; position?: Vector; rotation?: ArrayLike<number>; axes?: number; compliance?: number }): this;
  /** Lets go of a handle, or of all. */
  release(id?: number): this;
  setColliders(colliders: readonly Collider[]): this;
  /** Where a collider, by its place in the list, is at the end of the next step. */
  moveCollider(index: number, pose: ColliderPoseDesc, options?: { teleport?: boolean }): this;
  step(seconds: number): this;
  /** Moves to rest under the present loads. */
  equilibrium(): EquilibriumReport;
  setMethod(method: MethodName): this;
  reset(): this;
  positions(options?: { space?: Space }): Float32Array;
  positions<T extends Float32Array | Float64Array>(options: { space?: Space; out: T }): T;
  normals(options?: { space?: Space }): Float32Array;
  normals<T extends Float32Array | Float64Array>(options: { space?: Space; out: T }): T;
  /** Unit quaternions w, x, y, z. */
  rotations(options?: { space?: Space }): Float32Array;
  rotations<T extends Float32Array | Float64Array>(options: { space?: Space; out: T }): T;
  report(): StateReport;
  /** An estimate of the present error against the full shell. */
  certify(): Certificate;
  save(): Uint8Array;
  load(bytes: Uint8Array): this;
  clone(): State;
}

/** A solid, for any number of states. */
export class Collider extends Handle {
  private constructor();
}

/** One instance of the library. */
export class Shellwarp {
  private constructor();
  readonly version: string;
  readonly methods: Method[];
  /** Materials by name, with the source of their numbers. */
  readonly presets: { readonly name: string; readonly label: string; readonly source: string }[];
  model(options: Shape & { material?: Material; fixed?: Indices; clamped?: Indices }): Model;
  loadModel(bytes: Uint8Array): Model;
  collider(
    options: Omit<ColliderDesc, 'kind' | 'mesh'> & Partial<Shape> & { kind: 'plane' | 'sphere' | 'capsule' | 'box' | 'hull' | 'mesh' | 'deforming-mesh' },
  ): Collider;
}

/** Starts the library: of the module beside this file, or of its bytes, a compiled module or a response of `fetch`. */
export function load(source?: WebAssembly.Module | ArrayBuffer | ArrayBufferView | Response | Promise<Response>): Promise<Shellwarp>;

/** The numbers of the C header by name, such as `constants.SW_AXIS_X`. */
export const constants: Readonly<Record<string, number>>;
