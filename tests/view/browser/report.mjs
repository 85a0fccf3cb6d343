// Looks at a report of `ear evaluate`: report.mjs FILE FOLDER. A screenshot to FOLDER, what was seen as JSON to standard output.
import { chromium } from "playwright-core";

const [file, folder] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ["--no-sandbox", "--disable-gpu"] });
const page = await (await browser.newContext({ viewport: { width: 1100, height: 900 } })).newPage();
const seen = { console: [], requests: [] };
page.on("console", (message) => seen.console.push(message.text()));
page.on("pageerror", (error) => seen.console.push(String(error)));
page.on("request", (request) => seen.requests.push(request.url().split(":")[0]));
await page.goto(`file://${file}`);

const space = page.locator("#space");
await space.scrollIntoViewIfNeeded();
// The picture, after `act` and the frame that follows.
async function after(act) {
  await act();
  await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
  return (await space.screenshot()).toString("base64");
}
const box = await space.boundingBox();
const begin = await after(async () => {});
await page.screenshot({ path: `${folder}/report.png` });
const dragged = await after(async () => {
  await page.mouse.move(box.x + 300, box.y + 100);
  await page.mouse.down();
  await page.mouse.move(box.x + 420, box.y + 130, { steps: 3 });
  await page.mouse.up();
});
await space.focus();
const keyed = await after(() => page.keyboard.press("ArrowLeft"));
const zoomed = await after(() => page.keyboard.press("+"));
const hidden = await after(() => page.locator(".legend button.truth").click());
await page.locator(".legend button.truth").click();
await space.focus();
await page.keyboard.press("Home");
await space.evaluate((canvas) => canvas.blur());
seen.turned = [dragged !== begin, keyed !== dragged, zoomed !== keyed, hidden !== zoomed];
seen.back = (await after(async () => {})) === begin;
seen.images = await page.evaluate(() => Array.from(document.querySelectorAll(".film img"), (image) => image.naturalWidth));
seen.overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
await browser.close();
console.log(JSON.stringify(seen));
