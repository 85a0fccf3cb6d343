// The paths in space. drawn: {truth: [[x, y, z] or null, ...], entries: [{of, points: [[x, y, z, in the air] or null, ...]}],
// moments: [[x, y, z], ...]}; null interrupts a path.
const stage = new Stage(document.getElementById("space"), true, false);

function shown(of) {
  const button = document.querySelector(`.legend button[data-of=${of}]`);
  return !button || button.getAttribute("aria-pressed") === "true";
}

// Whole on the ground, dashed in the air.
function drawPath(points, style) {
  let piece = [], flying = false;
  const flush = () => { if (piece.length > 1) stage.line(piece, style, 2, flying ? [6, 4] : []); };
  for (const p of points) {
    if (!p) { flush(); piece = []; continue; }
    if (piece.length && Boolean(p[3]) !== flying) { flush(); piece = piece.slice(-1); }
    flying = Boolean(p[3]);
    piece.push(p);
  }
  flush();
}

function drawSpace() {
  Object.assign(stage, prepared(stage.canvas));
  if (stage.width < 10) return;
  stage.frame([drawn.truth, ...drawn.entries.map((entry) => entry.points)].flat().filter(Boolean));
  stage.grid();
  if (shown("truth")) {
    stage.context.globalAlpha = 0.3;
    let piece = [];
    for (const p of [...drawn.truth, null]) {
      if (p) piece.push(p);
      else { stage.line(piece, colour("truth"), 5); piece = []; }
    }
    stage.context.globalAlpha = 1;
  }
  for (const { of, points } of drawn.entries) {
    if (!shown(of)) continue;
    drawPath(points, colour(of));
    const places = points.filter(Boolean);
    stage.dot(places[0], colour(of), 5);
  }
  stage.context.font = "600 12px system-ui, sans-serif";
  drawn.moments.forEach((p, i) => {
    const at = stage.project(p);
    if (!at) return;
    stage.line([p, [p[0], p[1], stage.floor]], colour("soft"), 1, [2, 3]);
    stage.dot(p, colour("ink"), 3);
    stage.context.fillText(String(i + 1), at[0] + 6, at[1] - 6);
  });
}

let drawing = false;
function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => { drawing = false; drawSpace(); });
}
document.querySelectorAll(".legend button").forEach((button) => button.addEventListener("click", redraw));
window.addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
window.addEventListener("beforeprint", drawSpace);
redraw();
