// A WebAssembly module without what only debuggers read.

/** Its sections but the custom ones. */
export function stripped(wasm) {
  const kept = [wasm.subarray(0, 8)];
  for (let at = 8; at < wasm.length; ) {
    const start = at, id = wasm[at++];
    let size = 0, byte;
    for (let shift = 0; (byte = wasm[at++]), (size += (byte & 127) * 2 ** shift), byte & 128; shift += 7);
    at += size;
    if (id !== 0) kept.push(wasm.subarray(start, at));
  }
  return Buffer.concat(kept);
}
