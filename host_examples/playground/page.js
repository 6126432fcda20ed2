// The playground: chooses shells, leads them by the pointer, and shows what each method makes of it.

import * as THREE from 'three';
import { boxOf, lowEnd, placed, readObj } from './shapes.mjs';
import { View, turned } from './view.js';

const element = (id) => document.getElementById(id);
const JUDGED = 400, OLD = 2000, BRUSH = 0.04, DROPPED_HERTZ = 1.6;      // ms between estimates, and until one is pale; m; of a dropped mesh
const BALL = 0.13, GIVE = 0.3;                              // radius, m; how far a soft handle gives under the shell's weight, m
const PHASES = ['masses', 'ordering', 'factorization', 'modes', 'certificate', 'modal rotation', 'training the reduced shell'];
const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const FULL = 'shell-implicit';

/** The bytes of an embedded part: gzip in base64. */
async function part(id) {
  const packed = Uint8Array.from(atob(element(id).textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A worker that answers one question at a time. */
class Helper {
  constructor() {
    this.worker = new Worker(Helper.url);
    this.busy = false;
    this.worker.onmessage = ({ data }) => {
      if (data.phase !== undefined) return this.told?.(data);
      this.busy = false;
      data.answer ? this.settle[0](data.answer) : this.settle[1](Object.assign(new Error(data.trouble), { broken: data.broken }));
    };
    this.worker.onerror = ({ message }) => { this.busy = false; this.settle?.[1](new Error(message)); };
  }

  static async made() {
    const helper = new Helper();
    await helper.ask('start', { wasm: Helper.wasm });
    return helper;
  }

  ask(ask, more = {}) {
    this.busy = true;
    return new Promise((...settle) => {
      this.settle = settle;
      this.worker.postMessage({ ask, ...more });
    });
  }

  end() {
    this.worker.terminate();
  }
}

/** One shell on show: a worker that moves it, one that judges it, and its numbers. */
class Pane {
  constructor(page, index) {
    this.page = page;
    this.index = index;
    this.stage = page.view.stages[index];
    this.clear();
  }

  clear() {
    Object.assign(this, { owed: 0, micros: NaN, error: NaN, saved: null, judgedAt: 0, judgedOf: 0, unsure: false, reset: true });
  }

  async start() {
    [this.mover, this.judge] = await Promise.all([Helper.made(), Helper.made()]);
  }

  async open(bytes) {
    this.clear();
    if (this.mover.busy || this.judge.busy || !this.fresh) {
      this.mover.end();
      this.judge.end();
      await this.start();
    }
    const [facts] = await Promise.all([this.mover.ask('open', { bytes }), this.judge.ask('open', { bytes })]);
    return facts;
  }

  get method() {
    return this.page.methods[this.index];
  }

  get full() {
    return this.method?.name === FULL;
  }

  /** Asks for the next shape once the last one has come. */
  next(seconds) {
    const { page } = this;
    this.owed = Math.min(this.owed + seconds, 1 / 20);
    if (this.mover.busy || !(this.owed > 0 || this.reset || this.method !== this.last)) return;
    const question = { method: this.method.number, seconds: this.owed, loads: page.loads, handles: page.handlesNow(), reset: this.reset };
    const model = page.bytes;
    this.owed = 0;
    this.reset = false;
    this.last = this.method;
    this.mover.ask('move', question).then((answer) => {
      if (page.bytes !== model || element('paint').checked) return;
      this.stage.setShape(answer.positions);
      if (this.method?.number === question.method) this.micros = answer.micros;
      this.saved = { ...question, saved: answer.saved };
      this.shownAt = performance.now();
      this.moved = (this.moved ?? 0) + 1;
      if (this.refused) page.say('');
      this.refused = false;
    }, (error) => page.trouble(this, error));
  }

  judgeNow(now) {
    if (this.full || !this.saved || this.judge.busy || now - this.judgedAt < JUDGED || this.page.waiting) return;
    const { method, loads, handles, saved } = this.saved, model = this.page.bytes, of = this.shownAt;
    this.judge.ask('judge', { method, loads, handles, saved }).then(({ error }) => {
      if (this.page.bytes === model && this.method?.number === method) Object.assign(this, { error, judgedOf: of, unsure: false });
      this.judgedAt = performance.now();
    }, (error) => {
      Object.assign(this, { error: NaN, unsure: true, judgedAt: performance.now() + 1000 });
      if (error.broken) this.page.restart();
    });
  }

  label() {
    const tag = element(`tag${this.index}`), { x, y } = this.page.view.pane(this.index);
    tag.hidden = this.index >= this.page.view.shown || !this.page.bytes;
    tag.style.left = `${x + 18}px`;
    tag.style.top = `${y + (y ? 12 : 62)}px`;
    tag.children[0].textContent = this.method?.label ?? '';
    tag.children[1].textContent = Number.isFinite(this.micros) ? `${shown(this.micros)} \u00b5s a step` : '\u2026 \u00b5s a step';
    tag.children[2].textContent = this.full ? 'what the others are judged by'
      : Number.isFinite(this.error) ? `error ${shown(100 * this.error)} %` : this.unsure ? 'no estimate here' : 'error \u2026';
    tag.children[2].classList.toggle('old', !this.full && this.shownAt - this.judgedOf > OLD);
  }
}

function shown(x) {
  return x >= 1000 ? Math.round(x).toLocaleString('en').replace(',', '\u2009') : x >= 100 ? String(Math.round(x)) : String(Number(x.toPrecision(2)));
}

class Page {
  constructor() {
    this.view = new View(element('view'));
    this.panes = [new Pane(this, 0), new Pane(this, 1)];
    this.methods = [null, null];
    this.handles = [];
    this.ball = [0.2, 0, -0.35];
    this.gesture = null;
    this.waiting = true;
    this.paused = false;
  }

  async start() {
    Helper.url = URL.createObjectURL(new Blob([element('worker').textContent], { type: 'text/javascript' }));
    Helper.wasm = await part('wasm');
    this.shapes = JSON.parse(element('shapes-list').textContent);
    for (const shape of this.shapes) {
      const button = Object.assign(document.createElement('button'), { type: 'button', textContent: shape.label });
      button.addEventListener('click', () => this.choose(shape));
      shape.button = button;
      element('shapes').append(button);
    }
    this.listen();
    await Promise.all(this.panes.map((pane) => pane.start()));
    this.last = performance.now();
    requestAnimationFrame((now) => this.frame(now));
    await this.choose(this.shapes[0]);
    document.documentElement.dataset.playground = 'ready';
  }

  // ---- what is shown ----

  async choose(shape) {
    if (!shape.mesh) {
      const bytes = await part(`mesh-${shape.name}`), [n, m, held] = new Uint32Array(bytes.buffer, 0, 3);
      shape.mesh = {
        positions: Float64Array.from(new Float32Array(bytes.buffer, 12, 3 * n)),
        triangles: new Uint32Array(bytes.buffer, 12 + 12 * n, 3 * m), held: new Uint32Array(bytes.buffer, 12 + 12 * (n + m), held),
      };
      shape.bytes = await part(`model-${shape.name}`);
    }
    element('soft').checked = Boolean(shape.soft);
    await this.open(shape, shape.mesh, shape.bytes);
  }

  async open(shape, mesh, bytes) {
    this.waiting = true;
    this.say('');
    this.shape = shape;
    this.mesh = mesh;
    this.held = new Set(mesh.held);
    this.bytes = bytes;
    this.handles = [];
    this.script = null;
    for (const { button } of this.shapes) button.setAttribute('aria-pressed', String(button === shape.button));
    for (const { stage } of this.panes) stage.setMesh(mesh), stage.setHeld([...this.held]);
    element('compute').disabled = Boolean(bytes);
    const low = boxOf(mesh.positions).low[2];
    this.view.fit();
    this.floorAt = low - (shape.name === 'dinosaur' ? 0 : 0.22);
    this.ball = [0.2, 0, this.floorAt + BALL];
    if (!bytes) {
      for (const pane of this.panes) pane.clear();
      return this.fillFacts();
    }
    this.facts = (await Promise.all(this.panes.map((pane) => pane.open(bytes))))[0];
    for (const pane of this.panes) pane.fresh = true;
    this.offer(this.facts.methods);
    this.fillFacts();
    this.waiting = false;
  }

  fillFacts() {
    const n = this.mesh.positions.length / 3, count = n.toLocaleString('en').replace(',', '\u2009');
    element('facts').textContent = this.bytes
      ? `${count} vertices, ${this.facts.modes} modes${this.facts.fields ? ` and ${this.facts.fields} fields` : ''}; a metre across`
      : `${count} vertices: paint what is held, then press Precompute`;
  }

  offer(methods) {
    const want = [this.methods[0]?.name ?? (this.facts.fields ? 'polynomial-shell' : 'warp'), this.methods[1]?.name];
    [0, 1].forEach((k) => {
      const select = element(`method${k}`), options = methods.map(({ name, label }) => new Option(label, name));
      select.replaceChildren(...(k ? [new Option('none', '')] : []), ...options);
      const name = methods.some((m) => m.name === want[k]) ? want[k] : k ? '' : methods[0].name;
      this.setMethod(k, name);
    });
  }

  setMethod(k, name) {
    element(`method${k}`).value = name;
    this.methods[k] = this.facts.methods.find((m) => m.name === name) ?? null;
    Object.assign(this.panes[k], { micros: NaN, error: NaN });
    this.view.shown = this.methods[1] ? 2 : 1;
    this.say('');
  }

  get loads() {
    const blow = Number(element('wind').value);
    return {
      gravity: [0, 0, -Number(element('gravity').value)], wind: [0.5 * blow, 0.8 * blow, 0.33 * blow],
      floor: element('floor').checked ? this.floorAt : null, ball: element('ball').checked ? { centre: this.ball, radius: BALL } : null,
    };
  }

  handlesNow() {
    const compliance = element('soft').checked ? GIVE / (9.8 * this.facts.mass) : 0;
    return this.handles.map(({ vertex, position, rotation }) => ({ vertex, position, rotation, compliance }));
  }

  say(words) {
    if (element('trouble').textContent !== words) element('trouble').textContent = words;
  }

  trouble(pane, error) {
    pane.refused = true;
    this.say(`${pane.method.label}: ${error.message}`);
    if (error.broken) this.restart();
  }

  /** Everything anew, after a module has ended. */
  restart() {
    for (const pane of this.panes) pane.fresh = false;
    this.open(this.shape, this.mesh, this.bytes);
  }

  // ---- frames ----

  frame(now) {
    const elapsed = Math.min((now - this.last) / 1000, 0.1), seconds = this.paused ? 0 : elapsed * Number(element('speed').value);
    this.last = now;
    if (!this.waiting && !element('paint').checked) {
      this.script?.(seconds);
      for (const pane of this.panes.slice(0, this.view.shown)) pane.next(seconds), pane.judgeNow(now);
    }
    this.decorate();
    for (const pane of this.panes) pane.label();
    this.view.draw();
    requestAnimationFrame((next) => this.frame(next));
  }

  decorate() {
    const { floor, ball } = this.loads, turnable = this.handles.find((h) => h.kept && !h.led);
    for (const { stage } of this.panes) {
      if (!this.mesh) return;
      stage.floor.position.z = this.floorAt;
      stage.floor.visible = floor !== null;
      stage.ball.visible = Boolean(ball);
      stage.ball.position.fromArray(this.ball);
      stage.ball.scale.setScalar(BALL - 0.002);
      stage.setHandles(this.handles.map((h) => h.vertex));
      stage.ring.visible = Boolean(turnable);
      if (turnable) stage.ring.position.copy(stage.at(turnable.vertex));
    }
    element('release').disabled = this.handles.length === 0;
  }

  // ---- the pointer ----

  listen() {
    const canvas = element('view');
    const at = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    // Before the camera's own listener, so that a press on the shell does not turn the view.
    canvas.addEventListener('pointerdown', (event) => this.press(event, ...at(event)), { capture: true });
    addEventListener('pointermove', (event) => this.gesture?.id === event.pointerId && this.gesture.move(...at(event)));
    for (const end of ['pointerup', 'pointercancel']) addEventListener(end, (event) => this.gesture?.id === event.pointerId && this.letGo());
    canvas.addEventListener('dblclick', () => this.view.fit());
    for (const k of [0, 1]) element(`method${k}`).addEventListener('change', ({ target }) => this.setMethod(k, target.value));
    for (const id of ['gravity', 'wind']) {
      const tell = () => { element(id).parentElement.querySelector('output').textContent = `${element(id).value} ${id === 'wind' ? 'm/s' : 'm/s\u00b2'}`; };
      element(id).addEventListener('input', tell);
      tell();
    }
    const on = (id, action) => element(id).addEventListener('click', action);
    on('pause', () => { this.paused = !this.paused; element('pause').textContent = this.paused ? 'Go on' : 'Pause'; });
    on('reset', () => this.reset());
    on('equal', () => { for (const pane of this.panes) pane.reset = true; });
    on('release', () => { this.handles = []; this.script = null; });
    on('lead', () => this.pullOver());
    on('compute', () => this.compute());
    on('cancel', () => this.cancel?.());
    element('paint').addEventListener('change', ({ target }) => target.checked && this.showRest());
    this.listenForFiles();
  }

  listenForFiles() {
    element('file').addEventListener('change', ({ target }) => target.files[0] && this.take(target.files[0]));
    for (const kind of ['dragenter', 'dragover']) addEventListener(kind, (event) => { event.preventDefault(); document.body.classList.add('dropping'); });
    for (const kind of ['dragleave', 'drop']) addEventListener(kind, (event) => { event.preventDefault(); document.body.classList.remove('dropping'); });
    addEventListener('drop', ({ dataTransfer }) => dataTransfer.files[0] && this.take(dataTransfer.files[0]));
  }

  reset() {
    this.handles = [];
    this.script = null;
    for (const pane of this.panes) pane.reset = true;
  }

  /** The rest shape, to paint on. */
  showRest() {
    this.reset();
    for (const { stage } of this.panes) stage.setShape(Float32Array.from(this.mesh.positions)), stage.setHeld([...this.held]);
  }

  press(event, x, y) {
    if (event.button > 0 || this.gesture || !this.mesh) return;
    const index = this.view.paneAt(x, y), found = element('paint').checked ? this.brush(x, y, index) : this.grab(x, y, index);
    if (!found) return;
    this.gesture = { id: event.pointerId, ...found };
    this.view.orbit.enabled = false;
    event.stopImmediatePropagation();
    this.gesture.move(x, y);
  }

  letGo() {
    this.gesture.end?.();
    this.gesture = null;
    this.view.orbit.enabled = true;
  }

  grab(x, y, index) {
    const { stage } = this.panes[index];
    if (this.waiting) return null;
    const ringed = this.handles.find((h) => h.kept), ring = ringed && this.view.screen(stage.at(ringed.vertex), index);
    if (ring) {
      const edge = this.view.screen(stage.at(ringed.vertex).add(new THREE.Vector3(0.09, 0, 0).applyQuaternion(this.view.camera.quaternion)), index);
      const radius = Math.hypot(edge.x - ring.x, edge.y - ring.y);
      if (Math.abs(Math.hypot(x - ring.x, y - ring.y) - radius) < 14) return this.turn(ringed, ring, x, y);
    }
    const found = this.view.pick(x, y, index, (v) => !this.held.has(v));
    if (found?.ball) return this.pushBall(found.point, index);
    if (!found || found.vertex < 0) return null;
    this.script = null;
    return this.pull(found.vertex, index);
  }

  pull(vertex, index) {
    const place = this.panes[index].stage.at(vertex), known = this.handles.find((h) => h.vertex === vertex);
    const handle = known ?? { vertex, position: place.toArray() };
    if (!known) this.handles.push(handle);
    handle.led = true;
    let from = null;
    return {
      move: (x, y) => {
        const to = this.view.onPlane(x, y, index, place);
        if (!to) return;
        from ??= to.clone().sub(place);
        handle.position = to.sub(from).toArray();
      },
      end: () => {
        handle.led = false;
        handle.kept = element('keep').checked || Boolean(known);
        if (!handle.kept) this.handles = this.handles.filter((h) => h !== handle);
        else this.handles = [handle, ...this.handles.filter((h) => h !== handle)];
      },
    };
  }

  turn(handle, middle, x, y) {
    let last = Math.atan2(y - middle.y, x - middle.x);
    return {
      move: (px, py) => {
        const angle = Math.atan2(py - middle.y, px - middle.x), step = Math.atan2(Math.sin(last - angle), Math.cos(last - angle));
        handle.rotation = turned(this.view.camera, step, handle.rotation ?? UPRIGHT);
        last = angle;
      },
    };
  }

  pushBall(point, index) {
    const start = this.ball;
    return {
      move: (x, y) => {
        const to = this.view.onPlane(x, y, index, point);
        if (to) this.ball = start.map((c, k) => c + to.getComponent(k) - point.getComponent(k));
      },
    };
  }

  /** The free end is led in an arc over what is held, for all methods alike. */
  pullOver() {
    this.reset();
    const { positions } = this.mesh, held = [...this.held], middle = new THREE.Vector3();
    for (const v of held) middle.add(new THREE.Vector3().fromArray(positions, 3 * v));
    middle.divideScalar(held.length);
    const at = (v) => new THREE.Vector3().fromArray(positions, 3 * v);
    let tip = 0;
    for (let v = 0; 3 * v < positions.length; ++v) if (at(v).distanceTo(middle) > at(tip).distanceTo(middle)) tip = v;
    const reach = at(tip).sub(middle), up = new THREE.Vector3(0, 0, 1), axis = reach.clone().cross(up).normalize();
    const handle = { vertex: tip, position: at(tip).toArray(), kept: true };
    let time = 0;
    this.scriptDone = false;
    this.view.fit(middle.clone().setZ(middle.z + 0.15), 3.2);
    this.script = (seconds) => {
      if (!this.handles.length) this.handles = [handle];
      time += seconds;
      this.scriptDone = time >= 3;
      const share = Math.min(1, time / 3), angle = 2.4 * share * share * (3 - 2 * share);
      handle.position = reach.clone().applyAxisAngle(axis, angle).multiplyScalar(1 - 0.15 * share).add(middle).toArray();
    };
    if (!this.methods[1] && this.facts.fields) this.setMethod(0, 'warp'), this.setMethod(1, 'reduced-shell');
  }

  // ---- meshes of one's own ----

  brush(x, y, index) {
    const { stage } = this.panes[index];
    if (!this.view.pick(x, y, index)) return null;
    return {
      move: (px, py) => {
        const found = this.view.pick(px, py, index);
        if (!found || found.ball) return;
        for (let v = 0; 3 * v < stage.shape.length; ++v) {
          if (stage.at(v).distanceTo(found.point) < BRUSH || v === found.vertex) element('erase').checked ? this.held.delete(v) : this.held.add(v);
        }
        for (const pane of this.panes) pane.stage.setHeld([...this.held]);
        element('compute').disabled = false;
      },
    };
  }

  async take(file) {
    try {
      const mesh = placed(readObj(await file.text()), element('z_up').checked ? 'z' : 'y');
      await this.open({ name: file.name, label: file.name, frequency: DROPPED_HERTZ }, { ...mesh, held: lowEnd(mesh.positions) }, null);
    } catch (error) {
      this.say(`${file.name}: ${error.message}`);
    }
  }

  async compute() {
    const { shape } = this, mesh = { ...this.mesh, held: Uint32Array.from([...this.held].sort((a, b) => a - b)) };
    const helper = await Helper.made(), busy = (on) => { for (const id of ['progress', 'cancel']) element(id).hidden = !on; element('compute').disabled = on; };
    this.cancel = () => { helper.end(); busy(false); element('phase').textContent = 'cancelled'; };
    helper.told = ({ phase, fraction }) => {
      element('progress').value = phase < 6 ? 0.15 * (phase + fraction) / 6 : 0.15 + 0.85 * fraction;
      element('phase').textContent = PHASES[phase] ?? '';
    };
    element('paint').checked = false;
    busy(true);
    try {
      const { bytes } = await helper.ask('precompute', { mesh, recipe: { frequency: shape.frequency, fields: shape.fields, poses: shape.poses } });
      element('phase').textContent = '';
      busy(false);
      await this.open({ ...shape, mesh, bytes }, mesh, bytes);
    } catch (error) {
      element('phase').textContent = '';
      busy(false);
      this.say(error.message);
    }
    helper.end();
  }
}

const page = (window.playground = new Page());
page.start().catch((error) => {
  page.say(`The playground could not start: ${error.message}`);
  console.error(error);
});
