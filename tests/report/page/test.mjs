// The report's page in headless Chromium: it loads without errors, its canvas is not blank, the slider moves the shells, and
// nothing is wider than a phone.
//
// usage: node test.mjs INDEX_HTML [SCREENSHOT_FOLDER]
// Exits with 77 where no Chromium is found (CHROMIUM, or chromium, chromium-browser, google-chrome on the path).
import { chromium } from "playwright-core";
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import path from "node:path";
import { pathToFileURL } from "node:url";

function browserPath() {
  const names = ["chromium", "chromium-browser", "google-chrome"];
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  for (const name of names) {
    try {
      return execFileSync("sh", ["-c", `command -v ${name}`], { encoding: "utf8" }).trim();
    } catch {}
  }
  console.log("skipped: no Chromium (set CHROMIUM, or apt install chromium)");
  process.exit(77);
}

/** Number of different colours on the canvas, and a hash of its pixels. */
function look(page) {
  return page.evaluate(() => {
    const canvas = document.querySelector("#player canvas");
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const pixels = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
    let hash = 0;
    for (const p of pixels) hash = (Math.imul(hash, 31) + p) | 0;
    return { colours: new Set(pixels).size, hash };
  });
}

function seek(page, share) {
  return page.evaluate((s) => {
    const slider = document.querySelector("#player input[type=range]");
    slider.value = String(s * Number(slider.max));
    slider.dispatchEvent(new Event("input"));
  }, share);
}

const [file, folder] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: browserPath(),
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  const troubles = [];
  page.on("pageerror", (e) => troubles.push(e.message));
  page.on("console", (m) => m.type() === "error" && troubles.push(m.text()));
  page.on("request", (r) => /^(file|data|blob):/.test(r.url()) || troubles.push(`asks for ${r.url()}`));
  await page.goto(pathToFileURL(path.resolve(file)).href);
  const shot = (name, options = {}) => folder && page.screenshot({ path: path.join(folder, name), ...options });
  await shot("opening.png");

  // The page opens with one plot, in which every method of the page's list is named once, of short runs all but
  // the explicit shell, which is their reference; all else is folded.
  const opening = await page.evaluate(() => {
    const plots = [...document.querySelectorAll(".plot svg")].filter((svg) => svg.checkVisibility());
    const names = [...document.querySelectorAll(".methods b")].map((b) => b.textContent);
    const words = [...(plots[0]?.querySelectorAll("text") ?? [])].map((t) => t.textContent.trim());
    return { plots: plots.length, names, counts: names.map((n) => words.filter((w) => w === n).length), top: plots[0]?.getBoundingClientRect().bottom };
  });
  assert.equal(opening.plots, 1, "one plot is open");
  assert.ok(opening.names.length >= 8 && opening.names.every((n, k) => opening.counts[k] === 1 || n === "full shell, explicit"), JSON.stringify(opening));
  assert.ok(opening.top <= 900, `the plot is seen at once: it ends at ${opening.top}`);
  await page.evaluate(() => (location.hash = "#watch"));
  await page.waitForSelector("html[data-player=ready]", { timeout: 60_000 });
  await page.evaluate(() => document.querySelectorAll("details").forEach((d) => (d.open = true)));

  // Of every plot, the title, both axes' words, and no words over others.
  const faults = await page.evaluate(() => {
    const found = [];
    for (const svg of document.querySelectorAll(".plot svg")) {
      const title = svg.querySelector("title")?.textContent ?? "";
      const texts = [...svg.querySelectorAll("text")].map((t) => [t.textContent.trim(), t.getBoundingClientRect(), t.hasAttribute("transform")]);
      if (!title || !texts.some((t) => t[0] === title)) found.push(`a plot without a title: ${texts[0]?.[0]}`);
      if (texts.filter((t) => t[2]).length < 1) found.push(`${title}: an axis says nothing`);
      const box = svg.getBoundingClientRect();
      for (const [i, [a, r]] of texts.entries()) {
        if (!a) continue;
        if (r.left < box.left || r.right > box.right || r.top < box.top || r.bottom > box.bottom) found.push(`${title}: '${a}' is cut off`);
        for (const [b, q] of texts.slice(0, i)) {
          const wide = Math.min(r.right, q.right) - Math.max(r.left, q.left), high = Math.min(r.bottom, q.bottom) - Math.max(r.top, q.top);
          if (b && wide > 1 && high > 4) found.push(`${title}: '${a}' lies on '${b}'`);
        }
      }
    }
    const cells = [...document.querySelectorAll("td")].map((t) => t.textContent).filter((t) => /^-0\.0+( |$)/.test(t));
    return found.concat(cells.map((c) => `a cell says ${c}`));
  });
  assert.deepEqual(faults, []);

  const scenes = await page.$$eval("#player select option", (options) => options.map((o) => o.textContent));
  assert.ok(scenes.some((name) => name.includes("ball")), `a scene with a collider: ${scenes}`);
  for (let k = 0; k < scenes.length; k++) {
    await page.selectOption("#player select", String(k));
    await page.waitForTimeout(1000);
    await seek(page, 0);
    const first = await look(page);
    await seek(page, 0.5);
    const later = await look(page);
    // A blank canvas has one colour; shaded shells over it have hundreds.
    assert.ok(later.colours > 100, `${scenes[k]}: ${later.colours} colours`);
    assert.notEqual(first.hash, later.hash, `${scenes[k]}: the slider moves the shells`);
    await page.$eval("#player", (e) => e.scrollIntoView());
    await shot(`player_${k}_beside.png`);
    // Every method but the explicit shell, which is the reference's, has its box and its error; a further one shows.
    const ticks = await page.$$eval("#player .tracks label", (labels) => labels.map((l) => l.textContent.trim()));
    assert.ok(ticks.length === 8 && ticks.slice(0, 7).every((t) => /: error [\d.]+ %$/.test(t)) && /full shell: the reference$/.test(ticks[7]), ticks.join());
    await page.check("#player .tracks label:first-child input");
    assert.notEqual((await look(page)).hash, later.hash, `${scenes[k]}: ${ticks[0]} shows`);
    await page.uncheck("#player .tracks label:first-child input");
    await page.uncheck("#player [name=beside]");
    assert.notEqual((await look(page)).hash, later.hash, `${scenes[k]}: overlaid looks different`);
    await shot(`player_${k}.png`);
    await page.check("#player [name=beside]");
  }
  await shot("desktop.png", { fullPage: true });

  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(500);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 390, `nothing but plots and tables scrolls sideways: the page is ${wide} wide`);
  await shot("phone.png", { fullPage: true });
  await page.$eval("#player", (e) => e.scrollIntoView());
  await shot("phone_player.png");
  assert.deepEqual(troubles, [], "no errors, no network");
  console.log(`page: OK, ${scenes.length} scenes`);
} finally {
  await browser.close();
}
