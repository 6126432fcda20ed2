// The playground in headless Chromium: it opens as a file, vertices follow the pointer, and the numbers shown are finite.
//
// usage: node test_page.mjs INDEX_HTML [SCREENSHOT_FOLDER]
// Ends with a line "skipped: ..." where no Chromium is found (CHROMIUM, or chromium, chromium-browser, google-chrome on the path).

import assert from 'node:assert/strict';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { launch } from './browser.mjs';

const [file, folder] = process.argv.slice(2);
const browser = await launch('the playground in a browser');
const troubles = [];
const PATIENCE = { timeout: 90_000 };                       // a hang, not a measure of speed

async function opened(options) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 860 }, ...options });
  page.on('pageerror', (e) => troubles.push(e.message));
  page.on('console', (m) => m.type() === 'error' && troubles.push(m.text()));
  page.on('request', (r) => /^(file|data|blob):/.test(r.url()) || troubles.push(`asks for ${r.url()}`));
  await page.goto(pathToFileURL(path.resolve(file)).href);
  await page.waitForSelector('html[data-playground=ready]', PATIENCE);
  return page;
}

const shot = (page, name) => folder && page.screenshot({ path: path.join(folder, `${name}.png`) });
/** The number that a pane shows of the method chosen for it, once it shows one. */
const number = (page, pane, kind) => page.waitForFunction(([k, name]) => {
  const tag = document.getElementById(`tag${k}`), chosen = document.getElementById(`method${k}`).selectedOptions[0].textContent;
  const text = tag.querySelector(`.${name}`).textContent.replace(/[^\d.]/g, '');
  return tag.querySelector('b').textContent === chosen && text ? { value: Number(text) } : null;
}, [pane, kind], PATIENCE).then((found) => found.jsonValue()).then(({ value }) => value);
const frames = (page, more, pane = 0) => page.evaluate(([k]) => window.playground.panes[k].moved ?? 0, [pane])
  .then((now) => page.waitForFunction(([k, least]) => window.playground.panes[k].moved >= least, [pane, now + more], PATIENCE));

/** Where a vertex is: in space, and on the page. */
const place = (page, vertex, pane = 0) => page.evaluate(([v, k]) => {
  const { view, panes } = window.playground, at = panes[k].stage.at(v), box = view.canvas.getBoundingClientRect(), { x, y } = view.screen(at, k);
  return { at: at.toArray(), x: x + box.left, y: y + box.top };
}, [vertex, pane]);

/** The vertex furthest from what is held. */
const tipOf = (page) => page.evaluate(() => {
  const { mesh, held } = window.playground, first = [...held][0], far = (v) => Math.hypot(...[0, 1, 2].map((c) => mesh.positions[3 * v + c] - mesh.positions[3 * first + c]));
  return Array.from({ length: mesh.positions.length / 3 }, (_, v) => v).reduce((a, b) => (far(a) >= far(b) ? a : b));
});

async function choose(page, label) {
  await page.click(`#shapes button:text-is("${label}")`);
  await page.waitForFunction((words) => document.querySelector('#shapes [aria-pressed=true]')?.textContent === words && !window.playground.waiting, label, PATIENCE);
  await frames(page, 3);
}

/** Presses on a vertex. On a slow machine a shell that swings is elsewhere by then: so once more, as a hand would. */
async function pressed(page, vertex, pane, down, up) {
  for (let attempt = 0; attempt < 20; ++attempt) {
    const from = await place(page, vertex, pane);
    await down(from);
    if (await page.evaluate(() => window.playground.handles.some((handle) => handle.led))) return from;
    await up();
  }
  throw new Error(`vertex ${vertex} was not met in twenty presses`);
}

async function dragged(page, vertex, by, pane = 0) {
  const down = async ({ x, y }) => { await page.mouse.move(x, y); await page.mouse.down(); };
  const from = await pressed(page, vertex, pane, down, () => page.mouse.up());
  for (let k = 1; k <= 8; ++k) {
    await page.mouse.move(from.x + (by[0] * k) / 8, from.y + (by[1] * k) / 8);
    await frames(page, 2, pane);
  }
  return from;
}

const claims = {
  async 'a dragged vertex follows the pointer and swings back when let go'(page) {
    await page.click('#pause');
    await page.click('#reset');
    await page.waitForFunction(() => !window.playground.panes[0].reset && !window.playground.panes[0].mover.busy, null, PATIENCE);
    const tip = await tipOf(page);
    await page.click('#pause');
    const led = await page.evaluate(() => window.playground.handles.length);
    assert.equal(led, 0);
    const from = await dragged(page, tip, [-40, -130]);
    await frames(page, 20);
    const seen = await page.evaluate(() => {
      const { handles, panes } = window.playground, { vertex, position } = handles[0], at = panes[0].stage.at(vertex).toArray();
      return { off: Math.hypot(...at.map((x, c) => x - position[c])), moved: position };
    });
    await shot(page, 'dragged');
    // A millionth of the metre that the shell measures is what the library calls met; floats on the way have 1e-7.
    assert.ok(seen.off < 1e-5, `the vertex is ${seen.off} m from the pointer`);
    assert.ok(Math.hypot(...seen.moved.map((x, c) => x - from.at[c])) > 0.15, 'it was led far');
    await page.mouse.up();
    await frames(page, 40);
    const after = await place(page, tip);
    assert.ok(after.at[2] < seen.moved[2] - 0.05, 'it falls back');
    assert.equal(await page.evaluate(() => window.playground.handles.length), 0);
  },

  async 'every method shows a step\'s time and an error'(page) {
    for (const name of await page.$$eval('#method0 option', (options) => options.map((o) => o.value))) {
      await page.selectOption('#method0', name);
      const micros = await number(page, 0, 'micros');
      assert.ok(Number.isFinite(micros) && micros > 0, `${name}: ${micros} microseconds`);
      if (name === 'shell-implicit') assert.match(await page.textContent('#tag0 .error'), /judged by/);
      else assert.ok(Number.isFinite(await number(page, 0, 'error')), name);
    }
    await page.selectOption('#method0', 'polynomial-shell');
  },

  async 'every shell moves under gravity and goes on without trouble'(page) {
    for (const label of await page.$$eval('#shapes button', (buttons) => buttons.map((b) => b.textContent))) {
      await choose(page, label);
      // A tenth of a millimetre of a metre: no rounding, and less than any of them sags.
      await page.waitForFunction(() => {
        const { mesh, panes } = window.playground;
        return mesh.positions.some((x, i) => Math.abs(panes[0].stage.shape[i] - x) > 1e-4);
      }, null, PATIENCE);
      assert.equal(await page.textContent('#trouble'), '', label);
    }
  },

  async 'pulled over, the reduced shell is nearer to the full one than the warp'(page) {
    await choose(page, 'Flat strip');
    await page.click('#lead');
    await page.waitForFunction(() => window.playground.scriptDone, null, PATIENCE);
    for (const k of [0, 1]) await frames(page, 30, k);
    await page.waitForTimeout(2500);
    await shot(page, 'pulled_over');
    const [warp, reduced] = [await number(page, 0, 'error'), await number(page, 1, 'error')];
    assert.ok(reduced < warp / 2, `warp ${warp} %, reduced ${reduced} %`);
    await page.click('#release');
    await page.selectOption('#method1', '');
  },

  async 'a kept handle stays, and its ring turns the vertex'(page) {
    await choose(page, 'Leaf');
    await page.selectOption('#method0', 'polynomial-shell');
    await page.check('#keep');
    await dragged(page, await tipOf(page), [-20, -60]);
    await page.mouse.up();
    await frames(page, 5);
    const tip = await page.evaluate(() => window.playground.handles[0].vertex);
    const kept = await place(page, tip), ring = await page.evaluate((v) => {
      const { view, panes } = window.playground, edge = panes[0].stage.at(v), across = edge.clone().set(0.09, 0, 0);
      return view.screen(edge.add(across.applyQuaternion(view.camera.quaternion)), 0).x;
    }, tip);
    const radius = ring - kept.x, before = await page.evaluate(() => [...window.playground.panes[0].stage.shape]);
    await page.mouse.move(kept.x + radius, kept.y);
    await page.mouse.down();
    for (let k = 1; k <= 6; ++k) await page.mouse.move(kept.x + radius * Math.cos(k / 10), kept.y - radius * Math.sin(k / 10)), await frames(page, 3);
    await page.mouse.up();
    await frames(page, 20);
    const seen = await page.evaluate(([earlier]) => {
      const { handles, panes } = window.playground, now = panes[0].stage.shape;
      return { count: handles.length, rotation: handles[0].rotation, moved: Math.max(...earlier.map((x, i) => Math.abs(x - now[i]))) };
    }, [before]);
    await shot(page, 'turned');
    assert.equal(seen.count, 1);
    // Six tenths of a radian: the trace of the matrix is 1 + 2 cos of the angle; the ring's pixels are whole ones.
    const angle = Math.acos((seen.rotation[0] + seen.rotation[4] + seen.rotation[8] - 1) / 2);
    assert.ok(Math.abs(angle - 0.6) < 0.05, `turned by ${angle}`);
    assert.ok(seen.moved > 0.005, 'the shell follows the turn');
    const off = Math.hypot(...(await place(page, tip)).at.map((x, c) => x - kept.at[c]));
    // As where it is led: what the library calls met, and floats.
    assert.ok(off < 1e-5, `the vertex is ${off} m from where it is held`);
    await page.click('#release');
    await page.uncheck('#keep');
  },

  async 'nothing falls through the floor, and the ball pushes'(page) {
    await choose(page, 'Leaf');
    await page.fill('#gravity', '20');
    await page.check('#floor');
    await page.check('#ball');
    await frames(page, 60);
    assert.ok(Number.isFinite(await number(page, 0, 'error')));
    await shot(page, 'colliders');
    const seen = await page.evaluate(() => {
      const { panes, loads } = window.playground, shape = panes[0].stage.shape, lowest = { gap: Infinity };
      for (let i = 0; i < shape.length; i += 3) {
        lowest.gap = Math.min(lowest.gap, shape[i + 2] - loads.floor, Math.hypot(...[0, 1, 2].map((c) => shape[i + c] - loads.ball.centre[c])) - loads.ball.radius);
      }
      return lowest.gap;
    });
    // Fields cannot follow every dent: a centimetre of the metre.
    assert.ok(seen > -0.01, `${seen} m inside`);
    const from = await page.evaluate(() => { const { view, ball } = window.playground, v = view.orbit.target.clone().fromArray(ball); return view.screen(v, 0); });
    const before = await page.evaluate(() => [...window.playground.panes[0].stage.shape]);
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    for (let k = 1; k <= 6; ++k) await page.mouse.move(from.x, from.y - 20 * k), await frames(page, 3);
    await page.mouse.up();
    const moved = await page.evaluate((earlier) => Math.max(...earlier.map((x, i) => Math.abs(x - window.playground.panes[0].stage.shape[i]))), before);
    await shot(page, 'ball_pushed');
    assert.ok(moved > 0.05, `the ball moved the leaf by ${moved} m`);
    for (const id of ['#floor', '#ball']) await page.uncheck(id);
    await page.fill('#gravity', '4');
  },

  async 'wind blows the way that it should, and slow motion is slow'(page) {
    await choose(page, 'Flat strip');
    const gravity = await page.inputValue('#gravity');
    await page.fill('#gravity', '0');
    await page.click('#pause');
    await page.click('#reset');
    await page.waitForFunction(() => !window.playground.panes[0].reset && !window.playground.panes[0].mover.busy, null, PATIENCE);
    const tip = await tipOf(page), before = (await place(page, tip)).at;
    await page.fill('#wind', '12');
    await page.click('#pause');
    // A millimetre of the metre along the air's way: no rounding, and without wind nothing else moves it.
    await page.waitForFunction(([v, from]) => {
      const { panes, loads } = window.playground, at = panes[0].stage.at(v).toArray(), way = loads.wind;
      return at.reduce((sum, x, c) => sum + (x - from[c]) * way[c], 0) / Math.hypot(...way) > 1e-3;
    }, [tip, before], PATIENCE);
    await shot(page, 'wind');
    await page.selectOption('#speed', '0.1');
    const seen = await page.evaluate(() => new Promise((done) => {
      const { playground } = window, [pane] = playground.panes, found = [];
      pane.next = function (seconds) { found.at(-1)[1] = seconds; Object.getPrototypeOf(pane).next.call(pane, seconds); };
      playground.frame = function (now) {
        found.push([Math.min((now - this.last) / 1000, 0.1), 0]);
        Object.getPrototypeOf(playground).frame.call(this, now);
        if (found.length === 5) { delete pane.next; delete playground.frame; done(found); }
      };
    }));
    for (const [elapsed, simulated] of seen) assert.ok(Math.abs(simulated - 0.1 * elapsed) < 1e-12, `${simulated} s of ${elapsed} s`);
    assert.ok(seen.some(([elapsed]) => elapsed > 0));
    await page.selectOption('#speed', '1');
    await page.fill('#wind', '0');
    await page.fill('#gravity', gravity);
  },

  async 'a dropped mesh is painted, precomputed, cancelled and moved'(page) {
    const side = 12, lines = [];
    for (let i = 0; i <= side; ++i) for (let j = 0; j <= side; ++j) lines.push(`v ${i} 0 ${j}`);
    for (let i = 0; i < side; ++i) for (let j = 0; j < side; ++j) { const a = i * (side + 1) + j + 1; lines.push(`f ${a} ${a + 1} ${a + side + 2} ${a + side + 1}`); }
    await page.evaluate((text) => {
      const files = new DataTransfer();
      files.items.add(new File([text], 'sheet.obj'));
      window.dispatchEvent(new DragEvent('drop', { dataTransfer: files, cancelable: true }));
    }, lines.join('\n'));
    await page.waitForFunction(() => document.getElementById('facts').textContent.startsWith('169 vertices'), null, PATIENCE);
    const held = () => page.evaluate(() => window.playground.held.size), before = await held();
    assert.equal(before, side + 1, 'held at first: one side');
    await page.check('#paint');
    const corner = await place(page, 168);
    await page.mouse.move(corner.x, corner.y);
    await page.mouse.down();
    await page.mouse.up();
    assert.ok((await held()) > before, 'painting holds more');
    await shot(page, 'painted');
    await page.click('#compute');
    await page.click('#cancel');
    assert.equal(await page.textContent('#phase'), 'cancelled');
    await page.check('#erase');
    await page.check('#paint');
    await page.mouse.move(corner.x, corner.y);
    await page.mouse.down();
    await page.mouse.up();
    assert.equal(await held(), before, 'erased again');
    await page.uncheck('#erase');
    await page.click('#compute');
    await page.waitForFunction(() => document.getElementById('progress').value > 0.2, null, PATIENCE);
    await page.waitForFunction(() => window.playground.bytes && !window.playground.waiting, null, PATIENCE);
    await frames(page, 40);
    const tip = await tipOf(page), at = await place(page, tip);
    assert.ok(at.at[2] < -0.01, `the free end hangs: ${at.at[2]}`);
    assert.ok(Number.isFinite(await number(page, 0, 'error')));
    await shot(page, 'dropped');
  },

  async 'a file that is no mesh is refused with the line'(page) {
    await page.evaluate(() => {
      const files = new DataTransfer();
      files.items.add(new File(['v 0 0 0\nv 1 0 0\nf 1 2 9'], 'broken.obj'));
      window.dispatchEvent(new DragEvent('drop', { dataTransfer: files, cancelable: true }));
    });
    await page.waitForFunction(() => document.getElementById('trouble').textContent.includes('broken.obj: line 3'), null, PATIENCE);
  },

  async 'the page fits a phone, and a finger drags'(page) {
    const phone = await opened({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
    await frames(phone, 3);
    assert.ok((await phone.evaluate(() => document.documentElement.scrollWidth)) <= 390, 'nothing is wider than the phone');
    const tip = await tipOf(phone), client = await phone.context().newCDPSession(phone);
    const touch = (type, x, y) => client.send('Input.dispatchTouchEvent', { type, touchPoints: type === 'touchEnd' ? [] : [{ x, y }] });
    const from = await pressed(phone, tip, 0, ({ x, y }) => touch('touchStart', x, y), () => touch('touchEnd'));
    for (let k = 1; k <= 5; ++k) await touch('touchMove', from.x - 6 * k, from.y - 14 * k), await frames(phone, 2);
    await frames(phone, 10);
    const to = await place(phone, tip);
    // The shell swings until it is touched: it is led from where it is then, by what the finger goes. Pixels are whole ones.
    const off = await phone.evaluate(() => {
      const { handles: [{ vertex, position }], panes } = window.playground, at = panes[0].stage.at(vertex).toArray();
      return Math.hypot(...at.map((x, c) => x - position[c]));
    });
    assert.ok(off < 1e-5, `the vertex is ${off} m from where the finger leads it`);
    assert.ok(to.y < from.y - 40 && Math.abs(to.x - from.x + 30) < 40, `${to.x - from.x}, ${to.y - from.y}`);
    await touch('touchEnd');
    await shot(phone, 'phone');
    await phone.close();
  },
};

try {
  const page = await opened();
  await frames(page, 5);
  for (const [name, claim] of Object.entries(claims)) {
    await claim(page);
    console.log(`ok: ${name}`);
  }
  assert.deepEqual(troubles, [], 'no errors, no network');
  console.log(`playground: OK, ${Object.keys(claims).length} claims`);
} finally {
  await browser.close();
}
