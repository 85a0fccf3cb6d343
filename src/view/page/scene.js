// The path with vehicle, ground, beams and truth: from above, or in perspective. One drawing, two cameras.
function rotate([w, x, y, z], [a, b, c]) {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
}
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

class Scene extends Stage {
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
