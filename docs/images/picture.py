"""Cuts a picture out of a report: picture.py REPORT.html PICTURE.svg [SECTION [PANELS]]

Of `ear evaluate --report`: the trajectory and the position error, one below the other, with the report's own style sheet.
Of `ear experiments`: the first PANELS panels of one section, with a line that says which colour is what.
"""

import re
import sys
from pathlib import Path

MARGIN = 16
SECTIONS = ["Trajectory", "Position error"]


def section(page, title):
    return re.search(rf"<section[^>]*><h2>{title}</h2>.*?</section>", page, re.DOTALL)[0]


def style(page):
    """The report's colours and strokes, without the rules that lay out the page or stretch a drawing to its width."""
    rules = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
    return re.sub(r"^svg \{.*?\}\n", "", rules, flags=re.MULTILINE)


def key(content):
    """The names of the curves in these panels, each in its colour."""
    curves = dict(re.findall(r'<polyline class="curve (\w+)"[^>]*data-name="([^"]*)"', content))
    texts = "".join(f'<tspan class="{colour}" dx="14" style="fill: var(--c)">{name}</tspan>'
                    for colour, name in curves.items())
    return f'<svg x="{MARGIN}" y="{MARGIN}" width="1040" height="20"><text x="30" y="14">{texts}</text></svg>'


def picture(page, titles, panels=None):
    parts = []
    y = MARGIN
    if panels:
        drawn = re.findall(r"<svg.*?</svg>", section(page, titles[0]), re.DOTALL)[:panels]
        parts.append(key("".join(drawn)))
        y += 20
    for title in titles:
        for svg in re.findall(r"<svg.*?</svg>", section(page, title), re.DOTALL)[:panels]:
            width, height = (float(number) for number in re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())
            parts.append(f'<svg x="{MARGIN}" y="{y:g}" width="{width:g}" height="{height:g}"' + svg[len("<svg"):])
            y += height
    size = f"{width + 2 * MARGIN:g} {y + MARGIN:g}"
    font = "svg { font-family: system-ui, sans-serif; overflow: visible; }"
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}"><style>{style(page)}{font}</style>\n'
            '<rect width="100%" height="100%" style="fill: var(--card)"/>\n' + "\n".join(parts) + "\n</svg>\n")


if __name__ == "__main__":
    report, output = map(Path, sys.argv[1:3])
    given = sys.argv[3:4] or SECTIONS
    count = int(sys.argv[4]) if len(sys.argv) > 4 else None
    output.write_text(picture(report.read_text(encoding="utf-8"), given, count), encoding="utf-8")
