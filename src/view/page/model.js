// What the page knows: the moments of the last five minutes, and which one is shown.
const MOST_MOMENTS = 3000;
const $ = (id) => document.getElementById(id);
const query = new URLSearchParams(location.search);
const viewer = Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => (b % 36).toString(36)).join("");

const model = {
  about: null,
  moments: [], // summaries, oldest first
  oldPath: [], // of the time before: [x, y, z] or with the truth behind
  shown: -1, // index of the moment that is shown
  paused: false,
  events: [],
  ended: false,
};

function address(path, parameters = {}) {
  const all = new URLSearchParams({ viewer, ...parameters });
  if (query.has("token")) all.set("token", query.get("token"));
  return `${path}?${all}`;
}

async function ask(path, parameters) {
  const answer = await fetch(address(path, parameters), { cache: "no-store" });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer;
}

const seconds = (from, to) => Number(BigInt(to) - BigInt(from)) / 1e9;
const age = (moment) => seconds(moment.t_ns, model.moments[model.moments.length - 1].t_ns);

function elapsed(moment) {
  const s = Math.max(0, seconds(model.first, moment.t_ns));
  return `${Math.floor(s / 60)}:${(s % 60).toFixed(1).padStart(4, "0")}`;
}

// What is worth a line: changes of the health, gaps, refusals. Derived from one summary to the next.
function noteEvents(before, now) {
  const add = (text) => model.events.push({ t: elapsed(now), n: now.n, text });
  if (!before || before.health !== now.health) add(now.health);
  if (!before) return;
  for (const stream of ["imu", "camera", "encoder", "laser"]) {
    const [, refused, gaps] = now.counts[stream];
    const [, refusedBefore, gapsBefore] = before.counts[stream];
    if (gaps > gapsBefore) add(`${stream}: gap (${gaps} so far)`);
    if (refused > refusedBefore) add(`${stream}: ${refused - refusedBefore} refused (${refused} so far)`);
  }
  if (now.counts.spikes > before.counts.spikes) add(`imu: spike (${now.counts.spikes} so far)`);
  if (now.counts.jumps > before.counts.jumps) add(`clock jump (${now.counts.jumps} so far)`);
  if (now.load !== before.load) add(`load step ${now.load}`);
  if (now.resets !== before.resets) add("the pose goes on with a jump");
  if (model.events.length > 500) model.events.splice(0, model.events.length - 500);
}

function take(answer) {
  for (const moment of answer.moments) {
    if (model.first === undefined) model.first = moment.t_ns;
    noteEvents(model.moments[model.moments.length - 1], moment);
    model.moments.push(moment);
  }
  const tooMany = model.moments.length - MOST_MOMENTS;
  if (tooMany > 0) {
    const gone = model.moments.splice(0, tooMany);
    for (const m of gone) if (m.state) model.oldPath.push([...m.state.p, ...(m.truth || [])]);
    if (model.oldPath.length > 8000) model.oldPath = model.oldPath.filter((_, i) => i % 2 === 0);
    model.shown = Math.max(0, model.shown - tooMany);
  }
  if (!model.paused) model.shown = model.moments.length - 1;
}
