// The library as a WebAssembly module: its memory, structs and callbacks from JavaScript.

const SECTION = { type: 1, import: 2, function: 3, export: 7 };
const TYPE = { i32: 0x7f, f64: 0x7c };

// A module that hands on one function, so that it gets a type and can stand in a table: JavaScript functions as such cannot.
function typed(parameters, result, body) {
  const text = (words) => [words.length, ...new TextEncoder().encode(words)];
  const section = (id, bytes) => [id, bytes.length, ...bytes];
  const bytes = [
    0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0,
    ...section(SECTION.type, [1, 0x60, parameters.length, ...parameters.map((p) => TYPE[p]), 1, TYPE[result]]),
    ...section(SECTION.import, [1, ...text('m'), ...text('f'), 0, 0]),
    ...section(SECTION.export, [1, ...text('f'), 0, 0]),
  ];
  return new WebAssembly.Instance(new WebAssembly.Module(new Uint8Array(bytes)), { m: { f: body } }).exports.f;
}

export class Library {
  constructor(instance, layout) {
    this.calls = instance.exports;
    this.layout = layout;
    this.lent = null;
  }

  // Does `work` and gives back what it allocated.
  within(work) {
    const outer = this.lent;
    this.lent = [];
    try {
      return work();
    } finally {
      for (const [at, size] of this.lent) this.calls.sw_free(at, size);
      this.lent = outer;
    }
  }

  // Made anew at each use: memory that grows moves.
  get view() {
    return new DataView(this.calls.memory.buffer);
  }

  bytes(at, size) {
    return new Uint8Array(this.calls.memory.buffer, at, size);
  }

  alloc(size) {
    const at = this.calls.sw_alloc(size);
    if (!at) throw new Error(`no memory for ${size} bytes`);
    this.lent?.push([at, size]);
    return at;
  }

  put(array) {
    const at = this.alloc(array.byteLength);
    this.bytes(at, array.byteLength).set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
    return at;
  }

  text(at) {
    const all = new Uint8Array(this.calls.memory.buffer);
    return new TextDecoder().decode(all.slice(at, all.indexOf(0, at)));
  }

  // Calls a function that returns a status.
  call(name, ...words) {
    const status = this.calls[name](...words);
    if (status) throw new Error(`${name}: status ${status}: ${this.text(this.calls.sw_last_error_message())}`);
  }

  // A struct at its defaults, and the values given: integers and pointers as numbers, doubles where `real` names them.
  struct(type, values = {}, real = {}) {
    const { bytes, at: fields } = this.layout[type];
    const at = this.alloc(bytes);
    this.calls.sw_struct_init(at, bytes);
    for (const [name, value] of Object.entries(values)) this.view.setUint32(at + fields[name], value, true);
    for (const [name, value] of Object.entries(real)) [value].flat().forEach((v, k) => this.view.setFloat64(at + fields[name] + 8 * k, v, true));
    return at;
  }

  f64(at, type, field, k = 0) {
    return this.view.getFloat64(at + this.layout[type].at[field] + 8 * k, true);
  }

  // A number by which the library can call `body`.
  callback(parameters, result, body) {
    const table = this.calls.__indirect_function_table, at = table.grow(1);
    table.set(at, typed(parameters, result, body));
    return at;
  }
}
