// Pictures of the pages that the project makes, for docs: each page is opened as a file in headless Chromium.
//
// usage: node page_pictures.mjs FOLDER PLAYER DOCS_SITE REPORT
// A page that is not there is left out with a line.

import { existsSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { launch } from './browser.mjs';

const [folder, player, site, report] = process.argv.slice(2);
const browser = await launch('pictures of pages');

async function picture(name, file, { query = '', size = [1280, 860] }, act) {
  if (!existsSync(file)) {
    console.log(`left out: ${name}: there is no ${file}`);
    return;
  }
  const page = await browser.newPage({ viewport: { width: size[0], height: size[1] } });
  await page.goto(pathToFileURL(path.resolve(file)).href + query);
  await act(page);
  await page.screenshot({ path: path.join(folder, `${name}.png`) });
  await page.close();
  console.log(path.join(folder, `${name}.png`));
}

await picture('player', player, { query: '?still' }, async (page) => {
  await page.waitForSelector('html[data-player=ready]', { timeout: 60_000 });
  await page.$eval('input[type=range]', (slider) => {
    slider.value = String(Math.round(0.45 * Number(slider.max)));
    slider.dispatchEvent(new Event('input'));
  });
  await page.waitForTimeout(500);
});

await picture('docs_site', site, {}, async (page) => {
  await page.waitForTimeout(2000);                          // its search listens when its index is read
  await page.click('input.md-search__input');
  await page.keyboard.type('friction', { delay: 50 });
  await page.waitForSelector('.md-search-result__item', { timeout: 30_000 });
  await page.waitForTimeout(500);
});

await picture('report', report, { size: [1280, 900] }, (page) => page.waitForTimeout(500));

await browser.close();
