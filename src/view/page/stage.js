// Lines and dots in space on a canvas, from above or in perspective, moved and turned by mouse, finger and keys. The view and
// the report of `ear evaluate` share it. Whoever uses it has redraw().
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

class Stage {
  // `wheel`: it zooms, where the page has no need to scroll.
  constructor(canvas, perspective, wheel = true) {
    this.canvas = canvas;
    this.perspective = perspective;
    this.reset();
    this.listen(wheel);
  }

  reset() {
    Object.assign(this, { yaw: -2.2, pitch: 0.55, zoom: 1, move: [0, 0] });
  }

  listen(wheel) {
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
    if (wheel) canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-e.deltaY * 0.001)); }, { passive: false });
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
}
