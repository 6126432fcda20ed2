// Compiled, never run: the types take what they should, and nothing else.

import { load, ShellwarpError, constants, type Certificate, type Model, type State } from 'shellwarp';

const shellwarp = await load(fetch('shellwarp.wasm'));
const model: Model = shellwarp.model({ positions: [0, 0, 0, 1, 0, 0, 0, 1, 0], triangles: new Uint32Array([0, 1, 2]), material: { preset: 'felt', metresPerUnit: 0.01 } });
model.precompute({ modes: 4, sagGravity: [0, 0, -9.81], onProgress: (phase, fraction) => phase < 3 || fraction < 1 });
const state: State = model.state({ method: 'warp', integrator: 'exact', deterministic: true });
state.setWind({ velocity: [1, 0, 0], density: 1.2, normalDrag: 1 }).hold(1, { vertex: 2, position: [0, 1, 1], axes: constants.SW_AXIS_Z }).step(1 / 60);
const wide: Float64Array = state.positions({ out: new Float64Array(9) });
const narrow: Float32Array = state.normals();
const certificate: Certificate = state.certify();
const error: number = certificate.error + wide[0] + narrow[0] + new ShellwarpError(3, '').status;
state.setColliders([shellwarp.collider({ kind: 'sphere', radius: error })]);

// @ts-expect-error: a field that no descriptor has
model.precompute({ mode: 4 });
// @ts-expect-error: three numbers
state.setGravity([0, 1]);
// @ts-expect-error: no such integrator
model.state({ integrator: 'euler' });
