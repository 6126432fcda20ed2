// Curves, methods, loads and words beside the picture; and the start of it all.

function html(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

function number(x) {
  if (x === 0) return "0";
  return Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1).replace(".0e", "e").replace("e-", "e\u2212").replace("e+", "e") : String(Number(x.toPrecision(3)));
}

/** Norm of the displacement's difference from another track's at a frame, over all vertices. */
function apart(track, truth, frame) {
  const size = shells[track.shell].rest.length;
  let sum = 0;
  for (let i = frame * size; i < (frame + 1) * size; i++) sum += (track.unit * track.steps[i] - (truth ? truth.unit * truth.steps[i] : 0)) ** 2;
  return Math.sqrt(sum);
}

/** Percent off the full shell at every frame, of its largest displacement. */
function errorsAgainst(track, truth) {
  let scale = 0;
  for (let f = 0; f < frames; f++) scale = Math.max(scale, apart(truth, null, f));
  return motion.times.map((t, f) => [t, scale ? (100 * apart(track, truth, f)) / scale : 0]);
}

/** Percent of the motion that a step of the full shell may miss before its motion is no measure. */
const COARSE = 1;

/** How far a track is off the full shell's own motion, in words. */
function offWords(track, points, truth) {
  const worst = points.reduce((a, b) => (b[1] > a[1] ? b : a));
  const off = `${track.label}: up to ${number(worst[1])} % off the full shell's own motion, at ${number(worst[0])} s.`;
  if (truth.coarse > COARSE) return `${off} Much of this is the full shell's: each of its steps is off by up to ${number(truth.coarse)} %, and they calm it. Shorter steps (--step) tell which is nearer.`;
  return `${off} It holds what adds up over time, by the steps of both; an estimate is of one moment.`;
}

/** A sentence, in which no option is broken across lines. */
function sentence(text) {
  const made = html("p", /do not trust the picture/.test(text) ? "warns" : "");
  made.append(...text.split(/(--[\w-]+)/).map((part, k) => (k % 2 ? html("span", "option", part) : part)));
  return made;
}

const plots = [], comparisons = [];

function plot(title, curves) {
  const [wide, tall, left, right, top, bottom] = [300, 132, 44, 6, 6, 20];
  const most = Math.max(...curves.flatMap((c) => c.points.map((p) => p[1])), 1e-300);
  const step = 10 ** Math.floor(Math.log10(most)), nice = [1, 2, 5, 10].map((f) => f * step).find((v) => v >= most * 0.999) || most;
  const x = (t) => left + ((wide - left - right) * t) / (last || 1), y = (v) => tall - bottom - ((tall - top - bottom) * v) / nice;
  const box = html("div", "plot");
  const line = (x1, y1, x2, y2) => `<line x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}" stroke="#d9dce3"/>`;
  const words = (px, py, anchor, text) => `<text x="${px}" y="${py}" text-anchor="${anchor}">${text}</text>`;
  const marks = [0, 0.5, 1].map((s) => line(left, y(s * nice), wide - right, y(s * nice)) + words(left - 5, y(s * nice) + 3.5, "end", number(s * nice))).join("");
  const time = words(left, tall - 6, "start", "0 s") + words(wide - right, tall - 6, "end", `${number(last)} s`);
  const drawn = curves.map(({ colour, points, dots }) => `<polyline fill="none" stroke="${colour}" stroke-width="1.8" stroke-linejoin="round" points="${points.map((p) => `${x(p[0]).toFixed(1)},${y(p[1]).toFixed(1)}`).join(" ")}"/>` +
    (dots ? points.map((p) => `<circle cx="${x(p[0]).toFixed(1)}" cy="${y(p[1]).toFixed(1)}" r="2.6" fill="${colour}"/>`).join("") : "")).join("");
  box.innerHTML = `<svg viewBox="0 0 ${wide} ${tall}" role="img" aria-label="${title}">${marks}${time}${drawn}<line class="cursor" y1="${top}" y2="${tall - bottom}" stroke="#23272f" stroke-dasharray="2 2"/></svg>`;
  plots.push({ svg: box.firstChild, cursor: box.querySelector(".cursor"), x, left, right, wide });
  element("plots").append(html("h2", "", title), box);
}

function drawCursors(time) {
  for (const { cursor, x } of plots) cursor.setAttribute("x1", x(time)), cursor.setAttribute("x2", x(time));
}

function fillAside(player) {
  element("title").textContent = document.title = motion.title;
  element("facts").textContent = `${motion.facts}; a square of the ground is ${number(player.grid(0).apart)} ${motion.unit} wide`;
  const unit = motion.unit ? `, ${motion.unit}` : "";
  plot(`Largest displacement${unit}`, tracks.map((t) => ({ colour: t.colour, points: motion.times.map((s, f) => [s, t.displacement[f]]) })));
  for (let shell = 0; shell < shells.length; shell++) {
    const of = shells.length > 1 ? ` of ${shells[shell].name}` : "", here = tracks.filter((t) => t.shell === shell), truth = here.find((t) => t.full);
    const judged = here.filter((t) => t !== truth && (truth || t.estimates.length > 0));
    if (!judged.length) continue;
    const curves = judged.map((t) => ({ colour: t.colour, dots: !truth, points: truth ? errorsAgainst(t, truth) : t.estimates }));
    if (curves[0].points.length < 2) continue;
    plot(truth ? `Off the full shell's motion${of}, % of its largest displacement` : `Error of single moments${of}, estimated, % of the displacement then`, curves);
    if (truth) judged.forEach((t, k) => comparisons.push(offWords(t, curves[k].points, truth)));
  }
  const list = element("methods");
  list.append(html("h2", "", shells.length > 1 && methods.length < 2 ? "Shells" : methods.length > 1 ? "Methods" : "Method"));
  for (const track of tracks) {
    const row = html("label", "method"), swatch = html("i"), box = html("input");
    swatch.style.background = track.colour;
    box.type = "checkbox";
    box.checked = true;
    box.hidden = tracks.length < 2;
    box.addEventListener("change", () => { track.shown = box.checked; player.fit(); player.draw(); });
    row.append(box, swatch, html("span", "", shells.length > 1 ? `${shells[track.shell].name}${methods.length > 1 ? `, ${track.label}` : ""}` : track.label), html("small", "", track.cost));
    list.append(row);
  }
  const loads = element("loads");
  if (motion.loads.length) loads.append(html("h2", "", "Loads and holds"));
  for (const load of motion.loads) {
    const row = html("div", "load"), swatch = html("i");
    swatch.style.background = load.colour;
    row.append(swatch, html("span", "", load.words));
    loads.append(row);
  }
  const words = element("words");
  if (methods.length > 1) loads.after(words); // many words: curves compare better
  const said = [...motion.words, ...comparisons];
  if (said.length) words.append(html("h2", "", "What it says"), ...said.map(sentence));
  for (const { svg, left, right, wide } of plots) {
    const go = (e) => { const r = svg.getBoundingClientRect(), at = ((e.clientX - r.left) / r.width) * wide; player.pause(); player.seek(last * Math.min(1, Math.max(0, (at - left) / (wide - left - right)))); };
    svg.addEventListener("pointerdown", (e) => { svg.setPointerCapture(e.pointerId); go(e); });
    svg.addEventListener("pointermove", (e) => { if (e.buttons) go(e); });
  }
}

try {
  if (!gl) throw new Error("this browser has no WebGL");
  tracks.forEach((track, k) => (track.key = `track${k}`));
  const player = new Player();
  fillAside(player);
  player.seek(0);
  player.resize();
  document.documentElement.dataset.player = "ready";
  if (!/[?&#]still/.test(location.href)) player.play();
} catch (error) {
  element("trouble").textContent = `The player could not start: ${error.message}`;
  console.error(error);
}
