// What is shown at a time, and what hands and keys do.

class Player {
  constructor() {
    this.painter = new Painter();
    this.playing = false;
    this.time = 0;
    this.larger = 1;
    this.box = boxOf(1);
    this.startTurn();
    this.offerLarger();
    element("time").max = String(last);
    element("edges").checked = shells.every((shell) => shell.rest.length < 9000);
    element("beside").closest("label").hidden = methods.length < 2;
    element("time").addEventListener("input", () => { this.pause(); this.seek(Number(element("time").value)); });
    element("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    for (const id of ["edges", "ghost", "tint"]) element(id).addEventListener("change", () => this.draw());
    element("beside").addEventListener("change", () => { this.fit(); this.draw(); });
    element("larger").addEventListener("change", () => {
      this.larger = Number(element("larger").value);
      this.box = boxOf(this.larger);
      this.fit();
      this.seek(this.time);
    });
    addEventListener("keydown", (e) => {
      if (e.key === " " && !/^(BUTTON|SELECT|INPUT)$/.test(e.target.tagName)) { e.preventDefault(); element("play").click(); }
      const step = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
      if (step && e.target.tagName !== "SELECT" && e.target.id !== "time") { this.pause(); this.seek(motion.times[Math.min(frames - 1, Math.max(0, place(this.time)[0] + step))]); }
    });
    this.listen();
    new ResizeObserver(() => this.resize()).observe(element("stage"));
    this.resize();
    this.fit();
  }

  /** Looks across the longest level side. */
  startTurn() {
    const extent = across.map((axis) => dot(axis, add(this.box.high, this.box.low, -1)));
    camera.turn = (extent[0] > extent[1] ? -Math.PI / 2 : 0) + 0.5;
    this.side = cameraAxes().right;
  }

  /** Motion that is too small to see may be drawn larger. */
  offerLarger() {
    const share = motion.most / this.box.size, select = element("larger");
    const factors = [1, 10, 100, 1000, 10000, 100000].filter((f) => f === 1 || (motion.most > 0 && share * f < 0.5 && share < 0.03));
    factors.forEach((f) => select.add(new Option(f === 1 ? "motion to scale" : `motion \u00d7 ${f.toLocaleString("en")}`, f)));
    select.hidden = factors.length < 2;
  }

  shift(track) {
    if (!element("beside").checked || methods.length < 2) return [0, 0, 0];
    const width = 1.08 * dot(this.side.map(Math.abs), add(this.box.high, this.box.low, -1)) + 0.04 * this.box.size;
    const seen = methods.filter((_, g) => tracks.some((t) => t.group === g && t.shown));
    const rank = seen.indexOf(track.method);
    return this.side.map((x) => x * width * (rank - (seen.length - 1) / 2));
  }

  /** Of the box of all motions, where a track's shell is drawn. */
  corners(track) {
    const by = this.shift(track), { low, high } = this.box;
    return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((c) => by[c] + (k >> c & 1 ? high : low)[c]));
  }

  /** Far enough off that the box of every shown track is in view. */
  fit() {
    const { back, right, above } = cameraAxes(), aspect = canvas.width / canvas.height || 1;
    const tall = Math.tan(camera.field / 2) / 1.22, wide = tall * aspect;
    const corners = tracks.filter((t) => t.shown).flatMap((track) => this.corners(track));
    if (!corners.length) return;
    const middle = [0, 1, 2].map((c) => (Math.min(...corners.map((x) => x[c])) + Math.max(...corners.map((x) => x[c]))) / 2);
    camera.target = middle;
    camera.far = Math.max(...corners.map((x) => {
      const d = add(x, middle, -1);
      return dot(d, back) + Math.max(Math.abs(dot(d, right)) / wide, Math.abs(dot(d, above)) / tall);
    }));
  }

  listen() {
    const fingers = new Map();
    let gap = 0;
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("dblclick", () => { this.fit(); this.draw(); });
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); camera.far *= Math.exp(0.0012 * e.deltaY); this.draw(); }, { passive: false });
    canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); gap = 0; });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => { fingers.delete(e.pointerId); gap = 0; });
    canvas.addEventListener("pointermove", (e) => {
      const before = fingers.get(e.pointerId);
      if (!before) return;
      const x = e.clientX - before[0], y = e.clientY - before[1];
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      if (fingers.size > 1) {
        const [a, b] = [...fingers.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (gap) camera.far *= gap / now;
        gap = now;
        this.pan(x / 2, y / 2);
      } else if (e.shiftKey || e.buttons & 6) {
        this.pan(x, y);
      } else {
        camera.turn -= 0.008 * x;
        camera.lift = Math.min(1.55, Math.max(-1.55, camera.lift + 0.008 * y));
      }
      this.draw();
    });
  }

  pan(x, y) {
    const { right, above } = cameraAxes(), unit = (2 * camera.far * Math.tan(camera.field / 2)) / canvas.clientHeight;
    camera.target = add(add(camera.target, right, -x * unit), above, y * unit);
  }

  resize() {
    const dense = Math.min(devicePixelRatio || 1, 2), stage = element("stage");
    const before = canvas.width / canvas.height;
    canvas.width = Math.max(1, Math.round(stage.clientWidth * dense));
    canvas.height = Math.max(1, Math.round(stage.clientHeight * dense));
    if (Math.abs(before - canvas.width / canvas.height) > 0.01) this.fit();
    this.draw();
  }

  seek(time) {
    this.time = time;
    element("time").value = String(time);
    element("clock").textContent = `${time.toFixed(2)} s`;
    for (const track of tracks) setShape(track, time, this.larger);
    for (const solid of solids) if (solid.moves) placeSolid(solid, time);
    this.fresh = true;
    this.draw();
  }

  play() {
    this.playing = true;
    element("play").textContent = "Pause";
    if (this.time >= last - 1e-6) this.seek(0);
    let before = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const next = this.time + (Number(element("speed").value) * (now - before)) / 1000;
      before = now;
      this.seek(next > last ? 0 : next);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    element("play").textContent = "Play";
  }

  draw() {
    const { painter } = this, aspect = canvas.width / canvas.height, { matrix, eye } = cameraMatrix(aspect), axes = cameraAxes();
    const sun = unitOf(add(add(up.map((x) => 1.5 * x), axes.right, -0.75), axes.back, 0.5));
    const level = this.level(), shown = tracks.filter((t) => t.shown);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.933, 0.945, 0.961, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.depthMask(true);
    const common = { camera: matrix, eye, sun, up, level, flatten: 0, tinted: 0, alpha: 1, shift: [0, 0, 0], size: 1, fresh: this.fresh };
    if (camera.lift > 0.02) this.drawGround(common, level, shown);
    this.drawSolids(common, shown);
    for (const track of shown) this.drawTrack(track, common, shown.length > 1 && !element("beside").checked && methods.length > 1);
    this.fresh = false;
    this.drawCompass(axes);
    this.drawLabels(matrix);
    drawCursors(this.time);
  }

  level() {
    return dot(up, this.box.low) - 0.1 * this.box.size;
  }

  /** The lines of the ground: their ends, a round length apart. */
  grid(level) {
    const wish = this.box.size / 6, step = 10 ** Math.floor(Math.log10(wish)), apart = [1, 2, 5, 10].map((f) => f * step).find((v) => v >= wish);
    const reach = 14, at = (a, b) => add(add(up.map((x) => x * level), across[0], a), across[1], b);
    const start = across.map((axis) => apart * Math.round(dot(axis, camera.target) / apart));
    const ends = [];
    for (let k = -reach; k <= reach; k++)
      for (const end of [-reach, reach]) ends.push(...at(start[0] + k * apart, start[1] + end * apart));
    for (let k = -reach; k <= reach; k++)
      for (const end of [-reach, reach]) ends.push(...at(start[0] + end * apart, start[1] + k * apart));
    return { ends: new Float32Array(ends), indices: new Uint32Array(ends.length / 3).map((_, k) => k), apart };
  }

  drawGround(common, level, shown) {
    const middle = add(camera.target, up, level - dot(up, camera.target)), far = 1.6 * camera.far, lines = this.grid(level);
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    const square = new Float32Array(corners.flatMap(([a, b]) => add(add(middle, across[0], a * far), across[1], b * far)));
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    const fading = { ...common, kind: 3, middle, fade: far, fresh: true };
    this.painter.draw("ground", gl.TRIANGLES, square, new Uint32Array([0, 1, 2, 0, 2, 3]), { ...fading, colour: [0.86, 0.885, 0.92], alpha: 1 });
    this.painter.draw("grid", gl.LINES, lines.ends, lines.indices, { ...fading, fade: 14 * lines.apart, colour: [0.62, 0.66, 0.72], alpha: 0.6 });
    gl.enable(gl.STENCIL_TEST);                        // a shadow is dark once, however many layers cast it
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.disable(gl.DEPTH_TEST);
    for (const track of shown)
      this.painter.draw(track.key, gl.TRIANGLES, track.now, shells[track.shell].triangles,
        { ...common, kind: 3, flatten: 1, colour: [0.2, 0.24, 0.32], alpha: 0.28, shift: this.shift(track), middle, fade: far, indexKey: `shell${track.shell}` });
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.STENCIL_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Colliders beside each shell; none where the motion is drawn larger, since nothing would touch them. */
  drawSolids(common, shown) {
    if (this.larger !== 1) return;
    const shifts = [...new Map(shown.map((track) => this.shift(track)).map((shift) => [shift.join(), shift])).values()];
    gl.enable(gl.BLEND);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2, 2);                              // behind the shells that lie on them
    for (const solid of solids) {
      const level = solid.kind === "plane" && shifts.every((shift) => Math.abs(dot(shift, [...solid.turned.slice(0, 3)])) < 1e-6 * this.box.size);
      gl.depthMask(solid.kind !== "plane");
      for (const shift of level ? [[0, 0, 0]] : shifts)         // shells side by side stand on one level plane
        this.painter.draw(solid.key, gl.TRIANGLES, solid.now, solid.triangles, { ...common, shift, kind: 0, colour: SOLID,
          alpha: solid.kind === "plane" ? 0.45 : 1, normals: solid.turned, tints: solid.tint, fresh: common.fresh && solid.moves });
    }
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  drawTrack(track, common, overlaid) {
    const shell = shells[track.shell], shift = this.shift(track), here = { ...common, shift, indexKey: `shell${track.shell}` };
    gl.enable(gl.BLEND);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    this.painter.draw(track.key, gl.TRIANGLES, track.now, shell.triangles, { ...here, kind: 0, colour: rgb(track.colour),
      tinted: element("tint").checked ? 1 : 0, alpha: overlaid ? 0.75 : 1, normals: track.normals, tints: track.tint });
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (element("edges").checked)
      this.painter.draw(track.key, gl.LINES, track.now, shell.edges, { ...here, kind: 1, colour: [0.08, 0.1, 0.14], alpha: 0.16 });
    if (element("ghost").checked)
      this.painter.draw(`rest${track.shell}`, gl.LINES, shell.rest, shell.edges, { ...here, kind: 1, colour: [0.2, 0.24, 0.32], alpha: 0.22, fresh: false });
    const dense = canvas.width / canvas.clientWidth || 1;
    if (shell.held.length && shell.held.length < 2000)
      this.painter.draw(track.key, gl.POINTS, track.now, shell.held, { ...here, kind: 2, colour: HELD, size: 4.5 * dense, fresh: false });
    this.drawHandles(track, here, dense);
    gl.disable(gl.BLEND);
  }

  drawHandles(track, here, dense) {
    const [k, share] = place(this.time);
    for (const handle of motion.handles) {
      if (handle.shell !== track.shell || this.time > (handle.release ?? Infinity)) continue;
      const at = [0, 1, 2].map((c) => {
        const a = handle.path[3 * k + c], b = handle.path[3 * Math.min(k + 1, frames - 1) + c];
        const rest = shells[track.shell].rest[3 * handle.vertex + c];
        return rest + this.larger * (a + share * (b - a) - rest);
      });
      gl.disable(gl.DEPTH_TEST);
      this.painter.draw("handle", gl.POINTS, new Float32Array(at), new Uint32Array([0]), { ...here, kind: 2, colour: BALL, size: 13 * dense, fresh: true, indexKey: "handle" });
      gl.enable(gl.DEPTH_TEST);
    }
  }

  /** The axes, and which way gravity and the wind go. */
  drawCompass(axes) {
    const compass = element("compass"), dense = Math.min(devicePixelRatio || 1, 2), size = compass.clientWidth;
    compass.width = compass.height = size * dense;
    const pen = compass.getContext("2d");
    pen.scale(dense, dense);
    pen.lineCap = "round";
    const middle = size / 2;
    const arrow = (direction, colour, word, reach, width) => {
      const d = unitOf(direction), x = middle + reach * dot(d, axes.right), y = middle - reach * dot(d, axes.above);
      pen.strokeStyle = pen.fillStyle = colour;
      pen.lineWidth = width;
      pen.beginPath(); pen.moveTo(middle, middle); pen.lineTo(x, y); pen.stroke();
      pen.beginPath(); pen.arc(x, y, width * 1.3, 0, 7); pen.fill();
      pen.font = "11px system-ui, sans-serif";
      pen.textAlign = "center"; pen.textBaseline = "middle";
      const out = Math.hypot(x - middle, y - middle) || 1;
      // Beyond the tip, and whole.
      const half = pen.measureText(word).width / 2, away = 7 + 4 + (word.length > 1 ? half * Math.abs(x - middle) / out : 0);
      const at = (tip, way, room) => Math.min(size - room, Math.max(room, tip + (away * way) / out));
      pen.fillText(word, at(x, x - middle, half + 1), at(y, y - middle, 6));
    };
    [["x", "#c8372d"], ["y", "#2f8f4e"], ["z", "#2d62ad"]].forEach(([word, colour], k) => arrow([0, 1, 2].map((c) => (c === k ? 1 : 0)), colour, word, 0.26 * size, 1.6));
    for (const load of motion.loads) if (load.direction) arrow(load.direction, load.colour, load.short, 0.34 * size, 3);
  }

  drawLabels(matrix) {
    const several = methods.length > 1 && element("beside").checked;
    // On a phone every other label is a line or two higher, so that each has the room of two.
    const crowded = methods.length > 2 && element("labels").parentElement.clientWidth < 640;
    element("labels").replaceChildren(...(several ? methods : []).flatMap((method, g) => {
      const track = tracks.find((t) => t.group === g && t.shown);
      if (!track) return [];
      // Above all corners, as one sees them.
      const places = this.corners(track).map((x) => {
        const [across, upward, depth] = [0, 1, 3].map((r) => matrix[r] * x[0] + matrix[4 + r] * x[1] + matrix[8 + r] * x[2] + matrix[12 + r]);
        return [across / depth, upward / depth];
      });
      const across = places.map((place) => place[0]), left = (Math.min(...across) + Math.max(...across)) / 2, top = Math.max(...places.map((place) => place[1]));
      const span = document.createElement("span");
      span.textContent = track.label;
      span.style.color = track.colour;
      const most = (crowded ? 150 : 92) / methods.length;
      span.style.maxWidth = `${most}%`;
      span.style.left = crowded ? `clamp(${most / 2}%, ${50 + 50 * left}%, ${100 - most / 2}%)` : `${50 + 50 * left}%`;
      span.style.top = crowded ? `max(${g % 2 ? 8 : 10.4}rem, calc(${50 - 50 * top}% - ${g % 2 ? 2.8 : 0.4}rem))` : `max(5.5rem, calc(${50 - 50 * top}% - 0.4rem))`;
      if (crowded) span.style.fontSize = "0.72rem";
      return [span];
    }));
  }
}
