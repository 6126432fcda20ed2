// The camera, and drawing by WebGL.

const up = [0, 1, 2].map((k) => (k === motion.up ? 1 : 0));
const across = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].filter((_, k) => k !== motion.up);
if (dot(cross(across[0], across[1]), up) < 0) across.reverse();

const camera = { turn: 0.6, lift: 0.42, far: 1, target: [0, 0, 0], field: (30 * Math.PI) / 180 };

function cameraAxes() {
  const flat = add(across[0].map((x) => x * Math.cos(camera.turn)), across[1], Math.sin(camera.turn));
  const back = add(flat.map((x) => x * Math.cos(camera.lift)), up, Math.sin(camera.lift));
  const right = unitOf(cross(up, back));
  return { back, right, above: cross(back, right) };
}

function cameraMatrix(aspect) {
  const { back, right, above } = cameraAxes(), eye = add(camera.target, back, camera.far);
  const near = camera.far / 50, end = camera.far * 40, f = 1 / Math.tan(camera.field / 2);
  const look = new Float32Array(16);
  [right, above, back].forEach((axis, r) => { axis.forEach((x, c) => (look[4 * c + r] = x)); look[12 + r] = -dot(axis, eye); });
  look[15] = 1;
  const lens = new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (end + near) / (near - end), -1, 0, 0, (2 * end * near) / (near - end), 0]);
  return { matrix: times(lens, look), eye };
}

const canvas = element("view");
const gl = canvas.getContext("webgl", { alpha: false, antialias: true, stencil: true, preserveDrawingBuffer: true });

const VERTEX = `
attribute vec3 place, normal; attribute float tint;
uniform mat4 camera; uniform vec3 shift, up; uniform float level, flatten, size; uniform vec3 sun;
varying vec3 at, facing; varying float share;
void main() {
  at = place + shift;
  float height = dot(at, up) - level;
  at -= flatten * height * sun / dot(sun, up);
  facing = normal; share = tint;
  gl_Position = camera * vec4(at, 1.0);
  gl_PointSize = size;
}`;
const FRAGMENT = `
precision highp float;
varying vec3 at, facing; varying float share;
uniform vec3 colour, eye, sun, up; uniform float kind, alpha, tinted, fade; uniform vec3 middle;
vec3 ramp(float t) {
  vec3 a = mix(vec3(0.27, 0.0, 0.33), vec3(0.13, 0.57, 0.55), smoothstep(0.0, 0.5, t));
  return mix(a, vec3(0.95, 0.88, 0.15), smoothstep(0.5, 1.0, t));
}
void main() {
  if (kind < 0.5) {                                    // a lit surface, the same from both sides
    vec3 n = normalize(facing), v = normalize(eye - at);
    if (dot(n, v) < 0.0) n = -n;
    vec3 base = mix(colour, ramp(clamp(share, 0.0, 1.0)), tinted);
    float key = max(dot(n, normalize(sun)), 0.0), sky = 0.5 + 0.5 * dot(n, up), rim = pow(1.0 - abs(dot(n, v)), 3.0);
    float shine = pow(max(dot(n, normalize(normalize(sun) + v)), 0.0), 40.0);
    gl_FragColor = vec4(base * (0.34 + 0.22 * sky + 0.60 * key) + 0.10 * shine + 0.06 * rim, alpha);
  } else if (kind < 1.5) {                             // one colour
    gl_FragColor = vec4(colour, alpha);
  } else if (kind < 2.5) {                             // a round point
    float r = length(gl_PointCoord - 0.5);
    if (r > 0.5) discard;
    gl_FragColor = vec4(r > 0.38 ? vec3(0.12) : colour, alpha);
  } else {                                             // ground, fading out
    gl_FragColor = vec4(colour, alpha * (1.0 - smoothstep(0.25, 1.0, distance(at, middle) / fade)));
  }
}`;

function compiled(type, source) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
  return shader;
}

class Painter {
  constructor() {
    this.wide = gl.getExtension("OES_element_index_uint");
    const program = (this.program = gl.createProgram());
    gl.attachShader(program, compiled(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, FRAGMENT));
    ["place", "normal", "tint"].forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    gl.useProgram(program);
    this.uniforms = {};
    const names = "camera shift up level flatten size sun colour eye kind alpha tinted middle fade";
    for (const name of names.split(" ")) this.uniforms[name] = gl.getUniformLocation(program, name);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.buffers = new Map();
  }

  set(name, value) {
    const at = this.uniforms[name];
    if (value.length === 16) gl.uniformMatrix4fv(at, false, value);
    else if (value.length === 3) gl.uniform3fv(at, value);
    else gl.uniform1f(at, value);
  }

  buffer(key, data, target, fresh) {
    let known = this.buffers.get(key);
    if (!known) this.buffers.set(key, (known = gl.createBuffer())), (fresh = true);
    gl.bindBuffer(target, known);
    if (fresh) gl.bufferData(target, data, gl.DYNAMIC_DRAW);
  }

  /** Draws indexed things of one set of vertices; `key` names the buffers. */
  draw(key, mode, places, indices, options) {
    for (const [name, value] of Object.entries(options)) if (name in this.uniforms) this.set(name, value);
    this.buffer(`${key}.place`, places, gl.ARRAY_BUFFER, options.fresh);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    [["normal", options.normals, 3], ["tint", options.tints, 1]].forEach(([name, data, width], k) => {
      if (!data) return gl.disableVertexAttribArray(k + 1);
      this.buffer(`${key}.${name}`, data, gl.ARRAY_BUFFER, options.fresh);
      gl.enableVertexAttribArray(k + 1);
      gl.vertexAttribPointer(k + 1, width, gl.FLOAT, false, 0, 0);
    });
    this.buffer(`${options.indexKey || key}.${mode}`, indices, gl.ELEMENT_ARRAY_BUFFER, false);
    gl.drawElements(mode, indices.length, gl.UNSIGNED_INT, 0);
  }
}
