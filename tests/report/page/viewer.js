// Plays the recorded shells, those that are ticked, overlaid or side by side.
// Reads the JSON of <script id="motions">: positions as 16-bit numbers in a box, differences from frame to frame, low bytes
// then high bytes, deflated, base64.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const FRAME = 1 / 30;

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
}

async function inflated(base64) {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Frames of positions (3 n floats each). */
async function decoded(motion, track) {
  const bytes = await inflated(track.data);
  const count = bytes.length / 2;
  const size = 3 * motion.vertices;
  const frames = [];
  const value = new Uint16Array(size);
  for (let start = 0; start < count; start += size) {
    const frame = new Float32Array(size);
    for (let i = 0; i < size; i++) {
      value[i] += bytes[start + i] | (bytes[count + start + i] << 8);
      const axis = i % 3;
      frame[i] = motion.low[axis] + ((motion.high[axis] - motion.low[axis]) * value[i]) / 65535;
    }
    frames.push(frame);
  }
  return frames;
}

class Player {
  constructor(root, motions) {
    this.motions = motions;
    this.canvas = root.querySelector("canvas");
    this.slider = root.querySelector("input[type=range]");
    this.clock = root.querySelector("output");
    this.choice = root.querySelector("select");
    this.beside = root.querySelector("[name=beside]");
    this.playButton = root.querySelector("button");
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 1e4);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.playing = false;
    this.time = 0;
    motions.forEach((m, k) => this.choice.add(new Option(m.title, k)));
    this.choice.addEventListener("change", () => this.show(Number(this.choice.value)));
    this.slider.addEventListener("input", () => { this.pause(); this.seek(Number(this.slider.value)); });
    this.beside.addEventListener("change", () => { this.arrange(); this.frameCamera(); this.draw(); });
    this.playButton.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.list = root.querySelector(".tracks");
    this.ticked = new Set(["warp", "polynomial shell", "full shell"]);
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
  }

  async show(k) {
    const motion = (this.motion = this.motions[k]);
    const index = new Uint32Array((await inflated(motion.triangles)).buffer);
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xf4f5f7);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(-2, 4, 3);
    this.scene.add(sun);
    this.tracks = [];
    for (const track of motion.tracks) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * motion.vertices), 3));
      geometry.setIndex(new THREE.BufferAttribute(index, 1));
      const material = new THREE.MeshStandardMaterial({
        color: track.colour, side: THREE.DoubleSide, roughness: 0.75, transparent: true, opacity: 1,
      });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.frustumCulled = false;
      const group = new THREE.Group();
      group.add(mesh);
      const ball = motion.ball && new THREE.Mesh(
        new THREE.SphereGeometry(motion.ball.radius, 48, 32), new THREE.MeshStandardMaterial({ color: 0xb9b2a6, roughness: 0.9 }));
      if (ball) group.add(ball);
      this.scene.add(group);
      this.tracks.push({ mesh, ball, group, name: track.name, frames: await decoded(motion, track) });
    }
    this.list.replaceChildren(...motion.tracks.map((track) => this.tick(track)));
    this.slider.max = String((motion.frames - 1) * motion.every * FRAME);
    this.arrange();
    this.frameCamera();
    this.resize();
    this.seek(Math.min(this.time, Number(this.slider.max)));
  }

  /** A box that shows or hides a track, with its error. */
  tick(track) {
    const label = document.createElement("label");
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: this.ticked.has(track.name) });
    box.addEventListener("change", () => {
      this.ticked[box.checked ? "add" : "delete"](track.name);
      this.arrange();
      this.frameCamera();
      this.draw();
    });
    label.style.color = track.colour;
    label.append(box, ` ${track.name}: ${track.error}`);
    return label;
  }

  shown() {
    return this.tracks.filter((track) => this.ticked.has(track.name));
  }

  size() {
    return Math.hypot(...this.motion.high.map((h, c) => h - this.motion.low[c]));
  }

  arrange() {
    const { beside, low, high } = this.motion;
    const gap = 1.15 * (high[beside] - low[beside]);
    this.tracks.forEach(({ group, name }) => (group.visible = this.ticked.has(name)));
    const shown = this.shown();
    shown.forEach(({ group, mesh }, k) => {
      group.position.setComponent(beside, this.beside.checked ? (k - (shown.length - 1) / 2) * gap : 0);
      mesh.material.opacity = this.beside.checked ? 1 : 0.72;
    });
  }

  frameCamera() {
    const { low, high, up, view, beside } = this.motion;
    const centre = new THREE.Vector3(...low.map((l, c) => 0.5 * (l + high[c])));
    this.camera.up.set(...up);
    const more = Math.max(this.shown().length - 1, 0);
    const width = this.beside.checked ? 1.15 * more * (high[beside] - low[beside]) : 0;
    const aspect = Math.min(1, this.camera.aspect / 1.3);
    const far = (1.35 * this.size() + 0.9 * width) / aspect;
    this.camera.position.copy(centre).addScaledVector(new THREE.Vector3(...view).normalize(), far);
    this.controls.target.copy(centre);
    this.controls.update();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Shows a time by interpolating between recorded frames. */
  seek(time) {
    this.time = time;
    this.slider.value = String(time);
    this.clock.textContent = `${time.toFixed(2)} s`;
    const place = Math.min(time / (this.motion.every * FRAME), this.motion.frames - 1);
    const k = Math.min(Math.floor(place), this.motion.frames - 2);
    const share = place - k;
    const pose = this.motion.poses && this.motion.poses[k].map((a, c) => a + share * (this.motion.poses[k + 1][c] - a));
    for (const { mesh, ball, frames } of this.tracks) {
      const to = mesh.geometry.attributes.position.array;
      const [a, b] = [frames[k], frames[k + 1]];
      for (let i = 0; i < to.length; i++) to[i] = a[i] + share * (b[i] - a[i]);
      mesh.geometry.attributes.position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
      if (ball) {
        const [from, to] = [this.motion.ball.places[k], this.motion.ball.places[k + 1]];
        ball.position.set(...from.map((x, c) => x + share * (to[c] - x)));
      }
      if (pose) {
        mesh.position.set(pose[0], pose[1], pose[2]);
        mesh.rotation.set(0, pose[3], 0);
      }
    }
    this.draw();
  }

  play() {
    this.playing = true;
    this.playButton.textContent = "Pause";
    if (this.time >= Number(this.slider.max) - 1e-3) this.seek(0);
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      this.seek((this.time + (now - last) / 1000) % Number(this.slider.max));
      last = now;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.playButton.textContent = "Play";
  }

  draw() {
    if (this.scene) this.renderer.render(this.scene, this.camera);
  }
}

async function start() {
  const source = document.getElementById("motions");
  if (!source) return;
  // A canvas has no size before what it stands in is open.
  const section = document.getElementById("watching");
  while (!section.open) await new Promise((opened) => section.addEventListener("toggle", opened, { once: true }));
  const player = new Player(document.getElementById("player"), JSON.parse(source.textContent));
  await player.show(0);
  player.seek(0.6 * Number(player.slider.max));
  document.documentElement.dataset.player = "ready";
}

start().catch((error) => {
  document.getElementById("player-trouble").textContent = `The player could not start: ${error.message}`;
  console.error(error);
});
