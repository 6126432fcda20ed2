// The headless Chromium that tests and pictures of pages run in.

import { chromium } from 'playwright-core';
import { execFileSync } from 'node:child_process';

/** A browser that draws without a graphics card. Ends the program with a line "skipped: WHAT ..." where there is none. */
export function launch(what) {
  return chromium.launch({
    executablePath: browserPath(what),
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
  });
}

function browserPath(what) {
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  for (const name of ['chromium', 'chromium-browser', 'google-chrome']) {
    try {
      return execFileSync('sh', ['-c', `command -v ${name}`], { encoding: 'utf8' }).trim();
    } catch {}
  }
  console.log(`skipped: ${what}: no Chromium (set CHROMIUM, or apt install chromium)`);
  process.exit(0);
}
