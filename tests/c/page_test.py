"""The page of `simulate --html`: it holds the motion that the point cache holds, and plays it in a browser without the network.

usage: page_test.py motion|browser|view PROGRAM MESH FOLDER

`browser` exits with 77 where no Chromium is found (CHROMIUM, or chromium, chromium-browser, google-chrome on the path).
"""

import base64
import json
import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

METHODS = ["warp", "rotation-strain", "shell-implicit"]
# Out of reach, so that the strip falls as it would alone. The ball is a fifth higher from a tenth of a second on.
COLLIDERS = ["--collider", "plane:z=-5", "--collider", "sphere:0.2@1,0,-4:0,0,0.2@0.1", "--collider", "box:0.1,0.1,0.1@1,0,-4"]
# Runs inside the page once it plays: what the canvas shows at rest, later, turned and with a method hidden, and what was asked for.
PROBE = """
<script>
const picture = () => {
  const view = document.getElementById("view"), copy = document.createElement("canvas");
  [copy.width, copy.height] = [view.width, view.height];
  const pen = copy.getContext("2d");
  pen.drawImage(view, 0, 0);
  const pixels = new Uint32Array(pen.getImageData(0, 0, copy.width, copy.height).data.buffer);
  return { colours: new Set(pixels).size, hash: pixels.reduce((h, p) => (Math.imul(h, 31) + p) | 0, 7) };
};
const seek = (share) => {
  const time = document.getElementById("time");
  time.value = String(share * time.max);
  time.dispatchEvent(new Event("input"));
};
const drag = (id) => {
  const view = document.getElementById("view");
  view.setPointerCapture = () => {};
  for (const [type, x] of [["pointerdown", 300], ["pointermove", 380], ["pointerup", 380]])
    view.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: x, clientY: 300, buttons: 1 }));
};
const seen = {};
seek(0); seen.rest = picture();
seek(0.5); seen.later = picture();
drag(); seen.turned = picture();
document.querySelector("#methods input").click(); seen.hidden = picture();
seen.curves = document.querySelectorAll("#plots polyline").length;
const middle = (solid) => [0, 1, 2].map((c) => solid.now.reduce((sum, x, i) => (i % 3 === c ? sum + x : sum), 0) / (solid.now.length / 3));
seek(0); seen.low = middle(solids[1]);
seek(1); seen.high = middle(solids[1]);
seen.clock = document.getElementById("clock").textContent;
seen.asked = performance.getEntriesByType("resource").map((e) => e.name).filter((n) => !n.startsWith("data:"));
seen.wide = document.documentElement.scrollWidth - innerWidth;
seen.ready = document.documentElement.dataset.player || document.getElementById("trouble").textContent;
document.documentElement.dataset.seen = btoa(JSON.stringify(seen));
</script>
"""


def run(program, mesh, folder, *options):
    """A strip held at one end that falls for ten frames, by three methods."""
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run([program, "simulate", mesh, "--clamp-box", "0", "-1", "-1", "0", "1", "1", "--gravity", "0", "0", "-1",
                           "--frames", "10", *([] if "--method" in options else ["--method", "warp"]), *map(str, options)], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def data_of(page):
    return json.loads(re.search(r'<script id="motion" type="application/json">(.*?)</script>', page, re.S).group(1))


def numbers(text, kind):
    raw = base64.b64decode(text)
    return [x for (x,) in struct.iter_unpack("<" + kind, raw)]


def check_motion(program, mesh, folder):
    page = folder / "strip.html"
    code, out, err = run(program, mesh, folder, "--out", folder, "--html", page, *COLLIDERS, "--compare", ",".join(METHODS[1:]))
    assert code == 0 and f"page: {page}\n" in out, out + err
    text = page.read_text(encoding="utf-8")
    assert not re.search(r'(src|href)="?(https?:)?//', text), "the page asks for the network"
    motion = data_of(text)
    assert [t["method"] for t in motion["tracks"]] == METHODS
    assert motion["up"] == 2 and len(motion["times"]) == 11 and motion["words"]
    assert len(motion["tracks"][0]["estimates"]) == 8 and not motion["tracks"][2]["estimates"]
    plane, ball, box = motion["colliders"]
    assert [plane["kind"], ball["kind"], box["kind"]] == ["plane", "sphere", "box"] and ball["radius"] == 0.2
    still, moving = numbers(plane["poses"], "f"), numbers(ball["poses"], "f")
    assert still == [0, 0, -5, 1, 0, 0, 0, 1, 0, 0, 0, 1] and len(moving) == 12 * 11
    assert moving[:3] == [1, 0, -4] and abs(moving[-10] + 3.8) < 1e-6, moving  # 32 bits
    cache = (folder / "strip.pc2").read_bytes()
    points, samples = struct.unpack_from("<i", cache, 16)[0], struct.unpack_from("<i", cache, 28)[0]
    rest, track = numbers(motion["shells"][0]["rest"], "f"), motion["tracks"][0]
    steps = numbers(track["data"], "h")
    assert samples == 11 and len(rest) == 3 * points and len(steps) == samples * 3 * points
    written = struct.unpack_from(f"<{samples * 3 * points}f", cache, 32)
    # Half a step, and the rounding of the cache's and the rest positions' 32 bits at coordinates up to 2.
    allowed = 0.5 * track["unit"] + 4e-7
    worst = max(abs(rest[i % (3 * points)] + track["unit"] * step - x) for i, (step, x) in enumerate(zip(steps, written)))
    assert worst <= allowed, (worst, allowed)
    assert max(map(abs, steps)) == 32767
    print(f"motion: OK, off by {worst:.1e} of {allowed:.1e} allowed")


def browser():
    names = [os.environ.get("CHROMIUM"), *map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))]
    found = [name for name in names if name]
    if not found:
        print("skipped: no Chromium (set CHROMIUM, or apt install chromium)")
        sys.exit(77)
    return found[0]


def check_browser(program, mesh, folder):
    chromium = browser()
    code, out, err = run(program, mesh, folder, "-q", "--html", folder / "strip.html", *COLLIDERS, "--compare", ",".join(METHODS[1:]))
    assert code == 0, out + err
    probed = folder / "probed.html"
    probed.write_text((folder / "strip.html").read_text(encoding="utf-8").replace("</body>", PROBE + "</body>"), encoding="utf-8")
    for size in ("1280,900", "500,900"):  # a desktop, and as narrow as a headless window gets
        done = subprocess.run([chromium, "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                               "--ignore-gpu-blocklist", f"--user-data-dir={folder / 'browser'}", f"--window-size={size}",
                               f"--screenshot={folder / ('shot_' + size.replace(',', 'x') + '.png')}",
                               "--dump-dom", probed.resolve().as_uri() + "?still"], capture_output=True, text=True)
        found = re.search(r'data-seen="([^"]*)"', done.stdout)
        assert found, f"the page's script did not end:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
        seen = json.loads(base64.b64decode(found.group(1)))
        assert seen["ready"] == "ready", seen
        # A sphere's vertices are no even cover of it: their seam is counted twice, a fiftieth of the radius off.
        assert all(abs(a - b) < 0.01 for low, place in ((seen["low"], (1, 0, -4)), (seen["high"], (1, 0, -3.8))) for a, b in zip(low, place)), seen
        assert seen["asked"] == [], seen
        # A blank canvas has one colour, a shaded shell over the ground hundreds.
        assert seen["rest"]["colours"] > 100, seen
        pictures = [seen[name]["hash"] for name in ("rest", "later", "turned", "hidden")]
        assert len(set(pictures)) == 4, f"scrubbing, turning and hiding change the picture: {seen}"
        # A curve of displacement for each method, and one of error for each but the full shell.
        assert seen["curves"] == 5, seen
        assert seen["wide"] <= 0, seen
    print("browser: OK")


def check_view(program, mesh, folder):
    """--view hands the page to the platform's opener, here one that notes what it was given."""
    folder.mkdir(parents=True, exist_ok=True)
    opened, opener = folder / "opened", folder / "bin" / ("open" if sys.platform == "darwin" else "xdg-open")
    opener.parent.mkdir(exist_ok=True)
    opener.write_text(f'#!/bin/sh\nprintf %s "$1" >"{opened}"\n', encoding="utf-8")
    opener.chmod(0o755)
    opened.unlink(missing_ok=True)
    path = os.environ["PATH"]
    os.environ["PATH"] = f"{opener.parent}:{path}"
    place = folder / "it's here"
    code, out, err = run(program, mesh, folder, "--out", place, "--view")
    page = place / f"{Path(mesh).stem}.html"
    assert code == 0 and f"page: {page}\n" in out and page.stat().st_size > 0, out + err
    assert opened.read_text(encoding="utf-8") == str(page), opened.read_text(encoding="utf-8")
    opener.write_text("#!/bin/sh\nexit 3\n", encoding="utf-8")
    code, out, err = run(program, mesh, folder, "--html", page, "--view", "-q")
    assert code == 0 and f"open {page} in" in err, err
    print("view: OK")


if __name__ == "__main__":
    what, program, mesh, folder = sys.argv[1:]
    {"motion": check_motion, "browser": check_browser, "view": check_view}[what](program, mesh, Path(folder))
