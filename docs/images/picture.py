"""Cuts the picture of README.md out of a report: picture.py REPORT.html PICTURE.svg

The trajectory and the position error, one below the other, with the report's own style sheet.
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


def picture(page):
    parts = []
    y = MARGIN
    for title in SECTIONS:
        for svg in re.findall(r"<svg.*?</svg>", section(page, title), re.DOTALL):
            width, height = (float(number) for number in re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())
            parts.append(f'<svg x="{MARGIN}" y="{y:g}" width="{width:g}" height="{height:g}"' + svg[len("<svg"):])
            y += height
    size = f"{width + 2 * MARGIN:g} {y + MARGIN:g}"
    font = "svg { font-family: system-ui, sans-serif; overflow: visible; }"
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}"><style>{style(page)}{font}</style>\n'
            '<rect width="100%" height="100%" style="fill: var(--card)"/>\n' + "\n".join(parts) + "\n</svg>\n")


if __name__ == "__main__":
    report, output = map(Path, sys.argv[1:])
    output.write_text(picture(report.read_text(encoding="utf-8")), encoding="utf-8")
