// Plays the recorded shells of <script id="motion">, drawn by WebGL; needs nothing from elsewhere, and works from file://.
//
// A track is one shell by one method: float32 rest positions and 16-bit displacements from them, in units of its `unit`, base64.
"use strict";

const motion = JSON.parse(document.getElementById("motion").textContent);
const element = (id) => document.getElementById(id);
const COLOURS = ["#3b78d8", "#e07b39", "#2f9e63", "#8d5bc2", "#d1495b", "#1f9aa8", "#b08a1e", "#7a8290"];
const HELD = [0.16, 0.18, 0.22], BALL = [0.98, 0.78, 0.1];

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer;
}

function rgb(hex) {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
}

/** Each edge of the triangles once. */
function edgesOf(triangles) {
  const seen = new Set(), edges = [];
  for (let t = 0; t < triangles.length; t += 3)
    for (let k = 0; k < 3; k++) {
      const a = triangles[t + k], b = triangles[t + ((k + 1) % 3)];
      const key = Math.min(a, b) * 4294967296 + Math.max(a, b);
      if (!seen.has(key)) seen.add(key), edges.push(a, b);
    }
  return new Uint32Array(edges);
}

const shells = motion.shells.map((shell) => {
  const triangles = new Uint32Array(bytesOf(shell.triangles));
  return { ...shell, triangles, edges: edgesOf(triangles), rest: new Float32Array(bytesOf(shell.rest)), held: new Uint32Array(bytesOf(shell.held)) };
});
const methods = [...new Set(motion.tracks.map((t) => t.method))];
const tracks = motion.tracks.map((track) => {
  const shell = shells[track.shell];
  const several = methods.length > 1;
  return {
    ...track, group: methods.indexOf(track.method), shown: true,
    steps: new Int16Array(bytesOf(track.data)),
    colour: COLOURS[(several ? methods.indexOf(track.method) : track.shell) % COLOURS.length],
    now: new Float32Array(shell.rest.length), normals: new Float32Array(shell.rest.length), tint: new Float32Array(shell.rest.length / 3),
  };
});
const frames = motion.times.length, last = motion.times[frames - 1];

/** Where a time lies: the frame before it, and the share of the way to the next. */
function place(time) {
  let k = 0;
  while (k + 2 < frames && motion.times[k + 1] <= time) k++;
  if (frames < 2) return [0, 0];
  return [k, Math.min(1, Math.max(0, (time - motion.times[k]) / (motion.times[k + 1] - motion.times[k])))];
}

function setShape(track, time, larger) {
  const { rest, triangles } = shells[track.shell], size = rest.length, [k, share] = place(time);
  const from = k * size, to = frames < 2 ? from : from + size, unit = track.unit * larger;
  const { steps, now, normals, tint } = track;
  for (let i = 0; i < size; i += 3) {
    let square = 0;
    for (let c = i; c < i + 3; c++) {
      const step = track.unit * (steps[from + c] + share * (steps[to + c] - steps[from + c]));
      square += step * step;
      now[c] = rest[c] + (unit / (track.unit || 1)) * step;
    }
    tint[i / 3] = motion.most ? Math.sqrt(square) / motion.most : 0;
  }
  normals.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = now[b] - now[a], uy = now[b + 1] - now[a + 1], uz = now[b + 2] - now[a + 2];
    const vx = now[c] - now[a], vy = now[c + 1] - now[a + 1], vz = now[c + 2] - now[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const v of [a, b, c]) (normals[v] += nx), (normals[v + 1] += ny), (normals[v + 2] += nz);
  }
}

/** The box that holds every track at every frame. */
function boxOf(larger) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const track of tracks) {
    const rest = shells[track.shell].rest, unit = track.unit * larger;
    for (let i = 0; i < track.steps.length; i++) {
      const x = rest[i % rest.length] + unit * track.steps[i], c = i % 3;
      if (x < low[c]) low[c] = x;
      if (x > high[c]) high[c] = x;
    }
  }
  return { low, high, size: Math.hypot(...high.map((h, c) => h - low[c])) || 1 };
}

// Vectors and matrices.

const add = (a, b, s = 1) => a.map((x, k) => x + s * b[k]);
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unitOf = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

/** Column-major product of 4 x 4 matrices. */
function times(a, b) {
  const m = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return m;
}

function moved(by) {
  return new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...by, 1]);
}
