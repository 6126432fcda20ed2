// The playground in headless Chromium: it opens as a file, vertices follow the pointer, and the numbers shown are finite.
//
// usage: node test_page.mjs INDEX_HTML [SCREENSHOT_FOLDER]
// Ends with a line "skipped: ..." where no Chromium is found (CHROMIUM, or chromium, chromium-browser, google-chrome on the path).

import { chromium } from 'playwright-core';
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

function browserPath() {
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  for (const name of ['chromium', 'chromium-browser', 'google-chrome']) {
    try {
      return execFileSync('sh', ['-c', `command -v ${name}`], { encoding: 'utf8' }).trim();
    } catch {}
  }
  console.log('skipped: the playground in a browser: no Chromium (set CHROMIUM, or apt install chromium)');
  process.exit(0);
}

const [file, folder] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: browserPath(),
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
const troubles = [];
const PATIENCE = { timeout: 180_000 };                      // a hang, not a measure of speed

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

async function dragged(page, vertex, by, pane = 0) {
  const from = await place(page, vertex, pane);
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
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
    await frames(page, 1);
    const tip = await tipOf(page), rest = await place(page, tip);
    await page.click('#pause');
    const led = await page.evaluate(() => window.playground.handles.length);
    assert.equal(led, 0);
    await dragged(page, tip, [-40, -130]);
    await frames(page, 20);
    const seen = await page.evaluate(() => {
      const { handles, panes } = window.playground, { vertex, position } = handles[0], at = panes[0].stage.at(vertex).toArray();
      return { off: Math.hypot(...at.map((x, c) => x - position[c])), moved: position };
    });
    await shot(page, 'dragged');
    // A millionth of the metre that the shell measures is what the library calls met; floats on the way have 1e-7.
    assert.ok(seen.off < 1e-5, `the vertex is ${seen.off} m from the pointer`);
    assert.ok(Math.hypot(...seen.moved.map((x, c) => x - rest.at[c])) > 0.15, 'it was led far');
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

  async 'the page fits a phone, and a finger drags'(page) {
    const phone = await opened({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
    await frames(phone, 3);
    assert.ok((await phone.evaluate(() => document.documentElement.scrollWidth)) <= 390, 'nothing is wider than the phone');
    const tip = await tipOf(phone), from = await place(phone, tip), client = await phone.context().newCDPSession(phone);
    const touch = (type, x, y) => client.send('Input.dispatchTouchEvent', { type, touchPoints: type === 'touchEnd' ? [] : [{ x, y }] });
    await touch('touchStart', from.x, from.y);
    for (let k = 1; k <= 5; ++k) await touch('touchMove', from.x - 6 * k, from.y - 14 * k), await frames(phone, 2);
    await frames(phone, 10);
    const to = await place(phone, tip);
    // Pixels: the pointer's place is a whole one, and the vertex began some pixels beside the finger.
    assert.ok(Math.hypot(to.x - (from.x - 30), to.y - (from.y - 70)) < 8, `${to.x - from.x}, ${to.y - from.y}`);
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
