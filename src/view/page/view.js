// Asks for what is new ten times a second and draws it; pause, scrub bar, keys.
const scenes = [new Scene($("above"), false), new Scene($("perspective"), true)];
let drawing = false;

function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => { drawing = false; draw(); });
}

function draw() {
  const m = model.moments[model.shown];
  if (!m || !model.about) return;
  for (const scene of scenes) scene.draw();
  drawCamera(m);
  drawError();
  showState(m);
  showSources(m);
  showStreams(m);
  showStages(m);
  showEvents(m);
  $("health").textContent = m.health;
  $("health").className = `health ${m.status}`;
  $("clock").textContent = `${elapsed(m)}   t = ${m.t_ns} ns`;
  document.body.dataset.n = m.n;
  document.body.dataset.t = m.t_ns;
  const mode = m.state ? m.state.mode : "";
  const words = { standing: "standing", rolling: "on the ground", free: model.about.axle ? "in the air" : "" };
  $("contact").textContent = words[mode] || "";
  $("contact").className = `tag ${mode}`;
  $("contact").hidden = !words[mode];
  const grow = scenes[0].grow || 1;
  $("ellipse-scale").textContent = grow > 1 ? `(drawn ${grow} times as large)` : "";
  $("scrub").max = model.moments.length - 1;
  $("scrub").value = model.shown;
  const back = age(m);
  $("when").textContent = model.paused ? `${back.toFixed(1)} s ago` : model.ended ? "ended" : "live";
}

// Image and features of the moment that is shown, one request of each at a time.
let fetching = false;
async function showImage() {
  const m = model.moments[model.shown];
  if (fetching || !m || m.n === camera.n || !m.image) return;
  fetching = true;
  try {
    const [image, features] = await Promise.all([ask("image", { n: m.n, ...(camera.right && { camera: "right" }) }), ask("features", { n: m.n })]);
    const right = camera.right;
    const shown = { image: await createImageBitmap(await image.blob()), features: await features.json(), n: m.n };
    if (right !== camera.right) return; // another one was asked for meanwhile: it is fetched next
    if (camera.image) camera.image.close();
    Object.assign(camera, shown);
    redraw();
  } catch (error) {
    camera.n = m.n; // it is gone by now: the next one will do
  } finally {
    fetching = false;
  }
}

const sleep = (ms) => new Promise((done) => { setTimeout(done, ms); });

async function begin() {
  model.about = await (await ask("about")).json();
  $("title").textContent = model.about.title;
  document.title = `${model.about.title} - ear`;
  $("side").hidden = model.about.cameras.length < 2;
  $("truth-key").hidden = !model.about.truth;
  const path = await (await ask("path")).json();
  const first = (await (await ask("moments", { n: 0 })).json()).moments[0];
  if (first && first.n > 1) model.oldPath = path.slice(0, -3000);
}

async function follow() {
  while (true) {
    try {
      if (!model.about) await begin();
      const last = model.moments.length ? model.moments[model.moments.length - 1].n : 0;
      const answer = await (await ask("moments", { n: last })).json();
      model.ended = answer.ended;
      take(answer);
      $("link").textContent = `${answer.viewers} of 8 viewers` + (answer.refused ? `; ${answer.refused} requests refused` : "");
      if (answer.moments.length) redraw();
      showImage();
      if (answer.moments.length < 100) await sleep(model.ended ? 1000 : 100);
    } catch (error) {
      $("link").textContent = model.ended ? "ended; what was loaded stays" : `no connection: ${error.message}`;
      await sleep(model.ended ? 5000 : 1000);
    }
  }
}

function pause(on) {
  model.paused = on;
  if (!on) model.shown = model.moments.length - 1;
  $("pause").setAttribute("aria-pressed", on);
  $("pause").textContent = on ? "Go on" : "Pause";
  redraw();
  showImage();
}

$("pause").addEventListener("click", () => pause(!model.paused));
$("scrub").addEventListener("input", () => {
  model.shown = Number($("scrub").value);
  if (!model.paused) pause(true);
  model.shown = Number($("scrub").value);
  redraw();
  showImage();
});
document.addEventListener("keydown", (e) => {
  if (e.key === " " && !["BUTTON", "INPUT"].includes(document.activeElement.tagName)) {
    e.preventDefault();
    pause(!model.paused);
  }
});
$("side").addEventListener("click", () => {
  camera.right = !camera.right;
  camera.n = 0;
  $("side").setAttribute("aria-pressed", camera.right);
  $("which").textContent = camera.right ? "Right camera" : "Left camera";
  showImage();
});
$("tint").addEventListener("click", () => {
  camera.byAge = !camera.byAge;
  $("tint").setAttribute("aria-pressed", camera.byAge);
  $("use-key").hidden = camera.byAge;
  $("age-key").hidden = !camera.byAge;
  redraw();
});
window.addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
follow();
