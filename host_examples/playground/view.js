// What is seen: one or two panes side by side with the same camera, each with a shell, what holds it, handles, floor and ball.

import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

const FRONT = [0x6fae5a, 0xe08f4a], BACK = [0xb9d8a4, 0xf2cfa6];
const NEAR = 26;                                    // pixels from a vertex that still take it
const RING = 0.09;                                  // radius of the ring about a handle, m

function dots(colour, size) {
  const points = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: colour, size, sizeAttenuation: false, depthTest: true }));
  points.frustumCulled = false;
  return points;
}

/** The scene of one pane. */
export class Stage {
  constructor(index) {
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xeef1f5);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa3b2, 2.1));
    const sun = new THREE.DirectionalLight(0xffffff, 1.7);
    sun.position.set(-1, -2, 3);
    this.scene.add(sun);
    this.geometry = new THREE.BufferGeometry();
    const side = (colour, which) => new THREE.Mesh(this.geometry, new THREE.MeshStandardMaterial({ color: colour, side: which, roughness: 0.75 }));
    this.faces = side(FRONT[index], THREE.FrontSide);
    this.backs = side(BACK[index], THREE.BackSide);
    this.held = dots(0x2a2e38, 5);
    this.handles = dots(0xf0b90b, 13);
    this.handles.material.depthTest = false;
    this.floor = new THREE.GridHelper(4, 40, 0xaab2bf, 0xd3d8e0);
    this.floor.rotation.x = Math.PI / 2;
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(1, 40, 24), new THREE.MeshStandardMaterial({ color: 0x7f8fb5, roughness: 0.6 }));
    this.ring = new THREE.Mesh(new THREE.TorusGeometry(RING, 0.006, 10, 60), new THREE.MeshBasicMaterial({ color: 0x8d5bc2, depthTest: false }));
    this.ring.renderOrder = this.handles.renderOrder = 1;
    for (const part of [this.faces, this.backs]) part.frustumCulled = false;
    this.scene.add(this.faces, this.backs, this.held, this.handles, this.floor, this.ball, this.ring);
    this.ball.visible = this.ring.visible = false;
  }

  setMesh({ positions, triangles }) {
    this.geometry.setAttribute('position', new THREE.BufferAttribute(Float32Array.from(positions), 3));
    this.geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    this.setShape(Float32Array.from(positions));
  }

  get shape() {
    return this.geometry.attributes.position.array;
  }

  setShape(positions) {
    this.shape.set(positions);
    this.geometry.attributes.position.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.geometry.boundingSphere = null;
  }

  at(vertex) {
    return new THREE.Vector3().fromArray(this.shape, 3 * vertex);
  }

  setHeld(held) {
    this.mark(this.held, held);
  }

  setHandles(vertices) {
    this.mark(this.handles, vertices);
  }

  mark(points, vertices) {
    const places = new Float32Array(3 * vertices.length);
    vertices.forEach((v, k) => places.set(this.shape.subarray(3 * v, 3 * v + 3), 3 * k));
    points.geometry.dispose();
    points.geometry.setAttribute('position', new THREE.BufferAttribute(places, 3));
    points.visible = vertices.length > 0;
  }
}

/** Canvas, camera and panes. */
export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 60);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enablePan = true;
    this.stages = [new Stage(0), new Stage(1)];
    this.shown = 1;
    this.ray = new THREE.Raycaster();
    this.fit();
  }

  /** Looks at a place from so far away. */
  fit(middle = new THREE.Vector3(0, 0, -0.08), far = 2.1) {
    this.camera.position.set(0.9, -1.9, 0.75).normalize().multiplyScalar(far).add(middle);
    this.orbit.target.copy(middle);
    this.orbit.update();
  }

  /** Place and size of a pane, pixels of the page from the canvas's left top corner. Narrow canvases stack panes. */
  pane(index) {
    const { clientWidth: wide, clientHeight: tall } = this.canvas;
    if (this.shown === 1) return { x: 0, y: 0, wide, tall };
    return wide > tall ? { x: (index * wide) / 2, y: 0, wide: wide / 2, tall } : { x: 0, y: (index * tall) / 2, wide, tall: tall / 2 };
  }

  paneAt(x, y) {
    const first = this.pane(0);
    return this.shown > 1 && (x >= first.x + first.wide || y >= first.y + first.tall) ? 1 : 0;
  }

  aim(index) {
    const { wide, tall } = this.pane(index);
    this.camera.aspect = wide / tall;
    this.camera.fov = wide < tall ? 46 : 32;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  draw() {
    const { clientWidth, clientHeight } = this.canvas, dense = Math.min(devicePixelRatio || 1, 2);
    if (this.canvas.width !== Math.floor(clientWidth * dense) || this.canvas.height !== Math.floor(clientHeight * dense)) {
      this.renderer.setPixelRatio(dense);
      this.renderer.setSize(clientWidth, clientHeight, false);
    }
    this.orbit.update();
    this.renderer.setScissorTest(true);
    for (let k = 0; k < this.shown; ++k) {
      const { x, y, wide, tall } = this.pane(k), low = clientHeight - y - tall;
      this.aim(k);
      this.stages[k].ring.quaternion.copy(this.camera.quaternion);
      this.renderer.setViewport(x, low, wide, tall);
      this.renderer.setScissor(x, low, wide, tall);
      this.renderer.render(this.stages[k].scene, this.camera);
    }
  }

  /** Where a place is on the canvas, in pixels. */
  screen(place, index) {
    this.aim(index);
    const { x, y, wide, tall } = this.pane(index), p = place.clone().project(this.camera);
    return { x: x + ((p.x + 1) / 2) * wide, y: y + ((1 - p.y) / 2) * tall };
  }

  cast(x, y, index) {
    this.aim(index);
    const pane = this.pane(index);
    this.ray.setFromCamera(new THREE.Vector2((2 * (x - pane.x)) / pane.wide - 1, 1 - (2 * (y - pane.y)) / pane.tall), this.camera);
    return this.ray;
  }

  /** The place under the pointer and the vertex nearest to it, or null; `taken` says which vertices count. */
  pick(x, y, index, taken = () => true) {
    const stage = this.stages[index], ray = this.cast(x, y, index);
    const hit = ray.intersectObjects([stage.faces, stage.backs, ...(stage.ball.visible ? [stage.ball] : [])])[0];
    if (hit?.object === stage.ball) return { ball: true, point: hit.point };
    if (hit) {
      const corners = [hit.face.a, hit.face.b, hit.face.c].filter(taken);
      if (!corners.length) return { point: hit.point, vertex: -1 };
      const vertex = corners.reduce((a, b) => (stage.at(a).distanceTo(hit.point) <= stage.at(b).distanceTo(hit.point) ? a : b));
      return { vertex, point: hit.point };
    }
    let vertex = -1, least = NEAR;
    for (let v = 0; 3 * v < stage.shape.length; ++v) {
      if (!taken(v)) continue;
      const p = this.screen(stage.at(v), index), far = Math.hypot(p.x - x, p.y - y);
      if (far < least) (least = far), (vertex = v);
    }
    return vertex < 0 ? null : { vertex, point: stage.at(vertex) };
  }

  /** Where the pointer meets the plane through `place` that faces the camera. */
  onPlane(x, y, index, place) {
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new THREE.Vector3()), place);
    return this.cast(x, y, index).ray.intersectPlane(plane, new THREE.Vector3());
  }
}

/** The rotation by an angle about the direction to the camera, row by row, after another. */
export function turned(camera, angle, before) {
  const axis = camera.getWorldDirection(new THREE.Vector3()).negate();
  const m = new THREE.Matrix4().makeRotationAxis(axis, angle).multiply(new THREE.Matrix4().set(
    ...before.slice(0, 3), 0, ...before.slice(3, 6), 0, ...before.slice(6, 9), 0, 0, 0, 0, 1)).elements;
  return [m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]];
}
