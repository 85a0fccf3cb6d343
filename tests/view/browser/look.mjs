// Looks at the view as a person would: look.mjs URL FOLDER SECONDS, of the recording. Screenshots to FOLDER, what was seen as
// JSON to standard output.
import { chromium } from "playwright-core";

const [url, folder, seconds] = process.argv.slice(2);
const SIZES = { wide: [1300, 900], narrow: [400, 800] };
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ["--no-sandbox", "--disable-gpu"] });
const seen = { console: [], requests: [] };

async function open([width, height]) {
  const page = await (await browser.newContext({ viewport: { width, height } })).newPage();
  page.on("console", (message) => {
    if (!message.text().includes("willReadFrequently")) seen.console.push(message.text()); // that is about coloured()
  });
  page.on("pageerror", (error) => seen.console.push(String(error)));
  page.on("request", (request) => seen.requests.push(new URL(request.url()).origin));
  const answer = await page.goto(url);
  seen.bytes = (await answer.body()).length;
  return page;
}

// Pixels of a canvas that have a colour, given as CSS has it.
function coloured(page, canvas, name) {
  return page.evaluate(([id, variable]) => {
    const probe = document.createElement("canvas").getContext("2d");
    probe.fillStyle = colour(variable);
    probe.fillRect(0, 0, 1, 1);
    const [r, g, b] = probe.getImageData(0, 0, 1, 1).data;
    const c = document.getElementById(id);
    const data = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3] > 200 && Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 24) ++count;
    }
    return count;
  }, [canvas, name]);
}

async function read(page) {
  const text = (selector) => page.locator(selector).innerText();
  const state = await page.evaluate(() => Object.fromEntries(Array.from(document.querySelectorAll("#state dt"),
    (term) => [term.textContent, term.nextElementSibling.textContent])));
  return { t: await page.evaluate(() => document.body.dataset.t), state, health: await text("#health"), contact: await text("#contact"),
    features: await text("#features"), sources: await page.locator("#sources tr").count(), events: await text("#events") };
}

// How many features the page shows of each kind, those that ended included: not tested yet, used, refused.
function uses(page) {
  return page.evaluate(() => [0, 1, 2].map((use) => camera.features.filter((feature) => feature[2] % ENDED === use).length));
}

const pages = {};
for (const [name, size] of Object.entries(SIZES)) pages[name] = await open(size);
const shown = () => (document.body.dataset.t ? seconds(model.first, document.body.dataset.t) : 0);
while ((await pages.wide.evaluate(shown)) < Number(seconds)) await pages.wide.waitForTimeout(50);

// By keyboard alone: what can be reached, the pause, the scrub bar.
const { wide, narrow } = pages;
seen.reached = [];
for (let i = 0; i < 8; ++i) {
  await wide.keyboard.press("Tab");
  seen.reached.push(await wide.evaluate(() => document.activeElement.id));
}
await wide.evaluate(() => document.activeElement.blur());
await wide.keyboard.press("Space");
await narrow.locator("#pause").click();
await wide.waitForTimeout(500);
seen.paused = await read(wide);
seen.narrow = await read(narrow);
seen.pixels = {};
for (const canvas of ["above", "perspective"]) {
  seen.pixels[canvas] = {};
  for (const name of ["blue", "red", "truth", "orange", "pink"]) seen.pixels[canvas][name] = await coloured(wide, canvas, name);
}
seen.uses = await uses(wide);
for (const name of ["sky", "yellow"]) seen.pixels[name] = await coloured(wide, "camera", name);
await wide.locator("#tint").click();
await wide.waitForTimeout(200);
seen.pixels.age = await coloured(wide, "camera", "orange");
await wide.locator("#tint").click();
seen.pixels.error = await coloured(wide, "error", "blue");
for (const [name, page] of Object.entries(pages)) await page.screenshot({ path: `${folder}/${name}.png` });
seen.overflow = await narrow.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
await wide.waitForTimeout(400);
seen.still = (await read(wide)).t === seen.paused.t;

// The right image on request.
const left = await wide.locator("#camera").screenshot();
await wide.locator("#side").click();
await wide.waitForTimeout(500);
seen.right = !left.equals(await wide.locator("#camera").screenshot());
seen.pixels.right = await coloured(wide, "camera", "yellow");
await wide.locator("#side").click();

// A part of the picture turns with the mouse.
const before = await wide.locator("#perspective").screenshot();
const box = await wide.locator("#perspective").boundingBox();
await wide.mouse.move(box.x + 50, box.y + 50);
await wide.mouse.down();
await wide.mouse.move(box.x + 150, box.y + 80, { steps: 4 });
await wide.mouse.up();
await wide.waitForTimeout(200);
seen.turned = !before.equals(await wide.locator("#perspective").screenshot());

await wide.locator("#scrub").focus();
for (let i = 0; i < 30; ++i) await wide.keyboard.press("ArrowLeft");
await wide.waitForTimeout(500);
seen.scrubbed = await read(wide);
await wide.locator("#pause").click();
await wide.waitForTimeout(500);
seen.live = await read(wide);
await browser.close();
console.log(JSON.stringify(seen));
