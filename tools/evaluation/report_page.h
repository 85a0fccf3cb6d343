// The fixed parts of the report: style sheet and script.
#pragma once

namespace ear::evaluation {

// Colours of the estimates: Okabe and Ito's set, told apart by colour-blind readers; brighter on a dark page.
inline constexpr const char* kReportStyle = R"css(
:root {
  color-scheme: light dark;
  --page: #f6f7f9; --card: #ffffff; --ink: #1c2128; --soft: #5b6570; --rule: #dfe3e8; --line: var(--rule); --grid: #eceff2; --good: #e6f4ec;
  --truth: #1c2128; --consistent: #009e7322;
  --e0: #0072b2; --e1: #d55e00; --e2: #009e73; --e3: #b1579a; --e4: #b07800; --e5: #2f9fd8; --e6: #8a6d3b; --e7: #6b6f9c;
  --s0: #bfd9ec; --s1: #f7d9a8; --s2: #bfe3d5; --s3: #ecc7dc; --s4: #f4efb0; --s5: #d3d3ea; --s6: #f2c1b0; --s7: #d9dde1;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #14171b; --card: #1c2026; --ink: #e6e9ed; --soft: #9aa4af; --rule: #343b44; --grid: #282e36; --good: #1d3a30;
    --truth: #e6e9ed; --consistent: #2fbf9426;
    --e0: #4da3ff; --e1: #ff8a4c; --e2: #2fc79a; --e3: #e08bc8; --e4: #f0b429; --e5: #7fd0f7; --e6: #c9a66b; --e7: #a5a9dc;
    --s0: #2b4a63; --s1: #66491b; --s2: #23503f; --s3: #5b3450; --s4: #57531d; --s5: #3b3b63; --s6: #653529; --s7: #434a52;
  }
}
* { box-sizing: border-box; }
body { margin: 0; padding: 28px 20px 60px; background: var(--page); color: var(--ink);
       font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
main { max-width: 1080px; margin: 0 auto; }
h1 { font-size: 24px; line-height: 1.25; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 17px; margin: 0 0 2px; }
p { margin: 0 0 10px; color: var(--soft); max-width: 78ch; }
section { background: var(--card); border: 1px solid var(--rule); border-radius: 10px; padding: 18px 20px; margin: 16px 0; }
.legend { display: flex; flex-wrap: wrap; gap: 8px; position: sticky; top: 0; z-index: 2; padding: 10px 0;
          background: var(--page); }
.legend button { font: inherit; color: inherit; background: var(--card); border: 1px solid var(--rule);
                 border-radius: 999px; padding: 3px 12px 3px 10px; cursor: pointer; }
.legend button[aria-pressed=false] { opacity: 0.4; text-decoration: line-through; }
.legend i { display: inline-block; width: 18px; height: 4px; border-radius: 2px; margin-right: 8px;
            vertical-align: middle; background: var(--c); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; min-width: 50%; }
th, td { padding: 4px 14px 4px 0; text-align: right; border-bottom: 1px solid var(--grid); white-space: nowrap; }
th:first-child { text-align: left; font-weight: 400; color: var(--soft); white-space: pre; padding-right: 28px; }
thead th { font-weight: 600; border-bottom: 2px solid var(--c, var(--rule)); }
td.best { background: var(--good); font-weight: 600; }
td, thead th { padding-left: 14px; }
ul.notes { margin: 12px 0 0; padding-left: 18px; color: var(--soft); font-size: 14px; }
svg { display: block; width: 100%; height: auto; overflow: visible; }
svg text { fill: var(--soft); font-size: 11.5px; }
svg text.label { fill: var(--ink); font-size: 12.5px; }
svg text.inside { fill: var(--ink); }
svg.strip text.end { fill: var(--c); font-weight: 600; }
.middle { text-anchor: middle; } .end { text-anchor: end; }
.frame { fill: none; stroke: var(--rule); } .grid { stroke: var(--grid); } .grid.zero { stroke: var(--soft); opacity: 0.6; }
.curve { fill: none; stroke: var(--c); stroke-width: 1.5; stroke-linejoin: round; }
.curve.truth { stroke-width: 5; opacity: 0.22; stroke-linecap: round; }
.band { fill: var(--c); fill-opacity: 0.11; stroke: var(--c); stroke-opacity: 0.35; stroke-width: 0.8; } .shaded { fill: var(--consistent); }
circle.start { fill: var(--card); stroke: var(--c); stroke-width: 2; } rect.end { fill: var(--c); }
.cursor { stroke: var(--soft); stroke-dasharray: 3 3; visibility: hidden; }
.s0 { fill: var(--s0); } .s1 { fill: var(--s1); } .s2 { fill: var(--s2); } .s3 { fill: var(--s3); }
.s4 { fill: var(--s4); } .s5 { fill: var(--s5); } .s6 { fill: var(--s6); } .s7 { fill: var(--s7); }
.truth { --c: var(--truth); }
.e0 { --c: var(--e0); } .e1 { --c: var(--e1); } .e2 { --c: var(--e2); } .e3 { --c: var(--e3); }
.e4 { --c: var(--e4); } .e5 { --c: var(--e5); } .e6 { --c: var(--e6); } .e7 { --c: var(--e7); }
.hidden { display: none; }
#space { display: block; width: 100%; height: 420px; touch-action: pan-y; cursor: grab; }
#space:focus-visible { outline: 3px solid var(--e0); outline-offset: 2px; }
ol.film { list-style: none; counter-reset: film; display: grid; gap: 12px; padding: 0; margin: 0;
          grid-template-columns: repeat(auto-fill, minmax(200px, 1fr)); }
ol.film li { counter-increment: film; font-size: 13px; overflow-wrap: anywhere; }
ol.film li::before { content: counter(film); font-weight: 600; margin-right: 6px; }
ol.film img { display: block; width: 100%; border-radius: 4px; margin-bottom: 4px; }
#readout { position: fixed; pointer-events: none; visibility: hidden; background: var(--card); color: var(--ink);
           border: 1px solid var(--rule); border-radius: 6px; padding: 5px 9px; font-size: 13px; z-index: 3;
           font-variant-numeric: tabular-nums; box-shadow: 0 2px 8px #0003; white-space: pre; }
@media print { .legend { position: static; } section { break-inside: avoid; } }
)css";

// The legend hides and shows estimates; over a plot, the pointer reads the values of all curves. Without scripts the
// page loses only these two.
inline constexpr const char* kReportScript = R"js(
document.querySelectorAll('.legend button').forEach(button => button.addEventListener('click', () => {
  const show = button.getAttribute('aria-pressed') === 'false';
  button.setAttribute('aria-pressed', show);
  document.querySelectorAll('svg .' + button.dataset.of + ', svg.' + button.dataset.of)
    .forEach(part => part.classList.toggle('hidden', !show));
}));

const readout = document.getElementById('readout');
const numbers = (svg, name) => svg.dataset[name].split(' ').map(Number);

// y of the curve's point nearest to pixel column x, or nothing where the curve has a gap.
function yAt(polyline, x) {
  const points = polyline.points;
  let low = 0, high = points.numberOfItems - 1;
  if (high < 0 || x < points.getItem(0).x - 2 || x > points.getItem(high).x + 2) return null;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points.getItem(middle).x < x) low = middle; else high = middle;
  }
  const a = points.getItem(low), b = points.getItem(high);
  return x - a.x < b.x - x ? a.y : b.y;
}

document.querySelectorAll('svg.readable').forEach(svg => {
  const [left, right, top, bottom] = numbers(svg, 'box');
  const [x0, x1] = numbers(svg, 'x'), [y0, y1] = numbers(svg, 'y');
  const group = svg.closest('section').querySelectorAll('svg.readable .cursor');
  svg.addEventListener('pointermove', event => {
    const box = svg.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * svg.viewBox.baseVal.width;
    if (x < left || x > right) return leave();
    const lines = [svg.closest('section').dataset.axis + ' ' + (x0 + (x - left) / (right - left) * (x1 - x0)).toFixed(2)];
    svg.querySelectorAll('polyline:not(.hidden)').forEach(curve => {
      const y = yAt(curve, x);
      if (y === null) return;
      const value = y0 + (bottom - y) / (bottom - top) * (y1 - y0);
      lines.push(curve.dataset.name + '  ' + (svg.dataset.log ? 10 ** value : value).toPrecision(3));
    });
    group.forEach(cursor => {
      cursor.setAttribute('x1', x); cursor.setAttribute('x2', x); cursor.style.visibility = 'visible';
    });
    readout.textContent = lines.join('\n');
    readout.style.visibility = 'visible';
    readout.style.left = Math.min(event.clientX + 14, innerWidth - readout.offsetWidth - 8) + 'px';
    readout.style.top = Math.min(event.clientY + 14, innerHeight - readout.offsetHeight - 8) + 'px';
  });
  const leave = () => {
    readout.style.visibility = 'hidden';
    group.forEach(cursor => { cursor.style.visibility = 'hidden'; });
  };
  svg.addEventListener('pointerleave', leave);
});
)js";

}  // namespace ear::evaluation
