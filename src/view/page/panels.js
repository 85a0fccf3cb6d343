// Everything that is no path: image, figures, charts.
const STAGES = ["pyramid", "track", "detect", "stereo", "reject", "filter"];
const STAGE_COLOURS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"];
const USES = ["sky", "yellow", "red-bright"]; // not tested yet, used, refused: colour and shape
const ENDED = 4;
const camera = { image: null, features: [], n: 0, right: false, byAge: false };

// Of a feature at the origin, so large: a square is not tested yet, a disc was used, a cross was refused.
function mark(context, use, size) {
  context.beginPath();
  if (use === 0) context.rect(-0.9 * size, -0.9 * size, 1.8 * size, 1.8 * size);
  else if (use === 1) context.arc(0, 0, size, 0, 2 * Math.PI);
  else {
    for (const side of [-1, 1]) {
      context.moveTo(-size, -side * size);
      context.lineTo(size, side * size);
    }
  }
}

function element(tag, text, className) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function pairs(list, rows) {
  list.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
}

function drawCamera(moment) {
  const { context, width, height } = prepared($("camera"));
  if (!camera.image || model.about.cameras.length === 0) {
    context.fillStyle = colour("soft");
    context.fillText("no image", 10, 20);
    return;
  }
  const [w, h] = model.about.cameras[camera.right ? 1 : 0];
  const scale = Math.min(width / w, height / h), left = (width - scale * w) / 2, top = (height - scale * h) / 2;
  context.drawImage(camera.image, left, top, scale * w, scale * h);
  for (const [, frames, code, xLeft, yLeft, xRight, yRight] of camera.features) {
    const stereo = xRight !== undefined;
    if (camera.right && !stereo) continue;
    const [x, y] = camera.right ? [xRight, yRight] : [xLeft, yLeft];
    const use = code % ENDED, oldness = frames >= 30 ? 2 : frames >= 5 ? 1 : 0;
    const style = colour(camera.byAge ? ["sky", "orange", "yellow"][oldness] : USES[use]);
    context.save();
    context.translate(left + scale * (x + 0.5), top + scale * (y + 0.5));
    if (code >= ENDED) context.globalAlpha = 0.5;
    mark(context, use, 2 + 0.8 * oldness);
    context.lineWidth = 3;
    context.strokeStyle = "#000b";
    context.stroke();
    context.lineWidth = 1.5;
    context.strokeStyle = style;
    context.stroke();
    context.fillStyle = style;
    if (stereo) context.fill(); // what is hollow is seen by the left camera alone
    context.restore();
  }
  const s = moment.state;
  $("features").textContent = s ? `${s.tracks} features, ${s.stereo} by both cameras; ${s.used} used, ${s.rejected} not` : "";
}

function sigmas(moment) {
  const [xx, xy, yy, zz] = moment.state.cov.map((v) => v * 1e-6);
  return [Math.sqrt((xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy)), Math.sqrt(zz)];
}

function errorOf(m) {
  return m.state && m.truth ? Math.hypot(...m.state.p.map((v, i) => v - m.truth[i])) : null;
}

const metres = (v) => (v === null ? "-" : v < 1 ? `${(100 * v).toFixed(1)} cm` : `${v.toFixed(2)} m`);

function drawError() {
  const { context, width, height } = prepared($("error"));
  const now = model.moments[model.shown];
  const recent = model.moments.slice(0, model.shown + 1).filter((m) => seconds(m.t_ns, now.t_ns) <= 60);
  const curves = [
    { name: "3 sigma, horizontal", style: colour("pink"), dash: [6, 4], of: (m) => (m.state ? 3 * sigmas(m)[0] : null) },
    ...(model.about.truth ? [{ name: "error", style: colour("blue"), dash: [], of: errorOf }] : []),
  ];
  const values = curves.map((curve) => recent.map(curve.of));
  const most = Math.max(0.01, ...values.flat().filter((v) => v !== null)) * 1.1;
  const [left, bottom] = [54, height - 18];
  const x = (m) => left + (width - left - 8) * (1 - seconds(m.t_ns, now.t_ns) / 60);
  const y = (v) => bottom - (bottom - 8) * (v / most);
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "right";
  for (const share of [0, 0.5, 1]) {
    context.strokeStyle = colour("line");
    context.beginPath();
    context.moveTo(left, y(share * most / 1.1));
    context.lineTo(width - 8, y(share * most / 1.1));
    context.stroke();
    context.fillStyle = colour("soft");
    context.fillText(metres(share * most / 1.1), left - 6, y(share * most / 1.1) + 4);
  }
  context.textAlign = "center";
  for (const s of [60, 45, 30, 15, 0]) context.fillText(s ? `-${s} s` : "now", Math.min(width - 16, left + (width - left - 8) * (1 - s / 60)), height - 4);
  curves.forEach((curve, i) => {
    context.strokeStyle = curve.style;
    context.lineWidth = 2;
    context.setLineDash(curve.dash);
    context.beginPath();
    let down = false;
    recent.forEach((m, k) => {
      const v = values[i][k];
      if (v !== null) context[down ? "lineTo" : "moveTo"](x(m), y(v));
      down = v !== null;
    });
    context.stroke();
    context.setLineDash([]);
  });
  context.textAlign = "left";
  const last = (i) => values[i][values[i].length - 1] ?? null;
  $("error-now").textContent = curves.map((c, i) => `${c.dash.length ? "- -" : "\u2014"} ${c.name} ${metres(last(i))}`).join("   ");
}

function showState(m) {
  const text = (v, digits = 3) => v.toFixed(digits);
  if (!m.state) return pairs($("state"), [["quality", `${m.quality} of 100`]]);
  const [horizontal, vertical] = sigmas(m), { p, v } = m.state;
  const heading = rotate(m.state.q, model.about.axle ? model.about.axle.forward : [1, 0, 0]);
  pairs($("state"), [
    ["position x", `${text(p[0])} m`], ["position y", `${text(p[1])} m`], ["position z", `${text(p[2])} m`],
    ["speed", `${text(Math.hypot(...v), 2)} m/s`],
    ["heading", `${text((Math.atan2(heading[1], heading[0]) * 180) / Math.PI, 1)}\u00b0`],
    ["sigma, horizontal", metres(horizontal)], ["sigma, vertical", metres(vertical)],
    ["error", metres(errorOf(m))],
    ["slope along, across", m.state.slope ? m.state.slope.map((s) => text((s * 180) / Math.PI, 1)).join(", ") + "\u00b0" : "-"],
    ["quality", `${m.quality} of 100`],
  ]);
}

function showSources(m) {
  const has = (name) => (name.startsWith("wheel") ? Boolean(model.about.axle) : name.startsWith("beam") ? Number(name.slice(5)) < model.about.beams.length
    : name === "camera_left" ? model.about.cameras.length > 0 : name === "camera_right" ? model.about.cameras.length > 1 : true);
  const rows = model.about.sources.flatMap((name, i) => {
    if (!has(name)) return [];
    const [fit, used, rejected, last, score] = m.sources[i];
    const old = last !== null && last > 1; // a score of long ago, as of wheels in flight
    const row = element("tr", undefined, `${m.faulty.includes(name) ? "faulty" : ""} ${old ? "old" : ""}`.trim());
    const cell = element("td"), gauge = element("span", undefined, `gauge${score < 0.5 ? " over" : ""}`), fill = element("span");
    fill.style.width = `${100 * score}%`;
    gauge.append(fill);
    cell.append(gauge, score.toFixed(2));
    if (fit !== null) cell.title = `last measurement: ${fit.toFixed(2)} of what still fits`;
    row.append(element("td", name.replace("_", " ")), cell, element("td", used, "n"), element("td", rejected, "n"),
      element("td", last === null ? "-" : last.toFixed(1), "n"));
    return [row];
  });
  $("sources").replaceChildren(...rows);
}

function showStreams(m) {
  const before = model.moments[Math.max(0, model.shown - 20)], span = seconds(before.t_ns, m.t_ns);
  const rows = Object.entries(model.about.rates).filter(([, nominal]) => nominal !== null).map(([stream, nominal]) => {
    const [accepted, refused, gaps] = m.counts[stream];
    const row = element("tr");
    const rate = span > 0 ? (accepted - before.counts[stream][0]) / span : null;
    row.append(element("td", stream), element("td", rate === null ? "-" : rate.toFixed(0), "n"),
      element("td", nominal > 0 ? nominal.toFixed(0) : "-", "n"), element("td", refused, "n"), element("td", gaps, "n"));
    return row;
  });
  $("streams").replaceChildren(...rows);
}

function showStages(m) {
  const recent = model.moments.slice(Math.max(0, model.shown - 20), model.shown + 1).filter((one) => one.image);
  const median = (i) => recent.map((one) => one.ms[i]).sort((a, b) => a - b)[Math.floor(recent.length / 2)] || 0;
  const stages = STAGES.map((_, i) => median(i)); // one frame alone says little
  const total = stages.reduce((a, b) => a + b, 0);
  $("load").textContent = `${total.toFixed(1)} ms, median of two seconds; load step ${m.load}`;
  $("bar").replaceChildren(...stages.map((ms, i) => {
    const part = element("span");
    part.style.cssText = `width:${total ? (100 * ms) / total : 0}%;background:${STAGE_COLOURS[i]}`;
    return part;
  }));
  $("stages").replaceChildren(...STAGES.flatMap((name, i) => {
    const term = element("dt"), mark = element("i");
    mark.style.background = STAGE_COLOURS[i];
    term.append(mark, name);
    return [term, element("dd", `${stages[i].toFixed(2)} ms`)];
  }));
}

function showEvents(m) {
  const lines = model.events.filter((event) => event.n <= m.n).slice(-40).reverse();
  $("events").replaceChildren(...lines.map((event) => {
    const line = element("li");
    line.append(element("b", event.t), event.text);
    return line;
  }));
}
