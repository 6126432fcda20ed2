// Colliders: their surfaces in their own axes, and where they are at a time.

const SOLID = [0.55, 0.6, 0.7];

/** A square of the plane z = 0 near all that moves, wide enough for shells side by side. */
function planeSurface({ poses }) {
  const { low, high, size } = boxOf(1), pose = new Float32Array(bytesOf(poses));
  const from = low.map((x, c) => (x + high[c]) / 2 - pose[c]), [x, y] = [0, 1].map((axis) => dot(from, [0, 1, 2].map((r) => pose[3 + 3 * r + axis])));
  const wide = size * Math.max(1, methods.length);
  const rest = [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([a, b]) => [x + a * wide, y + b * wide, 0]);
  return { rest, normals: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1], triangles: [0, 1, 2, 0, 2, 3] };
}

function boxSurface({ half_extents }) {
  const rest = [], normals = [], triangles = [];
  for (let axis = 0; axis < 3; axis++)
    for (const side of [-1, 1]) {
      const first = rest.length / 3;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const corner = [0, 0, 0], normal = [0, 0, 0];
        corner[axis] = normal[axis] = side;
        corner[(axis + 1) % 3] = a;
        corner[(axis + 2) % 3] = b;
        rest.push(...corner.map((x, c) => x * half_extents[c]));
        normals.push(...normal);
      }
      triangles.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  return { rest, normals, triangles };
}

/** A sphere whose halves are half_length up and down along z: 0 for a sphere. */
function roundSurface({ radius, half_length }) {
  const rings = 24, around = 48, rest = [], normals = [], triangles = [];
  for (let i = 0; i <= rings + 1; i++) {
    const upper = i <= rings / 2, angle = (Math.PI * (upper ? i : i - 1)) / rings;
    for (let j = 0; j <= around; j++) {
      const turn = (2 * Math.PI * j) / around, n = [Math.sin(angle) * Math.cos(turn), Math.sin(angle) * Math.sin(turn), Math.cos(angle)];
      normals.push(...n);
      rest.push(radius * n[0], radius * n[1], radius * n[2] + (upper ? half_length : -half_length));
    }
  }
  for (let i = 0; i <= rings; i++)
    for (let j = 0; j < around; j++) {
      const a = i * (around + 1) + j, b = a + around + 1;
      triangles.push(a, b, b + 1, a, b + 1, a + 1);
    }
  return { rest, normals, triangles };
}

/** A mesh of flat triangles, each with corners of its own. */
function meshSurface(collider) {
  return flatSurface(new Float32Array(bytesOf(collider.rest)), new Uint32Array(bytesOf(collider.triangles)));
}

function flatSurface(places, corners) {
  const rest = [], normals = [], at = (v) => [...places.subarray(3 * v, 3 * v + 3)];
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = [at(corners[t]), at(corners[t + 1]), at(corners[t + 2])], n = unitOf(cross(add(b, a, -1), add(c, a, -1)));
    rest.push(...a, ...b, ...c);
    normals.push(...n, ...n, ...n);
  }
  return { rest, normals, triangles: corners.map((_, k) => k) };
}

const SURFACES = { plane: planeSurface, sphere: roundSurface, capsule: roundSurface, box: boxSurface, hull: meshSurface, mesh: meshSurface, deforming: meshSurface };

const solids = motion.colliders.map((collider, k) => {
  const { rest, normals, triangles } = SURFACES[collider.kind](collider), poses = new Float32Array(bytesOf(collider.poses));
  return {
    kind: collider.kind, key: `solid${k}`, rest, normals, poses, moves: poses.length > 12, triangles: new Uint32Array(triangles),
    shapes: collider.shapes && new Float32Array(bytesOf(collider.shapes)), corners: collider.shapes && new Uint32Array(bytesOf(collider.triangles)),
    now: new Float32Array(rest.length), turned: new Float32Array(rest.length), tint: new Float32Array(rest.length / 3),
  };
});

// How much smaller round solids are drawn, so that flat triangles that touch them hide them.
const SUNK = 0.003 * boxOf(1).size;

// The surface of a solid that deforms, between two frames of the film.
function deform(solid, k, share) {
  const n = solid.shapes.length / (solid.poses.length / 12), a = solid.shapes.subarray(n * k, n * k + n), b = solid.shapes.subarray(n * k + n, n * k + 2 * n);
  Object.assign(solid, flatSurface(share && b.length ? a.map((x, i) => x + share * (b[i] - x)) : a, solid.corners), { triangles: solid.triangles });
}

function placeSolid(solid, time) {
  if (solid.shapes) deform(solid, ...place(time));
  const [k, share] = solid.moves ? place(time) : [0, 0], { poses, rest, normals, now, turned } = solid, next = Math.min(12 * k + 12, poses.length - 12);
  const pose = Array.from({ length: 12 }, (_, c) => poses[12 * k + c] + share * (poses[next + c] - poses[12 * k + c]));
  const sunk = SURFACES[solid.kind] === roundSurface ? SUNK : 0;
  for (let i = 0; i < rest.length; i += 3)
    for (let r = 0; r < 3; r++) {
      const along = (x) => pose[3 + 3 * r] * x[i] + pose[4 + 3 * r] * x[i + 1] + pose[5 + 3 * r] * x[i + 2];
      turned[i + r] = along(normals);
      now[i + r] = pose[r] + along(rest) - sunk * turned[i + r];
    }
}

for (const solid of solids) placeSolid(solid, 0);
