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
  await page.waitForSelector("html[data-player=ready]", { timeout: 60_000 });
  const shot = (name, options = {}) => folder && page.screenshot({ path: path.join(folder, name), ...options });

  const scenes = await page.$$eval("#player select option", (options) => options.map((o) => o.textContent));
  assert.ok(scenes.length > 0, "the player has scenes");
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
