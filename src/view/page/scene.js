// The path with vehicle, ground, beams and truth: from above, or in perspective. One drawing, two cameras.
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

function rotate([w, x, y, z], [a, b, c]) {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
}
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

class Scene {
  constructor(canvas, perspective) {
    this.canvas = canvas;
    this.perspective = perspective;
    this.reset();
    this.listen();
  }

  reset() {
    Object.assign(this, { yaw: -2.2, pitch: 0.55, zoom: 1, move: [0, 0] });
  }

  listen() {
    const { canvas } = this;
    let last = null;
    const drag = (dx, dy) => {
      if (this.perspective) {
        this.yaw -= dx * 0.01;
        this.pitch = Math.min(1.5, Math.max(0.05, this.pitch + dy * 0.01));
      } else {
        this.move = [this.move[0] + dx, this.move[1] + dy];
      }
      redraw();
    };
    const zoom = (factor) => { this.zoom = Math.min(30, Math.max(0.1, this.zoom * factor)); redraw(); };
    canvas.addEventListener("pointerdown", (e) => { last = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener("pointermove", (e) => {
      if (!last) return;
      drag(e.clientX - last[0], e.clientY - last[1]);
      last = [e.clientX, e.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-e.deltaY * 0.001)); }, { passive: false });
    const keys = { ArrowLeft: [-15, 0], ArrowRight: [15, 0], ArrowUp: [0, -15], ArrowDown: [0, 15] };
    canvas.addEventListener("keydown", (e) => {
      if (keys[e.key]) drag(...keys[e.key]);
      else if (e.key === "+" || e.key === "=") zoom(1.2);
      else if (e.key === "-") zoom(1 / 1.2);
      else if (e.key === "Home") { this.reset(); redraw(); }
      else return;
      e.preventDefault();
    });
  }

  // Middle and size of what is to be seen.
  frame(points) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const p of points) {
      for (let i = 0; i < 3; ++i) { low[i] = Math.min(low[i], p[i]); high[i] = Math.max(high[i], p[i]); }
    }
    this.middle = low.map((value, i) => (value + high[i]) / 2);
    this.extent = [Math.max(1, high[0] - low[0]), Math.max(1, high[1] - low[1])];
    this.floor = low[2];
  }

  // World to pixels; null for what is behind the camera.
  project(p) {
    const [x, y, z] = [p[0] - this.middle[0], p[1] - this.middle[1], p[2] - this.middle[2]];
    if (!this.perspective) {
      const scale = this.zoom * Math.min((this.width - 70) / this.extent[0], (this.height - 70) / this.extent[1]);
      this.scale = scale;
      return [this.width / 2 + this.move[0] + scale * x, this.height / 2 + this.move[1] - scale * y];
    }
    const size = Math.hypot(...this.extent);
    const distance = (1.4 * size) / this.zoom;
    const [s, c] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [a, b] = [c * x + s * y, -s * x + c * y]; // b to the right, a away from the eye is negative
    const [sp, cp] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    const depth = distance - (cp * a + sp * z);
    if (depth < 0.05 * distance) return null;
    const scale = (1.1 * Math.min(this.width, 1.4 * this.height)) / depth;
    return [this.width / 2 + scale * b, this.height / 2 - scale * (cp * z - sp * a)];
  }

  line(points, style, width, dash = []) {
    const c = this.context;
    c.strokeStyle = style;
    c.lineWidth = width;
    c.setLineDash(dash);
    c.beginPath();
    let down = false;
    for (const p of points) {
      const at = this.project(p);
      if (at && down) c.lineTo(...at);
      else if (at) c.moveTo(...at);
      down = Boolean(at);
    }
    c.stroke();
    c.setLineDash([]);
  }

  dot(p, style, radius) {
    const at = this.project(p);
    if (!at) return;
    this.context.fillStyle = style;
    this.context.beginPath();
    this.context.arc(...at, radius, 0, 2 * Math.PI);
    this.context.fill();
  }

  grid() {
    const reach = 0.75 * Math.max(...this.extent);
    const step = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 500].find((s) => reach / s <= 8) || 1000;
    const begin = (i) => Math.floor((this.middle[i] - reach) / step) * step;
    const end = (i) => this.middle[i] + reach;
    const style = colour("line");
    for (let x = begin(0); x <= end(0); x += step) this.line([[x, begin(1), this.floor], [x, end(1), this.floor]], style, 1);
    for (let y = begin(1); y <= end(1); y += step) this.line([[begin(0), y, this.floor], [end(0), y, this.floor]], style, 1);
    this.context.fillStyle = colour("soft");
    this.context.font = "12px system-ui, sans-serif";
    this.context.fillText(`grid ${step} m`, 8, this.height - 8);
  }

  paths(upTo) {
    const old = model.oldPath;
    if (model.about.truth) {
      const truth = [...old.filter((p) => p.length > 3).map((p) => p.slice(3)), ...upTo.filter((m) => m.truth).map((m) => m.truth)];
      this.line(truth, colour("truth"), 5);
    }
    this.line(old.map((p) => p.slice(0, 3)), colour("blue"), 2);
    let piece = [], flying = null;
    const flush = () => { if (piece.length > 1) this.line(piece, colour(flying ? "red" : "blue"), 2, flying ? [6, 4] : []); };
    for (const m of upTo) {
      if (!m.state) { flush(); piece = []; flying = null; continue; }
      const free = Boolean(model.about.axle) && m.state.mode === "free";
      if (flying !== null && free !== flying) { flush(); piece = piece.slice(-1); }
      flying = free;
      piece.push(m.state.p);
    }
    flush();
  }

  ellipse(state) {
    const [xx, xy, yy] = state.cov.map((v) => v * 1e-6);
    const mean = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy), turn = Math.atan2(2 * xy, xx - yy) / 2;
    const radii = [Math.sqrt(Math.max(0, mean + spread)), Math.sqrt(Math.max(0, mean - spread))].map((s) => 3 * s);
    this.grow = radii[0] > 0 ? Math.max(1, 10 ** Math.ceil(Math.log10((0.02 * Math.max(...this.extent)) / radii[0]))) : 1;
    const points = [];
    for (let i = 0; i <= 40; ++i) {
      const [a, b] = [this.grow * radii[0] * Math.cos((i * Math.PI) / 20), this.grow * radii[1] * Math.sin((i * Math.PI) / 20)];
      points.push(plus(state.p, [a * Math.cos(turn) - b * Math.sin(turn), a * Math.sin(turn) + b * Math.cos(turn), 0]));
    }
    this.line(points, colour("pink"), 2);
  }

  vehicle(moment) {
    const { p, q } = moment.state, { axle } = model.about;
    model.about.beams.forEach((beam, i) => {
      const range = moment.ranges[i];
      if (range === null || range === undefined) return;
      const from = plus(p, rotate(q, beam.p)), hit = plus(from, rotate(q, beam.d), range);
      this.line([from, hit], colour("orange"), 2);
      this.dot(hit, colour("orange"), 3.5);
    });
    const forward = rotate(q, axle ? axle.forward : [1, 0, 0]);
    const long = 0.045 * Math.max(...this.extent);
    if (axle) {
      const middle = plus(p, rotate(q, axle.p)), left = rotate(q, axle.left), up = rotate(q, axle.up);
      for (const side of [-0.5, 0.5]) {
        const hub = plus(middle, left, side * axle.width), rim = [];
        for (let i = 0; i <= 24; ++i) {
          const [a, b] = [axle.radius * Math.cos((i * Math.PI) / 12), axle.radius * Math.sin((i * Math.PI) / 12)];
          rim.push(plus(plus(hub, forward, a), up, b));
        }
        this.line(rim, colour("ink"), 2);
      }
      this.line([plus(middle, left, -0.5 * axle.width), plus(middle, left, 0.5 * axle.width)], colour("ink"), 2);
    }
    this.line([p, plus(p, forward, long)], colour("ink"), 3);
    this.line([p, [p[0], p[1], this.floor]], colour("soft"), 1, [2, 3]);
    this.dot(p, colour("ink"), 5);
  }

  draw() {
    Object.assign(this, prepared(this.canvas));
    if (model.shown < 0 || this.width < 10) return;
    const upTo = model.moments.slice(0, model.shown + 1);
    const points = [...model.oldPath, ...upTo.filter((m) => m.state).map((m) => m.state.p)];
    if (points.length === 0) return;
    this.frame(points);
    this.grid();
    this.paths(upTo);
    const moment = upTo[upTo.length - 1];
    if (!moment.state) return;
    this.ellipse(moment.state);
    this.vehicle(moment);
  }
}
