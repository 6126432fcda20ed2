// One worker of the page: it moves a shell, judges one, or precomputes a mesh. It answers each message by one, and tells progress between.

import layout from 'layout.json';
import { Model, Motion, precompute, startLibrary } from './shell.mjs';

const LONGEST = 1 / 120, MEASURED = 500;   // s; ms
let library, model, motion, measured = { at: -Infinity, value: NaN };

const answers = {
  async start({ wasm }) {
    library = await startLibrary(wasm, layout);
    return {};
  },

  precompute({ mesh, recipe }) {
    const bytes = precompute(library, mesh, recipe, (phase, fraction) => postMessage({ phase, fraction }));
    return { bytes };
  },

  open({ bytes }) {
    motion?.destroy();
    model?.destroy();
    motion = null;
    model = new Model(library, bytes);
    const { vertices, modes, fields, mass, methods } = model;
    return { vertices, modes, fields, mass, methods };
  },

  move({ method, seconds, loads, handles, reset }) {
    if (!motion) motion = new Motion(model, method);
    else if (motion.method !== method) motion.setMethod(method), (measured.at = -Infinity);
    if (reset) motion.reset();
    motion.setLoads(loads);
    const steps = motion.advance(seconds, LONGEST, handles), now = performance.now();
    if (steps && now - measured.at > MEASURED) measured = { value: motion.microseconds(seconds / steps), at: performance.now() };
    return { positions: motion.positions(), saved: motion.save(), micros: measured.value };
  },

  judge({ method, loads, handles, saved }) {
    if (motion?.method !== method) {
      motion?.destroy();
      motion = new Motion(model, method);
    }
    motion.setLoads(loads);
    motion.hold(handles);
    motion.load(saved);
    return { error: motion.error() };
  },
};

onmessage = async ({ data }) => {
  try {
    postMessage({ answer: await answers[data.ask](data) });
  } catch (error) {
    postMessage({ trouble: error.message, broken: error instanceof WebAssembly.RuntimeError });
  }
};
