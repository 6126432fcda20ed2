// The shells to choose from, and meshes that are dropped: all turned so that z is up, and made a metre across.

/** Reads vertices and faces of an OBJ file; polygons become fans. */
export function readObj(text) {
  const positions = [], triangles = [];
  text.split('\n').forEach((line, row) => {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === 'v') {
      const point = rest.slice(0, 3).map(Number);
      if (point.length < 3 || !point.every(Number.isFinite)) throw new Error(`line ${row + 1}: a vertex needs three numbers, found "${line.trim()}"`);
      positions.push(...point);
    } else if (word === 'f') {
      const count = positions.length / 3;
      const corners = rest.map((corner) => parseInt(corner, 10)).map((k) => (k < 0 ? count + k : k - 1));
      if (corners.length < 3 || corners.some((k) => !(k >= 0 && k < count))) throw new Error(`line ${row + 1}: a face names no vertex before it: "${line.trim()}"`);
      for (let k = 2; k < corners.length; ++k) triangles.push(corners[0], corners[k - 1], corners[k]);
    }
  });
  if (!triangles.length) throw new Error('no faces found: is it an OBJ mesh?');
  return { positions: Float64Array.from(positions), triangles: Uint32Array.from(triangles) };
}

/** Lowest and highest coordinates. */
export function boxOf(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  positions.forEach((x, i) => {
    if (x < low[i % 3]) low[i % 3] = x;
    if (x > high[i % 3]) high[i % 3] = x;
  });
  return { low, high, size: Math.hypot(...high.map((h, c) => h - low[c])) };
}

/** The same mesh with z up, about the origin, its box's diagonal one metre. */
export function placed({ positions, triangles }, up) {
  const turned = new Float64Array(positions.length);
  for (let i = 0; i < positions.length; i += 3) {
    const [x, y, z] = positions.subarray(i, i + 3);
    turned.set(up === 'y' ? [x, -z, y] : [x, y, z], i);
  }
  const { low, high, size } = boxOf(turned);
  if (!(size > 0)) throw new Error('the mesh has no size');
  return { positions: turned.map((x, i) => (x - (low[i % 3] + high[i % 3]) / 2) / size), triangles };
}

/** The vertices at the low end of the longest side: what a mesh is held by until someone paints. */
export function lowEnd(positions) {
  const { low, high } = boxOf(positions);
  const sides = high.map((h, c) => h - low[c]), axis = sides.indexOf(Math.max(...sides));
  return where(positions, (...x) => x[axis] < low[axis] + 0.03 * sides[axis]);
}

function where(positions, inside) {
  const found = [];
  for (let v = 0; 3 * v < positions.length; ++v) if (inside(...positions.subarray(3 * v, 3 * v + 3))) found.push(v);
  return Uint32Array.from(found);
}

// A leaf one long, curved along and across, its stalk at x = 0.
function leaf() {
  const along = 36, across = 12, positions = [], triangles = [];
  for (let i = 0; i <= along; ++i) {
    for (let j = 0; j <= across; ++j) {
      const s = i / along, t = (2 * j) / across - 1;
      const width = 0.24 * (0.06 + 0.94 * Math.sin(Math.PI * (0.05 + 0.94 * s ** 0.8)) ** 0.9);
      positions.push(s, width * t, 0.03 * Math.abs(t) * Math.sin(Math.PI * s) + 0.12 * s * (1 - s));
    }
  }
  for (let i = 0; i < along; ++i) {
    for (let j = 0; j < across; ++j) {
      const a = i * (across + 1) + j, b = a + across + 1;
      triangles.push(a, b, b + 1, a, b + 1, a + 1);
    }
  }
  return { positions: Float64Array.from(positions), triangles: Uint32Array.from(triangles) };
}

// The hat's band: its axis is at z = -6 and leans by 14 degrees about the height 168.6.
function inBand(x, y, z) {
  const lean = (14 * Math.PI) / 180, height = (y - 168.6) * Math.cos(lean) - (z + 6) * Math.sin(lean);
  return Math.abs(height) < 1.6 && Math.hypot(x, z + 6) < 11;
}

/** Where each shell's mesh comes from, which way is up, what holds it, how fast it swings in Hz; soft: handles give way at first, since
 * its crown does not bend. */
export const SHAPES = [
  { name: 'leaf', label: 'Leaf', mesh: leaf, up: 'z', held: (x) => x < 0.03, frequency: 1.8 },
  { name: 'hat', label: 'Hat', file: 'character_hat.obj', up: 'y', held: inBand, frequency: 3, poses: 20, soft: true },
  { name: 'v_beam', label: 'V-beam', file: 'v_beam.obj', up: 'z', held: (x) => x < 0.11, frequency: 2.5 },
  { name: 'strip', label: 'Flat strip', file: 'flat_beam.obj', up: 'z', held: (x) => x < 0.11, frequency: 1.2 },
  { name: 'dinosaur', label: 'Dinosaur', file: 'dinosaur.obj', up: 'y', held: (x, y) => y < 0.02, frequency: 1.5, fields: 12, poses: 4,
    posesInTests: 1 },
];

/** A shell of SHAPES: its mesh as placed, and what holds it. `read` gives the text of a file of tests/data/meshes. */
export function shapeOf({ mesh, file, up, held }, read) {
  const found = mesh ? mesh() : readObj(read(file));
  return { ...placed(found, up), held: where(found.positions, held) };
}
